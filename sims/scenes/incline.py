"""Two balls are sent up an incline: one grips and rolls, the other, of less friction, slips all the way.

A ball that rolls needs friction of 2/7 of the downhill pull; it has it as long as tan(angle) <= 7/2 mu. Either way the
motion is closed form, with d the acceleration of the centre down the slope and s that of the rim:

    rolls    d = s = 5/7 g sin(angle)
    slips    d = g (sin(angle) - mu cos(angle))        s = 5/2 mu g cos(angle)

so that a ball sent up at speed v turns at the height v^2 sin(angle)/(2 d) and comes back with v; for the one that rolls
that is 7/10 v^2/g, at any angle. All laws of friction give these motions, so that rigid friction, the simplest, will
do. (By those with springs the balls are put down without traction, which takes some 0.1 ms of slip to build up: 1e-4 of
the speed on a slope of 25 degrees.) Source: any textbook of mechanics; I = 2/5 m R^2, Coulomb friction.
"""

from __future__ import annotations

from math import cos, pi, radians, sin, tan

import numpy as np

from contactlaw import MATERIALS, ContactPair, checks
from sims.contact_point import Array, contact_velocity, static_overlap
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVE, Limit, Measured, Scene, Settings, register
from sims.worlds import new_world

GRAVITY = 9.81  # [m/s^2]
RADIUS = 0.0254  # [m]
RESTITUTION = 0.93
LANES = {"grips": 0.1, "slips": -0.1}  # balls and where they go, across [m]


@register
class Incline(Scene):
    """Up a slope and back, gripping and slipping."""

    name = "incline"
    title = "two balls sent up an incline: one rolls, one slips; heights and accelerations against the closed form"
    engines = EVERYWHERE
    options = {
        "angle": (10.0, "of the incline, in degrees"),
        "speed": (1.0, "up the incline at the start, in m/s"),
        "friction": (0.115, "of the ball that is to roll"),
        "slippery": (0.02, "friction of the other"),
    }

    def run(self, settings: Settings) -> Recording:
        """Both balls start rolling, with the overlap that they rest with, and come back past their start."""
        self.demand(settings)
        angle = radians(checks.number("angle", self.option(settings, "angle"), "in (0, 90)", low=0.0, high=90.0))
        speed = checks.positive("speed", self.option(settings, "speed"))
        material = MATERIALS[settings.material or "steel"]
        mass = 4.0 / 3.0 * pi * RADIUS**3 * (material.density or 1000.0)
        uphill, normal = np.array([cos(angle), 0.0, sin(angle)]), np.array([-sin(angle), 0.0, cos(angle)])
        frictions = {
            name: self.option(settings, option) for name, option in zip(LANES, ("friction", "slippery"), strict=True)
        }

        world = new_world(settings, gravity=(0.0, 0.0, -GRAVITY))
        world.plane("slope", normal=normal)
        for name, friction in frictions.items():
            pair = ContactPair(material, material, friction, RESTITUTION, law="coulomb")
            sunk = static_overlap(pair, mass * GRAVITY * cos(angle), RADIUS)
            start = (RADIUS - sunk) * normal + [0.0, LANES[name], 0.0]
            world.ball(name, RADIUS, mass, start, speed * uphill, [0.0, speed / RADIUS, 0.0])
            world.contact(name, "slope", pair)
        slowest = min(acceleration(angle, friction)[0] for friction in frictions.values())
        return world.record(2.2 * speed / slowest, angle=angle, speed=speed, frictions=frictions)

    def marks(self, recording: Recording) -> list[tuple[float, float, str]]:
        """Which ball turned where."""
        tops = {
            name: recording.track(name).positions[np.argmax(recording.track(name).positions[:, 2])] for name in LANES
        }
        return [(float(top[0]), float(top[2]) - 1.4 * RADIUS, name) for name, top in tops.items()]

    def caption(self, recording: Recording) -> str:
        """What to see: the ball that slips is braked by all of gravity but friction, and turns lower."""
        balls = self.measure(recording)["balls"]
        heights = ", ".join(f"{name} {1e3 * ball['turning_height']:.1f}" for name, ball in balls.items())
        return f"both start rolling at {recording.facts['speed']:g} m/s; turn at a height [mm]: {heights}"

    def measure(self, recording: Recording) -> Measured:
        """Accelerations fitted to the whole run, turning heights, speeds on the way back, and the closed form's."""
        facts, times = recording.facts, recording.times
        angle, speed = facts["angle"], facts["speed"]
        uphill, normal = np.array([cos(angle), 0.0, sin(angle)]), np.array([-sin(angle), 0.0, cos(angle)])
        out: Measured = recording.told()
        out |= {"angle_degrees": float(np.degrees(angle)), "balls": {}}
        for name, friction in facts["frictions"].items():
            track = recording.track(name)
            centre, height = track.velocities @ uphill, track.positions @ normal
            rim = centre - contact_velocity(track.velocities, track.spins, normal, RADIUS) @ uphill
            down, rim_down = acceleration(angle, friction)
            back = int(np.argmin(np.abs(times - 2.0 * speed / down)))
            out["balls"][name] = {
                "friction": friction,
                "rolls": tan(angle) <= 3.5 * friction,
                "acceleration": -slope(times, centre), "acceleration_closed_form": down,
                "rim": -slope(times, rim), "rim_closed_form": rim_down,
                "turning_height": float(np.ptp(track.positions[:back, 2])) if back > 1 else 0.0,
                "turning_height_closed_form": speed**2 * sin(angle) / (2.0 * down),
                "speed_back": float(-centre[back] + down * (2.0 * speed / down - times[back])),
                "speed_back_closed_form": speed,
                "change_of_distance": float(np.ptp(height)) / RADIUS,
            }  # fmt: skip
        return out

    def check(self, measured: Measured) -> list[Limit]:
        """Each against the closed form, to a thousandth; no ball leaves the slope or sinks into it."""
        if measured["law"] in (NATIVE, "linear_spring"):  # the overlap at the start is that of Hertz
            return []
        out = []
        for name, ball in measured["balls"].items():
            for what in ("acceleration", "rim", "turning_height", "speed_back"):
                error = abs(ball[what] / ball[f"{what}_closed_form"] - 1.0)
                out.append(Limit(f"error of the {what.replace('_', ' ')}, ball that {name}", 1e-3, error))
            out.append(
                Limit(f"change of distance from the slope over R, ball that {name}", 1e-8, ball["change_of_distance"])
            )
        return out


def acceleration(angle: float, friction: float) -> tuple[float, float]:
    """Of centre and rim, down the slope [m/s^2], of a ball that started rolling; angle in rad."""
    if tan(angle) <= 3.5 * friction:
        return 5.0 / 7.0 * GRAVITY * sin(angle), 5.0 / 7.0 * GRAVITY * sin(angle)
    return GRAVITY * (sin(angle) - friction * cos(angle)), 2.5 * friction * GRAVITY * cos(angle)


def slope(times: Array, values: Array) -> float:
    """Of the straight line through values over time."""
    return float(np.polyfit(times, values, 1)[0])
