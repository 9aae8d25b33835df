"""A coin wobbles down on a table, like Euler's disk: the flatter it lies, the faster it precesses.

While its centre stands still and its rim rolls, a thin disk of radius a at an angle alpha to the table precesses at

    Omega = 2 sqrt(g/(a sin(alpha)))

which grows without bound as it falls. For a coin of half thickness h with rounded edges of radius r, centre C,
direction e down along its face and axis n, the contact point is at C + A e - H n with A = a - r (1 - sin(alpha)) and H
= h - r (1 - cos(alpha)). With w the spin about the axis, which friction about the vertical changes, rolling without
slip and the torque of weight and friction about C give

    Omega^2 s (c I + m H B) - Omega w (s J + m A B) = m g (A c - H s)        B = A s + H c

with s = sin(alpha), c = cos(alpha), and moments of inertia I across the axis and J about it; the centre stands still
where w = Omega s H/A. Rolling resistance takes the energy, slowly enough for this to hold at each instant. Sources: the
thin disk, H. K. Moffatt, Nature 404 (2000) 833; the rest, Newton's laws.
"""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array
from sims.options import Option, of_contact, seconds
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVE, NATIVES, NONE, Limit, Measured, Scene, Settings, register
from sims.worlds import new_world

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GRAVITY = 9.81  # [m/s^2]
EDGE = 0.1  # radius of the edges, over half the thickness: as boxes and cylinders have it
FLAT = radians(4.0)  # down to which it is compared
WINDOW = 0.1  # [s] over which a wobble of its own is averaged


