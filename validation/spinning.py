"""Energy of contacts that turn, spin and open on prescribed paths: random ones, and the cycle that gives most.

A step may change load and place together, or the load first and then the place ("in turn"): every path is the limit of
such. In turn the work of the mean force is exact, together it is off by the square of the step.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from contactlaw.jit import jit
from contactlaw.laws import sectors, torsion
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import PAIR_SIZE, SPUN, ask_energy, contact_of, pair_of
from contactlaw.laws.step import prescribe
from validation import turning
from validation.case import Array

WAYS = ["sectors", "springs"]  # `laws.sectors`; the law's springs, with `torsion` and its limit curve


def random_path(rng: np.random.Generator, kind: str, parts: int) -> tuple[Array, Array]:
    """`turning.random_path` with an angle, times the radius over the displacement of full slip, as third of place."""
    overlap, place = turning.random_path(rng, kind, parts)
    legs = (overlap.size - 2) // parts
    corners = np.cumsum(rng.normal(size=legs + 1)) * 10.0 ** rng.uniform(-2.0, 0.7)
    angle = np.interp(np.arange(legs * parts + 1) / parts, np.arange(legs + 1), corners)
    return overlap, np.column_stack([place, np.append(angle[0], angle)])


def dissipated(way: str, overlap: Array, place: Array, in_turn: bool) -> tuple[Array, float]:
    """Work less the energy held at each point, over mu P_max times the path's length; most of a limit's share, less 1.

    overlap: over the deepest, (n,). place: (n, 3) as in `random_path`.
    """
    pair, p, header, memory = _contact()
    unit, radius = turning.FRICTION / pair.kappa * turning.DEEPEST, np.sqrt(turning.RADIUS * turning.DEEPEST)
    out, state = np.zeros(overlap.size), np.zeros(1, torsion.TORSION)
    memory[:] = 0.0
    moved = place * [unit, unit, unit / radius]
    over = _ledger(way == "sectors", in_turn, p, turning.DEEPEST * overlap, moved, (header, memory), state, out)
    full = turning.FRICTION * 4.0 / 3.0 * pair.effective_modulus * np.sqrt(turning.RADIUS) * turning.DEEPEST**1.5
    step = np.diff(place, axis=0)
    return out / (full * unit * (np.hypot(step[:, 0], step[:, 1]) + np.abs(step[:, 2])).sum()), over


@lru_cache
def _contact() -> Any:
    pair = turning.pair_of_law("microslip")
    header, _ = pair.rule.with_nodes(None).new_contact()
    return pair, pair.parameters(), header, np.zeros(pair.memory_size)


@jit
def _ledger(by_sectors, in_turn, p, overlap, place, contact_and_memory, states, out):
    """Work less energy [J] at each point of a path; returns the greatest share of a limit that is used, less 1."""
    header, memory = contact_and_memory
    own, law = memory[: sectors.NUMBERS].reshape((2, sectors.RINGS, sectors.SECTORS)), p[PAIR_SIZE:]
    state, c, pair, most = states[0], contact_of(header), pair_of(p), np.max(overlap)
    work, over, f, g, m = 0.0, -1.0, 0.0, 0.0, 0.0
    prescribe(c, pair, most)
    for k in range(1, overlap.size):
        for leg in range(2 if in_turn else 1):
            c.before, c.overlap, c.ratio = overlap[k - 1] if leg == 0 else overlap[k], overlap[k], 1.0
            if c.overlap <= 0.0:
                prescribe(c, pair, most)
                memory[:] = 0.0
                state.span, state.moment, state.stored = 0.0, 0.0, 0.0
                state.missed[:], state.twists[:] = 0.0, 0.0
                f, g, m = 0.0, 0.0, 0.0
                continue
            c.force = c.elastic = elastic_force(c, False, c.overlap)
            share = 0.0 if in_turn and leg == 0 else 1.0
            du, dv = share * (place[k, 0] - place[k - 1, 0]), share * (place[k, 1] - place[k - 1, 1])
            angle = share * (place[k, 2] - place[k - 1, 2])
            if by_sectors:
                c.state = SPUN
                sectors.advance(c, state, own, pair.g_t, (du, dv, angle))
            else:
                torsion.advance(state, c, pair, law, memory, (du, dv, angle), c.before, 0.0)
            work += 0.5 * ((f + c.f) * du + (g + c.g) * dv + (m + state.moment) * angle)
            f, g, m, limit = c.f, c.g, state.moment, pair.friction * c.force
            over = max(over, np.sqrt(f * f + g * g) / limit - 1.0)
            over = max(over, abs(m) / (torsion.FULL * limit * np.sqrt(c.radius * c.overlap)) - 1.0)
        held = state.stored
        if c.overlap > 0.0 and not by_sectors:
            held = ask_energy(pair, c, law, memory) + torsion.stored(state, c, pair.g_t)
        out[k] = work - held
    return over


def most_given(way: str, count: int, seed: int = 3) -> dict[str, float]:
    """By kind of load, the most that random paths give back, in turn in steps of any size; "together": in 16 a leg."""
    rng, found = np.random.default_rng(seed), {"cone": -1.0, "together": 0.0}
    for kind in turning.KINDS:
        found[kind] = 0.0
        for trial in range(count):
            in_turn = kind != "steady" and trial % 4 > 0
            parts = (1, 4, 16)[trial % 3] if in_turn or kind == "steady" else 16
            lost, over = dissipated(way, *random_path(rng, kind, parts), in_turn)
            name = kind if in_turn or kind == "steady" else "together"
            found[name], found["cone"] = max(found[name], turning.fall(lost)), max(found["cone"], over)
    return found


def worst_cycle(way: str, rng: np.random.Generator, corners: int, parts: int, in_turn: bool, looks: int) -> float:
    """The most that a closed cycle gives back each time, over mu P_max and its length; found by climbing from chance.

    Corners and loads are moved at random by steps that shrink where nothing is gained, and the cycle made wider.
    """

    def gain(x: Array) -> float:
        overlap, place = 0.03 + 0.97 / (1.0 + np.exp(-np.clip(x[:, 0], -30.0, 30.0))), x[:, 1:]
        at = np.linspace(0.0, corners, corners * parts + 1)
        ring = np.arange(corners + 1)
        one = np.stack([np.interp(at, ring, np.append(v, v[0])) for v in (overlap, *place.T)], 1)
        path = np.concatenate([[[0.0, *one[0, 1:]]], one[:1], *[one[1:]] * 4])
        lost, _ = dissipated(way, path[:, 0] / path[:, 0].max(), path[:, 1:], in_turn)
        turn = corners * parts
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
