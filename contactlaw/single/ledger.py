"""What an impact did, instant by instant, in SI units, by the scaled normal motion that it is laid on."""

from __future__ import annotations

from typing import NamedTuple

from contactlaw.jit import jit
from contactlaw.laws.base import Array
from contactlaw.laws.normal_motion import Motion


class Scale(NamedTuple):
    """From scaled to SI: effective mass [kg], approach speed [m/s], length [m], tangential effective mass [kg]."""

    mass: float
    approach: float
    length: float
    tangential_mass: float


# Rows of what is known of the tangential motion, (TRACK, steps + 1): force [N], energy stored by it [J], work done by
# it until now [J], sliding speed [m/s].
PULL, STORED, DONE, SLIDING_SPEED = range(4)
TRACK = 4


@jit
def note(track_out, k, pull, stored, done, speed):
    """Write an instant of the tangential motion, where it is kept."""
    if track_out.size > 0:
        track_out[PULL, k], track_out[STORED, k], track_out[DONE, k], track_out[SLIDING_SPEED, k] = (
            pull, stored, done, speed,
        )  # fmt: skip


def ledger(motion: Motion, scale: Scale, track: Array) -> list[Array]:
    """Time [s], overlap [m], normal force [N]; kinetic energy, stored normally and tangentially, lost to friction and
    to the damper [J], (steps + 1,) each."""
    energy = scale.mass * scale.approach * scale.approach
    stored, square = energy * motion.energy, motion.speed * motion.speed
    return [
        scale.length / scale.approach * motion.instant,
        scale.length * motion.delta,
        energy / scale.length * motion.force,
        0.5 * energy * square + 0.5 * scale.tangential_mass * track[SLIDING_SPEED] ** 2,
        stored,
        track[STORED],
        track[DONE] - track[STORED],
        0.5 * energy * (1.0 - square) - stored,
    ]
