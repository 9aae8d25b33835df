"""The contacts of a compiled model: what each plugin instance is configured for, and the tables they share."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
from functools import cached_property
from math import inf

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.kernels import scene, touch
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import config, layout, memo
from contactlaw.mujoco_plugin.shapes import (
    Shape,
    check_measurable,
    check_served,
    effective_radius,
    has_closed_form,
    in_order,
)

LIBRARY = layout.library()
LIBRARY.mj_getPluginConfig.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
LIBRARY.mj_getPluginConfig.restype = ctypes.c_char_p
LIBRARY.mj_name2id.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
LIBRARY.mj_id2name.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int]
LIBRARY.mj_id2name.restype = ctypes.c_char_p
LIBRARY.mjp_getPlugin.argtypes = [ctypes.c_char_p, ctypes.POINTER(ctypes.c_int)]
LIBRARY.mjp_getPlugin.restype = ctypes.c_void_p

NEIGHBOURS = 8  # contacts at once for each body, as far as room is left open; balls in a close packing have 12 halves
WORK_OF_CONTACT, MOST_WORK = 500, 200_000  # numbers of scratch memory: enough for most, at most
FAR_OUT = 1e100  # [m], a bound whose square is still a number


def contact_of(model: int, number: int) -> config.Contact:
    """The contact that a plugin instance of the model at this address is configured for."""
    items = ((key, LIBRARY.mj_getPluginConfig(model, number, key.encode())) for key in config.KEYS)
    return config.read(tuple((key, value.decode()) for key, value in items if value))


def members(view: layout.ModelView) -> list[int]:
    """Numbers of this plugin's instances in a model."""
    slot = ctypes.c_int(-1)
    LIBRARY.mjp_getPlugin(config.PLUGIN_NAME.encode(), ctypes.byref(slot))
    return np.flatnonzero(view.ints("plugin", view.size("nplugin")) == slot.value).tolist()


