"""Who may touch whom, of two sets of bodies."""

from __future__ import annotations

from collections.abc import Mapping

import pybullet as p

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.contact import Contact, Couple
from contactlaw.pybullet_callback.shapes import Side, check_radius, check_served, coordinates

PARENT = 16  # of what getJointInfo tells


def couples_of(
    client: int, a: list[Side], b: list[Side], pair: ContactPair, others: Mapping[int, Contact]
) -> list[Couple]:
    """Who of two sets may touch whom: every one of A with every one of B, each two once, but no link with its parent.

    Raises:
        ValueError: Two that others, contacts by handle, have already; no two at all; shapes that the law cannot serve,
            or that have no radius.
    """
    single = len(a) == 1 and len(b) == 1
    known = {
        frozenset((couple.a.key, couple.b.key)): (handle, couple)
        for handle, contact in others.items()
        for couple in contact.couples
    }
    bodies = {side.body for side in (*a, *b)}
    linked = {body for body in bodies if p.getNumJoints(body, client) > 0}
    fixed = {body for body in bodies if not coordinates(client, body)}
    free = bodies - fixed - linked
    couples: dict[frozenset, Couple] = {}
    for one in a:
        for two in b:
            two_keys = frozenset((one.key, two.key))
            if one.key == two.key and single:
                raise ValueError(f"body_b = {two.body}, link_b = {two.link}: the same as a; a contact needs two")
            if one.key == two.key or two_keys in couples or (not single and related(client, one, two)):
                continue
            if one.body in fixed and two.body in fixed:
                if single:
                    raise ValueError(f"body_a, body_b = {one}, {two}: neither can move; one must")
                continue
            if two_keys in known:
                handle, couple = known[two_keys]
                raise ValueError(f"body_a, body_b = {one}, {two}: {couple} have contact {handle} already")
            check_served(one, two, one.body in free or two.body in free)
            check_radius(pair, one, two)
            couples[two_keys] = Couple(one, two)
    if not couples:
        raise ValueError("body_a, body_b: no two of them can touch; a contact needs two bodies, one that can move")
    return list(couples.values())


def related(client: int, one: Side, two: Side) -> bool:
    """Whether two links are parent and child, which overlap at their joint and which Bullet lets overlap."""
    if one.body != two.body:
        return False
    return any(
        p.getJointInfo(child.body, child.link, client)[PARENT] == parent.link
        for child, parent in ((one, two), (two, one))
        if child.link >= 0
    )
