"""The contact law in PyBullet: a callback that the user's loop calls before each stepSimulation.

Bullet steps v <- v + dt f/m, then x <- x + dt v. The velocities it reports are therefore those half a step before the
positions, which is what the law's leapfrog wants: a step of the law costs no correction and is second order.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from itertools import count
from math import inf
from operator import itemgetter
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks
from contactlaw.kernels.contact import NORMAL, OVERLAP
from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.contact import (
    PLACE,
    RESULTS,
    ROW,
    TANGENTIAL,
    Contact,
    ContactState,
    Point,
    advance,
    closing_speed,
    with_radius,
)
from contactlaw.pybullet_callback.geometry import (
    BASE,
    Motion,
    effective_radius,
    engine_parameters,
    read_motion,
    read_side,
)
from contactlaw.pybullet_callback.losses import Losses

Array = NDArray[np.float64]
Motions = dict[tuple[int, int], Motion]

LOOK_AHEAD = 20.0  # distance within which an approach is watched, in effective radii
ON_A, ON_B, DIRECTION, DISTANCE = 5, 6, 7, 8  # in a point of getClosestPoints

_CALLBACKS = count()


class ContactCallback:
    """The contact law for chosen pairs of bodies of one physics client; call it before every stepSimulation.

    It reads where the bodies are, asks the law for the forces and applies them, equal and opposite at one point inside
    the overlap. Bullet's own response is off for these pairs and only these. An error changes nothing.

    What must hold, and what cannot be known:
      * The step must resolve the contact: at most a tenth of its duration, checked at the touch, in the step before it,
        and when the step changes during one; the error names the step to use. numSubSteps must be 0 or 1, as forces
        stay the same over the substeps. Both are read whenever bodies touch or are about to.
      * Radii come from spheres, capsule ends, planes and box faces; anything else needs `pair.radius`, and then the
        deepest point found acts alone. Without `pair.radius` a box edge or a capsule side is an error when the bodies
        touch, a capsule lying on a flat body with both ends whenever it does.
      * What approaches by more than 20 effective radii in a step may pass through a thin body unseen.
      * Bullet's default damping and its clamp of velocities at 100 m/s and 100 rad/s eat energy and cannot be read.
        They are recognised by what they do, and warned of once per body: the default damping in the first steps of
        free flight of a body without links, the clamp when a base in touch moves at exactly 100. Set
        changeDynamics(body, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e6).
      * Effective masses are those at the touch; motors, joint limits, constraints and native contacts are not in them.
      * Removing a contact turns the native response of its pair on, whatever collision groups say: what
        setCollisionFilterPair said before cannot be read.
      * Remove a contact before its bodies. A body that has gone, or another one that PyBullet has given its id, is an
        error at the next call that sees the number of bodies change, or at the touch. Bodies carry a user data entry
        for this.

    Args:
        client: Physics client id.
    """

    def __init__(self, client: int = 0) -> None:
        if isinstance(client, bool) or not isinstance(client, int | np.integer) or not p.isConnected(int(client)):
            raise ValueError(f"client = {client!r}: must be the id of a connected physics client")
        self._client = int(client)
        self._contacts: dict[int, Contact] = {}
        self._next_handle = 0
        self._mark = f"contactlaw {next(_CALLBACKS)}"
        self._marked: set[int] = set()
        self._body_count = -1
        self._losses = Losses(self._client)
        self._lay_out()

    def add_contact(
        self,
        body_a: int,
        body_b: int,
        pair: ContactPair,
        link_a: int = -1,
        link_b: int = -1,
        *,
        plane: ArrayLike | None = None,
    ) -> int:
        """Let the law act between two bodies in place of the native response.

        Args:
            body_a, body_b: PyBullet's ids.
            pair: The contact; its radius, where None, comes from the shapes.
            link_a, link_b: Links; -1: the base.
            plane: Normal of the plane in which all motion happens, a unit vector: one traction component instead of
                two, at less cost. None: motion in space.

        Returns:
            A handle for the other methods.

        Raises:
            ValueError: Unknown ids, the same body twice, a pair added already, no radius to be had, substeps.
        """
        if not isinstance(pair, ContactPair):
            raise ValueError(f"pair = {pair!r}: must be a contactlaw.ContactPair")
        a, b = read_side(self._client, "a", body_a, link_a), read_side(self._client, "b", body_b, link_b)
        if a.key == b.key:
            raise ValueError(f"body_b = {body_b!r}, link_b = {link_b!r}: the same as a; a contact needs two")
        for handle, other in self._contacts.items():
            if {a.key, b.key} == {other.a.key, other.b.key}:
                raise ValueError(f"body_a, body_b = {body_a!r}, {body_b!r}: {other} have contact {handle} already")
        axis = None if plane is None else checks.unit_vector("plane", plane)
        radius = effective_radius(pair, a, b)
        engine_parameters(self._client)
        handle, self._next_handle = self._next_handle, self._next_handle + 1
        self._contacts[handle] = Contact(
            a=a,
            b=b,
            key_a=a.key,
            key_b=b.key,
            pair=with_radius(pair, radius),
            by_shape=pair.radius is None,
            plane=axis,
            parameters=pair.parameters(radius, axis),
            history=pair.history(planar=axis is not None),
            query=partial(
                p.getClosestPoints, a.body, b.body, LOOK_AHEAD * radius, a.link, b.link, physicsClientId=self._client
            ),
        )
        p.setCollisionFilterPair(a.body, b.body, a.link, b.link, 0, self._client)
        self._adopt({a.body, b.body} - self._marked)
        self._lay_out()
        return handle

    def remove_contact(self, handle: int) -> None:
        """Forget a contact and give its pair the native response back; its bodies may be gone already."""
        contact = self._contact(handle)
        del self._contacts[handle]
        a, b = contact.a, contact.b
        if self._is_there(a.body) and self._is_there(b.body):
            p.setCollisionFilterPair(a.body, b.body, a.link, b.link, 1, self._client)
        self._release({a.body, b.body} - {side.body for other in self._contacts.values() for side in other.sides})
        self._lay_out()

    def remove_all(self) -> None:
        """Remove every contact."""
        for handle in list(self._contacts):
            self.remove_contact(handle)

    def state(self, handle: int) -> ContactState:
        """The contact as the last call left it."""
        contact = self._contact(handle)
        h = contact.history.copy()
        return ContactState(
            contact.touching, float(h[OVERLAP]), float(h[NORMAL]), np.array(contact.tangential_force), h
        )

    def save(self) -> dict[int, Array]:
        """All histories by handle; with PyBullet's saveState, all that a restart needs."""
        return {
            handle: np.concatenate([[contact.dt, contact.share], contact.tangential_force, contact.history])
            for handle, contact in self._contacts.items()
        }

    def restore(self, saved: Mapping[int, ArrayLike]) -> None:
        """Bring back what `save` gave; a contact added since then starts open.

        Raises:
            ValueError: An unknown handle, or a record that does not fit its contact.
        """
        records = {handle: checks.finite_array(f"saved[{handle}]", record) for handle, record in saved.items()}
        for handle, record in records.items():
            wanted = (5 + self._contact(handle).history.size,)
            if record.shape != wanted:
                raise ValueError(f"saved[{handle}]: shape {record.shape}; must be {wanted}")
        for handle, contact in self._contacts.items():
            contact.open()
            contact.gap = inf
            if handle in records:
                record = records[handle]
                contact.dt, contact.share = float(record[0]), float(record[1])
                contact.tangential_force, contact.history[:] = record[2:5].copy(), record[5:]
                contact.touching = bool(contact.history[OVERLAP] > 0.0)

    def __call__(self) -> None:
        """Apply the forces of this step.

        Raises:
            ValueError: The step is too long for a contact, or bodies or shapes are not what the class asks for.
        """
        bodies_now = p.getNumBodies(self._client)
        if bodies_now != self._body_count:
            self._check_bodies(self._contacts.values())
            self._body_count = bodies_now
        near, parted = self._look()
        if near:
            self._act(near)
        if self._losses.flying:
            self._losses.watch({side.body for contact, _ in near for side in contact.sides})
        for contact in parted:
            contact.open()
            for side in contact.sides:
                self._losses.take_off(side.body)

    def _look(self) -> tuple[list[tuple[Contact, Point]], list[Contact]]:
        """Contacts that touch or may do so within this step; contacts that touched before and do no more."""
        near, parted = [], []
        for contact in self._contacts.values():
            points = contact.query()
            gap = inf
            if points:
                point = points[0] if len(points) == 1 else min(points, key=itemgetter(DISTANCE))
                gap = point[DISTANCE]
                # Far enough: the last step took less than a third of what was left before it.
                if gap >= 0.0 and contact.gap - gap < 0.5 * gap:
                    contact.gap = gap
                else:
                    near.append((contact, Point(point[ON_A], point[ON_B], point[DIRECTION], gap)))
            else:
                contact.gap = inf
            if contact.touching and gap >= 0.0:
                parted.append(contact)
        return near, parted

    def _act(self, near: list[tuple[Contact, Point]]) -> None:
        """Let the law act on the contacts that overlap; all that can fail comes before the first force."""
        dt = engine_parameters(self._client)["fixedTimeStep"]
        motions: Motions = {}
        acting: list[Contact] = []
        for contact, point in near:
            a, b = self._motion(contact.key_a, motions), self._motion(contact.key_b, motions)
            if contact.touching and point.gap < 0.0:
                contact.check_on(point, a, b, dt)
            elif point.gap < max(closing_speed(point, a, b), 0.0) * dt or point.gap < 0.0:
                self._check_bodies([contact])
                contact.check_touch(self._client, point, a, b, dt)
            if point.gap < 0.0:
                ROW.pack_into(
                    self._rows.data, len(acting) * ROW.size,
                    contact.number, *contact.masses, contact.share, point.gap, *point.on_a, *point.on_b, *point.normal,
                    *a.position, *a.velocity, *a.spin, *b.position, *b.velocity, *b.spin,
                )  # fmt: skip
                acting.append(contact)
        if acting:
            self._push(acting, motions, dt)
        for contact, point in near:
            contact.gap = max(point.gap, 0.0)

    def _push(self, acting: list[Contact], motions: Motions, dt: float) -> None:
        """Evaluate the law for the measured rows and apply its forces."""
        bad, clamped = advance(
            len(acting), self._rows, self._bounds, self._parameters, self._history, self._scratch, dt, self._results
        )
        if bad >= 0:
            raise ValueError(f"{acting[bad]}: position, velocity or force is not finite")
        for contact, row in zip(acting, self._results[: len(acting)].tolist(), strict=True):
            force, place = row[:PLACE], row[PLACE:TANGENTIAL]
            if contact.share < 1.0:  # else A is fixed
                p.applyExternalForce(*contact.key_a, force, place, p.WORLD_FRAME, self._client)
            if contact.share > 0.0:
                reaction = [-force[0], -force[1], -force[2]]
                p.applyExternalForce(*contact.key_b, reaction, place, p.WORLD_FRAME, self._client)
            contact.touching, contact.tangential_force = True, row[TANGENTIAL:]
        if clamped >= 0:
            self._losses.warn_of_clamp(motions.items())

    def _motion(self, key: tuple[int, int], motions: Motions) -> Motion:
        """The motion of a body, read once per call."""
        motion = motions.get(key)
        if motion is None:
            motion = motions[key] = read_motion(self._client, *key)
        return motion

    def _contact(self, handle: Any) -> Contact:
        if handle not in self._contacts:
            raise ValueError(f"handle = {handle!r}: must be one of {list(self._contacts)}")
        return self._contacts[handle]

    def _is_there(self, body: int) -> bool:
        """Whether the body still is the one a contact was added for."""
        return p.getUserDataId(body, self._mark, BASE, BASE, self._client) >= 0

    def _check_bodies(self, contacts: Iterable[Contact]) -> None:
        for contact in contacts:
            for side in contact.sides:
                if not self._is_there(side.body):
                    raise ValueError(
                        f"body {side.body}: removed, or no longer the one of the contact of {contact}; call "
                        "remove_contact before removing a body"
                    )

    def _adopt(self, new: set[int]) -> None:
        for body in new:
            p.addUserData(body, self._mark, "", physicsClientId=self._client)
            self._marked.add(body)
            self._losses.adopt(body)

    def _release(self, bodies: set[int]) -> None:
        for body in bodies:
            if self._is_there(body):
                p.removeUserData(p.getUserDataId(body, self._mark, BASE, BASE, self._client), self._client)
            self._marked.discard(body)
            self._losses.release(body)

    def _lay_out(self) -> None:
        """Put parameters and histories of all contacts into arrays that one jitted call can walk through."""
        contacts = list(self._contacts.values())
        self._parameters = np.concatenate([np.empty(0), *(contact.parameters for contact in contacts)])
        self._history = np.concatenate([np.empty(0), *(contact.history for contact in contacts)])
        self._scratch = np.empty_like(self._history)
        self._rows = np.zeros((len(contacts), ROW.size // 8))
        self._results = np.zeros((len(contacts), RESULTS))
        sizes = np.array([(contact.parameters.size, contact.history.size) for contact in contacts]).reshape(-1, 2)
        self._bounds = np.concatenate([np.zeros((1, 2), dtype=np.int64), np.cumsum(sizes, axis=0, dtype=np.int64)])
        for number, contact in enumerate(contacts):
            contact.number = number
            contact.history = self._history[self._bounds[number, 1] : self._bounds[number + 1, 1]]
