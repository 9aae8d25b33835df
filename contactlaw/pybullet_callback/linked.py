"""The same step where bodies have links, or shapes that PyBullet must measure: the compiled parts, with Python between.

Coriolis and centrifugal accelerations of the links, and what motors and joint limits do, are not foreseen.
"""

from __future__ import annotations

import numpy as np
import pybullet as p
from numba import typeof, types
from numpy.typing import NDArray

from contactlaw.jit import INTERPRETED, compile_now, compiling
from contactlaw.kernels.meeting import SAFETY, meet
from contactlaw.kernels.rows import FRAME
from contactlaw.kernels.scene import (
    ANGULAR,
    ANGULAR_RATE,
    BODY_OF,
    LINEAR,
    MEAN,
    MEAN_SPIN,
    RATE,
    SHAPE_A,
    SHAPE_B,
    TREE,
    describe,
)
from contactlaw.kernels.touch import CLEAR, FOUND, FOUND_OVERLAP, KIND, NORMAL, OTHER, STAYS_A, STAYS_B
from contactlaw.pybullet_callback.bodies import Bodies
from contactlaw.pybullet_callback.mechanism import Mechanism, read_motion
from contactlaw.pybullet_callback.shapes import BASE
from contactlaw.pybullet_callback.stance import set_out
from contactlaw.pybullet_callback.step import NOT_FINITE, NOTHING, exchange, look_around
from contactlaw.pybullet_callback.tables import DT, GRAVITY, WIDTH, Tables, views, workspace

Array = NDArray[np.float64]

COMPILE_TIME = 25  # [s]
ON_A, ON_B, DIRECTION, DISTANCE = 5, 6, 7, 8  # in a point of getClosestPoints


def prepare(tables: Tables) -> None:
    """Compile what a step of such contacts needs."""
    if INTERPRETED:
        return
    t, number = tables, types.float64
    memory, seen, work = (typeof(value) for value in (t.memory, views(t.memory), workspace(t.memory)))
    pairs, shapes, places, bodies, parameters, records = (
        typeof(value) for value in (t.pairs, t.shapes, t.places, t.bodies, t.parameters, t.records)
    )
    with compiling("the PyBullet callback for bodies with links", COMPILE_TIME):
        compile_now(set_out, memory, seen)
        near, ways = compile_now(look_around, memory, seen)
        found = compile_now(meet, near, ways, pairs, shapes, places, bodies, number[:, ::1], number, work)
        whole, yes = typeof(0), typeof(True)
        told = compile_now(
            describe, *found[:3], pairs, shapes, places, bodies, parameters, records, whole, number, yes, whole, work
        )
        compile_now(exchange, memory, seen, *found, *told)


