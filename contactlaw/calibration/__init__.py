"""Friction, restitution and stiffness ratio from a table of impacts, with uncertainties; needs scipy.

Maw, Barber & Fawcett (1981) take mu from impacts that slide throughout, selected by hand, and compare the others with
the curve psi_2(psi_1). Which impacts slide depends on mu and kappa themselves; so here one curve is fitted to all
(`fit`). `assessment` says in words what the table determines.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.calibration.result import Calibration, Estimate
from contactlaw.calibration.table import Array, Impacts, errors_of, mass_ratio_of, velocities_of
from contactlaw.collision import Body

__all__ = ["Calibration", "Estimate", "calibrate", "contact_velocities"]


def calibrate(
    before: Sequence[ArrayLike], after: Sequence[ArrayLike | None], inertia_ratio: float | Body | tuple[Body, Body], *,
    normal_error: ArrayLike | None = None, tangential_error: ArrayLike | None = None,
    stiffness_ratio: float | None = None, hold_stiffness_ratio: bool = False, restitution: float | None = None,
    restitution_law: str | None = None,
) -> Calibration:  # fmt: skip
    """Restitution, friction and stiffness ratio from a table of n impacts.

    Velocities are those of the contact point of one body relative to the other; `contact_velocities` computes them from
    those of a centre of mass and spins. Any unit of velocity will do if all have the same.

    Args:
        before: (V_z1, V_x1) [m/s], each of shape (n,): speed of approach, > 0, and tangential velocity, any sign.
        after: (V_z2, V_x2) [m/s], each of shape (n,): speed of separation, > 0, and tangential velocity, positive in
            the same direction as before. V_z2 may be None if the restitution is given.
        inertia_ratio: K^2 = I/(M L^2) of the body that strikes a fixed one, L from its centre to the contact (a solid
            ball 0.4, a disk 0.5); or the `Body`; or two, if both are free (their velocities do not matter).
        normal_error, tangential_error: Standard deviations of the measured velocities [m/s]: a number, shape (n,), or
            (2, n) before and after. None (both): one unknown error of all velocities, estimated from the scatter.
        stiffness_ratio: kappa to start from, best `ContactPair.kappa`; None: 0.85.
        hold_stiffness_ratio: Whether that kappa is known, so that only mu is fitted.
        restitution: e if V_z2 was not measured.
        restitution_law: Dependence of e on speed (`losses`): "constant", "viscoelastic" or "plastic"; None: the most
            likely, if that is clear (20 to 1).

    Returns:
        Values with uncertainties, and in words (`summary`) what the table does not determine. A parameter counts as
        determined if its 95 % range is closed and spans less than a factor of 2.5. In tables of 8 and more, outliers
        are left out and named (by chance, in a few of a hundred tables that have none).

    Raises:
        ValueError: An argument is outside its range; the message names it.
        ImportError: scipy is missing.
    """
    ratio = mass_ratio_of(inertia_ratio)
    given = None if restitution is None else checks.restitution("restitution", restitution)
    if restitution_law is not None:
        checks.one_of("restitution_law", restitution_law, ["constant", "viscoelastic", "plastic"])
        if given is not None and restitution_law != "constant":
            raise ValueError(f"restitution_law = {restitution_law!r}: needs V_z2, and the restitution is given")
    kappa = None if stiffness_ratio is None else checks.number(
        "stiffness_ratio", stiffness_ratio, "in [0.2, 3]", low=0.2, high=3.0
    )  # fmt: skip
    if checks.truth("hold_stiffness_ratio", hold_stiffness_ratio) and kappa is None:
        raise ValueError("hold_stiffness_ratio = True: needs the stiffness_ratio that is held")
    velocities = velocities_of(before, after, given)
    if (normal_error is None) != (tangential_error is None):
        raise ValueError("normal_error, tangential_error: give both, or neither")
    errors = np.ones_like(velocities)
    if normal_error is not None and tangential_error is not None:
        errors[::2] = errors_of("normal_error", normal_error, errors.shape[1])
        errors[1::2] = errors_of("tangential_error", tangential_error, errors.shape[1])
    checks.need("scipy", "calibrate", "calibration")
    from contactlaw.calibration.assessment import assess

    table = Impacts(velocities, errors, normal_error is not None, ratio, given is None)
    return assess(table, given, kappa, hold=hold_stiffness_ratio, asked=restitution_law)


def contact_velocities(normal: ArrayLike, tangential: ArrayLike, spin: ArrayLike, radius: float) -> tuple[Array, Array]:
    """Velocities of the contact point of a ball or puck, for `calibrate`.

    Args:
        normal: Normal speed of the centre of mass [m/s], shape (n,); positive both towards and away from the surface.
        tangential: Tangential velocity of the centre [m/s], shape (n,), any sign.
        spin: Angular velocity [rad/s], shape (n,) or a number; positive for a ball that rolls along positive tangential
            velocity, so that rolling means V_x = 0. Backspin is negative.
        radius: Distance from the centre of mass to the contact [m].

    Returns:
        V_z and V_x [m/s], each of shape (n,): V_x = tangential - radius spin.

    Raises:
        ValueError: Shapes do not match, or a value is outside its range.
    """
    arm = checks.positive("radius", radius)
    z, v, w = checks.broadcast({"normal": normal, "tangential": tangential, "spin": spin})
    return np.atleast_1d(z).copy(), np.atleast_1d(v - arm * w)
