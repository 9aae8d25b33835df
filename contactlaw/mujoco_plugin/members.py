"""The contacts of a compiled model: what each plugin instance is configured for, and whether it can be served."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import chain
from math import inf, isnan, nan

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.layout import LIBRARY
from contactlaw.mujoco_plugin.native import Bits, Rules, explicit_pairs, friction_of, touch
from contactlaw.mujoco_plugin.shapes import Shape, check_served, native_margin
from contactlaw.pair import ContactPair
from contactlaw.world.sets import Sets, groups

_GEOM, _PLUGIN, _BODY, _TREE, _ACTUATOR, _OF_SENSOR = (
    int(getattr(mujoco.mjtObj, f"mjOBJ_{name}")) for name in ("GEOM", "PLUGIN", "BODY", "XBODY", "ACTUATOR", "SENSOR")
)
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
            what = f"actuator {view.name(_ACTUATOR, k) or k!r}: adhesion of body {view.name(_BODY, body) or body!r}"
            yield f"{what} presses by the engine's own contacts, and not by those of the law"
    for k in sensors.tolist():
        ends = (view.sensor_objtype[k], view.sensor_objid[k]), (view.sensor_reftype[k], view.sensor_refid[k])
        if all(on(int(kind), int(number)) for kind, number in ends):
            what = f"sensor {view.name(_OF_SENSOR, k) or k!r}: tells of the engine's own contacts"
            yield f"{what}, and not of those of the law; take contacts_of, or a sensor contactlaw.contact"


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
        own = self.view.name(_PLUGIN, self.number)
        name = self.contact.name
        start, _, end = own.partition(name) if name and name in own else ("", "", "")
        out = []
        for key, (text,) in (("geom1", self.contact.ones), ("geom2", self.contact.twos)):
            ids = [self._id(start + text + end)]
            if ids[0] < 0:
                ids = [self._id(start + name + end) for name in config.split(text)]
            if not ids or min(ids) < 0:
                raise ValueError(
                    f"{key} = {text!r}: must be the name of a geom of the model, or names with spaces between"
                )
            out.append(list(dict.fromkeys(ids)))
        return out

    def _id(self, name: str) -> int:
        return LIBRARY.mj_name2id(self.view.address, _GEOM, name.encode())

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
        return self.product.among(Rules(self.view, self.native).allow)

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
        return {geom: Shape(name(_GEOM, geom), int(types[geom]), sizes[geom].copy()) for geom in self.geoms}


def check(view: layout.ModelView, known: list[Member], moves: Callable[[int], bool]) -> None:
    """Each pair belongs to one instance, can move, and has no contact by the engine itself.

    moves: whether a geom does.

    Raises:
        ValueError: Not so; the message names the geoms.
    """
    natively_on = _finder(view)
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
        check_served(member.sets, shapes)
        on = natively_on(member.sets)
        if on:
            one, two = (shapes[geom] for geom in on)
            margin, gap = native_margin(one, two)
            raise ValueError(
                f"{_names(shapes, on)}: the engine's own contact of this pair is on; turn it off by <contact><pair "
                f'geom1="{one.name}" geom2="{two.name}" margin="{margin!r}" gap="{gap:g}"/></contact>'
            )


def _names(shapes: dict[int, Shape], pair: tuple[int, int]) -> str:
    return f"geom1 = {shapes[pair[0]].name!r}, geom2 = {shapes[pair[1]].name!r}"


def _finder(view: layout.ModelView) -> Callable[[Sets], tuple[int, int] | None]:
    """What finds two geoms of sets that touch by the engine's own contact; None: there are none."""
    bits = list(zip(view.geom_contype.tolist(), view.geom_conaffinity.tolist(), strict=True))
    owner, excluded = view.geom_bodyid.tolist(), set(view.exclude_signature.tolist())
    margins: dict[tuple[int, int], float] = {}
    for one, two, margin in explicit_pairs(view):
        key = min(one, two), max(one, two)
        margins[key] = max(margin, margins.get(key, -inf))

    def is_on(pair: tuple[int, int]) -> bool:
        low, high = sorted(owner[geom] for geom in pair)
        if (min(pair), max(pair)) in margins:
            return margins[min(pair), max(pair)] >= 0.0
        return (low << 16) + high not in excluded and touch(bits[pair[0]], bits[pair[1]])

    def found(sets: Sets) -> tuple[int, int] | None:
        named = [(two, one) if sets.reversed(one, two) else (one, two) for one, two in margins if sets.hold(one, two)]
        some = any(touch(bits[one], bits[two]) for one, two in sets.by_kinds(bits.__getitem__))
        return next(filter(is_on, chain(named, sets.every() if some else ())), None)

    return found
