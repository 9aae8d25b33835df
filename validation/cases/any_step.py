"""Error of a bounce over the engine's step, and over the processor time of the law's substeps."""

from functools import partial
from typing import Any

import numpy as np

from contactlaw import ContactPair
from contactlaw.laws.microslip import NODES, Microslip
from validation import ball
from validation.ball import FRICTION, INCIDENCES, INTEGRATORS, MASS, RESTITUTION, SUBSTEPS, TANGENTIAL_MASS
from validation.case import Axes, Case, Data, Limit, Outcome
from validation.front import largest, rms
from validation.impacts import judge
from validation.measure import interleaved, spread
from validation.picture import STYLES, limit_line, plain_ticks
from validation.reference import turning_data

ASKED = 5e-4
GROWN = 3e-3  # of the energy, that an impact of few substeps may gain
RESTITUTIONS = [1.0, RESTITUTION, 0.5]
LONG = 2e-3  # [s], MuJoCo's own step
STEPS = {"mujoco": [1.0 / 240.0, LONG, 1e-3, 1e-4, 1e-5, 1e-6],
         "pybullet": [1.0 / 240.0, 1e-3, 1e-4, 1e-5, 1e-6]}  # [s]  # fmt: skip
RESOLVED = (50, 100, 200, 400)
"""Steps a contact."""
COUNTS = [25, 50, 100, 200, 400]  # substeps a contact
TWIRL = 20.0  # [rad/s] about the normal; 0.004 rad in a contact
OF_SPIN = 1e-2  # in psi_2, asked of what such a spin makes of it
FEW_BELOW = 2e-5  # [s]: such steps resolve the contact, and a tenth of the phases will do


