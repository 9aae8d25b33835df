"""Compilation by numba, with a cache on disk that notices every edit.

numba stamps cached code with the time and size of the *one* file that defines the function. After an edit of a helper
or a constant in another file it would load stale machine code and give wrong physics without a word. Here the stamp is
a hash of all sources of the package, so any edit recompiles everything that could depend on it (`cache`).
"""

import gc
import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from functools import cache
from pathlib import Path
from time import perf_counter
from types import FunctionType, SimpleNamespace
from typing import Any, TypeVar

import numba
from llvmlite import ir
from numba import types
from numba.core import event
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.registry import cpu_target
from numba.core.sigutils import normalize_signature
from numba.core.typed_passes import IRLegalization
from numba.core.types import Dispatcher, unliteral

from contactlaw.cache import REPORTED, Cache, report_no_cache

Function = TypeVar("Function", bound=Callable[..., Any])


_ROOT = Path(__file__).parent
_SOURCES = (path.relative_to(_ROOT).as_posix().encode() + path.read_bytes() for path in sorted(_ROOT.rglob("*.py")))
SOURCE_STAMP = hashlib.sha256(b"".join(_SOURCES)).hexdigest()


def _cache(compiled: Any, key: str) -> None:
    """Give a compiled function the cache of this package, keyed by all sources and the key."""
    try:
        compiled._cache = Cache(compiled.__wrapped__, SOURCE_STAMP + key)
    except RuntimeError:
        report_no_cache("no folder for numba's cache")


class _CalleeLibrary(JITCodeLibrary):
    """LLVM code of a function that other compiled code calls.

    The code is linked into each caller that Python calls. Only there is it optimised, made into machine code and
    cached, so that it is not optimised a second time on its own.
    """

    def finalize(self) -> None:
        """Mark the code as complete; its callees are linked once, with the outermost caller."""
        self._finalized = True

    def _collect(self, found: dict[Any, Any]) -> dict[Any, Any]:
        """Add the LLVM modules of this function and of all its direct and indirect callees, by library."""
        found[self] = super()._get_module_for_linking()
        for library in self._linking_libraries:
            if library not in found and isinstance(library, _CalleeLibrary):
                library._collect(found)
            elif library not in found:
                found[library] = library._get_module_for_linking()
        return found

    def _get_module_for_linking(self) -> Any:
        """One LLVM module of this function and all its callees."""
        own, *others = self._collect({}).values()
        module = own.clone()
        for other in others:
            module.link_in(other, preserve=True)
        return module

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: no machine code exists for the function alone."""
        return 0

    @property
    def codegen(self) -> Any:
        """The library itself, on which numba calls `set_env`."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing: only wrappers for Python use the environment, and there are none."""


SKIPPED_PASSES = {
    "WithLifting", "InlineClosureLikes", "MakeFunctionToJitFunction", "InlineInlinables", "InlineOverloads",
    "DeadBranchPrune", "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "NopythonRewrites",
    "AnnotateTypes", "DumpParforDiagnostics",
}  # fmt: skip
"""Passes of numba's compiler for features that this package does not use: closures, literals that select types, array
expressions."""


@register_pass(mutates_CFG=False, analysis_only=True)
class _Legalization(IRLegalization):
    """Marks the end of each variable's life, for counts of references, in functions that make or return arrays.

    The others use arrays that somebody else keeps alive; counts would be a fifth of their code, and never be used. All
    functions of users count: expressions and helpers may make arrays there.
    """

    _name = "legalization_where_counted"

    def run_pass(self, state: Any) -> bool:
        """Leave out counts of references where they serve nothing."""
        made = any(isinstance(one, types.BoundFunction) or _home_of(one) == "numpy" for one in state.typemap.values())
        counted = made or state.targetctx.data_model_manager[state.return_type].contains_nrt_meminfo()
        if counted or not state.func_id.modname.startswith("contactlaw."):
            return bool(super().run_pass(state))
        state.targetctx = state.targetctx.subtarget(enable_nrt=False)
        return False


def _home_of(kind: Any) -> Any:
    """Return the module of the function that a numba type stands for, if any."""
    return getattr(getattr(kind, "typing_key", None), "__module__", None)


