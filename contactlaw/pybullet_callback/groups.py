"""Collision groups in place of rules a pair, for sets of thousands: they cost one call a body.

Bodies that are members of the same sets form a class, and each class has a group of its own. The mask of a class leaves
out the classes that its contacts hold, so that Bullet's own response is off for just these pairs.
"""

from collections.abc import Iterable

import pybullet as p

from contactlaw.pybullet_callback.contact import Contact
from contactlaw.pybullet_callback.shapes import Key

HIGHEST, MOST = 30, 25  # bit of the first group, and number of groups above the six lowest bits, which Bullet names
DEFAULT, STATIC, ALL = 1, 2, -1  # Bullet's groups of bodies that move and of others; all groups
Class = tuple[bool, frozenset[tuple[int, int]]]  # whether it cannot move; numbers of contacts and of their sets


def classes_of(contacts: list[Contact]) -> dict[Key, Class]:
    """Return the class of each member of contacts, by body and link."""
    fixed = set[int]().union(*(one.fixed for one in contacts))
    member: dict[Key, set[tuple[int, int]]] = {}
    for number, contact in enumerate(contacts):
        for side, keys in enumerate((contact.sets.ones, contact.sets.twos)):
            for key in keys:
                member.setdefault(key, set()).add((number, side))
    return {key: (key[0] in fixed, frozenset(where)) for key, where in member.items()}


def set_groups(client: int, contacts: list[Contact], left: Iterable[Key] = ()) -> None:
    """Set groups and masks of all members of contacts, and Bullet's own ones of those that have `left`.

    Raises:
        ValueError: There are more classes than groups; nothing has been changed.
    """
    classes = classes_of(contacts)
    if len(set(classes.values())) > MOST:
        raise ValueError(
            f"groups: bodies of the contacts with groups are members of {len(set(classes.values()))} different "
            f"combinations of sets, and PyBullet has {MOST} groups to spare; pass groups=False for small sets"
        )
    bits = {one: 1 << (HIGHEST - i) for i, one in enumerate(dict.fromkeys(classes.values()))}
    masks = {one: ~sum(bit for two, bit in bits.items() if _apart(one, two)) for one in bits}
    for key in left:
        fixed = p.getDynamicsInfo(*key, client)[0] == 0.0
        p.setCollisionFilterGroupMask(*key, *((STATIC, ~STATIC) if fixed else (DEFAULT, ALL)), client)
    for key, one in classes.items():
        p.setCollisionFilterGroupMask(*key, bits[one], masks[one] & (~STATIC if one[0] else ALL), client)


def _apart(one: Class, two: Class) -> bool:
    """Return whether Bullet's own response is off between two classes: a contact holds them, or neither can move."""
    return (one[0] and two[0]) or any((number, 1 - side) in two[1] for number, side in one[1])
