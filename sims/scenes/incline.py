"""Two balls are sent up an incline: one rolls, the other, with less friction, slips all the way.

A rolling ball needs a friction force of 2/7 of the downhill force, so it rolls if tan(angle) <= 7/2 mu. Both motions
have a closed form, with d the acceleration of the centre down the slope and s that of the rim:

    rolls    d = s = 5/7 g sin(angle)
    slips    d = g (sin(angle) - mu cos(angle))        s = 5/2 mu g cos(angle)

so that a ball sent up at speed v turns at the height v^2 sin(angle)/(2 d) and comes back with v. For the rolling ball
this height is 7/10 v^2/g at any angle. All laws of friction give these motions, so the simplest, rigid friction,
suffices. (With laws that have springs the balls start without traction, which builds up during some 0.1 ms of slip:
1e-4 of the speed on a slope of 25 degrees.) Source: any textbook of mechanics; I = 2/5 m R^2, Coulomb friction.
"""

from __future__ import annotations

from math import cos, radians, sin, tan
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array, contact_velocity, static_overlap
from sims.options import Option, ball_mass, of_ball, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVE, Limit, Mark, Measured, Scene, Settings, register
from sims.worlds import new_world

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GRAVITY = 9.81  # [m/s^2]
LANES = {"grips": 0.1, "slips": -0.1}  # balls and where they go, across [m]


