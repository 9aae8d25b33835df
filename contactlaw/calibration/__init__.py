"""Friction, restitution and stiffness ratio from a table of impacts, each with its uncertainty.

procedure: what a user calls. impact_fit: the law through the data. evidence: what the data say and how surely; scatter:
the statistics of few numbers. assessment: verdicts in words. result: what comes out.
"""

from contactlaw.calibration.procedure import calibrate, contact_velocities
from contactlaw.calibration.result import Calibration, Estimate

__all__ = ["Calibration", "Estimate", "calibrate", "contact_velocities"]
