"""Style of the pictures: curves differ in marker and line as well as colour, so that grey prints can be read."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from validation.case import Axes

STYLES: list[dict[str, Any]] = [
    {"color": "black", "marker": "o", "linestyle": "-"},
    {"color": "#c44e00", "marker": "s", "linestyle": "--"},
    {"color": "#0072b2", "marker": "^", "linestyle": "-."},
    {"color": "#8a8a8a", "marker": "D", "linestyle": ":"},
    {"color": "#4b9f78", "marker": "v", "linestyle": (0, (5, 1, 1, 1, 1, 1))},
    {"color": "#b58900", "marker": "P", "linestyle": (0, (1, 1))},
]
LAW_STYLES: dict[str, dict[str, Any]] = dict(
    zip(("microslip", "mindlin", "linear_spring", "mindlin_rescaled", "coulomb"), STYLES, strict=False)
)
SETTINGS: Any = {
    "font.size": 9.0, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#dddddd",
    "grid.linewidth": 0.5, "lines.markersize": 4.5, "lines.linewidth": 1.2, "legend.frameon": False, "savefig.dpi": 110,
}  # fmt: skip


def styled() -> AbstractContextManager[None]:
    """Within this, matplotlib draws and saves in the style of the report."""
    import matplotlib

    return matplotlib.rc_context(SETTINGS)


def panels(
    columns: int = 1, rows: int = 1, *, width: float = 4.6, height: float = 3.6, layout: Any = "constrained",
    **shared: Any,
) -> tuple[Any, list[Axes]]:  # fmt: skip
    """A figure with panels in rows; sizes of one panel in inches. No window, no state of pyplot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width * columns, height * rows), layout=layout)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **shared).flat)


def legend_below(axes: Axes, columns: int) -> None:
    """One legend for all panels, below them, of what a panel shows."""
    axes.get_figure().legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns)


def plain_ticks(axes: Axes, values: list[int]) -> None:
    """Exactly these numbers along a logarithmic x axis, as they are."""
    axes.set_xticks(values, [str(value) for value in values])
    axes.set_xticks([], minor=True)


def limit_line(axes: Axes, value: float, text: str) -> None:
    """A thin line at a limit that is asked for."""
    axes.axhline(value, color="black", linewidth=0.8, linestyle=(0, (8, 4)))
    axes.annotate(text, (0.99, value), xycoords=("axes fraction", "data"), xytext=(0, 2),
                  textcoords="offset points", va="bottom", ha="right", fontsize=8)  # fmt: skip


def bars(axes: Axes, names: list[str], spreads: list[dict[str, float]]) -> None:
    """Horizontal bars of medians, quartiles as whiskers, the value written at each; dark where the law is not there."""
    shades = ["#444444" if name.endswith(("native contact", "no contact at all")) else "#b8b8b8" for name in names]
    medians = [one["median"] for one in spreads]
    whiskers = [[one["median"] - one["low"] for one in spreads], [one["high"] - one["median"] for one in spreads]]
    axes.barh(names, medians, xerr=whiskers, color=shades, height=0.65, error_kw={"elinewidth": 0.8, "capsize": 2})
    for number, one in enumerate(spreads):
        text = f"{one['median']:.0f}" if one["median"] >= 100.0 else f"{one['median']:.3g}"
        axes.annotate(text, (one["high"], number), xytext=(4, 0), textcoords="offset points", va="center", fontsize=8)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.margins(x=0.12)


POINTS: dict[str, Any] = {
    "color": "black", "marker": "o", "markerfacecolor": "white", "markersize": 6.0, "markeredgewidth": 1.2,
    "linestyle": "none", "elinewidth": 0.9, "capsize": 2.0, "zorder": 5,
}  # fmt: skip
BROAD: dict[str, Any] = {"color": "#cccccc", "linewidth": 5.0, "linestyle": "-", "solid_capstyle": "butt", "zorder": 1}
MARKERS_A_LINE = 7


def curves(axes: Axes, x: Sequence[float], by_law: Mapping[str, Sequence[float]]) -> None:
    """Each law as a line with few markers, at different places; the reference as a broad pale line beneath."""
    spacing = max(1, len(x) // MARKERS_A_LINE)
    for number, (name, y) in enumerate(by_law.items()):
        if name not in LAW_STYLES:
            axes.plot(x, y, **BROAD, label="reference")
        else:
            offset = number * spacing // len(by_law)
            axes.plot(x, y, **LAW_STYLES[name], markevery=(offset, spacing), markersize=4.0, label=name)


def points(axes: Axes, x: Sequence[float], y: Sequence[float], error: Any, label: str) -> None:
    """What was measured, with its error in y: a number, one for each, or None."""
    axes.errorbar(x, y, yerr=error, **POINTS, label=label)
