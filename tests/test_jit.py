"""Compiled code that other compiled code takes in: kept only with that, and right in another process too."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import types
from numba.core.runtime import _nrt_python as memory

from contactlaw import jit
from contactlaw.jit import CALLBACKS, INTERPRETED, address_of

SOURCE = """
import sys
from contactlaw.jit import jit
@jit
def inner(x): return x + 1.0
@jit
def one(x): return 2.0 * inner(x)
@jit
def other(x): return 3.0 * inner(x) + one(x)
print({"inner": inner, "one": one, "other": other}[sys.argv[1]](1.0))
"""


@pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")
@pytest.mark.slow
def test_what_is_taken_in_is_kept_with_who_takes_it(tmp_path: Path) -> None:
    file = tmp_path / "functions.py"
    file.write_text(SOURCE)
    root = str(Path(__file__).parents[1])
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": root}
    for name, value in (("one", 4.0), ("other", 10.0), ("inner", 2.0), ("other", 10.0)):
        run = subprocess.run([sys.executable, str(file), name], env=own, capture_output=True, text=True, check=False)
        assert (run.returncode, run.stdout.split()) == (0, [str(value)]), run.stderr
    names = {path.name.split("-")[0] for path in (tmp_path / "cache").rglob("*.nbc")}
    assert {name for name in names if name.startswith("functions.")} == {
        "functions.inner", "functions.one", "functions.other",
    }  # fmt: skip


def test_a_compilation_is_told_of_once(monkeypatch) -> None:
    stream, said = io.StringIO(), jit._Report()
    monkeypatch.setattr(sys, "stderr", stream)
    for _ in range(2):
        said.begin()
        said.end()
    (first,) = stream.getvalue().splitlines()
    assert first.startswith("contactlaw: compiling kernels: up to a minute, once")


def harmonic_sum(count):
    """Return 1 + 1/2 + ... + 1/count."""
    total = 0.0
    for i in range(1, int(count) + 1):
        total += 1.0 / i
    return total


@pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")
def test_a_c_function_is_one_function() -> None:
    address_of(harmonic_sum, types.float64(types.float64), ours=False)
    assert CALLBACKS[-1].ctypes(2.0) == 1.5
    assert len(re.findall("^define .*harmonic_sum", CALLBACKS[-1].inspect_llvm(), re.M)) == 1


@jit.jit
def thrice(x):
    """Return an array that another function makes."""
    return 3.0 * x


@jit.jit
def total(x):
    """Use arrays of helpers and of an expression, without a method or a function of numpy."""
    _, (first, last) = 1.0, ends(x)
    y = 2.0 * thrice(x)
    return y[0] + first[0] + last[0]


@jit.jit
def ends(x):
    """Return two parts of an array."""
    return x[:1], x[-1:]


@jit.jit
def summed(count):
    """Return a sum over arrays that live for one round of the loop."""
    out = 0.0
    for _ in range(count):
        out += total(np.ones(100))
    return out


@pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")
def test_arrays_in_functions_of_users_are_freed_once() -> None:
    """As many as are made, by numba's own count. Without counts of references callers of helpers kept them for good."""
    memory.memsys_enable_stats()
    made, freed = memory.memsys_get_stats_alloc(), memory.memsys_get_stats_free()
    assert summed(50) == 400.0
    made, freed = memory.memsys_get_stats_alloc() - made, memory.memsys_get_stats_free() - freed
    memory.memsys_disable_stats()
    assert made == freed >= 50
