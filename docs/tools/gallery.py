"""The gallery: each scene with its picture, description, animation and code."""

from __future__ import annotations

import hashlib
import inspect
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "sims" / "figures"
CACHE = ROOT / ".cache" / "pictures"
HEAD = """# Gallery

Every scene is one file in `sims/scenes`. It runs in a few seconds, checks itself against known results, and is an
example of how to use the package. `python -m sims NAME --help` shows its options:

- `--plot x.png` and `--gif x.gif` make the pictures shown here, `--mp4 x.mp4` a video (`pip install -e '.[video]'`),
  and `--view` opens the engine's window;
- `--engine both` runs a scene in MuJoCo and PyBullet, `--engine none` in the package's own world;
- `--law native` uses the engine's own contact;
- `--json` prints the results;
- `--friction`, `--restitution`, `--mass` and `--radius` are those of the ball.

Numbers under a ball count its bounces.
"""


class Gallery(NamedTuple):
    """The page in Markdown, and its pictures by their place in the site."""

    page: str
    pictures: dict[str, Path]


def make(draw: bool) -> Gallery:
    """Make the page of all scenes; draw: make missing pictures, which takes some minutes the first time."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    from sims.scene import find_scenes

    scenes, parts, pictures = find_scenes(), [HEAD], {}
    parts.append("\n".join(f"- [{name}](#{name}): {scene.title}" for name, scene in scenes.items()) + "\n")
    for name, scene in scenes.items():
        shown = _pictures(name, draw)
        pictures |= {f"sims/figures/{path.name}": path for path in shown}
        parts.append(_chapter(name, scene, [path.suffix for path in shown]))
    return Gallery("\n".join(parts), pictures)


def _chapter(name: str, scene: Any, suffixes: list[str]) -> str:
    """Chapter of one scene."""
    first, _, rest = (inspect.getdoc(sys.modules[type(scene).__module__]) or "").partition("\n\n")
    lines = [f"## {name}", ""]
    if ".png" in suffixes:
        lines += [f"![{scene.title}](../sims/figures/{name}.png)", "", f"*{_sentence(scene.title)}*", ""]
    lines += [first, "", *_paragraphs(rest)]
    lines += ["```sh", f"python -m sims {name}", "```", ""]
    if ".gif" in suffixes:
        pace = f", {scene.slow:g} times slower than real time" if scene.slow != 1.0 else ""
        lines += [f'??? example "Animation{pace}"', ""]
        lines += [f"    ![{scene.title}, animation](../sims/figures/{name}.gif)", ""]
    code = textwrap.dedent(inspect.getsource(type(scene).simulate))
    lines += [f'??? example "Code: {code.count(chr(10))} lines of sims/scenes/{name}.py"', "", "    ```python"]
    lines += [f"    {line}".rstrip() for line in code.rstrip().splitlines()]
    return "\n".join([*lines, "    ```", ""])


def _paragraphs(text: str) -> list[str]:
    """Lines of a docstring in Markdown; indented paragraphs are formulas."""
    lines = []
    for part in filter(str.strip, text.split("\n\n")):
        formula = all(line.startswith("    ") for line in part.splitlines())
        lines += ["```text", textwrap.dedent(part), "```", ""] if formula else [part, ""]
    return lines


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _pictures(name: str, draw: bool) -> list[Path]:
    """Pictures of a scene: committed ones, or those made for this state of the sources."""
    folder = CACHE / _state()
    wanted = {suffix: COMMITTED / f"{name}{suffix}" for suffix in (".png", ".gif")}
    missing = {suffix: folder / f"{name}{suffix}" for suffix, path in wanted.items() if not path.exists()}
    if draw and any(not path.exists() for path in missing.values()):
        print(f"picture of {name}", file=sys.stderr, flush=True)
        folder.mkdir(parents=True, exist_ok=True)
        options = [word for suffix, path in missing.items() for word in (_option(suffix), str(path))]
        # A scene that misses a limit ends with 1 and has its pictures all the same.
        subprocess.run([sys.executable, "-m", "sims", name, *options], cwd=ROOT, stdout=subprocess.DEVNULL, check=False)
        lost = [str(path) for path in missing.values() if not path.exists()]
        if lost:
            raise RuntimeError(f"{name}: no picture was made at {', '.join(lost)}")
    return [path for path in (wanted | missing).values() if path.exists()]


def _option(suffix: str) -> str:
    return "--plot" if suffix == ".png" else "--gif"


def _state() -> str:
    """Hash of the sources that the pictures are made with."""
    digest = hashlib.sha256()
    for path in sorted((ROOT / "sims").rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
