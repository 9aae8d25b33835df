"""Bodies, trees and contacts added to a world from Python; shapes: see `shapes.description`."""

from collections.abc import Iterable
from math import inf
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.jit import INTERPRETED
from contactlaw.pair import ContactPair
from contactlaw.world.arrays import empty, with_bodies, with_more_room, with_pair, with_shapes, with_tree
from contactlaw.world.data.frames import ORIGIN, UNTURNED, matrix_of, principal, product, unit_quaternion
from contactlaw.world.data.records import CLOSED, EDITED, PUT, Array, Arrays
from contactlaw.world.shapes.description import Shapes
from contactlaw.world.trees.description import Tree
from contactlaw.world.trees.tree_records import TreeRecords, coordinates, write_coordinates

SUBSTEPS = 100  # of an impact, by default; the error of psi_2 is then about 3e-4, and falls with their square
CROWD_SUBSTEPS = 10  # the same for a damped impact in an island of more than `crowd` closed contacts
LEAST_SUBSTEPS = 10
NEAR_PART = 8  # other shapes near a corner, an edge or a rim for which there is room, in the mean


class Building(Shapes):
    """The part of `World` that adds bodies, trees and contacts."""

    def __init__(
        self, *unnamed: Any, gravity: ArrayLike = (0.0, 0.0, -9.81), timestep: float = 1e-3, substeps: float = SUBSTEPS,
        crowd_substeps: float = CROWD_SUBSTEPS, crowd: int = 4, stillness: float = 1e-9,
    ) -> None:  # fmt: skip
        if unnamed:  # World(2e-3) would set gravity where a time step is meant
            given = ", ".join(map(repr, unnamed))
            raise TypeError(f"World({given}): name the arguments, as in World(gravity=9.81, timestep=2e-3)")
        if INTERPRETED:
            raise RuntimeError("a world is moved by compiled code alone, and NUMBA_DISABLE_JIT is set: unset it")
        super().__init__()
        pull = checks.finite_array("gravity", gravity)
        downward = np.array([0.0, 0.0, -1.0])
        if pull.ndim == 0 and pull < 0.0:
            raise ValueError(f"gravity = {gravity!r}: must be >= 0, as one number acts downward; or of shape (3,)")
        self._gravity = pull * downward if pull.ndim == 0 else checks.vector("gravity", pull).copy()
        self._gravity.flags.writeable = False
        self.timestep = timestep
        self._arrays = empty()
        state = self._arrays.world
        for name, count in (("substeps", substeps), ("crowd_substeps", crowd_substeps)):
            state[name] = checks.number(name, count, f"in [{LEAST_SUBSTEPS}, 1e6]", low=LEAST_SUBSTEPS, high=1e6)
        state["crowd"] = checks.count("crowd", crowd, 0)
        state["stillness"] = checks.number("stillness", stillness, "from 0 to 1e-2", low=0.0, high=1e-2)
        self._rules: list[int] = []  # of two sets of shapes: their pair of materials; -1: they do not touch
        self._pairs: list[ContactPair] = []
        self._new_bodies: list[dict[str, Any]] = []
        self._bound: Arrays | None = None  # those that the records have the addresses of

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuse what would change nothing: a reading, gravity that bodies have already, a misspelt name."""
        if name == "timestep":
            value = checks.positive(name, value)
        elif not name.startswith("_"):
            raise AttributeError(f"{name} = {value!r}: only timestep can be set; `place` sets the motion of a body")
        super().__setattr__(name, value)

    @property
    def gravity(self) -> Array:
        """Acceleration of gravity [m/s^2], shape (3,)."""
        return self._gravity

    @property
    def arrays(self) -> Arrays:
        """The arrays of the world, with all that has been added."""
        if self._new_bodies:
            self._arrays = with_bodies(self._arrays, self._new_bodies)
            self._new_bodies = []
        if self._new_shapes:
            self._arrays = with_shapes(self._arrays, self._new_shapes)
            self._new_shapes = []
            parts = sum(number != owner for number, owner in enumerate(self._owners))
            others = min(len(self._owners) - parts, NEAR_PART)
            while self._arrays.near.size < others * parts:
                self._arrays = with_more_room(self._arrays)
        if self._regroup:
            self._arrays = self._arrays._replace(groups=self._groups())
            self._regroup = False
        return self._arrays

    def _bound_arrays(self) -> Arrays:
        """Return `arrays` for compiled code, with their addresses and sizes in the records."""
        arrays = self.arrays
        if arrays is not self._bound:
            self._bound = arrays.bound()
        return arrays

    def add_body(
        self, mass: float, inertia: ArrayLike, position: ArrayLike = ORIGIN, velocity: ArrayLike = ORIGIN,
        quaternion: ArrayLike = UNTURNED, spin: ArrayLike = ORIGIN,
    ) -> int:  # fmt: skip
        """Add a body; returns its number.

        Args:
            mass: [kg]; inf: a kinematic body, which keeps its velocity in contacts and under gravity.
            inertia: About the centre of mass [kg m^2]: one number, three along the body's axes, or a matrix (3, 3).
            position: Of the centre of mass [m], shape (3,).
            velocity: [m/s], shape (3,).
            quaternion: Of the body's axes, scalar first, shape (4,).
            spin: Angular velocity, world frame [rad/s], shape (3,).
        """
        heavy = isinstance(mass, Real) and mass == inf
        moments, frame = (np.full(3, inf), UNTURNED) if heavy else principal(inertia)
        isotropic = len(set(moments.tolist())) == 1
        own = unit_quaternion("quaternion", quaternion)
        own = own if frame is UNTURNED else product(own, frame)
        given = {"position": position, "velocity": velocity, "spin": spin}
        self._new_bodies.append({
            name: checks.vector(name, value) for name, value in given.items() if value is not ORIGIN
        } | {
            "quaternion": own, "axes": matrix_of(own).ravel(),
            "inverse_mass": 0.0 if heavy else 1.0 / checks.positive("mass", mass), "inverse_inertia": 1.0 / moments,
            "isotropic": isotropic, "oriented": not isotropic, "acceleration": ORIGIN if heavy else self._gravity,
            "placed": 1,
        })  # fmt: skip
        self._frames.append(frame)
        return len(self._frames) - 1

    def add_tree(self, tree: Tree, q: ArrayLike | None = None, v: ArrayLike | None = None) -> tuple[int, list[int]]:
        """Add bodies joined by joints; returns the tree's number, and those of its bodies.

        Args:
            tree: Its bodies and joints.
            q, v: Its coordinates and velocities, see `Tree`; None: `Tree.start`, and zeros.
        """
        number, bodies = self.add_tree_of(checks.instance("tree", tree, Tree).rows)
        self.place_tree(number, tree.start if q is None else q, np.zeros(tree.v_size) if v is None else v)
        return number, bodies

    def add_tree_of(self, rows: TreeRecords) -> tuple[int, list[int]]:
        """Add a tree from its records, as adapters do; it has no pose until it is placed."""
        first, count = len(self._frames), rows.links.size
        self._new_bodies += rows.bodies()
        self._frames += [UNTURNED] * count
        arrays = self._arrays = with_tree(self.arrays, rows.fields() | {"first": first + 1, "gravity": self.gravity})
        rows.write(arrays, arrays.trees.size - 1)
        return arrays.trees.size - 1, list(range(first, first + count))

    def place_tree(self, tree: int, q: ArrayLike, v: ArrayLike) -> None:
        """Set a tree's coordinates [m, rad], shape (q_size,), and velocities, shape (v_size,)."""
        own, rates = checks.finite_array("q", q), checks.finite_array("v", v)
        write_coordinates(self._bound_arrays(), self._tree(tree), own, rates)
        self.arrays.world["stale"] = 1

    def tree(self, tree: int) -> tuple[Array, Array]:
        """Return the coordinates and velocities of a tree."""
        return coordinates(self.arrays, self._tree(tree))

    def place(
        self, body: int, position: ArrayLike | None = None, velocity: ArrayLike | None = None,
        quaternion: ArrayLike | None = None, spin: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """Set a body's pose or velocities; arguments as for `add_body`, None: unchanged. Wakes all that it touches."""
        b = self.arrays.bodies[self._body(body)]
        if b["tree"] != 0:
            raise ValueError(f"body = {body}: belongs to a tree of joints; use place_tree")
        if position is not None:
            b["position"] = checks.vector("position", position)
        if velocity is not None:
            b["velocity"] = checks.vector("velocity", velocity)
        if quaternion is not None:
            b["quaternion"] = product(unit_quaternion("quaternion", quaternion), self._frames[body])
            b["axes"] = matrix_of(b["quaternion"]).ravel()
        if spin is not None:
            b["spin"] = checks.vector("spin", spin)
        b["placed"] = PUT
        rows = self.arrays.contacts[self.arrays.contacts["phase"] == CLOSED]
        rows = rows[(rows["body_a"] == body + 1) | (rows["body_b"] == body + 1)]
        touched = np.concatenate([rows["body_a"], rows["body_b"], [body + 1]])
        bodies = self.arrays.bodies
        bodies["held"][touched - bodies["member"][touched]] = np.nan  # differs from any acceleration, so that all wake
        self.arrays.world["stale"] = 1

    def apply_force(self, body: int, force: ArrayLike = ORIGIN, torque: ArrayLike = ORIGIN) -> None:
        """Let a force at a body's centre of mass [N], and a torque [N m], act from now on, until the next call.

        They are constant in the world frame, shape (3,), besides gravity; what they do is not in `World.energy`.
        """
        b = self.arrays.bodies[self._body(body)]
        if b["tree"] != 0 or b["inverse_mass"] == 0.0:
            what = "belongs to a tree of joints" if b["tree"] != 0 else "is kinematic"
            raise ValueError(f"body = {body}: {what}; forces act on free bodies of finite mass")
        pushed = self.gravity + b["inverse_mass"] * checks.vector("force", force)
        b["acceleration"], b["torque"] = pushed, checks.vector("torque", torque)

    def add_contact(self, shapes1: int | Iterable[int], shapes2: int | Iterable[int], pair: ContactPair) -> None:
        """Let all shapes of one set touch those of another, or of the same set; a later rule overrides an earlier one.

        Args:
            shapes1, shapes2: Numbers of shapes. Shapes of one body never touch, nor do two planes.
            pair: Materials, friction, restitution and law; its radius, if given, holds for all contacts.
        """
        checks.instance("pair", pair, ContactPair)
        self._add_rule(shapes1, shapes2, self._arrays.pairs.size)
        self._pairs.append(pair)
        self._arrays = with_pair(self._arrays, pair.radius or 0.0, pair.parameters(radius=1.0), pair.memory_size)

    def add_rule(self, shapes1: int | Iterable[int], shapes2: int | Iterable[int], pair: int = -1) -> None:
        """Add a rule as `add_contact`, with the pair of an earlier `add_contact`, by number; -1: they do not touch."""
        self._add_rule(shapes1, shapes2, checks.count("pair", pair, -1, len(self._pairs) - 1))

    def _add_rule(self, shapes1: int | Iterable[int], shapes2: int | Iterable[int], pair: int) -> None:
        sets = [list(named) if np.iterable(named) else [named] for named in (shapes1, shapes2)]
        for name, numbers in zip(("shapes1", "shapes2"), sets, strict=True):
            if not numbers:
                raise ValueError(f"{name}: is empty; name at least one shape")
            for number in numbers:
                if checks.count(name, number, 0) >= len(self._memberships):
                    raise ValueError(f"{name} = {number}: there are {len(self._memberships)} shapes, counted from 0")
        if len(sets[0]) == 1 and sets[0] == sets[1]:
            raise ValueError(f"shapes1 = shapes2 = {sets[0][0]}: must be two different shapes")
        for side, numbers in enumerate(sets):
            for number in numbers:
                self._memberships[number] += (2 * len(self._rules) + side,)
        self._rules.append(pair)
        if pair >= 0:
            self._give_parts(*sets)
            self._give_parts(*sets[::-1])
        self._regroup = True

    def _tree(self, tree: int) -> int:
        if checks.count("tree", tree, 0) >= self.arrays.trees.size:
            raise ValueError(f"tree = {tree}: there are {self.arrays.trees.size} trees, counted from 0")
        return tree

    def _groups(self) -> Array:
        """Sort shapes into groups that are in the same sets; returns the table of the pairs that two groups make."""
        sets = [self._memberships[owner] for owner in self._owners]
        kinds = {kind: number for number, kind in enumerate(dict.fromkeys(sets))}
        self._arrays.shapes["group"] = [kinds[kind] for kind in sets]
        owners = np.array(self._owners, np.int64)
        order = np.argsort(owners, kind="stable")  # each owner, then its parts
        same = np.append(owners[order[1:]] == owners[order[:-1]], False)
        self._arrays.shapes["next"][order] = np.where(same, np.roll(order, -1), 0)
        table, sides = np.full((len(kinds), len(kinds)), -1), [[] for _ in range(2 * len(self._rules))]
        for kind, number in kinds.items():
            for side in kind:
                sides[side].append(number)
        for ones, twos, pair in zip(sides[::2], sides[1::2], self._rules, strict=True):
            table[np.ix_(ones, twos)] = pair
            table[np.ix_(twos, ones)] = pair
        one = self._arrays.world
        # a new shape may overlap what sleeps
        one["stale"], one["edited"] = 1, np.maximum(one["edited"], EDITED * (one["time"] > 0.0))
        return table
