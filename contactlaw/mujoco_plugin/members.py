"""The contacts of a compiled model: what each plugin instance is configured for, and whether it can be served.

The engine's rules (MuJoCo documentation, Computation, "Collision detection", Selection): two geoms are tested if
`<contact><pair>` names them; else if the `contype` of one has a bit in common with the `conaffinity` of the other, and
their bodies are not excluded, nor both without a joint, nor parent and child, unless the parent is welded to the world.
Bodies that are welded together count as one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import chain, combinations_with_replacement
from math import inf, isnan, nan
from typing import NamedTuple

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.layout import LIBRARY
from contactlaw.mujoco_plugin.shapes import Bits, Shape, check_served, native_margin, touch, type_of
from contactlaw.pair import ContactPair
from contactlaw.world.near.sets import Sets, groups

FILTER_PARENT = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
_GEOM, _BODY, _TREE = (int(getattr(mujoco.mjtObj, f"mjOBJ_{name}")) for name in ("GEOM", "BODY", "XBODY"))
_ADHESION, _SENSOR = int(mujoco.mjtTrn.mjTRN_BODY), int(getattr(mujoco.mjtSensor, "mjSENS_CONTACT", -1))


def configured(view: layout.ModelView, number: int) -> Iterator[tuple[str, str]]:
    """Keys and values of a plugin instance, those that have any."""
    items = ((key, LIBRARY.mj_getPluginConfig(view.address, number, key.encode())) for key in config.KEYS)
    return ((key, value.decode()) for key, value in items if value)


def instances(view: layout.ModelView) -> list[int]:
    """Numbers of this plugin's instances in a model."""
    slots = [layout.plugin_of(name)[1] for name in (config.PLUGIN_NAME, config.BLIND)]
    return np.flatnonzero(np.isin(view.plugin, slots)).tolist()


def members(view: layout.ModelView) -> list[int]:
    """Those of them that are contacts; what is not configured at all is a sensor of all contacts."""
    return [number for number in instances(view) if any(configured(view, number))]


def left_out(view: layout.ModelView) -> Iterator[str]:
    """What knows the engine's own contacts alone, and is on geoms that touch by the law: words for each."""
    sticky, sensors = (np.flatnonzero(own) for own in (view.actuator_trntype == _ADHESION, view.sensor_type == _SENSOR))
    if not (sticky.size or sensors.size):
        return
    geoms = np.unique([geom for number in members(view) for geom in Member(view, number).geoms])

    def on(kind: int, number: int) -> bool:
        """Whether such geoms are of an object; a site, or no object, means any."""
        bodies = view.geom_bodyid[geoms].copy()
        while kind == _TREE and (bodies > number).any():
            bodies[bodies > number] = view.body_parentid[bodies[bodies > number]]
        own = {_GEOM: geoms, _BODY: bodies, _TREE: bodies}.get(kind)
        return own is None or number in own

    for k in sticky.tolist():
        body = int(view.actuator_trnid[k, 0])
        if on(_BODY, body):
            what = f"actuator {view.label('actuator', k)}: adhesion of body {view.label('body', body)}"
            yield f"{what} presses by the engine's own contacts, and not by those of the law"
    for k in sensors.tolist():
        ends = (view.sensor_objtype[k], view.sensor_objid[k]), (view.sensor_reftype[k], view.sensor_refid[k])
        if all(on(int(kind), int(number)) for kind, number in ends):
            what = f"sensor {view.label('sensor', k)}: tells of the engine's own contacts, and not"
            yield f"{what} of those of the law; take contacts_of, or a sensor contactlaw.contact"


def friction_of(one: tuple[float, int], two: tuple[float, int]) -> float:
    """Coefficient of geoms with these frictions and priorities: the greater, or that of the greater priority."""
    return max(one[0], two[0]) if one[1] == two[1] else max(one, two, key=lambda own: own[1])[0]


class Rule(NamedTuple):
    """Each geom of the first touches each of the second, or none does."""

    ones: frozenset[int]
    twos: frozenset[int]
    allowed: bool

    def fits(self, one: int, two: int) -> bool:
        """Whether it is about two geoms."""
        return (one in self.ones and two in self.twos) or (two in self.ones and one in self.twos)


