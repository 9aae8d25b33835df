"""Error against run time inside PyBullet."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from validation import front_engine
from validation.ball import RESTITUTION, BulletBall, steel_pair
from validation.case import Case, Data, Outcome, Progress, Table, register
from validation.front_engine import DURATION, PATIENCE, Way

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OWN_STEP = 1.0 / 240.0  # [s]
NATIVE_STEPS = [OWN_STEP, 1e-3, 1e-4]  # [s]


@register
class FrontPybullet(Case):
    """A steel ball's bounce in PyBullet: every law, nodes, substeps and steps, and the engine's own contact."""

    name = "front_pybullet"
    place = 44
    title = "Error and time in PyBullet"
    claim = (
        "At PyBullet's own step of 1/240 s and with default settings the law is asked to be on the front of error "
        "against run time, 30 times closer than the single-spring laws at equal run time, and 100 times faster than "
        "the annulus reference at equal error. Reading and pushing the bodies takes part of the time, whatever the law."
    )
    caption = (
        f"Largest error in psi_2 of a steel ball's bounce (e = {RESTITUTION:g}) over the time of callback and engine, "
        "from before the touch until the ball has left, and over that of one step. Line: the front. Numbers: "
        "nodes/substeps of microslip at 1/240 s. Native: PyBullet's own contact, "
        "with the same friction and restitution."
    )
    needs = ("pybullet",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every way, side by side."""
        ways = {
            name: Way(
                name.split(",")[0],
                one.dt,
                partial(BulletBall, one.dt, "law", steel_pair(one.law), substeps=one.substeps),
            )
            for name, one in front_engine.settings(OWN_STEP, quick).items()
        }
        for dt in NATIVE_STEPS[:1] if quick else NATIVE_STEPS:
            name = f"native, {front_engine.in_words(dt)}"
            ways[name] = Way("native", dt, partial(_native, dt), PATIENCE)
        for number in (100, 1000):
            dt = DURATION / number
            ways[f"native, T/{number}"] = Way("native", dt, partial(_native, dt))
        data, problems = front_engine.measured(ways, 12 if quick else 50, quick, progress)
        return Outcome(front_engine.limits(data, "PyBullet"), data, problems)

    def table(self, data: Data) -> Table:
        """The front."""
        return front_engine.table(data)

    def draw(self, data: Data) -> Figure:
        """Error over the time of an impact, and of a step."""
        return front_engine.draw(data)


def _native(dt: float) -> BulletBall:
    """Bullet multiplies friction and restitution of two bodies: the floor takes 1, so that the ball's own remain."""
    ball = BulletBall(dt, "native")
    ball.engine.changeDynamics(ball.floor, -1, lateralFriction=1.0, restitution=1.0, physicsClientId=ball.client)
    return ball
