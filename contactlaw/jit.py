"""Compilation with a cache that notices every edit.

numba's on-disk cache is stamped with the time and size of the *one* file a function stands in. A helper or a constant
changed in another file would leave stale machine code behind and give silently wrong physics. Here the stamp is a hash
of every kernel source together, so an edit anywhere recompiles everything that could depend on it (`cache`).
"""

from __future__ import annotations

import gc
import hashlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numba
from numba.core import event
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager
from numba.core.registry import cpu_target
from numba.core.sigutils import normalize_signature
from numba.core.types import Dispatcher, unliteral

from contactlaw.cache import Cache, lament

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
    """Keep the machine code, by all sources and the key."""
    try:
        compiled._cache = Cache(compiled.__wrapped__, SOURCE_STAMP + key)
    except RuntimeError:  # nowhere to keep it
        _say.kept = False


class _Ingredient(JITCodeLibrary):
    """Code that goes into that of others: it is optimised, made machine code of and kept only there, and once."""

    def finalize(self) -> None:
        """What it calls is linked where machine code is made, not in each that is called on the way."""
        self._finalized = True

    def _gather(self, found: dict[Any, Any]) -> dict[Any, Any]:
        """The code of all that it calls, and its own, by library."""
        found[self] = super()._get_module_for_linking()
        for library in self._linking_libraries:
            if library not in found and isinstance(library, _Ingredient):
                library._gather(found)
            elif library not in found:
                found[library] = library._get_module_for_linking()
        return found

    def _get_module_for_linking(self) -> Any:
        """All of that."""
        own, *others = self._gather({}).values()
        whole = own.clone()
        for other in others:
            whole.link_in(other, preserve=True)
        return whole

    def get_pointer_to_function(self, name: str) -> int:
        """There is none."""
        return 0

    @property
    def codegen(self) -> Any:
        """Itself, for `set_env`."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """What only wrappers for Python use is not there."""


NEEDLESS = {
    "WithLifting", "InlineClosureLikes", "MakeFunctionToJitFunction", "InlineInlinables", "InlineOverloads",
    "DeadBranchPrune", "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "NopythonRewrites",
    "AnnotateTypes", "DumpParforDiagnostics",
}  # fmt: skip
"""Passes of numba's compiler for what no code of ours has: closures, literals that choose types, sums of arrays."""


class _InsideCompiler(Compiler):
    def compile_extra(self, func: Any) -> Any:
        """Compile for compiled code alone."""
        self.state.library = _Ingredient(self.state.targetctx.codegen(), func.__qualname__)
        return super().compile_extra(func)

    def define_pipelines(self) -> Any:
        """numba's, without what serves nothing here."""
        (passes,) = super().define_pipelines()
        kept = PassManager(passes.pipeline_name)
        kept.passes = [one for one in passes.passes if one[0].__name__ not in NEEDLESS]
        kept.finalize()
        return [kept]


INSIDE: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _InsideCompiler}


def _take_any_value(dispatcher: Any, inside: Any) -> None:
    """Let compiled code call what is compiled for it, once for each type of arguments, not for each literal."""
    template_of = inside.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        return template_of(tuple(map(unliteral, args)), {name: unliteral(kind) for name, kind in kws.items()})

    dispatcher.get_call_template = get_call_template
    dispatcher.get_overload = inside.get_overload


def jit_for(key: str, **options: Any) -> Callable[[Function], Function]:
    """`jit` for code that depends on something outside too, named by the key; options: numba's.

    What calls it from Python has it compiled on its own, with what numba wraps it in; what is compiled takes it in.
    """

    def compile_lazily(function: Function) -> Function:
        dispatcher = numba.njit(error_model="numpy", **options)(function)
        if dispatcher is not function:
            _cache(dispatcher, key)
            _take_any_value(dispatcher, numba.njit(error_model="numpy", **INSIDE, **options)(function))
        return dispatcher  # type: ignore[return-value]

    return compile_lazily


class _Haste:
    """numba while it compiles for us.

    All that it makes is alive, so that no garbage is looked for; nobody reads how long LLVM took, which numba would sum
    up for each function on the way; what an operator gives for numbers is found out once.
    """

    def __init__(self) -> None:
        self.collects = False
        self.timer: Any = None

    def begin(self) -> None:
        """From now on."""
        self.collects = gc.isenabled()
        gc.disable()
        self.timer, event.install_timer = event.install_timer, lambda kind, callback: nullcontext()
        typing: Any = cpu_target.typing_context
        resolve, known = typing.resolve_function_type, {}

        def resolve_once(function: Any, args: Any, kws: Any) -> Any:
            if kws or isinstance(function, str | Dispatcher):  # a slice cannot be a key
                return resolve(function, args, kws)
            key = function, args
            if key not in known:
                known[key] = resolve(function, args, kws)
            return known[key]

        typing.resolve_function_type = resolve_once

    def end(self) -> None:
        """As it was."""
        del vars(cpu_target.typing_context)["resolve_function_type"]
        event.install_timer = self.timer
        if self.collects:
            if gc.get_freeze_count() == 0:  # else somebody keeps what they froze
                gc.freeze()  # what is young counts as old: it is not searched at once
                gc.unfreeze()
            gc.enable()


