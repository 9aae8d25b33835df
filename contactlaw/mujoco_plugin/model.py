"""A compiled model as a world: its bodies, their shapes, and which of these touch by the law."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.mujoco_plugin import jointed, layout, sensors
from contactlaw.mujoco_plugin.block import FREE, JOINTED, LED, PLACED, PUSH, SENSOR, STARTS, build
from contactlaw.mujoco_plugin.members import Member, check, instances, members, rules_of
from contactlaw.mujoco_plugin.notices import seen
from contactlaw.world import World
from contactlaw.world.arrays import with_room, with_rows
from contactlaw.world.data.demand import STEP, supply
from contactlaw.world.data.frames import matrix_of, product
from contactlaw.world.data.records import CORNER, DISC, EDGE, ELLIPSOID, END, HULL, SEGMENT, SIDE, SPHERE, Arrays
from contactlaw.world.state import size as state_size
from contactlaw.world.trees.tree_records import TreeRecords

Array = NDArray[np.float64]
UNIT = np.array([1.0, 0.0, 0.0, 0.0])
# For each round shape, by its kind: contacts that there is room for at once (balls of any sizes that do not overlap
# touch 7.5 times their number at most, Kuperberg & Schramm 1994), a hull's with those of its parts; and near pairs
NEIGHBOURS = {SPHERE: 8, END: 8, SEGMENT: 8, CORNER: 3, EDGE: 2, DISC: 4, SIDE: 4, ELLIPSOID: 8, HULL: 32}
LISTED, LISTED_PART = 40, 8
# Contacts of a geom that the state has room for: those that last from one step to the next. Equal balls touch three
# times their number in the densest heap
LASTING = {"sphere": 4, "ellipsoid": 4, "capsule": 4, "box": 8, "cylinder": 8, "mesh": 12}


class Pose(NamedTuple):
    """Where something is in a frame: its origin [m] and its quaternion."""

    place: Array
    turn: Array

    def then(self, other: Pose) -> Pose:
        """Of something in this frame, given in it."""
        if self is HERE or other is HERE:
            return self if other is HERE else other
        return Pose(self.place + matrix_of(self.turn) @ other.place, product(self.turn, other.turn))

    def inverse(self) -> Pose:
        """Of that frame in this."""
        if not self.place.any() and (self.turn == UNIT).all():
            return HERE
        turn = self.turn * [1.0, -1.0, -1.0, -1.0]
        return Pose(-matrix_of(turn) @ self.place, turn)


HERE = Pose(np.zeros(3), UNIT)


class Model:
    """The bodies and contacts of a compiled model."""

    def __init__(self, view: layout.ModelView) -> None:
        self._members = [Member(view, number) for number in members(view)]
        self._kinds = {geom: shape for member in self._members for geom, shape in member.shapes.items()}
        geoms = sorted(self._kinds)
        self._m = view
        self._carriers = {geom: self._carrier(int(self._m.geom_bodyid[geom])) for geom in geoms}
        self._world = World(gravity=0.0, substeps=max(member.contact.substeps for member in self._members))
        self._rows: dict[int, int] = {}  # of the world, counted without itself
        self._frames: dict[int, Pose] = {}  # of bodies that move: their frames, from the centre of mass
        self._trees: list[dict[str, Any]] = []
        self._frees: list[dict[str, Any]] = []
        self._placed: list[dict[str, Any]] = []
        self._add_bodies()
        given = [(member.contact.rounding, member.geoms) for member in self._members]
        self._roundings = {geom: radius for radius, geoms in given if radius is not None for geom in geoms}
        self._shapes = {geom: self._add_shape(geom) for geom in geoms}
        self._instances: list[int] = []  # of each pair of the world
        self._pairs: dict[tuple[int, float], int] = {}  # of each instance and coefficient of friction
        natives = [number for number, member in enumerate(self._members) if member.native]
        self._order = natives + [number for number in range(len(self._members)) if number not in natives]
        for number in self._order:
            self._touch(number, self._members[number].sets.ones, self._members[number].sets.twos)
        self._rooms = self._rooms_for()
        if natives:
            self._keep_rules(natives)

    @cached_property
    def arrays(self) -> Arrays:
        """Its world, with room for as many contacts as there may be."""
        contacts, near = self._rooms
        made = with_room(self._world.arrays, near, contacts)
        made.pairs["relaxed"] = [self._members[number].contact.overlaps == "relax" for number in self._instances]
        return made

    def _rooms_for(self) -> tuple[int, int]:
        """How many contacts, and near pairs, there is to be room for.

        While a model is compiled, when the size of its state is asked for, it has no explicit pairs and exclusions yet:
        the engine's rules are left out here.
        """
        made = self._world.arrays
        kinds, counts = np.unique(made.shapes[["kind", "group"]], return_counts=True)
        a, b = np.meshgrid(np.arange(kinds.size), np.arange(kinds.size), indexing="ij")
        meet = (made.groups[kinds["group"][a], kinds["group"][b]] >= 0) & (kinds["kind"][a] <= kinds["kind"][b])
        pairs = int((counts[a] * (counts[b] - (a == b)))[meet].sum())
        parts = made.shapes["kind"][self._world.owners] == HULL  # of hulls, which MuJoCo does not know when it asks
        parts &= made.shapes["kind"] != HULL
        rooms = [NEIGHBOURS[kind] for kind in made.shapes["kind"][~parts].tolist() if kind in NEIGHBOURS]
        contacts, near = sum(rooms), LISTED * len(rooms) + LISTED_PART * int(parts.sum())
        contacts = contacts if parts.any() else max(min(pairs, contacts), 1)
        return contacts, max(min(pairs, near), 1)

    def _touch(self, number: int, ones: Iterable[int], twos: Iterable[int]) -> None:
        """Let geoms of an instance touch; the first time, all of it."""
        member, known = self._members[number], self._pairs
        for mu, these, those in member.by_friction(ones, twos):
            shapes = self._shapes_of(these), self._shapes_of(those)
            if not all(shapes):
                continue
            if (number, mu) not in known:  # as many as there may be: the state is as long whatever they are now
                for own in [*member.pairs, *(member.contact.frictions - len(member.pairs)) * [mu]]:
                    known.setdefault((number, own), len(self._instances))
                    self._world.add_contact(*shapes, member.pairs[own])
                    self._instances.append(number)
                if not member.contact.frictions:
                    continue
            self._world.add_rule(*shapes, known[number, mu])

    def _shapes_of(self, geoms: Iterable[int]) -> list[int]:
        return [shape for geom in geoms for shape in self._shapes[geom]]

    def _keep_rules(self, natives: list[int]) -> None:
        """Take from instances that touch as they would natively what the engine does not let touch, or others have."""
        bits = {geom: own for number in natives for geom, own in self._members[number].native.items()}
        for rule in rules_of(self._m, bits):
            ones, twos = self._shapes_of(rule.ones), self._shapes_of(rule.twos)
            if not rule.allowed and ones and twos:
                self._world.add_rule(ones, twos)
            for number in natives if rule.allowed else ():
                if all(self._members[number].sets.hold(one, two) for one in rule.ones for two in rule.twos):
                    self._touch(number, rule.ones, rule.twos)
        for number in self._order[len(natives) :]:
            self._touch(number, self._members[number].sets.ones, self._members[number].sets.twos)

    @property
    def state_size(self) -> int:
        """Numbers in plugin_state."""
        return self._row + self._world_size

    @property
    def _row(self) -> int:
        """Where the state of the world begins in it."""
        return PUSH + 2 * self._m.nv + LED * len(self._placed)

    @property
    def _world_size(self) -> int:
        a = self.arrays
        room = min(a.contacts.size, sum(LASTING.get(shape.type, 0) for shape in self._kinds.values()))
        return state_size(max(room, 1), a.memory.shape[1], a.bodies.size, a.pairs.size)

    def check(self) -> None:
        """See that the law can serve it; its pairs are there only once it is compiled as a whole.

        Raises:
            ValueError: It cannot; the message names the geoms.
        """
        carriers = {geom: carrier for geom, (carrier, _) in self._carriers.items()}
        dofs = self._m.body_dofnum
        check(self._m, self._members, lambda geom: dofs[carriers[geom]] > 0)
        if self._m.npluginstate < self.state_size:
            raise ValueError("plugin_state: is shorter than the law needs; the model must be compiled by spec.compile")

    def block(self, report: int) -> int:
        """Address of a new block of the leading instance; report: as `block` has it."""
        m, nq, nv = self._m, self._m.nq, self._m.nv
        own = {member.number: number for number, member in enumerate(self._members)}
        senses, listed = sensors.rows_of(m, dict.fromkeys(instances(m), -1) | own)
        watch, values = self._seen()
        shapes = {shape: geom for geom, shapes in self._shapes.items() for shape in shapes}
        geoms = [shapes[owner] for owner in self._world.owners.tolist()]
        supply(STEP)
        return build(self.arrays, {
            "leads": 1, "own_size": self.state_size, "report": report, "body_count": m.nbody,
            "state": m.plugin_stateadr[self._members[0].number], "row": self._row, "nq": nq, "nv": nv,
            "signature": m.signature, "made": layout.number_of(m.plugin_attr.tobytes() + values.tobytes()),
            "starts": np.zeros(STARTS * (1 + nq + nv)), "left": np.zeros(1 + nq + 2 * nv), "given": np.zeros(nv),
            "frees": with_rows(np.zeros(0, FREE), self._frees), "free_count": len(self._frees),
            "placed": with_rows(np.zeros(0, PLACED), self._placed), "placed_count": len(self._placed),
            "trees": with_rows(np.zeros(0, JOINTED), self._trees), "tree_count": len(self._trees),
            "geoms": np.array(geoms, np.int64), "instances": np.array(self._instances, np.int64),
            "said": np.zeros(len(self._members), np.int64), "frictions": np.full(len(self._instances), np.nan),
            "watch": watch, "watch_count": len(watch), "seen": values, "sense": sensors.address() if senses else 0,
            "sensors": with_rows(np.zeros(0, SENSOR), listed), "sensor_count": len(listed),
            "centres": np.array([self._pose_of(geom).inverse().place for geom in geoms]),
            "loads": np.zeros(12 * m.nbody + 2 * nv + 6),
        } | (jointed.addresses() if self._trees else {}))  # fmt: skip

    def _seen(self) -> tuple[NDArray[np.int64], Array]:
        """What the world is made of: trees, and all that geoms hang on."""
        parent, roots = self._m.body_parentid.tolist(), self._roots
        bodies = {int(self._m.geom_bodyid[geom]) for geom in self._kinds}
        bodies |= set(np.flatnonzero(np.isin(roots, [roots[body] for body in bodies if roots[body]])).tolist())
        for body in tuple(bodies):
            while body:
                bodies.add(body)
                body = parent[body]
        return seen(self._m, sorted(bodies), sorted(self._kinds))

    def _carrier(self, body: int) -> tuple[int, Pose]:
        """The body that moves, is placed, or stands for good, and carries this one; where this one is in its frame."""
        m, pose = self._m, HERE
        while body and m.body_dofnum[body] == 0 and m.body_mocapid[body] < 0:
            pose = Pose(m.body_pos[body], m.body_quat[body]).then(pose)
            body = int(m.body_parentid[body])
        return body, pose

    def _add_bodies(self) -> None:
        """Rows of the world: free bodies first, then those that joints hold, then those that the user places."""
        m, root = self._m, self._roots
        carriers = sorted({body for body, _ in self._carriers.values()})
        free = self._free
        for body in (body for body in carriers if free[body]):
            pose = Pose(m.body_ipos[body].copy(), m.body_iquat[body].copy())
            row = self._world.add_body(float(m.body_mass[body]), m.body_inertia[body])
            self._rows[body], self._frames[body] = row, pose.inverse()
            self._frees.append({
                "body": row + 1, "id": body, "q": m.jnt_qposadr[m.body_jntadr[body]], "v": m.body_dofadr[body],
                "offset": pose.place, "frame": pose.turn,
            })  # fmt: skip
        for first in dict.fromkeys(int(root[body]) for body in carriers if m.body_dofnum[body] and not free[body]):
            bodies = np.flatnonzero(root == first).tolist()  # welded ones among them
            rows = TreeRecords(m, bodies)
            tree, made = self._world.add_tree_of(rows)
            for body, row, at, turn in zip(bodies, rows.row, rows.at, rows.quaternion, strict=True):
                self._rows[body], self._frames[body] = made[row], Pose(at, turn)
            base = int(m.body_parentid[first])
            self._trees.append({"tree": tree, "q": rows.q_of[0], "v": rows.v_of[0], "base": base})
        bases = {self._carrier(tree["base"])[0] for tree in self._trees}
        for body in sorted({*carriers, *(base for base in bases if m.body_mocapid[base] >= 0)}):
            if m.body_mocapid[body] >= 0:
                self._rows[body] = self._world.add_body(np.inf, 1.0)
                self._placed.append({"body": self._rows[body] + 1, "id": body})
            elif not body:
                self._rows[0] = self._world.add_body(np.inf, 1.0)
        for tree in self._trees:
            base, _ = self._carrier(tree["base"])
            self._world.arrays.trees["hangs_on"][tree["tree"]] = self._rows.get(base, -1) + 1

    @cached_property
    def _roots(self) -> NDArray[np.int64]:
        """The first body of the kinematic tree that each body is of; zero: of none."""
        parent, dofs = self._m.body_parentid.tolist(), self._m.body_dofnum.tolist()
        roots = [0] * len(parent)
        for body in range(1, len(parent)):
            roots[body] = roots[parent[body]] or (body if dofs[body] else 0)
        return np.array(roots)

    @cached_property
    def _free(self) -> NDArray[np.bool_]:
        """Which bodies a free joint alone moves, and nothing that moves or weighs hangs on."""
        m, parent = self._m, self._m.body_parentid.tolist()
        counts = ((m.body_mass > 0.0) | (m.body_dofnum > 0)).tolist()
        laden = [False] * len(parent)
        for body in range(len(parent) - 1, 0, -1):
            laden[parent[body]] |= laden[body] or counts[body]
        jointed = m.body_jntnum > 0
        free = jointed & (m.body_mass > 0.0) & ~np.array(laden)
        free[jointed] &= m.jnt_type[m.body_jntadr[jointed]] == int(mujoco.mjtJoint.mjJNT_FREE)
        dofs = m.body_dofadr[free][:, None] + np.arange(6)
        free[free] = ~((m.dof_armature[dofs] != 0.0) | (m.dof_damping[dofs] != 0.0)).any(1)
        held = np.isin(m.eq_type, (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)))
        for ids in (m.eq_obj1id[held], m.eq_obj2id[held]):
            at_site = m.eq_objtype[held] == int(mujoco.mjtObj.mjOBJ_SITE)
            free[self._roots[ids[~at_site]]] = free[self._roots[m.site_bodyid[ids[at_site]]]] = False
        return free

    def _pose_of(self, geom: int) -> Pose:
        """Where a geom is, from the centre of mass of what carries it, along its principal axes."""
        carrier, pose = self._carriers[geom]
        return self._frames.get(carrier, HERE).then(pose.then(Pose(self._m.geom_pos[geom], self._m.geom_quat[geom])))

    def _add_shape(self, geom: int) -> list[int]:
        """Give a geom to its body in the world; returns the shapes that it makes."""
        row, shape, pose = self._rows[self._carriers[geom][0]], self._kinds[geom], self._pose_of(geom)
        kind = "sphere" if shape.is_spherical else shape.type
        size, points = self._heights(geom) if kind == "hfield" else (shape.size, None)
        points = self._vertices(geom) if kind == "mesh" else points
        return self._world.add_shape(kind, row, size, *pose, self._roundings.get(geom), points)

    def _heights(self, geom: int) -> tuple[Array, Array]:
        """Half lengths of a height field along x and y [m], and its heights [m], shape (rows, columns).

        While the model is compiled there are none yet, and something stands for them.
        """
        m, field = self._m, int(self._m.geom_dataid[geom])
        first, shape = int(m.hfield_adr[field]), (int(m.hfield_nrow[field]), int(m.hfield_ncol[field]))
        if shape[0] == 0:
            return np.ones(2), np.zeros((2, 2))
        own = m.hfield_data[first : first + shape[0] * shape[1]].reshape(shape)
        return m.hfield_size[field, :2], m.hfield_size[field, 2] * own.astype(np.float64)

    def _vertices(self, geom: int) -> Array:
        """Of a mesh [m], shape (n, 3), in the geom's frame: those of its hull where MuJoCo has found it.

        While the model is compiled there are none yet, and those of something stand for them.
        """
        view = self._m
        mesh = int(view.geom_dataid[geom])
        first, count, graph = (int(getattr(view, f"mesh_{name}")[mesh]) for name in ("vertadr", "vertnum", "graphadr"))
        if count == 0:
            return np.eye(4, 3)
        own = view.mesh_vert[first : first + count]
        if graph >= 0:
            numbers = view.mesh_graph[graph:]
            own = own[numbers[2 + numbers[0] : 2 + 2 * numbers[0]]]
        return own.astype(np.float64)
