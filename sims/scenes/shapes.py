"""Boxes dropped flat, on an edge and on a corner, a can that starts to roll, and a puck that stands on its end.

A flat shape touches a plane by small balls in its rounded edges (docs/shapes.md). A box touches by four corners, of
radius r, a tenth of its smallest half length; a puck on its end by four feet; a can of radius R on its side by two rims
of curvatures 1/r and 1/R, which are Hertz's elliptic contacts (Johnson, Contact Mechanics, 1985, section 4.2). At rest
n such points carry the weight, and the depth of each is

        depth = (m g/n / (4/3 E* sqrt(radius)))^(2/3)

A can thrown without spin slides until it rolls, at 2/3 of its speed whatever the friction (I = 1/2 m R^2).
"""

from math import pi, radians
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair
from sims.contact_point import static_overlap
from sims.options import length, of_contact, seconds, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVES, Limit, Mark, Measured, Scene, Settings, plain, register
from sims.worlds import new_world
from sims.worlds.parts import onto, turned

GRAVITY = 9.81  # [m/s^2]
SIDES = (0.03, 0.02, 0.02)  # half lengths of a box [m]
CAN, PUCK = (0.02, 0.03), (0.025, 0.01)  # radius and half length [m]
EDGE = 0.1  # radius of the edges, over the smallest half length
PLACES = {"flat": -0.2, "edge": -0.1, "corner": 0.0, "puck": 0.14, "can": 0.21}  # along x [m]
TURNS = {"flat": np.eye(3), "edge": turned([0.0, 1.0, 0.0], radians(35.0)),
         "corner": turned([0.0, 1.0, 0.0], 0.25) @ onto(np.array(SIDES) / np.linalg.norm(SIDES)).T}  # fmt: skip


@register
class Shapes(Scene):
    """Seen from the side."""

    name = "shapes"
    title = "boxes fall flat, on an edge and on a corner; a can rolls; a puck stands on its end"
    engines = EVERYWHERE
    shown, exposure, slow = 0.8, 0.16, 4.0
    apart = True
    material = "nylon"
    options = {
        "drop": length(0.03, "height from which the boxes fall"),
        "speed": speed(0.3, "speed of the can"),
        "seconds": seconds(3.0, 1.0),
    } | of_contact(0.3, 0.3)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Put down the can and the puck, and release the boxes."""
        density = MATERIALS[o.material].density or 1000.0
        world = new_world(settings, (0.0, 0.0, -GRAVITY))
        for name, turn in TURNS.items():
            low = float(np.abs(turn[2] * SIDES).sum())  # of a corner below the middle
            mass = 8.0 * density * float(np.prod(SIDES))
            world.box(name, SIDES, mass, (PLACES[name], 0.0, low + o.drop), rotation=turn)
        lying, upright = np.eye(3)[1:]
        cylinders = ("can", CAN, lying, CAN[0], o.speed), ("puck", PUCK, upright, PUCK[1], 0.0)
        for name, size, axis, height, along in cylinders:
            mass = 2.0 * pi * size[0] ** 2 * size[1] * density
            place = (PLACES[name], 0.0, height - depth(name, mass, o))
            world.cylinder(name, *size, mass, place, (along, 0.0, 0.0), rotation=onto(axis))
        world.plane("floor")
        world.contact(list(PLACES), "floor", ContactPair(o.material, o.material, o.friction, o.restitution))
        return world.record(o.seconds, every=4e-3)

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Names."""
        return [(track.positions[entry, 0], 0.0, track.name) for track in recording.tracks]

    def caption(self, recording: Recording) -> str:
        """The depths at rest."""
        bodies = self.measure(recording)["bodies"].items()
        return "depth [um]: " + ", ".join(f"{name} {plain(one['depth_um'], 3)}" for name, one in bodies)

    def measure(self, recording: Recording) -> Measured:
        """Depth and remaining speed of each body."""
        bodies = {}
        for name in PLACES:
            track = recording.track(name)
            energy, up = track.energy((0.0, 0.0, -GRAVITY)), np.abs(track.rotations[-1, 2])
            round_height = float(np.hypot(*up[:2]) * track.size[0] + up[2] * track.size[-1])
            height = float(up @ SIDES) if track.shape == "box" else round_height
            bodies[name] = {
                "depth_um": 1e6 * (height - float(track.positions[-1, 2])),
                "depth_closed_form_um": 1e6 * depth(name, track.mass, recording.o),
                "speed_at_the_end": float(np.linalg.norm(track.velocities[-1])),
                "energy_gained": float(np.max(energy - energy[0]) / energy[0]),
            }
        return recording.told() | {"speed": recording.o.speed, "bodies": bodies}

    def check(self, measured: Measured) -> list[Limit]:
        """Depths at rest, the can's speed, and no energy gained."""
        if measured["law"] in NATIVES:
            return []
        out = []
        for name, one in measured["bodies"].items():
            error = abs(one["depth_um"] / one["depth_closed_form_um"] - 1.0)
            speed_left = 2.0 / 3.0 * measured["speed"] if name == "can" else 0.0
            out += [
                Limit(f"error of the depth, {name}", 1e-3, error),
                Limit(f"speed at the end less that of rolling or rest, {name}", 1e-4 * measured["speed"],
                      abs(one["speed_at_the_end"] - speed_left), "m/s"),
                Limit(f"energy gained, over that at the start, {name}", 1e-6, one["energy_gained"]),
            ]  # fmt: skip
        return out


def depth(name: str, mass: float, o: Any) -> float:
    """Depth at rest by the closed form [m]."""
    edge = EDGE * min(CAN if name == "can" else PUCK if name == "puck" else SIDES)
    points, radius = (2.0, elliptic_radius(1.0 / CAN[0], 1.0 / edge)) if name == "can" else (4.0, edge)
    return float(static_overlap(ContactPair(o.material, o.material, o.friction), mass * GRAVITY / points, radius))


def elliptic_radius(p: float, q: float) -> float:
    """Radius [m] of the ball that gives the same overlap as curvatures p < q [1/m]: Hertz's elliptic contact."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    m: Any = brentq(lambda m: (ellipe(m) / (1.0 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - q / p, 1e-6, 1.0 - 1e-9)
    return float(pi**2 * (ellipk(m) - ellipe(m)) / m / (2.0 * p * ellipk(m) ** 3))
