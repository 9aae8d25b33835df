"""The annulus solver along a path given by samples, with instants added so that every annulus enters at one of them."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.reference.normal_motion import Array, NormalMotion, hertz_force
from validation.reference.response import History, rings, solve

STEPS_PER_ANNULUS = 4  # instants while the contact edge, or the displacement, moves by one annulus
MOST_STEPS = 8  # per annulus in all: a stroke this long slides anyhow


def _refine(overlap: Array, displacement: Array, points: Array) -> tuple[Array, NDArray[np.int64]]:
    """Positions along a path where the solver should stop, and the indices among them of the given samples.

    Positions count samples, from 0 to n - 1: 2.25 lies a quarter of the way from sample 2 to 3; between samples overlap
    and scaled displacement (zeros if it is not known yet), shape (n,), run straight. points: radii where the annuli are
    watched, rising from zero.
    """
    width = points[-1] / (points.size - 0.5)
    radius = np.sqrt(np.maximum(overlap, 0.0))
    stroke = np.abs(np.diff(radius)) / width + np.abs(np.diff(displacement)) / (points.size * width * width)
    divisions = np.clip(np.ceil(STEPS_PER_ANNULUS * stroke), 1, MOST_STEPS * points.size).astype(int)
    pieces = []
    for k, (division, rise) in enumerate(zip(divisions, np.diff(overlap), strict=True)):
        crossings = (points**2 - overlap[k]) / rise if rise else np.empty(0)
        inside = crossings[(crossings > 0.0) & (crossings < 1.0)]
        pieces.append(k + np.union1d(np.arange(division) / division, inside))
    given = np.cumsum([0, *(piece.size for piece in pieces)])
    return np.concatenate([*pieces, [overlap.size - 1.0]]), given


def _at(positions: Array, samples: Array) -> Array:
    """Samples, shape (n,), interpolated at positions counted in samples."""
    return np.interp(positions, np.arange(samples.size), samples)


def along_motion(
    time: ArrayLike, overlap: ArrayLike, normal_force: ArrayLike, psi_1: float, chi: float, annuli: int = 20
) -> History:
    """Free tangential motion of a body whose normal motion is given, in units of E* = R = m_N = 1.

    Rising instants, overlap, zero or less out of contact, and P >= 0 with the damper's part if there is one, shape (n,)
    each. The response is that at these instants; between them more are added, on straight lines in overlap and P.
    """
    instants, depth, force = (np.array(one, dtype=float) for one in (time, overlap, normal_force))
    boundaries, points = rings(depth, annuli)
    positions, given = _refine(depth, np.zeros_like(depth), points)
    fine_time, fine_force = _at(positions, instants), _at(positions, force)
    impulse = np.append(0.0, 0.5 * (fine_force[1:] + fine_force[:-1]) * np.diff(fine_time))
    motion = NormalMotion(fine_time, np.maximum(_at(positions, depth), 0.0), fine_force, impulse)
    history = solve(motion, boundaries, points, psi_1=float(psi_1), chi=float(chi))
    chosen = {f.name: getattr(history, f.name)[given] for f in fields(history) if f.name not in ("boundaries", "radii")}
    return replace(history, **chosen)


def force_along_path(
    approach: ArrayLike, displacement: ArrayLike, *, kappa: float = 1.0, friction: float = 1.0, annuli: int = 40
) -> Array:
    """Tangential force along a prescribed quasi-static motion that begins without traction, with E* = R = 1.

    Overlap and displacement s_x, shape (n,); the force, shape (n,), is positive along a first displacement.
    """
    depth, scaled = np.array(approach, dtype=float), np.array(displacement, dtype=float) * (kappa / friction)
    boundaries, points = rings(depth, annuli)
    positions, given = _refine(depth, scaled, points)
    fine_depth = np.maximum(_at(positions, depth), 0.0)
    motion = NormalMotion(positions, fine_depth, hertz_force(fine_depth), np.zeros_like(positions))
    history = solve(motion, boundaries, points, displacement=_at(positions, scaled))
    return friction * history.tangential_force[given]
