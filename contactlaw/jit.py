"""Compilation with a cache that notices every edit.

numba's on-disk cache is stamped with the time and size of the *one* file a function stands in. A helper or a constant
changed in another file would leave stale machine code behind and give silently wrong physics. Here the stamp is a hash
of every kernel source together, so an edit anywhere recompiles everything that could depend on it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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


@contextmanager
def _telling(module: str) -> Iterator[None]:
    yield


jit = jit_for("")
"""`numba.njit` with the cache keyed on every source of the package; plain Python under NUMBA_DISABLE_JIT=1."""


jit_of_sums = jit_for("", fastmath={"reassoc", "contract", "nsz", "nnan"}, nogil=True)
"""`jit` for loops whose sums may be taken in any order, which lets them run on vectors; their inputs hold no NaN.

Several threads may be in one at once."""


class _Compiled(CFunc):
    """A C function that says when it is compiled rather than read from the cache."""

    def _compile_uncached(self) -> Any:
        with _telling(self._pyfunc.__module__):
            return super()._compile_uncached()


def address_of(function: Callable[..., Any], signature: Any, key: str = "", ours: bool = True) -> int:
    """Address of a function compiled for a signature, as C code is called; it lives for good.

    ours: whether it stands in this package, whose sources key the cache; others are compiled anew in each process, a
    second or less, lest what they import change unseen.
    """
    compiled = _Compiled(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    if ours:
        _cache(compiled, key)
    compiled.compile()
    _CALLBACKS.append(compiled)
    return int(compiled.address or 0)


def c_callback(signature: Any, key: str) -> Callable[[Callable[..., Any]], int]:
    """`address_of` as a decorator; key: what outside of the package the function depends on."""
    return lambda function: address_of(function, signature, key)


_CALLBACKS: list[CFunc] = []
