"""Coordinates and velocities of trees from Python, and the addresses of the functions that move trees."""

from ctypes import CFUNCTYPE, c_uint64
from functools import lru_cache

from contactlaw.jit import address_of
from contactlaw.world.data.call import ask_mobility, call_on_tree, call_with_body, call_with_number, call_with_vectors
from contactlaw.world.data.records import Array, Arrays, numbers_of
from contactlaw.world.trees import dynamics, kinematics, mobility, motion


@lru_cache
def addresses() -> dict[str, int]:
    """Return the addresses of the compiled functions of trees, by their names in `records.TREE`."""
    by_signature = {
        call_on_tree: (kinematics.move, dynamics.accelerate),
        call_with_number: (motion.fly, motion.drift),
        call_with_body: (
            mobility.settle, mobility.spread_delta_v, mobility.stop, mobility.move_from_start, mobility.write_masses,
            mobility.add_damping,
        ),
        call_with_vectors: (mobility.kick, mobility.add_accelerations, mobility.add_force),
        ask_mobility: (mobility.mobility,),
    }  # fmt: skip
    return {one.__name__: address_of(one, kind) for kind, functions in by_signature.items() for one in functions}


def numbers(world: Arrays, number: int, name: str) -> Array:
    """Return a view of one of a tree's arrays, by its name in `records.TREE`."""
    tree = world.trees[number]
    sizes = numbers_of(tree)
    names = list(sizes)
    first = int(tree["numbers"]) + sum(sizes[one] for one in names[: names.index(name)])
    return world.joints[first : first + sizes[name]]


def coordinates(world: Arrays, number: int) -> tuple[Array, Array]:
    """Return copies of the coordinates and velocities of a tree."""
    return numbers(world, number, "q").copy(), numbers(world, number, "v").copy()


def write_coordinates(world: Arrays, number: int, q: Array, v: Array) -> None:
    """Set the coordinates and velocities of a tree, and all that follows from them; wakes its bodies."""
    for name, value in (("q", q), ("v", v)):
        own = numbers(world, number, name)
        if value.shape != own.shape:
            raise ValueError(f"{name}: shape {value.shape}; must be {own.shape}")
        own[:] = value
    tree = world.trees[number]
    tree["stale"] = 1
    world.bodies["asleep"][int(tree["first"]) : int(tree["first"] + tree["count"])] = 0
    CFUNCTYPE(None, c_uint64)(int(tree["settle"]))(int(tree["bodies"]))
