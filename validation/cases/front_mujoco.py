"""Error against run time inside MuJoCo."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from validation import front_engine
from validation.ball import RADIUS, RESTITUTION, linear_spring, mujoco_ball, steel_pair, true_velocity
from validation.case import Case, Data, Outcome, Progress, Table, register
from validation.front_engine import DURATION, PATIENCE, Way

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OWN_STEP = 2e-3  # [s]
NATIVE_STEPS = [OWN_STEP, 1e-3, 1e-4]  # [s]
SOFT = 0.02  # [s], a native contact that some steps of 2 ms resolve
RESOLVED = [1000, 300, 100, 30]  # steps a contact, of a native contact that lasts as long as the law's


@register
class FrontMujoco(Case):
    """A steel ball's bounce in MuJoCo: every law, nodes, substeps and steps, and the engine's own contact."""

    name = "front_mujoco"
    place = 43
    title = "Error and time in MuJoCo"
    claim = (
        "At MuJoCo's own step of 2 ms and with default settings the law is asked to be on the front of error against "
        "run time, 30 times closer than the single-spring laws at equal run time, and 100 times faster than the "
        "annulus reference at equal error. Shorter steps only cost more: the law's substeps do their work."
    )
    caption = (
        f"Largest error in psi_2 of a steel ball's bounce (e = {RESTITUTION:g}) over the time of the engine's steps "
        "from before the touch until the ball has left, and over that of one step. Line: the front. Numbers: "
        "nodes/substeps of microslip at 2 ms. Native: its own contact, soft, and "
        "as stiff as the law's."
    )
    needs = ("mujoco",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every way, side by side."""
        ways = {
            name: Way(
                name.split(",")[0],
                one.dt,
                partial(MujocoBall, one.dt, "law alone", one.law, substeps=one.substeps),
            )
            for name, one in front_engine.settings(OWN_STEP, quick).items()
        }
        for number in RESOLVED[::3] if quick else RESOLVED:
            dt = DURATION / number
            ways[f"native, as stiff, T/{number}"] = Way("native", dt, partial(_native, dt, _bouncing(DURATION)))
        for dt in NATIVE_STEPS[:1] if quick else NATIVE_STEPS:
            words = front_engine.in_words(dt)
            for kind, solref in (("its own solref", [0.02, 1.0]), ("soft, bouncing", _bouncing(SOFT))):
                ways[f"native, {kind}, {words}"] = Way("native", dt, partial(_native, dt, solref), PATIENCE)
        data, problems = front_engine.measured(ways, 12 if quick else 50, quick, progress)
        return Outcome(front_engine.limits(data, "MuJoCo"), data, problems)

    def table(self, data: Data) -> Table:
        """The front."""
        return front_engine.table(data)

    def draw(self, data: Data) -> Figure:
        """Error over the time of an impact, and of a step."""
        return front_engine.draw(data)


class MujocoBall:
    """A ball over a floor in MuJoCo, as `validation.front_engine.Ball` has it."""

    def __init__(self, dt: float, contact: str, law: Any = "microslip", **options: Any) -> None:
        import mujoco

        self.engine: Any = mujoco
        self.model, self.data, _ = mujoco_ball(dt, contact, steel_pair(law), **options)

    def start(self, height: float, velocity: Any, spin: Any) -> None:
        """Put it at a height [m] over touching; the spin is about an axis that the turning leaves alone."""
        self.engine.mj_resetData(self.model, self.data)
        self.data.qpos[2] = RADIUS + height
        self.data.qvel[:3], self.data.qvel[3:] = velocity, spin

    def step(self, count: int) -> None:
        """Step the engine."""
        self.engine.mj_step(self.model, self.data, count)

    @property
    def height(self) -> float:
        """Over touching [m]."""
        return float(self.data.qpos[2]) - RADIUS

    @property
    def true_motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity [m/s] and spin [rad/s] at the time of the position."""
        velocity = true_velocity(self.model, self.data)
        return velocity[:3], velocity[3:]


def _native(dt: float, solref: list[float]) -> MujocoBall:
    return MujocoBall(dt, "native", solref=solref)


def _bouncing(duration: float) -> list[float]:
    """solref of a contact of this duration [s] and the ball's restitution."""
    return [-value for value in linear_spring(duration, RESTITUTION)]
