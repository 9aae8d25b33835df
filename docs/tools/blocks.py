"""Blocks apart from each other: Python's Markdown takes a table, a list or code right after text for one with it."""

from __future__ import annotations

import re


def apart(markdown: str) -> str:
    """With a blank line around tables and code and before lists."""
    out: list[str] = []
    before, fenced = "text", False
    for line in markdown.split("\n"):
        if fenced:
            fenced = not line.startswith("```")
        else:
            sort = _sort(line, before)
            if line and out and out[-1] and sort != before and (before, sort) != ("list", "text"):
                out.append("")
            before, fenced = sort, sort == "code"
        out.append(line)
    return "\n".join(out)


def _sort(line: str, before: str) -> str:
    """What sort of block a line begins or goes on with."""
    if line.startswith("```"):
        return "code"
    if line.startswith("|"):
        return "table"
    if re.match(r"([-*]|\d+\.) ", line) or (before == "list" and line.startswith("  ")):
        return "list"
    return "text"
