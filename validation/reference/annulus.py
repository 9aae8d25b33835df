"""The annulus solver: partial slip on a Hertz contact whose size changes, the reference that judges the contact laws.

Contact radius cut into N equal annuli; axisymmetric traction; stick and slip guessed per annulus and corrected in each
step, coupled with the body's tangential momentum. The compiled core is in annulus_kernel.py, where the equations stand;
the normal motion of an impact in normal_motion.py. Second order in 1/N.

Limits: for psi_1 below about 0.1 slip is a ring thinner than an annulus; the error of psi_2 stays small, but not
against psi_1, and some tangential energy is created (it vanishes as N grows).

Restitution < 1: the damper does not touch the elastic contact. Tractions q, stick and slip are those of the undamped
theory, with the limits mu p_Hertz(r) of the overlap that the damped motion follows; the damper changes the total normal
force, and friction carries the same mobilised share of it, F = (P/P_Hertz) times the sum of q. At P = 0 the impact is
over. As F is then not the sum of q, tangential energy can rise while the normal motion loses some (seen: by a tenth of
its first value, never above that value).

Scaled quantities: psi = (kappa/mu) V_x/V_z1, chi = (kappa/2) m_N/m_T; forces F/mu; displacements kappa s_x/mu.

Sources: Maw, Barber & Fawcett, Wear 38 (1976) 101-114; J. Lubr. Tech. 103 (1981) 74-80.
"""

import math
from dataclasses import replace
from itertools import pairwise

from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array, impact_motion
from validation.reference.paths import along_motion, force_along_path
from validation.reference.refinement import broadcast
from validation.reference.response import History, rings, solve

__all__ = ["History", "along_motion", "force_along_path", "impact", "rebound", "rebound_extrapolated"]

STEPS_PER_ANNULUS = 16  # with these the error of time stepping is about a tenth of that of the annuli
ANNULI_TO_EXTRAPOLATE = 40  # the middle one of three resolutions, up to chi = 3


def rebound(
    psi_1: ArrayLike, chi: ArrayLike, annuli: int = 20, *, restitution: ArrayLike = 1.0, steps: int | None = None
) -> float | Array:
    """Rebound psi_2 = (kappa/mu) V_x2/V_z1, told as `impact` is: a float for scalars, arrays broadcast."""
    return broadcast(lambda psi, ratio, e: _history(psi, ratio, annuli, e, steps).psi_2, psi_1, chi, restitution)


def rebound_extrapolated(
    psi_1: float, chi: float, restitution: float = 1.0, *, annuli: int | None = None
) -> tuple[float, float]:
    """psi_2 by Richardson extrapolation from N and 2N as of second order, and its change from that with N/2 and N.

    annuli: N, by default 40, above chi = 3 80.

    Raises:
        ValueError: N cannot be halved.
    """
    if annuli is None:
        annuli = ANNULI_TO_EXTRAPOLATE * (1 if chi <= 3.0 else 2)
    if annuli < 4 or annuli % 2:
        raise ValueError(f"annuli is {annuli!r}; to be halved it must be even and at least 4")
    levels = [float(rebound(psi_1, chi, n, restitution=restitution)) for n in (annuli // 2, annuli, 2 * annuli)]
    coarse, fine = (second + (second - first) / 3.0 for first, second in pairwise(levels))
    return fine, abs(fine - coarse)


def impact(
    psi_1: float, chi: float, annuli: int = 20, *, restitution: float = 1.0, steps: int | None = None
) -> History:
    """One impact with its whole history, normalised: by its duration, largest overlap, force, radius and pressure, and
    initial energy (1/(4 chi) for psi_1 = 0). annuli: N >= 2; steps: at least; None: in step with annuli and chi."""
    h = _history(psi_1, chi, annuli, restitution, steps)
    force, pressure = h.normal_force.max(), h.pressure.max()
    return replace(
        h, time=h.time / h.time[-1], overlap=h.overlap / h.overlap.max(), normal_force=h.normal_force / force,
        tangential_force=h.tangential_force / force, radii=h.radii / h.boundaries[-1], pressure=h.pressure / pressure,
        boundaries=h.boundaries / h.boundaries[-1], traction=h.traction / pressure,
        energy=h.energy / (h.energy[0] or 0.25 / chi),
    )  # fmt: skip


def _history(psi_1: float, chi: float, annuli: int, restitution: float, steps: int | None) -> History:
    if steps is None:
        # The tangential oscillation quickens with sqrt(chi). Rounded up, so that few motions need integrating.
        steps = STEPS_PER_ANNULUS * annuli * math.ceil(2.0 * math.sqrt(max(chi, 1.0))) // 2
    motion = impact_motion(float(restitution), int(annuli), int(steps))
    return solve(motion, *rings(motion.overlap, annuli), psi_1=float(psi_1), chi=float(chi))
