"""Limits and tables in words."""

from typing import Any

from validation.case import Table


def number(value: float) -> str:
    """A figure as the tables show it: four significant digits, so that a narrow miss shows."""
    return f"{value:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0.0 else f"{value:.1e}"


def with_unit(value: float, unit: str) -> str:
    """A figure and its unit, if it has one."""
    return f"{number(value)} {unit}" if unit else number(value)


def asked(limit: dict[str, Any]) -> str:
    """What a saved limit asks."""
    return f"{'at least' if limit['at_least'] else 'at most'} {with_unit(limit['asked'], limit['unit'])}"


def kept(limit: dict[str, Any]) -> str:
    """Whether a saved limit is kept."""
    return "kept" if limit["passed"] else "MISSED"


def markdown(table: Table, most: int | None = None) -> str:
    """The table in Markdown, or so many rows of it."""
    rows = [table.heads, ["---"] * len(table.heads), *table.rows[:most]]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)
