"""Common interface of both engines and the world without one, for scenes."""

import importlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from time import perf_counter, sleep
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import ContactPair, checks
from contactlaw.laws import law_of
from sims.recording import Outline, Recording, Track, block, plane, rod
from sims.scene import NATIVES, Settings
from sims.worlds.parts import Array, Body, Path, State, Tuning

MOST_STEPS = 10**7  # of a recording


class World(ABC):
    """Bodies, their contacts, and time.

    First add everything, then `record`; or `start`, then any number of `step` and `read`, then `close`. Bodies touch
    only where `contact` or `native` says so.

    Args:
        settings: Engine, law and step.
        gravity: [m/s^2], shape (3,).
        tuning: Of the engine and its adapter.
    """

    def __init__(self, settings: Settings, gravity: ArrayLike, tuning: Tuning) -> None:
        self.settings, self.tuning = settings, tuning
        self.timestep = settings.step
        self.gravity = checks.vector("gravity", gravity)
        self.time = 0.0
        self.bodies: list[Body] = []
        self.scenery: list[Outline] = []
        self._fixed: list[str] = []
        self._laws: list[str] = []

    @property
    def law(self) -> str:
        """Law of the contacts: that of the settings, or those of the pairs."""
        return self.settings.law or " and ".join(dict.fromkeys(self._laws)) or "none"

    # ---- what there is

    def ball(
        self, name: str, radius: float, mass: float, position: ArrayLike, velocity: ArrayLike = (0.0, 0.0, 0.0),
        spin: ArrayLike = (0.0, 0.0, 0.0), *, inertia: ArrayLike | None = None, rotation: ArrayLike | None = None,
        disc: float | None = None,
    ) -> None:  # fmt: skip
        """Add a body that is round where it touches.

        Args:
            name: Of the body.
            radius: [m].
            mass: [kg].
            position: Of its centre [m].
            velocity: [m/s].
            spin: World frame [rad/s].
            inertia: Moment of inertia about any axis, or about its own three [kg m^2]; None: a homogeneous ball.
            rotation: From its axes to the world's, shape (3, 3).
            disc: Half the thickness [m] with which to draw it as a disc about its own z axis.
        """
        moments = 0.4 * mass * radius**2 if inertia is None else inertia
        shape, size = ("ball", (radius,)) if disc is None else ("disc", (radius, disc))
        self._add(name, shape, size, mass, moments, position, velocity, spin, rotation)

    def box(
        self, name: str, half_sizes: Sequence[float], mass: float, position: ArrayLike,
        velocity: ArrayLike = (0.0, 0.0, 0.0), spin: ArrayLike = (0.0, 0.0, 0.0), *,
        rotation: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """A homogeneous box."""
        squares = np.square(half_sizes)
        moments = mass / 3.0 * (squares.sum() - squares)
        self._add(name, "box", tuple(half_sizes), mass, moments, position, velocity, spin, rotation)

    def capsule(
        self, name: str, radius: float, half_length: float, mass: float, position: ArrayLike,
        velocity: ArrayLike = (0.0, 0.0, 0.0), spin: ArrayLike = (0.0, 0.0, 0.0), *,
        inertia: ArrayLike, rotation: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """A capsule along its own z axis."""
        self._add(name, "capsule", (radius, half_length), mass, inertia, position, velocity, spin, rotation)

    def cylinder(
        self, name: str, radius: float, half_length: float, mass: float, position: ArrayLike,
        velocity: ArrayLike = (0.0, 0.0, 0.0), spin: ArrayLike = (0.0, 0.0, 0.0), *,
        rotation: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """A homogeneous cylinder along its own z axis."""
        across = mass * (0.25 * radius**2 + half_length**2 / 3.0)
        moments = (across, across, 0.5 * mass * radius**2)
        self._add(name, "cylinder", (radius, half_length), mass, moments, position, velocity, spin, rotation)

    def solid(
        self, name: str, shape: str, size: ArrayLike, mass: float, inertia: ArrayLike, position: ArrayLike,
        velocity: ArrayLike, spin: ArrayLike, rotation: ArrayLike,
    ) -> None:  # fmt: skip
        """A body of any shape; not for recordings.

        Args:
            name, mass, inertia, position, velocity, spin, rotation: As for `ball`.
            shape: "ball", "capsule", "box", "cylinder", "ellipsoid" (not in PyBullet), "hull", or without an engine
                "balls".
            size: Radius, and half length; half lengths, or half axes; of a hull its points, shape (n, 3); of balls
                radius and centre of each, shape (n, 4) [m].
        """
        self._add(name, shape, tuple(np.ravel(size)), mass, inertia, position, velocity, spin, rotation)

    def paddle(self, name: str, half_sizes: Sequence[float], path: Path, *, rotation: ArrayLike | None = None) -> None:
        """A box that follows a path without turning, whatever hits it."""
        at_rest = np.zeros(3)
        self._add(name, "box", tuple(half_sizes), np.inf, np.inf, path(0.0), at_rest, at_rest, rotation, path)

    def plane(self, name: str, point: ArrayLike = (0.0, 0.0, 0.0), normal: ArrayLike = (0.0, 0.0, 1.0)) -> None:
        """A fixed plane through a point [m]; bodies are on the side that its normal points to."""
        up = checks.unit_vector("normal", normal)
        origin = checks.vector("point", point)
        self._fix(name, plane(origin, up, name))
        self._make_plane(name, origin, up)

    def block(
        self, name: str, half_sizes: Sequence[float], position: ArrayLike, rotation: ArrayLike | None = None
    ) -> None:
        """A fixed box."""
        self._fixed_shape("box", name, half_sizes, position, rotation)

    def peg(
        self, name: str, radius: float, half_length: float, position: ArrayLike, rotation: ArrayLike | None = None
    ) -> None:
        """A fixed capsule along its own z axis."""
        self._fixed_shape("capsule", name, (radius, half_length), position, rotation)

    def contact(
        self, ones: str | Sequence[str], twos: str | Sequence[str], pair: ContactPair, *,
        speed: float = 1.0,
    ) -> None:  # fmt: skip
        """Let bodies touch, each of the first with each of the second: by the law of settings or pair, or natively.

        Args:
            ones, twos: Names; a name may be in both.
            pair: Materials, friction and restitution; its law is that of the settings, where they have one.
            speed: Approach speed [m/s] for which MuJoCo's own contact is made as stiff as the law's.
        """
        first, second = ([names] if isinstance(names, str) else list(names) for names in (ones, twos))
        known = [body.name for body in self.bodies] + self._fixed
        for name in (*first, *second):
            checks.one_of("name", name, known)
        if self.settings.law in NATIVES:
            self._touch_natively(first, second, pair, speed)
        else:
            told = self.settings.by_law(pair)
            self._laws.append(law_of(told.law).name)
            self._touch_by_law(first, second, told)

    def native(self, friction: float, restitution: float, spring: tuple[float, float] | None = None) -> None:
        """Let all bodies and planes, already added, touch by the engine's own contact as its users set it.

        Args:
            friction: Of any two.
            restitution: Of any two; PyBullet's alone, MuJoCo has none.
            spring: Stiffness and damping over mass [1/s^2], [1/s]; None: the engine's own.
        """
        self._make_native(friction, restitution, spring)

    # ---- what happens

    def start(self, *states: tuple[ArrayLike, ArrayLike, ArrayLike]) -> None:
        """Begin, or begin again, with no contact open.

        Args:
            states: Position [m], velocity [m/s] and spin [rad/s] of each body, unturned, in the order in which they
                were added; none: every body as it was added.
        """
        self.time = 0.0
        own = [(body.position, body.velocity, body.spin, body.rotation) for body in self.bodies]
        told = [(np.array(x, float), np.array(v, float), np.array(w, float), np.eye(3)) for x, v, w in states]
        self._start(told or own)

    def step(self, count: int = 1) -> None:
        """Take a number of steps; driven bodies are placed on their paths before each."""
        driven = [body for body in self.bodies if body.path is not None]
        if not driven:
            self._advance(count)
            self.time += count * self.timestep
            return
        for _ in range(count):
            for body in driven:
                here, there = (np.asarray(body.path(t)) for t in (self.time, self.time + self.timestep))  # type: ignore[misc]
                self._drive(body, here, (there - here) / self.timestep)
            self._advance(1)
            self.time += self.timestep

    def push(self, loads: Array) -> None:
        """Force [N] and torque [N m] on each body in the coming step, world frame, shape (n, 6)."""
        raise ValueError(f"engine = {self.settings.engine!r}: takes no force from outside")

    def read(self) -> State:
        """Read the state of all bodies; velocities are read here only, in any engine."""
        return self._read()

    def place(self, number: int = 0) -> Array:
        """Position of one body [m], shape (3,); cheaper than `read`."""
        return self._read().position[number]

    def close(self) -> None:
        """Let go of the engine."""
        self._close()

    def record(
        self, duration: float, every: float | None = None, look: Callable[[], bool] | None = None, **facts: Any
    ) -> Recording:
        """Run for some time and record the motion, including the start.

        Args:
            duration: [s].
            every: Time between two entries [s], rounded to steps; None: every step.
            look: Called after every step; the recording ends with the entry before which it returned True.
            facts: Added to the recording's own.
        """
        stride = max(1, round((every or 0.0) / self.timestep))
        count = max(1, round(duration / (stride * self.timestep)))
        if stride * count > MOST_STEPS:
            raise ValueError(
                f"timestep = {self.timestep:g}: {duration:.3g} s would take {stride * count:.1g} steps, more than "
                f"{MOST_STEPS:.0g}; ask for a longer one"
            )
        self.start()
        places = np.empty((count + 1, len(self.bodies), 3))
        turns = np.empty((count + 1, len(self.bodies), 3, 3))
        speeds, spins = np.empty_like(places), np.empty_like(places)
        wall_time, ended, opened = 0.0, False, perf_counter()
        reach = max(
            [np.ptp([body.position for body in self.bodies], axis=0).max(), *(4.0 * b.size[0] for b in self.bodies)]
        )
        try:
            for number in range(count + 1):
                for _ in range(0 if number == 0 else 1 if look is None else stride):
                    begin = perf_counter()
                    self.step(stride if look is None else 1)
                    wall_time += perf_counter() - begin
                    ended = ended or (look is not None and look())
                places[number], turns[number], speeds[number], spins[number] = self._read()
                self.settings.progress(number / count)
                if self.settings.watch:
                    self._show(places[number].mean(axis=0), float(reach))
                    sleep(max(number * stride * self.timestep * self.settings.watch - (perf_counter() - opened), 0.0))
                if ended:
                    count = number
                    break
        finally:
            self._close()
        tracks = [
            Track(body.name, body.shape, body.size, places[: count + 1, i], turns[: count + 1, i],
                  speeds[: count + 1, i], spins[: count + 1, i], body.mass, body.inertia)
            for i, body in enumerate(self.bodies)
        ]  # fmt: skip
        own = {
            "engine": self.settings.engine, "law": self.law, "timestep": self.timestep,
            "steps": stride * count, "wall_time": wall_time, "gravity": self.gravity.tolist(),
        }  # fmt: skip
        times = np.arange(count + 1, dtype=np.float64) * (self.timestep * stride)
        return Recording(times, tracks, self.scenery, facts=own | facts)

    def _add(
        self, name: str, shape: str, size: tuple[float, ...], mass: float, inertia: Any, position: Any, velocity: Any,
        spin: Any, rotation: Any, path: Path | None = None,
    ) -> None:  # fmt: skip
        self._refuse_twice(name)
        ix, iy, iz = np.broadcast_to(np.asarray(inertia, dtype=float), 3).tolist()
        body = Body(
            name, shape, size, mass, (ix, iy, iz), checks.vector("position", position),
            checks.vector("velocity", velocity), checks.vector("spin", spin),
            np.eye(3) if rotation is None else np.array(rotation, dtype=float), path,
        )  # fmt: skip
        self.bodies.append(body)
        self._make_body(body)

    def _fixed_shape(
        self, shape: str, name: str, size: ArrayLike, position: ArrayLike, rotation: ArrayLike | None
    ) -> None:
        turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=float)
        sizes, place = np.asarray(size, dtype=float), checks.vector("position", position)
        self._fix(name, (block if shape == "box" else rod)(place, sizes, turn, name))
        self._make_fixed(name, shape, sizes, place, turn)

    def _fix(self, name: str, outline: Outline) -> None:
        self._refuse_twice(name)
        self._fixed.append(name)
        self.scenery.append(outline)

    def _refuse_twice(self, name: str) -> None:
        if name in self._fixed or name in [body.name for body in self.bodies]:
            raise ValueError(f"name = {name!r}: there is one of this name already")

    # ---- what an engine does

    @abstractmethod
    def _make_body(self, body: Body) -> None: ...

    @abstractmethod
    def _make_plane(self, name: str, point: Array, normal: Array) -> None: ...

    @abstractmethod
    def _make_fixed(self, name: str, shape: str, size: Array, position: Array, rotation: Array) -> None: ...

    @abstractmethod
    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair) -> None: ...

    @abstractmethod
    def _touch_natively(self, ones: list[str], twos: list[str], pair: ContactPair, speed: float) -> None: ...

    def _make_native(self, friction: float, restitution: float, spring: tuple[float, float] | None) -> None:
        raise ValueError(f"engine = {self.settings.engine!r}: has no contact of its own")

    @abstractmethod
    def _start(self, states: list[tuple[Array, Array, Array, Array]]) -> None:
        """Position, velocity, spin and rotation of each body at one time; the first time the engine is made ready."""

    @abstractmethod
    def _drive(self, body: Body, position: Array, velocity: Array) -> None: ...

    @abstractmethod
    def _advance(self, count: int) -> None: ...

    @abstractmethod
    def _read(self) -> State: ...

    def _show(self, middle: Array, reach: float) -> None:  # noqa: B027  (an engine may have nothing to do)
        """Update the engine's window, opening it the first time; look at a point [m] from a few `reach` [m] away."""

    def _close(self) -> None:  # noqa: B027
        """Let go of the engine."""


def new_world(settings: Settings, gravity: ArrayLike = (0.0, 0.0, -9.81), tuning: Tuning | None = None) -> World:
    """An empty world in the engine of the settings."""
    module = importlib.import_module(f"sims.worlds.{settings.engine}_world")
    return module.EngineWorld(settings, gravity, tuning or Tuning())
