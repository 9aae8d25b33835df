"""Machine code on disk: damaged, interrupted, unwritable or shared, the result is right and nothing is raised."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import contactlaw
from contactlaw.cache import CHECK, CodeFiles

PACKAGE = Path(contactlaw.__file__).parent
CODE = "from contactlaw.laws.oscillator import damping_ratio as f; print(f(0.5), sum(f.stats.cache_hits.values()))"

pytestmark = pytest.mark.heavy


@pytest.fixture
def package(tmp_path: Path) -> Path:
    shutil.copytree(PACKAGE, tmp_path / "contactlaw", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def start(root: Path, **more: str) -> subprocess.Popen[str]:
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1", **more}
    return subprocess.Popen(
        [sys.executable, "-c", CODE], env=environment, cwd=root, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )  # fmt: skip


def run(root: Path, **more: str) -> tuple[list[str], str]:
    """What it printed and what it said; that it ends well."""
    process = start(root, **more)
    out, said = process.communicate()
    assert process.returncode == 0, said
    assert "Traceback" not in said
    return out.split(), said


def files(root: Path) -> list[Path]:
    return sorted(root.rglob("oscillator.damping_ratio-*.nbc"))


@pytest.mark.slow
def test_damaged_files_are_made_anew(package):
    (value, _), said = run(package)
    assert said.count("contactlaw: compiling") == 1
    (path,) = files(package)
    whole = path.read_bytes()
    for data in (b"", whole[:100], whole[: len(whole) // 2], whole[:-1] + b"?", b"\0" * len(whole)):
        path.write_bytes(data)
        assert run(package)[0] == [value, "0"]
        assert path.stat().st_size == len(whole), "it is kept again"
    assert run(package)[0] == [value, "1"]


def test_an_unwritable_place_is_told_in_one_line(package):
    nowhere = {"NUMBA_CACHE_DIR": "/proc/none", "HOME": "/proc/none"}
    shutil.copytree(package / "contactlaw", package / "closed" / "contactlaw")
    for folder in (package / "closed").rglob("*"):
        if folder.is_dir() and folder.name != "__pycache__":
            (folder / "__pycache__").write_text("a file where the folder would be")
    (value, hits), said = run(package / "closed", **nowhere)
    assert hits == "0" and value == run(package)[0][0]
    assert said.count("machine code cannot be kept") == 1


def test_a_full_disk_is_told_in_one_line(monkeypatch, capsys):
    from contactlaw import cache
    from contactlaw.jit import jit_for

    def full(self: object, key: object, data: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(CodeFiles, "save", full)
    monkeypatch.setattr(cache, "REPORTED", [])
    monkeypatch.setattr(CodeFiles, "load", lambda self, key: None)
    double, triple = (jit_for("test")(function) for function in (lambda x: 2.0 * x, lambda x: 3.0 * x))
    assert (double(1.5), triple(1.5)) == (3.0, 4.5)
    said = capsys.readouterr().err
    assert said.count("cannot be kept") == 1 and "No space left" in said


@pytest.mark.slow
def test_two_at_once_both_are_right(package):
    started = [start(package) for _ in range(3)]
    values = {process.communicate()[0].split()[0] for process in started}
    assert all(process.returncode == 0 for process in started)
    assert len(values) == 1
    assert run(package)[0][1] == "1"


def test_code_of_older_sources_is_neither_used_nor_kept(tmp_path):
    old, new = (CodeFiles(str(tmp_path), "f", stamp) for stamp in ("old", "new"))
    old.save("key", 1)
    assert new.load("key") is None
    new.save("key", 2)
    assert (old.load("key"), new.load("key"), new.load("other")) == (None, 2, None)
    assert len(list(tmp_path.iterdir())) == 1
    path = new.path("key")
    path.write_bytes(path.read_bytes()[CHECK:])
    assert new.load("key") is None
