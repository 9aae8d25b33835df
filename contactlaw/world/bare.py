"""Arrays without an owner, for compiled code that looks at many of their elements.

numba counts the references of every array that it takes a piece of, with atomic instructions; an array that has no
owner has nothing to count. Taken once where a step begins, this halves the time of a step.
"""

from __future__ import annotations

from typing import Any

from numba.core import cgutils
from numba.extending import intrinsic, overload


@intrinsic
def _without_owner(typing_context, array):
    def generate(context, builder, signature, arguments):
        out = context.make_array(signature.args[0])(context, builder, arguments[0])
        out.meminfo = cgutils.get_null_value(out.meminfo.type)
        out.parent = cgutils.get_null_value(out.parent.type)
        return out._getvalue()

    return array(array), generate


def bare(array: Any) -> Any:
    """The same array without a count of references; the caller keeps it alive."""
    return array


@overload(bare)
def _bare(array: Any) -> Any:
    def look(array: Any) -> Any:
        return _without_owner(array)

    return look
