"""Reference for the bounce of a soft ball under a steady load, such as its weight, during the contact.

In a hard impact gravity is negligible. A rubber ball touches for milliseconds, and its weight adds some m g T to the
normal impulse, 1 % and more, which changes psi_2 by as much. The normal motion is therefore integrated here with the
load included, and the annulus solver is given that motion.

Units: E* R^(1/2) = m = 1 and approach speed 1; so lengths are in L = (m v^2/(E* R^(1/2)))^(2/5), times in L/v. With d
the overlap and load = g L/v^2,

    d'' = load - P        P = max(k d^(3/2) + alpha sqrt(k) d^(1/4) d', 0)        d(0) = 0, d'(0) = 1

The contact ends when P reaches zero on the way out.

Sources: Hertz law: Johnson, Contact Mechanics (1985), section 11.4; dashpot: Tsuji, Tanaka & Ishida, Powder Technology
71 (1992) 239; tangential response: Maw, Barber & Fawcett (1976, 1981), as in `validation.reference.annulus`.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import sqrt

import numpy as np

from contactlaw import ContactPair

SAMPLES = 1000  # of the normal motion; straight lines between them
ANNULI = 20  # and twice as many, to extrapolate


STAYS = "so large that the body does not leave: its speed or restitution is too low, or its mass too high"


@dataclass(frozen=True)
class LoadedRebound:
    """Result of a loaded impact.

    Attributes:
        psi_2: (kappa/mu) V_x2/V_z1.
        restitution: Normal speed after over V_z1, both where the surfaces would just touch: what is left of the overlap
            at the release is flown through under the load.
        duration: Of the contact, in L/v.
    """

    psi_2: float
    restitution: float
    duration: float


def scaled_load(pair: ContactPair, mass: float, approach: float, pull: float) -> float:
    """The load of a body that is pulled into the surface.

    Args:
        pair: The contact, with its radius.
        mass: Of the body [kg].
        approach: Normal speed before the impact [m/s].
        pull: Acceleration into the surface [m/s^2].
    """
    if pair.radius is None:
        raise ValueError("radius = None: must be given")
    length = (mass * approach**2 / (pair.effective_modulus * sqrt(pair.radius))) ** 0.4
    return pull * length / approach**2


@lru_cache(maxsize=512)
def loaded_rebound(psi_1: float, chi: float, restitution: float, load: float) -> LoadedRebound:
    """An impact under a steady load.

    Args:
        psi_1: (kappa/mu) V_x1/V_z1.
        chi: (kappa/2) m_N/m_T.
        restitution: e of the damper, that of an impact without load.
        load: Acceleration into the surface in v^2/L; below zero away from it.

    Returns:
        The rebound; the annulus solver's error in psi_2 is below 1e-4 for chi up to 1.5.

    Raises:
        ValueError: An argument is outside its range, or the ball does not leave.
    """
    from validation.reference.annulus import along_motion

    time, overlap, speed, force = _normal_motion(restitution, load)
    coarse, fine = (
        float(along_motion(time, overlap, force, psi_1, chi, annuli).psi[-1]) for annuli in (ANNULI, 2 * ANNULI)
    )
    left = speed**2 - 2.0 * load * overlap[-1]
    if left <= 0.0:
        raise ValueError(f"load = {load:.3g}: {STAYS}")
    return LoadedRebound(fine + (fine - coarse) / 3.0, float(np.sqrt(left)), float(time[-1]))


@lru_cache(maxsize=512)
def _normal_motion(restitution: float, load: float) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """Instants, overlap and force, shape (n,) each, and the speed at the release."""
    from scipy.integrate import solve_ivp

    from validation.reference.normal_motion import STIFFNESS, contact_force, damping

    alpha = damping(restitution)

    def rate(_: float, state: np.ndarray) -> list[float]:
        overlap = max(state[0], 0.0)
        return [state[1], load - STIFFNESS * overlap**1.5 - alpha * STIFFNESS**0.5 * overlap**0.25 * state[1]]

    def release(_: float, state: np.ndarray) -> float:
        if state[1] > 0.0:  # the force is zero at the touch too
            return 1.0
        overlap = max(state[0], 0.0)
        return STIFFNESS * overlap**1.25 + alpha * STIFFNESS**0.5 * state[1] if alpha else state[0]

    release.terminal = True  # type: ignore[attr-defined]
    path = solve_ivp(
        rate, (0.0, 100.0 / restitution), [0.0, 1.0], method="DOP853", events=release, dense_output=True, rtol=1e-11,
        atol=1e-13, max_step=0.1,
    )  # fmt: skip
    if not path.t_events[0].size:
        raise ValueError(f"load = {load:.3g}: {STAYS}")
    # Close together at both ends, where the contact radius changes fastest.
    end = float(path.t_events[0][0])
    time = 0.5 * end * (1.0 - np.cos(np.linspace(0.0, np.pi, SAMPLES)))
    overlap, speed = path.sol(time)
    overlap = np.maximum(overlap, 0.0)
    force = contact_force(overlap, speed, alpha)
    force[0] = force[-1] = 0.0
    return time, overlap, float(-speed[-1]), force
