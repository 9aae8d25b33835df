"""The bounce at any engine step: error over the step, and over the time that the law's own substeps take."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from functools import partial
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contactlaw import ContactPair
from validation.ball import (
    FRICTION,
    INTEGRATORS,
    MASS,
    RADIUS,
    SUBSTEPS,
    TANGENTIAL_MASS,
    BulletBall,
    energy_of,
    mujoco_ball,
    steel_pair,
)
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.impacts import judge
from validation.measure import interleaved, spread
from validation.picture import STYLES, limit_line, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

ASKED = 4e-3
GROWN = 3e-3  # of the energy, that an impact of few substeps may gain
SPEED = 1.0  # [m/s]
RESTITUTIONS = [1.0, 0.93, 0.5]
INCIDENCES = [0.2, 0.6, 1.0, 1.4, 2.0, 2.7, 3.5, 4.2, 5.0, 6.0]
LONG = 2e-3  # [s], MuJoCo's own step
STEPS = {
    "mujoco": [1.0 / 240.0, LONG, 1e-3, 1e-4, 1e-5, 1e-6],
    "pybullet": [1.0 / 240.0, 1e-3, 1e-4, 1e-5, 1e-6],
}  # [s]
COUNTS = [25, 50, 100, 200, 400]  # substeps a contact
TWIRL = 20.0  # [rad/s] about the normal; 0.004 rad in a contact
FEW_BELOW = 2e-5  # [s]: such steps resolve the contact, and a tenth of the phases will do


@register
class AnyStep(Case):
    """A steel ball's bounce at engine steps from 4 ms down to 1 us."""

    name = "any_step"
    place = 41
    title = "Any engine step"
    claim = (
        "The engine's step does not matter: whether a contact of some 180 us falls between two steps of 4 ms or is "
        "resolved by hundreds of them, wherever in a step the bodies touch, the rebound keeps to the converged "
        "solution within 0.004 with the default substeps; more of them buy less error."
    )
    caption = (
        f"Error in psi_2 of a steel ball's bounce, {len(INCIDENCES)} incidences from {INCIDENCES[0]:g} to "
        f"{INCIDENCES[-1]:g}, many phases of the touch in the step. Left: over the engine's step, {SUBSTEPS} substeps; "
        f"open marks: PyBullet. Right: at a step of {1e3 * LONG:g} ms in MuJoCo, over the time that the impact takes, "
        "for the number of substeps written at the marks."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every step in both engines, every integrator of MuJoCo, every number of substeps."""
        psi_1 = INCIDENCES[::3] if quick else INCIDENCES
        phases = 12 if quick else 100
        data: Data = {"psi_1": psi_1, "phases": phases, "steps": STEPS, "error": {}, "rms": {}, "substeps": COUNTS}
        data |= {"in_substeps": {}, "integrators": {}, "twirl": {}, "uncertainty": 0.0}
        problems: list[str] = []
        for number, e in enumerate(RESTITUTIONS):
            pair = steel_pair(restitution=e)
            truth = judge([(psi, pair.chi(MASS, TANGENTIAL_MASS), e) for psi in psi_1])
            data["uncertainty"] = max(data["uncertainty"], float(truth.uncertainty.max()))

            def errors(
                results: Array, what: str, coarse: bool = False, pair: ContactPair = pair, psi_2: Array = truth.psi_2
            ) -> Array:
                if not np.isfinite(results).all():
                    problems.append(f"{what}, e = {pair.restitution:g}: not finite or not gone after the impact")
                if results[..., 1].max() > 1.0 + (GROWN if coarse else 0.3 * GROWN):
                    problems.append(f"{what}, e = {pair.restitution:g}: energy grown to {results[..., 1].max():.4f}")
                return results[..., 0] * pair.kappa / (FRICTION * SPEED) - psi_2[:, None]

            for engine, bounce in (("mujoco", in_mujoco), ("pybullet", in_pybullet)):
                found = [errors(bounce(pair, dt, psi_1, _phases(phases, dt)), f"{engine}, {dt:g} s")
                         for dt in STEPS[engine]]  # fmt: skip
                data["error"][f"{engine}, e = {e:g}"] = [_largest(one) for one in found]
                data["rms"][f"{engine}, e = {e:g}"] = [_rms(one) for one in found]
            for engine, bounce in (("mujoco", in_mujoco), ("pybullet", in_pybullet)) if e == RESTITUTIONS[0] else ():
                found = [errors(bounce(pair, dt, psi_1, _phases(phases, dt), twirl=TWIRL), f"{engine}, {dt:g} s, spun")
                         for dt in STEPS[engine]]  # fmt: skip
                data["twirl"][engine] = [_largest(one) for one in found]
            for name in INTEGRATORS:
                one = errors(in_mujoco(pair, LONG, psi_1, _phases(phases, LONG), integrator=name), name)
                data["integrators"].setdefault(name, []).append(_largest(one))
            found = [errors(in_mujoco(pair, LONG, psi_1, _phases(phases, LONG), substeps=n), f"{n} substeps", n < 50)
                     for n in COUNTS]  # fmt: skip
            data["in_substeps"][f"e = {e:g}"] = {
                "error": [_largest(one) for one in found],
                "rms": [_rms(one) for one in found],
            }
            progress(0.9 * (number + 1) / len(RESTITUTIONS))
        data["microseconds"] = _times(50 if quick else 400)
        limits = [
            Limit(f"error in {engine} at any step, e = {e:g}", ASKED, max(data["error"][f"{engine}, e = {e:g}"]))
            for engine in STEPS
            for e in RESTITUTIONS
        ] + [
            Limit(f"error with {name}, step {1e3 * LONG:g} ms", ASKED, max(data["integrators"][name]))
            for name in INTEGRATORS
        ] + [
            Limit(f"error in {engine} at any step, spun at {TWIRL:g} rad/s about the normal", ASKED,
                  max(data["twirl"][engine]))
            for engine in STEPS
        ]  # fmt: skip
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        """A row an engine, restitution and step; then substeps."""
        table = Table(["engine, impact", "step or substeps", "largest error", "rms", "time an impact [us]"])
        for key, errors in data["error"].items():
            steps = data["steps"][key.split(",")[0]]
            for dt, error, rms in zip(steps, errors, data["rms"][key], strict=True):
                table.rows.append([key, _in_words(dt), f"{error:.1e}", f"{rms:.1e}", ""])
        for engine, errors in data["twirl"].items():
            for dt, error in zip(data["steps"][engine], errors, strict=True):
                table.rows.append([f"{engine}, e = 1, spun about the normal", _in_words(dt), f"{error:.1e}", "", ""])
        for key, found in data["in_substeps"].items():
            for n, error, rms, time in zip(
                data["substeps"], found["error"], found["rms"], data["microseconds"], strict=True
            ):
                table.rows.append(
                    [f"mujoco, 2 ms, {key}", f"{n} substeps", f"{error:.1e}", f"{rms:.1e}", f"{time['median']:.1f}"]
                )
        return table

    def draw(self, data: Data) -> Figure:
        """Error over the step, and over time."""
        figure, (left, right) = panels(2)
        for style, e in zip(STYLES, RESTITUTIONS, strict=False):
            for engine, open_mark in (("mujoco", False), ("pybullet", True)):
                key = f"{engine}, e = {e:g}"
                look: dict[str, Any] = style | (
                    {"fillstyle": "none", "markersize": 9, "linestyle": ""} if open_mark else {}
                )
                left.loglog(
                    data["steps"][engine], data["error"][key], **look, label=None if open_mark else f"e = {e:g}"
                )
            found = data["in_substeps"][f"e = {e:g}"]
            times = [one["median"] for one in data["microseconds"]]
            right.loglog(times, found["error"], **style, label=f"e = {e:g}, largest")
            right.loglog(times, found["rms"], **(style | {"markersize": 2.5, "linewidth": 0.7}), label="rms")
        for n, time, error in zip(data["substeps"], times, data["in_substeps"]["e = 1"]["error"], strict=True):
            right.annotate(str(n), (time, error), xytext=(3, 4), textcoords="offset points", fontsize=8)
        for axes in (left, right):
            limit_line(axes, ASKED, "asked")
            axes.set_ylabel(r"error in $\psi_2$ [-]")
        left.set(xlabel="engine step [s]", title=f"{SUBSTEPS} substeps")
        right.set(xlabel="time an impact takes [us]", title="step of 2 ms, number of substeps")
        left.set_ylim(5e-5, 1e-2)
        right.set_ylim(3e-6, 2e-2)
        left.legend(loc="lower right")
        right.legend(fontsize=7, ncols=3, loc="lower left")
        return figure


def in_mujoco(
    pair: ContactPair, dt: float, psi_1: list[float], phases: Array, *, integrator: str = "Euler",
    substeps: int = SUBSTEPS, twirl: float = 0.0,
) -> Array:  # fmt: skip
    """Velocity of the contact point along the launch after the impact [m/s], and energy over the first.

    twirl: spin about the normal besides [rad/s].
    """
    import mujoco

    model, data, name = mujoco_ball(dt, "law alone", pair, integrator=integrator, substeps=substeps)
    start = int(model.plugin_stateadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PLUGIN, name)])
    out = np.empty((len(psi_1), phases.size, 2))
    count = _count(pair, dt)
    for index in np.ndindex(out.shape[:2]):
        velocity, spin, along = launch(psi_1[index[0]] * FRICTION / pair.kappa * SPEED, index[1])
        spin[2] = twirl
        mujoco.mj_resetData(model, data)
        data.qpos[2] = RADIUS + phases[index[1]] * dt * SPEED
        data.qvel[:3], data.qvel[3:] = velocity, spin
        mujoco.mj_step(model, data, count)
        turned = data.xmat[1].reshape(3, 3) @ data.qvel[3:]  # of the last step's start; the ball turns about this axis
        out[index] = _outcome(data.qvel[:3], turned, along, energy_of(velocity, spin))
        if data.qpos[2] <= RADIUS or data.plugin_state[start] != 0.0:
            out[index] = np.nan
    return out


def in_pybullet(pair: ContactPair, dt: float, psi_1: list[float], phases: Array, *, twirl: float = 0.0) -> Array:
    """The same in PyBullet."""
    ball = BulletBall(dt, "law", pair)
    out = np.empty((len(psi_1), phases.size, 2))
    try:
        for index in np.ndindex(out.shape[:2]):
            velocity, spin, along = launch(psi_1[index[0]] * FRICTION / pair.kappa * SPEED, index[1])
            spin[2] = twirl
            ball.start(float(phases[index[1]]) * dt * SPEED, velocity, spin)
            ball.step(_count(pair, dt))
            out[index] = _outcome(*ball.true_motion, along, energy_of(velocity, spin))
            if ball.height <= 0.0:
                out[index] = np.nan
    finally:
        ball.close()
    return out


def launch(speed: float, number: int) -> tuple[Array, Array, Array]:
    """Velocity, spin and direction of sliding of a ball whose contact point slides: obliquely or, if odd, spinning."""
    angle = 2.4 * number
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    velocity, spin = np.array([0.0, 0.0, -SPEED]), np.zeros(3)
    if number % 2:
        spin = -speed / RADIUS * np.array([-along[1], along[0], 0.0])
    else:
        velocity += speed * along
    return velocity, spin, along


def _outcome(velocity: Any, spin: Any, along: Array, first: float) -> tuple[float, float]:
    velocity, spin = np.asarray(velocity), np.asarray(spin)
    point = velocity - RADIUS * np.array([spin[1], -spin[0], 0.0])
    return float(point @ along), energy_of(velocity, spin) / first


def _count(pair: ContactPair, dt: float) -> int:
    """Steps until the ball has gone, a dent left by the damper too, and nothing is owed."""
    return ceil(2.0 * pair.contact_duration(MASS, SPEED) / dt) + 4


def _phases(count: int, dt: float) -> Array:
    count = max(count // 10, 4) if dt < FEW_BELOW else count
    return (np.arange(count) + 0.5) / count


def _largest(errors: Array) -> float:
    return float(np.abs(errors).max())


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _times(repeats: int) -> list[dict[str, float]]:
    """Time of an impact within long steps [us], beyond that of the same steps in free flight, for each of `COUNTS`."""
    import mujoco

    scenes = {n: mujoco_ball(LONG, "law alone", substeps=n) for n in COUNTS}
    free = mujoco_ball(LONG, "law alone")
    velocity, _, _ = launch(1.4 * FRICTION / steel_pair().kappa, 0)

    def place(model: Any, data: Any, height: float) -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[2], data.qvel[:3] = RADIUS + height, velocity

    runs = {str(n): partial(mujoco.mj_step, m, d, 4) for n, (m, d, _) in scenes.items()}
    prepare = {str(n): partial(place, m, d, 0.5 * LONG) for n, (m, d, _) in scenes.items()}
    runs["free"], prepare["free"] = partial(mujoco.mj_step, *free[:2], 4), partial(place, *free[:2], 1.0)
    seconds = interleaved(runs, repeats, prepare)
    return [spread(1e6 * (seconds[str(n)] - seconds["free"])) for n in COUNTS]


def _in_words(dt: float) -> str:
    return f"1/{round(1.0 / dt)} s" if abs(240.0 * dt - 1.0) < 1e-9 else f"{1e3 * dt:g} ms"
