"""A superball thrown under a table: floor, underside, floor, and out again on the side where it came in."""

from __future__ import annotations

from math import sqrt
from typing import ClassVar

from contactlaw import checks
from sims.bounces import bounces_of
from sims.recording import Recording
from sims.scene import Limit, Measured, Scene, Settings, register
from sims.superball import GRAVITY, INTERVAL, MASS, RADIUS, check_bounces, pair_of, settled, spins_in_words
from sims.worlds import new_world

LENGTH, DEPTH, THICKNESS = 0.5, 0.4, 0.012  # of the table [m]; its edge is at x = 0
BOUNCES = 3
WAIT = 0.25  # how long to watch after the last bounce [s]


@register
class UnderTable(Scene):
    """Thrown without spin, forward and down; the bounce off the floor spins it so that the table sends it back.

    The table is low: a ball as soft as this one must not hit faster than some 2 m/s to keep a small contact.
    """

    name = "under_table"
    title = "a superball thrown under a low table comes back out"
    shown: ClassVar[float] = 0.36
    slow = 10.0
    options = {
        "clearance": (0.15, "height of the table's underside over the floor, in m"),
        "speed": (2.5, "forward, with which it is thrown, in m/s"),
        "landing": (2.0, "downward speed at the floor, in m/s"),
    }

    def run(self, settings: Settings) -> Recording:
        """Throw it."""
        self.demand(settings)
        clearance, speed, landing = (
            checks.positive(name, self.option(settings, name)) for name in ("clearance", "speed", "landing")
        )
        if clearance <= 2.0 * RADIUS:
            raise ValueError(f"clearance = {clearance!r}: must be above the ball's {2.0 * RADIUS} m")
        pair = pair_of(settings)
        drop = 0.5 * (clearance - 2.0 * RADIUS)
        if landing**2 <= 2.0 * GRAVITY * drop:
            raise ValueError(
                f"landing = {landing!r}: must be above that of a fall, {sqrt(2.0 * GRAVITY * drop):.2f} m/s"
            )
        down = sqrt(landing**2 - 2.0 * GRAVITY * drop)

        world = new_world(settings)
        world.ball("ball", RADIUS, MASS, [-0.06, 0.0, RADIUS + drop], [speed, 0.0, -down])
        world.plane("floor")
        world.block("table", [LENGTH / 2, DEPTH / 2, THICKNESS / 2], [LENGTH / 2, 0.0, clearance + THICKNESS / 2])
        world.contact("ball", ["floor", "table"], pair, speed=landing)

        duration = 3.0 * (clearance - 2.0 * RADIUS) / landing + 2.0 * WAIT
        return world.record(duration, INTERVAL, material=pair.a.name, clearance=clearance)

    def caption(self, recording: Recording) -> str:
        """The spins of the flights shown."""
        bounces = bounces_of(recording, "ball", ceiling=recording.facts["clearance"])
        return spins_in_words(recording, bounces, self.shown)

    def measure(self, recording: Recording) -> Measured:
        """Every bounce beside the reference, and where the ball is in the end."""
        pair = pair_of(Settings(material=recording.facts["material"]))
        bounces = bounces_of(recording, "ball", ceiling=recording.facts["clearance"])
        last = float(recording.track("ball").positions[-1, 0])
        return settled(recording, pair, bounces, x_end=last)

    def check(self, measured: Measured) -> list[Limit]:
        """Floor, underside, floor; out again by the law, against the reference."""
        out = check_bounces(measured["bounces"], measured["law"], BOUNCES)
        if measured["law"] == "microslip":
            under = sum(one["surface"] == "table" for one in measured["bounces"])
            out.append(Limit("bounces off the underside", 1, under, at_least=True))
            out.append(Limit("where it ends, the edge being at 0", -RADIUS, measured["x_end"], "m"))
        return out
