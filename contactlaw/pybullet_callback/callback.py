"""The contact law in PyBullet: a callback that the user's loop calls for every step."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from itertools import count, islice
from typing import Any
from weakref import WeakSet

import numpy as np
import pybullet as p

from contactlaw import checks
from contactlaw.jit import INTERPRETED
from contactlaw.pair import ContactPair, ContactWarning
from contactlaw.pybullet_callback.contact import Contact, ContactState, sets_of
from contactlaw.pybullet_callback.exchange import LISTED, NOTED
from contactlaw.pybullet_callback.marks import Marks
from contactlaw.pybullet_callback.scene import Saved, Scene
from contactlaw.pybullet_callback.shapes import engine_parameters, read_sides
from contactlaw.pybullet_callback.stepping import STEP_BULLET, stepped_by, stepping
from contactlaw.world.contacts.ledger import Ledger

LEAST_SUBSTEPS = 10
NEWS = LISTED | NOTED


class ContactCallback:
    """The contact law for chosen bodies of one physics client.

        contact.step()                                instead of stepSimulation, or
        contact(); pybullet.stepSimulation()          once each, or
        with contact.stepping(): ...                  where somebody else calls stepSimulation

    It reads where the bodies are and how they move, moves them through the step in a world of its own (`World`), which
    resolves their impacts however long the step is, and hands back to PyBullet those that were touched; all others it
    leaves to PyBullet. Bullet's own response is off for these pairs and only these. An error changes nothing there.

    `step` lets Bullet step first, so that it knows the accelerations that there were: forces that the user applied,
    damping, constraints and native contacts are in them. Position and velocity are right after it. `contact()` has to
    look ahead and knows of gravity alone; it gives its impulses as forces, so that the velocity is right after
    stepSimulation, while the position of a body that was in an impact lacks something until the next call: at most the
    step times what its velocity changed by.

    Bullet's velocity is that of half a step before its position, g dt/2 behind in free fall; with a closed contact it
    is the one that the body moves with now, zero for a body at rest, which stays where it is to the last bit.

    What must hold, and what cannot be known:
      * numSubSteps must be 0 or 1. The time step and gravity are read at every call, by `step` only where no body that
        falls shows them, nor while all sleep; they must not change between `contact()` and stepSimulation.
      * Radii come from spheres, capsules, planes and box faces. With `pair.radius` a sphere may touch any shape, and a
        capsule any if neither is a body of its own without joints; where PyBullet must measure, the tangent plane at
        the nearest point is what is touched in a step. Others, a box on a plane say, are refused: they touch in more
        than one point. Without `pair.radius` a ball on a box's edge is warned of.
      * Masses and inertias are read as bodies come near each other, and where one that is pressed does not move as it
        should; call `look` if they are changed in the step before an impact. Of bodies with joints the first alone.
      * Bullet's default damping and its clamp of velocities at 100 m/s and 100 rad/s eat energy. Set
        changeDynamics(body, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e6).
      * Removing a contact turns the native response of its pairs on, whatever collision groups say: what
        setCollisionFilterPair said before cannot be read.
      * Remove a contact before its bodies. A body that has gone, or another one that PyBullet has given its id, is an
        error at the next call if there are more or fewer bodies, or one is where it was not, or after resetSimulation.
        They carry a user data entry for this.
      * A body that is put deeper into another than a tenth of the radius, or than an impact at 5 m/s would
        press it, counts as just touching it: that depth is taken off the overlap as long as it lasts.

    Args:
        client: Physics client id.
        fixed_bodies_move: Whether bodies that nothing can push may be moved by the user, put elsewhere or given a
            velocity, at any time. False: they are read when a contact is added or removed and at `look`, which saves
            more than a microsecond a body and step.
    """

    def __init__(self, client: int = 0, *, fixed_bodies_move: bool = True) -> None:
        if isinstance(client, bool) or not isinstance(client, int | np.integer) or not p.isConnected(int(client)):
            raise ValueError(f"client = {client!r}: must be the id of a connected physics client")
        if INTERPRETED:
            raise RuntimeError("the callback needs compiled code, and NUMBA_DISABLE_JIT is set: unset it")
        self._client, self._moves = int(client), checks.truth("fixed_bodies_move", fixed_bodies_move)
        self._contacts: dict[int, Contact] = {}
        self._handles = count()
        self._marks = Marks(self._client)
        self._body_count = -1
        self._old: Scene | None = None
        self._made: Scene | None = None
        _ALL.add(self)

    def add_contact(
        self,
        body_a: int | Sequence[int] | Sequence[tuple[int, int]],
        body_b: int | Sequence[int] | Sequence[tuple[int, int]],
        pair: ContactPair,
        link_a: int = -1,
        link_b: int = -1,
        *,
        substeps: int = 100,
        rounding: float | None = None,
    ) -> int:
        """Let the law act between two bodies, or those of two sets, in place of the native response.

        Args:
            body_a, body_b: PyBullet's ids; or sequences of ids or of (body, link), every one of A then with every one
                of B, but none with itself and each two once. In sets, two bodies that cannot move are left out, and so
                are a link and its parent.
            pair: The contact; its radius, where None, comes from the shapes, for each two bodies theirs.
            link_a, link_b: Links of plain ids; -1: the base.
            substeps: Least number of steps that an impact is resolved by, >= 10; the error falls with its square. The
                most that any contact asks for hold for all.
            rounding: Radius of the edges of boxes and cylinders [m], and so of their contacts with what is flat, see
                docs/shapes.md; None: a tenth of the smallest half length of each.

        Returns:
            A handle for the other methods.

        Raises:
            ValueError: Unknown ids, the same body twice, two bodies added already, here or in another callback, shapes
                that touch in more than one point, no radius to be had, substeps.
        """
        if not isinstance(pair, ContactPair):
            raise ValueError(f"pair = {pair!r}: must be a contactlaw.ContactPair")
        a = read_sides(self._client, "a", body_a, link_a)
        b = read_sides(self._client, "b", body_b, link_b)
        radius = None if rounding is None else checks.positive("rounding", rounding)
        sides = {side.key: side for side in (*a, *b)}
        known = [(f"contact {handle}", one) for handle, one in self._contacts.items()]
        for other in _ALL - {self}:
            there = other._client == self._client and all(map(other._marks.is_there, other._marks.bodies))
            known += [("a contact of another ContactCallback", one) for one in other._contacts.values() if there]
        sets = sets_of(self._client, a, b, pair, known)
        contact = Contact(pair, checks.count("substeps", substeps, LEAST_SUBSTEPS), sides, sets, radius)
        engine_parameters(self._client)
        handle = next(self._handles)
        self._change(self._contacts | {handle: contact})
        contact.silence(self._client, () if contact.many else sets.every())
        self._marks.put(contact.bodies)
        return handle

    def remove_contact(self, handle: int) -> None:
        """Forget a contact and give its pairs the native response back; its bodies may be gone already."""
        contact = self._contact(handle)
        self._change({other: value for other, value in self._contacts.items() if other != handle})
        there = {body for body in contact.bodies if self._marks.is_there(body)}
        for one, two in contact.silent:
            if one[0] in there and two[0] in there:
                p.setCollisionFilterPair(one[0], two[0], one[1], two[1], 1, self._client)
        for body in contact.bodies.difference(*(other.bodies for other in self._contacts.values())):
            self._marks.take(body)

    def remove_all(self) -> None:
        """Remove every contact."""
        for handle in list(self._contacts):
            self.remove_contact(handle)

    def state(self, handle: int) -> ContactState:
        """The contact of two bodies at the end of the last step; of sets see `states`."""
        both, *more = islice(self._contact(handle).sets.every(), 2)
        if more:
            raise ValueError(f"handle = {handle!r}: a contact of sets; use states")
        return self._scene.states(handle, both)[0]

    def states(self, handle: int) -> list[ContactState]:
        """Those contacts of a handle that touched within the last step."""
        self._contact(handle)
        return self._scene.states(handle)

    def ledger(self, handle: int) -> Ledger:
        """What the contacts of a handle have done since it was added, or as `restore` brought it back."""
        self._contact(handle)
        return self._scene.ledger(handle)

    def save(self) -> Saved:
        """What is remembered of all contacts; with PyBullet's saveState, all that a restart needs, to the last bit.

        Call it where saveState is called, before a step or after it.
        """
        return self._scene.save()

    def restore(self, saved: Saved) -> None:
        """Bring back what `save` gave.

        Raises:
            ValueError: Contacts have been added or removed since.
        """
        self._scene.restore(saved)

    def look(self) -> None:
        """Read masses, inertias, joints, and bodies that are fixed, again."""
        self._change(self._contacts)

    def __call__(self) -> None:
        """Foresee the step that stepSimulation is about to take, and apply the forces of its contacts.

        Raises:
            ValueError: Bodies or their motion are not what the class asks for, or something moves and is where it was
                at the last call: Bullet has not stepped. Nothing has been done in PyBullet then.
        """
        if stepped_by(self._client) is self:
            raise ValueError("inside `stepping` each stepSimulation is a step of this callback: do not call it as well")
        scene = self._begin()
        if scene is not None:
            said = self._checked(scene.traffic.foresee)
            if said:
                self._look_over(scene, said)
            scene.traffic.push()

    def step(self) -> None:
        """Take a step of PyBullet and of the contacts; errors as for a call, but Bullet may have stepped then."""
        scene = self._begin()
        if scene is None:
            STEP_BULLET(self._client)
            return
        said = self._checked(scene.traffic.take_step)
        if said & NEWS:
            self._look_over(scene, said)

    def stepping(self) -> AbstractContextManager[None]:
        """Let each `pybullet.stepSimulation` of this client be `step`, for environments that step by themselves.

            with contact.stepping():
                env.step(action)

        It stands for whoever calls it: by the module, by a BulletClient, or by a name of its own in another module.
        Steps of other clients stay PyBullet's. After `resetSimulation` (most environments' `reset`) all bodies are new:
        call `remove_all` and add the contacts again.

        Raises:
            ValueError: Another callback has the steps of this client, on entering; what `step` raises, at the step.
        """
        return stepping(self, self._client)

    def _begin(self) -> Scene | None:
        """See that all bodies are there; None: there are no contacts."""
        if not self._contacts:
            return None
        if (count := p.getNumBodies(self._client)) != self._body_count or self._marks.first() != self._marks.text:
            self._marks.check()
            self._body_count = count
        return self._made or self._scene

    def _checked(self, take: Callable[[], int]) -> int:
        try:
            return take()
        except p.error:  # which does not say whose it is
            self._marks.check()
            raise

    @property
    def _scene(self) -> Scene:
        """The world of the contacts that there are."""
        if self._made is None:
            self._made = Scene(self._client, self._contacts, self._old, self._moves, self._marks.check)
            self._old = None
        return self._made

    def _change(self, contacts: dict[int, Contact]) -> None:
        self._old = self._made or self._old
        self._contacts, self._made, self._body_count = contacts, None, -1

    def _look_over(self, scene: Scene, said: int) -> None:
        """See to what a step says of its contacts: some that are near anew, or that there is something to say of."""
        if said & LISTED and scene.traffic.weigh_near():
            self.look()
        if said & NOTED:
            for slot, record in scene.contacts():
                for two, text in scene.notes(slot, record):
                    warnings.warn(f"{two}: {text}", ContactWarning, stacklevel=3)

    def _contact(self, handle: Any) -> Contact:
        if handle not in self._contacts:
            raise ValueError(f"handle = {handle!r}: must be one of {list(self._contacts)}")
        return self._contacts[handle]


_ALL: WeakSet[ContactCallback] = WeakSet()
"""Every callback that there is."""
