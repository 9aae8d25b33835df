"""What `mkdocs build` does beyond Markdown: which files it shows and where, equations without a script, the gallery.

The site mirrors the repository: README.md is its home, docs/law.md is docs/law.html, pictures stand where they stand. A
relative link is therefore the same for a reader of the site and for one of the files.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import blocks
import equations
import gallery
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
GUIDE, GALLERY, WORKER = "Guide", "docs/gallery.md", "docs/style/worker.js"
MATERIALS_HERE = "<!-- materials -->"
NETWORK_WORKER = '<script src="https://unpkg.com/iframe-worker/shim"></script>'
SHOWN = (
    "README.md", "docs/*.md", "docs/api/*.md", "docs/play/*", "docs/style/*.css", WORKER, "docs/pictures/*",
    "sims/figures/*.png", "sims/figures/*.gif", "validation/report.md", "validation/data/*",
    "validation/results/*.png", "validation/results/*.json",
)  # fmt: skip


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The repository's files in place of those that mkdocs found in docs; pages that no menu names join the guide."""
    kept = [file for file in files if not file.src_uri.startswith(("tools/", "style/", "api/", "play/"))]
    shown = Files([file for file in kept if not file.is_documentation_page()])
    for path in sorted({path for pattern in SHOWN for path in ROOT.glob(pattern) if path.is_file()}):
        uri = path.relative_to(ROOT).as_posix()
        shown.append(File.generated(config, uri, abs_src_path=str(path)))
    if GALLERY not in shown.src_uris:
        made = gallery.make(os.environ.get("SITE_PICTURES", "make") == "make")
        shown.append(File.generated(config, GALLERY, content=made.page))
        for uri, path in made.pictures.items():
            if uri not in shown.src_uris:
                shown.append(File.generated(config, uri, abs_src_path=str(path)))
    menu = next(entry[GUIDE] for entry in config.nav or [] if GUIDE in entry)
    named = set(_leaves(config.nav))
    menu += [file.src_uri for file in shown.documentation_pages() if file.src_uri not in named]
    return shown


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Blocks apart from each other; and the table of materials, where a page asks for it."""
    text = blocks.apart(markdown)
    return text.replace(MATERIALS_HERE, _materials()) if MATERIALS_HERE in text else text


def on_page_content(html: str, page: Page, **_: Any) -> str:
    """Equations as MathML, which browsers draw by themselves; pictures load when they come into view."""
    return re.sub(r"<img (?!loading)", '<img loading="lazy" ', equations.drawn(html, page.file.src_uri))


def on_post_page(output: str, page: Page, **_: Any) -> str:
    """The search's worker from a file of ours: the theme would load its stand-in for file:// from the network."""
    up = "../" * page.file.dest_uri.count("/")
    return output.replace(NETWORK_WORKER, f'<script src="{up}{WORKER}"></script>')


def on_post_template(output_content: str, **_: Any) -> str:
    """The same for the page of a wrong address, which a server shows: there workers work."""
    return output_content.replace(NETWORK_WORKER, "")


def _materials() -> str:
    """The named materials with the source of each number."""
    from contactlaw import MATERIALS

    rows = ["| name | E [GPa] | nu | rho [kg/m^3] | source |", "|---|---|---|---|---|"]
    for name, one in MATERIALS.items():
        density = "" if one.density is None else f"{one.density:g}"
        cells = (f"`{name}`", f"{one.youngs_modulus / 1e9:.4g}", f"{one.poissons_ratio:g}", density, one.source)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def _leaves(menu: Any) -> list[str]:
    if isinstance(menu, str):
        return [menu]
    parts = menu.values() if isinstance(menu, dict) else menu
    return [leaf for part in parts for leaf in _leaves(part)]
