"""Which contacts the engine makes by itself, and which of them it would make, had the law not taken them.

The engine's rules (MuJoCo documentation, Computation, "Collision detection", Selection): two geoms are tested if
`<contact><pair>` names them; else if the `contype` of one has a bit in common with the `conaffinity` of the other, and
their bodies are not excluded, nor both without a joint, nor parent and child, unless the parent is welded to the world.
Bodies that are welded together count as one.

The engine's own contacts of two sets of geoms are turned off, all others stay. A geom without the former touches all
that have one, a geom without the latter all that have the other, but neither its like: one of the two is taken from all
of a set at once, where this turns nothing else off. What is left, and few contacts in any case, gets an explicit pair
each, with a margin so negative that the engine never makes it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import mujoco

from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.shapes import native_margin, shape_of
from contactlaw.world.sets import Sets, groups

Bits = tuple[int, int]
FEW = 256  # pairs that are written down one by one
FILTER_PARENT = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)


def touch(one: Bits, two: Bits) -> bool:
    """Whether geoms with this contype and conaffinity touch natively."""
    return bool(one[0] & two[1] or two[0] & one[1])


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


class Rules:
    """Of geoms that may touch each other natively, those that do not; of two rules that fit, the later one holds.

    Args:
        view: The compiled model.
        bits: Contype and conaffinity that geoms had before the law took their contacts. What the engine still does with
            those that they have now is the engine's, and so are pairs of `<contact>` but for those with a negative
            margin, by which a contact is turned off.
    """

    def __init__(self, view: layout.ModelView, bits: Mapping[int, Bits]) -> None:
        contype, affinity, owner = view.geom_contype, view.geom_conaffinity, view.geom_bodyid
        weld, parent, tree = view.body_weldid, view.body_parentid, view.body_treeid
        known: list[tuple[Iterable[int], Iterable[int], bool]] = []
        kinds = groups(bits, lambda geom: (bits[geom], (int(contype[geom]), int(affinity[geom]))))
        for one, two in combinations_with_replacement(kinds, 2):
            if not touch(one[0], two[0]) or touch(one[1], two[1]):
                known.append((kinds[one], kinds[two], False))
        carried = groups(bits, lambda geom: int(weld[owner[geom]]))
        still = groups(bits, lambda geom: bool(tree[owner[geom]] < 0)).get(True, ())
        known += [(geoms, geoms, False) for geoms in (*carried.values(), still) if len(geoms) > 1]
        if not view.option("disableflags") & FILTER_PARENT:
            above = {body: int(weld[parent[body]]) for body in carried if body}
            known += [(carried[body], carried[up], False) for body, up in above.items() if up and up in carried]
        of_body = groups(bits, lambda geom: int(owner[geom]))
        for signature in view.exclude_signature.tolist():
            one, two = signature >> 16, signature & 0xFFFF
            if one in of_body and two in of_body:
                known.append((of_body[one], of_body[two], False))
        for one, two, margin in explicit_pairs(view):
            if one in bits and two in bits:
                known.append(([one], [two], margin < 0.0))
        self.known = [Rule(frozenset(ones), frozenset(twos), allowed) for ones, twos, allowed in known]

    def allow(self, one: int, two: int) -> bool:
        """Whether the law has the contact of two geoms."""
        return next((rule.allowed for rule in reversed(self.known) if rule.fits(one, two)), True)


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
        margin, gap = native_margin(shape_of(one), shape_of(two))
        spec.add_pair(geomname1=one.name, geomname2=two.name, margin=margin, gap=gap)


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
