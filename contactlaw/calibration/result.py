"""The result of a calibration: parameters with uncertainties, and in words what the table does not determine."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.calibration.table import Array
from contactlaw.impact import rebound
from contactlaw.losses import OverSpeed, Viscoelastic
from contactlaw.material import Material
from contactlaw.pair import ContactPair

REGIMES = SLIDES, SLIDES_FIRST, STICKS_FIRST, UNKNOWN = (
    "slides throughout", "slides, then sticks", "starts stuck", "unclear",
)  # fmt: skip

SURE = 1e-6  # uncertainty over the value: below, all digits that are shown are certain
NAMED = 10  # outliers that a verdict names, at most


@dataclass(frozen=True)
class Estimate:
    """Estimate of one parameter. No field is ever NaN; an unknown value is None.

    Attributes:
        status: "measured"; "given": by the user, not by the table; "not determined".
        value: The value; None if it is not determined.
        uncertainty: Standard uncertainty (one standard deviation); None if it is not known.
        lower, upper: 95 % range; None: open on that side.
        note: Remarks in words.
    """

    status: Literal["measured", "given", "not determined"]
    value: float | None = None
    uncertainty: float | None = None
    lower: float | None = None
    upper: float | None = None
    note: str = ""

    def __str__(self) -> str:
        if self.value is None:
            bounds = [f"at least {self.lower:.3g}"] if self.lower is not None else []
            bounds += [f"at most {self.upper:.3g}"] if self.upper is not None else []
            return f"not determined{': ' if bounds else ''}{', '.join(bounds)}"
        if self.status == "given":
            return f"{self.value:.4g} (given)"
        if self.uncertainty is None:
            return f"{self.value:.4g} (uncertainty not known)"
        if self.uncertainty <= SURE * abs(self.value):
            return f"{self.value:.6g} (to a millionth or better)"
        digits = int(np.clip(1 - np.floor(np.log10(self.uncertainty)), 0, 8))
        relative = f" ({100.0 * self.uncertainty / abs(self.value):.2g} %)" if self.value != 0.0 else ""
        return f"{self.value:.{digits}f} +- {self.uncertainty:.{digits}f}{relative}"


@dataclass(frozen=True)
class OverSpeedFit:
    """Restitution over speed, fitted to a table.

    Attributes:
        law: The law, for `ContactPair`; speeds in the unit of the table.
        number: The fitted parameter: e at the middle speed of the table (viscoelastic), or the yield speed (plastic).
        note: Which other law fits as well, in words.
    """

    law: OverSpeed
    number: Estimate
    note: str = ""

    def __str__(self) -> str:
        what = f"e at {self.law.speed:.3g}" if isinstance(self.law, Viscoelastic) else "yield speed"
        return f"{self.law.name}, {what} {self.number}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration:
    """Result of `calibrate`.

    Uncertainties account for random errors of the velocities, given or estimated from the scatter, whichever is larger.
    1.96 times an uncertainty is half the 95 % range, which is wider than normal if few impacts give the scatter. Errors
    that all impacts share (a scale, an angle of the camera) and errors of the law are not included.

    Attributes:
        restitution: e, weighted mean of V_z2/V_z1.
        friction: mu of the fit to all impacts.
        stiffness_ratio: kappa of the fit.
        sliding_friction: mu of the impacts that slide throughout alone, as in the paper.
        regimes: For each impact "slides throughout", "slides, then sticks", "starts stuck", or "unclear".
        outliers: Indices of impacts that lie farther off than scatter explains; they were left out.
        before, after: The table, V_z and V_x [m/s], shape (2, n); V_z2 is e V_z1 if it was not measured.
        residuals: V_x2 less the curve [m/s], shape (n,); zero if there is no curve.
        residual_rms: Root mean square of the residuals of the impacts used [m/s].
        degrees_of_freedom: Number of impacts used less parameters on which the residuals depend.
        chi_squared: chi^2 per degree of freedom, about 1 if law and errors fit; None without given errors.
        scatter: Error of a velocity that the residuals indicate [m/s]; None with given errors.
        mass_ratio: m_N/m_T.
        restitution_law: Restitution over speed; None if the table shows no clear dependence.
        curve_parameters: mu and kappa of the nearest curve, one of many if they are not determined; None: no curve.
    """

    restitution: Estimate
    friction: Estimate
    stiffness_ratio: Estimate
    sliding_friction: Estimate
    regimes: tuple[str, ...]
    outliers: tuple[int, ...] = ()
    before: Array = field(repr=False)
    after: Array = field(repr=False)
    residuals: Array = field(repr=False)
    residual_rms: float = 0.0
    degrees_of_freedom: int = 0
    chi_squared: float | None = None
    scatter: float | None = None
    mass_ratio: float
    curve_parameters: tuple[float, float] | None = None
    restitution_law: OverSpeedFit | None = None

    def count(self, regime: str) -> int:
        """Number of impacts in a regime."""
        return self.regimes.count(regime)

    @property
    def mean_restitution(self) -> float:
        """e of the curve: the mean, at most 1."""
        return min(self.restitution.value or 1.0, 1.0)

    def curve(self, incidence: ArrayLike) -> Array:
        """Return V_x2/V_z1 of the nearest curve at V_x1/V_z1, of any shape; ValueError if there is no curve."""
        if self.curve_parameters is None:
            raise ValueError(f"curve: there is none. {self.friction.note}")
        mu, kappa = self.curve_parameters
        t = checks.finite_array("incidence", incidence)
        chi = 0.5 * kappa * self.mass_ratio
        return mu / kappa * np.asarray(rebound(kappa / mu * t, chi, restitution=self.mean_restitution))

    def pair(self, a: Material, b: Material) -> ContactPair:
        """Return the pair of two materials with the measured values; kappa is theirs if it is not determined.

        Raises:
            ValueError: The friction is not determined.
        """
        if self.friction.value is None:
            raise ValueError(f"friction = {self.friction}: give the pair a value of your own")
        kappa = self.stiffness_ratio.value
        e = self.mean_restitution if self.restitution_law is None else self.restitution_law.law
        return ContactPair(a, b, self.friction.value, e, stiffness_ratio=kappa)

    @property
    def verdict(self) -> str:
        """What the table determines and what it does not, in words."""
        told = (self.friction, self.stiffness_ratio, self.restitution, self.restitution_law)
        parts = [one.note for one in told if one is not None and one.note]
        if self.outliers:
            named, more = ", ".join(str(index) for index in self.outliers[:NAMED]), len(self.outliers) - NAMED
            named += f" and {more} more" if more > 0 else ""
            parts.append(f"Left out as too far off to be scatter: impact {named} (counted from 0); look at it again.")
        if self.chi_squared is not None and self.degrees_of_freedom > 0:
            allowed = 2.0 * np.sqrt(2.0 / self.degrees_of_freedom)
            if self.chi_squared > 1.0 + allowed:
                parts.append(
                    f"The impacts scatter more than the given errors explain (chi^2 per degree of freedom "
                    f"{self.chi_squared:.2g}); the uncertainties have been widened to the scatter."
                )
            elif self.chi_squared < 1.0 - allowed:
                parts.append("The impacts scatter less than the given errors: these are probably too large.")
        return " ".join(parts) or "The table determines restitution, friction and stiffness ratio."

    def summary(self) -> str:
        """Return a few lines of text with all results."""
        known = [f"{self.count(name)} {name}" for name in REGIMES if self.count(name)]
        error = "nothing left to judge the scatter by"
        if self.chi_squared is not None:
            error = f"chi^2 per degree of freedom {self.chi_squared:.2f}"
        elif self.scatter is not None:
            error = f"points to an error of {self.scatter:.2g} in each velocity"
        law = "" if self.restitution_law is None else f"  over speed            {self.restitution_law}\n"
        return (
            f"{len(self.regimes)} impact{'s' if len(self.regimes) > 1 else ''}: {', '.join(known)}\n"
            f"restitution e           {self.restitution}\n{law}"
            f"friction mu             {self.friction}\n"
            f"  of sliding impacts    {self.sliding_friction}\n"
            f"stiffness ratio kappa   {self.stiffness_ratio}\n"
            f"residual of V_x2        {self.residual_rms:.2g} rms; {error}\n"
            f"{self.verdict}"
        )
