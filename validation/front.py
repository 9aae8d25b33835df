"""Error against run time: which methods no other beats in both, and by how much the others are beaten.

A *rung* is one way to the answer, a law or method with its settings; those of one law make a *family*. One rung beats
another if its error is no larger and it is faster for certain: in at least three quarters of the rounds in which both
were timed side by side. Rungs whose times the clock cannot tell apart do not beat each other. The *front* is what
nothing beats (non-dominated, Pareto-optimal).
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from validation.case import Array, Axes, Data
from validation.measure import spread
from validation.picture import LAW_STYLES
from validation.prediction import rms

CERTAIN = 75.0  # per cent of the rounds
STRIDE = 0.8  # from row to row of a table, in error
LOOKS: dict[str, dict[str, Any]] = LAW_STYLES | {
    "coulomb": {"color": "#b58900", "marker": "P"},
    "annuli": {"color": "#555555", "marker": "X"},
    "superposition": {"color": "#2f7f5f", "marker": "h"},
    "collide": {"color": "#b0307a", "marker": "<"},
    "native": {"color": "#7a4fa3", "marker": "d"},
}
"""Markers by family."""


class Rung(NamedTuple):
    """One way to the answer, timed: its law or method; errors, shape (n,); seconds an impact, shape (rounds,), those of
    one round taken side by side; why its figures do not count; an engine's steps of each impact, shape (rounds,)."""

    family: str
    error: Array
    seconds: Array
    problem: str = ""
    steps: Array | None = None


def non_dominated(errors: Mapping[str, float], seconds: Mapping[str, Array]) -> list[str]:
    """Names that no other beats, the fastest first; an error that is not finite is beaten by all.

    Raises:
        ValueError: The names of errors and of seconds, shape (rounds,), differ.
    """
    if errors.keys() != seconds.keys():
        raise ValueError(f"errors and seconds: differ in {sorted(errors.keys() ^ seconds.keys())}")
    free = [name for name in errors if np.isfinite(errors[name]) and not beaten_by(name, errors, seconds)]
    return sorted(free, key=lambda name: float(np.median(seconds[name])))


def beaten_by(name: str, errors: Mapping[str, float], seconds: Mapping[str, Array]) -> list[str]:
    """Names that are no worse in error than this one, and faster for certain; the one with the least error first."""
    others = [one for one in errors if one != name and errors[one] <= errors[name]]
    faster = [one for one in others if np.percentile(seconds[one] / seconds[name], CERTAIN) < 1.0]
    return sorted(faster, key=lambda one: errors[one])


def closest(errors: Mapping[str, float], times: Mapping[str, float], time: float) -> float:
    """The least error that costs no more than a time; inf: none does."""
    return min((errors[name] for name in errors if times[name] <= time), default=float("inf"))


def time_for(errors: Mapping[str, float], times: Mapping[str, float], error: float) -> float:
    """Time at which refining one method reaches an error, between its settings by powers; inf: none is as close.

    The fastest one's where that is closer still.
    """
    kept: list[tuple[float, float]] = []
    for name in sorted(times, key=lambda one: times[one]):
        if not kept or errors[name] < kept[-1][1]:
            kept.append((times[name], errors[name]))
    if not kept or kept[-1][1] > error:
        return float("inf")
    logs = np.log(np.maximum(np.array(kept[::-1]), 1e-300))
    return float(np.exp(np.interp(np.log(error), logs[:, 1], logs[:, 0])))


def weighed(rungs: Mapping[str, Rung]) -> Data:
    """All that table and picture of a front need, JSON types only.

    `rungs`: by name family, largest and rms error, microseconds an impact (and a step), how many beat it and the
    closest of them, its problem; `front`: names on the front; `dominated`: families that have no rung on it.
    """
    sane = {name: rung for name, rung in rungs.items() if not rung.problem}
    seconds = {name: rung.seconds for name, rung in sane.items()}
    errors = {name: largest(rung.error) for name, rung in sane.items()}
    found = non_dominated(errors, seconds)
    entries = {}
    for name, rung in rungs.items():
        entry: Data = {"family": rung.family, "problem": rung.problem, "microseconds": spread(1e6 * rung.seconds)}
        if not rung.problem:
            better = beaten_by(name, errors, seconds)
            entry |= {"largest": errors[name], "rms": rms(rung.error), "beaten": len(better), "beaten_by": better[:1]}
        if rung.steps is not None:
            entry["steps"] = float(rung.steps.mean())
            entry["step_microseconds"] = spread(1e6 * rung.seconds / rung.steps)
        entries[name] = entry
    families = dict.fromkeys(rung.family for rung in sane.values())
    on_front = {rungs[name].family for name in found}
    return {"rungs": entries, "front": found, "dominated": [one for one in families if one not in on_front]}


def largest(error: Array) -> float:
    """Largest error in size."""
    return float(np.abs(error).max())


