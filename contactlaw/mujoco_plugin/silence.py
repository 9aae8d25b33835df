"""The engine's own contacts of two sets of geoms are turned off, all others stay.

Two geoms touch natively if the `contype` of one has a bit in common with the `conaffinity` of the other. A geom without
the former touches all that have one, a geom without the latter all that have the other, but neither its like: one of
the two is taken from all of a set at once, where this turns nothing else off. What is left, and few contacts in any
case, gets an explicit pair each, with a margin so negative that the engine never makes it.
"""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import Any

import mujoco

from contactlaw.mujoco_plugin.native import Bits, touch
from contactlaw.mujoco_plugin.shapes import native_margin, shape_of
from contactlaw.world.sets import Sets, groups

FEW = 256  # pairs that are written down one by one


def silence(spec: mujoco.MjSpec, geoms: list[Any], sets: Sets) -> None:
    """Turn the native contacts of two sets of geoms off, which have names; geoms: all of the specification."""
    known = {geom.name: geom for geom in geoms if geom.name}
    for native in list(spec.pairs):
        ends = native.geomname1, native.geomname2
        if all(name in known for name in ends) and sets.hold(*(known[name] for name in ends)):
            spec.delete(native)
    if len(sets.ones) * len(sets.twos) > FEW:
        _take_bits(spec.worldbody, geoms, sets)
        if not any(touch(_bits(one), _bits(two)) for one, two in sets.by_kinds(_bits)):
            return
    for one, two in sets.every():
        margin = native_margin(shape_of(one), shape_of(two))
        spec.add_pair(geomname1=one.name, geomname2=two.name, margin=-margin, gap=0.0)


def _bits(geom: Any) -> Bits:
    return geom.contype, geom.conaffinity


def _take_bits(world: Any, every: list[Any], sets: Sets) -> None:
    ones, twos = set(sets.ones), set(sets.twos)
    alike = groups(every, lambda geom: (_bits(geom), geom in ones, geom in twos, geom.parent == world))
    bits = {kind: kind[0] for kind in alike}

    def wanted(one: Any, two: Any) -> bool:
        """Whether geoms of two kinds touch natively and are to do so further."""
        ours = (one[1] and two[2]) or (two[1] and one[2])
        alone = one == two and len(alike[one]) == 1
        return not ours and not alone and not (one[3] and two[3]) and touch(one[0], two[0])

    kept = [pair for pair in combinations_with_replacement(alike, 2) if wanted(*pair)]
    for kind, geoms in alike.items():
        (contype, conaffinity), first, second, _ = kind
        for taken in ((0, conaffinity), (contype, 0)):
            tried = bits | {kind: taken}
            if (first or second) and any(taken) and all(touch(tried[one], tried[two]) for one, two in kept):
                bits = tried
                for geom in geoms:
                    geom.contype, geom.conaffinity = taken
                break
