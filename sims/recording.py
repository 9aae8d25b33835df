"""Recording of a run: motion of the bodies over time, and the fixed surroundings."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw.files import whole

Array = NDArray[np.float64]


@dataclass
class Track:
    """One body over time.

    Attributes:
        name: Of the body.
        shape: "ball", "disc", "box", "capsule" or "cylinder".
        size: [m]; ball: (radius,); disc, about its z axis: (radius, half thickness); box: half lengths; capsule and
            cylinder, along its z axis: (radius, half length of the straight part).
        positions: Of the centre [m], shape (n, 3).
        rotations: From the body's axes to the world's, shape (n, 3, 3).
        velocities: Velocities at the time of the positions [m/s], shape (n, 3).
        spins: Likewise, world frame [rad/s], shape (n, 3).
        mass: [kg]; infinite for a driven body.
        inertia: About the body's axes [kg m^2], shape (3,).
    """

    name: str
    shape: str
    size: tuple[float, ...]
    positions: Array
    rotations: Array
    velocities: Array
    spins: Array
    mass: float = np.inf
    inertia: tuple[float, ...] = (np.inf, np.inf, np.inf)

    def energy(self, gravity: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """Kinetic energy, and potential under gravity [m/s^2], over time [J], shape (n,)."""
        own = np.einsum("nji,nj->ni", self.rotations, self.spins)
        kinetic = 0.5 * self.mass * (self.velocities**2).sum(axis=1) + 0.5 * (own**2) @ np.asarray(self.inertia)
        return kinetic - self.mass * self.positions @ np.asarray(gravity, dtype=float)


@dataclass(frozen=True)
class Outline:
    """Something fixed to draw: a line through points, their convex hull if `solid`, or a plane.

    Attributes:
        points: World [m], shape (n, 3).
        solid: Whether to fill it.
        name: What it is.
        normal: Of a plane through the first point, a unit vector towards its free side; (): no plane.
    """

    points: Array
    solid: bool = False
    name: str = ""
    normal: tuple[float, ...] = ()


def line(*points: ArrayLike, name: str = "") -> Outline:
    """A line through points [m]."""
    return Outline(np.array(points, dtype=float), name=name)


def plane(point: ArrayLike, normal: ArrayLike, name: str = "") -> Outline:
    """A plane through a point [m] with a unit normal."""
    return Outline(np.array([point], dtype=float), name=name, normal=tuple(np.asarray(normal, dtype=float).tolist()))


def block(position: ArrayLike, half_sizes: ArrayLike, rotation: ArrayLike | None = None, name: str = "") -> Outline:
    """A box by its centre and half lengths [m], turned by a matrix."""
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) * np.asarray(half_sizes, dtype=float)
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=float)
    return Outline(corners @ turn.T + np.asarray(position, dtype=float), solid=True, name=name)


def rod(position: ArrayLike, size: ArrayLike, rotation: ArrayLike, name: str = "") -> Outline:
    """A capsule by its centre, (radius, half length) [m], and the matrix that turns its z axis."""
    radius, half = np.asarray(size, dtype=float)
    angles = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
    rings = [(radius * np.cos(a), radius * np.sin(a), side * half) for side in (-1.0, 1.0) for a in angles]
    return Outline(np.array(rings) @ np.asarray(rotation, dtype=float).T + np.asarray(position), solid=True, name=name)


@dataclass
class Recording:
    """A run of a scene.

    Attributes:
        times: [s], shape (n,).
        tracks: The bodies.
        scenery: What stood around them.
        view: The world axes, 0 to 2, that go right and up in a picture.
        facts: engine, law, timestep, wall_time, and whatever the scene adds; JSON types.
    """

    times: Array
    tracks: list[Track]
    scenery: list[Outline] = field(default_factory=list)
    view: tuple[int, int] = (0, 2)
    facts: dict[str, Any] = field(default_factory=dict)

    def track(self, name: str) -> Track:
        """A body by its name.

        Raises:
            ValueError: There is none.
        """
        for one in self.tracks:
            if one.name == name:
                return one
        raise ValueError(f"name = {name!r}: must be one of {[one.name for one in self.tracks]}")

    @property
    def o(self) -> Any:
        """The facts as attributes: options, material, and whatever the scene added."""
        return SimpleNamespace(**self.facts)

    def told(self, *more: str) -> dict[str, Any]:
        """Facts common to all scenes (engine, law, step [s], wall time [s]) and further ones."""
        return {key: self.facts[key] for key in ("engine", "law", "timestep", *more, "wall_time")}

    def save(self, path: Path) -> Path:
        """Write everything to a npz file; returns its path."""
        arrays: dict[str, Any] = {"times": self.times}
        heads: dict[str, Any] = {"view": self.view, "facts": self.facts, "tracks": [], "scenery": []}
        for number, one in enumerate(self.tracks):
            head = {"name": one.name, "shape": one.shape, "size": list(one.size), "mass": one.mass}
            heads["tracks"].append(head | {"inertia": list(one.inertia)})
            for kind in ("positions", "rotations", "velocities", "spins"):
                arrays[f"{kind}_{number}"] = getattr(one, kind)
        for number, outline in enumerate(self.scenery):
            heads["scenery"].append({"solid": outline.solid, "name": outline.name, "normal": outline.normal})
            arrays[f"outline_{number}"] = outline.points
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as part, part.open("wb") as file:
            np.savez_compressed(file, heads=np.array(json.dumps(heads)), **arrays)
        return path

    @classmethod
    def load(cls, path: Path) -> Recording:
        """Read what `save` wrote."""
        with np.load(path, allow_pickle=False) as arrays:
            heads = json.loads(str(arrays["heads"]))
            tracks = [
                Track(head["name"], head["shape"], tuple(head["size"]), arrays[f"positions_{number}"],
                      arrays[f"rotations_{number}"], arrays[f"velocities_{number}"], arrays[f"spins_{number}"],
                      head["mass"], tuple(head["inertia"]))
                for number, head in enumerate(heads["tracks"])
            ]  # fmt: skip
            scenery = [
                Outline(arrays[f"outline_{number}"], head["solid"], head["name"], tuple(head["normal"]))
                for number, head in enumerate(heads["scenery"])
            ]
            right, up = heads["view"]
            return cls(arrays["times"], tracks, scenery, (int(right), int(up)), heads["facts"])
