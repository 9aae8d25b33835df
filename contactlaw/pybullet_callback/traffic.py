"""What goes between PyBullet and the world in a step: bodies are read, pushed and put where they are to be."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.exchange import (
    FLAGS,
    HEAD,
    JOB,
    MOTION,
    NO_ROOM,
    NOT_FINITE,
    ROW,
    compare,
    press,
    receive,
    steady,
)
from contactlaw.pybullet_callback.hand_back import PASSED, complete, foresee, hand_back, set_off
from contactlaw.pybullet_callback.linked import Linked
from contactlaw.pybullet_callback.measure import Measured
from contactlaw.pybullet_callback.shapes import BASE, Key
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.frames import ALIKE
from contactlaw.world.records import Arrays
from contactlaw.world.step import step

PACKED, STEP, NUMBERS = struct.Struct(f"{MOTION.itemsize // 8}d"), struct.Struct("4d"), struct.Struct(f"{JOB}d")
BEFORE, AFTER = (int(ROW.fields[name][1]) for name in ("before", "after"))  # type: ignore[index]
STEP_AT = int(HEAD.fields["dt"][1])  # type: ignore[index]


class Traffic:
    """The bodies of PyBullet that a world holds.

    Args:
        client: Physics client id.
        world: With all bodies and shapes.
        keys: Body and link of each of its bodies.
        linked: Those with joints.
        measured: Who must be measured.
        moves: Whether bodies that nothing can move are read at every step.
    """

    def __init__(
        self, client: int, world: World, keys: list[Key], linked: list[Linked], measured: list[Measured], moves: bool
    ) -> None:
        self._client, self._world, self.keys, self.linked, self._measured = client, world, keys, linked, measured
        self.rows: Any = np.zeros(len(keys), ROW)
        self.jobs: Any = np.zeros((len(keys) + 1, JOB))
        self._head: Any = np.zeros(1, HEAD)
        self.rows["left"]["position"] = np.nan
        self._found, self._pushed = 0, []
        for one in linked:
            self.rows["linked"][one.first : one.first + len(one.keys)] = 1
        plain = [(k, key) for k, key in enumerate(keys) if not self.rows["linked"][k]]
        self._bases = [(key[0], k * ROW.itemsize) for k, key in plain if key[1] == BASE]
        self._still = [(key, k * ROW.itemsize) for k, key in plain if key[1] != BASE]
        self.bind(world.arrays)
        self.weigh(k for k, _ in plain)
        if not moves:
            self._read(BEFORE)
            self._bases, self._still = self._moving, []

    def bind(self, arrays: Arrays) -> None:
        """Let the compiled code know where the arrays are."""
        self._world._arrays = self.arrays = arrays.bound()
        self._state, self.seen = arrays.world, np.zeros(arrays.contacts.size)
        head = self._head
        head["world"], head["rows"], head["jobs"] = (a.ctypes.data for a in (self._state, self.rows, self.jobs))
        head["seen"], head["count"] = self.seen.ctypes.data, len(self.keys)

    def weigh(self, rows: Iterable[int]) -> None:
        """Read masses and inertias of bodies without joints."""
        there = {p.getBodyUniqueId(i, self._client) for i in range(p.getNumBodies(self._client))}
        for k in rows:
            (body, link), row, own = self.keys[k], self.rows[k], self.arrays.bodies[k + 1]
            if row["linked"]:
                continue
            whole = link == BASE and body in there
            info = p.getDynamicsInfo(body, link, self._client) if whole else [0.0, 0.0, (0.0, 0.0, 0.0)]
            moments, moves = np.array(info[2]), info[0] > 0.0
            row["mass"], row["inertia"] = info[0], moments
            own["inverse_mass"] = 1.0 / info[0] if moves else 0.0
            own["inverse_inertia"] = np.divide(1.0, moments, np.zeros(3), where=moves & (moments > 0.0))
            own["isotropic"] = np.ptp(moments) <= ALIKE * moments.max()
            own["oriented"] |= 1 - own["isotropic"]
        heavy = {int(k) * ROW.itemsize for k in np.flatnonzero(self.rows["mass"])}
        self._moving = [one for one in self._bases if one[1] in heavy]

    def foresee(self, dt: float, gravity: tuple[float, float, float]) -> int:
        """The step that Bullet is about to take; returns what `exchange.look` says of the contacts."""
        if self.linked or self._measured:
            self._receive(dt, gravity)
        else:
            STEP.pack_into(self._head, STEP_AT, dt, *gravity)
            self._read(BEFORE)
            self._found = foresee(self._head, self._state)
            if self._found >= 0:
                return self._found
            if self._found == NOT_FINITE:
                self._refuse()
            self._settle(dt, NO_ROOM - self._found)
        self._step(dt)
        self._found = hand_back(self._head, 0)
        if self.linked:
            self._pushed = [one for one in self.linked if one.hand_back(self.arrays, dt, False, self._presses(one))]
        return self._found

    def push(self) -> None:
        """Apply the forces of the step that was foreseen."""
        if self._found >= FLAGS:
            self._push(self._found // FLAGS)
        for one in self._pushed:
            one.apply_push()

    def take_step(self, dt: float, gravity: tuple[float, float, float]) -> int:
        """A step of PyBullet, then the same one of the world, which is handed back; returns as `foresee`."""
        if not (self.linked or self._measured):
            return self._take_plain_step(dt, gravity)
        self._receive(dt, gravity)
        pushed = steady(self._head)
        if pushed:
            self._push(pushed)
        for one in self.linked:
            if one.pressed:
                one.apply_push()
            else:
                one.push[:] = 0.0
        p.stepSimulation(self._client)
        self._read(AFTER, self._moving)
        if compare(self._head) < 0:
            self._refuse()
        for one in self.linked:
            one.compare(self.arrays, dt)
        self._step(dt)
        done = hand_back(self._head, 1)
        if done >= FLAGS:
            self._put(done // FLAGS)
        for one in self.linked:
            one.hand_back(self.arrays, dt, True, self._presses(one))
        return done

    def _take_plain_step(self, dt: float, gravity: tuple[float, float, float]) -> int:
        """The same where no body has joints and none must be measured."""
        STEP.pack_into(self._head, STEP_AT, dt, *gravity)
        self._read(BEFORE)
        pushed = set_off(self._head)
        if pushed == NOT_FINITE:
            self._refuse()
        if NO_ROOM > pushed > PASSED:
            self._settle(dt, NO_ROOM - pushed)
            pushed = steady(self._head)
        if pushed > 0:
            self._push(pushed)
        p.stepSimulation(self._client)
        if pushed == PASSED:
            return 0
        self._read(AFTER, self._moving)
        done = complete(self._head, self._state)
        if done == NOT_FINITE:
            self._refuse()
        if done == NO_ROOM:
            self._step(dt)
            done = hand_back(self._head, 1)
        if done >= FLAGS:
            self._put(done // FLAGS)
        return done

    def _receive(self, dt: float, gravity: tuple[float, float, float]) -> None:
        """Read all bodies at the start of a step, and set the world's out from there."""
        STEP.pack_into(self._head, STEP_AT, dt, *gravity)
        self._read(BEFORE)
        found = receive(self._head)
        if found < 0:
            self._refuse()
        for one in self.linked:
            one.receive(self.arrays, gravity)
            one.set_out(self.arrays, dt)
            self.rows["strange"][one.first : one.first + len(one.keys)] = one.strange
            found |= int(one.strange)
        self._settle(dt, found)
        for one in self._measured:
            one.place(self._client, self.arrays, dt)

    def _settle(self, dt: float, found: int) -> None:
        """See to what `receive` found."""
        if found > 1:
            self._put(found >> 1)
        if found & 1:
            self._settle_in(dt)

    def _settle_in(self, dt: float) -> None:
        """Somebody has put bodies where they are: see who is near whom, and who lies on whom."""
        self._state["stale"] = 1
        self._step(0.0)
        press(self._head)
        for one in self.linked:
            if one.strange:
                self.arrays.bodies["held"][:, 0] = np.nan
                one.pressed = self._presses(one)
                one.set_out(self.arrays, dt)

    def _presses(self, one: Linked) -> bool:
        return bool(self.rows["pressed"][one.first : one.first + len(one.keys)].any())

    def _step(self, dt: float) -> None:
        """Move the world."""
        while step(self._state, dt, 1) == 0:  # there may not be room enough
            seen = self.seen
            self.bind(with_more_room(self.arrays))
            self.seen[: seen.size] = seen

    def _read(self, offset: int, bodies: list[tuple[int, int]] | None = None) -> None:
        """Where bodies are and how they move, into the rows; None: all."""
        client, buffer, pack = self._client, self.rows, PACKED.pack_into
        pose, velocity = p.getBasePositionAndOrientation, p.getBaseVelocity
        for body, at in self._bases if bodies is None else bodies:
            (x, q), (v, w) = pose(body, client), velocity(body, client)
            pack(buffer, at + offset, *x, *q, *v, *w)
        for (body, link), at in self._still if bodies is None else ():
            state = p.getLinkState(body, link, 1, 1, client)
            pack(buffer, at + offset, *state[0], *state[1], *state[6], *state[7])

    def _push(self, number: int) -> None:
        """Apply the forces and torques of the jobs."""
        for i in range(number):
            row, fx, fy, fz, tx, ty, tz, x, y, z = NUMBERS.unpack_from(self.jobs, i * NUMBERS.size)[:10]
            body = self.keys[int(row)][0]
            p.applyExternalForce(body, BASE, (fx, fy, fz), (x, y, z), p.WORLD_FRAME, self._client)
            if tx != 0.0 or ty != 0.0 or tz != 0.0:
                p.applyExternalTorque(body, BASE, (tx, ty, tz), p.WORLD_FRAME, self._client)

    def _put(self, number: int) -> None:
        """Put bodies where the jobs say, moving as they say."""
        for i in range(number):
            job = NUMBERS.unpack_from(self.jobs, i * NUMBERS.size)
            body = self.keys[int(job[0])][0]
            p.resetBasePositionAndOrientation(body, job[1:4], job[4:8], self._client)  # which stops it
            p.resetBaseVelocity(body, job[8:11], job[11:14], self._client)

    def _refuse(self) -> None:
        body, link = self.keys[int(self._head["bad"][0])]
        name = f"body {body}" if link == BASE else f"body {body} link {link}"
        raise ValueError(f"{name}: its position, velocity, or gravity is not finite")