def of_families(data: Data, families: Iterable[str]) -> tuple[dict[str, float], dict[str, float]]:
    """Largest errors and median times [us] of the rungs of some families that count, by name."""
    wanted = set(families)
    chosen = {name: one for name, one in data["rungs"].items() if one["family"] in wanted and not one["problem"]}
    errors = {name: one["largest"] for name, one in chosen.items()}
    return errors, {name: one["microseconds"]["median"] for name, one in chosen.items()}


def rows(data: Data, default: str) -> list[list[str]]:
    """Rows of a table: the front, the default, the closest of each dominated family, and what does not count.

    Of the front, those that have at most `STRIDE` of the error of the row before.

    Columns: rung, largest error, rms, time an impact [us], quartiles, time a step [us], on the front.
    """
    found = data["rungs"]
    shown, last = {default}, float("inf")
    for name in data["front"]:
        if found[name]["largest"] <= STRIDE * last:
            shown.add(name)
            last = found[name]["largest"]
    for family in data["dominated"]:
        errors, _ = of_families(data, [family])
        shown.add(min(errors, key=lambda one: errors[one]))
    out = []
    for name in sorted(shown, key=lambda one: found[one]["microseconds"]["median"]):
        one = found[name]
        time, step = one["microseconds"], one.get("step_microseconds")
        out.append([name, f"{one['largest']:.1e}", f"{one['rms']:.1e}", short(time["median"]),
                    f"{short(time['low'])} to {short(time['high'])}", short(step["median"]) if step else "",
                    _standing(data, name)])  # fmt: skip
    insane = {name: one["problem"] for name, one in found.items() if one["problem"]}
    out += [[name, *[""] * 5, f"does not count: {problem}"] for name, problem in insane.items()]
    return out


def _standing(data: Data, name: str) -> str:
    """Whether a rung is on the front, and if not what beats it."""
    one = data["rungs"][name]
    other = "".join(f", beaten by {other}" for other in one["beaten_by"])
    if one["family"] in data["dominated"]:
        return f"no setting of {one['family']} is{other}"
    return "yes" if name in data["front"] else f"no{other}"


HEADS = "method | largest error | rms | time an impact [us] | quartiles | time a step [us] | on the front"
"""Of `rows`."""


def short(value: float) -> str:
    """Three significant digits, never in powers of ten."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def closer(data: Data, default: str, families: Iterable[str]) -> float:
    """How many times closer the default is than the closest rung of other families that is as fast.

    As fast is what the clock cannot tell to be slower: its lower quartile is within the default's upper one. Where none
    is, the default is faster than all, and the fastest is taken.
    """
    star = data["rungs"][default]
    errors, _ = of_families(data, families)
    low = {name: data["rungs"][name]["microseconds"]["low"] for name in errors}
    return closest(errors, low, max(star["microseconds"]["high"], min(low.values()))) / star["largest"]


def faster(data: Data, default: str, families: Iterable[str]) -> float:
    """How many times faster the default is than a method refined until it is as close, between its settings by powers.

    Where none of its settings is as close: than the closest of them, which still takes less than would be needed.
    """
    star = data["rungs"][default]
    errors, times = of_families(data, families)
    time = time_for(errors, times, star["largest"])
    if not np.isfinite(time):
        time = times[min(errors, key=lambda name: errors[name])]
    return time / star["microseconds"]["median"]


def plot(axes: Axes, data: Data, default: str, *, floor: float = 0.0) -> None:
    """Largest error over time: a mark for each rung, the front a line, nodes/steps at it, the default a star.

    data: from `weighed`; floor: errors below are drawn there.
    """
    shown = {name: one for name, one in data["rungs"].items() if not one["problem"]}

    def point(name: str) -> tuple[float, float]:
        return shown[name]["microseconds"]["median"], max(shown[name]["largest"], floor)

    for family in dict.fromkeys(one["family"] for one in shown.values()):
        points = [point(name) for name, one in shown.items() if one["family"] == family]
        look = LOOKS[family] | {"linestyle": "none", "fillstyle": "full"}
        axes.loglog(*zip(*points, strict=True), **look, label=family)
    line: list[tuple[float, float]] = []
    labelled = float("inf")
    for name in data["front"]:
        if line and point(name)[1] > line[-1][1]:
            continue
        line.append(point(name))
        words = name.replace(",", "").split()
        if words[0] == "microslip" and len(words) == 5 and line[-1][1] < 0.6 * labelled:
            labelled = line[-1][1]
            axes.annotate(f"{words[1]}/{words[3]}", line[-1], xytext=(-5, -5), textcoords="offset points", fontsize=7,
                          ha="right", va="top")  # fmt: skip
    axes.loglog(*zip(*line, strict=True), color="black", linewidth=0.8, label="front")
    axes.margins(x=0.12, y=0.09)  # for the labels
    axes.loglog(*point(default), "*", color="#c44e00", markersize=13, markeredgecolor="black", linestyle="none",
                label="default")  # fmt: skip