@register
class Coin(Scene):
    """The coin starts in steady precession, its centre at rest."""

    name = "coin"
    title = "a coin wobbles down: the flatter it lies, the faster it precesses"
    engines = EVERYWHERE
    slow = 4.0
    native_step = 2e-4
    shown = 1.2
    exposure = 0.12
    apart = True
    options = {
        "angle": Option(35.0, "angle to the table at the start, in degrees", 5.0, 60.0),
        "radius": Option(0.0129, "radius of the coin, in m", 1e-3, 1.0),
        "thickness": Option(0.0022, "thickness of the coin, in m", 1e-4, 0.1),
        "rolling": Option(0.03, "coefficient of rolling resistance", 0.0, 1.0),
        "mass": Option(8.5e-3, "mass of the coin, in kg", 1e-6, 1e4),
        "seconds": seconds(1.6, 0.2),
    } | of_contact(0.4, 0.5)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Start in the steady motion of the angle asked for."""
        alpha = radians(o.angle)
        s, c, r = np.sin(alpha), np.cos(alpha), 0.5 * EDGE * o.thickness
        down, axis = np.array([c, 0.0, -s]), np.array([s, 0.0, c])
        rate, out, back = rolling(alpha, o)
        spin = rate * s * (-down + back / out * axis)
        height = (o.radius - r) * s + (0.5 * o.thickness - r) * c + r
        world = new_world(settings, (0.0, 0.0, -GRAVITY))
        turn = np.column_stack([down, [0.0, 1.0, 0.0], axis])
        world.cylinder("coin", o.radius, 0.5 * o.thickness, o.mass, (0.0, 0.0, height), spin=spin, rotation=turn)
        world.plane("table")
        pair = ContactPair(o.material, o.material, o.friction, o.restitution, rolling_resistance=o.rolling)
        world.contact("coin", "table", pair, speed=0.1)
        return world.record(o.seconds)

    def measure(self, recording: Recording) -> Measured:
        """Angle and rate of precession, means over a tenth of a second, beside the closed form at the same angle."""
        times, angles, rates, axial = wobble(recording)
        high = angles > FLAT
        measured, expected = rates[high], rolling(angles[high], recording.o, axial[high])[0]
        energy = recording.tracks[0].energy((0.0, 0.0, -GRAVITY))
        return recording.told("rolling") | {
            "angle_first_degrees": float(np.degrees(angles[0])), "angle_last_degrees": float(np.degrees(angles[-1])),
            "rate_first": float(rates[0]), "rate_highest": float(measured.max(initial=0.0)),
            "rate_error": float(np.abs(measured / expected - 1.0).max(initial=0.0)),
            "compared_until": float(times[high][-1]) if high.any() else 0.0,
            "energy_ratio": float(energy[-1] / energy[0]), "energy_rise": float(np.diff(energy).max() / energy[0]),
        }  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """Rate by the closed form at every angle; the coin falls and precesses faster; it never gains energy."""
        if measured["law"] in NATIVES or measured["rolling"] == 0.0:
            return []
        return [
            Limit("error of the mean rate of precession", 0.02, measured["rate_error"]),
            Limit(
                "highest rate of precession over the first",
                1.2,
                measured["rate_highest"] / measured["rate_first"],
                at_least=True,
            ),
            Limit("energy gained in a step, over that at the start", 1e-4, measured["energy_rise"]),
        ]

    def caption(self, recording: Recording) -> str:
        """Angles and rates."""
        measured = self.measure(recording)
        first, rates = measured["angle_first_degrees"], (measured["rate_first"], measured["rate_highest"])
        return f"precession at {rates[0]:.0f} rad/s at {first:.0f}\N{DEGREE SIGN}, then up to {rates[1]:.0f} rad/s"

    def figure(self, settings: Settings, recording: Recording) -> Figure:
        """Angle and rate over time, and the rate over the angle beside the closed form."""
        from matplotlib.figure import Figure

        from sims.panel import TONES, title_of

        runs = [(recording, "law", "o")]
        if settings.law not in NATIVES and settings.engine != NONE:
            runs.append((self.run(replace(settings, law=NATIVE, timestep=self.native_step)), "native", "^"))
        figure = Figure(figsize=(8.6, 3.8), layout="constrained")
        over_time, over_angle = figure.subplots(1, 2)
        for one, kind, marker in runs:
            times, angles, rates, _ = wobble(one)
            style = {"color": TONES[kind]["dark"], "markerfacecolor": "none", "label": title_of(self, one)}
            over_time.plot(times, np.degrees(angles), marker, **style)
            over_angle.plot(np.degrees(angles), rates, marker, **style)
        _, angles, _, axial = wobble(recording)
        seen = angles > np.radians(0.5)
        angles, axial = angles[seen], axial[seen]
        told = rolling(angles, recording.o, axial)[0]
        over_angle.plot(np.degrees(angles), told, "k--", linewidth=1.0, label="closed form, its spin about the axis")
        alpha, most = np.radians(np.linspace(2.0, recording.o.angle + 2.0, 100)), 1.3 * recording.o.angle
        told = rolling(alpha, recording.o)[0]
        over_angle.plot(np.degrees(alpha), told, "k-", linewidth=1.0, label="closed form, its middle at rest")
        over_time.set(xlabel="time [s]", ylabel="angle to the table [degrees]", ylim=(0.0, most))
        over_angle.set(xlabel="angle to the table [degrees]", ylabel="rate of precession [rad/s]")
        over_angle.set(xscale="log", yscale="log", xlim=(0.5, 1.2 * most))
        over_angle.set_xticks([1, 3, 10, 30], ["1", "3", "10", "30"])
        over_angle.set_yticks([20, 50, 100, 200, 500], ["20", "50", "100", "200", "500"])
        over_angle.minorticks_off()
        over_angle.legend(fontsize=8)
        for axes in (over_time, over_angle):
            axes.grid(alpha=0.3)
        return figure


def rolling(alpha: Any, o: Any, axial: Any = None) -> tuple[Any, Any, Any]:
    """Omega [rad/s] at an angle [rad], and A and H of the point of touch [m].

    axial: Spin about the axis [rad/s]; None: that with which the middle stands still.
    """
    s, c, h = np.sin(alpha), np.cos(alpha), 0.5 * o.thickness
    out, back = o.radius - EDGE * h * (1.0 - s), h - EDGE * h * (1.0 - c)
    across, about = 0.25 * o.radius**2 + h**2 / 3.0, 0.5 * o.radius**2
    weight = GRAVITY * np.maximum(out * c - back * s, 0.0)
    if axial is None:
        return np.sqrt(weight / (s * (across * c - about * s * back / out))), out, back
    lever = out * s + back * c
    square, line = s * (c * across + back * lever), axial * (s * about + out * lever)
    return (line + np.sqrt(line**2 + 4.0 * square * weight)) / (2.0 * square), out, back


def wobble(recording: Recording) -> tuple[Array, Array, Array, Array]:
    """Means of time [s], angle [rad], rate of precession and spin about the axis [rad/s] over windows."""
    track, step = recording.tracks[0], float(recording.times[1])
    axes = track.rotations[:, :, 2]
    turned, spins = np.unwrap(np.arctan2(axes[:, 1], axes[:, 0])), (track.spins * axes).sum(axis=1)
    each = max(1, round(WINDOW / step))
    starts = np.arange(0, axes.shape[0] - each, each)
    means = [[values[i : i + each].mean() for i in starts] for values in (np.arccos(np.clip(axes[:, 2], -1, 1)), spins)]
    rates = (turned[starts + each] - turned[starts]) / (each * step)
    return recording.times[starts] + 0.5 * WINDOW, np.array(means[0]), rates, np.array(means[1])