class Member:
    """What a compiled model says of one plugin instance."""

    def __init__(self, view: layout.ModelView, number: int) -> None:
        self.view = view
        self.number = number
        self.contact = contact_of(view.address, number)
        sets = self.contact.geoms1, self.contact.geoms2
        own = LIBRARY.mj_id2name(view.address, int(mujoco.mjtObj.mjOBJ_PLUGIN), number)
        self.sets = [self._geoms(key, names, own or b"") for key, names in zip(("geom1", "geom2"), sets, strict=True)]

    def _geoms(self, key: str, names: tuple[str, ...], own: bytes) -> list[int]:
        """Ids of geoms; attaching a model to another puts a prefix and suffix to all names, the instance's too."""
        text = " ".join(names)
        start, end = own.decode(), ""
        for candidate in (config.instance_name(*self._split(False)), config.instance_name(*self._split(True))):
            before, found, after = own.decode().partition(candidate)
            if found:
                start, end = before, after
                break
        else:
            start = ""
        whole = self._id(start + text + end)
        ids = [whole] if whole >= 0 else [self._id(start + name + end) for name in text.split()]
        if not ids or min(ids) < 0:
            raise ValueError(f"{key} = {text!r}: must be the name of a geom of the model, or names with spaces between")
        return ids

    def _split(self, apart: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
        one, two = " ".join(self.contact.geoms1), " ".join(self.contact.geoms2)
        return (tuple(one.split()), tuple(two.split())) if apart else ((one,), (two,))

    def _id(self, name: str) -> int:
        return LIBRARY.mj_name2id(self.view.address, int(mujoco.mjtObj.mjOBJ_GEOM), name.encode())

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """The geoms that may touch, each pair once."""
        one, two = self.sets
        if len(one) == len(two) == 1 and one == two:
            raise ValueError(f"geom2 = {' '.join(self.contact.geoms2)!r}: must be another geom than geom1")
        bodies, seen = self.view.ints("geom_bodyid", self.view.size("ngeom")), {}
        several = len(one) * len(two) > 1
        for i in one:
            for j in two:
                if i != j and not (several and bodies[i] == bodies[j]):
                    seen.setdefault((min(i, j), max(i, j)), (i, j))
        return list(seen.values())

    def shape(self, geom: int) -> Shape:
        """A geom."""
        count = self.view.size("ngeom")
        sizes = self.view.doubles("geom_size", 3 * count)[3 * geom : 3 * geom + 3]
        name = LIBRARY.mj_id2name(self.view.address, int(mujoco.mjtObj.mjOBJ_GEOM), geom) or b""
        return Shape(name.decode(), int(self.view.ints("geom_type", count)[geom]), sizes.copy())

    @cached_property
    def shapes(self) -> dict[int, Shape]:
        """All geoms of the instance."""
        return {geom: self.shape(geom) for geoms in self.sets for geom in geoms}

    def slots(self, one: int, two: int) -> int:
        """In how many places two geoms may touch."""
        a, other = self.shapes[one], self.shapes[two]
        if not in_order(a, other):
            a, other = other, a
        return int(touch.slots(a.kind, other.kind)) if has_closed_form(a, other) else 1

    @cached_property
    def room(self) -> int:
        """Records there is room for; one that has parted and still owes takes a place too."""
        slots = sum(self.slots(*pair) for pair in self.pairs)
        if self.contact.room is not None:
            return min(slots, self.contact.room)
        return min(slots, max(24, NEIGHBOURS * len(self.shapes)))

    @property
    def record_size(self) -> int:
        """Floats of a record."""
        return scene.HISTORY + self.contact.history_size

    @property
    def state_size(self) -> int:
        """Floats in plugin_state."""
        return b.records_at(self.contact.ledger) + self.room * self.record_size


class System:
    """All contacts of a model and the tables that the compiled callbacks work with."""

    def __init__(self, view: layout.ModelView) -> None:
        self.view = view
        self.members = [Member(view, number) for number in members(view)]
        self.geoms = sorted({geom for member in self.members for geom in member.shapes})
        self.index = {geom: i for i, geom in enumerate(self.geoms)}
        owners = view.ints("geom_bodyid", view.size("ngeom"))
        moving = {int(owners[geom]): self._facts(int(owners[geom])) for geom in self.geoms}
        self.bodies = [body for body, facts in moving.items() if facts[b.LAST_DOF] >= 0]
        self.facts = np.array([self._nothing(), *(moving[body] for body in self.bodies)])
        self.body_of = {geom: self._number(int(owners[geom])) for geom in self.geoms}
        self._check()

    @staticmethod
    def _nothing() -> NDArray[np.float64]:
        facts = np.zeros(b.BODY_FACTS)
        facts[[b.LAST_DOF, b.TREE_ID]] = -1.0
        return facts

    def _number(self, body: int) -> int:
        return self.bodies.index(body) + 1 if body in self.bodies else 0

    def _facts(self, body: int) -> NDArray[np.float64]:
        """What moves a body; for one that is free by itself, how easily."""
        view, count = self.view, self.view.size("nbody")
        parent, first, number = (view.ints(f, count) for f in ("body_parentid", "body_dofadr", "body_dofnum"))
        moving = body
        while moving and number[moving] == 0:
            moving = int(parent[moving])
        facts = self._nothing()
        if not moving:
            return facts
        last = int(first[moving] + number[moving] - 1)
        trees = view.ints("dof_treeid", view.size("nv"))
        of_tree = np.flatnonzero(trees == trees[last])
        facts[b.BODY_ID], facts[b.ROOT] = body, view.ints("body_rootid", count)[body]
        facts[b.LAST_DOF], facts[b.TREE_ID] = last, trees[last]
        facts[b.TREE_DOF], facts[b.TREE_SIZE] = of_tree[0], of_tree.size
        joint = int(view.ints("body_jntadr", count)[moving])
        mass, whole = (view.doubles(f, count)[body] for f in ("body_mass", "body_subtreemass"))
        extra = [view.doubles(f, view.size("nv"))[of_tree].any() for f in ("dof_armature", "dof_damping")]
        if (
            moving == body
            and of_tree.size == 6
            and view.ints("jnt_type", view.size("njnt"))[joint] == int(mujoco.mjtJoint.mjJNT_FREE)
            and mass == whole > 0.0
            and not any(extra)
        ):
            facts[b.LIGHTNESS] = 1.0 / mass
            facts[b.EASE : b.EASE + 3] = 1.0 / view.doubles("body_inertia", 3 * count)[3 * body : 3 * body + 3]
        return facts

    def _check(self) -> None:
        """Each pair belongs to one instance, can move, and has no contact by the engine itself."""
        known: set[tuple[int, int]] = set()
        native = _Native(self.view)
        for member in self.members:
            moving = False
            for one, two in member.pairs:
                shapes = member.shapes[one], member.shapes[two]
                names = f"geom1 = {shapes[0].name!r}, geom2 = {shapes[1].name!r}"
                if (min(one, two), max(one, two)) in known:
                    raise ValueError(f"{names}: this pair has been added before")
                known.add((min(one, two), max(one, two)))
                for shape in shapes:
                    check_measurable(shape)
                check_served(*shapes, bool(self.facts[[self.body_of[one], self.body_of[two]], b.LIGHTNESS].any()))
                effective_radius(*shapes, member.contact.pair.radius)
                moving = moving or bool(self.body_of[one] or self.body_of[two])
                if native.is_on(one, two):
                    raise ValueError(
                        f"{names}: the engine's own contact of this pair is on; turn it off by <contact><pair "
                        f'geom1="{shapes[0].name}" geom2="{shapes[1].name}" margin="{-native_margin(*shapes):g}"/>'
                        "</contact>"
                    )
            if not moving:
                raise ValueError("geom1, geom2: none of these geoms can move")

    def block(self, report: int) -> NDArray[np.float64]:
        """The memory of a leading instance, as `block` lays it out."""
        view, head = self.view, np.zeros(b.HEAD)
        pairs, parameters, instances = self._pairs()
        stride = max(member.record_size for member in self.members)
        room = sum(sum(member.slots(*pair) for pair in member.pairs) for member in self.members)
        room = min(room, 2 * sum(member.room for member in self.members) + 64)
        nv = view.size("nv")
        general = [int(facts[b.TREE_SIZE]) for facts in self.facts if facts[b.LAST_DOF] >= 0 and not facts[b.LIGHTNESS]]
        tables = {
            b.GEOMS_AT: np.array(self.geoms, dtype=float),
            b.SHAPES_AT: np.array([self._shape(geom) for geom in self.geoms]),
            b.BODIES_AT: self.facts,
            b.PAIRS_AT: pairs,
            b.PARAMETERS_AT: parameters,
            b.INSTANCES_AT: instances,
            b.PLACES_AT: np.zeros((len(self.geoms), touch.AXES + 9)),
            b.MOTION_AT: self._motion(),
            b.NEW_AT: np.zeros((room, stride)),
            b.LEDGER_AT: np.zeros((len(self.members), b.LEDGER_SIZE)),
            b.FORCE_AT: np.zeros(nv),
            b.INPUTS_AT: np.zeros(memo.inputs_of(view)),
            b.FRAMES_AT: np.zeros((len(self.facts), 9)),
            b.WORK_AT: np.zeros(
                min(WORK_OF_CONTACT * (room + 4) + 20 * nv + 100 * (len(self.geoms) + len(pairs)), MOST_WORK)
            ),
        }
        at = b.HEAD
        for index, values in tables.items():
            head[index] = at
            at += values.size
        numbers = {
            b.LEADS: 1.0, b.REPORT: report, b.INSTANCES: len(self.members), b.SHAPES: len(self.geoms),
            b.BODIES: len(self.facts), b.PAIRS: len(pairs), b.PARAMETERS: parameters.size, b.NV: nv, b.STRIDE: stride,
            b.CAPACITY: room, b.WIDTH: max([6, *general]), b.ACTUATED: view.size("nu") > 0, b.PENDING: -1.0,
            b.STAGE_TIME: np.nan, b.INPUTS: tables[b.INPUTS_AT].size, b.WORK: tables[b.WORK_AT].size,
            b.LEDGERS: any(member.contact.ledger for member in self.members),
        }  # fmt: skip
        for index, value in numbers.items():
            head[index] = value
        return np.concatenate([head, *(values.ravel() for values in tables.values())])

    def _shape(self, geom: int) -> list[float]:
        shape = next(member.shapes[geom] for member in self.members if geom in member.shapes)
        bound = shape.bound if shape.bound < inf else FAR_OUT
        return [shape.kind, *shape.sizes, self.body_of[geom], bound]

    def _motion(self) -> NDArray[np.float64]:
        motion = np.zeros((len(self.facts), scene.BODY))
        motion[:, scene.TREE] = self.facts[:, b.TREE_ID]
        return motion

    def _pairs(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Tables of pairs, of parameters, and of instances."""
        pairs, laws, instances, at = [], [], [], 0
        addresses = self.view.ints("plugin_stateadr", self.view.size("nplugin"))
        for member in self.members:
            contact, first, known = member.contact, len(pairs), {}
            for one, two in member.pairs:
                if not in_order(member.shapes[one], member.shapes[two]):
                    one, two = two, one
                radius = effective_radius(member.shapes[one], member.shapes[two], contact.pair.radius)
                if radius not in known:
                    laws.append(contact.pair.parameters(radius))
                    known[radius] = at
                    at += laws[-1].size
                pairs.append(
                    [self.index[one], self.index[two], known[radius], laws[-1].size, contact.substeps, contact.ledger,
                     member.slots(one, two)]
                )  # fmt: skip
            instances.append(
                [addresses[member.number], member.record_size, member.room, first, len(pairs), contact.ledger,
                 contact.pair.radius is not None, 0.0, member.number]
            )  # fmt: skip
        return np.array(pairs, dtype=float), np.concatenate(laws), np.array(instances, dtype=float)


class _Native:
    """Which contacts the engine itself makes."""

    def __init__(self, view: layout.ModelView) -> None:
        count = view.size("ngeom")
        self._bodies = view.ints("geom_bodyid", count)
        self._contype, self._affinity = view.ints("geom_contype", count), view.ints("geom_conaffinity", count)
        pairs = view.size("npair")
        ends = zip(view.ints("pair_geom1", pairs), view.ints("pair_geom2", pairs), strict=True)
        margins = view.doubles("pair_margin", pairs)
        self._margins: dict[tuple[int, int], float] = {}
        for (one, two), margin in zip(ends, margins, strict=True):
            key = (int(min(one, two)), int(max(one, two)))
            self._margins[key] = max(float(margin), self._margins.get(key, -inf))
        self._excluded = set(view.ints("exclude_signature", view.size("nexclude")).tolist())

    def is_on(self, one: int, two: int) -> bool:
        """Whether two geoms touch by the engine's own contact."""
        margin = self._margins.get((min(one, two), max(one, two)))
        if margin is not None:
            return margin >= 0.0
        low, high = sorted((int(self._bodies[one]), int(self._bodies[two])))
        if (low << 16) + high in self._excluded:
            return False
        return bool(self._contype[one] & self._affinity[two] or self._contype[two] & self._affinity[one])


def native_margin(one: Shape, two: Shape) -> float:
    """Margin, to be negated, of an explicit pair that the engine's bounding test always rejects."""
    bounds = [shape.bound for shape in (one, two)]
    # Bounding spheres are compared by squares: only a sum of exactly zero rejects all. Planes are compared signed.
    return sum(bounds) if max(bounds) < inf else 1e6
