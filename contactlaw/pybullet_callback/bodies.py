"""The bodies of PyBullet that a world holds: read before a step, pushed, and put where the world has them."""

import struct
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import chain
from operator import itemgetter
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback import rows
from contactlaw.pybullet_callback.hooks import begin_step, find_pressed, finish_step, has_flown, list_placed, rewind
from contactlaw.pybullet_callback.shapes import BASE, Key, Measured, engine_parameters, name_of
from contactlaw.pybullet_callback.stepping import STEP_BULLET
from contactlaw.pybullet_callback.trees import Tree
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.data.demand import PENDING_ERROR
from contactlaw.world.data.frames import ALIKE
from contactlaw.world.data.records import EDITED, Array, Arrays

MOTION_FORMAT, SIX_FORMAT, MASS_FORMAT, POSITION_FORMAT = (struct.Struct(f"{n}d") for n in (13, 6, 4, 3))
PARAMETERS = itemgetter("fixedTimeStep", "gravityAccelerationX", "gravityAccelerationY", "gravityAccelerationZ")
PASSED, STRAYED = rows.PASSED, rows.STRAYED  # looked up in each step
SIZE, PLACES = rows.ROW.itemsize, {name: at for name, (_, at, *_) in rows.ROW.fields.items()}  # type: ignore[union-attr]
BEFORE, LEFT, FORCE, MASS = (PLACES[name] for name in ("before", "left", "force", "mass"))


