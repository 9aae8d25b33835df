"""How Maw, Barber & Fawcett measured rubber: a first block gives the puck backspin, a second one deflects it obliquely.

Rubber grips so well (mu = 2.4) that it slides only at grazing angles at which no launching device can aim. The puck is
therefore thrown at a first block, from which it returns with spin. The measured impact is that on a second block, set
at a small angle to its path. Source: J. Lubr. Technol. 103 (1981) 74, "Results for Rubber Puck".
"""

from math import acos, atan, degrees, hypot
from typing import Any

import numpy as np

from contactlaw import Body, collide
from sims.contact_point import Array, contact_velocity, rebound_of
from sims.options import Option
from sims.puck import OPTIONS, Puck, changes
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register, signed
from sims.worlds import new_world

# What the paper leaves open: psi_2 over psi_1 does not depend on it.
UP = np.array([0.0, 0.0, 1.0])
FIRST = np.array([-1.0, 0.0, 0.0])  # normal of the first block
BLOCK = (0.2, 0.03, 0.03)  # half lengths [m], along the face first
SPEED = 1.0  # approach to the first block [m/s]
LEAD, BETWEEN = 0.03, 0.15  # times in flight, before the first block and from there to the second [s]


@register
class RubberExperiment(Scene):
    """Two blocks and a puck on an air table, seen from above; neither table nor gravity is simulated."""

    name = "rubber_experiment"
    title = "the paper's rubber experiment: a puck gets backspin at a first block and meets a second at a small angle"
    engines = EVERYWHERE
    exposure, slow = 0.034, 5.0
    material = "rubber"
    options = {
        "psi1_first": Option(1.0, "psi_1 at the first block", -1e3, 1e3),
        "psi1": Option(2.0, "psi_1 at the second block", -1e3, 1e3),
    } | OPTIONS

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Aim by a single impact without an engine, then throw."""
        puck = Puck(o.material, o.psi1_first, speed=SPEED, **changes(o))
        pair, radius = puck.pair, puck.radius
        throw = np.array([SPEED, puck.psi_1 * pair.friction / pair.kappa * SPEED, 0.0])
        aim = collide(pair, Body(puck.mass, radius, puck.inertia, throw), normal=FIRST)
        second, angle = second_normal(aim.velocity_a, radius * aim.spin_a[2], o.psi1 / pair.psi(1, 1))
        duration = float(aim.time[-1])
        struck = BETWEEN * aim.velocity_a + [0.0, 0.5 * duration * (throw + aim.velocity_a)[1], 0.0]

        world = new_world(settings, gravity=(0.0, 0.0, 0.0))
        world.ball("puck", radius, puck.mass, -LEAD * throw, throw, disc=0.5 * puck.thickness,
                   inertia=[0.6 * puck.inertia, 0.6 * puck.inertia, puck.inertia])  # fmt: skip
        for name, normal, touch in (("first", FIRST, np.zeros(3)), ("second", second, struck)):
            turn = np.column_stack([np.cross(normal, UP), normal, UP])
            world.block(name, BLOCK, touch - (radius + BLOCK[1]) * normal, turn)
        world.contact("puck", ["first", "second"], pair, speed=SPEED)
        apart = LEAD + duration + 0.5 * BETWEEN
        facts = {"second": second.tolist(), "apart": apart, "angle": degrees(angle)}
        recording = world.record(2.0 * apart + 3.0 * duration, **facts)
        recording.view = (0, 1)
        return recording

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Labels of the blocks."""
        places = [(outline.points[:, :2].mean(axis=0), outline.name) for outline in recording.scenery]
        return [(float(place[0]), float(place[1]) - 0.2, f"{name} block") for place, name in places]

    def caption(self, recording: Recording) -> str:
        """Spin before the first block, between the blocks, and after the second."""
        track, between = recording.track("puck"), int(np.searchsorted(recording.times, recording.o.apart))
        spins = " \N{RIGHTWARDS ARROW} ".join(signed(track.spins[i, 2], 1) for i in (0, between, -1))
        return f"spin {spins} rad/s"

    def measure(self, recording: Recording) -> Measured:
        """Both impacts, read from the free flights before, between and after."""
        facts, track = recording.facts, recording.track("puck")
        puck = Puck(facts["material"], **changes(recording.o))
        between = int(np.searchsorted(recording.times, facts["apart"]))
        out: Measured = recording.told("material")
        out |= {"angle_degrees": facts["angle"], "spin_between": float(track.spins[between, 2])}
        for name, normal, ends in (("first", FIRST, [0, between]), ("second", facts["second"], [between, -1])):
            before, after = contact_velocity(track.velocities[ends], track.spins[ends], normal, track.size[0])
            out |= {f"{key}_{name}": value for key, value in
                    rebound_of(puck.pair, puck.chi, before, after, normal).items() if key != "aside"}  # fmt: skip
        energy = track.energy()
        out["energy_ratios"] = [float(energy[between] / energy[0]), float(energy[-1] / energy[between])]
        return out

    def check(self, measured: Measured) -> list[Limit]:
        """Both impacts against the annulus solver; no energy gained."""
        checks_: list[Limit] = []
        if measured["law"] not in ("mindlin", "native"):
            checks_.append(Limit("greatest energy ratio of an impact", 1.001, max(measured["energy_ratios"])))
        if measured["law"] == "microslip":
            checks_ += [
                Limit(f"error of psi_2 at the {name} block",
                      4e-3, abs(measured[f"psi2_{name}"] - measured[f"psi2_reference_{name}"]))
                for name in ("first", "second")
            ]  # fmt: skip
        return checks_


def second_normal(velocity: Array, rim: float, slope: float) -> tuple[Array, float]:
    """Orientation of the second block.

    Args:
        velocity: Velocity of the puck on its way there [m/s], shape (3,).
        rim: Radius times spin about the upward axis [m/s].
        slope: Tangential over normal velocity of the contact point, as asked for.

    Returns:
        The block's normal, and the angle between path and face [rad].

    Raises:
        ValueError: The spin alone gives a larger slope at any angle.
    """
    speed = hypot(velocity[0], velocity[1])
    cosine = rim / (speed * hypot(1.0, slope))
    if abs(cosine) >= 1.0:
        raise ValueError(f"psi1 asks for a slope of {slope:.3g}, below what the spin alone gives at any angle")
    angle = acos(cosine) - atan(slope)  # speed cos(angle) - rim = slope speed sin(angle)
    path = velocity / speed
    return np.cos(angle) * np.cross(path, UP) - np.sin(angle) * path, angle
