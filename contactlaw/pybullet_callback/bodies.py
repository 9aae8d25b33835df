"""The bodies of PyBullet that a world holds: read before a step, pushed, and put where the world has them."""

import struct
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback import rows
from contactlaw.pybullet_callback.hooks import begin_step, find_pressed, finish_step, has_flown, rewind, select_pushed
from contactlaw.pybullet_callback.shapes import BASE, Key, Measured, engine_parameters, name_of
from contactlaw.pybullet_callback.stepping import STEP_BULLET
from contactlaw.pybullet_callback.trees import Tree
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.data.demand import PENDING_ERROR
from contactlaw.world.data.frames import ALIKE
from contactlaw.world.data.records import EDITED, Arrays
from contactlaw.world.step import step

NOTHING: Any = (), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # pose and velocity before the first reading
MOTION_FORMAT, POSE_FORMAT, SIX_FORMAT, MASS_FORMAT, POSITION_FORMAT = (
    struct.Struct(f"{n}d") for n in (13, 7, 6, 4, 3)
)
PARAMETERS = "fixedTimeStep", "gravityAccelerationX", "gravityAccelerationY", "gravityAccelerationZ"
PASSED, STRAYED = rows.PASSED, rows.STRAYED  # looked up in each step
SIZE, PLACES = rows.ROW.itemsize, {name: at for name, (_, at, *_) in rows.ROW.fields.items()}  # type: ignore[union-attr]
BEFORE, AFTER, LEFT, FORCE, MASS = (PLACES[name] for name in ("before", "after", "left", "force", "mass"))
VELOCITY_AFTER = AFTER + POSE_FORMAT.size


