"""The records of a tree of bodies, from arrays named as in MuJoCo's model; its coordinates and velocities."""

from collections.abc import Iterable, Mapping, Sequence
from ctypes import CFUNCTYPE, c_uint64
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from contactlaw.jit import address_of
from contactlaw.world.data.call import ask_mobility, call_on_tree, call_with_body, call_with_number, call_with_vectors
from contactlaw.world.data.frames import ALIKE, CONJUGATE, IDENTITY, ORIGIN, Pose, matrix_of, principal, product
from contactlaw.world.data.records import Array, Arrays
from contactlaw.world.data.tree import AXIS, BALL, FREE_JOINT, HINGE, JOINT, LINK, SLIDE, numbers_of
from contactlaw.world.trees import dynamics, kinematics, mobility, motion

Q_SIZE = {BALL: 4, SLIDE: 1, HINGE: 1}
V_SIZE = {FREE_JOINT: 6, BALL: 3, SLIDE: 1, HINGE: 1}


class TreeRecords:
    """The records of one tree. Bodies without joints are merged with the body that they are fixed to.

    A free joint becomes three slides and a ball joint.

    Args:
        model: MuJoCo's model, or its arrays of all bodies, joints, coordinates and velocities that `records_of` fills.
        bodies: Numbers of the tree's bodies, parents before children. The first, and others of which soft constraints
            make one system with it, are carried by the world or by a body that is not among them.
        bases: Of a body that is carried so: the pose of what carries it, if that is not `TREE.base`.

    Attributes:
        links, joints, axes: Records (`tree.LINK`, `JOINT`, `AXIS`).
        row, at, quaternion: Of each of the bodies: number of its link, and pose of its frame in the link's principal
            axes, from its centre of mass: shapes (bodies,), (bodies, 3), (bodies, 4).
        q_of, v_of: Places of the tree's coordinates and velocities among those of the model.
        start, damping: Coordinates at the reference; damping of all velocities [N s/m] or [N m s].

    Raises:
        ValueError: A body without joints whose parent is not in the tree; a link without mass; a free joint after
            another joint.
    """

    def __init__(self, model: Any, bodies: Sequence[int], bases: Mapping[int, Pose] = MappingProxyType({})) -> None:
        known = {int(body): number for number, body in enumerate(bodies)}
        heads = [body for body in known if model.body_jntnum[body] > 0]
        link_of = {body: number for number, body in enumerate(heads)}
        each = [[one for joint in _joints_of(model, body) for one in _parts_of(model, joint)] for body in heads]
        joints = [joint for own in each for joint in own]
        self.links, self.joints = np.zeros(len(heads), LINK), np.zeros(len(joints), JOINT)
        self.links["joints"] = [len(own) for own in each]
        self.links["first_joint"] = firsts(self.links["joints"])
        self.q_of = np.array([q + i for kind, q, *_ in joints for i in range(Q_SIZE[kind])], np.int64)
        self.v_of = np.array([v + i for kind, _, v, *_ in joints for i in range(V_SIZE[kind])], np.int64)
        self.axes = np.zeros(self.v_of.size, AXIS)
        self.start = np.asarray(model.qpos0)[self.q_of]
        self.damping = np.asarray(model.dof_damping)[self.v_of]
        self.axes["armature"] = np.asarray(model.dof_armature)[self.v_of]
        self.row = np.zeros(len(known), np.int64)
        self.at, self.quaternion = np.zeros((len(known), 3)), np.zeros((len(known), 4))
        for body, number in known.items():  # poses are in the frames of links until the links are complete
            before = known.get(int(model.body_parentid[body]))
            pose = Pose(np.array(model.body_pos[body]), np.array(model.body_quat[body]))
            base = bases.get(body, IDENTITY) if before is None else Pose(self.at[before], self.quaternion[before])
            pose = base.then(pose)
            if body not in link_of:
                if before is None:
                    raise ValueError(f"bodies: body {body} has no joint and hangs on no other of the tree")
                self.row[number], (self.at[number], self.quaternion[number]) = self.row[before], pose
                continue
            self.row[number], self.quaternion[number] = link_of[body], (1.0, 0.0, 0.0, 0.0)
            link = self.links[link_of[body]]
            link["parent"] = -1 if before is None else self.row[before]
            kinds = [int(model.jnt_type[one]) for one in _joints_of(model, body)]
            if FREE_JOINT in kinds[before is None :]:
                raise ValueError(f"bodies: body {body} has a free joint behind another joint")
            link["position"], link["quaternion"] = IDENTITY if FREE_JOINT in kinds else pose
        self._hang_joints(joints)
        self.couple(())
        self._weigh(model, list(known))

    def _hang_joints(self, joints: list[Any]) -> None:
        """Set the records of joints and degrees of freedom; joints: as of `_parts_of`."""
        rows, links, axes = self.joints, self.links, self.axes
        rows["kind"], _, _, rows["at"], rows["axis"], rows["reference"] = zip(*joints, strict=True)
        sizes = np.array([V_SIZE[kind] for kind in rows["kind"].tolist()])
        rows["first_q"], rows["first_axis"] = firsts([Q_SIZE[kind] for kind in rows["kind"].tolist()]), firsts(sizes)
        axes["begins"][rows["first_axis"]] = 1
        links["first_axis"] = first = rows["first_axis"][links["first_joint"]]
        links["axes"] = np.add.reduceat(sizes, links["first_joint"])
        last = first + links["axes"] - 1
        axes["carrier"] = np.arange(axes.size) - 1
        axes["carrier"][first] = np.where(links["parent"] >= 0, last[links["parent"]], -1)

    def couple(self, joined: Iterable[Iterable[int]]) -> None:
        """Set which entries the rows of the factor have, from the elimination tree of the mass matrix.

        Row k of M has entries of the axes that carry axis k and of those that are coupled with it. Elimination of k
        couples all of these with each other (Liu 1990, The role of elimination trees in sparse factorization).

        joined: sets of velocities of the model; a soft constraint couples those of each, and what carries them.
        """
        place, carriers = {int(v): k for k, v in enumerate(self.v_of)}, self.axes["carrier"].tolist()
        before = [{k} - {-1} for k in carriers]
        for one in joined:
            coupled, left = set[int](), {place[v] for v in one if v in place}
            while left:
                coupled |= left
                left = {carriers[k] for k in left} - {-1}
            for k in coupled:
                before[k].update(i for i in coupled if i < k)
        self.axes["parent"] = -1
        for k in range(len(before) - 1, -1, -1):
            if before[k]:
                parent = self.axes["parent"][k] = max(before[k])
                before[parent] |= before[k] - {parent}
        self.path = np.zeros((len(before), len(before)), np.int64)
        for k, parent in enumerate(self.axes["parent"].tolist()):
            depth = self.axes["depth"][k] = 0 if parent < 0 else self.axes["depth"][parent] + 1
            self.path[k], self.path[k, depth] = self.path[parent], k

    def _weigh(self, model: Any, bodies: list[int]) -> None:
        """Set mass, centre of mass and principal axes of each link, from all bodies merged in it."""
        for number, link in enumerate(self.links):
            parts = [i for i in range(len(bodies)) if self.row[i] == number and model.body_mass[bodies[i]] > 0.0]
            if not parts:
                raise ValueError(f"bodies: link {number} has no mass")
            own = [bodies[i] for i in parts]
            mass = np.array([float(model.body_mass[body]) for body in own])
            turns = [product(self.quaternion[i], np.array(model.body_iquat[bodies[i]])) for i in parts]
            places = np.array([self.at[i] + matrix_of(self.quaternion[i]) @ model.body_ipos[bodies[i]] for i in parts])
            link["mass"], link["centre"] = mass.sum(), mass @ places / mass.sum()
            link["inertia"], link["frame"] = model.body_inertia[own[0]], turns[0]
            if len(parts) > 1:
                tensor = np.zeros((3, 3))
                for body, turn, m, c in zip(own, turns, mass, places - link["centre"], strict=True):
                    axes = matrix_of(turn)
                    tensor += axes @ np.diag(model.body_inertia[body]) @ axes.T
                    tensor += m * (c @ c * np.eye(3) - np.outer(c, c))
                link["inertia"], link["frame"] = principal(tensor)
        for i in range(len(bodies)):
            link = self.links[self.row[i]]
            back = link["frame"] * CONJUGATE
            self.at[i] = matrix_of(back) @ (self.at[i] - link["centre"])
            self.quaternion[i] = product(back, self.quaternion[i])

    def bodies(self) -> list[dict[str, Any]]:
        """Return the fields of `records.BODY` of each link."""
        return [
            {
                "quaternion": (1.0, 0.0, 0.0, 0.0), "inverse_mass": 1.0 / link["mass"],
                "inverse_inertia": 1.0 / link["inertia"],
                "isotropic": np.ptp(link["inertia"]) <= ALIKE * link["inertia"].max(),
                "oriented": 1,
            }
            for link in self.links
        ]  # fmt: skip

    def fields(self) -> dict[str, Any]:
        """Return the fields of `tree.TREE`, except its bodies, gravity, and what carries it if not the world."""
        return {
            "count": self.links.size, "joint_count": self.joints.size, "q_size": self.start.size,
            "v_size": self.axes.size, "base_turn": (1.0, 0.0, 0.0, 0.0), "stale": 1,
        }  # fmt: skip

    def write(self, world: Arrays, number: int) -> None:
        """Write the records, the reference coordinates and the damping into the arrays of a tree of the world."""
        for name, rows in (("links", self.links), ("joints", self.joints), ("axes", self.axes)):
            numbers(world, number, name).view(rows.dtype)[:] = rows
        numbers(world, number, "path").view(np.int64)[:] = self.path.ravel()
        numbers(world, number, "q")[:] = self.start
        count = self.axes.size
        numbers(world, number, "d").reshape(count, count)[range(count), range(count)] = self.damping
        world.trees["stale"][number] = 1


