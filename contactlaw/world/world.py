"""`World`: bodies, shapes and contacts from Python, without an engine."""

import warnings
from copy import deepcopy
from math import hypot
from typing import Any, Self

import numpy as np

from contactlaw import checks
from contactlaw.pair import DEEPEST, TOO_DEEP, ContactWarning
from contactlaw.world import readout
from contactlaw.world.arrays import kept, restored, with_more_room, with_own_code
from contactlaw.world.building import Building
from contactlaw.world.data.demand import PENDING_ERROR
from contactlaw.world.data.frames import product
from contactlaw.world.data.records import Array, Arrays
from contactlaw.world.step import step


class World(Building):
    """Rigid bodies in flight and in contact, with an elastic-frictional contact law.

    Each step moves the bodies, with substeps that resolve their contacts: results do not depend on the length of the
    step, which may be a thousand times that of an impact. Shapes are spheres, capsules, ellipsoids, boxes, cylinders,
    convex hulls, height fields and planes.

        from contactlaw import MATERIALS, ContactPair
        from contactlaw.world import World

        world = World(timestep=2e-3)
        floor = world.add_plane(None, point=(0, 0, 0), normal=(0, 0, 1))
        body = world.add_body(mass=0.5, inertia=2e-4, position=(0, 0, 0.3), spin=(0, 50, 0))
        ball = world.add_sphere(body, radius=0.02)
        steel = MATERIALS["steel"]
        world.add_contact(ball, floor, ContactPair(steel, steel, friction=0.1, restitution=0.9))
        world.step(500)
        print(world.position[body], world.energy.total)

    Its whole state is in `arrays`, plain arrays of records (`world.data.records`), which `save` copies.

    Args:
        gravity: [m/s^2], shape (3,), or one number: downward along z.
        timestep: [s] of `step`.
        substeps: Of an impact between few bodies; with 100, the default, psi_2 is right to 5e-4. A damped
            one of two bodies alone that slides slower than mu V has fewer, for the same error.
        crowd_substeps: Of a damped impact in an island of more than `crowd` closed contacts. With 10, the default,
            velocities after a billiard break are right to 1e-3 of that of the cue ball (20: 2e-4). An elastic
            impact has at least 60, a damped one with joints at least 20.
        crowd: Number of closed contacts up to which an island has `substeps`.
        stillness: Share of its load by which a contact may be out of balance, and of its energy that motion may have,
            when it falls asleep; 0: never.

    Raises:
        ValueError: A value outside its range; the message names it.
        RuntimeError: NUMBA_DISABLE_JIT is set; worlds need compiled code.
    """

    def step(self, n: int = 1) -> None:
        """Move the world by n steps of `timestep`; a `ContactWarning` tells once of overlaps too deep for Hertz.

        Crowds of balls cost less in one call than in n: steps shorter than an impact are made together, but for the
        last, with substeps no longer than a step. Both ways agree as closely as substeps are exact, not to the bit.

        Raises:
            RuntimeError: More shapes came near each other within one step than there was room for; or the motion is no
                longer finite, the message then names the body that was lost first.
        """
        left, before = checks.count("n", n, 0), self.arrays.world["deepest"][0]
        while left > 0:
            world = self._bound_arrays().world
            made = step(world, self.timestep, left)
            world["time"] += made * self.timestep
            left = left - made if world["lost_body"][0] == 0 else 0
            if not PENDING_ERROR and left > 0:  # or it raises
                self._arrays = with_more_room(self.arrays)
        if before <= DEEPEST < self.arrays.world["deepest"][0]:
            warnings.warn(TOO_DEEP.format(self.arrays.world["deepest"][0]), ContactWarning, stacklevel=2)
        if self.arrays.world["lost"][0] + self.arrays.world["left_out"][0] > 0:
            raise RuntimeError("a step lost contacts: too many shapes came near each other in it; shorten timestep")
        finite = np.isfinite(self.arrays.bodies["position"]).all(1)
        if not finite.all():
            b = self.arrays.bodies[lost := int(self.arrays.world["lost_body"][0])]
            speed = hypot(*b["velocity"]) + float(b["reach"]) * hypot(*b["spin"])
            how = f", at {speed:.2g} m/s" if lost and np.isfinite(speed) else ""
            raise RuntimeError(
                f"body {(lost or np.argmin(finite)) - 1}{how}: the motion is no longer finite: speeds or overlaps are "
                "beyond what numbers can hold"
            )

    @property
    def time(self) -> float:
        """Time since the start [s]: steps made, times their length; `restore` sets it back."""
        return float(self.arrays.world["time"][0])

    @property
    def position(self) -> Array:
        """Centres of mass [m], shape (bodies, 3); a reading, like all of these: `place` sets them."""
        return _reading(self.arrays.bodies["position"][1:].copy())

    @property
    def velocity(self) -> Array:
        """Velocities of the centres of mass [m/s], shape (bodies, 3)."""
        return _reading(self.arrays.bodies["velocity"][1:].copy())

    @property
    def spin(self) -> Array:
        """Angular velocities, world frame [rad/s], shape (bodies, 3)."""
        return _reading(self.arrays.bodies["spin"][1:].copy())

    @property
    def quaternion(self) -> Array:
        """Quaternions of the bodies' axes, scalar first, shape (bodies, 4)."""
        own = self.arrays.bodies["quaternion"][1:]
        turned = [product(q, f * [1, -1, -1, -1]) for q, f in zip(own, self._frames, strict=True)]
        return _reading(np.array(turned).reshape(-1, 4))

    @property
    def asleep(self) -> Array:
        """Whether each body sleeps: it is at rest until something disturbs it, shape (bodies,)."""
        return self.arrays.bodies["asleep"][1:] != 0

    @property
    def energy(self) -> readout.Energy:
        """Kinetic, potential and elastic energy [J]."""
        return readout.energy(self._bound_arrays(), self.gravity)

    @property
    def momentum(self) -> tuple[Array, Array]:
        """Linear [N s] and angular momentum about the origin [N m s], shape (3,) each."""
        return readout.momentum(self.arrays)

    @property
    def contacts(self) -> Array:
        """Contacts that are closed, or were in the last step: an array with named fields, a row each.

        shapes, bodies: numbers of A and B (body -1: the world); a box or a cylinder has several contacts with a flat
        shape. closed. overlap [m]. point [m], normal from B to A, force on A [N], moment on A about the point [N m] by
        torsion and rolling resistance, shape (3,). Since the touch: impulse on A [N s], normal_work and friction_work
        done on the bodies [J], deepest: greatest overlap [m], strongest: greatest normal force [N], duration [s],
        touches: how many.
        """
        rows = readout.contacts(self.arrays)
        rows["shapes"] = np.array(self._owners, np.int64)[rows["shapes"]]
        return rows

    def ledger(self, number: int) -> readout.Ledger:
        """Return impacts, time and losses so far of the contacts of one `add_contact`, counted from 0."""
        number = checks.count("number", number, 0, len(self._pairs) - 1)
        return readout.ledger(self.arrays.pairs, self.arrays.contacts, number)

    @property
    def owners(self) -> Array:
        """Of each shape its own number, or that of the box, cylinder or hull that it is a corner, edge or rim of."""
        return np.array(self._owners, np.int64)

    def save(self) -> Arrays:
        """Return a copy of the whole state; steps from it are the same to the bit. It may be pickled into a file."""
        return kept(self.arrays)

    def restore(self, saved: Arrays) -> None:
        """Set the world back to what `save` returned, of this world or of one built alike, in this process or another.

        Materials, friction and laws are those of this world.

        Raises:
            ValueError: Not what `save` returned, or bodies, shapes or contacts have been added since.
        """
        self._arrays = restored(checks.instance("saved", saved, Arrays), self.arrays)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Unpickle: the addresses of functions are those of this process."""
        self.__dict__.update(state)
        numbers = [pair.parameters(radius=1.0) for pair in self._pairs]
        self._arrays = with_own_code(self._arrays, np.concatenate([*numbers, np.zeros(0)]))

    def __copy__(self) -> Self:
        """Return a deep copy: worlds that share arrays would move each other's bodies."""
        return deepcopy(self)


def _reading(values: Array) -> Array:
    """Return a copy of the state that refuses assignment, which would change nothing in the world."""
    values.flags.writeable = False
    return values
