"""A compiled model as a world: its bodies, their shapes, and which of these touch by the law."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from functools import cached_property
from types import SimpleNamespace
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import FREE, HEAD, JOINTED, PLACED, PROBE, PUSH, STARTS, fill, size_of
from contactlaw.mujoco_plugin.members import Member, check, members
from contactlaw.mujoco_plugin.probes import address_of_probe
from contactlaw.mujoco_plugin.shapes import BOX, CAPSULE, PLANE, Shape
from contactlaw.world import World
from contactlaw.world.arrays import with_room, with_rows
from contactlaw.world.frames import matrix_of, product
from contactlaw.world.records import Arrays
from contactlaw.world.state import size as state_size
from contactlaw.world.step import address_of_pressed, address_of_step
from contactlaw.world.tree_rows import TreeRows

Array = NDArray[np.float64]
UNIT = np.array([1.0, 0.0, 0.0, 0.0])
NEIGHBOURS, LISTED = 12, 40  # contacts at once, and near pairs, that there is room for, for each shape


class Pose(NamedTuple):
    """Where something is in a frame: its origin [m] and its quaternion."""

    place: Array
    turn: Array

    def then(self, other: Pose) -> Pose:
        """Of something in this frame, given in it."""
        return Pose(self.place + matrix_of(self.turn) @ other.place, product(self.turn, other.turn))

    def inverse(self) -> Pose:
        """Of that frame in this."""
        turn = self.turn * [1.0, -1.0, -1.0, -1.0]
        return Pose(-matrix_of(turn) @ self.place, turn)


class Model:
    """The bodies and contacts of a compiled model."""

    def __init__(self, view: layout.ModelView) -> None:
        self._view = view
        self._members = [Member(view, number) for number in members(view)]
        geoms = sorted({geom for member in self._members for geom in member.shapes})
        count = view.size("nbody")
        self._parent, self._mocap = view.ints("body_parentid", count), view.ints("body_mocapid", count)
        self._dofs, self._first_dof = view.ints("body_dofnum", count), view.ints("body_dofadr", count)
        self._places = view.doubles("body_pos", 3 * count).reshape(-1, 3)
        self._turns = view.doubles("body_quat", 4 * count).reshape(-1, 4)
        self._owner = view.ints("geom_bodyid", view.size("ngeom"))
        self._carriers = {geom: self._carrier(int(self._owner[geom])) for geom in geoms}
        self._world = World(gravity=0.0, substeps=max(member.contact.substeps for member in self._members))
        self._rows: dict[int, int] = {}  # of the world, counted without itself
        self._frames: dict[int, Pose] = {}  # of bodies that move: their frames, from the centre of mass
        self._trees: list[dict[str, Any]] = []
        self._left = 0  # numbers of what the last step left of trees
        self._frees: list[dict[str, Any]] = []
        self._placed: list[dict[str, Any]] = []
        self._add_bodies()
        self._shapes = {geom: self._add_shape(geom) for geom in geoms}
        self._instances: list[int] = []  # of each pair of the world
        for number, member in enumerate(self._members):
            ones, twos = ([shape for geom in geoms for shape in self._shapes[geom]] for geoms in member.sets)
            if ones and twos:
                self._world.add_contact(ones, twos, member.contact.pair)
                self._instances.append(number)
        self._probes = [self._add_probe(*entry) for entry in self._measured()]

    @cached_property
    def arrays(self) -> Arrays:
        """Its world, with room for as many contacts as there may be."""
        made = self._world.arrays
        a, b = made.shapes[:, None], made.shapes[None, :]
        meets = (made.groups[a["group"], b["group"]] >= 0) & (a["body"] != b["body"])
        pairs = int((meets & (a["kind"] <= b["kind"])).sum())
        contacts, near = (max(min(pairs, most * made.shapes.size), 1) for most in (NEIGHBOURS, LISTED))
        return with_room(made, near, contacts)

    @property
    def state_size(self) -> int:
        """Numbers in plugin_state."""
        return PUSH + self._view.size("nv") + self._world_size

    @property
    def _world_size(self) -> int:
        a = self.arrays
        return state_size(a.contacts.size, a.memory.shape[1], a.bodies.size, a.pairs.size)

    def check(self) -> None:
        """See that the law can serve it; its pairs are there only once it is compiled as a whole.

        Raises:
            ValueError: It cannot; the message names the geoms.
        """
        free = {row["id"] for row in self._frees}
        carriers = {geom: carrier for geom, (carrier, _) in self._carriers.items()}
        check(
            self._view, self._members, lambda geom: self._dofs[carriers[geom]] > 0, lambda geom: carriers[geom] in free
        )
        if self._view.size("npluginstate") < self.state_size:
            raise ValueError("plugin_state: is shorter than the law needs; the model must be compiled by spec.compile")

    def block_size(self) -> int:
        """Bytes of the block."""
        return size_of(self.arrays, *self._tables.values())

    def fill(self, memory: NDArray[np.uint8], report: int) -> None:
        """Write the block of the leading instance, where it will stay; report: address of what tells Python."""
        head = np.zeros(1, HEAD)
        addresses = self._view.ints("plugin_stateadr", self._view.size("nplugin"))
        fields = {
            "leads": 1, "own_size": self.state_size, "step": address_of_step(), "pressed": address_of_pressed(),
            "report": report, "state": addresses[self._members[0].number], "state_size": self._world_size,
            "nq": self._view.size("nq"), "nv": self._view.size("nv"), "free_count": len(self._frees),
            "placed_count": len(self._placed), "probe_count": len(self._probes), "tree_count": len(self._trees),
        }  # fmt: skip
        for name, value in fields.items():
            head[name] = value
        if self._probes:
            self.arrays.world["probe"] = address_of_probe()
        fill(memory, head, self.arrays, **self._tables)

    @cached_property
    def _tables(self) -> dict[str, NDArray[Any]]:
        """By the names of their addresses in the head."""
        nv = self._view.size("nv")
        return {
            "starts": np.zeros(STARTS * (1 + self._view.size("nq") + nv)), "given": np.zeros(nv),
            "frees": with_rows(np.zeros(0, FREE), self._frees), "placed": with_rows(np.zeros(0, PLACED), self._placed),
            "probes": with_rows(np.zeros(0, PROBE), self._probes), "kept": np.zeros(24 * len(self._probes)),
            "trees": with_rows(np.zeros(0, JOINTED), self._trees), "left": np.zeros(self._left),
            "geoms": self._geom_of_shapes(), "instances": np.array(self._instances, np.int64),
            "said": np.zeros(len(self._members), np.int64),
        }  # fmt: skip

    def _geom_of_shapes(self) -> NDArray[np.int64]:
        owners = {shape: geom for geom, shapes in self._shapes.items() for shape in shapes}
        return np.array([owners[shape] for shape in range(len(owners))], np.int64)

    def _carrier(self, body: int) -> tuple[int, Pose]:
        """The body that moves, is placed, or stands for good, and carries this one; where this one is in its frame."""
        pose = Pose(np.zeros(3), UNIT)
        while body and self._dofs[body] == 0 and self._mocap[body] < 0:
            pose = Pose(self._places[body], self._turns[body]).then(pose)
            body = int(self._parent[body])
        return body, pose

    def _add_bodies(self) -> None:
        """Rows of the world: free bodies first, then those that joints hold, then those that the user places."""
        carriers = sorted({body for body, _ in self._carriers.values()})
        for body in carriers:
            if self._dofs[body] and self._is_free(body):
                self._add_free(body)
        for root in dict.fromkeys(self._root(body) for body in carriers if self._dofs[body] and body not in self._rows):
            self._add_tree(root)
        for body in carriers:
            if self._mocap[body] >= 0:
                self._rows[body] = self._world.add_body(np.inf, 1.0)
                self._placed.append({"body": self._rows[body] + 1, "id": body})
            elif not body:
                self._rows[0] = self._world.add_body(np.inf, 1.0)

    def _is_free(self, body: int) -> bool:
        """Whether a free joint alone moves it, and nothing that moves or weighs hangs on it."""
        view, nv = self._view, self._view.size("nv")
        joint = int(view.ints("body_jntadr", view.size("nbody"))[body])
        masses = view.doubles("body_mass", view.size("nbody"))
        below = [one for one in range(body + 1, masses.size) if self._hangs_on(one, body)]
        dofs = slice(self._first_dof[body], self._first_dof[body] + 6)
        extra = any(view.doubles(name, nv)[dofs].any() for name in ("dof_armature", "dof_damping"))
        free = int(view.ints("jnt_type", view.size("njnt"))[joint]) == int(mujoco.mjtJoint.mjJNT_FREE)
        return free and masses[body] > 0.0 and not (masses[below].any() or self._dofs[below].any() or extra)

    def _hangs_on(self, one: int, body: int) -> bool:
        while one > body:
            one = int(self._parent[one])
        return one == body

    def _add_free(self, body: int) -> None:
        view, count = self._view, self._view.size("nbody")
        pose = self._inertial(body)
        inertia = view.doubles("body_inertia", 3 * count)[3 * body : 3 * body + 3]
        joint = int(view.ints("body_jntadr", count)[body])
        row = self._world.add_body(float(view.doubles("body_mass", count)[body]), inertia)
        self._rows[body], self._frames[body] = row, pose.inverse()
        self._frees.append({
            "body": row + 1, "id": body, "q": int(view.ints("jnt_qposadr", view.size("njnt"))[joint]),
            "v": int(self._first_dof[body]), "offset": pose.place, "frame": pose.turn,
            "plain": bool((pose.place == 0.0).all() and (pose.turn == UNIT).all()),
        })  # fmt: skip

    def _root(self, body: int) -> int:
        """The first body of a kinematic tree."""
        root = body
        while body:
            root = body if self._dofs[body] else root
            body = int(self._parent[body])
        return root

    def _add_tree(self, root: int) -> None:
        """Bodies that joints hold together, welded ones among them."""
        bodies = [body for body in range(root, self._parent.size) if self._hangs_on(body, root)]
        view, (count, joints, dofs) = self._view, (self._view.size(name) for name in ("nbody", "njnt", "nv"))
        whole = {"body_parentid": count, "body_jntnum": count, "body_jntadr": count, "jnt_type": joints,
                 "jnt_qposadr": joints, "jnt_dofadr": joints}  # fmt: skip
        real = {"body_pos": (count, 3), "body_quat": (count, 4), "body_ipos": (count, 3), "body_iquat": (count, 4),
                "body_mass": (count,), "body_inertia": (count, 3), "jnt_pos": (joints, 3), "jnt_axis": (joints, 3),
                "qpos0": (view.size("nq"),), "dof_armature": (dofs,), "dof_damping": (dofs,)}  # fmt: skip
        arrays = {name: view.ints(name, size) for name, size in whole.items()}
        arrays |= {name: view.doubles(name, int(np.prod(shape))).reshape(shape) for name, shape in real.items()}
        rows = TreeRows(SimpleNamespace(**arrays), bodies)
        tree, made = self._world.add_tree_of(rows)
        for body, row, at, turn in zip(bodies, rows.row, rows.at, rows.quaternion, strict=True):
            self._rows[body], self._frames[body] = made[row], Pose(at, turn)
        self._trees.append({
            "tree": tree, "q": int(rows.q_of[0]), "v": int(rows.v_of[0]), "base": int(self._parent[root]),
            "left": 8 * self._left,
        })  # fmt: skip
        self._left += rows.q_of.size + rows.v_of.size

    def _inertial(self, body: int) -> Pose:
        """Centre of mass and principal axes of a body in its frame."""
        count = self._view.size("nbody")
        return Pose(
            self._view.doubles("body_ipos", 3 * count)[3 * body : 3 * body + 3].copy(),
            self._view.doubles("body_iquat", 4 * count)[4 * body : 4 * body + 4].copy(),
        )

    def _shape_of(self, geom: int) -> Shape:
        return next(member.shapes[geom] for member in self._members if geom in member.shapes)

    def _pose_of(self, geom: int) -> Pose:
        """Where a geom is, from the centre of mass of what carries it, along its principal axes."""
        carrier, pose = self._carriers[geom]
        count = self._view.size("ngeom")
        own = Pose(
            self._view.doubles("geom_pos", 3 * count)[3 * geom : 3 * geom + 3],
            self._view.doubles("geom_quat", 4 * count)[4 * geom : 4 * geom + 4],
        )
        pose = pose.then(own)
        return self._frames[carrier].then(pose) if carrier in self._frames else pose

    def _add_shape(self, geom: int) -> list[int]:
        """Give a geom to its body in the world; returns the shapes that it makes."""
        row, shape, pose = self._rows[self._carriers[geom][0]], self._shape_of(geom), self._pose_of(geom)
        axis = matrix_of(pose.turn)[:, 2]
        if shape.type == PLANE:
            return [self._world.add_plane(row, pose.place, axis)]
        if shape.type == CAPSULE:
            return list(self._world.add_capsule(row, float(shape.size[0]), float(shape.size[1]), pose.place, axis))
        if shape.type == BOX:
            return [self._world.add_box(row, shape.size, pose.place, pose.turn)]
        return [self._world.add_sphere(row, float(shape.size[0]), pose.place)] if shape.is_spherical else []

    def _measured(self) -> list[tuple[int, int, int]]:
        """Instances, and round shapes of theirs each with one that the engine must measure."""
        pairs = [(number, *pair) for number, member in enumerate(self._members) for pair in member.pairs]
        pairs = [(k, a, b) if self._shape_of(a).is_round else (k, b, a) for k, a, b in pairs]
        return [(k, a, b) for k, a, b in pairs if not self._shape_of(b).has_closed_form]

    def _add_probe(self, instance: int, one: int, other: int) -> dict[str, Any]:
        """Let a sphere, that of a capsule at its nearest point, touch a plane that is to be placed on another shape."""
        pose, own, shape = self._pose_of(other), self._pose_of(one), self._shape_of(one)
        around = float(self._view.doubles("geom_rbound", self._view.size("ngeom"))[other])
        sphere = self._world.add_sphere(self._rows[self._carriers[one][0]], float(shape.size[0]), own.place)
        row, reach = self._rows[self._carriers[other][0]], float(np.linalg.norm(pose.place)) + around
        plane = self._world.add_tangent(row, sphere, reach)
        self._world.add_contact(sphere, plane, self._members[instance].contact.pair)
        self._instances.append(instance)
        self._shapes[one].append(sphere)
        self._shapes[other].append(plane)
        half = 0.0 if shape.is_spherical else float(shape.size[1])
        return {
            "geom_a": one, "geom_b": other, "sphere": sphere, "plane": plane, "at": pose.place,
            "frame": matrix_of(pose.turn).ravel(), "middle": own.place, "line": half * matrix_of(own.turn)[:, 2],
        }  # fmt: skip
