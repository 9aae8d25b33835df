"""What goes between PyBullet and the world in a step: bodies are read, pushed and put where they are to be."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.exchange import (
    FLAGS,
    HEAD,
    LIST,
    LYING,
    MOTION,
    NO_ROOM,
    NOT_FINITE,
    OTHERS,
    PASSED,
    ROW,
    complete,
    press,
    set_off,
    steady,
)
from contactlaw.pybullet_callback.linked import Linked
from contactlaw.pybullet_callback.measure import Measured
from contactlaw.pybullet_callback.shapes import BASE, Key, engine_parameters, name_of
from contactlaw.pybullet_callback.stepping import STEP_BULLET
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.data.demand import PENDING_ERROR
from contactlaw.world.data.frames import ALIKE
from contactlaw.world.data.records import Arrays
from contactlaw.world.step import step

FRAME = p.WORLD_FRAME
NOTHING: Any = (), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # read of a body yet
WHOLE, POSE, SPEED = struct.Struct(f"{MOTION.itemsize // 8}d"), struct.Struct("7d"), struct.Struct("6d")
PARAMETERS = "fixedTimeStep", "gravityAccelerationX", "gravityAccelerationY", "gravityAccelerationZ"
STEP, PLACE, SIZE = struct.Struct("4d"), struct.Struct("3d"), ROW.itemsize
BEFORE, AFTER, LEFT, FORCE = (int(ROW.fields[name][1]) for name in ("before", "after", "left", "force"))  # type: ignore[index]
SPEED_AFTER = AFTER + int(MOTION.fields["velocity"][1])  # type: ignore[index]
STEP_AT = int(HEAD.fields["dt"][1])  # type: ignore[index]


class Traffic:
    """The bodies of PyBullet that a world holds.

    What is read is written into the rows only where it is not what was read before. The time step and gravity are not
    read where bodies that fall free show that they are those known, and while all sleep, held; nor, while all are far
    apart, velocities of bodies that cannot be moved.

    Args:
        client: Physics client id.
        world: With all bodies and shapes.
        keys: Body and link of each of its bodies.
        linked: Those with joints.
        measured: Who must be measured.
        moves: Whether bodies that nothing can move are read at every step.
        check: Raises an error where a body is another one than it was.
        listed: Called when the list of near pairs is another one, which is made before Bullet's step then, or None.

    Attributes:
        dt: Of the step [s].
    """

    def __init__(
        self, client: int, world: World, keys: list[Key], linked: list[Linked], measured: list[Measured], moves: bool,
        check: Callable[[], None], listed: Callable[[], None] | None,
    ) -> None:  # fmt: skip
        self._client, self._world, self.keys, self._check = client, world, keys, check
        self.linked, self._measured, self._listed = linked, measured, listed
        self.rows: Any = np.zeros(len(keys), ROW)
        self._bytes = memoryview(self.rows.view(np.uint8))
        self._named: Any = np.zeros(len(keys), np.int64)
        self._names = memoryview(self._named)
        self._head: Any = np.zeros(1, HEAD)
        self._head["plain"] = self._plain = not (linked or measured)
        self._head["ahead"] = listed is not None
        self._head_at = self._head.ctypes.data
        self.rows["left"]["position"] = np.nan
        self._found, self._pushed, self._foreseen = 0, [], False
        self._pushes = list[Callable[[], Any]]()
        self.dt, self._fall, self._down, self._parameters = 0.0, 0.0, 0, ()
        for one in linked:
            self.rows["linked"][one.members] = 1
        plain = np.flatnonzero(self.rows["linked"] == 0).tolist()
        self.bind(world.arrays)
        self.weigh(plain)
        self._heavy = dict.fromkeys(k for k in plain if self.rows["mass"][k] > 0.0)
        self._moving = [(keys[k][0], k * SIZE) for k in self._heavy]
        fixed = [(keys[k], k * SIZE) for k in plain if self.rows["mass"][k] == 0.0]
        bases = self._moving + [(body, at) for (body, link), at in fixed if link == BASE]
        self._bases = [
            (partial(p.getBasePositionAndOrientation, body, client), partial(p.getBaseVelocity, body, client),
             partial(WHOLE.pack_into, self._bytes, at + BEFORE)) for body, at in bases
        ]  # fmt: skip
        self._steps = [
            (read[1], partial(SPEED.pack_into, self._bytes, at + SPEED_AFTER))
            for read, (_, at) in zip(self._bases, self._moving, strict=False)
        ]
        self._still = [one for one in fixed if one[0][1] != BASE]
        if not moves:
            self._read()
            self._bases, self._still = self._bases[: len(self._moving)], []

    def bind(self, arrays: Arrays) -> None:
        """Let the compiled code know where the arrays are."""
        self._world._arrays = self.arrays = arrays.bound()
        self._state, self.seen = arrays.world, np.zeros(arrays.contacts.size)
        head = self._head
        head["world"], head["rows"], head["named"] = (a.ctypes.data for a in (self._state, self.rows, self._named))
        head["seen"], head["count"] = self.seen.ctypes.data, len(self.keys)
        self._passed, self._lie, self._weights = False, False, dict[int, Any]()
        self._last, self._after = [NOTHING] * len(self.keys), [()] * len(self.keys)  # read before and after a step

    def weigh(self, rows: Iterable[int]) -> None:
        """Read masses and inertias of bodies without joints; what has others than before wakes."""
        for k in rows:
            mass, moments = told = _mass_of(self.keys[k], self._client)
            if told == self._weights.get(k):
                continue
            self._weights[k] = told
            row, own, inertia = self.rows[k], self.arrays.bodies[k + 1], np.array(moments)
            if mass == row["mass"] and (inertia == row["inertia"]).all():
                continue
            row["mass"], row["inertia"] = mass, inertia
            own["inverse_mass"] = 1.0 / mass if mass > 0.0 else 0.0
            own["inverse_inertia"] = np.divide(1.0, inertia, np.zeros(3), where=(mass > 0.0) & (inertia > 0.0))
            own["isotropic"] = np.ptp(inertia) <= ALIKE * inertia.max()
            own["oriented"] |= 1 - own["isotropic"]
            own["held"] = np.nan

    def weigh_near(self) -> bool:
        """The same of all that may touch something soon; returns whether links have others than the trees know."""
        if self._listed:
            self._listed()
        near = self.arrays.near_bodies[: self._state["near_body_count"][0]].tolist()
        self.weigh([k - 1 for k in near if k - 1 in self._heavy])
        return any(one.inertias() != one.known for one in self.linked)

    def foresee(self) -> int:
        """The step that Bullet is about to take; returns what `exchange.look` says of the contacts."""
        self._found, self._pushed, self._passed, self._lie = 0, [], False, False
        self._look_up()
        if self._set_off() != PASSED:
            self._found = self._complete(0)
            self._pushed = [
                one for one in self.linked if one.hand_back(self.arrays, self.dt, False, self._presses(one))
            ]
        self._foreseen = True
        return self._found

    def push(self) -> None:
        """Apply the forces of the step that was foreseen."""
        if self._found >= FLAGS:
            self._push(self._found // FLAGS)
        for one in self._pushed:
            one.apply_push()

    def take_step(self) -> int:
        """A step of PyBullet, then the same one of the world, which is handed back; returns as `foresee`."""
        if not (self._plain and self._parameters):
            self._look_up()
        lie = self._lie and not self._read()
        pushed = 0 if lie else self._set_off()
        if lie:
            for apply in self._pushes:
                apply()
        elif pushed > 0:
            self._push(pushed)
        for one in self.linked:
            one.apply_steady_push()
        STEP_BULLET(self._client)
        if pushed == PASSED:
            if self._falls() or not self._look_up():
                return 0
            set_off(self._head_at)  # once more: something may be met in such a step
            self._passed = False
        before, self._after = self._after, [velocity() for velocity, _ in self._steps]
        if lie:
            if before == self._after:
                return 0
            set_off(self._head_at)
        for was, now, (_, write) in zip(before, self._after, self._steps, strict=False):
            if now != was:
                write(*now[0], *now[1])
        for one in self.linked:
            one.compare(self.arrays, self.dt)
        done = self._complete(1)
        self._lie = done == LYING and self._plain and not self._still
        if done >= FLAGS:
            self._put(done // FLAGS, LEFT)
        for one in self.linked:
            one.hand_back(self.arrays, self.dt, True, self._presses(one))
        return done

    def _set_off(self) -> int:
        """Read all bodies and set the world's out from there; returns how many are to be pushed, or PASSED."""
        for one in self.linked:
            one.now = one.read()
        if not self._read(self._passed) and self._foreseen:
            self._refuse_twice()
        self._foreseen = False
        pushed = set_off(self._head_at)
        if self._passed and pushed != PASSED and self._read():
            pushed = set_off(self._head_at)
        self._passed = pushed == PASSED
        if self._passed:
            return pushed
        if pushed == NOT_FINITE:
            self._refuse()
        if pushed == LIST:
            self._list_anew()
            pushed = steady(self._head_at)
        found = max(LIST - pushed, 0)
        for one in self.linked:
            one.receive(self.arrays, self._head["gravity"][0])
            one.set_out(self.arrays, self.dt)
            self.rows["strange"][one.members] = one.strange
            found |= int(one.strange)
        if found:
            self._settle(found)
            pushed = steady(self._head_at)
        for one in self._measured:
            one.place(self._client, self.arrays, self.dt)
        return pushed

    def _look_up(self) -> bool:
        """Read the time step and gravity; returns whether they are others."""
        told = engine_parameters(self._client)
        known = tuple(told[name] for name in PARAMETERS)
        if known == self._parameters:
            return False
        self.dt, self._parameters = known[0], known
        STEP.pack_into(self._head, STEP_AT, *known)
        self._down = max(range(3), key=lambda i: abs(known[i + 1]))
        self._fall = self.dt * known[self._down + 1]
        return True

    def _falls(self) -> bool:
        """Whether the first body that moves has fallen, within a half, as in a step of the length and gravity known:
        so much longer it may be for what is called far apart.
        """
        if self._fall == 0.0:
            return False
        down, fall = self._down, self._fall
        return abs(self._steps[0][0]()[0][down] - self._last[0][1][0][down] - fall) < 0.5 * abs(fall)

    def _complete(self, stepped: int) -> int:
        """Move the world and hand it back."""
        while (done := complete(self._head_at, stepped)) < 0:
            if done == NOT_FINITE:
                self._refuse()
            if done == NO_ROOM and not PENDING_ERROR:  # or it raises
                self._make_room()
                continue
            if self._plain and self._look_up():
                set_off(self._head_at)
            if done == OTHERS:
                for body, at in self._moving:
                    x, q = p.getBasePositionAndOrientation(body, self._client)
                    POSE.pack_into(self._bytes, at + AFTER, *x, *q)
                self.weigh(np.flatnonzero(self.rows["other"] == 2).tolist())
        return done

    def _settle(self, found: int) -> None:
        """See to what `exchange.receive` found."""
        self._check()
        if found > 1:
            self._put(found >> 1, BEFORE)
            self._last = [(pose(), velocity()) for pose, velocity, _ in self._bases]
        if not found & 1:
            return
        # somebody has put bodies where they are: see who is near whom, and who lies on whom
        self.weigh(np.flatnonzero((self.rows["strange"] != 0) & (self.rows["linked"] == 0)).tolist())
        self._list_anew()
        self.arrays.bodies["placed"][1:] = self.rows["strange"]
        press(self._head_at)
        for one in self.linked:
            if one.strange:
                self.arrays.bodies["held"][:, 0] = np.nan
                one.pressed = self._presses(one)
                one.set_out(self.arrays, self.dt)

    def _list_anew(self) -> None:
        """See who is near whom, before Bullet does."""
        self._state["stale"] = 1
        while step(self._state, 0.0, 1) == 0:
            self._make_room()
        if self._listed:
            self._listed()

    def _presses(self, one: Linked) -> bool:
        return bool(self.rows["pressed"][one.members].any())

    def _make_room(self) -> None:
        seen = self.seen
        self.bind(with_more_room(self.arrays))
        self.seen[: seen.size] = seen

    def _read(self, passed: bool = False) -> bool:
        """Where bodies are and how they move, into the rows; returns whether something is not as it was before.

        passed: whether how those move that cannot be moved does not matter.
        """
        new, last, moving = False, self._last, len(self._moving)
        for i, (pose, velocity, write) in enumerate(self._bases):
            state = pose(), last[i][1] if passed and i >= moving else velocity()
            if state != last[i]:
                last[i], new = state, True
                (x, q), (v, w) = state
                write(*x, *q, *v, *w)
        for (body, link), at in self._still:
            state = p.getLinkState(body, link, 1, 1, self._client)
            WHOLE.pack_into(self._bytes, at + BEFORE, *state[0], *state[1], *state[6], *state[7])
        return new

    def _push(self, number: int) -> None:
        """Apply the forces and torques of bodies that have been named."""
        rows, client, force, torque = self._bytes, self._client, p.applyExternalForce, p.applyExternalTorque
        self._pushes = []
        for k in self._names[:number]:
            body, at = self.keys[k][0], k * SIZE
            fx, fy, fz, tx, ty, tz = SPEED.unpack_from(rows, at + FORCE)
            place = PLACE.unpack_from(rows, at + BEFORE)
            self._pushes.append(partial(force, body, BASE, (fx, fy, fz), place, FRAME, client))
            if tx != 0.0 or ty != 0.0 or tz != 0.0:
                self._pushes.append(partial(torque, body, BASE, (tx, ty, tz), FRAME, client))
        for apply in self._pushes:
            apply()

    def _put(self, number: int, motion: int) -> None:
        """Put bodies that have been named where a motion in their rows says, moving as it says."""
        for k in self._names[:number]:
            body, own = self.keys[k][0], WHOLE.unpack_from(self._bytes, k * SIZE + motion)
            p.resetBasePositionAndOrientation(body, own[:3], own[3:7], self._client)  # which stops it
            p.resetBaseVelocity(body, own[7:10], own[10:], self._client)

    def _refuse_twice(self) -> None:
        """Nothing has moved since a step was foreseen: that is right only if nothing was moving."""
        moving = [body for body, _ in self._moving if any(map(any, p.getBaseVelocity(body, self._client)))]
        moving += [one.body for one in self.linked if one.now[1].any()]
        if moving and all(
            np.array_equal(now, was) for one in self.linked for now, was in zip(one.now, one.start, strict=True)
        ):
            raise ValueError(
                f"called again before stepSimulation: body {moving[0]} moves, and is where it was; call it once for "
                "each step, and let `restore` go with restoreState"
            )

    def _refuse(self) -> None:
        name = name_of(self.keys[int(self._head["bad"][0])])
        raise ValueError(f"{name}: its position, velocity, or gravity is not finite")


def _mass_of(key: Key, client: int) -> tuple[float, tuple[float, float, float]]:
    """Mass and principal moments of a body; none of a link that nothing can move, or of a body that has gone."""
    try:
        info = p.getDynamicsInfo(*key, client) if key[1] == BASE else (0.0, 0.0, (0.0, 0.0, 0.0))
    except p.error:
        return 0.0, (0.0, 0.0, 0.0)
    return info[0], info[2]