def firsts(sizes: Iterable[int]) -> Array:
    """Return where each of several things of these sizes begins if they follow each other."""
    return np.cumsum([0, *sizes])[:-1]


def _joints_of(model: Any, body: int) -> range:
    """Return the numbers of a body's joints."""
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))


def _parts_of(model: Any, joint: int) -> list[Any]:
    """Return kind, first coordinate and velocity, place, axis and reference of a joint, or the four of a free one."""
    kind, q, v = (int(numbers[joint]) for numbers in (model.jnt_type, model.jnt_qposadr, model.jnt_dofadr))
    if kind == FREE_JOINT:
        slides = [(SLIDE, q + i, v + i, ORIGIN, axis, 0.0) for i, axis in enumerate(np.eye(3))]
        return [*slides, (BALL, q + 3, v + 3, ORIGIN, ORIGIN, 0.0)]
    return [(kind, q, v, model.jnt_pos[joint], model.jnt_axis[joint], model.qpos0[q])]


@lru_cache
def addresses() -> dict[str, int]:
    """Return the addresses of the compiled functions of trees, by their names in `tree.TREE`."""
    by_signature = {
        call_on_tree: (kinematics.move, dynamics.accelerate),
        call_with_number: (motion.fly, motion.drift),
        call_with_body: (
            mobility.settle, mobility.spread_delta_v, mobility.stop, mobility.move_from_start, mobility.write_masses,
            mobility.add_damping, mobility.balance, mobility.take_middle,
        ),
        call_with_vectors: (mobility.kick, mobility.add_accelerations, mobility.add_force),
        ask_mobility: (mobility.mobility,),
    }  # fmt: skip
    return {one.__name__: address_of(one, kind) for kind, functions in by_signature.items() for one in functions}


