"""Functions called by their addresses: what moves trees, or meets discs or hulls, is compiled where they are."""

from __future__ import annotations

from typing import Any

import numba
from numba import types

from contactlaw.jit import jit_inside
from contactlaw.memory import caller
from contactlaw.world.records import BODY, CONTACT, NEAR, SHAPE, TREE, WORLD

BODY_TYPE = numba.from_dtype(BODY)
SHAPE_TYPE = numba.from_dtype(SHAPE)
TREE_TYPE = numba.from_dtype(TREE)
NEAR_TYPE = numba.from_dtype(NEAR)
CONTACT_TYPE = numba.from_dtype(CONTACT)
WORLD_TYPE = numba.from_dtype(WORLD)
NUMBER = types.float64
VECTOR = types.UniTuple(NUMBER, 3)

ON_TREE = types.void(TREE_TYPE)
WITH_BODY = types.void(BODY_TYPE)
WITH_NUMBER = types.void(BODY_TYPE, NUMBER)
WITH_VECTORS = types.void(BODY_TYPE, VECTOR, VECTOR)
DEEPEST = types.UniTuple(NUMBER, 4)(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR)
NEAREST = types.UniTuple(NUMBER, 7)(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR)
RADIUS = types.UniTuple(NUMBER, 4)(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE)
MEETING = types.UniTuple(NUMBER, 10)(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE)
TIME = types.void(NEAR_TYPE, SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR, VECTOR, NUMBER)
FACE = types.boolean(VECTOR, VECTOR, NUMBER, SHAPE_TYPE, BODY_TYPE)
ON_WORLD = types.boolean(WORLD_TYPE)
A_STEP = types.boolean(WORLD_TYPE, NUMBER, types.boolean)
A_READ = types.int64(WORLD_TYPE, types.uint64, types.int64)
LIMIT = NUMBER(CONTACT_TYPE, types.uint64, NUMBER, NUMBER, VECTOR)
TWIST = types.void(CONTACT_TYPE, types.uint64, NUMBER, VECTOR, NUMBER, types.UniTuple(NUMBER, 2))
ALONG = types.void(CONTACT_TYPE, types.uint64, types.uint64, NUMBER, NUMBER, NUMBER)
DEMAND = types.uint64(types.int64)
MOBILITY = NUMBER(BODY_TYPE, VECTOR, BODY_TYPE, VECTOR, VECTOR)


call_on_tree: Any = caller(ON_TREE)
call_with_body: Any = caller(WITH_BODY)
call_with_number: Any = caller(WITH_NUMBER)
call_with_vectors: Any = caller(WITH_VECTORS)
ask_mobility: Any = caller(MOBILITY)
ask_deepest: Any = caller(DEEPEST)
ask_meeting: Any = caller(MEETING)
ask_nearest: Any = caller(NEAREST)
ask_radius: Any = caller(RADIUS)
ask_time: Any = caller(TIME)
ask_over_face: Any = caller(FACE)
call_on_world: Any = caller(ON_WORLD)
call_step: Any = caller(A_STEP)
call_read: Any = caller(A_READ)
call_limit: Any = caller(LIMIT)
call_twist: Any = caller(TWIST)
call_along: Any = caller(ALONG)
ask_address: Any = caller(DEMAND)


@jit_inside
def address(w, what):
    """Where a function is that only some scenes need, by its number, see `demand`."""
    if w.found[what] == 0:
        w.found[what] = ask_address(w.demand, what)
    return w.found[what]
