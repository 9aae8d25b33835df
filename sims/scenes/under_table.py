"""A superball thrown under a table bounces off floor, underside and floor, and leaves on the side where it came in."""

from math import sqrt
from typing import Any, ClassVar

from sims.bounces import bounces_of
from sims.options import length, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register
from sims.superball import GRAVITY, INTERVAL, OPTIONS, check_bounces, pair_of, settled, spins_in_words
from sims.worlds import new_world

LENGTH, DEPTH, THICKNESS = 0.5, 0.4, 0.012  # of the table [m]; its edge is at x = 0
BOUNCES = 3
WAIT = 0.25  # how long to watch after the last bounce [s]


@register
class UnderTable(Scene):
    """Thrown forward and down without spin; the bounce off the floor gives it spin, so that the table sends it back.

    The table is low because a ball as soft as this may not hit faster than some 2 m/s if the contact is to stay small.
    """

    name = "under_table"
    title = "a superball thrown under a low table comes back out"
    engines = EVERYWHERE
    shown: ClassVar[float] = 0.36
    slow = 10.0
    material = "rubber"
    options = {
        "clearance": length(0.15, "height of the table's underside over the floor"),
        "speed": speed(2.5, "forward speed of the throw"),
        "landing": speed(2.0, "downward speed at the floor"),
    } | OPTIONS

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Throw it."""
        room = o.clearance - 2.0 * o.radius
        if room <= 0.0:
            raise ValueError(f"clearance = {o.clearance!r}: must be above the ball's {2.0 * o.radius} m")
        fall = GRAVITY * room  # square of the speed of a fall from half way
        if o.landing**2 <= fall:
            raise ValueError(f"landing = {o.landing!r}: must be above that of a fall, {sqrt(fall):.2f} m/s")
        down = sqrt(o.landing**2 - fall)

        world = new_world(settings)
        world.ball("ball", o.radius, o.mass, [-0.06, 0.0, o.radius + 0.5 * room], [o.speed, 0.0, -down])
        world.plane("floor")
        world.block("table", [LENGTH / 2, DEPTH / 2, THICKNESS / 2], [LENGTH / 2, 0.0, o.clearance + THICKNESS / 2])
        world.contact("ball", ["floor", "table"], pair_of(o), speed=o.landing)
        return world.record(3.0 * room / o.landing + 2.0 * WAIT, INTERVAL)

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """The number of each bounce, below the floor or above the table."""
        found = bounces_of(recording, "ball", ceiling=recording.facts["clearance"])
        heights = [0.0 if one.normal[2] > 0.0 else recording.o.clearance + 0.04 for one in found]
        return [(one.place[0], height, str(number)) for number, (one, height) in
                enumerate(zip(found, heights, strict=True), 1) if one.time < self.shown]  # fmt: skip

    def caption(self, recording: Recording) -> str:
        """The spins of the flights shown."""
        bounces = bounces_of(recording, "ball", ceiling=recording.facts["clearance"])
        return spins_in_words(recording, bounces, self.shown)

    def measure(self, recording: Recording) -> Measured:
        """Every bounce beside the reference, and the ball's last position."""
        bounces = bounces_of(recording, "ball", ceiling=recording.facts["clearance"])
        last = float(recording.track("ball").positions[-1, 0])
        return settled(recording, bounces, x_end=last, radius=recording.o.radius)

    def check(self, measured: Measured) -> list[Limit]:
        """Bounces off floor, underside and floor; by the law the ball comes out again; all against the reference."""
        out = check_bounces(measured["bounces"], measured["law"], BOUNCES)
        if measured["law"] == "microslip":
            under = sum(one["surface"] == "table" for one in measured["bounces"])
            out.append(Limit("bounces off the underside", 1, under, at_least=True))
            out.append(Limit("last position, from the edge of the table", -measured["radius"], measured["x_end"], "m"))
        return out
