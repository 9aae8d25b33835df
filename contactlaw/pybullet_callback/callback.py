"""The contact law in PyBullet: a callback that the user's loop calls before each stepSimulation."""

from __future__ import annotations

import operator
import struct
from collections.abc import Iterable, Mapping, Sequence
from itertools import count
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import ArrayLike, NDArray

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback import linked
from contactlaw.pybullet_callback.contact import Contact, ContactState, Ledger, state_of
from contactlaw.pybullet_callback.couples import couples_of
from contactlaw.pybullet_callback.layout import Layout
from contactlaw.pybullet_callback.linked import Linked
from contactlaw.pybullet_callback.losses import Losses
from contactlaw.pybullet_callback.marks import Marks
from contactlaw.pybullet_callback.shapes import BASE, engine_parameters, read_sides
from contactlaw.pybullet_callback.step import (
    ACT,
    DIVERGED,
    ENDED,
    LEDGERS,
    LOOK,
    NO_ROOM,
    NOT_FINITE,
    NOTHING,
    PUSHES,
    advance,
    prepare,
)
from contactlaw.pybullet_callback.tables import APART, BAD, PUSH, STILL
from contactlaw.pybullet_callback.watch import look_over

Array = NDArray[np.float64]

LEAST_SUBSTEPS = 10
LOOK_AGAIN = 60  # steps after which bodies at rest that are left alone are looked at
HEAD = struct.Struct("4d")  # time step and gravity
PUSHED = struct.Struct(f"{PUSH}d")


