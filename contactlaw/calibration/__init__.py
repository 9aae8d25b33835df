"""Friction, restitution and stiffness ratio from a table of impacts, each with its uncertainty; needs scipy.

procedure: what a user calls. table: the impacts. curve: the law. fit: the curve through the impacts. outliers: impacts
left out. ranges: what is allowed at 95 %. assessment: verdicts in words. result: what comes out.
"""

from contactlaw.calibration.procedure import calibrate, contact_velocities
from contactlaw.calibration.result import Calibration, Estimate

__all__ = ["Calibration", "Estimate", "calibrate", "contact_velocities"]
