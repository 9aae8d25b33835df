"""Who may touch whom, of two sets of bodies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import pybullet as p

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.contact import Contact
from contactlaw.pybullet_callback.shapes import BASE, Key, Side, can_move, check_radius, check_served
from contactlaw.world.sets import Sets

PARENT = 16  # of what getJointInfo tells


def sets_of(
    client: int, a: list[Side], b: list[Side], pair: ContactPair, others: Iterable[tuple[str, Contact]]
) -> Sets:
    """Who of two sets may touch whom: every one of A with every one of B, each two once, but no link with its parent.

    Raises:
        ValueError: Two that others, contacts by what to call them, have already; no two at all; shapes that the law
            cannot serve, or that have no radius.
    """
    sides = {side.key: side for side in (*a, *b)}
    bodies, single = {side.body for side in sides.values()}, len(a) == 1 and len(b) == 1
    fixed = {body for body in bodies if not can_move(client, body)}
    free = {body for body in bodies - fixed if p.getNumJoints(body, client) == 0}
    if single and a[0].key == b[0].key:
        raise ValueError(f"body_b = {b[0].body}, link_b = {b[0].link}: the same as a; a contact needs two")
    if single and bodies <= fixed:
        raise ValueError(f"body_a, body_b = {a[0]}, {b[0]}: neither can move; one must")
    parents = {} if single else parents_of(client, sides)

    def allow(one: Key, two: Key) -> bool:
        return not (one[0] in fixed and two[0] in fixed) and parents.get(one) != two and parents.get(two) != one

    sets = Sets([side.key for side in a], [side.key for side in b], lambda key: key).among(allow)
    for name, other in others:
        twice = sets.common(other.sets)
        if twice:
            one, two = (sides[key] for key in twice)
            raise ValueError(f"body_a, body_b = {one}, {two}: they have {name} already")
    kinds = list(sets.by_kinds(lambda key: (sides[key].shape, key[0] in free, key[0] in fixed)))
    for first, second in kinds:
        one, two = sides[first], sides[second]
        check_served(one, two, one.body in free or two.body in free)
        check_radius(pair, one, two)
    if not kinds:
        raise ValueError("body_a, body_b: no two of them can touch; a contact needs two bodies, one that can move")
    return sets


def parents_of(client: int, sides: Mapping[Key, Side]) -> dict[Key, Key]:
    """Of each link the one before it, which it overlaps at their joint and which Bullet lets it overlap."""
    return {
        (body, link): (body, p.getJointInfo(body, link, client)[PARENT]) for body, link in sides if link != BASE
    }  # fmt: skip