class ContactCallback:
    """The contact law for chosen bodies of one physics client; call it before every stepSimulation.

    It reads where the bodies are and how they move, integrates their contacts through the coming step with steps of
    their own, and applies what comes out as forces and torques. The time step may be far longer than a contact, and
    several impacts may fall into one. Bullet's own response is off for these pairs and only these. An error changes
    nothing.

    What must hold, and what cannot be known:
      * numSubSteps must be 0 or 1, as a force stays the same over the substeps. The time step and gravity are read at
        every call and must not change between the call and stepSimulation.
      * An impulse late in a step acts in part in the next one: between the two, PyBullet's own velocities lack that
        part. `owed` and `velocity` tell it.
      * Radii come from spheres, capsule ends, planes and box faces. With `pair.radius` a sphere may touch any shape,
        and a capsule any if neither is a body of its own without joints; the deepest point found acts alone. Others, a
        box on a plane say, are refused: they touch in more than one point. Without `pair.radius` a box edge or a
        capsule side is an error when the bodies touch. A capsule that lies on a plane or a box does so with both ends.
      * Of what moves bodies between the contacts, gravity alone is foreseen, and of bodies with links no Coriolis or
        centrifugal accelerations. Forces applied by the user, motors, joint limits, constraints and native contacts act
        all the same, but an impact within the step does not know of them.
      * Masses and inertias are those at the touch.
      * Bullet's default damping and its clamp of velocities at 100 m/s and 100 rad/s eat energy and cannot be read.
        They are recognised by what they do, and warned of once per body: the default damping in the first steps of
        free flight of a body without links, the clamp when a base in touch moves at exactly 100. Set
        changeDynamics(body, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e6).
      * Removing a contact turns the native response of its pairs on, whatever collision groups say: what
        setCollisionFilterPair said before cannot be read.
      * Remove a contact before its bodies. A body that has gone, or another one that PyBullet has given its id, is an
        error at the next call that sees the number of bodies change, or at the touch. Bodies carry a user data entry
        for this.

    Args:
        client: Physics client id.
        fixed_bodies_move: Whether bodies that nothing can push may be moved by the user, put elsewhere or given a
            velocity, at any time. False: they are read when a contact is added, at `restore`, and when something new
            touches them, which saves 1 to 2 us a body and step.
        left_alone: Whether bodies are left alone between calls: nobody puts them elsewhere or pushes them, gravity and
            the contacts of this callback alone move them, and neither gravity nor the time step changes. Then nothing
            is read as long as none can touch another, and what is at rest is looked at now and then only. Call `look`
            after a change. Has no effect where bodies have links or shapes that PyBullet must measure.
    """

    def __init__(self, client: int = 0, *, fixed_bodies_move: bool = True, left_alone: bool = False) -> None:
        if isinstance(client, bool) or not isinstance(client, int | np.integer) or not p.isConnected(int(client)):
            raise ValueError(f"client = {client!r}: must be the id of a connected physics client")
        if not isinstance(fixed_bodies_move, bool):
            raise ValueError(f"fixed_bodies_move = {fixed_bodies_move!r}: must be True or False")
        if not isinstance(left_alone, bool):
            raise ValueError(f"left_alone = {left_alone!r}: must be True or False")
        prepare()
        self._client = int(client)
        self._moves, self._alone = fixed_bodies_move, left_alone
        self._unseen = 0  # steps for which nothing needs to be read
        self._contacts: dict[int, Contact] = {}
        self._handles = count()
        self._marks = Marks(self._client)
        self._body_count = -1
        self._dt = 0.0
        self._losses = Losses(self._client)
        self._layout = Layout(self._client, {})

    def add_contact(
        self,
        body_a: int | Sequence[int] | Sequence[tuple[int, int]],
        body_b: int | Sequence[int] | Sequence[tuple[int, int]],
        pair: ContactPair,
        link_a: int = -1,
        link_b: int = -1,
        *,
        substeps: int = 100,
        ledger: bool = False,
    ) -> int:
        """Let the law act between two bodies, or those of two sets, in place of the native response.

        Args:
            body_a, body_b: PyBullet's ids; or sequences of ids or of (body, link), every one of A then with every one
                of B, but none with itself and each two once. In sets, two bodies that cannot move are left out.
            pair: The contact; its radius, where None, comes from the shapes, for each two bodies theirs.
            link_a, link_b: Links of plain ids; -1: the base.
            substeps: Least number of steps that a contact is resolved by, >= 10; the error falls with its square.
            ledger: Whether to keep account, see `ledger`.

        Returns:
            A handle for the other methods.

        Raises:
            ValueError: Unknown ids, the same body twice, two bodies added already, shapes that touch in more than one
                point, no radius to be had, substeps.
        """
        if not isinstance(pair, ContactPair):
            raise ValueError(f"pair = {pair!r}: must be a contactlaw.ContactPair")
        a = read_sides(self._client, "a", body_a, link_a)
        b = read_sides(self._client, "b", body_b, link_b)
        if not isinstance(ledger, bool):
            raise ValueError(f"ledger = {ledger!r}: must be True or False")
        couples = couples_of(self._client, a, b, pair, self._contacts)
        contact = Contact(pair, _substeps(substeps), couples, Ledger() if ledger else None)
        engine_parameters(self._client)
        handle = next(self._handles)
        layout = Layout(self._client, self._contacts | {handle: contact}, self._layout, fixed_bodies_move=self._moves)
        if not layout.plain:
            linked.prepare(layout.tables)
        self._contacts[handle], self._layout = contact, layout
        self.look()
        for couple in couples:
            one, two = couple.a, couple.b
            p.setCollisionFilterPair(one.body, two.body, one.link, two.link, 0, self._client)
        for body in self._marks.put({side.body for couple in couples for side in couple.sides}):
            self._losses.adopt(body)
        return handle

    def remove_contact(self, handle: int) -> None:
        """Forget a contact and give its pairs the native response back; its bodies may be gone already."""
        contact = self._contact(handle)
        del self._contacts[handle]
        for couple in contact.couples:
            a, b = couple.a, couple.b
            if self._marks.is_there(a.body) and self._marks.is_there(b.body):
                p.setCollisionFilterPair(a.body, b.body, a.link, b.link, 1, self._client)
        used = {side.body for other in self._contacts.values() for couple in other.couples for side in couple.sides}
        for body in {side.body for couple in contact.couples for side in couple.sides} - used:
            self._marks.take(body)
            self._losses.release(body)
        self._layout = Layout(self._client, self._contacts, self._layout, fixed_bodies_move=self._moves)
        self.look()

    def remove_all(self) -> None:
        """Remove every contact."""
        for handle in list(self._contacts):
            self.remove_contact(handle)

    def state(self, handle: int) -> ContactState:
        """The contact of two bodies as the last call left it; of sets see `states`."""
        contact = self._contact(handle)
        if len(contact.couples) != 1:
            raise ValueError(f"handle = {handle!r}: a contact of {len(contact.couples)} pairs; use states")
        return state_of(contact.couples[0], contact, self._layout.records_of(handle, 0), self._dt)

    def states(self, handle: int) -> list[ContactState]:
        """Those contacts of a handle that touch within the step, as the last call left them."""
        contact = self._contact(handle)
        return [
            state_of(contact.couples[number], contact, self._layout.records_of(handle, number), self._dt)
            for number in self._layout.touching(handle)
        ]

    def ledger(self, handle: int) -> Ledger:
        """A copy of the account of a handle.

        Raises:
            ValueError: It was not asked for in `add_contact`.
        """
        ledger = self._contact(handle).ledger
        if ledger is None:
            raise ValueError(f"handle = {handle!r}: keeps no ledger; ask for it with add_contact(..., ledger=True)")
        return Ledger(**vars(ledger))

    def owed(self, body: int) -> tuple[Array, Array]:
        """What the next step still owes a body: impulse [N s] and angular impulse about its base [N m s], (3,) each."""
        return self._balance(body)[:2]

    def velocity(self, body: int) -> tuple[Array, Array]:
        """True velocity [m/s] and spin [rad/s] of a base now, each (3,).

        PyBullet's own velocity is that of half a step before its position, and an impulse that comes late in a step is
        given in part in the next one: between the two shares it is neither that before an impact nor that after. This
        one has what is owed and half a step of gravity more, so that it is zero for a body at rest, and after an
        impact the one that the body flies off with. While bodies touch it is what they move with now.
        """
        return self._balance(body)[2:]

    def _balance(self, body: int) -> tuple[Array, Array, Array, Array]:
        bodies = self._layout.bodies
        if body not in {known for known, _ in bodies.keys}:
            raise ValueError(f"body = {body!r}: has no contact; must be one of {sorted({b for b, _ in bodies.keys})}")
        self._check_bodies([body])
        self._read()
        return Linked(self._client, self._layout.tables, bodies).balance(body)

    def save(self) -> dict[int, Array]:
        """What is remembered of every handle; with PyBullet's saveState, all that a restart needs.

        Call it where saveState is called, before the callback or after stepSimulation. A row for each contact: which of
        the handle's pairs, slot, time step, and the record as `contactlaw.kernels.scene` lays it out. Ledgers are not
        in it.
        """
        return {handle: self._layout.save(handle, self._dt) for handle in self._contacts}

    def restore(self, saved: Mapping[int, ArrayLike]) -> None:
        """Bring back what `save` gave; a handle without a record starts open.

        Raises:
            ValueError: An unknown handle, or a record that does not fit its contact.
        """
        for handle in saved:
            self._contact(handle)
        dt = self._layout.restore({handle: np.asarray(record) for handle, record in saved.items()})
        self._dt = self._dt if dt is None else dt
        self.look()

    def __call__(self) -> None:
        """Apply the forces of this step.

        Raises:
            ValueError: Bodies, shapes or their motion are not what the class asks for.
        """
        bodies_now = p.getNumBodies(self._client)
        if bodies_now != self._body_count:
            self._check_bodies({body for body, _ in self._layout.bodies.keys})
            self._body_count = bodies_now
        if not self._contacts:
            return
        layout = self._layout
        if self._unseen > 0:
            self._unseen -= 1
            still = int(layout.tables.memory[STILL])
            if still:
                self._push(still)
            return
        parameters = self._read()
        result = self._advance()
        while result < 0 or result & LOOK:
            if result == NO_ROOM:
                layout.widen()
            elif result < 0:
                self._refuse(result)
            elif not layout.bodies.refresh(look_over(layout, self._marks, self._losses), layout.tables):
                break
            result = self._advance()
        if result != NOTHING:
            self._act(result, parameters)
        elif self._losses.flying:
            self._losses.watch(set(), parameters)
        if self._alone and layout.plain and not self._losses.flying:
            memory = layout.tables.memory
            self._unseen = LOOK_AGAIN if memory[STILL] else int(memory[APART])

    def look(self) -> None:
        """Read everything at the next call: for bodies that are left alone and have been changed all the same."""
        self._unseen, self._layout.tables.memory[STILL] = 0, 0.0

    def _advance(self) -> int:
        """A step of the tables as they are."""
        layout = self._layout
        if layout.plain:
            return advance(layout.tables.memory)
        return Linked(self._client, layout.tables, layout.bodies).advance()

    def _act(self, result: int, parameters: dict[str, Any]) -> None:
        """Nothing can fail any more: apply the forces, and let the records that belong to them be in force."""
        layout, tables = self._layout, self._layout.tables
        self._push(result)
        self._dt = parameters["fixedTimeStep"]
        if result % PUSHES == ACT and not self._losses.flying:
            return
        if result & LEDGERS:
            layout.enter(self._dt)
        if self._losses.flying:
            self._losses.watch(layout.bodies_near(), parameters)
        if result % PUSHES != ACT:
            ended = layout.ended() if result & ENDED else set()
            tables.commit()
            for body in ended:
                self._losses.take_off(body)

    def _push(self, result: int) -> None:
        """Apply the forces and torques that a step came to."""
        layout, tables, client = self._layout, self._layout.tables, self._client
        for i in range(result // PUSHES):
            row, fx, fy, fz, tx, ty, tz, x, y, z = PUSHED.unpack_from(tables.buffer, tables.pushes_at + i * PUSHED.size)
            body, link = layout.bodies.keys[int(row)]
            p.applyExternalForce(body, link, (fx, fy, fz), (x, y, z), p.WORLD_FRAME, client)
            if tx != 0.0 or ty != 0.0 or tz != 0.0:
                p.applyExternalTorque(body, link, (tx, ty, tz), p.WORLD_FRAME, client)

    def _read(self) -> dict[str, Any]:
        """Everything that a step needs to know of the engine, into the tables."""
        parameters = engine_parameters(self._client)
        tables = self._layout.tables
        HEAD.pack_into(
            tables.buffer, 0, parameters["fixedTimeStep"], parameters["gravityAccelerationX"],
            parameters["gravityAccelerationY"], parameters["gravityAccelerationZ"],
        )  # fmt: skip
        self._layout.bodies.read(tables)
        return parameters

    def _refuse(self, result: int) -> None:
        """Say what a step failed of."""
        bad, layout = int(self._layout.tables.memory[BAD]), self._layout
        if result == NOT_FINITE:
            body, link = layout.bodies.keys[bad]
            name = f"body {body}" if link == BASE else f"body {body} link {link}"
            raise ValueError(f"{name}: its position, velocity, or gravity is not finite")
        assert result == DIVERGED
        raise ValueError(f"{layout.couples[bad][2]}: what they exchange is not finite")

    def _contact(self, handle: Any) -> Contact:
        if handle not in self._contacts:
            raise ValueError(f"handle = {handle!r}: must be one of {list(self._contacts)}")
        return self._contacts[handle]

    def _check_bodies(self, bodies: Iterable[int]) -> None:
        for body in bodies:
            self._marks.check(body)


def _substeps(value: Any) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        number = 0
    if isinstance(value, bool) or number < LEAST_SUBSTEPS:
        raise ValueError(f"substeps = {value!r}: must be an integer >= {LEAST_SUBSTEPS}")
    return number
