"""Plugin instances of a compiled model: their configuration, their geoms, and whether the law can serve them.

MuJoCo's rules (documentation, Computation, "Collision detection", Selection): two geoms are tested if a
`<contact><pair>` names them. Else they are tested if contype of one shares a bit with conaffinity of the other, unless
their bodies are excluded, or both have no joint, or are parent and child with the parent not welded to the world.
Bodies welded together count as one.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from functools import cached_property
from itertools import chain
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.geoms import MAX_NAMES, Bits, first_of, native_margin, shape_in, touch
from contactlaw.world.data.tree import FREE_JOINT
from contactlaw.world.near.sets import Sets, groups

NO_CONSTRAINT = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
FILTER_PARENT = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
_GEOM, _BODY, _TREE = (int(getattr(mujoco.mjtObj, f"mjOBJ_{name}")) for name in ("GEOM", "BODY", "XBODY"))
_ADHESION = int(mujoco.mjtTrn.mjTRN_BODY)
_SENSORS = [int(getattr(mujoco.mjtSensor, f"mjSENS_{name}", -1)) for name in ("CONTACT", "TACTILE")]
_GRID = "mujoco.sensor.touch_grid"  # a plugin of MuJoCo's own
ACTS = "acts by the engine's own contacts, and not by those of the law"
READS = "measures the engine's own contacts, and not those of the law; use contacts_of, or a sensor contactlaw.contact"


def configured(view: layout.ModelView, number: int) -> Iterator[tuple[str, str]]:
    """Yield the keys of a plugin instance that have a value, and the values."""
    items = ((key, layout.LIBRARY.mj_getPluginConfig(view.address, number, key.encode())) for key in config.KEYS)
    return ((key, value.decode()) for key, value in items if value)


def instances(view: layout.ModelView) -> list[int]:
    """Return the ids of all instances of this plugin in a model."""
    slots = [layout.plugin_of(name)[1] for name in (config.PLUGIN_NAME, config.BLIND)]
    return np.flatnonzero(np.isin(view.plugin, slots)).tolist()


def contact_instances(view: layout.ModelView) -> list[int]:
    """Return the ids of instances that are contacts; those without any configuration are sensors of all contacts."""
    return [number for number in instances(view) if any(configured(view, number))]


def leads(view: layout.ModelView, number: int) -> bool:
    """Return whether an instance is the first contact of the model, whose block holds the world (see `block`)."""
    return number == next((one for one in instances(view) if any(configured(view, one))), None)


def unserved_readers(view: layout.ModelView) -> Iterator[str]:
    """Yield a warning for what the engine's own contacts alone know, where it is on geoms of the law.

    These are adhesion actuators, sensors of contacts, and (from MuJoCo 3.11) adhesion and surface velocity of geoms.
    """
    bare, found = np.zeros((view.ngeom, 1)), list[tuple[str, Any]]()  # and all that each is on
    for name in ("adhesion", "surfacevel"):
        values = getattr(view, f"geom_{name}", bare).reshape(view.ngeom, -1)
        for geom in np.flatnonzero(values.any(1)).tolist():
            found.append((f"geom {view.label('geom', geom)}: {name} {ACTS}", [(_GEOM, geom)]))
    for k in np.flatnonzero(view.actuator_trntype == _ADHESION).tolist():
        body = int(view.actuator_trnid[k, 0])
        what = f"actuator {view.label('actuator', k)}: adhesion of body {view.label('body', body)}"
        found.append((f"{what} {ACTS}", [(_BODY, body)]))
    grids = (view.sensor_plugin >= 0) & (view.plugin[view.sensor_plugin] == layout.plugin_of(_GRID)[1])
    for k in np.flatnonzero(np.isin(view.sensor_type, _SENSORS) | grids).tolist():
        ends = np.array([view.sensor_objtype, view.sensor_objid, view.sensor_reftype, view.sensor_refid])[:, k]
        found.append((f"sensor {view.label('sensor', k)}: {READS}", ends.reshape(2, 2).tolist()))
    if not found:
        return
    geoms = {geom for number in contact_instances(view) for geom in ContactInstance(view, number).geoms}
    bodies = set(view.geom_bodyid[list(geoms)].tolist())
    trees = {above for body in bodies for above in view.chain(body)}
    of_law = {_GEOM: geoms, _BODY: bodies, _TREE: trees | {0}}  # a site, or no object, may have any geoms
    yield from (text for text, ends in found if all(one in of_law.get(kind, (one,)) for kind, one in ends))


def contact_of_kinds(
    view: layout.ModelView, known: Sequence[ContactInstance]
) -> tuple[dict[int, int], NDArray[np.int64]]:
    """Return a kind for each geom, and a matrix of the contact that geoms of two kinds make: an index, or -1.

    Of several contacts that hold two geoms, the last one has them; those that hold only native pairs come first. The
    native pairs of the law are those that the engine would have tested before the law took over, and does not test now.
    A `<pair>` with a negative margin is one that `spec` wrote, so it is the law's.
    """
    before = {geom: own for one in known for geom, own in one.native.items()}
    weld, owner, fixed, above = view.body_weldid, view.geom_bodyid, view.body_treeid < 0, view.carriers
    carriers = set(above[weld[owner]].tolist()) - {0}
    apart = {body for signature in view.exclude_signature.tolist() for body in (signature >> 16, signature & 0xFFFF)}
    apart |= {body for body in set(owner.tolist()) if above[body] or int(weld[body]) in carriers}
    named = {geom for both in view.margins for geom in both}

    def kind_of(geom: int) -> Hashable:
        sides, body = tuple((geom in one.sides[0], geom in one.sides[1]) for one in known), int(owner[geom])
        if geom not in before:
            return sides
        alone = geom if geom in named else -1, body if body in apart else -1
        return sides, before[geom], view.bits[geom], bool(fixed[body]), alone

    kinds = list(groups(dict.fromkeys(geom for one in known for geom in one.geoms), kind_of).values())
    kind = {geom: number for number, geoms in enumerate(kinds) for geom in geoms}
    some = np.array([geoms[0] for geoms in kinds])
    body = owner[some]
    was = np.array([before.get(geom, (0, 0)) for geom in some.tolist()]).T
    now = np.array([view.bits[geom] for geom in some.tolist()]).T
    native = touch(was[:, :, None], was) & ~touch(now[:, :, None], now) & may_meet(view, body[:, None], body)
    for (one, two), margin in view.margins.items():
        if one in before and two in before:
            native[kind[one], kind[two]] = native[kind[two], kind[one]] = margin < 0.0
    table = np.full(native.shape, -1)
    for number, contact in sorted(enumerate(known), key=lambda item: not item[1].native):
        ones, twos = (np.array([geom in side for geom in some.tolist()]) for side in contact.sides)
        held = (ones[:, None] & twos) | (twos[:, None] & ones)
        table[held & native if contact.native else held] = number
    return kind, table


class ContactInstance:
    """A plugin instance that is a contact: its configuration and its geoms in the compiled model."""

    def __init__(self, view: layout.ModelView, number: int) -> None:
        self.view, self.number, self.name = view, number, view.name("plugin", number)
        self.contact = config.read(tuple(configured(view, number)))
        self.sides = self._find_geoms()
        self.geoms = list({**self.sides[0], **self.sides[1]})
        if self.contact.native and len(self.contact.native) != len(self.geoms):
            raise ValueError(f"native: is of {len(self.contact.native)} geoms; must be of all {len(self.geoms)}")
        self.native: dict[int, Bits] = dict(zip(self.geoms, self.contact.native, strict=False))

    def _find_geoms(self) -> list[dict[int, None]]:
        """Return the ids of the geoms of both sides.

        Where the model was attached to another one, geom names have the prefix and suffix of the instance's name.
        """
        name = self.contact.name
        start, _, end = self.name.partition(name) if name and name in self.name else ("", "", "")
        out = []
        for key, (text,) in (("geom1", self.contact.ones), ("geom2", self.contact.twos)):
            whole = self.view.geom(start + text + end)
            names = [text] if whole >= 0 else config.split(text)
            ids = [self.view.geom(start + name + end) for name in names]
            if not ids or min(ids) < 0:
                none = f"; {names[ids.index(-1)]!r} is none" if len(ids) > 1 else ""
                raise ValueError(
                    f"{key} = {text!r}: must be the name of a geom of the model, or names with spaces between{none}"
                )
            out.append(dict.fromkeys(ids))
        return out

    @cached_property
    def sets(self) -> Sets:
        """All pairs of a geom of the first side and one of the second."""
        ones, twos = self.sides
        if len(ones) == len(twos) == 1 and ones == twos:
            raise ValueError(f"geom2 = {self.contact.twos[0]!r}: must be another geom than geom1")
        return Sets(ones, twos, self.view.geom_bodyid.tolist().__getitem__)


def may_meet(view: layout.ModelView, one: Any, two: Any) -> Any:
    """Return whether the engine tests geoms of bodies that are not welded together, ids or arrays, by their bits."""
    (a, above_a), (b, above_b) = ((view.body_weldid[body], view.carriers[body]) for body in (one, two))
    excluded = np.isin((np.minimum(one, two) << 16) + np.maximum(one, two), view.exclude_signature)
    meet = ~excluded & ((view.body_treeid[one] >= 0) | (view.body_treeid[two] >= 0))
    filtered = not view.opt["disableflags"] & FILTER_PARENT
    return meet & ~(filtered & (((above_a == b) & (b > 0)) | ((above_b == a) & (a > 0))))


def is_native(view: layout.ModelView, one: int, two: int) -> bool:
    """Return whether two geoms touch by the engine's own contact."""
    low, high = sorted((one, two))
    if (low, high) in view.margins:
        return view.margins[low, high] >= 0.0
    if not touch(view.bits[one], view.bits[two]):
        return False
    a, b = view.geom_bodyid[[one, two]]
    return view.body_weldid[a] != view.body_weldid[b] and may_meet(view, a, b)


