"""Energy of contacts that turn, spin and open: what random paths give back at most, and the cycle that gives most."""

import numpy as np

from contactlaw.laws import Law
from validation import ledger
from validation.case import Array

WAYS = {"sectors": ledger.SECTORS, "springs": "microslip"}


def random_path(rng: np.random.Generator, kind: str, parts: int) -> tuple[Array, Array]:
    """`ledger.random_path` with an angle as third of place."""
    overlap, place = ledger.random_path(rng, kind, parts)
    legs = (overlap.size - 2) // parts
    corners = np.cumsum(rng.normal(size=legs + 1)) * 10.0 ** rng.uniform(-2.0, 0.7)
    angle = np.interp(np.arange(legs * parts + 1) / parts, np.arange(legs + 1), corners)
    return overlap, np.column_stack([place, np.append(angle[0], angle)])


def dissipated(way: str | Law, overlap: Array, place: Array, in_turn: bool) -> tuple[Array, float]:
    """Of `ledger.dissipated`, by one of `WAYS` or a law, what is lost at each point; the most of a limit's share, less
    1."""
    path = ledger.in_turn(overlap, place) if in_turn else (overlap, place)
    lost, force = ledger.dissipated(WAYS.get(way, way) if isinstance(way, str) else way, *path)
    return lost[:: 2 if in_turn else 1], ledger.over_limit(path[0], force)


def most_given(way: str | Law, count: int, seed: int = 3, *, spins: bool = True) -> dict[str, float]:
    """By kind of load, the most that random paths, with an angle or without, give back, load and place in turn in steps
    of any size; "together": at once in 16 a leg; "cone": how far forces pass their limit."""
    draw, rng = (random_path if spins else ledger.random_path), np.random.default_rng(seed)
    found = {"cone": -1.0, "together": 0.0} | dict.fromkeys(ledger.KINDS, 0.0)
    for kind in ledger.KINDS:
        for trial in range(count):
            in_turn = kind != "steady" and trial % 4 > 0
            together = kind != "steady" and not in_turn
            lost, over = dissipated(way, *draw(rng, kind, 16 if together else (1, 4, 16)[trial % 3]), in_turn)
            name = "together" if together else kind
            found[name], found["cone"] = max(found[name], ledger.fall(lost)), max(found["cone"], over)
    return found


def worst_cycle(way: str, rng: np.random.Generator, corners: int, parts: int, in_turn: bool, looks: int) -> float:
    """The most that a closed cycle gives back each time, over mu P_max and its length; found by climbing from chance.

    Corners and loads are moved at random by steps that shrink where nothing is gained, and the cycle made wider.
    """
    turn = corners * parts

    def gain(x: Array) -> float:
        overlap, ring = 0.03 + 0.97 / (1.0 + np.exp(-np.clip(x[:, 0], -30.0, 30.0))), np.arange(corners + 1)
        at = np.linspace(0.0, corners, turn + 1)
        one = np.stack([np.interp(at, ring, np.append(v, v[0])) for v in (overlap, *x[:, 1:].T)], 1)
        path = np.concatenate([[[0.0, *one[0, 1:]]], one[:1], *[one[1:]] * 4])
        lost, _ = dissipated(way, path[:, 0] / path[:, 0].max(), path[:, 1:], in_turn)
        return 4.0 * float(lost[-1 - turn] - lost[-1])

    x, size = rng.normal(size=(corners, 4)) * 10.0 ** rng.uniform(-1.0, 0.5), 0.5
    best = gain(x)
    for _ in range(looks):
        new = x + size * rng.normal(size=x.shape) * (rng.random(x.shape) < 0.3) * np.abs(x).mean()
        new[:, 1:] *= np.exp(size * rng.normal())
        found = gain(new)
        size *= 1.3 if found > best else 0.97
        if found > best:
            x, best = new, found
    return best
