"""`MicroslipTurning`, the law for slides that turn, under its public name; see `laws.microslip_turning`."""

from contactlaw.laws.microslip_turning import MicroslipTurning

__all__ = ["MicroslipTurning"]
