"""A superball thrown with backspin: it comes back, again with backspin, and goes on to and fro."""

from __future__ import annotations

from math import sqrt
from typing import ClassVar

from contactlaw import checks
from sims.bounces import bounces_of
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Measured, Scene, Settings, register
from sims.superball import (
    BACKSPIN,
    GRAVITY,
    INTERVAL,
    MASS,
    MOST_BOUNCES,
    RADIUS,
    RESTITUTION,
    check_bounces,
    flight,
    garwin,
    pair_of,
    settled,
    spins_in_words,
)
from sims.worlds import new_world


@register
class Superball(Scene):
    """Thrown level, with backspin, over a floor."""

    name = "superball"
    title = "a superball with backspin bounces back and forth"
    engines = EVERYWHERE
    shown: ClassVar[float] = 0.92
    exposure, slow = 0.0505, 8.0
    beside_damped = True
    options = {
        "bounces": (6, f"how many, 1 to {MOST_BOUNCES}"),
        "speed": (2.0, "with which it is thrown, in m/s"),
        "backspin": (BACKSPIN, "R omega/v; 2.5: no angular momentum about the touch, it turns round at every bounce"),
        "drop": (0.2, "from the throw to the floor, in m"),
    }

    def run(self, settings: Settings) -> Recording:
        """Throw it."""
        self.demand(settings)
        count = int(self.option(settings, "bounces"))
        checks.number("bounces", count, f"1 to {MOST_BOUNCES}", low=1, high=MOST_BOUNCES)
        speed, backspin = self.option(settings, "speed"), self.option(settings, "backspin")
        drop = checks.positive("drop", self.option(settings, "drop"))
        pair = pair_of(settings)
        landing = sqrt(2.0 * GRAVITY * drop)

        world = new_world(settings)
        spin = [0.0, -backspin * speed / RADIUS, 0.0]
        world.ball("ball", RADIUS, MASS, [0.0, 0.0, RADIUS + drop], [speed, 0.0, 0.0], spin)
        world.plane("floor")
        world.contact("ball", "floor", pair, speed=landing)

        speeds = [landing * RESTITUTION**number for number in range(count + 1)]
        touching = sum(pair.contact_duration(MASS, one) for one in speeds[:count])
        flying = (landing + 2.0 * sum(speeds[1:]) - speeds[-1]) / GRAVITY
        return world.record(touching + flying, INTERVAL, material=pair.a.name, bounces=count)

    def ideals(self, recording: Recording) -> list[tuple[str, Recording]]:
        """Garwin's ball from the same throw."""
        ideal = flight(recording, garwin, recording.facts["bounces"], float(recording.times[-1]))
        return [("Garwin's ideal ball: perfectly rough and elastic", ideal)]

    def marks(self, recording: Recording) -> list[tuple[float, float, str]]:
        """The number of each bounce, under the place where it happens."""
        shown = [bounce for bounce in bounces_of(recording, "ball") if bounce.time < self.shown]
        return [(float(bounce.place[0]), 0.0, str(number)) for number, bounce in enumerate(shown, 1)]

    def caption(self, recording: Recording) -> str:
        """The spins of the flights shown."""
        return spins_in_words(recording, bounces_of(recording, "ball"), self.shown)

    def measure(self, recording: Recording) -> Measured:
        """Every bounce beside the reference, and where Garwin's ideal ball would bounce."""
        pair = pair_of(Settings(material=recording.facts["material"]))
        bounces = bounces_of(recording, "ball")[: recording.facts["bounces"]]
        ideal = flight(recording, garwin, recording.facts["bounces"])
        garwins = [
            {"time": one.time, "x": float(one.place[0]), "spin_after": float(one.spin_after[1])}
            for one in bounces_of(ideal, "ball")
        ]
        return settled(recording, pair, bounces, asked_bounces=recording.facts["bounces"], garwin=garwins)

    def check(self, measured: Measured) -> list[Limit]:
        """The bounces against the reference; that spin and direction turn round in all but one of them at least."""
        bounces, wanted = measured["bounces"], measured["asked_bounces"]
        out = check_bounces(bounces, measured["law"], wanted)
        if measured["law"] == "microslip":
            reversed_ = sum(one["spin_before"] * one["spin_after"] < 0.0 for one in bounces)
            starts = [0.0, *(one["x"] for one in bounces)]
            back = sum(one["velocity_after"][0] * (x - one["x"]) > 0.0 for one, x in zip(bounces, starts, strict=False))
            out.append(Limit("bounces that reverse the spin", wanted - 1, reversed_, at_least=True))
            out.append(Limit("bounces after which it flies towards the last one", wanted - 1, back, at_least=True))
        return out
