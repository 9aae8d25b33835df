"""The contacts of a compiled model: what each plugin instance is configured for, and whether it can be served."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cached_property
from math import inf

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.shapes import Shape, check_measurable, check_served, effective_radius, native_margin

LIBRARY = layout.library()
LIBRARY.mj_getPluginConfig.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
LIBRARY.mj_getPluginConfig.restype = ctypes.c_char_p
LIBRARY.mj_name2id.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
LIBRARY.mj_id2name.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int]
LIBRARY.mj_id2name.restype = ctypes.c_char_p
LIBRARY.mjp_getPlugin.argtypes = [ctypes.c_char_p, ctypes.POINTER(ctypes.c_int)]
LIBRARY.mjp_getPlugin.restype = ctypes.c_void_p


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


def check(
    view: layout.ModelView, known: list[Member], moves: Callable[[int], bool], is_free: Callable[[int], bool]
) -> None:
    """Each pair belongs to one instance, can move, and has no contact by the engine itself.

    moves, is_free: whether a geom does, and whether it does so with a free joint.

    Raises:
        ValueError: Not so; the message names the geoms.
    """
    seen: set[tuple[int, int]] = set()
    native = _Native(view)
    for member in known:
        moving = False
        for one, two in member.pairs:
            shapes = member.shapes[one], member.shapes[two]
            names = f"geom1 = {shapes[0].name!r}, geom2 = {shapes[1].name!r}"
            if (min(one, two), max(one, two)) in seen:
                raise ValueError(f"{names}: this pair has been added before")
            seen.add((min(one, two), max(one, two)))
            for shape in shapes:
                check_measurable(shape)
            check_served(*shapes, is_free(one) or is_free(two))
            effective_radius(*shapes, member.contact.pair.radius)
            moving = moving or moves(one) or moves(two)
            if native.is_on(one, two):
                raise ValueError(
                    f"{names}: the engine's own contact of this pair is on; turn it off by <contact><pair "
                    f'geom1="{shapes[0].name}" geom2="{shapes[1].name}" margin="{-native_margin(*shapes):g}"/>'
                    "</contact>"
                )
        if not moving:
            raise ValueError("geom1, geom2: none of these geoms can move")


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
