"""`ContactCallback`: the contact law in PyBullet, called by the user's loop in every step."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count, islice
from typing import Any
from weakref import WeakSet

import pybullet as p

from contactlaw import checks
from contactlaw.jit import INTERPRETED
from contactlaw.pair import ContactPair, ContactWarning
from contactlaw.pybullet_callback.contact import Contact, ContactState, Tags, sets_of
from contactlaw.pybullet_callback.rows import NOTED
from contactlaw.pybullet_callback.scene import Saved, Scene
from contactlaw.pybullet_callback.shapes import client_of, engine_parameters, identity, read_sides
from contactlaw.pybullet_callback.stepping import NEXT, STEP_BULLET, STEPPED, take
from contactlaw.pybullet_callback.trees import numbers_of
from contactlaw.world.building import CROWD_SUBSTEPS, LEAST_SUBSTEPS, SUBSTEPS
from contactlaw.world.readout import Ledger, ledger


class ContactCallback:
    """The contact law for chosen bodies of one physics client.

        contact.step()                                instead of stepSimulation, or
        contact(); pybullet.stepSimulation()          once each, or
        with contact.stepping(): ...                  where an environment calls stepSimulation

    All three take the same step: bodies are read, Bullet steps, which shows the accelerations by forces of the user,
    damping, constraints and native contacts, then a world of the callback's own (`World`), which resolves impacts
    however long the step is; bodies that contacts have touched are written back. Bullet's own response is disabled for
    these pairs and only these.

    docs/pybullet.md tells what position and velocity are after a step, and when masses are read; docs/limits.md what is
    not supported, docs/shapes.md which shapes touch how.

    Args:
        client: Physics client id.
        fixed_bodies_move: Whether bodies that nothing can push may be moved by the user, or given a velocity, at any
            time. False: they are read when a contact is added or removed and by `look`, which saves more than a
            microsecond a body and step.
        crowd_substeps: Least number of substeps of a damped impact where more than four contacts of an island are
            closed, >= 10.
    """

    def __init__(
        self, client: int = 0, *, fixed_bodies_move: bool = True, crowd_substeps: int = CROWD_SUBSTEPS
    ) -> None:
        if INTERPRETED:
            raise RuntimeError("the callback needs compiled code, and NUMBA_DISABLE_JIT is set: unset it")
        self._client, self._moves = client_of(client), checks.truth("fixed_bodies_move", fixed_bodies_move)
        self._crowd_substeps = checks.count("crowd_substeps", crowd_substeps, LEAST_SUBSTEPS)
        self._contacts: dict[int, Contact] = {}
        self._handles = count()
        self._tags = Tags(self._client)
        self._body_count, self._constraints = -1, list[int]()  # as last seen
        self._old: Scene | None = None
        self._made: Scene | None = None
        _ALL.add(self)

    def __getstate__(self) -> None:
        raise TypeError(
            "a ContactCallback belongs to its physics client, and cannot be copied or pickled: pickle what `save` "
            "returns, and add the contacts anew"
        )

    def add_contact(
        self, body_a: int | Sequence[int] | Sequence[tuple[int, int]],
        body_b: int | Sequence[int] | Sequence[tuple[int, int]], pair: ContactPair, link_a: int = -1, link_b: int = -1,
        *, substeps: int = SUBSTEPS, rounding: float | None = None, others: bool = True,
    ) -> int:  # fmt: skip
        """Let the law act between two bodies, or two sets of bodies, in place of the native response.

        Bullet no longer puts them to sleep, which the callback does itself; do not switch that on again.

        Args:
            body_a, body_b: PyBullet's ids; or sequences of ids or of (body, link): each of A then may touch each of B,
                but none itself, and each pair once. In sets, pairs of bodies that cannot move are left out, and so are
                a link and its parent.
            pair: The contact; its radius, where None, is that of the shapes of each pair.
            link_a, link_b: Links, where bodies are given as ids; -1: the base.
            substeps: Least number of substeps of an impact, >= 10; the error falls with its square. The largest number
                that any contact asks for holds for all.
            rounding: Radius [m] of the edges of boxes and cylinders, and so of their contacts with flat shapes, see
                docs/shapes.md; None: a tenth of the smallest half length of each.
            others: Whether these bodies may touch any other body by Bullet's own response. False removes them from its
                collision detection, at one call a body in place of a rule for each pair, for sets of a hundred and more
                (see docs/pybullet.md); they may still be added to further contacts of the law. When the contact is
                removed they get Bullet's own collision groups and masks.

        Returns:
            A handle for the other methods.

        Raises:
            ValueError: Unknown ids, the same body twice, a pair that this or another callback has already, shapes that
                the law does not serve or that PyBullet does not tell, joints without mass, no radius, substeps.
        """
        checks.instance("pair", pair, ContactPair)
        a = read_sides(self._client, "a", body_a, link_a)
        b = read_sides(self._client, "b", body_b, link_b)
        radius = None if rounding is None else checks.positive("rounding", rounding)
        sides = {side.key: side for side in (*a, *b)}
        sets, fixed = sets_of(self._client, a, b, pair, self._all_contacts())
        least, touch_others = checks.count("substeps", substeps, LEAST_SUBSTEPS), checks.truth("others", others)
        contact = Contact(pair, least, sides, sets, fixed, radius, touch_others)
        contact.ruled = {body for body in contact.bodies if touch_others or self._tags.has_rules(body)}
        engine_parameters(self._client)
        handle = next(self._handles)
        self._change(self._contacts | {handle: contact})
        self._tags.add(contact.bodies)
        contact.set_rules(self._client, False, contact.ruled)
        if not touch_others:
            contact.set_masks(self._client, False, sides)
        for body in contact.bodies:  # one that Bullet has put to sleep would stay where it is, whatever hits it
            awake = {"activationState": p.ACTIVATION_STATE_DISABLE_SLEEPING, "physicsClientId": self._client}
            p.changeDynamics(body, -1, **awake)
        return handle

    def remove_contact(self, handle: int) -> None:
        """Remove a contact and enable the native response of its pairs, whose settings before cannot be read.

        Its bodies may have been removed already.
        """
        client_of(self._client)  # before anything is changed
        contact = self._contact(handle)
        self._change({other: value for other, value in self._contacts.items() if other != handle})
        there = {body for body in contact.bodies if self._tags.is_there(body)}
        contact.set_rules(self._client, True, contact.ruled, there)
        self._tags.note_rules(contact.ruled & there)
        if not contact.others:
            alone = {key for _, one in self._all_contacts() if not one.others for key in one.sides}
            own = contact.sides.keys() - alone
            contact.set_masks(self._client, True, [key for key in own if key[0] in there])
        self._tags.remove(contact.bodies.difference(*(other.bodies for other in self._contacts.values())))

    def remove_all(self) -> None:
        """Remove every contact."""
        for handle in list(self._contacts):
            self.remove_contact(handle)

    def state(self, handle: int) -> ContactState:
        """Return the contact of two bodies at the end of the last step; for sets see `states`."""
        both, *more = islice(self._contact(handle).sets.every(), 2)
        if more:
            raise ValueError(f"handle = {handle!r}: a contact of sets; use states")
        return self._scene.states(handle, both)[0]

    def states(self, handle: int | None = None) -> list[ContactState]:
        """Return the contacts, of a handle or of all, that touched within the last step."""
        if handle is not None:
            self._contact(handle)
        return self._scene.states(handle)

    def ledger(self, handle: int) -> Ledger:
        """Return the ledger of a handle since it was added, or as `restore` set it."""
        self._contact(handle)
        arrays = self._scene.bodies.arrays
        return ledger(arrays.pairs, arrays.contacts, list(self._contacts).index(handle))

    def save(self) -> Saved:
        """Return the state of all contacts; together with PyBullet's saveState it is all that an exact restart needs.

        Call it where saveState is called, before a step or after it.
        """
        return self._scene.save()

    def restore(self, saved: Saved) -> None:
        """Set the state that `save` returned.

        Raises:
            ValueError: Contacts have been added or removed since, or bodies have got a mass or lost it.
        """
        self._scene.restore(saved)
        NEXT.pop(self._client, None)

    def look(self) -> None:
        """Read masses, inertias, joints, and poses of fixed bodies again.

        Raises:
            ValueError: A body has been removed.
        """
        self._tags.check()
        for contact in self._contacts.values():
            contact.find_fixed(self._client)
        self._change(self._contacts)

    def __call__(self) -> None:
        """Let the next `pybullet.stepSimulation` of this client be `step`, see `stepping`, and raise what that raises.

        Raises:
            ValueError: Called before already, without stepSimulation after it; or inside `stepping`.
        """
        take(NEXT, self._client, self)

    def step(self) -> None:
        """Step PyBullet and the contacts.

        Raises:
            ValueError: Bodies or their motion are not what the class requires. PyBullet is unchanged then, unless all
                bodies were far apart, or numbers are not finite after its step, or joints too fast.
        """
        if not self._contacts:
            STEP_BULLET(self._client)
            return
        if (count := p.getNumBodies(self._client)) != self._body_count or next(self._tags.entries)() != self._tags.text:
            self._tags.check()
            self._body_count = count
        scene = self._made or self._scene
        some = not scene.bodies.flies and (p.getNumConstraints(self._client) > 0 or self._constraints)
        if some and numbers_of(self._client) != self._constraints:
            self.look()
            scene = self._scene
        try:
            flags = scene.bodies.take_step()
        except p.error:  # its message does not name the body
            self._tags.check()
            raise
        if scene.bodies.outdated:
            self.look()
        if flags & NOTED:
            for text in scene.new_warnings():
                warnings.warn(text, ContactWarning, stacklevel=2)

    @contextmanager
    def stepping(self) -> Iterator[None]:
        """Let each `pybullet.stepSimulation` of this client be `step`, for environments that step PyBullet themselves.

            with contact.stepping():
                env.step(action)

        The function is replaced for all callers, by the module, by a BulletClient, or by a name imported into another
        module; it stays replaced, and passes on all other steps to PyBullet. After `resetSimulation` (`reset` of most
        environments) all bodies are new: call `remove_all` and add the contacts again.

        Raises:
            ValueError: On entering, if another callback takes the steps of this client; in a step, what `step` raises.
        """
        take(STEPPED, self._client, self)
        try:
            yield
        finally:
            del STEPPED[self._client]

    @property
    def _scene(self) -> Scene:
        """The scene of the present contacts, made on first use."""
        if self._made is None:
            self._made = Scene(
                self._client, self._contacts, self._old, self._moves, self._tags.check, self._crowd_substeps
            )
            self._old, self._constraints = None, numbers_of(self._client)
        return self._made

    def _change(self, contacts: dict[int, Contact]) -> None:
        self._old = self._made or self._old
        self._contacts, self._made = contacts, None
        NEXT.pop(self._client, None)

    def _all_contacts(self) -> Iterator[tuple[str, Contact]]:
        """Yield the contacts of this client, with names for messages; those of other callbacks if bodies are there."""
        yield from ((f"contact {handle}", one) for handle, one in self._contacts.items())
        for other in _ALL - {self}:
            if other._client == self._client and all(map(other._tags.is_there, other._tags.bodies)):
                yield from (("a contact of another ContactCallback", one) for one in other._contacts.values())

    def _contact(self, handle: Any) -> Contact:
        return self._contacts[identity("handle", handle, self._contacts, "the handles")]


_ALL: WeakSet[ContactCallback] = WeakSet()
"""All callbacks of the process."""
