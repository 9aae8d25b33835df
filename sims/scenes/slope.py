"""A box lies on a slope of 20 degrees for a minute: with the law it stays at rest, on a soft constraint it creeps.

Friction exceeds what the slope needs (mu > tan(angle)), so by Coulomb's law nothing slides; elastic corners yield once,
by some nm. MuJoCo's constraints are regularised: a held body moves at a velocity in proportion to the force, whatever
mu is (MuJoCo's documentation, "Computation", on the constraint model). Elliptic cones, a larger `impratio` and
`noslip_iterations` reduce the creep: `--best 1`.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array
from sims.options import Option, of_contact, seconds
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVE, Limit, Measured, Scene, Settings, plain, register
from sims.worlds import new_world
from sims.worlds.parts import onto

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HALF, MASS = 0.05, 1.0  # [m], [kg]
DROP = 1e-4  # [m], of the box over the slope at the start
EVERY, LANDED = 0.02, 0.5  # [s] between two entries, and until when it has landed
IMPRATIO, NOSLIP = 10.0, 10
BEST = Option(0, f"1: native contact with elliptic cones, impratio {IMPRATIO:g}, {NOSLIP} noslip iterations", 0, 1)


@register
class Slope(Scene):
    """The picture shows the distance down the slope since landing, in um, on a logarithmic axis."""

    name = "slope"
    title = "a box lies on a slope for a minute: how fast it creeps"
    engines = EVERYWHERE
    slow = 0.05
    options = {
        "angle": Option(20.0, "angle of the slope, in degrees", 0.1, 80.0),
        "mass": Option(MASS, "mass of the box, in kg", 1e-3, 1e4),
        "seconds": seconds(60.0, 2.0, 1e5),
        "best": BEST,
    } | of_contact(0.5, 0.5)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Release the box just above the slope."""
        return built(settings, o).record(o.seconds, every=EVERY)

    def measure(self, recording: Recording) -> Measured:
        """Creep from half a second on, and the time of landing."""
        times, way = recording.times, _way(recording)
        after = times >= LANDED
        fit = np.polyfit(times[after], way[after], 1)[0]
        return recording.told("friction") | {
            "angle_degrees": recording.o.angle,
            "seconds": float(times[-1]),
            "creep_um_per_s": float(1e6 * (way[-1] - way[after][0]) / (times[-1] - times[after][0])),
            "creep_fitted_um_per_s": float(1e6 * fit),
            "way_um": float(1e6 * np.abs(way).max()),
        }

    def check(self, measured: Measured) -> list[Limit]:
        """No creep; no limit for the engine's own contact, or where Coulomb's law lets the box slide."""
        if measured["law"] == NATIVE or np.tan(np.radians(measured["angle_degrees"])) >= measured["friction"]:
            return []
        return [
            Limit("creep once it has landed", 1e-4, abs(measured["creep_um_per_s"]), "um/s"),
            Limit("the same, fitted", 1e-4, abs(measured["creep_fitted_um_per_s"]), "um/s"),
        ]

    def caption(self, recording: Recording) -> str:
        """The rate of creep."""
        return f"creep {plain(abs(self.measure(recording)['creep_um_per_s']), 2)} um/s"

    def figure(self, settings: Settings, recording: Recording) -> Figure | None:
        """Distance since landing over time, beside MuJoCo's own contact by default and with its best settings."""
        from matplotlib.figure import Figure

        curves = [(f"contactlaw, step {1e3 * settings.step:.3g} ms", recording, "-", "#1f4e9c")]
        if settings.law != NATIVE:
            own = replace(settings, engine="mujoco", law=NATIVE, watch=0.0)
            best = replace(own, options=dict(settings.options) | {"best": 1.0})
            names = "MuJoCo's own contact, default", f"elliptic, impratio {IMPRATIO:g}, {NOSLIP} noslip iterations"
            curves += [(names[0], self.run(own), "--", "#d9730d"), (names[1], self.run(best), "-.", "#777777")]
        figure = Figure(figsize=(7.0, 4.2), layout="constrained")
        axes = figure.subplots()
        for name, one, line, colour in curves:
            after = one.times >= LANDED
            way = 1e6 * np.abs(_way(one)[after] - _way(one)[after][0])
            label = f"{name}: {plain(abs(self.measure(one)['creep_um_per_s']), 2)} um/s"
            axes.plot(one.times[after], np.maximum(way, FLOOR_UM), line, color=colour, label=label)
        axes.set_yscale("log")
        axes.set(xlabel="time [s]", ylabel=f"way down the slope since {LANDED:g} s [um]", ylim=(0.5 * FLOOR_UM, None))
        axes.annotate("0 is drawn here", (0.99, FLOOR_UM), xycoords=("axes fraction", "data"), xytext=(0, 3),
                      textcoords="offset points", ha="right", fontsize=8)  # fmt: skip
        o = recording.o
        axes.set_title(f"a box of {o.mass:g} kg, slope of {o.angle:g} degrees, mu = {o.friction:g}", loc="left",
                       fontsize=10)  # fmt: skip
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 0.15))
        return figure


def built(settings: Settings, o: Any) -> Any:
    """Build the world, with the box just above the slope."""
    angle = radians(o.angle)
    normal = np.array([-sin(angle), 0.0, cos(angle)])
    world: Any = new_world(settings)
    world.plane("slope", normal=normal)
    world.box("box", (HALF,) * 3, o.mass, (HALF + DROP) * normal, rotation=onto(normal))
    if settings.law == NATIVE:
        world.native(o.friction, 0.0)
        if o.best and settings.engine == "mujoco":
            set_best(world.spec.option)
    else:
        world.contact("box", "slope", ContactPair(o.material, o.material, o.friction, o.restitution))
    return world


FLOOR_UM = 1e-10  # the least that places of doubles tell apart, and where nothing is drawn


def set_best(option: Any) -> None:
    """Apply MuJoCo's settings against creep."""
    import mujoco

    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # type: ignore[attr-defined]
    option.impratio, option.noslip_iterations = IMPRATIO, NOSLIP


def _way(recording: Recording) -> Array:
    """Distance of the box down the slope from its start [m], shape (n,)."""
    angle = radians(recording.o.angle)
    places = recording.track("box").positions
    return -(places - places[0]) @ np.array([cos(angle), 0.0, sin(angle)])