class _Said:
    """Says on stderr that something is compiled: what, for how long, and that it happens once.

    On a terminal a clock goes on beside it; a log has no use for one.
    """

    def __init__(self) -> None:
        self.doing = ["kernels: some seconds"]
        self.told: set[str] = set()
        self.depth = 0  # compilations within one another
        self.clock = threading.Thread()
        self.kept = True
        self.haste = _Haste()

    def __call__(self) -> None:
        what = self.doing[-1]
        if what in self.told:
            return
        self.told |= {what, self.doing[0]}
        once = ", once; later runs read it from numba's cache" if self.kept else ""
        print(f"contactlaw: compiling {what}{once}", file=sys.stderr)
        if not self.kept:
            lament("no folder for numba's cache")

    def begin(self) -> None:
        """Something is being compiled from now on."""
        self()
        if self.depth == 0:
            self.haste.begin()
        self.depth += 1
        if not self.clock.is_alive() and sys.stderr and sys.stderr.isatty():
            self.clock = threading.Thread(target=self.tick, args=(time.monotonic(),), daemon=True)
            self.clock.start()

    def end(self) -> None:
        """It has been compiled."""
        self.depth -= 1
        if self.depth == 0:
            self.haste.end()

    def tick(self, begun: float) -> None:
        """Say every other second how long it has taken."""
        while time.sleep(TICK) is None and self.depth > 0:
            print(f"contactlaw: compiling, {time.monotonic() - begun:.0f} s", end="\r", file=sys.stderr, flush=True)


TICK = 2.5  # [s]
_say = _Said()


class _Listener(event.Listener):
    @staticmethod
    def ours(event: Any) -> bool:
        return event.data["dispatcher"].py_func.__module__.startswith("contactlaw.")

    def on_start(self, event: Any) -> None:
        if self.ours(event):
            _say.begin()

    def on_end(self, event: Any) -> None:
        if self.ours(event):
            _say.end()


event.register("numba:compile", _Listener())


@contextmanager
def compiling(what: str, seconds: int) -> Iterator[None]:
    """What is compiled inside is told by this name, with the time [s] that it takes."""
    _say.doing.append(f"{what}: about {seconds} s")
    try:
        yield
    finally:
        _say.doing.pop()


jit = jit_for("")
"""`numba.njit` with the cache keyed on every source of the package; plain Python under NUMBA_DISABLE_JIT=1."""


def plain(function: Any) -> Any:
    """A function as Python, with all that it calls: where one call from there is not worth compiling it."""
    own = getattr(function, "py_func", None)
    if own is None:
        return function
    known = own.__globals__
    called = {name: plain(known[name]) for name in own.__code__.co_names if name in known}
    return FunctionType(own.__code__, known | called)


jit_inside = jit
"""`jit` of what compiled code alone calls."""


jit_inline = jit_for("", forceinline=True)
"""`jit` for what is small and called at every substep: copied into whoever calls it."""


jit_of_sums = jit_for("", fastmath={"reassoc", "contract", "nsz", "nnan"}, nogil=True)
"""`jit` for loops whose sums may be taken in any order, which lets them run on vectors; their inputs hold no NaN.

Several threads may be in one at once."""


INTERPRETED = bool(getattr(numba, "config").DISABLE_JIT)  # noqa: B009  (what numba reads from the environment)


class _Compiled(CFunc):
    """A C function that says when it is compiled rather than read from the cache."""

    _cache: Any

    def _compile_uncached(self) -> Any:
        if len(_say.doing) == 1 and not isinstance(self._cache, Cache):  # a law of the user's, in a second or less
            return super()._compile_uncached()  # type: ignore[misc]
        _say.begin()
        try:
            return super()._compile_uncached()  # type: ignore[misc]  (numba has no types)
        finally:
            _say.end()


def address_of(function: Callable[..., Any], signature: Any, key: str = "", ours: bool = True) -> int:
    """Address of a function compiled for a signature, as C code is called; it lives for good.

    ours: whether it stands in this package, whose sources key the cache; others are compiled anew in each process, a
    second or less, lest what they import change unseen.
    """
    compiled = _Compiled(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    if ours:
        _cache(compiled, key)
    compiled.compile()
    CALLBACKS.append(compiled)
    return int(compiled.address or 0)


def c_callback(signature: Any, key: str) -> Callable[[Callable[..., Any]], int]:
    """`address_of` as a decorator; key: what outside of the package the function depends on."""
    return lambda function: address_of(function, signature, key)


CALLBACKS: list[CFunc] = []
"""All that `address_of` has compiled."""
