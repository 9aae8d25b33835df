"""Reading a compiled model into a world: its bodies, their shapes, and which pairs touch by the law.

This is done when a model is compiled (for the size of the state) and for each `MjData` made. What changes from step to
step is read by `free` and `trees`.
"""

from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import layout, sensors, trees
from contactlaw.mujoco_plugin.block import FREE, JOINTED, MOCAP, MOVED, PUSH, SENSOR, SPRING, STARTS, build
from contactlaw.mujoco_plugin.geoms import check_served, shape_in
from contactlaw.mujoco_plugin.instances import ContactInstance, check, contact_instances, contact_of_kinds, instances
from contactlaw.mujoco_plugin.notices import reported_of, watched_ranges
from contactlaw.world import World
from contactlaw.world.arrays import with_room, with_rows
from contactlaw.world.data.demand import STEP, supply
from contactlaw.world.data.frames import IDENTITY, UNTURNED, Pose
from contactlaw.world.data.kinds import EDGE
from contactlaw.world.data.records import Array, Arrays
from contactlaw.world.data.tree import FREE_JOINT
from contactlaw.world.near.sets import systems_of
from contactlaw.world.state import size as state_size
from contactlaw.world.trees.tree_records import TreeRecords

# Contacts that plugin_state has room for, for each geom: those that last from one step to the next. Equal balls have
# about three contacts a ball in the densest heap
LASTING = {"sphere": 4, "ellipsoid": 4, "capsule": 4, "box": 8, "cylinder": 8, "mesh": 12}
_EQ, _TRN, _WRAP = mujoco.mjtEq, mujoco.mjtTrn, mujoco.mjtWrap
EQUALITIES = {_EQ.mjEQ_JOINT: "joint", _EQ.mjEQ_TENDON: "tendon", _EQ.mjEQ_CONNECT: "body", _EQ.mjEQ_WELD: "body"}
TRANSMISSIONS = {_TRN.mjTRN_JOINT: "joint", _TRN.mjTRN_JOINTINPARENT: "joint", _TRN.mjTRN_TENDON: "tendon"}
SITE, JOINTS = int(_TRN.mjTRN_SITE), [int(kind) for kind, what in TRANSMISSIONS.items() if what == "joint"]
TRANSMISSIONS |= {_TRN.mjTRN_SITE: "site", getattr(_TRN, "mjTRN_SO3", None): "joint"}  # with two objects both are sites
SO3 = int(getattr(mujoco.mjtBias, "mjBIAS_SO3", -1))  # from MuJoCo 3.15
WRAPS = {_WRAP.mjWRAP_JOINT: "joint", _WRAP.mjWRAP_SITE: "site"}
WRAPS |= dict.fromkeys((_WRAP.mjWRAP_SPHERE, _WRAP.mjWRAP_CYLINDER), "geom")
"""What equality constraints, actuators and tendons act on, by MuJoCo's numbers."""
GAS = 10.0, 1e-4  # greatest density [kg/m^3] and viscosity [Pa s] of what drags no free body within a step
LASTING_ON_BOXES = 24  # of a box on another: four corners of each, and at each corner four pairs of edges that cross


def check_inertias(view: layout.ModelView) -> None:
    """Check masses and moments of inertia of what moves, as they may have been edited since the model was compiled."""
    for name in ("body_mass", "body_inertia"):
        values = getattr(view, name)
        wrong = ~(np.isfinite(values) & (values >= 0.0)).reshape(len(values), -1).all(1)
        for body in np.flatnonzero(wrong & (view.body_treeid >= 0)).tolist():
            where = f"{name} = {values[body].tolist()} of body {view.label('body', body)}"
            raise ValueError(f"{where}: must be finite and not negative")


