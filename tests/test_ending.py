"""Commands that are ended before their time: files are whole or as they were, and a line says what ended them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from contactlaw.files import whole

ROOT = Path(__file__).parent.parent
CODE = """
import sys, time
from pathlib import Path
from contactlaw.files import whole
from sims.ending import run

def command():
    with whole(Path("table.csv")) as part:
        part.write_text("half")
        print("ready", flush=True)
        time.sleep(60)

run(command)
"""


def test_a_file_takes_its_place_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "picture.png"
    for text in ("first", "second"):
        with whole(path) as part:
            assert part.suffix == ".png" and part.parent == tmp_path
            part.write_text(text)
        assert [one.read_text() for one in tmp_path.iterdir()] == [text]


@pytest.mark.parametrize("fault", [OSError, KeyboardInterrupt])
def test_what_stood_there_stays_if_it_cannot(tmp_path: Path, fault: type[BaseException]) -> None:
    path = tmp_path / "picture.png"
    path.write_text("precious")

    def fail() -> None:
        with whole(path) as part:
            part.write_text("half")
            raise fault

    with pytest.raises(fault):
        fail()
    assert [one.read_text() for one in tmp_path.iterdir()] == ["precious"]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    link, path = tmp_path / "link", tmp_path / "path"
    path.write_text("old")
    link.symlink_to(path)
    with whole(link) as part:
        part.write_text("new")
    assert link.is_symlink() and path.read_text() == "new"


def heed_signals() -> None:
    """Undo what a shell sets for commands in the background (SIGINT) and nohup (SIGHUP): both ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def started(folder: Path, *command: str) -> subprocess.Popen[str]:
    """Start Python with a command line; signals end it as they would in a terminal."""
    return subprocess.Popen(
        [sys.executable, *command], cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=heed_signals,
    )  # fmt: skip


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_signal_ends_a_command_in_order(tmp_path: Path, name: str) -> None:
    (tmp_path / "table.csv").write_text("precious")
    process = started(tmp_path, "-c", CODE)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    process.send_signal(getattr(signal, name))
    _, said = process.communicate(timeout=30)
    assert process.returncode == 128 + getattr(signal, name)
    assert said == f"ended by {name}; files are whole or as they were\n"
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [("table.csv", "precious")]


@pytest.mark.heavy
@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_a_scene_that_is_told_to_end_does(tmp_path: Path) -> None:
    """While it moves, which compiled code does."""
    pytest.importorskip("typer")
    pytest.importorskip("mujoco")
    process = started(tmp_path, "-m", "sims", "slope", "--engine", "mujoco", "--seconds", "1e4", "--plot", "x.png")
    assert process.stderr is not None
    line = process.stderr.readline()
    while "contactlaw: compiling" in line or line == "\n" or line.endswith(" %\n"):
        line = process.stderr.readline()
    assert line.startswith("slope in mujoco with seconds = 10000: up to about ") and "Ctrl-C ends it" in line
    process.terminate()
    began = time.perf_counter()
    _, said = process.communicate(timeout=60)
    assert time.perf_counter() - began < 30.0
    assert process.returncode == 128 + signal.SIGTERM and "Traceback" not in said
    assert said.splitlines()[-1] == "ended by SIGTERM; files are whole or as they were"
    assert list(tmp_path.iterdir()) == []