class _WholeLibrary(JITCodeLibrary):
    """LLVM code of a C function, inlined into its wrapper: numba keeps both apart, and arguments are copied."""

    def add_ir_module(self, module: Any) -> None:
        """Add a module; in that of the wrapper, the call of the native function is the one marked as not to inline."""
        instructions = (one for function in module.functions for block in function.blocks for one in block.instructions)
        calls = [one for one in instructions if isinstance(one, ir.CallInstr) and "noinline" in one.attributes]
        for call in calls:
            call.attributes.remove("noinline")
            call.attributes.add("alwaysinline")
        super().add_ir_module(module)
        for call in calls:
            self._final_module.get_function(call.callee.name).linkage = "internal"


class _WholeCompiler(Compiler):
    library: Any = _WholeLibrary

    def compile_extra(self, func: Any) -> Any:
        """Compile a function into a library of its kind."""
        self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class _CalleeCompiler(_WholeCompiler):
    library = _CalleeLibrary

    def define_pipelines(self) -> Any:
        """Return numba's pipeline without `SKIPPED_PASSES`, nor counts of references where they serve nothing."""
        (passes,) = super().define_pipelines()
        kept = PassManager(passes.pipeline_name)
        own = [(_Legalization if one is IRLegalization else one, name) for one, name in passes.passes]
        kept.passes = [(one, name) for one, name in own if one.__name__ not in SKIPPED_PASSES]
        kept.finalize()
        return [kept]


CALLEE: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _CalleeCompiler}


def _call_from_compiled(dispatcher: Any, callee: Any) -> None:
    """Let compiled callers of a dispatcher use its callee variant, compiled for each type, not for each literal."""
    template_of = callee.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        return template_of(tuple(map(unliteral, args)), {name: unliteral(kind) for name, kind in kws.items()})

    dispatcher.get_call_template = get_call_template
    dispatcher.get_overload = callee.get_overload


def jit_for(key: str, **options: Any) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function lazily, with its cache keyed by all sources and the key.

    A call from Python compiles the function with numba's wrapper; compiled callers link it into their own code.

    Args:
        key: What the code depends on outside the sources of the package; empty: nothing.
        options: Those of `numba.njit`.
    """

    def compile_lazily(function: Function) -> Function:
        dispatcher = numba.njit(error_model="numpy", **options)(function)
        if dispatcher is not function:
            _cache(dispatcher, key)
            _call_from_compiled(dispatcher, numba.njit(error_model="numpy", **CALLEE, **options)(function))
        return dispatcher  # type: ignore[return-value]

    return compile_lazily


@contextmanager
def uncollected() -> Iterator[None]:
    """Switch the garbage collector off where many objects are made that nearly all stay alive."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            if gc.get_freeze_count() == 0:  # unfreezing would also release objects that the application has frozen
                gc.freeze()  # freeze and unfreeze move new objects to the oldest generation, which is searched last
                gc.unfreeze()
            gc.enable()


@contextmanager
def _faster_compilation() -> Iterator[None]:
    """Shorten compilations inside the context: numba's timers of LLVM's passes are off, types are resolved once."""
    timer = event.install_timer
    typing: Any = cpu_target.typing_context
    event.install_timer = lambda kind, callback: nullcontext()
    resolve, known = typing.resolve_function_type, {}

    def resolve_once(function: Any, args: Any, kws: Any) -> Any:
        if kws or isinstance(function, str | Dispatcher):  # a slice cannot be a key
            return resolve(function, args, kws)
        key = function, args
        if key not in known:
            known[key] = resolve(function, args, kws)
        return known[key]

    typing.resolve_function_type = resolve_once
    try:
        yield
    finally:
        del vars(typing)["resolve_function_type"]
        event.install_timer = timer