class Model:
    """The bodies and contacts of a compiled model."""

    def __init__(self, view: layout.ModelView) -> None:
        self._contacts = [ContactInstance(view, number) for number in contact_instances(view)]
        geoms = sorted({geom for instance in self._contacts for geom in instance.geoms})
        self._geom_shapes = {geom: shape_in(view, geom) for geom in geoms}
        self._m = view
        # of each geom: the body that carries it, and the pose of the geom's own body in that one's frame
        self._carriers = {geom: self._carrier(int(self._m.geom_bodyid[geom])) for geom in geoms}
        substeps = max(instance.contact.substeps for instance in self._contacts)
        crowd_substeps = max(instance.contact.crowd_substeps for instance in self._contacts)
        self._world = World(gravity=0.0, substeps=substeps, crowd_substeps=crowd_substeps)
        self._rows: dict[int, int] = {}  # of each body its number in the world, without the world's own row
        self._frames: dict[int, Pose] = {}  # of moving bodies: MuJoCo's body frame in the principal axes
        self._trees: list[dict[str, Any]] = []
        self._place_of_v = np.full((2, view.nv), -1)  # of each velocity its place in its tree, and the tree's number
        self._spring_rows: list[dict[str, Any]] = []
        self._places: list[Array] = []  # of the coordinates and the velocities of each tree
        self._frees: list[dict[str, Any]] = []
        self._mocaps: list[dict[str, Any]] = []
        self._add_bodies()
        # of each geom its pose in the principal axes of the body that carries it
        own = {geom: Pose(view.geom_pos[geom], view.geom_quat[geom]) for geom in geoms}
        on = self._carriers.items()
        self._poses = {geom: self._frames.get(body, IDENTITY).then(pose.then(own[geom])) for geom, (body, pose) in on}
        given = [one for one in self._contacts if one.contact.rounding is not None]
        self._roundings = {geom: one.contact.rounding for one in given for geom in one.geoms}
        self._shapes = {geom: self._add_shape(geom) for geom in geoms}
        for instance in self._contacts:
            if not instance.native:
                check_served(instance.sets, self._geom_shapes)
            ones, twos = ([shape for geom in side for shape in self._shapes[geom]] for side in instance.sides)
            self._world.add_contact(ones, twos, instance.contact.pair)

    @cached_property
    def arrays(self) -> Arrays:
        """The world's arrays, with room for contacts and near pairs."""
        made, geoms = with_room(self._world.arrays, self._world.owners), self._geom_of_shape
        kind, table = contact_of_kinds(self._m, self._contacts)
        made.shapes["group"] = [kind[geom] for geom in geoms]
        made.shapes["friction"], made.shapes["priority"] = self._m.geom_friction[geoms, 0], self._m.geom_priority[geoms]
        made.shapes["frictionless"] = self._m.geom_condim[geoms] == 1
        made.bodies["placed"] = 0  # each step tells this of what can move; all else stays where it is
        made.pairs["relaxed"] = [instance.contact.overlaps == "relax" for instance in self._contacts]
        made.pairs["friction"][[instance.contact.geom_friction for instance in self._contacts]] = np.nan
        return made._replace(groups=table)

    @cached_property
    def _geom_of_shape(self) -> list[int]:
        geom_of = {shape: geom for geom, shapes in self._shapes.items() for shape in shapes}
        return [geom_of[owner] for owner in self._world.owners.tolist()]

    @property
    def state_size(self) -> int:
        """Length of the law's part of plugin_state, in doubles."""
        a = self.arrays
        edged = set(self._world.owners[a.shapes["kind"] == EDGE].tolist())  # they may meet others that have edges
        rooms = {geom: LASTING.get(shape.type, 0) for geom, shape in self._geom_shapes.items()}
        boxes = [geom for geom, shape in self._geom_shapes.items() if shape.type == "box"]
        rooms |= {geom: LASTING_ON_BOXES for geom in boxes if not edged.isdisjoint(self._shapes[geom])}
        room = min(a.contacts.size, sum(rooms.values()))
        # which trees equalities join is not known yet while the model is compiled, nor which bodies are in the world
        bodies = max(a.bodies.size, self._m.nbody + 1) if self._m.eq_type.size else a.bodies.size
        return self._row + state_size(max(room, 1), a.memory.shape[1], bodies, a.pairs.size)

    @property
    def _row(self) -> int:
        """Where the state of the world begins in it."""
        # when the state is sized, while the model is compiled, the stiffnesses of tendons are not known yet
        pulled = self._m.nv if self._m.ntendon else 0
        return PUSH + 2 * self._m.nv + MOVED.itemsize // 8 * len(self._mocaps) + pulled

    def block(self, report: int) -> int:
        """Make a block for the leading instance and return its address; report: address of the function for reports.

        Raises:
            ValueError: The law cannot serve the model; the pairs are known only once it is compiled as a whole.
        """
        check(self._m, self._contacts, lambda geom: self._m.body_dofnum[self._carriers[geom][0]] > 0)
        if self._m.plugin_statenum[self._contacts[0].number] < self.state_size:
            raise ValueError("plugin_state: is shorter than the law needs; the model must be compiled by spec.compile")
        m, nq, nv, a = self._m, self._m.nq, self._m.nv, self.arrays
        sizes = m.signature, a.memory.shape[1], a.bodies.size, a.pairs.size  # which tell how a state is laid out
        own = {instance.number: number for number, instance in enumerate(self._contacts)}
        leader = self._contacts[0].number
        senses, listed = sensors.rows_of(m, dict.fromkeys(instances(m), -1) | own)
        geoms = self._geom_of_shape
        carrying = set(m.geom_bodyid[geoms].tolist()) | set(self._rows)
        bodies = {above for body in carrying for above in m.chain(body)}
        watch, values = watched_ranges(m, sorted(bodies), sorted(self._geom_shapes))
        supply(STEP)
        return build(a, {
            "report": report, "body_count": m.nbody, "nq": nq, "nv": nv,
            "state": m.plugin_stateadr[leader], "size": m.plugin_statenum[leader], "row": self._row,
            "signature": layout.hash_of(repr(sizes).encode()),
            "content": layout.hash_of(m.plugin_attr.tobytes() + values.tobytes()),
            "recent": np.zeros(STARTS * (1 + nq + nv)), "left": np.full(1 + nq + 2 * nv, np.nan), "given": np.zeros(nv),
            "frees": with_rows(np.zeros(0, FREE), self._frees), "free_count": len(self._frees),
            "mocaps": with_rows(np.zeros(0, MOCAP), self._mocaps), "mocap_count": len(self._mocaps),
            "trees": with_rows(np.zeros(0, JOINTED), self._trees), "tree_count": len(self._trees),
            "springs": with_rows(np.zeros(0, SPRING), self._spring_rows),
            "places": np.concatenate([*self._place_of_v, *self._places]),
            "geoms": np.array(geoms, np.int64), "reported": reported_of(m, len(self._contacts)).ctypes.data,
            "ranges": watch, "range_count": len(watch), "watched": values,
            "sense": sensors.address() if senses else 0,
            "sensors": with_rows(np.zeros(0, SENSOR), listed), "sensor_count": len(listed),
            "centres": np.array([self._poses[geom].inverse().place for geom in geoms]),
            "loads": np.zeros(12 * m.nbody + 2 * nv + 6),
        } | (trees.addresses() if self._trees else {}))  # fmt: skip

    def _carrier(self, body: int) -> tuple[int, Pose]:
        """Return the nearest ancestor of a body (or itself) that moves, is mocap or the world; and the pose in it."""
        m, pose = self._m, IDENTITY
        while body and m.body_dofnum[body] == 0 and m.body_mocapid[body] < 0:
            pose = Pose(m.body_pos[body], m.body_quat[body]).then(pose)
            body = int(m.body_parentid[body])
        return body, pose

    def _add_bodies(self) -> None:
        """Add bodies to the world: first free bodies, then kinematic trees, then mocap bodies and the world's own."""
        m, root = self._m, self._roots
        carriers = sorted({body for body, _ in self._carriers.values()})
        free, parts = self._free, np.bincount(m.body_treeid + 1)[m.body_treeid + 1]
        alike = ~m.body_ipos.any(1) & (m.body_iquat == UNTURNED).all(1)
        for body in (body for body in carriers if free[body]):
            pose = IDENTITY if alike[body] else Pose(m.body_ipos[body].copy(), m.body_iquat[body].copy())
            try:
                row = self._world.add_body(float(m.body_mass[body]), m.body_inertia[body])
            except ValueError as error:
                raise ValueError(f"body {m.label('body', body)}: {error}") from error
            self._rows[body], self._frames[body] = row, pose.inverse()
            self._frees.append({
                "body": row + 1, "id": body, "parts": parts[body], "q": m.jnt_qposadr[m.body_jntadr[body]],
                "v": m.body_dofadr[body], "offset": pose.place, "frame": pose.turn,
            })  # fmt: skip
        firsts = dict.fromkeys(int(root[body]) for body in carriers if m.body_dofnum[body] and not free[body])
        for first in dict.fromkeys(self._systems[first][0] for first in firsts):
            system = self._systems[first]
            bodies = np.flatnonzero(np.isin(root, system)).tolist()  # including welded ones
            bases = {one: self._carrier(int(m.body_parentid[one])) for one in system}
            led = any(m.body_mocapid[carrier] >= 0 for carrier, _ in bases.values())
            poses = {} if led else {one: pose for one, (_, pose) in bases.items()}
            springs = {spring: v for spring, v in self._springs.items() if root[m.dof_bodyid[v[0]]] in system}
            rows = TreeRecords(m, bodies, poses)
            rows.couple([*self._held, *springs.values()])
            tree, made = self._world.add_tree_of(rows)
            for body, row, at, turn in zip(bodies, rows.row, rows.at, rows.quaternion, strict=True):
                self._rows[body], self._frames[body] = made[row], Pose(at, turn)
            self._place_of_v[0, rows.v_of], self._place_of_v[1, rows.v_of] = np.arange(rows.v_of.size), tree
            at = 2 * m.nv + sum(map(len, self._places))
            base = int(m.body_parentid[first]) if led else 0
            self._trees.append({
                "tree": tree, "q": at, "v": at + rows.q_of.size, "base": base,
                "first_spring": len(self._spring_rows), "spring_count": len(springs),
            })  # fmt: skip
            self._spring_rows += [dict(zip(SPRING.names or (), spring, strict=True)) for spring in springs]
            self._places += [rows.q_of, rows.v_of]
        bases = {self._carrier(tree["base"])[0] for tree in self._trees}
        for body in sorted({*carriers, *(base for base in bases if m.body_mocapid[base] >= 0)}):
            if not body or m.body_mocapid[body] >= 0:
                self._rows[body] = self._world.add_body(np.inf, 1.0)
            if m.body_mocapid[body] >= 0:
                self._mocaps.append({"body": self._rows[body] + 1, "id": body})
        for tree in self._trees:
            base, _ = self._carrier(tree["base"])
            self._world.arrays.trees["hangs_on"][tree["tree"]] = self._rows.get(base, -1) + 1

    @cached_property
    def _roots(self) -> Array:
        """First body of the kinematic tree of each body; zero if it is in none."""
        first = dict[int, int]()
        trees = enumerate(self._m.body_treeid.tolist())
        return np.array([first.setdefault(tree, body) if tree >= 0 else 0 for body, tree in trees])

    @cached_property
    def _free(self) -> Array:
        """Which bodies move by a free joint alone.

        A free body has mass, no armature or damping, no child with mass or joints, and no equality constraint, tendon,
        or actuator whose force follows its motion: forces on it are constant within a step.
        """
        m, tree = self._m, self._m.body_treeid
        massive = np.bincount(tree[(m.body_mass > 0.0) & (tree >= 0)], minlength=m.ntree)
        alone = (massive == 1) & (np.bincount(m.dof_treeid, minlength=m.ntree) == 6)
        free = (m.body_mass > 0.0) & (m.body_jntnum > 0)
        if m.opt["density"] > GAS[0] or m.opt["viscosity"] > GAS[1]:  # drag is felt within a step
            free[:] = False
        free[free] = alone[tree[free]] & (m.jnt_type[m.body_jntadr[free]] == FREE_JOINT)
        dofs = m.body_dofadr[free][:, None] + np.arange(6)
        free[free] = ~((m.dof_armature[dofs] != 0.0) | (m.dof_damping[dofs] != 0.0)).any(1)
        pulled = [self._velocities("tendon", one) for one in range(m.ntendon)]
        pulled += map(self._driven, np.flatnonzero(m.actuator_gaintype | m.actuator_biastype).tolist())  # 0: of a motor
        for held in [*self._held, *map(sorted, pulled)]:
            free[self._roots[m.dof_bodyid[held]]] = False
        return free

    @cached_property
    def _held(self) -> list[list[int]]:
        """The velocities of each equality constraint of bodies, joints or tendons."""
        m, out = self._m, list[list[int]]()
        for kind, objects, *ids in np.array([m.eq_type, m.eq_objtype, m.eq_obj1id, m.eq_obj2id]).T.tolist():
            what = EQUALITIES.get(_EQ(kind), "")
            what = "site" if what == "body" and objects == mujoco.mjtObj.mjOBJ_SITE else what
            out.append(sorted({v for one in ids if one >= 0 for v in self._velocities(what, one)}))
        return out

    @cached_property
    def _springs(self) -> dict[tuple[int, int, int, float], list[int]]:
        """The velocities of each `block.SPRING`, of its tendon or actuator; by its fields."""
        m = self._m
        taut = (m.tendon_stiffness != 0.0) | (m.tendon_armature != 0.0) if layout.TENDON_ROWS else ()
        tendons = np.flatnonzero(taut).tolist()
        out = {(one, 1, -1, float(m.tendon_armature[one])): self._velocities("tendon", one) for one in tendons}
        count = len(m.actuator_biastype)
        inertia = getattr(m, "actuator_armature", np.zeros(count))  # from 3.7
        kinds, (first, second) = m.actuator_trntype, m.actuator_trnid.T
        joint = np.where(np.isin(kinds, JOINTS), first, -1)
        # free joints have no length, nor sites that refer to no other
        lengthless = np.append(m.jnt_type == FREE_JOINT, False)[joint] | (kinds == SITE) & (second < 0)
        turns = (m.actuator_biastype == SO3) & (m.actuator_forcelimited == 0)  # whose limit is of three forces together
        servos = turns | (m.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)) & ~lengthless
        for row, actuator in enumerate(np.repeat(range(count), getattr(m, "actuator_outnum", 1)).tolist()):
            if servos[actuator] or inertia[actuator] != 0.0:
                own = row, 0, actuator if servos[actuator] else -1, float(inertia[actuator])
                out[own] = self._driven(actuator)
        return {spring: sorted(own) for spring, own in out.items() if own}

    def _driven(self, actuator: int) -> set[int]:
        """Return the velocities that an actuator may act on."""
        kind, ids = _TRN(int(self._m.actuator_trntype[actuator])), self._m.actuator_trnid[actuator].tolist()
        what = "site" if ids[1] >= 0 else TRANSMISSIONS.get(kind, "")
        return {v for one in ids if one >= 0 for v in self._velocities(what, one)}

    def _velocities(self, what: str, one: int) -> set[int]:
        """Return the last velocity that moves a "joint", "body", "site" or "geom", or each part of a "tendon"."""
        m = self._m
        if what == "joint":
            return {int(m.jnt_dofadr[one])}
        if what == "tendon":
            parts = slice(m.tendon_adr[one], m.tendon_adr[one] + m.tendon_num[one])
            wraps = zip(m.wrap_type[parts].tolist(), m.wrap_objid[parts].tolist(), strict=True)
            return {v for kind, part in wraps for v in self._velocities(WRAPS.get(_WRAP(kind), ""), part)}
        body = m.body_weldid[one if what == "body" else getattr(m, f"{what}_bodyid")[one] if what else 0]
        return {int(m.body_dofadr[body] + m.body_dofnum[body]) - 1} if m.body_dofnum[body] > 0 else set()

    @cached_property
    def _systems(self) -> dict[int, list[int]]:
        """The first bodies of the trees that equality constraints make one system, by each of them.

        Trees that a mocap body carries are left apart.
        """
        m, every = self._m, set(self._roots.tolist())
        led = {root for root in every if m.body_mocapid[self._carrier(int(m.body_parentid[root]))[0]] >= 0}
        held = [set(self._roots[m.dof_bodyid[held]].tolist()) - led for held in self._held]
        return systems_of([{root} for root in every] + held)

    def _add_shape(self, geom: int) -> list[int]:
        """Add a geom to its body in the world; return the numbers of the shapes that it makes."""
        row, shape = self._rows[self._carriers[geom][0]], self._geom_shapes[geom]
        ball = shape.type == "ellipsoid" and np.ptp(shape.size) == 0.0
        kind, (size, points) = "sphere" if ball else shape.type, self._size_of(geom)
        return self._world.add_shape(kind, row, size, *self._poses[geom], self._roundings.get(geom), points)

    def _size_of(self, geom: int) -> tuple[Array, Array | None]:
        """Return the sizes [m] of a geom; heights [m] of a field, shape (rows, columns), or vertices of a mesh, (n, 3).

        The vertices are those of its hull if MuJoCo has found it. While the model is compiled there are none of either
        yet; a flat field or a tetrahedron stands in for them.
        """
        m, shape, data = self._m, self._geom_shapes[geom], int(self._m.geom_dataid[geom])
        if shape.type == "hfield":
            first, rows, columns = int(m.hfield_adr[data]), int(m.hfield_nrow[data]), int(m.hfield_ncol[data])
            if rows == 0:
                return np.ones(3), np.zeros((2, 2))
            own = m.hfield_data[first : first + rows * columns].reshape(rows, columns)
            half_x, half_y, scale, base = m.hfield_size[data]
            heights = scale * own.astype(np.float64)
            return np.array([half_x, half_y, base + heights.min()]), heights
        if shape.type != "mesh":
            return shape.size, None
        first, count, graph = int(m.mesh_vertadr[data]), int(m.mesh_vertnum[data]), int(m.mesh_graphadr[data])
        if count == 0:
            return shape.size, np.eye(4, 3)
        own = m.mesh_vert[first : first + count]
        if graph >= 0:
            numbers = m.mesh_graph[graph:]
            own = own[numbers[2 + numbers[0] : 2 + 2 * numbers[0]]]
        return shape.size, own.astype(np.float64)
