"""The arrays of a world: created empty, and extended as bodies, shapes and contacts are added."""

from collections.abc import Callable
from math import comb
from typing import Any

import numpy as np

from contactlaw.laws.record import PAIR as LAW
from contactlaw.laws.record import PAIR_SIZE
from contactlaw.world.data import kinds
from contactlaw.world.data.records import EDITED, FREE, RECORDS, SCRATCH, WORLD, Array, Arrays
from contactlaw.world.data.tree import numbers_of
from contactlaw.world.implicit.equations import room_for
from contactlaw.world.shapes.functions import write_addresses
from contactlaw.world.shapes.hulls import by_direction
from contactlaw.world.trees.tree_records import addresses

FAR = 1e3  # [m] reach of a plane on a moving body
RECORDED, NONE = set(RECORDS["shapes"].names or ()), np.zeros((0, 3))  # fields of shapes; no vertices
CENTRED = 1e-9  # share of a body's reach, and of unity, by which rounding may put an axis beside that of its shapes
LEAST = 64  # room for near pairs and contacts at the start
# arrays of which a saved state has all, or as many rows as are in use, which `WORLD` says by these names
MOVING = ("bodies", "shapes", "pairs", "trees", "joints", "near_bodies", "world")
USED = {"near": "nears", "guards": "guard_count", "spare": "spares"}
NEAR_PAIRS = 40  # room in the list of near pairs for each round shape, if that is less than for all that can meet


def empty() -> Arrays:
    """Return the arrays of a world with no body but the world itself."""
    made = Arrays(*(np.zeros(0, RECORDS.get(name, np.float64)) for name in Arrays._fields))
    made = made._replace(memory=np.zeros((0, 0)), points=NONE, groups=np.full((1, 1), -1), world=np.zeros(1, WORLD))
    made.world["stale"] = made.world["together"] = 1
    axes = {"quaternion": (1.0, 0.0, 0.0, 0.0), "axes": np.eye(3).ravel(), "isotropic": 1}
    return with_space(with_bodies(made, [axes | {"oriented": 1}]), LEAST, LEAST, LEAST)  # planes are off its origin


def with_space(
    one: Arrays, near: int, guards: int, contacts: int, zeros: Callable[[Any, Any], Array] = np.zeros
) -> Arrays:
    """Return the world with empty arrays for so many near pairs, guards and contacts; zeros: makes them."""
    one.world["spares"] = contacts
    rooms = dict.fromkeys(("near", "rows"), near) | {"guards": guards}
    rooms |= dict.fromkeys(("contacts", "coasting", "saved_contacts"), contacts)
    memory = contacts, one.memory.shape[1]
    return one._replace(
        **{name: zeros(room, RECORDS[name]) for name, room in rooms.items()}, island_pairs=zeros(2 * near, np.int64),
        spare=np.arange(contacts)[::-1].copy(), memory=zeros(memory, float), saved_memory=zeros(memory, float),
    )  # fmt: skip


def longer(array: Array, count: int) -> Array:
    """Return an array with `count` rows of zeros appended."""
    return np.concatenate([array, np.zeros((count, *array.shape[1:]), array.dtype)])


def with_rows(array: Array, rows: list[dict[str, Any]]) -> Array:
    """Return an array of records with more records appended, given field by field."""
    if not rows:
        return array
    first = len(array)
    array = longer(array, len(rows))
    for name in dict.fromkeys(name for fields in rows for name in fields):
        own = [i for i, fields in enumerate(rows) if name in fields]
        array[name][first + np.array(own)] = np.array([rows[i][name] for i in own])
    return array


def with_bodies(one: Arrays, rows: list[dict[str, Any]]) -> Arrays:
    """Return the world with more bodies."""
    bodies = with_rows(one.bodies, rows)
    room = np.zeros(bodies.size, np.int64)
    return one._replace(
        bodies=bodies, near_bodies=room, roots=room.copy(), island_bodies=room.copy(),
        saved_bodies=np.zeros(bodies.size + SCRATCH, bodies.dtype), equations=np.zeros(room_for(6 * (bodies.size - 1))),
    )  # fmt: skip


def with_tree(one: Arrays, fields: dict[str, Any]) -> Arrays:
    """Return the world with one more tree, whose bodies it has already; fields: of `tree.TREE`."""
    trees = with_rows(one.trees, [addresses() | fields])
    tree = trees[-1]
    tree["numbers"] = one.joints.size
    own = slice(int(tree["first"]), int(tree["first"] + tree["count"]))
    one.bodies["member"][own] = np.arange(tree["count"])
    one.bodies["oriented"][own] = 1
    return one._replace(trees=trees, joints=longer(one.joints, sum(numbers_of(tree).values())))


