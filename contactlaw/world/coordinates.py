"""The coordinates of trees from Python, and the functions that move them."""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_uint64
from functools import lru_cache

from contactlaw.jit import address_of
from contactlaw.world import tree_motion, trees
from contactlaw.world.call import MOBILITY, WITH_BODY, WITH_NUMBER, WITH_VECTORS
from contactlaw.world.records import Array, Arrays, numbers_of


@lru_cache
def addresses() -> dict[str, int]:
    """Where these functions stand, compiled, by their names in `records.TREE`."""
    return {
        "fly": address_of(tree_motion.fly, WITH_NUMBER), "drift": address_of(tree_motion.drift, WITH_NUMBER),
        "settle": address_of(trees.settle, WITH_BODY), "kick": address_of(trees.kick, WITH_VECTORS),
        "mobility": address_of(trees.mobility, MOBILITY), "spread": address_of(trees.spread, WITH_BODY),
    }  # fmt: skip


def numbers(world: Arrays, number: int, name: str) -> Array:
    """Those that a tree keeps by a name, a view."""
    tree = world.trees[number]
    sizes = numbers_of(tree)
    names = list(sizes)
    first = int(tree["numbers"]) + sum(sizes[one] for one in names[: names.index(name)])
    return world.joints[first : first + sizes[name]]


def coordinates(world: Arrays, number: int) -> tuple[Array, Array]:
    """Coordinates and velocities of a tree."""
    return numbers(world, number, "q").copy(), numbers(world, number, "v").copy()


def write_coordinates(world: Arrays, number: int, q: Array, v: Array) -> None:
    """Put a tree somewhere: new are its coordinates, its velocities and all that follows from them."""
    for name, value in (("q", q), ("v", v)):
        own = numbers(world, number, name)
        if value.shape != own.shape:
            raise ValueError(f"{name}: shape {value.shape}; must be {own.shape}")
        own[:] = value
    tree = world.trees[number]
    tree["stale"] = 1
    CFUNCTYPE(None, c_uint64)(int(tree["settle"]))(int(tree["bodies"]))