def explicit_pairs(view: layout.ModelView) -> Iterable[tuple[int, int, float]]:
    """Both geoms of each `<pair>`, and its margin [m]."""
    return zip(view.pair_geom1.tolist(), view.pair_geom2.tolist(), view.pair_margin.tolist(), strict=True)


def rules_of(view: layout.ModelView, bits: Mapping[int, Bits]) -> list[Rule]:
    """Of geoms that may touch each other natively, those that do not; of two rules that fit, the later one holds.

    Args:
        view: The compiled model.
        bits: Contype and conaffinity that geoms had before the law took their contacts. What the engine still does with
            those that they have now is the engine's, and so are pairs of `<contact>` but for those with a negative
            margin, by which a contact is turned off.
    """
    contype, affinity, owner = view.geom_contype, view.geom_conaffinity, view.geom_bodyid
    weld, parent, tree = view.body_weldid, view.body_parentid, view.body_treeid
    kinds = groups(bits, lambda geom: (bits[geom], (int(contype[geom]), int(affinity[geom]))))
    known: list[tuple[Iterable[int], Iterable[int], bool]] = [
        (kinds[one], kinds[two], False)
        for one, two in combinations_with_replacement(kinds, 2)
        if not touch(one[0], two[0]) or touch(one[1], two[1])
    ]
    carried = groups(bits, lambda geom: int(weld[owner[geom]]))
    still = groups(bits, lambda geom: bool(tree[owner[geom]] < 0)).get(True, ())
    known += [(geoms, geoms, False) for geoms in (*carried.values(), still) if len(geoms) > 1]
    if not view.option("disableflags") & FILTER_PARENT:
        above = {body: int(weld[parent[body]]) for body in carried if body}
        known += [(carried[body], carried[up], False) for body, up in above.items() if up and up in carried]
    of_body = groups(bits, lambda geom: int(owner[geom]))
    excluded = ((signature >> 16, signature & 0xFFFF) for signature in view.exclude_signature.tolist())
    known += [(of_body[one], of_body[two], False) for one, two in excluded if one in of_body and two in of_body]
    pairs = explicit_pairs(view)
    known += [([one], [two], margin < 0.0) for one, two, margin in pairs if one in bits and two in bits]
    return [Rule(frozenset(ones), frozenset(twos), allowed) for ones, twos, allowed in known]


class Member:
    """What a compiled model says of one plugin instance."""

    def __init__(self, view: layout.ModelView, number: int) -> None:
        self.view = view
        self.number = number
        self.contact = config.read(tuple(configured(view, number)))
        self._ids = self._geoms()
        self.geoms = list(dict.fromkeys(self._ids[0] + self._ids[1]))
        if self.contact.native and len(self.contact.native) != len(self.geoms):
            raise ValueError(f"native: tells of {len(self.contact.native)} geoms; must tell of all {len(self.geoms)}")
        self.native: dict[int, Bits] = dict(zip(self.geoms, self.contact.native, strict=False))

    def _geoms(self) -> list[list[int]]:
        """Ids of geoms, by names that have what stands before and behind the instance's own name."""
        own = self.view.name("plugin", self.number)
        name = self.contact.name
        start, _, end = own.partition(name) if name and name in own else ("", "", "")
        out = []
        for key, (text,) in (("geom1", self.contact.ones), ("geom2", self.contact.twos)):
            ids = [self.view.geom(start + text + end)]
            if ids[0] < 0:
                ids = [self.view.geom(start + name + end) for name in config.split(text)]
            if not ids or min(ids) < 0:
                raise ValueError(
                    f"{key} = {text!r}: must be the name of a geom of the model, or names with spaces between"
                )
            out.append(list(dict.fromkeys(ids)))
        return out

    @cached_property
    def product(self) -> Sets:
        """The geoms that are named: each of the first with each of the second."""
        ones, twos = self._ids
        if len(ones) == len(twos) == 1 and ones == twos:
            raise ValueError(f"geom2 = {self.contact.twos[0]!r}: must be another geom than geom1")
        return Sets(ones, twos, self.view.geom_bodyid.tolist().__getitem__)

    @cached_property
    def sets(self) -> Sets:
        """The geoms that may touch."""
        if not self.native:
            return self.product
        known = rules_of(self.view, self.native)[::-1]
        return self.product.among(lambda one, two: next((rule.allowed for rule in known if rule.fits(one, two)), True))

    def by_friction(self, ones: Iterable[int], twos: Iterable[int]) -> Iterator[tuple[float, list[int], list[int]]]:
        """Geoms of one set that touch those of another, by their coefficient of friction."""
        if not self.contact.frictions:
            yield nan, list(ones), list(twos)
            return
        mu, priority = self.view.geom_friction[:, 0], self.view.geom_priority
        first, second = (groups(own, lambda geom: (float(mu[geom]), int(priority[geom]))) for own in (ones, twos))
        for one, these in first.items():
            yield from ((friction_of(one, two), these, those) for two, those in second.items())

    @cached_property
    def pairs(self) -> dict[float, ContactPair]:
        """What its contacts are, by their coefficients of friction; NaN: that of the pair.

        Raises:
            ValueError: There are more different ones than there is room for.
        """
        pair, room = self.contact.pair, self.contact.frictions or 1
        known = dict.fromkeys(mu for mu, _, _ in self.by_friction(*self._ids))
        if len(known) > room:
            raise ValueError(f"geom_friction: of one pair of materials {len(known)} different ones; room is for {room}")
        return {mu: pair if isnan(mu) else replace(pair, friction=mu) for mu in known}

    @cached_property
    def shapes(self) -> dict[int, Shape]:
        """All geoms of the instance."""
        sizes, types, name = self.view.geom_size, self.view.geom_type, self.view.name
        return {geom: Shape(name("geom", geom), type_of(int(types[geom])), sizes[geom].copy()) for geom in self.geoms}


