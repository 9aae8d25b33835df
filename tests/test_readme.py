"""The README's code runs as it stands, and it has exactly the two set-up commands."""

import re
from pathlib import Path

import numba
import pytest

TEXT = (Path(__file__).parent.parent / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.S)


def test_there_are_two_commands_and_both_make_an_environment():
    commands = re.findall(r"```sh\n(.*?)```", TEXT, re.S)
    assert len(commands) == 2
    assert "-m sims" in commands[0]
    assert "-m pytest" in commands[1]
    assert all(command.startswith("python3.11 -m venv .venv && ") for command in commands)


@pytest.mark.heavy
@pytest.mark.parametrize("code", BLOCKS, ids=[re.findall(r"import (\w+)", block)[0] for block in BLOCKS])
def test_code_runs_as_it_stands(code, no_other_client):
    for engine in ("mujoco", "pybullet"):
        if engine in code:
            pytest.importorskip(engine)
    if "mujoco" in code and numba.config.DISABLE_JIT:
        pytest.skip("the MuJoCo plugin needs compiled callbacks")
    exec(compile(code, "README.md", "exec"), {})


@pytest.mark.parametrize("code", BLOCKS)
def test_an_example_has_eight_lines_at_most_beside_its_imports(code):
    lines = [line for line in code.splitlines() if line and "import " not in line]
    assert len(lines) <= 8


def test_what_a_newcomer_must_know_is_said():
    """How long tests take and how to leave slow ones out; that the plugin is imported first, in workers too."""
    text = " ".join(TEXT.split())
    assert "-m 'not slow'" in text and "minutes on two cores" in text
    assert "where `contactlaw.mujoco_plugin` has been imported before" in text and "workers of a pool" in text


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (Path(__file__).parent.parent / target).exists(), target
