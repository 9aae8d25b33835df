"""The contacts of a compiled model: what each plugin instance is configured for, and whether it can be served."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from math import inf, isnan, nan

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.native import Bits, Rules, explicit_pairs, friction_of, touch
from contactlaw.mujoco_plugin.shapes import Shape, check_measurable, check_served, native_margin
from contactlaw.pair import ContactPair
from contactlaw.world.sets import Sets, groups

LIBRARY = layout.library()
LIBRARY.mj_getPluginConfig.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
LIBRARY.mj_getPluginConfig.restype = ctypes.c_char_p
LIBRARY.mj_name2id.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
LIBRARY.mj_id2name.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int]
LIBRARY.mj_id2name.restype = ctypes.c_char_p
LIBRARY.mjp_getPlugin.argtypes = [ctypes.c_char_p, ctypes.POINTER(ctypes.c_int)]
LIBRARY.mjp_getPlugin.restype = ctypes.c_void_p

_GEOM, _PLUGIN = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtObj.mjOBJ_PLUGIN)


def contact_of(model: int, number: int) -> config.Contact:
    """The contact that a plugin instance of the model at this address is configured for."""
    items = ((key, LIBRARY.mj_getPluginConfig(model, number, key.encode())) for key in config.KEYS)
    return config.read(tuple((key, value.decode()) for key, value in items if value))


def instances(view: layout.ModelView) -> list[int]:
    """Numbers of this plugin's instances in a model."""
    slot = ctypes.c_int(-1)
    LIBRARY.mjp_getPlugin(config.PLUGIN_NAME.encode(), ctypes.byref(slot))
    return np.flatnonzero(view.plugin == slot.value).tolist()


def members(view: layout.ModelView) -> list[int]:
    """Those of them that are contacts; what is not configured at all is a sensor of all contacts."""
    return [
        number for number in instances(view)
        if any(LIBRARY.mj_getPluginConfig(view.address, number, key.encode()) for key in config.KEYS)
    ]  # fmt: skip


class Member:
    """What a compiled model says of one plugin instance."""

    def __init__(self, view: layout.ModelView, number: int) -> None:
        self.view = view
        self.number = number
        self.contact = contact_of(view.address, number)
        self._ids = self._geoms()
        self.geoms = list(dict.fromkeys(self._ids[0] + self._ids[1]))
        if self.contact.native and len(self.contact.native) != len(self.geoms):
            raise ValueError(f"native: tells of {len(self.contact.native)} geoms; must tell of all {len(self.geoms)}")
        self.native: dict[int, Bits] = dict(zip(self.geoms, self.contact.native, strict=False))

    def _geoms(self) -> list[list[int]]:
        """Ids of geoms.

        Attaching a model to another puts a prefix and suffix to all its names, the instance's too. Only what a body
        refers to is attached; the geoms are those whose names have some beginning and end of the instance's own, the
        shortest, that leads to a geom of such a body.
        """
        view, texts = self.view, {"geom1": self.contact.geoms1[0], "geom2": self.contact.geoms2[0]}
        own = (LIBRARY.mj_id2name(view.address, _PLUGIN, self.number) or b"").decode()
        owner = view.geom_bodyid
        refer = set(np.flatnonzero(view.body_plugin == self.number).tolist())
        plain = [self._named(text, "", "") for text in texts.values()]
        if all(plain) and (not refer or any(int(owner[geom]) in refer for ids in plain for geom in ids)):
            return plain
        for start, end in _affixes(own) if refer else ():
            found = [self._named(text, start, end) for text in texts.values()]
            if all(found) and any(int(owner[geom]) in refer for ids in found for geom in ids):
                return found
        for (key, text), ids in zip(texts.items(), plain, strict=True):
            if not ids:
                raise ValueError(
                    f"{key} = {text!r}: must be the name of a geom of the model, or names with spaces between"
                )
        return plain

    def _named(self, text: str, start: str, end: str) -> list[int]:
        """Ids of the geoms of such names; none, if one of them there is not."""
        out = []
        for name in dict.fromkeys((text,)) if self._id(start + text + end) >= 0 else config.split(text):
            out.append(self._id(start + name + end))
            if out[-1] < 0:
                return []
        return out

    def _id(self, name: str) -> int:
        return LIBRARY.mj_name2id(self.view.address, _GEOM, name.encode())

    @cached_property
    def product(self) -> Sets:
        """The geoms that are named: each of the first with each of the second."""
        ones, twos = self._ids
        if len(ones) == len(twos) == 1 and ones == twos:
            raise ValueError(f"geom2 = {' '.join(self.contact.geoms2)!r}: must be another geom than geom1")
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
        address, sizes, types = self.view.address, self.view.geom_size, self.view.geom_type

        def name(geom: int) -> str:
            return (LIBRARY.mj_id2name(address, _GEOM, geom) or b"").decode()

        return {geom: Shape(name(geom), int(types[geom]), sizes[geom].copy()) for geom in self.geoms}


