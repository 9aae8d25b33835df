"""Who may touch whom, of two sets of bodies."""

from __future__ import annotations

from collections.abc import Mapping

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.bodies import Bodies
from contactlaw.pybullet_callback.contact import Contact, Couple
from contactlaw.pybullet_callback.shapes import BASE, Side, effective_radius


def couples_of(
    client: int, a: list[Side], b: list[Side], pair: ContactPair, others: Mapping[int, Contact]
) -> list[Couple]:
    """Who of two sets may touch whom: every one of A with every one of B, each two once.

    Raises:
        ValueError: Two that others, contacts by handle, have already; no two at all; no radius to be had.
    """
    single = len(a) == 1 and len(b) == 1
    known = {
        frozenset((couple.a.key, couple.b.key)): (handle, couple)
        for handle, contact in others.items()
        for couple in contact.couples
    }
    fixed = {body for body in {side.body for side in (*a, *b)} if Bodies(client, [(body, BASE)]).is_fixed(body)}
    couples: dict[frozenset, Couple] = {}
    for one in a:
        for two in b:
            two_keys = frozenset((one.key, two.key))
            if one.key == two.key and single:
                raise ValueError(f"body_b = {two.body}, link_b = {two.link}: the same as a; a contact needs two")
            if one.key == two.key or two_keys in couples:
                continue
            radius = effective_radius(pair, one, two) if single else 0.0
            if one.body in fixed and two.body in fixed:
                if single:
                    raise ValueError(f"body_a, body_b = {one}, {two}: neither can move; one must")
                continue
            if two_keys in known:
                handle, couple = known[two_keys]
                raise ValueError(f"body_a, body_b = {one}, {two}: {couple} have contact {handle} already")
            couples[two_keys] = Couple(one, two, radius or effective_radius(pair, one, two))
    if not couples:
        raise ValueError("body_a, body_b: no two of them can touch; a contact needs two bodies, one that can move")
    return list(couples.values())
