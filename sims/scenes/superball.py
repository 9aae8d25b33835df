"""A superball thrown with backspin: each bounce reverses its spin, so that it bounces back and forth."""

from math import sqrt
from typing import Any, ClassVar

from sims.bounces import bounces_of
from sims.options import Option, length, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register
from sims.superball import (
    BACKSPIN,
    GRAVITY,
    INTERVAL,
    MOST_BOUNCES,
    OPTIONS,
    by_reference,
    check_bounces,
    describe,
    flight,
    garwin,
    pair_of,
    settled,
    spins_in_words,
)
from sims.worlds import new_world

TURNS = "that reverse the spin", "that send the ball back"


@register
class Superball(Scene):
    """Thrown level, with backspin, over a floor."""

    name = "superball"
    title = "a superball with backspin bounces back and forth"
    engines = EVERYWHERE
    shown: ClassVar[float] = 0.92
    exposure, slow = 0.0505, 8.0
    material = "rubber"
    beside_damped = True
    options = {
        "bounces": Option(6, "number of bounces", 1, MOST_BOUNCES),
        "speed": speed(2.0, "speed of the throw"),
        "backspin": Option(
            BACKSPIN,
            "R omega/v; at 2.5 the angular momentum about the contact point is zero: each bounce reverses it",
            -100,
            100,
        ),
        "drop": length(0.2, "height of the throw over the floor"),
    } | OPTIONS

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Throw it."""
        pair, landing = pair_of(o), sqrt(2.0 * GRAVITY * o.drop)
        world = new_world(settings)
        spin = [0.0, -o.backspin * o.speed / o.radius, 0.0]
        world.ball("ball", o.radius, o.mass, [0.0, 0.0, o.radius + o.drop], [o.speed, 0.0, 0.0], spin)
        world.plane("floor")
        world.contact("ball", "floor", pair, speed=landing)

        speeds = [landing * o.restitution**number for number in range(o.bounces + 1)]
        touching = sum(pair.contact_duration(o.mass, one) for one in speeds[: o.bounces])
        flying = (landing + 2.0 * sum(speeds[1:]) - speeds[-1]) / GRAVITY
        return world.record(touching + flying, INTERVAL)

    def ideals(self, recording: Recording) -> list[tuple[str, Recording]]:
        """Garwin's ideal ball from the same throw."""
        ideal = flight(recording, garwin, recording.facts["bounces"], float(recording.times[-1]))
        return [("Garwin's ideal ball: perfectly rough and elastic", ideal)]

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """The number of each bounce, below its place."""
        shown = [bounce for bounce in bounces_of(recording, "ball") if bounce.time < self.shown]
        return [(float(bounce.place[0]), 0.0, str(number)) for number, bounce in enumerate(shown, 1)]

    def caption(self, recording: Recording) -> str:
        """The spins of the flights shown."""
        return spins_in_words(recording, bounces_of(recording, "ball"), self.shown)

    def measure(self, recording: Recording) -> Measured:
        """Every bounce beside the reference, and the places where Garwin's ideal ball would bounce."""
        bounces = bounces_of(recording, "ball")[: recording.facts["bounces"]]
        ideal = flight(recording, garwin, recording.facts["bounces"])
        garwins = [
            {"time": one.time, "x": float(one.place[0]), "spin_after": float(one.spin_after[1])}
            for one in bounces_of(ideal, "ball")
        ]
        expected = flight(recording, by_reference(pair_of(recording.o), recording.o.mass), recording.facts["bounces"])
        told = turns([describe(one, recording.o) for one in bounces_of(expected, "ball")])
        more = {"asked_bounces": recording.facts["bounces"], "turns_reference": told}
        return settled(recording, bounces, **more, garwin=garwins)

    def check(self, measured: Measured) -> list[Limit]:
        """All bounces against the reference; at most one reversal of spin or direction fewer than in the reference."""
        bounces, wanted = measured["bounces"], measured["asked_bounces"]
        out = check_bounces(bounces, measured["law"], wanted)
        if measured["law"] == "microslip":
            for what, found, expected in zip(TURNS, turns(bounces), measured["turns_reference"], strict=True):
                out.append(Limit(f"bounces {what}", expected - 1, found, at_least=True))
        return out


def turns(bounces: list[Measured]) -> list[int]:
    """Number of bounces that reverse the spin, and of those that send the ball back, as defined by `TURNS`."""
    starts = [0.0, *(one["x"] for one in bounces)]
    return [
        sum(one["spin_before"] * one["spin_after"] < 0.0 for one in bounces),
        sum(one["velocity_after"][0] * (x - one["x"]) > 0.0 for one, x in zip(bounces, starts, strict=False)),
    ]
