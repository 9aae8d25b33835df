"""Work that a contact takes in along a prescribed path, less the energy that it holds: what it gives back shows."""

from functools import lru_cache
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair
from contactlaw.jit import jit
from contactlaw.laws import Law, sectors, torsion
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import PAIR_SIZE, SPUN, ask_energy, pair_of
from contactlaw.laws.step import ask, prescribe
from validation.case import Array

FRICTION, RADIUS, DEEPEST = 0.1, 0.02, 2e-5  # mu; [m]
KINDS = ["steady", "growing", "shrinking", "any", "opening"]
SECTORS = "sectors"  # the way of `laws.sectors`; any other is a law


def pair_of_law(law: str | Law, radius: float | None = RADIUS) -> ContactPair:
    """Steel on steel."""
    return ContactPair(MATERIALS["steel"], MATERIALS["steel"], FRICTION, radius=radius, law=law)


def random_path(rng: np.random.Generator, kind: str, parts: int) -> tuple[Array, Array]:
    """Overlap over the deepest and displacement over that of full slip, a few straight legs in so many parts each."""
    legs = int(rng.integers(3, 10))
    overlap = {
        "steady": np.ones(legs + 1),
        "growing": np.sort(rng.uniform(0.02, 1.0, legs + 1)),
        "shrinking": -np.sort(-rng.uniform(0.02, 1.0, legs + 1)),
        "any": rng.uniform(0.12, 1.0, legs + 1),
        "opening": rng.uniform(-0.3, 1.0, legs + 1),
    }[kind]
    corners = np.cumsum(rng.normal(size=(legs + 1, 2)), axis=0) * 10.0 ** rng.uniform(-2.0, 0.5)
    at = np.linspace(0.0, legs, legs * parts + 1)
    place = np.stack([np.interp(at, np.arange(legs + 1), one) for one in corners.T], 1)
    # pressed in straight before it slides
    return np.append(0.0, np.interp(at, np.arange(legs + 1), overlap)), np.concatenate([place[:1], place])


def in_turn(overlap: Array, place: Array) -> tuple[Array, Array]:
    """The path on which each step changes the load first, then the place.

    Every path is the limit of such. Along them the work of the mean force is exact; where both change at once it is off
    by the square of the step, for any law: Coulomb's own force gives back 1e-3 in 16 steps a leg, 5e-5 in 64.
    """
    return np.repeat(overlap, 2)[1:], np.repeat(place, 2, axis=0)[:-1]


def dissipated(law: str | Law, overlap: Array, place: Array) -> tuple[Array, Array]:
    """Work done on a contact along a path less the energy that it holds, over mu P_max times the length of the path.

    One step from point to point. Overlap and place as in `random_path`; a third column of place is the angle, times the
    radius over the displacement of full slip: the law's springs then have `torsion` and its limit curve with them. The
    second is the force over mu P_max and the moment over that times the radius, shape (n, 3).
    """
    pair, p, header, memory, own = _contact(law)
    unit, radius, out = FRICTION / pair.kappa * DEEPEST, np.sqrt(RADIUS * DEEPEST), np.zeros((overlap.size, 4))
    spins, place = place.shape[1] > 2, np.column_stack([place, np.zeros((len(place), 3 - place.shape[1]))])
    way = 2 if law == SECTORS else int(spins)
    rings, moved = np.zeros(1, np.dtype((np.record, torsion.TORSION))), place * [unit, unit, unit / radius]
    _march(way, p, DEEPEST * overlap, moved, header, memory, own, rings, out)
    limit = FRICTION * 4.0 / 3.0 * pair.effective_modulus * np.sqrt(RADIUS) * DEEPEST**1.5
    force, moved = out[:, :3] / [limit, limit, limit * radius], np.diff(place, axis=0)
    work = np.append(0.0, np.cumsum(0.5 * ((force[1:] + force[:-1]) * moved).sum(axis=1)))
    return (work - out[:, 3] / (limit * unit)) / (np.hypot(*moved[:, :2].T) + np.abs(moved[:, 2])).sum(), force


def over_limit(overlap: Array, force: Array) -> float:
    """The greatest share of a limit, of the force or of the moment, that is used along a path, less 1."""
    x, (f, g, m) = overlap[overlap > 0.0], force[overlap > 0.0].T
    shares = np.hypot(f, g) / x**1.5, np.abs(m) / (torsion.FULL * x**2)
    return float(max(share.max(initial=0.0) for share in shares)) - 1.0


def fall(lost: Array) -> float:
    """Largest energy given back along a path: the deepest fall of what is dissipated."""
    return float((np.maximum.accumulate(lost) - lost).max())


@lru_cache
def _contact(law: str | Law) -> Any:
    pair = pair_of_law("microslip" if law == SECTORS else law)
    header, _ = pair.law.with_nodes(None).new_contact()
    return pair, pair.parameters(), header, np.zeros(pair.memory_size), np.zeros((2, sectors.RINGS, sectors.SECTORS))


@jit
def _march(way, p, overlap, place, header, memory, own, states, out):
    """Force along both tangents [N], moment about the normal [N m] and energy held [J] at each point of a path."""
    state, c, pair, law, most = states[0], header[0], pair_of(p), p[PAIR_SIZE:], np.max(overlap)
    for k in range(overlap.size):
        if k == 0 or overlap[k] <= 0.0:
            prescribe(c, pair, most)
            memory[:], own[:] = 0.0, 0.0
            state.span, state.moment, state.stored, state.missed[:], state.twists[:] = 0.0, 0.0, 0.0, 0.0, 0.0
            continue
        c.before, c.overlap, c.ratio = overlap[k - 1], overlap[k], 1.0
        c.force = c.elastic = elastic_force(c, False, c.overlap)
        moved = place[k, 0] - place[k - 1, 0], place[k, 1] - place[k - 1, 1], place[k, 2] - place[k - 1, 2]
        if way == 2:
            c.state = SPUN
            sectors.advance(c, state, own, pair.g_t, moved)
            held = state.stored
        else:
            if way == 1:
                torsion.advance(state, c, pair, law, memory, moved, (moved[2], c.before), 0.0)
            else:
                ask(c, pair, law, memory, moved[0], moved[1], 0.0)
            held = ask_energy(pair, c, law, memory) + torsion.stored(state, c, pair.g_t)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = c.f, c.g, state.moment, held
