"""Tables of impacts, and the checks of their columns."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks
from contactlaw.collision import Body

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Impacts:
    """A checked table of n impacts."""

    velocities: Array  # V_z1, V_x1, V_z2, V_x2 [m/s], shape (4, n)
    errors: Array  # standard deviations of the velocities [m/s], shape (4, n); all 1 if they are not known
    known_errors: bool
    mass_ratio: float  # m_N/m_T
    own_restitution: bool  # V_z2 was measured, so that its error counts

    @property
    def size(self) -> int:
        """Number of impacts n."""
        return self.velocities.shape[1]

    def chosen(self, used: Mask) -> Impacts:
        """Return the table of the impacts in a mask, shape (n,)."""
        return replace(self, velocities=self.velocities[:, used], errors=self.errors[:, used])

    @property
    def impulse_ratio(self) -> tuple[Array, Array]:
        """Tangential over normal impulse, and its standard deviation, shape (n,); it is mu if everything slides.

        Eq. (6) of Maw, Barber & Fawcett (1981), with V_z1 + V_z2 in place of the 2 V_z1 of an elastic impact.
        """
        z1, x1, z2, x2 = self.velocities
        s_z1, s_x1, s_z2, s_x2 = self.errors
        normal = self.mass_ratio * (z1 + z2)
        ratio = np.sign(x1) * (x1 - x2) / normal
        return ratio, np.sqrt(s_x1**2 + s_x2**2 + (self.mass_ratio * ratio) ** 2 * (s_z1**2 + s_z2**2)) / normal


def velocities_of(before: Sequence[ArrayLike], after: Sequence[ArrayLike | None], restitution: float | None) -> Array:
    """Check the arguments of `calibrate` and return V_z1, V_x1, V_z2, V_x2 [m/s], shape (4, n)."""
    columns = []
    for name, value in (("before", before), ("after", after)):
        try:
            normal, tangential = value
        except (TypeError, ValueError):
            raise ValueError(f"{name} = {reprlib.repr(value)}: must be two arrays, V_z and V_x [m/s]") from None
        if normal is None and name == "after" and restitution is not None:
            normal = restitution * columns[0]
        elif name == "after" and restitution is not None:
            raise ValueError(f"restitution = {restitution!r}: must be None where V_z2 was measured")
        for number, column in enumerate((normal, tangential)):
            if column is None:
                raise ValueError(f"{name}[{number}] = None: only V_z2 may be None, with a restitution")
            array = np.atleast_1d(checks.finite_array(f"{name}[{number}]", column))
            if array.ndim != 1:
                raise ValueError(f"{name}[{number}]: shape {array.shape}; must be (n,)")
            columns.append(array)
    sizes = dict(zip(("V_z1", "V_x1", "V_z2", "V_x2"), (column.size for column in columns), strict=True))
    if len(set(sizes.values())) > 1 or columns[0].size == 0:
        raise ValueError(f"before, after: lengths are {sizes}; must be one length, at least 1")
    for name, column in (("before[0] (V_z1)", columns[0]), ("after[0] (V_z2)", columns[2])):
        if column.min() <= 0.0:
            row = int(np.argmin(column))
            raise ValueError(f"{name}: is {column[row]:g} in impact {row}; speeds of approach and leaving must be > 0")
    least, most = checks.SPEEDS
    out = np.stack(columns)
    if out[::2].min() < least or np.abs(out).max() > most:
        raise ValueError(
            f"before, after: velocities are {out.min():g} to {out.max():g} m/s; must be at most {most:g}, and "
            f"along the normal at least {least:g}"
        )
    return out


def errors_of(name: str, value: ArrayLike, count: int) -> Array:
    """Check standard deviations and return them before and after the impact, shape (2, count)."""
    array = checks.finite_array(name, value)
    if array.shape not in ((), (count,), (2, count)):
        raise ValueError(f"{name}: shape {array.shape}; must be a number, ({count},) or (2, {count})")
    least, most = checks.SPEEDS
    bad = array[(array < least) | (array > most)]
    if bad.size:
        raise ValueError(
            f"{name}: holds {bad.flat[0]:g}; standard deviations must be > 0, in [{least:g}, {most:g}] m/s"
        )
    return np.broadcast_to(array, (2, count))


def mass_ratio_of(inertia_ratio: Any) -> float:
    """m_N/m_T at the contact: 1 + 1/K^2 for a body on a fixed one, else by masses, radii and inertias of the bodies."""
    if not isinstance(inertia_ratio, Body | tuple):
        return 1.0 + 1.0 / checks.positive("inertia_ratio", inertia_ratio)
    bodies = inertia_ratio if isinstance(inertia_ratio, tuple) else (inertia_ratio,)
    if len(bodies) not in (1, 2) or not all(isinstance(body, Body) for body in bodies):
        raise ValueError(f"inertia_ratio = {inertia_ratio!r}: must be K^2 = I/(M L^2) > 0, a Body, or two of them")
    normal = sum(body.inverse_mass for body in bodies)
    if normal == 0.0:
        raise ValueError("inertia_ratio: every body is held fast; at least one mass must be finite")
    turning = sum(body.radius**2 * body.inverse_inertia for body in bodies if np.isfinite(body.radius))
    return float(1.0 + turning / normal)
