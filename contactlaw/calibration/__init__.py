"""Friction, restitution and stiffness ratio from a table of impacts, with uncertainties; needs scipy.

procedure     the functions for users
table         checked tables of impacts
fit           the law's rebound curve, for any stiffness ratio, through the impacts; outliers
ranges        95 % ranges of the parameters; large tables are fitted by averages
over_speed    restitution that depends on speed
assessment    the whole evaluation, and its verdict in words
result        `Calibration`, the result
"""

from contactlaw.calibration.procedure import calibrate, contact_velocities
from contactlaw.calibration.result import Calibration, Estimate

__all__ = ["Calibration", "Estimate", "calibrate", "contact_velocities"]