def with_shapes(one: Arrays, rows: list[dict[str, Any]]) -> Arrays:
    """Return the world with more shapes; updates `reach`, `size` and `oriented` of their bodies."""
    points, records, known = one.points, [], NONE
    for fields in rows:
        table = by_direction(fields["vertices"]) if "vertices" in fields else fields.get("heights", NONE)
        if len(table) and table is not known:  # the shapes of one height field share theirs
            known, points = table, np.concatenate([points, table])
        place = {"first": len(points) - len(table)} if len(table) else {}
        records.append({name: value for name, value in fields.items() if name in RECORDED} | place)
    shapes = with_rows(one.shapes, records)
    new, bodies = shapes[-len(rows) :], one.bodies
    write_addresses(new)
    flat = new["kind"] >= kinds.PLANE
    far = np.linalg.norm(new["at"], axis=1) + np.linalg.norm(new["half"], axis=1)
    reach = np.where(new["kind"] == kinds.TANGENT, new["radius"], far)
    reach[flat & (new["kind"] != kinds.TANGENT)] = FAR
    solid = np.isin(new["kind"], (kinds.ELLIPSOID, kinds.BOX, kinds.CYLINDER))
    least = np.where(solid, new["half"].min(1), np.where(flat, np.inf, new["radius"]))
    np.bitwise_or.at(bodies["oriented"], new["body"], (reach > 0.0).astype(np.int64))
    on_body = new["body"] != 0
    np.maximum.at(bodies["reach"], new["body"][on_body], reach[on_body])
    sizes = np.where(bodies["size"] > 0.0, bodies["size"], np.inf)
    np.minimum.at(sizes, new["body"][on_body], least[on_body])
    bodies["size"] = np.where(sizes < np.inf, sizes, 0.0)
    set_round(bodies, shapes[~np.isin(shapes["kind"], kinds.PARTS)])
    one.world["stale"] = 1
    return one._replace(shapes=shapes, points=points, sweep=np.zeros(7 * shapes.size, np.int64))


def set_round(bodies: Array, whole: Array) -> None:
    """Set the axes about which bodies are round, from all whole shapes."""
    long, body = np.isin(whole["kind"], (kinds.CYLINDER, kinds.SEGMENT)), whole["body"]
    axes = np.where((whole["kind"] == kinds.CYLINDER)[:, None], whole["axes"].reshape(-1, 9)[:, 2::3], whole["half"])
    axes /= np.maximum(np.linalg.norm(axes, axis=1), 1e-300)[:, None]
    bodies["round"][body[long]] = axes[long]
    off = np.linalg.norm(np.cross(whole["at"], bodies["round"][body]), axis=1) > CENTRED * bodies["reach"][body]
    off |= long & (np.abs((axes * bodies["round"][body]).sum(1)) < 1.0 - CENTRED)
    bodies["round"][body[off | ~(long | np.isin(whole["kind"], (kinds.SPHERE, kinds.END)))]] = 0.0


def with_pair(one: Arrays, radius: float, numbers: Array, size: int) -> Arrays:
    """Return the world with one more pair of materials.

    radius: see `records.PAIR`. numbers: from `ContactPair.parameters`. size: length of the history that its law keeps.
    """
    pairs = longer(one.pairs, 1)
    pairs["radius"][-1], pairs["numbers"][-1] = radius, one.numbers.size
    pairs["friction"][-1] = numbers[:PAIR_SIZE].view(LAW)["friction"][0]
    more = max(size - one.memory.shape[1], 0)
    memory = np.pad(one.memory, ((0, 0), (0, more)))
    return one._replace(
        pairs=pairs, numbers=np.concatenate([one.numbers, numbers]), memory=memory, saved_memory=memory.copy()
    )


def with_room(one: Arrays, owners: Array) -> Arrays:
    """Return a world that has not been stepped with room for near pairs and contacts; takes no memory yet.

    owners: of each shape: its own number, or that of the shape that it is a part of.
    """
    sorts, counts = np.unique(one.shapes[["kind", "group"]], return_counts=True)
    a, b = np.meshgrid(np.arange(sorts.size), np.arange(sorts.size), indexing="ij")
    meet = np.array(kinds.MEETS)[sorts["kind"][a]] >> sorts["kind"][b] & 1 != 0
    meet &= one.groups[sorts["group"][a], sorts["group"][b]] >= 0
    pairs = int((counts[a] * (counts[b] - (a == b)))[meet].sum())
    # the parts of a hull are unknown while an engine's model is compiled, and the room must be the same later
    parts = (one.shapes["kind"][owners] == kinds.HULL) & (one.shapes["kind"] != kinds.HULL)
    rooms = [kinds.NEIGHBOURS[kind] for kind in one.shapes["kind"][~parts].tolist() if kind in kinds.NEIGHBOURS]
    contacts = sum(rooms) if parts.any() else max(min(pairs, sum(rooms)), 1)
    near = max(min(pairs, NEAR_PAIRS * (len(rooms) + int(parts.sum()))), 1)
    guards = min(near, comb(len(np.unique(owners)), 2)) if one.shapes["predict"].any() else 1
    return with_space(one, near, guards, contacts, lambda shape, kind: np.broadcast_to(np.zeros((), kind), shape))


