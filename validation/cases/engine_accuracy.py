"""The law inside both engines against the reference: error over the number of steps a contact."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import ContactPair
from contactlaw.laws.microslip import Microslip
from validation.ball import (
    FRICTION,
    MASS,
    RADIUS,
    RESTITUTION,
    TANGENTIAL_MASS,
    BulletBall,
    energy_of,
    mujoco_ball,
    steel_pair,
)  # fmt: skip
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.impacts import judge
from validation.picture import STYLES, panels, plain_ticks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEPS = [50, 100, 200, 400]
ASKED = {50: 1e-2, 100: 5e-3, 200: 5e-3, 400: 5e-3}
SPEED = 1.0  # [m/s]
INCIDENCES = [0.4, 1.0, 1.3, 2.0, 3.0, 4.2, 5.5]


@register
class EngineAccuracy(Case):
    """A steel ball's bounce in MuJoCo and PyBullet."""

    name = "engine_accuracy"
    place = 50
    title = "The law inside the engines"
    claim = (
        "Inside MuJoCo and PyBullet, at steps that resolve the contact, the law keeps the rebound to within "
        "0.005 of the converged solution from 100 steps a contact on (0.01 from 50), wherever in a step the bodies "
        "touch."
    )
    caption = (
        "Largest error in psi_2 of a steel ball's bounce over incidence, direction, launch and phase of the touch. "
        "The law takes steps of its own within the engine's, so that few engine steps cost no accuracy; what is left "
        "with many is the error of the nodes."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every impact in both engines, with the default law, with more nodes, and without damping."""
        psi_1 = INCIDENCES[::3] if quick else INCIDENCES
        count = 2 if quick else 5
        phases = (np.arange(count) + 0.5) / count
        pairs = {
            f"e = {RESTITUTION:g}": steel_pair(),
            f"e = {RESTITUTION:g}, 64 nodes": steel_pair(Microslip(node_count=64)),
            "e = 1, 64 nodes": steel_pair(Microslip(node_count=64), 1.0),
        }
        error: dict[str, list[float]] = {}
        normal: dict[str, list[float]] = {}
        problems: list[str] = []
        apart = 0.0
        uncertainty = 0.0
        for number, (label, pair) in enumerate(pairs.items()):
            chi = pair.chi(MASS, TANGENTIAL_MASS)
            truth = judge([(psi, chi, pair.restitution) for psi in psi_1])
            uncertainty = max(uncertainty, float(truth.uncertainty.max()))
            for steps in STEPS:
                results = {
                    engine: bounce(pair, steps, _launches(psi_1, pair.kappa), phases)
                    for engine, bounce in (("mujoco", _in_mujoco), ("pybullet", _in_pybullet))
                }
                apart = max(apart, float(np.abs(results["mujoco"] - results["pybullet"]).max()))
                for engine, found in results.items():
                    key = f"{engine}, {label}"
                    psi_2 = found[..., 0] * pair.kappa / (FRICTION * SPEED)
                    if not np.isfinite(found).all():
                        problems.append(f"{key}, {steps} steps: not finite")
                    if found[..., 2].max() > 1.001:
                        problems.append(f"{key}, {steps} steps: energy grown to {found[..., 2].max():.4f} of the first")
                    error.setdefault(key, []).append(float(np.abs(psi_2 - truth.psi_2[:, None, None]).max()))
                    normal.setdefault(key, []).append(float(np.abs(found[..., 1] / SPEED - pair.restitution).max()))
            progress((number + 1) / len(pairs))
        data = {
            "chi": chi, "psi_1": psi_1, "phases": phases.size, "steps": STEPS, "error": error,
            "restitution_error": normal, "reference_uncertainty": uncertainty, "engines_apart": apart,
        }  # fmt: skip
        limits = [
            Limit(f"error in {engine}, {steps} steps a contact", ASKED[steps], reached)
            for engine in ("mujoco", "pybullet")
            for steps, reached in zip(STEPS, error[f"{engine}, e = {RESTITUTION:g}"], strict=True)
        ]
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        """A row an engine and pair."""
        steps = data["steps"]
        table = Table(["engine, impact", *(f"{n} steps" for n in steps), f"error in e at {steps[1]} steps"])
        for key, error in data["error"].items():
            table.rows.append(
                [key, *(f"{value:.1e}" for value in error), f"{data['restitution_error'][key][1]:.1e}"]
            )  # fmt: skip
        table.rows.append(
            ["largest difference of the engines [m/s]", f"{data['engines_apart']:.0e}", *[""] * len(steps)]
        )
        return table

    def draw(self, data: Data) -> Figure:
        """Error over steps; the engines differ by rounding alone, so PyBullet's marks are rings around MuJoCo's."""
        figure, (axes,) = panels(1, width=6.0)
        keys = [key.removeprefix("mujoco, ") for key in data["error"] if key.startswith("mujoco")]
        for style, key in zip(STYLES, keys, strict=False):
            axes.loglog(data["steps"], data["error"][f"mujoco, {key}"], **style, label=key)
            axes.loglog(
                data["steps"],
                data["error"][f"pybullet, {key}"],
                "o",
                color=style["color"],
                markersize=9,
                fillstyle="none",
            )
        axes.plot([], [], "o", color="black", markersize=9, fillstyle="none", label="the same in PyBullet")
        axes.plot(
            [50, 75, 75, 400],
            [1e-2, 1e-2, 5e-3, 5e-3],
            color="black",
            linewidth=0.8,
            linestyle=(0, (8, 4)),
            label="asked",
        )
        axes.set(xlabel="engine steps a contact [-]", ylabel=r"largest error in $\psi_2$ [-]")
        plain_ticks(axes, data["steps"])
        axes.legend()
        return figure


def _launches(psi_1: list[float], kappa: float) -> list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """For each incidence: velocity, spin and direction of sliding of an oblique and of a spinning ball."""
    launches = []
    for psi in psi_1:
        speed = psi * FRICTION / kappa * SPEED
        kinds = []
        for angle, oblique in ((0.0, True), (0.7, True), (2.1, False)):
            along = np.array([np.cos(angle), np.sin(angle), 0.0])
            across = np.array([-along[1], along[0], 0.0])
            down = np.array([0.0, 0.0, -SPEED])
            # The contact point is at -R z: its velocity is v + spin x (-R z) = v - R (spin_y, -spin_x, 0).
            spin = np.zeros(3) if oblique else -speed / RADIUS * across
            kinds.append((down + (speed * along if oblique else 0.0), spin, along))
        launches.append(kinds)
    return launches


def _sizes(pair: ContactPair, steps: int) -> tuple[float, int]:
    """Step [s], and how many are taken: the flight before, the contact and some to spare."""
    return pair.contact_duration(MASS, SPEED) / steps, int(1.3 * steps) + 4


def _outcome(velocity: Any, spin: Any, along: np.ndarray, first: float) -> tuple[float, float, float]:
    """Velocity of the contact point along the launch, of the ball upwards [m/s], and energy over the first."""
    point = np.asarray(velocity) - RADIUS * np.array([spin[1], -spin[0], 0.0])
    return float(point @ along), float(velocity[2]), energy_of(np.asarray(velocity), np.asarray(spin)) / first


def _in_mujoco(pair: ContactPair, steps: int, launches: list[Any], phases: np.ndarray) -> np.ndarray:
    import mujoco

    dt, count = _sizes(pair, steps)
    model, data, _ = mujoco_ball(dt, "law", pair)
    out = np.empty((len(launches), len(launches[0]), phases.size, 3))
    for index in np.ndindex(out.shape[:3]):
        velocity, spin, along = launches[index[0]][index[1]]
        mujoco.mj_resetData(model, data)
        data.qpos[2] = RADIUS + phases[index[2]] * dt * SPEED
        data.qvel[:3], data.qvel[3:] = velocity, spin  # spin in the ball's frame, which turns about this very axis
        mujoco.mj_step(model, data, count)
        out[index] = _outcome(data.qvel[:3], data.qvel[3:], along, energy_of(velocity, spin))
        if data.qpos[2] <= RADIUS:
            out[index] = np.nan
    return out


def _in_pybullet(pair: ContactPair, steps: int, launches: list[Any], phases: np.ndarray) -> np.ndarray:
    dt, count = _sizes(pair, steps)
    ball = BulletBall(dt, "law", pair)
    out = np.empty((len(launches), len(launches[0]), phases.size, 3))
    try:
        for index in np.ndindex(out.shape[:3]):
            velocity, spin, along = launches[index[0]][index[1]]
            ball.start(float(phases[index[2]]) * dt * SPEED, velocity, spin)
            ball.step(count)
            out[index] = _outcome(*ball.motion, along, energy_of(velocity, spin))
            if ball.height <= 0.0:
                out[index] = np.nan
    finally:
        ball.close()
    return out