def check(view: layout.ModelView, known: list[Member], moves: Callable[[int], bool]) -> None:
    """Each pair belongs to one instance, can move, and has no contact by the engine itself.

    moves: whether a geom does.

    Raises:
        ValueError: Not so; the message names the geoms.
    """
    native = _Native(view)
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
        for shape in shapes.values():
            check_measurable(shape)
        for one, two in member.sets.by_kinds(lambda geom: shapes[geom].kind):  # noqa: B023  (used at once)
            check_served(shapes[one], shapes[two])
        on = native.example(member.sets)
        if on:
            one, two = (shapes[geom] for geom in on)
            margin, gap = native_margin(one, two)
            raise ValueError(
                f"{_names(shapes, on)}: the engine's own contact of this pair is on; turn it off by <contact><pair "
                f'geom1="{one.name}" geom2="{two.name}" margin="{margin!r}" gap="{gap:g}"/></contact>'
            )


def _affixes(name: str) -> Iterator[tuple[str, str]]:
    """Beginnings and ends of a name, the shortest first."""
    for length in range(1, len(name)):
        yield from ((name[:first], name[len(name) - length + first :]) for first in range(length, -1, -1))


def _names(shapes: dict[int, Shape], pair: tuple[int, int]) -> str:
    return f"geom1 = {shapes[pair[0]].name!r}, geom2 = {shapes[pair[1]].name!r}"


class _Native:
    """Which contacts the engine itself makes."""

    def __init__(self, view: layout.ModelView) -> None:
        self._bodies = view.geom_bodyid.tolist()
        self._contype, self._affinity = view.geom_contype.tolist(), view.geom_conaffinity.tolist()
        self._margins: dict[tuple[int, int], float] = {}
        for one, two, margin in explicit_pairs(view):
            key = min(one, two), max(one, two)
            self._margins[key] = max(margin, self._margins.get(key, -inf))
        self._excluded = set(view.exclude_signature.tolist())

    def example(self, sets: Sets) -> tuple[int, int] | None:
        """Two geoms of sets that touch by the engine's own contact; None: there are none."""
        for (one, two), margin in self._margins.items():
            if margin >= 0.0 and sets.hold(one, two):
                return (two, one) if sets.reversed(one, two) else (one, two)
        if not any(touch(self._bits(one), self._bits(two)) for one, two in sets.by_kinds(self._bits)):
            return None
        return next((pair for pair in sets.every() if self._is_on(*pair)), None)

    def _bits(self, geom: int) -> tuple[int, int]:
        return self._contype[geom], self._affinity[geom]

    def _is_on(self, one: int, two: int) -> bool:
        """Whether the bits of two geoms let them touch, and nothing else forbids it."""
        low, high = sorted((self._bodies[one], self._bodies[two]))
        off = (min(one, two), max(one, two)) in self._margins or (low << 16) + high in self._excluded
        return not off and touch(self._bits(one), self._bits(two))