class AnyStep(Case):
    """The engine's step does not matter. Whether a contact of some 180 us falls between two steps of 4 ms or is
    resolved by hundreds of them, and wherever in a step the bodies touch, the rebound stays within 0.0005 of the
    converged solution with the default substeps; more substeps reduce the error. At 50 to 400 engine steps per contact
    both engines give the same results, and the remaining error is that of the nodes.
    """

    place = 41
    title = "Any engine step"
    sheet = {"columns": 2}
    caption = (
        f"Error in psi_2 of a steel ball's bounce, for {len(INCIDENCES)} incidences from {INCIDENCES[0]:g} to "
        f"{INCIDENCES[-1]:g} and many positions of the first contact within the step. Left: over the engine's step, "
        f"{SUBSTEPS} substeps; open symbols: PyBullet. Right: at a step of {1e3 * LONG:g} ms in MuJoCo, over the "
        "processor time of the impact; numbers: substeps."
    )

    def run(self, quick: bool) -> Outcome:
        psi_1 = INCIDENCES[::3] if quick else INCIDENCES
        phases = 12 if quick else 100
        data: Data = {"psi_1": psi_1, "steps": STEPS, "error": {}, "substeps": COUNTS, "in_substeps": {},
                      "integrators": {}, "twirl": {}, "resolved": {}, "uncertainty": 0.0}  # fmt: skip
        problems: list[str] = []

        def errors(
            engine: str, dt: float, pair: ContactPair, *, twirl: float = 0.0, grown: float = 0.3 * GROWN, **tuning: Any
        ) -> np.ndarray:
            """Of psi_2, shape (incidences, phases)."""
            chi, e = pair.chi(MASS, TANGENTIAL_MASS), pair.restitution
            truth = judge([(psi, chi, e) for psi in psi_1])
            data["uncertainty"] = max(data["uncertainty"], float(truth.uncertainty.max()))
            count = max(phases // 10, 4) if dt < FEW_BELOW else phases
            world = ball.ball_world(engine, dt, pair, **tuning)
            found = ball.impacts(world, pair, psi_1, (np.arange(count) + 0.5) / count, twirl)
            world.close()
            what = f"{engine}, {dt:g} s, e = {e:g} {tuning or ''}"
            if not np.isfinite(found).all():
                problems.append(f"{what}: not finite or not gone after the impact")
            if found[..., 2].max() > 1.0 + grown:
                problems.append(f"{what}: energy grown to {found[..., 2].max():.4f}")
            return found[..., 0] - truth.psi_2[:, None]

        for e in RESTITUTIONS:
            pair = ball.steel_pair(restitution=e)
            for engine, steps in STEPS.items():
                found = [errors(engine, dt, pair) for dt in steps]
                data["error"][f"{engine}, e = {e:g}"] = [*map(largest, found)]
            for name in INTEGRATORS:
                one = errors("mujoco", LONG, pair, integrator=name)
                data["integrators"].setdefault(name, []).append(largest(one))
            found = [errors("mujoco", LONG, pair, substeps=n, grown=GROWN if n < 50 else 0.3 * GROWN) for n in COUNTS]
            data["in_substeps"][f"e = {e:g}"] = {"error": [*map(largest, found)], "rms": [*map(rms, found)]}
        spun = ball.steel_pair(restitution=1.0)
        shift = _of_spin(spun, psi_1)
        for engine, steps in STEPS.items():
            data["twirl"][engine] = [largest(errors(engine, dt, spun, twirl=TWIRL) - shift[:, None]) for dt in steps]
            pairs = {f"{NODES} nodes": ball.steel_pair(), "64 nodes": ball.steel_pair(Microslip(node_count=64))}
            for words, pair in pairs.items():
                duration = pair.contact_duration(MASS, ball.SPEED)
                found = [errors(engine, duration / n, pair) for n in RESOLVED]
                data["resolved"][f"{engine}, {words}"] = [*map(largest, found)]
        data["microseconds"] = _times(50 if quick else 400)
        limits = [
            *(Limit(f"error in {engine} at any step, e = {e:g}", ASKED, max(data["error"][f"{engine}, e = {e:g}"]))
              for engine in STEPS for e in RESTITUTIONS),
            *(Limit(f"error with {name}, step {1e3 * LONG:g} ms", ASKED, max(data["integrators"][name]))
              for name in INTEGRATORS),
            *(Limit(f"error of psi_2 in {engine}, spun at {TWIRL:g} rad/s about the normal, against the grid", OF_SPIN,
                    max(data["twirl"][engine])) for engine in STEPS),
            *(Limit(f"error in {engine}, {n} steps a contact", ASKED, reached) for engine in STEPS
              for n, reached in zip(RESOLVED, data["resolved"][f"{engine}, {NODES} nodes"], strict=True)),
        ]  # fmt: skip
        return Outcome(limits, data, problems)

    def draw(self, data: Data, left: Axes, right: Axes) -> None:
        times = [one["median"] for one in data["microseconds"]]
        for style, e in zip(STYLES, RESTITUTIONS, strict=False):
            marks = style | {"fillstyle": "none", "markersize": 9, "linestyle": ""}
            left.loglog(data["steps"]["mujoco"], data["error"][f"mujoco, e = {e:g}"], **style, label=f"e = {e:g}")
            left.loglog(data["steps"]["pybullet"], data["error"][f"pybullet, e = {e:g}"], **marks)
            found = data["in_substeps"][f"e = {e:g}"]
            right.loglog(times, found["error"], **style, label=f"e = {e:g}, largest")
            right.loglog(times, found["rms"], **(style | {"markersize": 2.5, "linewidth": 0.7}), label="rms")
        for n, time, error in zip(data["substeps"], times, data["in_substeps"]["e = 1"]["error"], strict=True):
            box = {"color": "white", "pad": 0.5}
            beside: dict[str, Any] = {"xytext": (6, 0), "textcoords": "offset points", "va": "center"}
            right.annotate(str(n), (time, error), **beside, fontsize=8, bbox=box)
        for axes in (left, right):
            limit_line(axes, ASKED, "asked")
            axes.set_ylabel(r"error in $\psi_2$ [-]")
        left.set(xlabel="engine step [s]", title=f"{SUBSTEPS} substeps", ylim=(5e-5, 1e-2))
        right.set(xlabel="time of an impact [us]", title="step of 2 ms, number of substeps", ylim=(1e-6, 2e-2))
        plain_ticks(right, [5, 10, 20, 40])
        left.legend(loc="lower right")
        right.legend(fontsize=7, ncols=3, loc="lower left")


def _of_spin(pair: ContactPair, psi_1: list[float]) -> np.ndarray:
    """Change of psi_2 by the spin `TWIRL`, from the grid with local Coulomb friction (nu = 0.28, chi = 1.465)."""
    from validation.reference import grid

    radius = float(np.sqrt(ball.RADIUS * pair.greatest_overlap(MASS, ball.SPEED)))
    sigma = pair.kappa / FRICTION * TWIRL * radius / ball.SPEED
    chi = [turning_data.BALL_CHI, turning_data.BALL_CHI, 0.0]

    def psi_2(psi: float, spin: float) -> float:
        return float(grid.rebound([psi, 0.0, spin], chi, nu=turning_data.NUS[1], cells=32, steps=256)[0])

    return np.array([psi_2(psi, sigma) - psi_2(psi, 0.0) for psi in psi_1])


def _times(repeats: int) -> list[dict[str, float]]:
    """Time of an impact in long steps [us], less that of the same steps in free flight, for each of `COUNTS`."""
    worlds = {str(n): ball.ball_world("mujoco", LONG, ball.steel_pair(), substeps=n) for n in COUNTS}
    worlds["free"] = ball.ball_world("mujoco", LONG, ball.steel_pair())
    thrown = ball.launch(1.4 * FRICTION / ball.steel_pair().kappa, 0.0, spinning=False)[:2]
    heights = dict.fromkeys(worlds, 0.5 * LONG) | {"free": 1.0}
    prepare = {name: partial(world.start, ball.at(heights[name], *thrown)) for name, world in worlds.items()}
    seconds = interleaved({name: partial(world.step, 4) for name, world in worlds.items()}, repeats, prepare)
    return [spread(1e6 * (seconds[str(n)] - seconds["free"])) for n in COUNTS]
