"""The coordinates of trees from Python, and the functions that move them."""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_uint64
from functools import lru_cache

import numpy as np

from contactlaw.jit import address_of
from contactlaw.world import tree_dynamics, tree_kinematics, tree_lasting, tree_motion, trees
from contactlaw.world.call import MOBILITY, ON_TREE, WITH_BODY, WITH_NUMBER, WITH_VECTORS
from contactlaw.world.records import AXIS, LINK, Array, Arrays, numbers_of


@lru_cache
def addresses() -> dict[str, int]:
    """Where these functions stand, compiled, by their names in `records.TREE`."""
    return {
        "fly": address_of(tree_motion.fly, WITH_NUMBER), "drift": address_of(tree_motion.drift, WITH_NUMBER),
        "settle": address_of(trees.settle, WITH_BODY), "kick": address_of(trees.kick, WITH_VECTORS),
        "mobility": address_of(trees.mobility, MOBILITY), "spread": address_of(trees.spread, WITH_BODY),
        "press": address_of(trees.press, WITH_VECTORS), "rest": address_of(trees.rest, WITH_BODY),
        "stand": address_of(tree_lasting.stand, WITH_BODY), "weigh": address_of(tree_lasting.weigh, WITH_BODY),
        "resist": address_of(tree_lasting.resist, WITH_BODY), "carry": address_of(tree_lasting.carry, WITH_VECTORS),
        "move": address_of(tree_kinematics.move, ON_TREE), "accelerate": address_of(tree_dynamics.accelerate, ON_TREE),
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
    world.bodies["asleep"][int(tree["first"]) : int(tree["first"] + tree["count"])] = 0
    CFUNCTYPE(None, c_uint64)(int(tree["settle"]))(int(tree["bodies"]))


def mass_matrix(world: Arrays, number: int) -> Array:
    """Of a tree, at the coordinates that its accelerations were last found for; shape (v_size, v_size)."""
    axes = numbers(world, number, "axes").view(AXIS)
    rows = numbers(world, number, "factor").reshape(axes.size, axes.size)
    lower = np.eye(axes.size)
    for k in range(axes.size):
        i = axes["before"][k]
        while i >= 0:
            lower[k, i] = rows[k, axes["depth"][i]]
            i = axes["before"][i]
    return lower.T @ np.diag(1.0 / axes["inverse"]) @ lower


def jacobian(world: Arrays, number: int, member: int) -> Array:
    """Velocity of the centre of mass of a tree's body, and its spin, by the tree's velocities; shape (6, v_size)."""
    axes, tree = numbers(world, number, "axes").view(AXIS), world.trees[number]
    link = numbers(world, number, "links").view(LINK)[member]
    arm = world.bodies["position"][int(tree["first"]) + member] - tree["origin"]
    out = np.zeros((6, axes.size))
    k = int(link["first_axis"] + link["axes"]) - 1
    while k >= 0:
        spin = axes["spin"][k]
        out[:3, k], out[3:, k] = axes["velocity"][k] + np.cross(spin, arm), spin
        k = int(axes["before"][k])
    return out
