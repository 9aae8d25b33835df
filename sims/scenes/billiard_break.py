"""A break at billiards: a cue ball rolls into fifteen balls that touch each other.

All balls of the rack are struck at once, as in a cradle. The cue ball keeps its spin: it stops, then rolls on. The aim
is straight and the rack is symmetric, so each ball must move as the mirror image of its partner. Energy must not grow,
whatever the contacts do. Balls and table as in `billiards`.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import static_overlap
from sims.options import Option, of_ball, seconds, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVES, Limit, Mark, Measured, Scene, Settings, register, signed
from sims.scenes.billiards import GRAVITY, PHENOLIC, TABLE
from sims.worlds import new_world

ROWS = 5
WAY, LEAD = 0.15, 1.0  # from the cue ball to the rack [m], and the longest time for it [s]
MOVES = 0.0025  # part of the cue ball's speed with which a ball counts as moving


@register
class BilliardBreak(Scene):
    """Seen from above."""

    name = "billiard_break"
    title = "a billiard break: a cue ball rolls into a rack of fifteen balls"
    engines = EVERYWHERE
    shown, exposure, slow = 0.4, 0.1, 8.0
    apart = True
    native_step = 1e-4
    material = None
    options = {
        "speed": speed(4.0, "speed of the cue ball", most=50.0),
        "gap": Option(0.0, "gap between the balls of the rack, in m", 0.0, 0.1),
        "seconds": seconds(0.5),
    } | of_ball(0.02625, 0.06, 0.95, mass=0.1406)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Roll the cue ball into the resting rack."""
        world = new_world(settings, (0.0, 0.0, -GRAVITY))
        world.plane("table")
        height = o.radius - static_overlap(TABLE, o.mass * GRAVITY, o.radius)
        pitch, way = 2.0 * o.radius + o.gap, min(WAY, LEAD * o.speed)
        world.ball("cue", o.radius, o.mass, (-way, 0.0, height), (o.speed, 0.0, 0.0), (0.0, o.speed / o.radius, 0.0))
        for row in range(ROWS):
            for place in range(row + 1):
                x, y = 0.75**0.5 * pitch * row + 2.0 * o.radius, pitch * (place - 0.5 * row)
                world.ball(f"{row}-{place}", o.radius, o.mass, (x, y, height))
        balls = [body.name for body in world.bodies]
        world.contact(balls, "table", replace(TABLE, radius=o.radius))
        world.contact(balls, balls, ContactPair(PHENOLIC, PHENOLIC, o.friction, o.restitution), speed=o.speed)
        recording = world.record(way / o.speed + o.seconds)
        recording.view = (0, 1)
        return recording

    def measure(self, recording: Recording) -> Measured:
        """Distance of balls from their mirror images, and the speeds and energy left."""
        energy = np.sum([track.energy((0.0, 0.0, -GRAVITY)) for track in recording.tracks], axis=0)
        energy -= sum(track.mass for track in recording.tracks) * GRAVITY * recording.tracks[0].positions[0, 2]
        partners = [(f"{row}-{place}", f"{row}-{row - place}") for row in range(ROWS) for place in range(row + 1)]
        ways = [[recording.track(name).positions for name in pair] for pair in partners]
        off = max(float(np.abs(one - two * [1.0, -1.0, 1.0]).max()) for one, two in ways)
        speeds = {track.name: float(np.linalg.norm(track.velocities[-1])) for track in recording.tracks}
        cue = recording.track("cue").velocities[:, 0]
        moving = sum(one > MOVES * recording.o.speed for one in speeds.values())
        return recording.told() | {
            "speed": recording.o.speed, "cue_velocity_least": float(cue.min()), "cue_velocity_after": float(cue[-1]),
            "fastest_velocity_after": max(speeds.values()), "moving": moving,
            "off_the_mirror": off, "energy_ratio": float(energy[-1] / energy[0]),
            "energy_gained": float(energy.max() / energy[0] - 1.0),
        }  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """Mirror symmetry, all balls moving, and no energy gained."""
        if measured["law"] in NATIVES:
            return []
        return [
            Limit("greatest distance of a ball from its partner's mirror image", 1e-3, measured["off_the_mirror"], "m"),
            Limit("balls that move", 12, measured["moving"], at_least=True),
            Limit("energy gained, over that at the start", 1e-6, measured["energy_gained"]),
        ]

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """The label of the cue ball."""
        x, y, _ = recording.track("cue").positions[entry]
        return [(x, y - recording.o.radius, "cue")]

    def caption(self, recording: Recording) -> str:
        """How many balls move, and how fast."""
        told = self.measure(recording)
        return (f"cue ball {told['speed']:g} m/s, after {signed(told['cue_velocity_after'], 2)} m/s; fastest "
                f"{told['fastest_velocity_after']:.2f} m/s")  # fmt: skip