class Linked:
    """One step of contacts of which some need Python.

    Args:
        client: Physics client id.
        tables: Filled with what was read.
        bodies: Whose rows are in the tables.
    """

    def __init__(self, client: int, tables: Tables, bodies: Bodies) -> None:
        self._client, self._tables, self._keys, self._linked = client, tables, bodies.keys, bodies.linked
        self._mechanisms: dict[int, Mechanism] = {}

    def advance(self) -> int:
        """As `step.advance`."""
        t = self._tables
        if not self.set_out():
            return NOT_FINITE
        near, ways = look_around(t.memory, views(t.memory))
        if self._stir({self._keys[row][0] for pair in near for row in self._rows(pair)}):
            near, ways = look_around(t.memory, views(t.memory))
        if near.size == 0:
            return NOTHING
        dt, records, work = float(t.memory[DT]), t.records, workspace(t.memory)
        measured = self._measure(near, ways)
        who, times, found, trees = meet(near, ways, t.pairs, t.shapes, t.places, t.bodies, measured, dt, work)
        if not len(who) and not len(records):
            return NOTHING
        rows, histories, arms, pulls, answers = describe(
            who, times, found, t.pairs, t.shapes, t.places, t.bodies, t.parameters, records, len(records), dt, True,
            int(t.memory[WIDTH]), work,
        )  # fmt: skip
        for i, (pair, _) in enumerate(who):
            for side, row in enumerate(self._rows(pair)):
                self._pull(row, arms[i, side], rows[i], pulls[i, side], answers[i, side])
        return exchange(t.memory, views(t.memory), who, times, found, trees, rows, histories, arms, pulls, answers)

    def set_out(self) -> bool:
        """As `step.set_out`, with the bodies that something is owed to."""
        if not set_out(self._tables.memory, views(self._tables.memory)):
            return False
        self._stir({body for row, (body, _) in enumerate(self._keys) if self._tables.owed[row].any()})
        return True

    def balance(self, body: int) -> tuple[Array, Array, Array, Array]:
        """Impulse and angular impulse about its base that a body is owed, and its base's true velocity and spin."""
        t, base = self._tables, read_motion(self._client, body, BASE)
        if not set_out(t.memory, views(t.memory)):
            raise ValueError(f"body {body}: its position or velocity, or those of another body, are not finite")
        rows = [row for row, key in enumerate(self._keys) if key[0] == body]
        linear, angular = np.zeros(3), np.zeros(3)
        for row in rows:
            linear += t.owed[row, :3]
            angular += t.owed[row, 3:] + np.cross(t.readings[row, :3] - base.position, t.owed[row, :3])
        if body not in self._linked:
            b = t.bodies[rows[0]]
            return linear, angular, b[LINEAR : LINEAR + 3].copy(), b[ANGULAR : ANGULAR + 3].copy()
        mechanism = Mechanism(self._client, body)
        change, _ = self._change(mechanism, {row: self._jacobian(mechanism, row) for row in rows})
        change = mechanism.jacobian_of(BASE, np.array(base.position)) @ change
        return linear, angular, base.velocity + change[:3], base.spin + change[3:]

    def _rows(self, pair: int) -> tuple[int, int]:
        """Bodies of both sides of a pair, as rows of the tables."""
        t = self._tables
        one, two = int(t.pairs[pair, SHAPE_A]), int(t.pairs[pair, SHAPE_B])
        return int(t.shapes[one, BODY_OF]), int(t.shapes[two, BODY_OF])

    def _stir(self, bodies: set[int]) -> bool:
        """Fill in the true motion of bodies with links; returns whether there was any to fill in."""
        new = (bodies & self._linked) - self._mechanisms.keys()
        for body in new:
            self._fill(body, Mechanism(self._client, body))
        return bool(new)

    def _jacobian(self, mechanism: Mechanism, row: int) -> Array:
        return mechanism.jacobian_of(self._keys[row][1], self._tables.readings[row, :3])

    def _change(self, mechanism: Mechanism, jacobians: dict[int, Array]) -> tuple[Array, Array]:
        """Generalized velocity that the engine's lacks, and the acceleration by gravity; jacobians: by row."""
        t = self._tables
        force = np.column_stack([np.zeros(len(mechanism.weight)), mechanism.weight @ t.memory[GRAVITY : GRAVITY + 3]])
        for row, jacobian in jacobians.items():
            force[:, 0] += jacobian.T @ t.owed[row]
        change, rate = mechanism.answer(force).T
        return change + 0.5 * t.memory[DT] * rate, rate

    def _fill(self, body: int, mechanism: Mechanism) -> None:
        t = self._tables
        self._mechanisms[body] = mechanism
        rows = [row for row, key in enumerate(self._keys) if key[0] == body]
        jacobians = {row: self._jacobian(mechanism, row) for row in rows}
        change, rate = self._change(mechanism, jacobians)
        for row, jacobian in jacobians.items():
            b = t.bodies[row]
            moved, speeds = jacobian @ change, jacobian @ rate
            b[LINEAR : LINEAR + 3] = b[MEAN : MEAN + 3] + moved[:3]
            b[ANGULAR : ANGULAR + 3] = b[MEAN_SPIN : MEAN_SPIN + 3] + moved[3:]
            b[RATE : RATE + 3], b[ANGULAR_RATE : ANGULAR_RATE + 3] = speeds[:3], speeds[3:]

    def _pull(self, row: int, arm: Array, contact: Array, pulls_out: Array, answers_out: Array) -> None:
        """Generalized forces along the axes of a contact, and what a unit impulse of each gives."""
        body, link = self._keys[row]
        mechanism = self._mechanisms.get(body)
        if mechanism is None or self._tables.bodies[row, TREE] < 0.0:
            return
        point = self._tables.readings[row, 0:3] + arm
        pulls = contact[FRAME : FRAME + 9].reshape(3, 3) @ mechanism.jacobian(link, point)
        n = pulls.shape[1]
        pulls_out[:, :n], answers_out[:, :n] = pulls, mechanism.answer(pulls.T).T

    def _measure(self, near: NDArray[np.int64], ways: Array) -> Array:
        """The closest points of near pairs that the kernels cannot locate, pair and `FOUND` each."""
        t, out = self._tables, []
        reach = SAFETY * 2.0 * float(ways.max())
        for pair in near:
            one, two = int(t.pairs[pair, SHAPE_A]), int(t.pairs[pair, SHAPE_B])
            if OTHER not in (t.shapes[one, KIND], t.shapes[two, KIND]):
                continue
            a, b = self._rows(pair)
            (body_a, link_a), (body_b, link_b) = self._keys[a], self._keys[b]
            points = p.getClosestPoints(
                body_a, body_b, max(reach, 1e-6), link_a, link_b, physicsClientId=self._client
            )  # fmt: skip
            if not points:
                continue
            point = min(points, key=lambda point: point[DISTANCE])
            row = np.zeros(1 + FOUND)
            row[0], found = pair, row[1:]
            found[FOUND_OVERLAP], found[CLEAR] = -point[DISTANCE], 1.0
            found[NORMAL : NORMAL + 3] = point[DIRECTION]
            found[STAYS_A : STAYS_A + 3] = point[ON_A] - t.places[one, :3]
            found[STAYS_B : STAYS_B + 3] = point[ON_B] - t.places[two, :3]
            out.append(row)
        return np.array(out).reshape(-1, 1 + FOUND)