class Bodies:
    """The bodies of PyBullet that a world holds, and the steps that both take.

    While all bodies are far apart only poses after each step are read, see `_fly`. While all sleep, and no reading
    changes, the last push is applied again and the world takes no step.

    Args:
        client, world: Physics client id, and the world with all bodies and shapes.
        keys: Body and link of each of its bodies: first those without joints, of these first those that have a mass.
        trees: Those with joints.
        measured: Pairs whose distance PyBullet must measure.
        moves: Whether bodies that nothing can push are read at every step.
        check: Raises an error if a body is no longer the one that was added.

    Attributes:
        dt: Time step [s].
        singles: Number of bodies without joints.
        flies: Whether no two bodies can touch in the next step, which then begins by nothing.
        outdated: Whether a body has got a mass, or lost it, so that other bodies than before can move, or links have
            other masses than before.
    """

    def __init__(
        self, client: int, world: World, keys: list[Key], trees: list[Tree], measured: list[Measured], moves: bool,
        check: Callable[[], None],
    ) -> None:  # fmt: skip
        self._client, self._world, self._keys, self._check = client, world, keys, check
        self.trees, self._measured = trees, measured
        self.singles = count = trees[0].first if trees else len(keys)
        self.rows: Any = np.zeros(count, rows.ROW)
        self._bytes = memoryview(self.rows.view(np.uint8))
        self._selected: Any = np.zeros(count, np.int64)
        self._selected_rows = memoryview(self._selected)
        self._head: Any = np.zeros(1, rows.HEAD)
        self._head["simple"] = self._simple = not (trees or measured)
        self._head["singles"] = count
        self._head_at = self._head.ctypes.data
        self.rows["left"]["position"] = self.rows["mass"] = np.nan
        self.outdated = False
        self.dt = 0.0
        self._moving = self._head["moving"] = m = sum(mass_of(key, client)[0] > 0.0 for key in keys[:count])
        motions, after, velocities = np.zeros((count, 13)), np.zeros((m, 7)), np.zeros((m, 6))
        for name, array in (("motions", motions), ("poses", after), ("velocities", velocities)):
            self._head[name] = array.ctypes.data
        self.bind(world.arrays)
        self.read_masses(range(count))
        calls = [call for key in keys[:count] for call in _calls_to_read(key, client)]
        if not moves:
            _reader(calls, motions)()
            del calls[2 * m :]
        self._read_motions = _reader(calls, motions[: len(calls) // 2])
        self._read_poses = _reader(calls[: 2 * m : 2], after)
        self._read_velocities = _reader(calls[1 : 2 * m : 2], velocities)
        self._fixed_poses = calls[2 * m :: 2]
        self._before, self._after = [], []  # as read before and after Bullet's step
        self._pushes: list[tuple[Callable[..., Any], Any]] = []

    def bind(self, arrays: Arrays) -> None:
        """Set the addresses of the world's arrays in the head."""
        self._world._arrays = self.arrays = arrays.bound()
        self._state = arrays.world
        for name, array in (("world", self._state), ("rows", self.rows), ("selected", self._selected)):
            self._head[name] = array.ctypes.data
        for one in self.trees:
            one.bind(self.arrays)
        self.flies, self._sleeps, self._parameters = False, False, ()

    def read_masses(self, these: Iterable[int]) -> None:
        """Read masses and inertias of bodies without joints; wake those that have others than before.

        Bodies that have got a mass, or lost it, keep the old one: `outdated` is then set.
        """
        for k in these:
            mass, moments = mass_of(self._keys[k], self._client)
            if (mass, *moments) == MASS_FORMAT.unpack_from(self._bytes, k * SIZE + MASS):
                continue
            row, own, inertia = self.rows[k], self.arrays.bodies[k + 1], np.array(moments)
            if (mass > 0.0) != (k < self._moving):
                self.outdated = True
                continue
            if row["mass"] >= 0.0:  # else it has not been read yet
                self._state["edited"] = EDITED
            row["mass"], row["inertia"] = mass, inertia
            own["inverse_mass"] = 1.0 / mass if mass > 0.0 else 0.0
            own["inverse_inertia"] = np.divide(1.0, inertia, np.zeros(3), where=(mass > 0.0) & (inertia > 0.0))
            own["isotropic"] = np.ptp(inertia) <= ALIKE * inertia.max()
            own["oriented"] |= 1 - own["isotropic"]
            own["held"] = np.nan

    def _read_near_masses(self) -> None:
        """Read masses of all bodies that may touch something soon, and of all links."""
        near = self.arrays.near_bodies[: self._state["near_body_count"][0]].tolist()
        self.read_masses([k - 1 for k in near if k <= self._moving])
        self.outdated |= any(one.inertias() != one.known for one in self.trees)

    def take_step(self) -> int:
        """Step PyBullet, then the world with the accelerations of that step; return as `hooks.write_bodies`."""
        if not self.flies:
            if self._read():
                self._begin_step()
            for call, values in self._pushes:
                call(*values)
            for one in self.trees:
                one.apply_push()
        STEP_BULLET(self._client)
        if self.flies and self._fly():
            return 0
        before, self._after = self._after, self._read_velocities(self._after if self._sleeps else ())
        if self._sleeps:
            if before is self._after:
                return 0
            self._begin_step()
        for one in self.trees:
            one.read_forces(self.dt)
        done = self._finish_step()
        self._sleeps = done == rows.ASLEEP and self._simple
        if done >= rows.FLAGS:
            self._put(done // rows.FLAGS)
        for one in self.trees:
            one.write_back(self.dt)
        if done & rows.LISTED:
            self._read_near_masses()
        return done

    def _begin_step(self) -> None:
        """Begin a step of bodies as they were read."""
        self._sleeps = False
        self._read_parameters()
        pushed = self._set_bodies()
        self.flies = pushed == PASSED
        self._pushes = self._calls_to_push(max(pushed, 0))

    def _read_parameters(self) -> None:
        """Read the time step and gravity."""
        known = PARAMETERS(engine_parameters(self._client))
        if known != self._parameters:
            self.dt, self._parameters = known[0], known
            self._head["dt"], self._head["gravity"] = self.dt, known[1:]
            self.arrays.trees["gravity"] = known[1:]

    def _read(self) -> bool:
        """Read poses and velocities of bodies without joints; return whether one has changed, or is awake.

        Those that have no mass, and have moved, may have got one.
        """
        before, moving = self._before, 2 * self._moving
        self._before = told = self._read_motions(before if self._sleeps else ())
        if told is not before and told[moving:] != before[moving:] and before:
            self.read_masses({i // 2 for i in range(moving, len(told)) if told[i] != before[i]})
        return told is not before

    def _set_bodies(self) -> int:
        """Set the bodies of the world as they were read; return how many are to be pushed, or PASSED."""
        pushed = begin_step(self._head_at)
        if pushed == PASSED:
            return pushed
        if pushed == rows.NOT_FINITE:
            self._refuse()
        found = pushed == rows.PLACED
        for one in self.trees:
            found |= one.begin_step()
        if found:
            pushed = self._find_pressed()
        for one in self._measured:
            one.place(self._client, self.arrays, self.dt)
        return pushed

    def _find_pressed(self) -> int:
        """After the user has moved bodies: find near pairs, and what presses on what; return how many are pushed."""
        self._check()
        self._read_selected_masses()
        while not list_placed(self._head_at):
            self._make_room()
        for one in self.trees:
            self.arrays.bodies["placed"][1 + one.first :][: len(one.heads)] = one.placed
        return find_pressed(self._head_at)

    def _calls_to_push(self, number: int) -> list[tuple[Callable[..., Any], Any]]:
        """Return calls, with arguments, that apply forces and torques to the first `number` selected bodies."""
        calls, client, frame = [], self._client, p.WORLD_FRAME
        for k in self._selected_rows[:number]:
            body, at = self._keys[k][0], k * SIZE
            fx, fy, fz, tx, ty, tz = SIX_FORMAT.unpack_from(self._bytes, at + FORCE)
            place = POSITION_FORMAT.unpack_from(self._bytes, at + BEFORE)
            calls.append((p.applyExternalForce, (body, BASE, (fx, fy, fz), place, frame, client)))
            if tx != 0.0 or ty != 0.0 or tz != 0.0:
                calls.append((p.applyExternalTorque, (body, BASE, (tx, ty, tz), frame, client)))
        return calls

    def _fly(self) -> bool:
        """Read poses after a step in which no two bodies could touch in free flight; return whether none can have.

        They are those before the next step, which then is begun by nothing else: a pose or a velocity that the user
        sets in between shows after that step. It is then taken back, and begun anew with what has been set.
        """
        self._read_poses()
        stands = [pose() for pose in self._fixed_poses] == self._before[2 * self._moving :: 2]
        done = has_flown(self._head_at) if stands else STRAYED
        if done == STRAYED:
            self._read()
            self._read_parameters()
            self.read_masses(range(self._moving))
            rewind(self._head_at)
            if self._set_bodies() == PASSED:
                done = has_flown(self._head_at)
        self.flies = done == PASSED
        if done == 0:
            self._read_near_masses()
        return done != STRAYED

    def _finish_step(self) -> int:
        """Take the step of the world; return as `hooks.write_bodies`."""
        while (done := finish_step(self._head_at)) < 0:
            if done == rows.NOT_FINITE:
                self._refuse()
            if done == rows.PUSHED_OTHERWISE:
                self._read_selected_masses()
            else:
                self._make_room()
        return done

    def _read_selected_masses(self) -> None:
        self.read_masses(self._selected_rows[: self._head["selected_count"][0]].tolist())

    def _make_room(self) -> None:
        """Enlarge the arrays of the world."""
        if not PENDING_ERROR:  # whose truth raises an error that was stored
            self.bind(with_more_room(self.arrays))

    def _put(self, number: int) -> None:
        """Set pose and velocity of the first `number` selected bodies to where they are `left`."""
        for k in self._selected_rows[:number]:
            body, own = self._keys[k][0], MOTION_FORMAT.unpack_from(self._bytes, k * SIZE + LEFT)
            p.resetBasePositionAndOrientation(body, own[:3], own[3:7], self._client)  # it also stops the body
            p.resetBaseVelocity(body, own[7:10], own[10:], self._client)

    def _refuse(self) -> None:
        lost = int(self._state["lost_body"][0])  # by the last step, and with it all that it touched
        name = name_of(self._keys[lost - 1 if lost else int(self._head["bad"][0])])
        raise ValueError(f"{name}: its position, velocity, or gravity is not finite")


def _reader(calls: Sequence[Callable[[], Any]], out: Array) -> Callable[..., Any]:
    """Return a function that makes calls, writes the numbers of the vectors that they return, and returns these.

    If they are those already `known`, it writes nothing and returns `known` itself.
    """
    numbers: Any = out.reshape(-1).view(np.uint8)
    memory, flat = memoryview(numbers), chain.from_iterable
    pack = struct.Struct(f"{out.size}d").pack_into

    def read(known: Any = ()) -> Any:
        told = [call() for call in calls]
        if told == known:
            return known
        pack(memory, 0, *flat(flat(told)))
        return told

    return read


def _calls_to_read(key: Key, client: int) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """Return functions that read position and quaternion, and velocity and spin, of a base or a link."""
    if key[1] == BASE:
        return partial(p.getBasePositionAndOrientation, key[0], client), partial(p.getBaseVelocity, key[0], client)
    read = partial(p.getLinkState, *key, 1, 1, client)
    return lambda: read()[:2], lambda: read()[6:]


def mass_of(key: Key, client: int) -> tuple[float, tuple[float, float, float]]:
    """Return mass and principal moments of a body; zero for a link that nothing can push, or a removed body."""
    try:
        info = p.getDynamicsInfo(*key, client) if key[1] == BASE else (0.0, 0.0, (0.0, 0.0, 0.0))
    except p.error:
        return 0.0, (0.0, 0.0, 0.0)
    return info[0], info[2]
