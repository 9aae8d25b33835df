"""Calls of functions by address, so that code for trees, discs or hulls is compiled only where a scene has them.

Signatures first, then what calls a function of each signature: the address comes before the arguments.
"""

from typing import Any

import numba
from numba import types

from contactlaw.jit import jit_inside
from contactlaw.memory import caller, whole_at
from contactlaw.world.data.demand import ADD_CALL, ASK, ERROR_OBJECT, IS_TRUE, PENDING
from contactlaw.world.data.records import BODY, CONTACT, NEAR, SHAPE, TREE, WORLD

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
DEEPEST = types.Tuple((VECTOR, NUMBER))(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR)
SIMPLEX = types.UniTuple(VECTOR, 3)
NEAREST = types.Tuple((VECTOR, NUMBER, VECTOR, SIMPLEX))(
    SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR, NUMBER, SIMPLEX
)
RADIUS = types.Tuple((NUMBER, VECTOR))(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE)
MEETING = types.Tuple((NUMBER, VECTOR, VECTOR, VECTOR))(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE)
SEPARATION = types.Tuple((VECTOR, NUMBER, NUMBER, VECTOR))(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR)
TIME = types.void(NEAR_TYPE, SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE, VECTOR, VECTOR, NUMBER)
FACE = types.boolean(VECTOR, VECTOR, NUMBER, SHAPE_TYPE, BODY_TYPE)
ON_WORLD = types.boolean(WORLD_TYPE)
ON_ISLAND = types.void(WORLD_TYPE, types.int64, types.int64)
STARTS_COASTING = types.int64(WORLD_TYPE, types.int64, NUMBER)
COASTS = types.int64(WORLD_TYPE, types.int64, types.UniTuple(NUMBER, 2))
STOPS_COASTING = types.void(WORLD_TYPE, types.int64)
WATCHES = types.int64(WORLD_TYPE, types.int64)
ROLLS = types.void(WORLD_TYPE, CONTACT_TYPE, types.UniTuple(NUMBER, 2))
A_STEP = types.boolean(WORLD_TYPE, NUMBER, types.int64)
A_READ = types.int64(WORLD_TYPE, types.uint64, types.int64)
SPIN = types.void(
    CONTACT_TYPE, types.uint64, types.uint64, VECTOR, NUMBER, NUMBER, types.boolean, types.UniTuple(NUMBER, 2)
)
ALONG = types.void(CONTACT_TYPE, types.uint64, types.uint64, NUMBER, NUMBER, NUMBER)
MOBILITY = NUMBER(BODY_TYPE, VECTOR, BODY_TYPE, VECTOR, VECTOR)


call_on_tree: Any = caller(ON_TREE)
call_with_body: Any = caller(WITH_BODY)
call_with_number: Any = caller(WITH_NUMBER)
call_with_vectors: Any = caller(WITH_VECTORS)
ask_mobility: Any = caller(MOBILITY)
ask_deepest: Any = caller(DEEPEST)
ask_meeting: Any = caller(MEETING)
ask_nearest: Any = caller(NEAREST)
ask_separation: Any = caller(SEPARATION)
ask_radius: Any = caller(RADIUS)
ask_time: Any = caller(TIME)
ask_over_face: Any = caller(FACE)
call_watch: Any = caller(WATCHES)
call_roll: Any = caller(ROLLS)
call_on_world: Any = caller(ON_WORLD)
call_on_island: Any = caller(ON_ISLAND)
call_start_coasting: Any = caller(STARTS_COASTING)
call_coast: Any = caller(COASTS)
call_stop_coasting: Any = caller(STOPS_COASTING)
call_step: Any = caller(A_STEP)
call_read: Any = caller(A_READ)
call_spin: Any = caller(SPIN)
call_along: Any = caller(ALONG)
call_for: Any = caller(types.void(types.int64))
call_later: Any = caller(types.int32(types.uint64, types.uint64))


@jit_inside
def ready(w, what):
    """Return whether a function compiled on demand is there, by its number in `demand`; asks Python for it if not."""
    table = w.demand
    if entry(table, what) == 0 and not error_pending(table):
        call_for(entry(table, ASK), what)
        if entry(table, what) == 0:
            raise_later(table)
    return entry(table, what) != 0


@jit_inside
def address(w, what):
    """Return the address of a function that is `ready`."""
    return entry(w.demand, what)


@jit_inside
def error_pending(table):
    """Return whether an exception is kept, without calling Python; table: address of `demand.TABLE`."""
    return entry(table, PENDING) != 0


@jit_inside
def raise_later(table):
    """Schedule the kept exception to be raised when compiled code has returned."""
    call_later(entry(table, ADD_CALL), entry(table, IS_TRUE), entry(table, ERROR_OBJECT))


@jit_inside
def entry(table, place):
    """Return an entry of `demand.TABLE`."""
    return types.uint64(whole_at(table, place))