class _Report(event.Listener):
    """Reports each compilation on stderr: its subject, its usual time, and that it happens once."""

    def __init__(self) -> None:
        self.subjects = ["kernels: up to a minute"]  # of what is being compiled, innermost last; see `compiling`
        self.reported: set[str] = set()  # subjects
        self.depth = 0  # of nested compilations
        self.seconds = self.began = 0.0  # time spent compiling so far [s]
        self.settings = ExitStack()

    def begin(self) -> None:
        """Note that a compilation begins; report its subject the first time."""
        subject = self.subjects[-1]
        if subject not in self.reported:
            self.reported |= {subject, self.subjects[0]}
            once = "" if REPORTED else ", once; later runs read it from numba's cache"
            print(f"contactlaw: compiling {subject}{once}", file=sys.stderr)
        if self.depth == 0:
            self.began = perf_counter()
            self.settings.enter_context(uncollected())
            self.settings.enter_context(_faster_compilation())
        self.depth += 1

    def end(self) -> None:
        """Note that a compilation has ended."""
        self.depth -= 1
        if self.depth == 0:
            self.settings.close()
            self.seconds += perf_counter() - self.began

    def on_start(self, event: Any) -> None:
        """Note the compilation of a function of this package, an event of numba."""
        if event.data["dispatcher"].py_func.__module__.startswith("contactlaw."):
            self.begin()

    def on_end(self, event: Any) -> None:
        """Note its end."""
        if event.data["dispatcher"].py_func.__module__.startswith("contactlaw."):
            self.end()


_report = _Report()
event.register("numba:compile", _report)


def seconds_compiling() -> float:
    """Return the time [s] that this process has spent compiling, for estimates of the time that a run takes."""
    return _report.seconds


@contextmanager
def compiling(what: str, seconds: int) -> Iterator[None]:
    """Report compilations inside the context under this name, with the usual time [s] that they take."""
    _report.subjects.append(f"{what}: about {seconds} s")
    try:
        yield
    finally:
        _report.subjects.pop()


jit = jit_for("")
"""`numba.njit` with the cache keyed on every source of the package; plain Python under NUMBA_DISABLE_JIT=1."""


jit_inline = jit_for("", forceinline=True)
"""`jit` for small functions that are called at every substep: always inlined into the caller."""


jit_of_sums = jit_for("", fastmath={"reassoc", "contract", "nsz", "nnan"}, nogil=True)
"""`jit` for loops whose sums may be reordered, so that LLVM can vectorise them. Inputs must not hold NaN.

Such functions release the GIL, so several threads may run one at once."""


def jit_module(name: str, compiled: Callable[[Any], Any] = jit) -> None:
    """Compile the functions of a module, as `compiled` does: its last line, in place of a decorator for each of them.

    Left as they are: functions that a decorator has compiled, and those with a return type, which are Python's own.
    """
    own = vars(sys.modules[name])
    ours = {key: one for key, one in own.items() if isinstance(one, FunctionType) and one.__module__ == name}
    own.update({key: compiled(one) for key, one in ours.items() if "return" not in one.__annotations__})


INTERPRETED = bool(getattr(numba, "config").DISABLE_JIT)  # noqa: B009  (NUMBA_DISABLE_JIT)


class _Compiled(CFunc):
    """A C function whose compilation is an event, as that of other functions is."""

    def _compile_uncached(self) -> Any:
        with event.trigger_event("numba:compile", {"dispatcher": SimpleNamespace(py_func=self.__wrapped__)}):
            return super()._compile_uncached()  # type: ignore[misc]  (numba has no types)


@cache
def address_of(function: Callable[..., Any], signature: Any, key: str = "", ours: bool = True) -> int:
    """Return the address of a C function compiled from a Python function; it stays valid until the process ends.

    Args:
        function: Function to compile.
        signature: Its numba signature, or the `memory.caller` of such functions.
        key: What the code depends on outside the sources of the package.
        ours: Whether the function is part of this package, whose sources key the cache. Others are compiled in each
            process (a second or less), since a change in what they import would go unnoticed.
    """
    signature = normalize_signature(getattr(signature, "signature", signature))
    function = getattr(function, "py_func", function)
    options = {"error_model": "numpy"}
    compiled = _Compiled(function, signature, locals={}, options=options, pipeline_class=_WholeCompiler)
    if ours:
        _cache(compiled, key)
    compiled.compile()
    CALLBACKS.append(compiled)
    return int(compiled.address or 0)


CALLBACKS: list[CFunc] = []
"""All functions that `address_of` has compiled, kept alive here."""