def check(view: layout.ModelView, known: list[Member], moves: Callable[[int], bool]) -> None:
    """Each pair belongs to one instance, can move, and has no contact by the engine itself.

    moves: whether a geom does.

    Raises:
        ValueError: Not so; the message names the geoms.
    """
    bits = list(zip(view.geom_contype.tolist(), view.geom_conaffinity.tolist(), strict=True))
    owner, excluded = view.geom_bodyid.tolist(), set(view.exclude_signature.tolist())
    margins: dict[tuple[int, int], float] = {}
    for one, two, margin in explicit_pairs(view):
        key = min(one, two), max(one, two)
        margins[key] = max(margin, margins.get(key, -inf))

    def is_on(pair: tuple[int, int]) -> bool:
        """Whether two geoms touch by the engine's own contact."""
        low, high = sorted(owner[geom] for geom in pair)
        if (min(pair), max(pair)) in margins:
            return margins[min(pair), max(pair)] >= 0.0
        return (low << 16) + high not in excluded and touch(bits[pair[0]], bits[pair[1]])

    for number, member in enumerate(known):
        shapes = member.shapes
        if not any(moves(geom) for geom in member.geoms):
            raise ValueError("geom1, geom2: none of these geoms can move")
        if member.native:
            continue
        for other in known[:number]:
            twice = None if other.native else member.sets.common(other.sets)
            if twice:
                raise ValueError(f"{_names(shapes, twice)}: this pair has been added before")
        sets = member.sets
        check_served(sets, shapes)
        named = [(two, one) if sets.reversed(one, two) else (one, two) for one, two in margins if sets.hold(one, two)]
        some = any(touch(bits[one], bits[two]) for one, two in sets.by_kinds(bits.__getitem__))
        on = next(filter(is_on, chain(named, sets.every() if some else ())), None)
        if on:
            one, two = (shapes[geom] for geom in on)
            margin, gap = native_margin(one, two)
            raise ValueError(
                f"{_names(shapes, on)}: the engine's own contact of this pair is on; turn it off by <contact><pair "
                f'geom1="{one.name}" geom2="{two.name}" margin="{margin!r}" gap="{gap:g}"/></contact>'
            )


def _names(shapes: dict[int, Shape], pair: tuple[int, int]) -> str:
    return f"geom1 = {shapes[pair[0]].name!r}, geom2 = {shapes[pair[1]].name!r}"