def with_more_room(one: Arrays) -> Arrays:
    """Return the world with twice the room for near pairs and contacts."""
    more, spares = one.contacts.size, int(one.world["spares"][0])
    made = with_space(one, 2 * one.near.size, 2 * one.guards.size, 2 * more)
    for name in ("near", "guards", "contacts", "memory"):
        getattr(made, name)[: len(getattr(one, name))] = getattr(one, name)
    made.spare[: more + spares] = [*range(2 * more - 1, more - 1, -1), *one.spare[:spares]]
    made.world["spares"] = more + spares
    made.world["lost"] = made.world["left_out"] = 0
    made.world["stale"] = 1
    return made


def with_own_code(one: Arrays, numbers: Array) -> Arrays:
    """Return a world whose records name the functions of this process; numbers: parameters of its laws, made in it."""
    write_addresses(one.shapes)
    for name, place in addresses().items() if one.trees.size else ():
        one.trees[name] = place
    return one._replace(numbers=numbers)


def kept(one: Arrays) -> Arrays:
    """Return a copy of what moves in a world, rows in use alone, without what it is built of or works in."""
    state, slots = one.bound().world[0], np.flatnonzero(one.contacts["phase"] != FREE)
    used = {name: int(state[count]) for name, count in USED.items()} | dict.fromkeys(MOVING)
    used["contacts"] = used["memory"] = int(slots[-1]) + 1 if slots.size else 0
    return Arrays(*(array[: used.get(name, 0)].copy() for name, array in one._asdict().items()))


def restored(saved: Arrays, own: Arrays) -> Arrays:
    """Return a world built as `own`, in the state that `kept` returned, perhaps in another process."""
    if any(getattr(saved, name).shape != getattr(own, name).shape for name in MOVING) or (
        saved.memory.shape[1] != own.memory.shape[1]
    ):
        raise ValueError("saved: is of another world, or bodies, shapes or contacts have been added since")
    made = with_space(own, *saved.world[["near_room", "guard_room", "contact_room"]][0].tolist())
    made = made._replace(**{name: getattr(saved, name).copy() for name in MOVING})
    for name in ("contacts", "memory", *USED):
        getattr(made, name)[: len(getattr(saved, name))] = getattr(saved, name)
    for name in ("radius", "numbers", "relaxed", "friction"):
        made.pairs[name] = own.pairs[name]
    return with_own_code(made, own.numbers)


def with_contacts_of(one: Arrays, old: Arrays, shapes: dict[int, int], pairs: dict[int, int]) -> Arrays:
    """Return a world with the contacts of an older one; what slept in others wakes, as it may have lain on them.

    Where shapes have another pair of materials now, their contact begins anew with the overlap that is there.
    shapes, pairs: numbers of the shapes and of the pairs of materials that are in both, by the old.
    """
    for slot in np.flatnonzero(old.contacts["phase"] != FREE):
        c = old.contacts[slot]
        a, b = shapes.get(int(c["shape_a"])), shapes.get(int(c["shape_b"]))
        pair = -1 if a is None or b is None else one.groups[one.shapes["group"][a], one.shapes["group"][b]]
        if pair < 0 or pair != pairs.get(int(c["pair"])):
            if pair >= 0:
                one.world["edited"] = EDITED
            one.bodies["held"][[one.shapes["body"][shape] for shape in (a, b) if shape is not None]] = np.nan
            continue
        one = with_more_room(one) if one.world["spares"][0] == 0 else one
        one.world["spares"] -= 1
        new = int(one.spare[one.world["spares"][0]])
        one.world["slots"] = max(one.world["slots"][0], new + 1)
        own, size = one.contacts[new : new + 1], min(one.memory.shape[1], old.memory.shape[1])
        own[0], own["pair"], own["near"] = c, pair, -1
        for side, shape in (("a", a), ("b", b)):
            own[f"shape_{side}"], own[f"body_{side}"] = shape, one.shapes["body"][shape]
        one.memory[new, :size] = old.memory[slot, :size]
    one.world["stale"] = 1
    return one
