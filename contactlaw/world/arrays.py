"""The arrays of a world: made empty, and made longer when bodies, shapes or contacts come to it."""

from __future__ import annotations

from typing import Any

import numpy as np

from contactlaw.world.records import BODY, CONTACT, NEAR, PAIR, SHAPE, STATE, Array, Arrays

LEAST = 64  # near pairs and contacts that there is room for from the start


def empty(nodes: Array) -> Arrays:
    """A world without bodies but itself; nodes: of its law, shape (2, count)."""
    world = Arrays(
        bodies=np.zeros(1, BODY), shapes=np.zeros(0, SHAPE), pairs=np.zeros(0, PAIR), near=np.zeros(LEAST, NEAR),
        contacts=np.zeros(LEAST, CONTACT), memory=np.zeros((LEAST, 2, nodes.shape[1])), nodes=nodes,
        groups=np.full((1, 1), -1), spare=np.arange(LEAST)[::-1].copy(), roots=np.zeros(1, np.int64),
        own=np.zeros(1, np.int64), mine=np.zeros(LEAST, np.int64), grid=np.zeros(4, np.int64), state=np.zeros(1, STATE),
    )  # fmt: skip
    body = world.bodies[0]
    body["quaternion"][0] = 1.0
    body["axes"] = np.eye(3).ravel()
    body["isotropic"] = 1
    body["oriented"] = 1  # planes of the world have places
    world.state["spares"] = LEAST
    world.state["stale"] = 1
    return world


def longer(array: Array, count: int) -> Array:
    """The array with so many rows of zeros behind it."""
    return np.concatenate([array, np.zeros((count, *array.shape[1:]), array.dtype)])


def with_body(world: Arrays, **fields: Any) -> Arrays:
    """The world and one more body."""
    bodies = longer(world.bodies, 1)
    for name, value in fields.items():
        bodies[name][-1] = value
    room = np.zeros(bodies.size, np.int64)
    return world._replace(bodies=bodies, roots=room, own=room.copy())


def with_shape(world: Arrays, **fields: Any) -> Arrays:
    """The world and one more shape."""
    shapes = longer(world.shapes, 1)
    for name, value in fields.items():
        shapes[name][-1] = value
    cells = 1 << int(np.ceil(np.log2(2 * shapes.size + 1)))
    world.state["stale"] = 1
    return world._replace(shapes=shapes, grid=np.zeros(cells + 3 * shapes.size, np.int64))


def with_more_room(world: Arrays) -> Arrays:
    """The world with room for twice as many near pairs and contacts."""
    more = world.contacts.size
    spares = int(world.state["spares"][0])
    new = np.arange(2 * more - 1, more - 1, -1)
    world.state["spares"] += more
    world.state["lost"] = 0
    world.state["stale"] = 1
    return world._replace(
        near=longer(world.near, world.near.size), mine=np.zeros(2 * world.near.size, np.int64),
        contacts=longer(world.contacts, more), memory=longer(world.memory, more),
        spare=np.concatenate([new, world.spare[:spares], np.zeros(more - spares, np.int64)]),
    )  # fmt: skip
