"""One contact without an engine: a whole impact in scaled variables, and the forces along a prescribed path."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from math import ceil, inf, isfinite, sqrt

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks, single
from contactlaw.laws import Law, law_of, oscillator
from contactlaw.laws.base import Array, Impacts
from contactlaw.laws.hertz import LINEAR_STIFFNESS
from contactlaw.laws.normal_motion import normal_motion
from contactlaw.laws.record import PAIR
from contactlaw.pair import ContactPair, warn_of_depth

# Nodes and steps by chi: the tangential oscillation has sqrt(2 chi) times the normal frequency, and the faster it is
# the finer its traces across the contact.
CHI_BOUNDS = [1.3, 2.2, 5.0, 10.0, 20.0, 40.0]
PART = 8192  # impacts that a thread takes at a time
RADIUS_AT = (PAIR.names or ()).index("radius")
STABLE_STEPS = 4.5  # per contact, times sqrt(chi): twice those at which a stuck contact, a leapfrog, grows
SCALED = 0.75, 0.75, 1.0, 1.0  # E*, G*, R and mu of a pair with P = delta^1.5 and kappa = mu = 1
RESOLUTION = [(16, 128), (16, 160), (32, 256), (64, 360), (64, 512), (128, 720), (128, 1024)]


def rebound(
    psi_1: ArrayLike,
    chi: ArrayLike,
    law: str | Law = "microslip",
    restitution: ArrayLike = 1.0,
    *,
    steps: int | None = None,
    threads: int = 1,
) -> float | Array:
    """Scaled tangential velocity of the contact point after an impact.

    Args:
        psi_1: (kappa/mu) V_x/V_z1 before, any sign. The arrays broadcast.
        chi: (kappa/2) m_N/m_T, > 0.
        law: Name in `LAWS`, or a law. One with numbers in SI units sees the scaled impact, m = V_z1 = 1 and P =
            delta^1.5.
        restitution: e, in [1e-6, 1].
        steps: Steps per impact; None: from chi, 128 to 1024. `coulomb` takes none.
        threads: How many threads share a large batch, >= 1; the results do not depend on it.

    Returns:
        psi_2 = (kappa/mu) V_x2/V_z1, scaled by the approach speed; a float where all arguments are scalars.
        Largest error of `microslip` at default settings: below 1e-3 for chi from 0.5 to 2, below 5e-3 up to 4.5.

    Raises:
        ValueError: A value outside its range; the message names it.
    """
    rule = law_of(law)
    if steps is not None and not (isinstance(steps, int | np.integer) and not isinstance(steps, bool) and steps >= 4):
        raise ValueError(f"steps = {steps!r}: must be None or an integer >= 4")
    threads = checks.count("threads", threads, 1)
    given = {"psi_1": psi_1, "chi": chi, "restitution": restitution}
    if all(isinstance(value, float) for value in given.values()):  # one impact: no time for arrays
        one = float(psi_1), float(chi), float(restitution)  # type: ignore[arg-type]
        return _single(*one, rule, steps)
    arrays = [checks.finite_array(name, value) for name, value in given.items()]
    try:
        psi, c, e = arrays if all(array.ndim == 0 for array in arrays) else np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True))
        raise ValueError(f"{shapes}: must be shapes that broadcast together") from None
    if (c <= 0.0).any():
        raise ValueError(f"chi = {c[c <= 0.0].flat[0]}: must be > 0")
    if ((e < checks.LEAST_RESTITUTION) | (e > 1.0)).any():
        wrong = e[(e < checks.LEAST_RESTITUTION) | (e > 1.0)].flat[0]
        raise ValueError(f"restitution = {wrong}: must be {checks.RESTITUTIONS}")
    out = _grouped(psi.ravel(), c.ravel(), e.ravel(), rule, steps, threads).reshape(psi.shape)
    return out if psi.ndim else float(out)


def _single(psi_1: float, chi: float, restitution: float, law: Law, steps: int | None) -> float:
    """One impact."""
    if not isfinite(psi_1):
        raise ValueError(f"psi_1: holds {psi_1}; every value must be finite")
    if not 0.0 < chi < inf:
        raise ValueError(f"chi = {chi}: must be finite and > 0")
    if not checks.LEAST_RESTITUTION <= restitution <= 1.0:
        raise ValueError(f"restitution = {restitution}: must be {checks.RESTITUTIONS}")
    chi_class = bisect_left(CHI_BOUNDS, chi)
    return float(_group(np.array([psi_1]), np.array([chi]), restitution, chi_class, law, steps)[0])


def _grouped(psi: Array, chi: Array, e: Array, law: Law, steps: int | None, threads: int) -> Array:
    """Divide the impacts into groups that share their tables."""
    out = np.empty(psi.size)
    classes = np.searchsorted(CHI_BOUNDS, chi)
    for number in np.flatnonzero(np.bincount(classes)):
        in_class = np.flatnonzero(classes == number)
        for restitution in np.unique(e[in_class]):
            chosen = in_class[e[in_class] == restitution]
            out[chosen] = _group(psi[chosen], chi[chosen], float(restitution), int(number), law, steps, threads)
    return out


def _group(
    psi: Array, chi: Array, restitution: float, chi_class: int, law: Law, steps: int | None, threads: int = 1
) -> Array:
    """psi_2 of impacts with one restitution and one resolution."""
    nodes, default_steps = RESOLUTION[chi_class]
    count = steps or default_steps
    check_steps(count, float(chi.max()))
    run, out = _impacts(law.with_nodes(nodes), _damping_ratio(restitution), count), np.empty(psi.size)
    _share(lambda part: run(psi[part], chi[part], out[part]), psi.size, threads)
    return out


@lru_cache(maxsize=64)
def _impacts(law: Law, zeta: float, steps: int) -> Impacts:
    """Whole impacts by a law: by its own way, or in steps."""
    return law.impacts(zeta, steps) or partial(_by_steps, law, zeta, steps)


def _by_steps(law: Law, zeta: float, steps: int, psi: Array, chi: Array, out: Array) -> None:
    """Whole impacts in steps, scaled so that m = V_z1 = 1, P = delta^1.5 and kappa = mu = 1."""
    motion = normal_motion(zeta, steps, law.linear)
    deepest = LINEAR_STIFFNESS**-2 if law.linear else float(motion.delta.max())  # the former: P = delta
    single.impacts_by_steps(
        law.with_pair(*SCALED, zeta, 1.0, 1.0, 0.0), *law.new_contact(), motion, deepest, psi, chi, out
    )


def _share(run: Callable[[slice], object], size: int, threads: int) -> None:
    """Let threads share a batch, in parts small enough that none waits long for the others."""
    if threads == 1 or size <= PART:
        run(slice(None))
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(run, (slice(start, start + PART) for start in range(0, size, PART))))


def nodes_for(chi: float) -> int:
    """Nodes of the microslip law for an impact at this chi."""
    return RESOLUTION[bisect_left(CHI_BOUNDS, chi)][0]


def check_steps(steps: int, chi: float) -> None:
    """Refuse fewer steps than an impact at this chi is stable with."""
    needed = ceil(STABLE_STEPS * sqrt(chi))
    if steps < needed:
        raise ValueError(f"chi = {chi:g}: needs steps >= {needed} to be stable, and several times that to be exact")


_damping_ratio = lru_cache(maxsize=256)(oscillator.damping_ratio)


def force_along_path(pair: ContactPair, approach: ArrayLike, displacement: ArrayLike) -> tuple[Array, Array]:
    """Forces of a contact moved slowly along a prescribed path.

    The path starts where the bodies touch, goes straight from point to point, and may leave and touch again.

    Args:
        pair: The contact, with a radius and restitution 1.
        approach: Overlap at each point [m], shape (n,); below zero: apart.
        displacement: Tangential displacement of A relative to B [m], shape (n,) along a line or (n, 2) in the plane;
            counted from its first point.

    Returns:
        Normal force [N], shape (n,), and tangential force [N], shaped as the displacement, positive along a first
        positive displacement (it is the force that moves A; friction on A is its negative). On a line, `microslip`
        with its number of nodes left open is exact (`laws.microslip_line`). Otherwise segments are divided into at most
        4096 parts, 256 to the greatest overlap. `linear_spring` takes its stiffness from that overlap.

    Raises:
        ValueError: Shapes that do not match, values not finite, no radius, or restitution below 1 (a slow path has no
            rate for the damper to act on). Friction over speed is that at rest.
    """
    pair = pair.at(0.0)
    if pair.restitution < 1.0:
        raise ValueError(f"restitution = {pair.restitution!r}: must be 1 here, a prescribed slow path has no rate")
    overlap, motion = checks.finite_array("approach", approach), checks.finite_array("displacement", displacement)
    if overlap.ndim != 1 or overlap.size == 0:
        raise ValueError(f"approach: shape {overlap.shape}; must be (n,) with n >= 1")
    if motion.shape not in (overlap.shape, (overlap.size, 2)):
        raise ValueError(
            f"displacement: shape {motion.shape}; must be ({overlap.size},) or ({overlap.size}, 2) to match approach"
        )
    line, law = motion.ndim == 1, pair.rule
    p = pair.parameters()
    warn_of_depth(float(overlap.max()), float(p[RADIUS_AT]))
    normal = np.empty(overlap.size)
    x, y = (1.0, 0.0) if line else single.direction(motion)
    if law.on_line is not None and pair.friction > 0.0 and (x != 0.0 or y != 0.0):
        pull = np.empty(overlap.size)
        law.on_line.force_along_path(p, overlap, motion if line else (motion - motion[0]) @ (x, y), normal, pull)
        return normal, pull if line else np.outer(pull, (x, y))
    plane = np.column_stack([motion, np.zeros(motion.size)]) if line else np.ascontiguousarray(motion)
    tangential = np.empty((overlap.size, 2))
    single.force_along_path(p, overlap, plane, *law.with_nodes(None).new_contact(), normal, tangential)
    return normal, tangential[:, 0].copy() if line else tangential
