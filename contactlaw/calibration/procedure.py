"""From a table of velocities before and after impacts to restitution, friction and stiffness ratio of a contact.

The procedure of Maw, Barber & Fawcett (1981): impacts that slide throughout give mu by eq. (6), the others then lie on
the curve psi_2(psi_1). Two things are done otherwise. The paper's 2 V_z1 stands for the normal impulse of an elastic
impact and is V_z1 + V_z2 here (1 + e for 2: 3.5 % in mu at e = 0.93). And which impacts slide depends on mu and kappa
themselves, so what the paper does by hand is only the start of a least-squares fit to all impacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.calibration.result import Calibration
from contactlaw.calibration.table import Array, Impacts
from contactlaw.collision import Body


def calibrate(
    before: Sequence[ArrayLike],
    after: Sequence[ArrayLike | None],
    inertia_ratio: float | Body | tuple[Body, Body],
    *,
    normal_error: ArrayLike | None = None,
    tangential_error: ArrayLike | None = None,
    stiffness_ratio: float | None = None,
    hold_stiffness_ratio: bool = False,
    restitution: float | None = None,
) -> Calibration:
    """Restitution, friction and stiffness ratio from a table of n impacts.

    Velocities are those of the contact point of one body relative to the other; `contact_velocities` makes them from
    those of a centre of mass and spins. Any unit of velocity will do, as long as it is the same throughout.

    Args:
        before: (V_z1, V_x1) [m/s], each of shape (n,): speed of approach, > 0, and tangential velocity, any sign.
        after: (V_z2, V_x2) [m/s], each of shape (n,): speed of leaving, > 0, and tangential velocity, counted along the
            same direction as before. V_z2 may be None if the restitution is given.
        inertia_ratio: K^2 = I/(M L^2) of the body that strikes a fixed one, L from its centre to the contact (a solid
            ball 0.4, a disk 0.5); or the `Body`; or two, if both are free (their velocities do not matter).
        normal_error, tangential_error: Standard deviations of the measured velocities [m/s]: a number, shape (n,), or
            (2, n) before and after. None (both): one unknown error in all velocities, told by the scatter.
        stiffness_ratio: kappa to start from, best `ContactPair.kappa`; None: 0.85.
        hold_stiffness_ratio: Take that kappa as known, and fit mu alone.
        restitution: e where V_z2 was not measured.

    Returns:
        Values with uncertainties, and in words (`summary`) what the table cannot tell. A parameter counts as determined
        if its 95 % range is closed and spans less than a factor of 2.5. Impacts too far off to be scatter are left
        out and named, in tables of 8 and more (by chance, in a few of a hundred without any).

    Raises:
        ValueError: An argument is outside its range; the message names it.
    """
    ratio = mass_ratio_of(inertia_ratio)
    given = None if restitution is None else checks.restitution("restitution", restitution)
    kappa = None if stiffness_ratio is None else checks.number(
        "stiffness_ratio", stiffness_ratio, "in [0.2, 3]", low=0.2, high=3.0
    )  # fmt: skip
    if hold_stiffness_ratio and kappa is None:
        raise ValueError("hold_stiffness_ratio = True: needs the stiffness_ratio to hold")
    z1, x1 = _two_columns("before", before)
    z2, x2 = _two_columns("after", after, missing=given is not None)
    if z1 is None or x1 is None or x2 is None:
        raise ValueError("before, after: None stands for V_z2 alone, the first of after")
    if z2 is not None and given is not None:
        raise ValueError(f"restitution = {given!r}: must be None where V_z2 was measured; it is told by the table")
    leaving = (given or 1.0) * z1 if z2 is None else z2
    sizes = {"V_z1": z1.size, "V_x1": x1.size, "V_z2": leaving.size, "V_x2": x2.size}
    if len(set(sizes.values())) > 1 or z1.size == 0:
        raise ValueError(f"before, after: lengths are {sizes}; must be one length, at least 1")
    for name, column in (("before[0] (V_z1)", z1), ("after[0] (V_z2)", leaving)):
        if (column <= 0.0).any():
            row = int(np.argmin(column))
            raise ValueError(f"{name}: is {column[row]:g} in impact {row}; speeds of approach and leaving must be > 0")
    if (normal_error is None) != (tangential_error is None):
        raise ValueError("normal_error, tangential_error: give both, or neither")
    errors = np.ones((4, z1.size))
    if normal_error is not None and tangential_error is not None:
        errors[::2] = _errors("normal_error", normal_error, z1.size)
        errors[1::2] = _errors("tangential_error", tangential_error, z1.size)
    try:
        from contactlaw.calibration.assessment import assess
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "scipy":
            raise
        raise ImportError("calibrate needs scipy: pip install 'contactlaw[calibration]'") from error
    table = Impacts(np.stack([z1, x1, leaving, x2]), errors, normal_error is not None, ratio, z2 is not None)
    return assess(table, given, kappa, hold=hold_stiffness_ratio)


def contact_velocities(normal: ArrayLike, tangential: ArrayLike, spin: ArrayLike, radius: float) -> tuple[Array, Array]:
    """Velocities of the contact point of a ball or puck, as `calibrate` takes them.

    Args:
        normal: Normal speed of the centre of mass [m/s], shape (n,); positive both towards and away from the surface.
        tangential: Tangential velocity of the centre [m/s], shape (n,), any sign.
        spin: [rad/s], shape (n,) or a number; positive for the spin of a ball that rolls along positive tangential
            velocity, so that rolling means V_x = 0. Backspin is negative.
        radius: From the centre of mass to the contact [m].

    Returns:
        V_z and V_x [m/s], each of shape (n,): V_x = tangential - radius spin.

    Raises:
        ValueError: Shapes that do not match, or values out of range.
    """
    arm = checks.positive("radius", radius)
    given = {"normal": normal, "tangential": tangential, "spin": spin}
    arrays = [checks.finite_array(name, value) for name, value in given.items()]
    try:
        z, v, w = np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True))
        raise ValueError(f"{shapes}: must be shapes that broadcast together") from None
    return np.atleast_1d(z).copy(), np.atleast_1d(v - arm * w)


def mass_ratio_of(inertia_ratio: Any) -> float:
    """m_N/m_T at the contact: 1 + 1/K^2 for a body on a fixed one, shared masses and arms for two."""
    if not isinstance(inertia_ratio, Body | tuple):
        return 1.0 + 1.0 / checks.positive("inertia_ratio", inertia_ratio)
    bodies = inertia_ratio if isinstance(inertia_ratio, tuple) else (inertia_ratio,)
    if not bodies or not all(isinstance(body, Body) for body in bodies) or len(bodies) > 2:
        raise ValueError(f"inertia_ratio = {inertia_ratio!r}: must be K^2 = I/(M L^2) > 0, a Body, or two of them")
    normal = sum(body.inverse_mass for body in bodies)
    if normal == 0.0:
        raise ValueError("inertia_ratio: every body is held fast; at least one mass must be finite")
    turning = sum(body.radius**2 * body.inverse_inertia for body in bodies if np.isfinite(body.radius))
    return float(1.0 + turning / normal)


def _two_columns(
    name: str, value: Sequence[ArrayLike | None], *, missing: bool = False
) -> tuple[Array | None, Array | None]:
    """A pair of arrays of shape (n,), the first None where that is allowed."""
    try:
        first, second = value
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r}: must be two arrays, normal and tangential velocities") from None
    columns: list[Array | None] = []
    for number, column in enumerate((first, second)):
        if column is None and missing and number == 0:
            columns.append(None)
            continue
        if column is None:
            raise ValueError(f"{name}[{number}] = None: only V_z2 may be None, with a restitution")
        array = np.atleast_1d(checks.finite_array(f"{name}[{number}]", column))
        if array.ndim != 1:
            raise ValueError(f"{name}[{number}]: shape {array.shape}; must be (n,)")
        columns.append(array)
    return columns[0], columns[1]


def _errors(name: str, value: ArrayLike, count: int) -> Array:
    """Standard deviations before and after, shape (2, n)."""
    array = checks.finite_array(name, value)
    if array.shape not in ((), (count,), (2, count)):
        raise ValueError(f"{name}: shape {array.shape}; must be a number, ({count},) or (2, {count})")
    if (array <= 0.0).any():
        raise ValueError(f"{name}: holds {array.min():g}; standard deviations must be > 0")
    return np.broadcast_to(array, (2, count))
