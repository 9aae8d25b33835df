"""Compilation with a cache that notices every edit.

numba's on-disk cache is stamped with the time and size of the *one* file a function stands in. A helper or a constant
changed in another file would leave stale machine code behind and give silently wrong physics. Here the stamp is a hash
of every kernel source together, so an edit anywhere recompiles everything that could depend on it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

Function = TypeVar("Function", bound=Callable[..., Any])


def _hash_of_sources() -> str:
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


SOURCE_STAMP = _hash_of_sources()


def _cache(compiled: Any, key: str) -> None:
    """Turn the cache on and key it on all sources; leave it off where numba's internals no longer fit."""
    try:
        compiled.enable_caching()
    except RuntimeError:  # nowhere to keep a cache, a package inside a zip file say
        return
    index = getattr(compiled._cache, "_cache_file", None)
    if index is not None and hasattr(index, "_source_stamp"):
        index._source_stamp = SOURCE_STAMP + key
    else:  # an unknown numba: compile afresh each time, slow but never stale
        compiled._cache.disable()


def jit_for(key: str, fastmath: bool | set[str] = False, nogil: bool = False) -> Callable[[Function], Function]:
    """`jit` for code that depends on something outside too, named by the key; may use fast math and threads."""

    def compile_lazily(function: Function) -> Function:
        dispatcher = numba.njit(error_model="numpy", fastmath=fastmath, nogil=nogil)(function)
        if dispatcher is not function:
            _cache(dispatcher, key)
        return dispatcher  # type: ignore[return-value]

    return compile_lazily


jit = jit_for("")
"""`numba.njit` with the cache keyed on every source of the package; plain Python under NUMBA_DISABLE_JIT=1."""


jit_of_sums = jit_for("", fastmath={"reassoc", "contract", "nsz", "nnan"}, nogil=True)
"""`jit` for loops whose sums may be taken in any order, which lets them run on vectors; their inputs hold no NaN.

Several threads may be in one at once."""


def c_callback(signature: Any, key: str) -> Callable[[Callable[..., Any]], int]:
    """`numba.cfunc` with the same cache; returns the address of the compiled function, which lives for good."""

    def compile_now(function: Callable[..., Any]) -> int:
        callback = CFunc(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
        _cache(callback, key)
        callback.compile()
        CALLBACKS.append(callback)
        return int(callback.address or 0)

    return compile_now


CALLBACKS: list[CFunc] = []
"""All that `c_callback` has compiled."""
