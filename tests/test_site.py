"""The documentation site builds without a warning, leads nowhere that is not, and loads nothing from elsewhere."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import contactlaw

ROOT = Path(__file__).parent.parent
pytestmark = pytest.mark.heavy


class Page(HTMLParser):
    """What a page refers to and can be referred to by."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.ids: set[str] = set()
        self.twice: set[str] = set()
        self.bare: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        if "id" in given:
            self.twice |= {given["id"]} & self.ids
            self.ids.add(given["id"])
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if "src" in given or (tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload", "preconnect")):
            self.loaded.append(given.get("src") or given["href"])
        if tag == "img" and not given.get("alt"):
            self.bare.append(given.get("src", ""))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="the site is made with the extra `docs`")
    folder = tmp_path_factory.mktemp("site")
    settings = {"SITE_PICTURES": "committed", "NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT, env=os.environ | settings, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path) for path in site.rglob("*.html")}


@pytest.mark.slow
def test_links_lead_somewhere(pages: dict[Path, Page]) -> None:
    for path, page in pages.items():
        if path.name == "404.html":
            continue  # its links are from the root of a server
        for link in [*page.links, *page.loaded]:
            parts = urlsplit(link)
            if parts.scheme or not (parts.path or parts.fragment):
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            assert target.exists(), f"{path.name}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].ids, f"{path.name}: {link}"


@pytest.mark.slow
def test_a_name_means_one_place(pages: dict[Path, Page]) -> None:
    assert not {path.name: page.twice for path, page in pages.items() if page.twice}


@pytest.mark.slow
def test_nothing_is_loaded_from_elsewhere(site: Path, pages: dict[Path, Page]) -> None:
    for path, page in pages.items():
        assert not [source for source in page.loaded if urlsplit(source).netloc], path.name
    for style in site.rglob("*.css"):
        assert not re.search(r"url\(['\"]?https?:|@import", style.read_text(encoding="utf-8")), style.name


@pytest.mark.slow
def test_pictures_say_what_they_show(pages: dict[Path, Page]) -> None:
    assert not {path.name: page.bare for path, page in pages.items() if page.bare}


@pytest.mark.slow
def test_the_reference_has_every_public_name(site: Path, pages: dict[Path, Page]) -> None:
    ids = set().union(*(page.ids for path, page in pages.items() if path.parent.name == "api"))
    tree = {
        "contactlaw": Path(contactlaw.__file__),
        **{f"contactlaw.{name}": Path(contactlaw.__file__).parent / name / "__init__.py"
           for name in ("mujoco_plugin", "pybullet_callback", "world")},
    }  # fmt: skip
    for module, path in tree.items():
        listed = next(
            ast.literal_eval(node.value)
            for node in ast.parse(path.read_text(encoding="utf-8")).body
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
        )
        assert not {f"{module}.{name}" for name in listed} - ids


@pytest.mark.slow
def test_stars_of_docstrings_are_no_emphasis(site: Path) -> None:
    for path in (site / "docs" / "api").glob("*.html"):
        text = path.read_text(encoding="utf-8")
        assert set(re.findall(r"<em>(.*?)</em>", text, re.S)) <= {"required"}, path.name
        assert not re.search('`"|"`', unescape(text)), path.name
    text = unescape((site / "docs" / "api" / "mujoco_plugin.html").read_text(encoding="utf-8"))
    assert '<code>"ball*"</code>' in text and '<code>"*"</code> alone stands for every geom' in text


@pytest.mark.slow
def test_blocks_stand_apart(site: Path) -> None:
    """No code swallowed by a table, no list or table that stayed text."""
    for path in site.rglob("*.html"):
        text = re.sub(r"<(head|pre|code|script)\b.*?</\1>", "", path.read_text(encoding="utf-8"), flags=re.S)
        assert not re.search(r"<td>\s*<div class=\"language", text), path.name
        assert not re.search(r"(<p>|\n)\s*(\||[-*] |```|\?\?\? )", re.sub(r"<head>.*?</head>", "", text, flags=re.S)), (
            path.name
        )


@pytest.mark.slow
def test_no_page_is_wider_than_a_narrow_window(site: Path, tmp_path: Path) -> None:
    """Every page in a frame of a browser: wide tables, code and pictures stay in frames of their own."""
    width = 420
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        pytest.skip("no browser: chromium or google-chrome on the path")
    paths = sorted(path for path in site.rglob("*.html") if path.name != "404.html")
    frames = "".join(f'<iframe width={width} height=700 src="{path.as_uri()}"></iframe>' for path in paths)
    script = """addEventListener("load", () => setTimeout(() => {
      const pages = [...document.querySelectorAll("iframe")].map((one) => one.contentDocument.documentElement);
      document.title = JSON.stringify(pages.map((one) => one.scrollWidth));
    }, 500));"""
    page = tmp_path / "frames.html"
    page.write_text(f"<!doctype html><title></title>{frames}<script>{script}</script>", encoding="utf-8")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
               "--allow-file-access-from-files", "--virtual-time-budget=8000", "--dump-dom", page.as_uri()]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    title = re.search(r"<title>(\[.*?\])</title>", done.stdout)
    assert title is not None, done.stderr[-2000:]
    widths = dict(zip([path.relative_to(site).as_posix() for path in paths], json.loads(title[1]), strict=True))
    assert not {name: wide for name, wide in widths.items() if not 0 < wide <= width}


@pytest.mark.slow
def test_equations_are_drawn(site: Path) -> None:
    text = (site / "docs" / "theory_impact.html").read_text(encoding="utf-8")
    assert text.count("<math") > 20
    assert "arithmatex" not in text


def _texts(node: ast.AST) -> str:
    """A literal's text, values left out."""
    if isinstance(node, ast.JoinedStr):
        return "".join(_texts(part) for part in node.values)
    return str(node.value) if isinstance(node, ast.Constant) and isinstance(node.value, str) else "\0"


def test_messages_are_those_of_the_package() -> None:
    source = "\0".join(
        _texts(node)
        for path in Path(contactlaw.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.JoinedStr | ast.Constant)
    )
    page = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(.+?)` \|", page, re.M)
    assert len(rows) > 25
    for row in rows:
        for part in row.split("..."):
            assert part.strip() in source, row
