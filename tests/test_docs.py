"""The guide's code runs as it stands, prints what the page says it prints, and its links lead somewhere."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import warnings
from inspect import getdoc
from math import acos, degrees
from pathlib import Path
from textwrap import dedent
from types import ModuleType

import pytest

from contactlaw import ContactWarning
from contactlaw.world import World
from contactlaw.world.implicit import acceptance, equations
from contactlaw.world.shapes import description, hulls, swept

ROOT = Path(__file__).parent.parent
PAGES = sorted((ROOT / "docs").glob("*.md"))
FIGURES = [
    ("limits.md", f"at most {hulls.MOST} vertices"),
    ("shapes.md", f"at most {hulls.MOST} vertices"),
    ("limits.md", f"turn by less than {degrees(acos(hulls.SHARP)):.0f} degrees"),
    ("limits.md", f"is {100.0 * swept.CAPSULE_CROWN:g} % thinner at its ends"),
    ("shapes.md", f"four small feet, at {description.FEET:g} of its radius"),
    ("world.md", f"at most {equations.LARGEST} unknowns, which are {equations.LARGEST // 6} free bodies"),
    ("world.md", f"has more than {acceptance.MANY}, the step is as long as {acceptance.WORTH:g}"),
    ("steps.md", f"an island of more than {equations.LARGEST // 6} bodies"),
]
"""Figures in sentences, as the sources have them."""
PROMISES = [
    (
        "numbers.md",
        "within {:g} in psi_2 of the converged solution for chi from 0.5 to 2,",
        "law_accuracy",
        "chi 0.5 to 2$",
    ),
    ("numbers.md", "for chi from 0.5 to 2, within {:g} up to 4.5", "law_accuracy", "chi 4.5$"),
    ("theory_impact.md", "Errors of the rebound are below {:g} in $\\psi_2$ at any step", "any_step", "at any step"),
]
"""Sentences with a figure that a case of validation keeps, and its limit."""
BLOCK = re.compile(r"^```python\n(.*?)^```$(?:\n+^```text\n(.*?)^```$)?", re.M | re.S)


def differences(printed: str, expected: str) -> list[str]:
    """Lines that differ; numbers are compared to the last digit that is printed, spaces do not count."""
    one, two = (text.strip().splitlines() for text in (printed, expected))
    if len(one) != len(two):
        return [f"{len(one)} lines instead of {len(two)}: {printed!r}"]
    return [f"{got!r} instead of {want!r}" for got, want in zip(one, two, strict=True) if got.split() != want.split()]


@pytest.mark.heavy
@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.stem, marks=[pytest.mark.slow] * (page.stem == "law")) for page in PAGES],
)
def test_page_runs_and_prints_what_it_says(
    page: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, no_other_client: None
) -> None:
    text = page.read_text(encoding="utf-8")
    for engine in ("mujoco", "pybullet"):
        if f"import {engine}\n" in text or f"import {engine} as" in text:
            pytest.importorskip(engine)
    monkeypatch.chdir(ROOT)  # `python -m validation...` is found there
    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ContactWarning)
        for block in BLOCK.finditer(text):
            line = text.count("\n", 0, block.start()) + 1
            code = compile("\n" * line + block[1], str(page), "exec", dont_inherit=True)  # errors name the page's line
            exec(code, module.__dict__)
            assert not differences(capsys.readouterr().out, block[2] or ""), f"{page.name}, block of line {line}"
    messages = [str(one.message) for one in said if issubclass(one.category, ContactWarning)]
    untold = [message for message in messages if message not in text]
    assert not untold, f"{page.name}: warns of what it does not show"


@pytest.mark.heavy
def test_a_law_of_ones_own_runs_from_a_file_of_its_own(tmp_path: Path) -> None:
    """The page's law as a module that is no part of the package, its other blocks as a script that imports it."""
    for engine in ("mujoco", "pybullet"):
        pytest.importorskip(engine)
    law, *rest = BLOCK.finditer((ROOT / "docs" / "own_law.md").read_text(encoding="utf-8"))
    assert law[1].count("\n") <= 40
    (tmp_path / "kelvin_voigt.py").write_text(law[1], encoding="utf-8")
    script = "\n".join(["from kelvin_voigt import KelvinVoigt", *(block[1] for block in rest)])
    (tmp_path / "use.py").write_text(script, encoding="utf-8")
    run = subprocess.run([sys.executable, "use.py"], cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)},
                         capture_output=True, text=True, check=False)  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert not differences(run.stdout, "".join(block[2] or "" for block in rest))


@pytest.mark.heavy
def test_the_example_of_the_reference_runs(capsys: pytest.CaptureFixture[str]) -> None:
    example = re.search(r"^ {4}from contactlaw.*?(?=^\S)", getdoc(World) or "", re.M | re.S)
    assert example is not None
    exec(compile(dedent(example[0]), "World", "exec", dont_inherit=True), {})
    assert capsys.readouterr().out


def test_every_code_block_is_one_that_is_run() -> None:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        blocks = list(BLOCK.finditer(text))
        assert len(blocks) == text.count("```python")
        assert sum(block[2] is not None for block in blocks) == text.count("```text")
        assert text.count("```") == 2 * (text.count("```python") + text.count("```text"))


def plain(page: str) -> str:
    """A page's text, on one line."""
    return " ".join((ROOT / "docs" / page).read_text(encoding="utf-8").split())


@pytest.mark.parametrize(("page", "said"), FIGURES, ids=[said for _, said in FIGURES])
def test_figures_in_sentences_are_those_of_the_sources(page: str, said: str) -> None:
    assert said in plain(page)


@pytest.mark.parametrize(
    ("page", "said", "case", "limit"), PROMISES, ids=[f"{case} {limit}" for *_, case, limit in PROMISES]
)
def test_figures_in_sentences_are_kept(page: str, said: str, case: str, limit: str) -> None:
    result = json.loads((ROOT / "validation" / "results" / f"{case}.json").read_text(encoding="utf-8"))
    worst = max(one["reached"] for one in result["limits"] if re.search(limit, one["name"]))
    pattern = re.escape(said).replace(re.escape("{:g}"), r"(\d\S*)")
    told = re.search(pattern, plain(page))
    assert told is not None and worst <= float(told[1])


def test_another_output_is_noticed() -> None:
    assert not differences("v = 0.1286  m\n", "v = 0.1286 m")
    for other in ("v = 0.1287 m", "v = -0.1286 m", "w = 0.1286 m", "v = 0.1286 m\nx", ""):
        assert differences("v = 0.1286 m", other)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    for target, anchor in re.findall(r"\]\(([^)#]+)#?([^)]*)\)", page.read_text(encoding="utf-8")):
        other = page.parent / target
        assert other.exists(), target
        text = other.read_text(encoding="utf-8") if anchor else ""
        heads = {
            re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in re.findall(r"^#+ (.*)$", text, re.M)
        }
        assert not anchor or anchor in heads, anchor


def test_the_index_names_every_page() -> None:
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    assert {page.name for page in PAGES} - {"README.md"} == set(re.findall(r"\]\((\w+\.md)\)", index))
