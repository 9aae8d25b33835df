"""The guide's code runs as it stands, prints what the page says it prints, and its links lead somewhere."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import pytest

from contactlaw import ContactWarning

ROOT = Path(__file__).parent.parent
PAGES = sorted((ROOT / "docs").glob("*.md"))
BLOCK = re.compile(r"^```python\n(.*?)^```$(?:\n+^```text\n(.*?)^```$)?", re.M | re.S)
NUMBER = re.compile(r"-?\d+(?:\.\d*)?(?:e[+-]?\d+)?")
LAST_DIGITS = 2  # of each number, in which another machine or engine version may round otherwise


def unit_of(number: str) -> float:
    """Worth of the last digit of a printed number."""
    mantissa, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def differences(printed: str, expected: str) -> list[str]:
    """Lines that differ by more than the last digits of their numbers; spaces do not count."""
    one, two = (text.strip().splitlines() for text in (printed, expected))
    if len(one) != len(two):
        return [f"{len(one)} lines instead of {len(two)}: {printed!r}"]
    found = []
    for got, want in zip(one, two, strict=True):
        same = NUMBER.sub("#", got).split() == NUMBER.sub("#", want).split()
        pairs = zip(NUMBER.findall(got), NUMBER.findall(want), strict=True) if same else []
        if not same or any(abs(float(a) - float(b)) > LAST_DIGITS * 1.001 * unit_of(b) for a, b in pairs):
            found.append(f"{got!r} instead of {want!r}")
    return found


@pytest.mark.heavy
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_runs_and_prints_what_it_says(
    page: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = page.read_text(encoding="utf-8")
    for engine in ("mujoco", "pybullet"):
        if f"import {engine}\n" in text or f"import {engine} as" in text:
            pytest.importorskip(engine)
    monkeypatch.chdir(ROOT)  # `python -m validation...` is found there
    space: dict[str, object] = {"__name__": "page"}
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ContactWarning)
        for block in BLOCK.finditer(text):
            line = text.count("\n", 0, block.start()) + 1
            exec(compile("\n" * line + block[1], str(page), "exec"), space)  # errors then name the page's own line
            assert not differences(capsys.readouterr().out, block[2] or ""), f"{page.name}, block of line {line}"
    messages = [str(one.message) for one in said if issubclass(one.category, ContactWarning)]
    untold = [message for message in messages if message not in text]
    assert not untold, f"{page.name}: warns of what it does not show"


def test_every_code_block_is_one_that_is_run() -> None:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        blocks = list(BLOCK.finditer(text))
        assert len(blocks) == text.count("```python")
        assert sum(block[2] is not None for block in blocks) == text.count("```text")
        assert text.count("```") == 2 * (text.count("```python") + text.count("```text"))


def test_another_output_is_noticed() -> None:
    assert not differences("v = 0.1286  m\n", "v = 0.1287 m")
    for other in ("v = 0.1290 m", "v = -0.1286 m", "w = 0.1286 m", "v = 0.1286 m\nx", ""):
        assert differences("v = 0.1286 m", other)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    for target, anchor in re.findall(r"\]\(([^)#]+)#?([^)]*)\)", page.read_text(encoding="utf-8")):
        other = page.parent / target
        assert other.exists(), target
        heads = {head.lower().replace(" ", "-") for head in re.findall(r"^#+ (.*)$", other.read_text(), re.M)}
        assert not anchor or anchor in heads, anchor


def test_the_index_names_every_page() -> None:
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    assert {page.name for page in PAGES} - {"README.md"} == set(re.findall(r"\]\((\w+\.md)\)", index))
