"""Calls of functions by address, so that code for trees, discs or hulls is compiled only where a scene has them.

Each caller here calls functions of one signature; it takes the address before the arguments.
"""

from typing import Any

import numba
from numba import types

from contactlaw.jit import jit_module
from contactlaw.memory import caller, element
from contactlaw.world.data.demand import DEMAND
from contactlaw.world.data.records import BODY, CONTACT, NEAR, SHAPE, WORLD
from contactlaw.world.data.tree import TREE

BODY_TYPE, SHAPE_TYPE, TREE_TYPE, NEAR_TYPE, CONTACT_TYPE, WORLD_TYPE = map(
    numba.from_dtype, (BODY, SHAPE, TREE, NEAR, CONTACT, WORLD)
)
TWO = SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE
NUMBER = types.float64
VECTOR, PAIR = types.UniTuple(NUMBER, 3), types.UniTuple(NUMBER, 2)
ADDRESSES = types.uint64, types.uint64

call_on_tree: Any = caller(types.void(TREE_TYPE))
call_with_body: Any = caller(types.void(BODY_TYPE))
call_with_number: Any = caller(types.void(BODY_TYPE, NUMBER))
call_with_vectors: Any = caller(types.void(BODY_TYPE, VECTOR, VECTOR))
ask_mobility: Any = caller(NUMBER(BODY_TYPE, VECTOR, BODY_TYPE, VECTOR, VECTOR))
ask_beside: Any = caller(
    types.Tuple((NUMBER, VECTOR, VECTOR, VECTOR))(
        *TWO, types.int64, types.UniTuple(VECTOR, 3), types.UniTuple(VECTOR, 3)
    )
)
ask_deepest: Any = caller(types.Tuple((VECTOR, NUMBER))(*TWO, VECTOR, types.uint64))
ask_meet: Any = caller(types.Tuple((NUMBER, VECTOR, VECTOR, VECTOR))(*TWO, types.uint64))
ask_nearest: Any = caller(
    types.Tuple((VECTOR, VECTOR, types.int64, VECTOR, types.UniTuple(VECTOR, 3)))(
        *TWO, VECTOR, types.int64, types.UniTuple(VECTOR, 3), NUMBER
    )
)
ask_separation: Any = caller(types.Tuple((VECTOR, NUMBER, NUMBER, VECTOR))(*TWO, VECTOR, NUMBER))
ask_curve: Any = caller(types.Tuple((NUMBER, NUMBER, VECTOR))(*TWO, VECTOR, VECTOR))
ask_predict: Any = caller(types.void(NEAR_TYPE, *TWO, VECTOR, VECTOR, NUMBER))
call_roll: Any = caller(types.void(WORLD_TYPE, CONTACT_TYPE, PAIR))
call_on_world: Any = caller(types.boolean(WORLD_TYPE))
call_on_island: Any = caller(types.void(WORLD_TYPE, types.int64, types.int64))
call_start_coasting: Any = caller(types.int64(WORLD_TYPE, types.int64, types.int64, NUMBER))
call_coast: Any = caller(types.int64(WORLD_TYPE, types.int64, types.int64, PAIR, types.boolean))
call_step: Any = caller(types.boolean(WORLD_TYPE, NUMBER, types.int64))
call_read: Any = caller(types.int64(WORLD_TYPE, types.uint64, types.int64))
call_spin: Any = caller(types.void(CONTACT_TYPE, *ADDRESSES, VECTOR, PAIR, NUMBER, types.boolean, PAIR))
call_for: Any = caller(types.void(types.int64))
call_later: Any = caller(types.int32(*ADDRESSES))

table_at: Any = element(DEMAND)


def ready(w, what):
    """Return whether a function compiled on demand is there, by its number in `demand`; asks Python for it if not."""
    table = table_at(w.demand, 0)
    if table.functions[what] == 0 and table.pending == 0:
        call_for(table.supply, what)
        if table.functions[what] == 0:
            raise_later(w.demand)
    return table.functions[what] != 0


def address(w, what):
    """Return the address of a function that is `ready`."""
    return table_at(w.demand, 0).functions[what]


def error_pending(table):
    """Return whether an exception is kept; table: address of `demand.TABLE`."""
    return table_at(table, 0).pending != 0


def raise_later(table):
    """Schedule the kept exception to be raised when compiled code has returned; table: address of `demand.TABLE`."""
    one = table_at(table, 0)
    call_later(one.add_call, one.is_true, one.error)


jit_module(__name__)
