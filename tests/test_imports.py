"""What importing costs, and a cache of machine code that is never stale."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import contactlaw
from contactlaw import jit

HEAVY_MODULES = ["mujoco", "pybullet", "matplotlib", "scipy"]
PACKAGE = Path(contactlaw.__file__).parent
pytestmark = pytest.mark.heavy


def run_python(code: str, root: Path) -> str:
    """Output of a fresh interpreter that finds the package in root, with its cache beside the sources."""
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, cwd=root
    )
    return done.stdout.strip()


@pytest.fixture
def copy_of_package(tmp_path: Path) -> Path:
    """Folder that holds a copy of the package without its cache."""
    shutil.copytree(PACKAGE, tmp_path / "contactlaw", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def test_import_loads_no_engine_and_no_plotting() -> None:
    """Numba itself brings scipy where it is installed; nothing of ours may."""
    code = f"""
import sys, numba
before = set(sys.modules)
import contactlaw
print([name for name in {HEAVY_MODULES} if name in sys.modules and name not in before])
print([name for name in sys.modules if name.startswith("contactlaw.") and ("mujoco" in name or "pybullet" in name)])
"""
    assert run_python(code, PACKAGE.parent) == "[]\n[]"


def test_without_scipy_calibrate_names_the_extra() -> None:
    code = """
import sys
sys.modules["scipy"] = None
import contactlaw
try:
    contactlaw.calibrate(([1.0], [0.1]), ([0.9], [0.0]), 0.4)
except ImportError as error:
    print(error)
"""
    assert run_python(code, PACKAGE.parent) == "calibrate needs scipy: pip install 'contactlaw[calibration]'"


def test_public_names_exist() -> None:
    assert all(hasattr(contactlaw, name) for name in contactlaw.__all__)
    assert list(contactlaw.__all__) == sorted(contactlaw.__all__, key=lambda name: (not name.isupper(), name))


@pytest.mark.parametrize("source", ["laws/mindlin.py", "world/contacts/touch.py", "world/__init__.py", "jit.py"])
def test_stamp_changes_with_any_source(copy_of_package: Path, source: str) -> None:
    code = "from contactlaw import jit; print(jit.__file__, jit.SOURCE_STAMP)"
    path, before = run_python(code, copy_of_package).split()
    assert Path(path).is_relative_to(copy_of_package)
    assert before == jit.SOURCE_STAMP, "a copy has the stamp of the original"
    with (copy_of_package / "contactlaw" / source).open("a") as file:
        file.write("# edited\n")
    assert run_python(code, copy_of_package).split()[1] != before


def test_stamp_changes_with_a_new_or_renamed_source(copy_of_package: Path) -> None:
    code = "from contactlaw import jit; print(jit.SOURCE_STAMP)"
    stamps = {run_python(code, copy_of_package)}
    extra = copy_of_package / "contactlaw" / "world" / "extra.py"
    extra.write_text("")
    stamps.add(run_python(code, copy_of_package))
    extra.rename(extra.with_name("other.py"))
    stamps.add(run_python(code, copy_of_package))
    assert len(stamps) == 3


@pytest.mark.slow
def test_cached_machine_code_notices_an_edit_in_another_file(copy_of_package: Path) -> None:
    """time_of_phases of normal_motion.py calls phase_point of oscillator.py: twice the y is 2^-0.2 of the time."""
    code = (
        "from contactlaw.laws.normal_motion import time_of_phases as t;"
        "print(t(0.5, 0.6, 0.0), sum(t.stats.cache_hits.values()), t.py_func.__code__.co_filename)"
    )
    first, hits, path = run_python(code, copy_of_package).split()
    assert Path(path).is_relative_to(copy_of_package)
    assert hits == "0"
    again, hits, _ = run_python(code, copy_of_package).split()
    assert (again, hits) == (first, "1"), "an unchanged package is compiled once"
    source = copy_of_package / "contactlaw" / "laws" / "oscillator.py"
    text = source.read_text()
    assert "return fade * s, " in text
    source.write_text(text.replace("return fade * s, ", "return 2.0 * fade * s, "))
    edited, hits, _ = run_python(code, copy_of_package).split()
    assert hits == "0"
    assert float(edited) == pytest.approx(float(first) * 2.0**-0.2, rel=1e-12)


@pytest.mark.parametrize(("engine", "module"), [("mujoco", "mujoco_plugin"), ("pybullet", "pybullet_callback")])
def test_without_an_engine_its_extra_is_named(engine: str, module: str) -> None:
    code = f"""
import sys
sys.modules["{engine}"] = None
try:
    import contactlaw.{module}
except ImportError as error:
    print(error)
"""
    said = run_python(code, PACKAGE.parent)
    assert said == f"contactlaw.{module} needs {engine}: pip install 'contactlaw[{engine}]'"
