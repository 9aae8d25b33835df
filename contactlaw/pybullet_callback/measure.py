"""Hook "measure": contacts of shapes without a closed form, whose nearest points PyBullet finds.

The other shape is replaced by its tangent plane at the nearest point, placed anew before each step.
"""

from dataclasses import dataclass

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.shapes import Side
from contactlaw.world.data.records import Arrays

ON_A, ON_B, NORMAL, DISTANCE = 5, 6, 7, 8  # indices in a point of getClosestPoints; the normal is from B to A
FAR = -1e6  # [m], offset along the normal of a plane that nothing touches
STEPS = 3.0  # search distance in steps of the present motion


@dataclass(frozen=True)
class Measured:
    """A sphere or a capsule, and a shape whose distance PyBullet must measure.

    Attributes:
        one, other: Sphere or capsule; measured shape.
        row_one, row_other: Rows of their bodies.
        ends: Shapes of the world: the sphere, or the ends of the capsule.
        planes: Shapes of the world: a tangent plane of the measured shape for each of `ends`.
    """

    one: Side
    other: Side
    row_one: int
    row_other: int
    ends: list[int]
    planes: list[int]

    def place(self, client: int, world: Arrays, dt: float) -> None:
        """Place the tangent plane at the nearest point for a step dt [s]; other planes go out of reach."""
        a, b = world.bodies[self.row_one + 1], world.bodies[self.row_other + 1]
        planes = world.shapes[self.planes]
        planes["at"], planes["normal"] = (0.0, 0.0, FAR), (0.0, 0.0, 1.0)
        speed = sum(np.linalg.norm(one["velocity"]) + dt * np.linalg.norm(one["acceleration"]) for one in (a, b))
        turning = np.linalg.norm(b["spin"]) * self.other.reach + np.linalg.norm(a["spin"]) * a["reach"]
        one, other, reach = self.one, self.other, STEPS * dt * float(speed + turning) + 1e-6
        points = p.getClosestPoints(one.body, other.body, reach, one.link, other.link, physicsClientId=client)
        if points:
            point = min(points, key=lambda one: one[DISTANCE])
            axes = b["axes"].reshape(3, 3)
            ends = a["position"] + world.shapes["at"][self.ends] @ a["axes"].reshape(3, 3).T
            nearest = int(np.argmin(np.linalg.norm(ends - point[ON_A], axis=1)))
            planes["at"][nearest] = (point[ON_B] - b["position"]) @ axes
            planes["normal"][nearest] = np.array(point[NORMAL]) @ axes
        world.shapes[self.planes] = planes