@register
class Incline(Scene):
    """Up a slope and back, gripping and slipping."""

    name = "incline"
    title = "two balls sent up an incline, one rolling, one slipping: heights and accelerations against the closed form"
    engines = EVERYWHERE
    options = {
        "angle": Option(10.0, "angle of the incline, in degrees", 1.0, 80.0),
        "speed": speed(1.0, "speed up the incline at the start", most=20.0),
        "slippery": Option(0.02, "friction of the ball that slips", 0.0, 10.0),
    } | of_ball(0.0254, 0.115, 0.93)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Start both balls rolling, with their static overlap, and record until they come back past their start."""
        angle, mass = radians(o.angle), o.mass or ball_mass(o.material, o.radius)
        uphill, normal = directions(angle)
        frictions = dict(zip(LANES, (o.friction, o.slippery), strict=True))

        world = new_world(settings, gravity=(0.0, 0.0, -GRAVITY))
        world.plane("slope", normal=normal)
        for name, friction in frictions.items():
            pair = ContactPair(o.material, o.material, friction, o.restitution, law="coulomb")
            sunk = static_overlap(pair, mass * GRAVITY * cos(angle), o.radius)
            start = (o.radius - sunk) * normal + [0.0, LANES[name], 0.0]
            world.ball(name, o.radius, mass, start, o.speed * uphill, [0.0, o.speed / o.radius, 0.0])
            world.contact(name, "slope", pair)
        slowest = min(acceleration(angle, friction)[0] for friction in frictions.values())
        return world.record(2.2 * o.speed / slowest, frictions=frictions)

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """The height at which each ball turns."""
        tracks = [recording.track(name) for name in LANES]
        tops = [track.positions[np.argmax(track.positions[:, 2])] for track in tracks]
        return [(top[0], top[2] - 1.4 * track.size[0], track.name) for track, top in zip(tracks, tops, strict=True)]

    def caption(self, recording: Recording) -> str:
        """The speed, and the heights at which the balls turn."""
        balls = self.measure(recording)["balls"]
        heights = ", ".join(f"{name} {1e3 * ball['turning_height']:.1f}" for name, ball in balls.items())
        return f"both start rolling at {recording.facts['speed']:g} m/s; turn at a height [mm]: {heights}"

    def figure(self, settings: Settings, recording: Recording) -> Figure:
        """Distance up the slope over time, every 50 ms, beside the closed form."""
        from matplotlib.figure import Figure

        from sims.panel import TONES

        o, times = recording.o, recording.times
        uphill, _ = directions(radians(o.angle))
        figure = Figure(figsize=(7.0, 4.0), layout="constrained")
        axes = figure.subplots()
        for (name, friction), marker, dash in zip(o.frictions.items(), "os", ("-", "--"), strict=True):
            rate, rim = acceleration(radians(o.angle), friction)
            told = f"{name}, mu = {friction:g}: centre {rate:.3g} m/s\N{SUPERSCRIPT TWO} down, rim {rim:.3g}"
            way = (recording.track(name).positions - recording.track(name).positions[0]) @ uphill
            every = np.searchsorted(times, np.arange(0.0, times[-1], 0.05))
            axes.plot(times, o.speed * times - 0.5 * rate * times**2, dash, color="0.4", linewidth=1.0)
            axes.plot(times[every], way[every], marker, color=TONES["law"]["dark"], label=told, markersize=5,
                      markerfacecolor=TONES["law"]["light"])  # fmt: skip
        axes.plot([], [], "-", color="0.4", label="closed form")
        axes.set(xlabel="time [s]", ylabel="way up the slope [m]")
        axes.set_title(f"{o.angle:g} degrees, {self.caption(recording)}", loc="left", fontsize=9)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
        return figure

    def measure(self, recording: Recording) -> Measured:
        """Accelerations fitted to the whole run, turning heights and return speeds, beside the closed form."""
        o, times = recording.o, recording.times
        angle = radians(o.angle)
        uphill, normal = directions(angle)
        out: Measured = recording.told()
        out |= {"angle_degrees": o.angle, "balls": {}}
        for name, friction in o.frictions.items():
            track = recording.track(name)
            centre, height = track.velocities @ uphill, track.positions @ normal
            rim = centre - contact_velocity(track.velocities, track.spins, normal, o.radius) @ uphill
            down, rim_down = acceleration(angle, friction)
            back = int(np.argmin(np.abs(times - 2.0 * o.speed / down)))
            out["balls"][name] = {
                "friction": friction,
                "rolls": tan(angle) <= 3.5 * friction,
                "acceleration": -slope(times, centre), "acceleration_closed_form": down,
                "rim": -slope(times, rim), "rim_closed_form": rim_down,
                "turning_height": float(np.ptp(track.positions[:back, 2])) if back > 1 else 0.0,
                "turning_height_closed_form": o.speed**2 * sin(angle) / (2.0 * down),
                "speed_back": float(-centre[back] + down * (2.0 * o.speed / down - times[back])),
                "speed_back_closed_form": o.speed,
                "change_of_distance": float(np.ptp(height)) / o.radius,
            }  # fmt: skip
        return out

    def check(self, measured: Measured) -> list[Limit]:
        """All against the closed form, to 1e-3; no ball leaves the slope or sinks into it."""
        if measured["law"] in (NATIVE, "linear_spring"):  # the overlap at the start is that of Hertz
            return []
        out = []
        for name, ball in measured["balls"].items():
            for what in ("acceleration", "rim", "turning_height", "speed_back"):
                told = ball[f"{what}_closed_form"]  # without friction the rim goes on at its speed
                error = abs(ball[what] - told) / (told or ball["acceleration_closed_form"])
                out.append(Limit(f"error of the {what.replace('_', ' ')}, ball that {name}", 1e-3, error))
            out.append(
                Limit(f"change of distance from the slope over R, ball that {name}", 1e-8, ball["change_of_distance"])
            )
        return out


def directions(angle: float) -> tuple[Array, Array]:
    """Unit vectors up the slope and along its normal; angle in rad."""
    return np.array([cos(angle), 0.0, sin(angle)]), np.array([-sin(angle), 0.0, cos(angle)])


def acceleration(angle: float, friction: float) -> tuple[float, float]:
    """Accelerations of centre and rim down the slope [m/s^2] of a ball that starts rolling; angle in rad."""
    if tan(angle) <= 3.5 * friction:
        return 5.0 / 7.0 * GRAVITY * sin(angle), 5.0 / 7.0 * GRAVITY * sin(angle)
    return GRAVITY * (sin(angle) - friction * cos(angle)), 2.5 * friction * GRAVITY * cos(angle)


def slope(times: Array, values: Array) -> float:
    """Slope of the straight line fitted to values over time."""
    return float(np.polyfit(times, values, 1)[0])