def skip_constraints(model: mujoco.MjModel) -> bool:
    """Switch the engine's constraint stage off if the law makes all contacts of the model, and all joints are free.

    Even where it finds nothing the stage takes a fifth of the step of a single body, and stack memory that grows as the
    square of the number of bodies. `load_model` calls this; after `spec.compile()` the user may. Returns whether the
    stage is off: by mjDSBL_CONSTRAINT in `model.opt.disableflags`, to which the law pays no heed. Clear the flag before
    `geom_contype` or `geom_conaffinity` is edited to let the engine make contacts again.
    """
    view = layout.view_of(model)
    bound = view.neq or view.ntendon or view.nflex or (view.jnt_type != FREE_JOINT).any() or view.dof_frictionloss.any()
    if contact_instances(view) and not bound and not _makes_contacts(view):
        model.opt.disableflags |= NO_CONSTRAINT
    return bool(model.opt.disableflags & NO_CONSTRAINT)


def _makes_contacts(view: layout.ModelView) -> bool:
    """Return whether the engine may make a contact by itself between any two geoms."""
    every, moving = (view.geom_contype, view.geom_conaffinity), np.flatnonzero(view.body_treeid[view.geom_bodyid] >= 0)
    both = ((a, b) for a in moving.tolist() for b in np.flatnonzero(touch(view.bits[a], every)).tolist())
    return bool((view.pair_margin >= 0.0).any()) or any(is_native(view, a, b) for a, b in both)


