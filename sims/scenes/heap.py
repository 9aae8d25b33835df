"""Steel balls are poured into a box, collide, slide, roll and come to rest: all of them sleep.

Rolling costs what hysteresis takes, a few ten-thousandths of the load; without it a ball that ends up alone on the
floor, under an arch of others, would roll to and fro for ever.

Two requirements hold for any contact law: floor and walls carry the weight, sum F_z = N m g, and the sum of kinetic,
potential and elastic energy never grows.
"""

from typing import Any

import numpy as np

from sims import heap
from sims.options import Option
from sims.recording import Recording
from sims.scene import NATIVE, NONE, Limit, Measured, Scene, Settings, register

LONGEST, EVERY, STILL = 12.0, 0.02, 0.3  # [s] to wait, between two entries, and asleep at the end


@register
class Heap(Scene):
    """Seen through a wall. The table compares processor time with MuJoCo's own contact, with both solvers."""

    name = "heap"
    title = "steel balls poured into a box come to rest and sleep: support, energy and cost"
    engines = ("mujoco", NONE)
    unable = {"pybullet": "reading so many balls costs more than moving them"}
    shown = 0.6
    exposure = 0.12
    apart = True
    options = {"balls": Option(64, "number of balls", 1, 10000)} | heap.OPTIONS

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Run until all have slept for a while; then time it again beside MuJoCo's own contact."""
        world = heap.poured(settings, o.balls, o=o, rolling=heap.rolling_loss(o))
        weight = o.balls * heap.mass_of(o) * heap.GRAVITY
        seen: dict[str, Any] = {"settled": None, "rise": 0.0, "support": 0.0}
        energies: list[float] = []

        def look() -> bool:
            if settings.law == NATIVE:
                return False
            if settings.engine == NONE:
                energies.append(world.world.energy.total)
            if seen["settled"] is None and heap.asleep(world).all():
                seen["settled"] = world.time
                seen["support"] = heap.support(world) / weight
            return seen["settled"] is not None and world.time > seen["settled"] + STILL

        recording = world.record(LONGEST, EVERY, look, weight=weight)
        if energies:
            seen["rise"] = float(np.diff(energies).max() / energies[0])
        if settings.engine == "mujoco" and settings.law != NATIVE:
            seen["cost"] = heap.costs(o.balls, LONGEST, step=settings.step, o=o)
        recording.facts |= {"seen": seen}
        return recording

    def measure(self, recording: Recording) -> Measured:
        """Time until it sleeps, support force, deepest overlap with a wall, and costs."""
        facts, seen = recording.facts, recording.facts["seen"]
        places = np.array([track.positions for track in recording.tracks])
        walls = [outline for outline in recording.scenery if outline.normal]
        gaps = [((places - wall.points[0]) @ np.array(wall.normal)).min() for wall in walls]
        radius = recording.o.radius
        out: Measured = recording.told("balls") | {
            "settled": seen["settled"], "seconds": float(recording.times[-1]),
            "deepest_over_radius": 1.0 - float(min(gaps)) / radius,
        }  # fmt: skip
        if facts["law"] == NATIVE:
            return out
        out |= {"support_over_weight_less_1": seen["support"] - 1.0}
        if facts["engine"] == NONE:
            out["energy_rise"] = seen["rise"]
        if "cost" in seen:
            out["cost"] = [
                {"contact": name, "drop_s": time, "law_over": seen["cost"]["drop"]["law"] / time}
                | ({"lying_law_over": seen["cost"]["lying"]["law"] / seen["cost"]["lying"][name]}
                   if seen["cost"]["lying"] else {})
                for name, time in seen["cost"]["drop"].items()
            ]  # fmt: skip
        return out

    def check(self, measured: Measured) -> list[Limit]:
        """At rest in the end, carried by floor and walls, no energy gained; no limits for the engine's own contact."""
        if measured["law"] == NATIVE:
            return []
        settled = measured["settled"]
        out = [
            Limit("all balls asleep", 10.0, float("inf") if settled is None else settled, "s"),
            Limit("support over weight, less 1", 1e-6, abs(measured["support_over_weight_less_1"])),
            Limit("greatest overlap with a wall, over R", 1e-2, measured["deepest_over_radius"]),
        ]
        if "energy_rise" in measured:
            out.append(Limit("energy gained in a step, over that at the start", 1e-6, measured["energy_rise"]))
        return out

    def caption(self, recording: Recording) -> str:
        """The time at which all balls slept."""
        settled = recording.facts["seen"]["settled"]
        return "seen through a wall" + ("" if settled is None else f"; all asleep at {settled:.1f} s")
