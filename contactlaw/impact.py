"""One contact without an engine: whole impacts in scaled variables, and forces along a prescribed path."""

from bisect import bisect_left
from functools import lru_cache, partial
from math import ceil, inf, isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks, single
from contactlaw.laws import Law, law_of, oscillator
from contactlaw.laws.base import Array, Impacts
from contactlaw.laws.hertz import LINEAR_STIFFNESS
from contactlaw.laws.normal_motion import normal_motion
from contactlaw.pair import ContactPair, warn_of_depth

# (nodes, steps) of the intervals between these values of chi. The tangential oscillation has sqrt(2 chi) times the
# normal frequency; the faster it is, the finer are the tractions that it leaves across the contact.
CHI_BOUNDS = [1.3, 2.2, 5.0, 10.0, 20.0, 40.0]
RESOLUTION = [(16, 128), (16, 160), (32, 256), (64, 360), (64, 512), (128, 720), (128, 1024)]
MOST_STEPS = 1_000_000  # an impact; the error, 1/steps^2, is rounding by then
STABLE_STEPS = 4.5  # steps an impact over sqrt(chi): twice those at which the leapfrog of a stuck contact is unstable
ROUNDING = 1e-15  # rounding error of coordinates, relative to the largest
SCALED = 0.75, 0.75, 1.0, 1.0  # E*, G*, R and mu of a pair with P = delta^1.5 and kappa = mu = 1


def rebound(
    psi_1: ArrayLike, chi: ArrayLike, law: str | Law = "microslip", restitution: ArrayLike = 1.0, *,
    steps: int | None = None,
) -> float | Array:  # fmt: skip
    """Scaled tangential velocity of the contact point after an impact.

    Args:
        psi_1: (kappa/mu) V_x/V_z1 before the impact, any sign. psi_1, chi and restitution broadcast.
        chi: (kappa/2) m_N/m_T, > 0.
        law: A law or its name in `LAWS`. Fields of a law that have SI units apply to the scaled impact, with
            m = V_z1 = 1 and P = delta^1.5.
        restitution: e in [1e-6, 1].
        steps: Steps per impact; None: 128 to 1024, by chi. `coulomb` needs none.

    Returns:
        psi_2 = (kappa/mu) V_x2/V_z1, scaled by the approach speed; a float if all arguments are scalars.
        Largest error of `microslip` at default settings: below 1e-3 for chi from 0.5 to 2, below 5e-3 up to 4.5.
        Threads of the caller may share a large batch: compiled code releases the GIL.

    Raises:
        ValueError: A value is outside its range; the message names it.
    """
    rule = law_of(law)
    steps = None if steps is None else checks.count("steps", steps, 4, MOST_STEPS)
    given: dict[str, Any] = {"psi_1": psi_1, "chi": chi, "restitution": restitution}
    psi, c, e = given.values()
    one = all(isinstance(value, float) for value in given.values()) and isfinite(psi)
    if one and 0.0 < c < inf and checks.LEAST_RESTITUTION <= e <= 1.0:  # arrays would cost more than the impact does
        return float(_group(np.array([psi]), np.array([c]), float(e), bisect_left(CHI_BOUNDS, c), rule, steps)[0])
    psi, c, e = checks.broadcast(given)
    if (c <= 0.0).any():
        raise ValueError(f"chi = {c[c <= 0.0].flat[0]}: must be > 0")
    if ((e < checks.LEAST_RESTITUTION) | (e > 1.0)).any():
        wrong = e[(e < checks.LEAST_RESTITUTION) | (e > 1.0)].flat[0]
        raise ValueError(f"restitution = {wrong}: must be {checks.RESTITUTIONS}")
    out = _grouped(psi.ravel(), c.ravel(), e.ravel(), rule, steps).reshape(psi.shape)
    return out if psi.ndim else float(out)


def _grouped(psi: Array, chi: Array, e: Array, law: Law, steps: int | None) -> Array:
    """psi_2 of impacts, in groups of one restitution and one resolution, which share their tables."""
    out = np.empty(psi.size)
    classes = np.searchsorted(CHI_BOUNDS, chi)
    for number in np.flatnonzero(np.bincount(classes)):
        in_class = np.flatnonzero(classes == number)
        for restitution in np.unique(e[in_class]):
            chosen = in_class[e[in_class] == restitution]
            out[chosen] = _group(psi[chosen], chi[chosen], float(restitution), int(number), law, steps)
    return out


def _group(psi: Array, chi: Array, restitution: float, chi_class: int, law: Law, steps: int | None) -> Array:
    """psi_2 of a group of impacts with one restitution and one resolution."""
    nodes, default_steps = RESOLUTION[chi_class]
    count = steps or default_steps
    check_steps(count, float(chi.max()))
    out = np.empty(psi.size)
    _impacts(law.with_nodes(nodes), _damping_ratio(restitution), count)(psi, chi, out)
    return law.finite(out)