class Bodies:
    """The bodies of PyBullet that a world holds, and the steps that both take.

    A reading is written into the rows only where it differs from the last one. Some are spared: time step and gravity
    while bodies in free fall show that they are as known, and while all bodies sleep; while all bodies are far apart
    only poses after each step are read, see `_fly`.

    Args:
        client, world: Physics client id, and the world with all bodies and shapes.
        keys, trees: Body and link of each of its bodies, and those with joints.
        measured: Pairs whose distance PyBullet must measure.
        moves: Whether bodies that nothing can push are read at every step.
        check: Raises an error if a body is no longer the one that was added.

    Attributes:
        dt: Time step [s].
        outdated: Whether a body has got a mass, or lost it, so that other bodies than before can move.
    """

    def __init__(
        self, client: int, world: World, keys: list[Key], trees: list[Tree], measured: list[Measured], moves: bool,
        check: Callable[[], None],
    ) -> None:  # fmt: skip
        self._client, self._world, self.keys, self._check = client, world, keys, check
        self.trees, self._measured = trees, measured
        self.rows: Any = np.zeros(len(keys), rows.ROW)
        self._bytes = memoryview(self.rows.view(np.uint8))
        self._selected: Any = np.zeros(len(keys), np.int64)
        self._selected_rows = memoryview(self._selected)
        self._head: Any = np.zeros(1, rows.HEAD)
        self._head["simple"] = self._simple = not (trees or measured)
        self._head_at = self._head.ctypes.data
        self.rows["left"]["position"] = np.nan
        self.outdated = False
        self._pushes = list[Callable[[], Any]]()  # calls of the last push
        self.dt, self._parameters = 0.0, ()
        for one in trees:
            self.rows["in_tree"][one.members] = 1
        simple = np.flatnonzero(self.rows["in_tree"] == 0).tolist()
        self.bind(world.arrays)
        self._heavy = dict.fromkeys(k for k in simple if _mass_of(keys[k], client)[0] > 0.0)
        self.read_masses(simple)
        self._order = [*self._heavy, *(k for k in simple if k not in self._heavy)]
        self._readers = [(*_readers_of(keys[k], client), self._writer(MOTION_FORMAT, k, BEFORE)) for k in self._order]
        readers = list(zip(self._heavy, self._readers, strict=False))
        self._velocities = [(read[1], self._writer(SIX_FORMAT, k, VELOCITY_AFTER)) for k, read in readers]
        self._poses = [(read[0], self._writer(POSE_FORMAT, k, AFTER)) for k, read in readers]
        if not moves:
            self._read()
            self._readers = self._readers[: len(self._heavy)]
        self._fixed = [one[0] for one in self._readers[len(self._heavy) :]]

    def _writer(self, numbers: struct.Struct, k: int, at: int) -> Callable[..., None]:
        """Return a function that writes numbers into a row, `at` bytes from its begin."""
        return partial(numbers.pack_into, self._bytes, k * SIZE + at)

    def bind(self, arrays: Arrays) -> None:
        """Set the addresses of the world's arrays in the head."""
        self._world._arrays = self.arrays = arrays.bound()
        self._state, head = arrays.world, self._head
        for name, array in (("world", self._state), ("rows", self.rows), ("selected", self._selected)):
            head[name] = array.ctypes.data
        head["count"] = len(self.keys)
        for one in self.trees:
            one.bind(self.arrays)
        self._flies, self._sleep = False, False
        self._stood = list[Any]()  # poses of fixed bodies when all bodies were found to be far apart
        self._last, self._after = [NOTHING] * len(self.keys), [()] * len(self.keys)  # read before and after a step

    def read_masses(self, these: Iterable[int]) -> None:
        """Read masses and inertias of bodies without joints; wake those that have others than before.

        Bodies that have got a mass, or lost it, keep the old one: `outdated` is then set.
        """
        for k in these:
            mass, moments = _mass_of(self.keys[k], self._client)
            if (mass, *moments) == MASS_FORMAT.unpack_from(self._bytes, k * SIZE + MASS):
                continue
            row, own, inertia = self.rows[k], self.arrays.bodies[k + 1], np.array(moments)
            if (mass > 0.0) != (k in self._heavy):
                self.outdated = True
                continue
            if row["mass"] > 0.0:
                self._state["edited"] = EDITED
            row["mass"], row["inertia"] = mass, inertia
            own["inverse_mass"] = 1.0 / mass if mass > 0.0 else 0.0
            own["inverse_inertia"] = np.divide(1.0, inertia, np.zeros(3), where=(mass > 0.0) & (inertia > 0.0))
            own["isotropic"] = np.ptp(inertia) <= ALIKE * inertia.max()
            own["oriented"] |= 1 - own["isotropic"]
            own["held"] = np.nan

    def near_masses_changed(self) -> bool:
        """Read masses of all bodies that may touch something soon; return whether those of links have changed."""
        near = self.arrays.near_bodies[: self._state["near_body_count"][0]].tolist()
        self.read_masses([k - 1 for k in near if k - 1 in self._heavy])
        return any(one.inertias() != one.known for one in self.trees)

    def take_step(self) -> int:
        """Step PyBullet, then the world with the accelerations of that step; return as `hooks.write_bodies`."""
        if not (self._simple and self._parameters):
            self._read_parameters()
        sleep = self._sleep and not self._read()
        pushed = PASSED if self._flies else 0 if sleep else self._begin_step()
        if not self._flies:
            if not sleep:
                self._pushes = self._calls_to_push(pushed) if pushed > 0 else []
            for apply in self._pushes:  # if all bodies sleep, the last push again
                apply()
        for one in self.trees:
            one.apply_push()
        STEP_BULLET(self._client)
        if pushed == PASSED and self._fly():
            return 0
        before, self._after = self._after, [velocity() for velocity, _ in self._velocities]
        if sleep:
            if before == self._after:
                return 0
            begin_step(self._head_at)
        for was, now, (_, write) in zip(before, self._after, self._velocities, strict=False):
            if now != was:
                write(*now[0], *now[1])
        for one in self.trees:
            one.read_forces(self.dt)
        done = self._finish_step()
        self._sleep = done == rows.ASLEEP and self._simple
        if done >= rows.FLAGS:
            self._put(done // rows.FLAGS)
        for one in self.trees:
            one.write_back(self.dt, self._is_pressed(one))
        return done

    def _begin_step(self) -> int:
        """Read all bodies and set those of the world; return how many are to be pushed, or PASSED."""
        for one in self.trees:
            one.read(one.start)
        self._read()
        return self._set_bodies()

    def _set_bodies(self) -> int:
        """Set the bodies of the world as they were read; return how many are to be pushed, or PASSED."""
        pushed = begin_step(self._head_at)
        if pushed == PASSED:
            return pushed
        if pushed == rows.NOT_FINITE:
            self._refuse()
        found = pushed == rows.PLACED
        for one in self.trees:
            one.begin_step(self._head["gravity"][0])
            one.set_tree(self.dt)
            self.rows["placed"][one.members] = one.placed
            found |= one.placed
        if found:
            self._find_pressed()
            pushed = select_pushed(self._head_at)
        for one in self._measured:
            one.place(self._client, self.arrays, self.dt)
        return pushed

    def _read_parameters(self) -> bool:
        """Read the time step and gravity; return whether they have changed."""
        told = engine_parameters(self._client)
        known = tuple(told[name] for name in PARAMETERS)
        if known == self._parameters:
            return False
        self.dt, self._parameters = known[0], known
        self._head["dt"], self._head["gravity"] = self.dt, known[1:]
        return True

    def _fly(self) -> bool:
        """Read poses after a step in which no two bodies could touch in free flight; return whether none can have.

        They are those before the next step, which then is begun by nothing else: a pose or a velocity that the user
        sets in between shows after that step. It is then taken back, and begun anew with what has been set.
        """
        if not self._flies:
            self._note_fixed()
        self._read_poses()
        done = has_flown(self._head_at) if [pose() for pose in self._fixed] == self._stood else STRAYED
        if done == STRAYED:
            self._read()
            self._note_fixed()
            self._read_parameters()
            rewind(self._head_at)
            if self._set_bodies() == PASSED:
                done = has_flown(self._head_at)
        self._flies = done == PASSED
        self._last[: len(self._heavy)] = [NOTHING] * len(self._heavy)  # the rows have changed
        return done != STRAYED

    def _note_fixed(self) -> None:
        """Note the poses of fixed bodies, as last read."""
        self._stood = [pose for pose, _ in self._last[len(self._heavy) : len(self._readers)]]

    def _finish_step(self) -> int:
        """Take the step of the world; return as `hooks.write_bodies`."""
        while (done := finish_step(self._head_at)) < 0:
            if done == rows.NOT_FINITE:
                self._refuse()
            if done == rows.NO_ROOM and not PENDING_ERROR:  # whose truth raises an error that was stored
                self.bind(with_more_room(self.arrays))
                continue
            if self._simple and self._read_parameters():
                begin_step(self._head_at)
            if done == rows.OTHERS:
                self._read_poses()
                self.read_masses(np.flatnonzero(self.rows["disturbed"] == 2).tolist())
        return done

    def _find_pressed(self) -> None:
        """After the user has moved bodies: find near pairs, and what presses on what."""
        self._check()
        self.read_masses(np.flatnonzero((self.rows["placed"] != 0) & (self.rows["in_tree"] == 0)).tolist())
        self._state["stale"] = 1
        while step(self._state, 0.0, 1) == 0:
            self.bind(with_more_room(self.arrays))
        find_pressed(self._head_at)
        for one in self.trees:
            if one.placed:
                self.arrays.bodies["held"][:, 0] = np.nan
                one.pressed = self._is_pressed(one)
                one.set_tree(self.dt)

    def _is_pressed(self, one: Tree) -> bool:
        return bool(self.rows["pressed"][one.members].any())

    def _read(self) -> bool:
        """Read poses and velocities of bodies into the rows; return whether one has changed."""
        new, last, moving, moved = False, self._last, len(self._heavy), []
        for i, (pose, velocity, write) in enumerate(self._readers):
            state = pose(), velocity()
            if state != last[i]:
                if i >= moving and last[i] is not NOTHING:
                    moved.append(self._order[i])
                last[i], new = state, True
                (x, q), (v, w) = state
                write(*x, *q, *v, *w)
        if moved:
            self.read_masses(moved)
        return new

    def _read_poses(self) -> None:
        """After Bullet's step: read the poses of bodies that have a mass."""
        for pose, write in self._poses:
            x, q = pose()
            write(*x, *q)

    def _calls_to_push(self, number: int) -> list[Callable[[], Any]]:
        """Return calls that apply forces and torques to the first `number` selected bodies."""
        calls, client, frame = [], self._client, p.WORLD_FRAME
        for k in self._selected_rows[:number]:
            body, at = self.keys[k][0], k * SIZE
            fx, fy, fz, tx, ty, tz = SIX_FORMAT.unpack_from(self._bytes, at + FORCE)
            place = POSITION_FORMAT.unpack_from(self._bytes, at + BEFORE)
            calls.append(partial(p.applyExternalForce, body, BASE, (fx, fy, fz), place, frame, client))
            if tx != 0.0 or ty != 0.0 or tz != 0.0:
                calls.append(partial(p.applyExternalTorque, body, BASE, (tx, ty, tz), frame, client))
        return calls

    def _put(self, number: int) -> None:
        """Set pose and velocity of the first `number` selected bodies to where they are `left`."""
        for k in self._selected_rows[:number]:
            body, own = self.keys[k][0], MOTION_FORMAT.unpack_from(self._bytes, k * SIZE + LEFT)
            p.resetBasePositionAndOrientation(body, own[:3], own[3:7], self._client)  # it also stops the body
            p.resetBaseVelocity(body, own[7:10], own[10:], self._client)

    def _refuse(self) -> None:
        lost = int(self._state["lost_body"][0])  # by the last step, and with it all that it touched
        name = name_of(self.keys[lost - 1 if lost else int(self._head["bad"][0])])
        raise ValueError(f"{name}: its position, velocity, or gravity is not finite")


def _readers_of(key: Key, client: int) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """Return functions that read position and quaternion, and velocity and spin, of a base or a link."""
    if key[1] == BASE:
        return partial(p.getBasePositionAndOrientation, key[0], client), partial(p.getBaseVelocity, key[0], client)
    read = partial(p.getLinkState, *key, 1, 1, client)
    return lambda: read()[:2], lambda: read()[6:]


def _mass_of(key: Key, client: int) -> tuple[float, tuple[float, float, float]]:
    """Return mass and principal moments of a body; zero for a link that nothing can push, or a removed body."""
    try:
        info = p.getDynamicsInfo(*key, client) if key[1] == BASE else (0.0, 0.0, (0.0, 0.0, 0.0))
    except p.error:
        return 0.0, (0.0, 0.0, 0.0)
    return info[0], info[2]
