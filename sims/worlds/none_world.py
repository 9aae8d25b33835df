"""A world without an engine, by `contactlaw.world.World`."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import ContactPair
from contactlaw import world as own
from contactlaw.world.data.records import Arrays
from sims.scene import NONE, Settings
from sims.worlds.parts import Array, Body, State, Tuning, matrix_to_quaternion
from sims.worlds.world import World


class EngineWorld(World):
    """`contactlaw.world.World`."""

    def __init__(self, settings: Settings, gravity: ArrayLike, tuning: Tuning) -> None:
        super().__init__(settings, gravity, tuning)
        self.world = own.World(
            gravity=self.gravity, timestep=self.timestep, substeps=tuning.substeps, crowd_substeps=tuning.crowd_substeps
        )
        self._fresh: Arrays | None = None
        self._shapes: dict[str, list[int]] = {}

    def _make_body(self, body: Body) -> None:
        if body.path is not None:
            raise ValueError(f"engine = {NONE!r}: drives no body; {body.name!r} has a path")
        number = self.world.add_body(
            body.mass, body.inertia, body.position, body.velocity, matrix_to_quaternion(body.rotation), body.spin
        )
        self._make_shape(body.name, number, body.shape, body.size)

    def _make_shape(self, name: str, body: int | None, shape: str, size: ArrayLike, **where: Any) -> None:
        """Make a shape on a body, or a fixed one; where: its position and rotation."""
        sizes, world, turn = np.asarray(size, dtype=float).tolist(), self.world, where.pop("turn", np.eye(3))
        if shape in ("ball", "disc"):
            made: Any = world.add_sphere(body, sizes[0], **where)  # type: ignore[arg-type]
        elif shape == "balls":
            made = tuple(world.add_sphere(body, r, at) for r, *at in np.reshape(sizes, (-1, 4)))  # type: ignore[arg-type]
        elif shape in ("box", "ellipsoid", "hull"):
            add: Any = {"box": world.add_box, "ellipsoid": world.add_ellipsoid, "hull": world.add_hull}[shape]
            size = np.reshape(sizes, (-1, 3)) if shape == "hull" else sizes
            made = add(body, size, quaternion=matrix_to_quaternion(turn), **where)
        else:
            add = world.add_capsule if shape == "capsule" else world.add_cylinder
            made = add(body, *sizes, axis=turn[:, 2], **where)
        self._shapes[name] = list(made) if isinstance(made, tuple) else [made]

    def _make_plane(self, name: str, point: Array, normal: Array) -> None:
        self._shapes[name] = [self.world.add_plane(None, point, normal)]

    def _make_fixed(self, name: str, shape: str, size: Array, position: Array, rotation: Array) -> None:
        self._make_shape(name, None, shape, size, at=position, turn=rotation)

    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair) -> None:
        first, second = ([shape for name in names for shape in self._shapes[name]] for names in (ones, twos))
        self.world.add_contact(first, second, pair)

    def _touch_natively(self, ones: list[str], twos: list[str], pair: ContactPair, speed: float) -> None:
        raise ValueError(f"law = 'native': engine = {NONE!r} has no contact of its own")

    def _start(self, states: list[tuple[Array, Array, Array, Array]]) -> None:
        fresh = self._fresh = self._fresh or self.world.save()
        self.world.restore(fresh)
        for number, (position, velocity, spin, turn) in enumerate(states):
            self.world.place(number, position, velocity, matrix_to_quaternion(turn), spin)

    def _drive(self, body: Body, position: Array, velocity: Array) -> None:
        """No body is driven."""

    def _advance(self, count: int) -> None:
        self.world.step(count)

    def _read(self) -> State:
        w, x, y, z = self.world.quaternion.T
        turns = np.array([
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]).transpose(2, 0, 1)  # fmt: skip
        return State(self.world.position, turns, self.world.velocity, self.world.spin)
