"""Equations in TeX, between $ or $$, as MathML."""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.S)


def drawn(page: str, name: str) -> str:
    """A page's HTML with its equations as MathML.

    Raises:
        ValueError: An equation that cannot be read; the message names page and equation.
    """

    def one(match: re.Match[str]) -> str:
        tag, display = match[1], "block" if match[2] == "[" else "inline"
        try:
            return f'<{tag} class="equation">{convert(html.unescape(match[3]), display=display)}</{tag}>'
        except Exception as error:
            raise ValueError(f"{name}: cannot read the equation {match[3]!r}: {error}") from error

    return EQUATION.sub(one, page)