def check(view: layout.ModelView, known: list[ContactInstance], moves: Callable[[int], bool]) -> None:
    """Check that each pair belongs to one instance, can move, and has no native contact; moves: whether a geom can."""
    bits, margins = view.bits, view.margins
    holders: dict[int, set[int]] = {}  # of each geom the contacts that hold it, so far
    for number, member in enumerate(known):
        if not any(moves(geom) for geom in member.geoms):
            names = first_of([view.label("geom", geom) for geom in member.geoms], MAX_NAMES)
            raise ValueError(f"{names}: none of these geoms can move")
        if member.native:
            continue
        near = [set[int]().union(*(holders.get(geom, ()) for geom in side)) for side in member.sides]
        for geom in member.geoms:
            holders.setdefault(geom, set()).add(number)
        for other in sorted(set.intersection(*near)):
            twice = member.sets.common(known[other].sets)
            if twice:
                raise ValueError(f"{_names(view, twice)}: this pair has been added before")
        sets = member.sets
        named = [(two, one) if sets.reversed(one, two) else (one, two) for one, two in margins if sets.hold(one, two)]
        some = any(touch(bits[one], bits[two]) for one, two in sets.by_kinds(bits.__getitem__))
        on = next((both for both in chain(named, sets.every() if some else ()) if is_native(view, *both)), None)
        if on:
            margin, gap = native_margin(*(shape_in(view, geom) for geom in on))
            one, two = (view.name("geom", geom) for geom in on)
            raise ValueError(
                f"{_names(view, on)}: the engine's own contact of this pair is on; turn it off by <contact><pair "
                f'geom1="{one}" geom2="{two}" margin="{margin!r}" gap="{gap:g}"/></contact>'
            )


def _names(view: layout.ModelView, pair: tuple[int, int]) -> str:
    return f"geom1 = {view.label('geom', pair[0])}, geom2 = {view.label('geom', pair[1])}"