@lru_cache(maxsize=64)
def _impacts(law: Law, zeta: float, steps: int) -> Impacts:
    """Return the function for whole impacts under a law: its own, or one that integrates them in steps.

    Units are such that m = V_z1 = 1, P = delta^1.5 and kappa = mu = 1.
    """
    if own := law.impacts(zeta, steps):
        return own
    motion = normal_motion(zeta, steps, law.linear)
    deepest = LINEAR_STIFFNESS**-2 if law.linear else motion.deepest  # linear: P = delta
    numbers = law.with_pair(*SCALED, zeta, 1.0, 1.0, 0.0)
    return partial(single.impacts_by_steps, numbers, *law.new_contact(), motion, deepest)


def check_steps(steps: int, chi: float) -> None:
    """Raise ValueError if an impact at this chi is unstable with so few steps."""
    needed = ceil(STABLE_STEPS * sqrt(chi))
    if steps < needed:
        raise ValueError(f"chi = {chi:g}: needs steps >= {needed} to be stable, and several times that to be exact")


_damping_ratio = lru_cache(maxsize=256)(oscillator.damping_ratio)


def force_along_path(pair: ContactPair, approach: ArrayLike, displacement: ArrayLike) -> tuple[Array, Array]:
    """Forces of a contact that is moved slowly along a prescribed path.

    The path starts at zero overlap, runs straight from point to point, and may lose and regain contact.

    Args:
        pair: The contact, with a radius and restitution 1.
        approach: Overlap at each point [m], shape (n,); negative: apart.
        displacement: Tangential displacement of A relative to B [m], shape (n,) along a line or (n, 2) in the plane,
            relative to its first point.

    Returns:
        Normal force [N], shape (n,), and tangential force [N], in the shape of the displacement. The tangential force
        is the one that moves A, positive along a first positive displacement; friction on A is its negative. Along a
        line `microslip` is exact if its number of nodes is left open (`laws.microslip_line`). Otherwise a segment is
        divided into 256 parts per greatest overlap, at most 4096. `linear_spring` takes its stiffness from the greatest
        overlap. Friction that depends on speed has its value at rest.

    Raises:
        ValueError: Shapes do not match, values are not finite, there is no radius, or the restitution is below 1 (a
            slow path has no rate for the damper to act on).
    """
    pair = checks.instance("pair", pair, ContactPair).at(0.0)
    if pair.restitution < 1.0:
        raise ValueError(f"restitution = {pair.restitution!r}: must be 1 here, a prescribed slow path has no rate")
    overlap, motion = checks.finite_array("approach", approach), checks.finite_array("displacement", displacement)
    if overlap.ndim != 1 or overlap.size == 0:
        raise ValueError(f"approach: shape {overlap.shape}; must be (n,) with n >= 1")
    if motion.shape not in (overlap.shape, (overlap.size, 2)):
        raise ValueError(
            f"displacement: shape {motion.shape}; must be ({overlap.size},) or ({overlap.size}, 2) to match approach"
        )
    line, law = motion.ndim == 1, pair.law
    p = pair.parameters()
    warn_of_depth(float(overlap.max()), pair.radius or inf)
    normal = np.empty(overlap.size)
    x, y = (1.0, 0.0) if line else _direction(motion)
    if law.on_line is not None and pair.friction > 0.0 and (x != 0.0 or y != 0.0):
        pull = np.empty(overlap.size)
        law.on_line.force_along_path(p, overlap, motion if line else (motion - motion[0]) @ (x, y), normal, pull)
        return normal, pull if line else np.outer(pull, (x, y))
    plane = np.column_stack([motion, np.zeros(motion.size)]) if line else np.ascontiguousarray(motion)
    tangential = np.empty((overlap.size, 2))
    single.force_along_path(p, overlap, plane, *law.with_nodes(None).new_contact(), normal, tangential)
    law.finite(tangential)
    return normal, tangential[:, 0].copy() if line else tangential


def _direction(displacement: Array) -> tuple[float, float]:
    """Direction of the straight line on which a path (n, 2) runs, up to rounding; (0, 0) if it is not straight."""
    moves = displacement - displacement[0]
    squares = moves[:, 0] * moves[:, 0] + moves[:, 1] * moves[:, 1]
    if not squares.any():
        return 1.0, 0.0
    x, y = moves[np.argmax(squares)] / np.sqrt(squares.max())
    off = np.abs(moves[:, 0] * y - moves[:, 1] * x).max()
    return (x, y) if off <= ROUNDING * np.abs(displacement).max() else (0.0, 0.0)
