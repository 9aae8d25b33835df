"""Docstrings are plain text: what Markdown and the reference's parser would misread is put so that they do not."""

from __future__ import annotations

import re
from typing import Any

import griffe

STARS = re.compile(  # code stays; "ball*", of names, is code; E*, G* get a star that is no emphasis
    r'(?P<code>`[^`]*`)|(?P<pattern>"[^"\s`]*\*[^"\s`]*")|(?<=[A-Za-z])\*(?![*\w])'
)
BULLET = re.compile(r"\n+ *\* (?=\S)")  # of a list, which Markdown wants apart and at the left
SEVERAL = re.compile(r"^( +)(\w+(?:, \w+)+): ", re.M)  # "a, b: ...", two of one kind: no type of the first


def _shown(found: re.Match[str]) -> str:
    return found[0] if found["code"] else f"`{found[0]}`" if found["pattern"] else "\N{ASTERISK OPERATOR}"


class PlainText(griffe.Extension):
    """Applied to every docstring that is read."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Put one docstring right."""
        if obj.docstring:
            text = BULLET.sub("\n\n* ", STARS.sub(_shown, obj.docstring.value))
            obj.docstring.value = SEVERAL.sub(lambda found: f"{found[1]}{found[2].replace(', ', ',')}: ", text)
