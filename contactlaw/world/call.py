"""Functions called by their addresses: what moves trees, or meets discs or hulls, is compiled where they are."""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from contactlaw.jit import jit_inside
from contactlaw.world.records import BODY, CONTACT, SHAPE, TREE, WORLD

BODY_TYPE = numba.from_dtype(BODY)
SHAPE_TYPE = numba.from_dtype(SHAPE)
TREE_TYPE = numba.from_dtype(TREE)
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
RADIUS = NUMBER(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE)
MEETING = types.UniTuple(NUMBER, 10)(SHAPE_TYPE, BODY_TYPE, SHAPE_TYPE, BODY_TYPE)
ON_WORLD = types.boolean(WORLD_TYPE)
A_STEP = types.boolean(WORLD_TYPE, NUMBER, types.boolean)
LIMIT = NUMBER(CONTACT_TYPE, NUMBER, VECTOR)
TWIST = types.void(CONTACT_TYPE, NUMBER, NUMBER, NUMBER, types.UniTuple(NUMBER, 2))
DEMAND = types.uint64(types.int64)
MOBILITY = NUMBER(BODY_TYPE, VECTOR, BODY_TYPE, VECTOR, VECTOR)


def _generate(signature: Any) -> Any:
    """What calls a C function of this signature at the address that is the first argument."""

    def generate(context, builder, own, arguments):
        nothing = signature.return_type == types.void
        result = ir.VoidType() if nothing else context.get_value_type(signature.return_type)
        kind = ir.FunctionType(result, [context.get_value_type(one) for one in signature.args])
        out = builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value() if nothing else out

    return signature.return_type(types.uint64, *signature.args), generate


def _call_on_tree(typing_context, address, tree):
    return _generate(ON_TREE)


def _call_with_body(typing_context, address, body):
    return _generate(WITH_BODY)


def _call_with_number(typing_context, address, body, number):
    return _generate(WITH_NUMBER)


def _call_with_vectors(typing_context, address, body, arm, impulse):
    return _generate(WITH_VECTORS)


def _ask_mobility(typing_context, address, a, arm_a, b, arm_b, direction):
    return _generate(MOBILITY)


def _ask_deepest(typing_context, address, sa, a, sb, b, d):
    return _generate(DEEPEST)


def _ask_meeting(typing_context, address, sa, a, sb, b):
    return _generate(MEETING)


def _ask_nearest(typing_context, address, sa, a, sb, b, shift):
    return _generate(NEAREST)


def _ask_radius(typing_context, address, sa, a, sb, b):
    return _generate(RADIUS)


def _call_on_world(typing_context, address, world):
    return _generate(ON_WORLD)


def _call_step(typing_context, address, world, dt, grows):
    return _generate(A_STEP)


def _call_limit(typing_context, address, contact, friction, moved):
    return _generate(LIMIT)


def _call_twist(typing_context, address, contact, modulus, angle, left, dashpot):
    return _generate(TWIST)


def _ask_address(typing_context, address, what):
    return _generate(DEMAND)


call_on_tree: Any = intrinsic(_call_on_tree)
call_with_body: Any = intrinsic(_call_with_body)
call_with_number: Any = intrinsic(_call_with_number)
call_with_vectors: Any = intrinsic(_call_with_vectors)
ask_mobility: Any = intrinsic(_ask_mobility)
ask_deepest: Any = intrinsic(_ask_deepest)
ask_meeting: Any = intrinsic(_ask_meeting)
ask_nearest: Any = intrinsic(_ask_nearest)
ask_radius: Any = intrinsic(_ask_radius)
call_on_world: Any = intrinsic(_call_on_world)
call_step: Any = intrinsic(_call_step)
call_limit: Any = intrinsic(_call_limit)
call_twist: Any = intrinsic(_call_twist)
ask_address: Any = intrinsic(_ask_address)


@jit_inside
def address(w, what):
    """Where a function is that only some scenes need, by its number, see `demand`."""
    if w.found[what] == 0:
        w.found[what] = ask_address(w.demand, what)
    return w.found[what]