def numbers(world: Arrays, number: int, name: str) -> Array:
    """Return a view of one of a tree's arrays, by its name in `tree.TREE`."""
    tree = world.trees[number]
    sizes = numbers_of(tree)
    names = list(sizes)
    first = int(tree["numbers"]) + sum(sizes[one] for one in names[: names.index(name)])
    return world.joints[first : first + sizes[name]]


def coordinates(world: Arrays, number: int) -> tuple[Array, Array]:
    """Return copies of the coordinates and velocities of a tree."""
    return numbers(world, number, "q").copy(), numbers(world, number, "v").copy()


def write_coordinates(world: Arrays, number: int, q: Array, v: Array) -> None:
    """Set the coordinates and velocities of a tree, and all that follows from them; wakes its bodies."""
    for name, value in (("q", q), ("v", v)):
        own = numbers(world, number, name)
        if value.shape != own.shape:
            raise ValueError(f"{name}: shape {value.shape}; must be {own.shape}")
        own[:] = value
    tree = world.trees[number]
    tree["stale"] = 1
    bodies = world.bodies[int(tree["first"]) : int(tree["first"] + tree["count"])]
    bodies["asleep"], bodies["placed"] = 0, 1
    CFUNCTYPE(None, c_uint64)(int(tree["settle"]))(int(tree["bodies"]))
