"""What an impact did, instant by instant, and the normal motion that it is laid on.

The normal motion does not feel the tangential one: it is tabulated once for a restitution and a number of steps, scaled
so that m = V_z1 = 1 and P = delta^1.5 (delta with linear springs), and shared by all impacts
(`laws.normal_motion.normal_table`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from contactlaw.jit import jit
from contactlaw.laws.base import Array
from contactlaw.laws.normal_motion import normal_table
from contactlaw.laws.oscillator import phase_point


class Motion(NamedTuple):
    """A scaled normal motion at steps + 1 instants, (steps + 1,) each.

    Overlap and its root; force, and its ratio to the undamped one; drop of the closing speed from half a step before
    the instant to half a step after; closing speed; elastic energy; the instant, and the time to the next.
    """

    delta: Array
    root: Array
    force: Array
    ratio: Array
    drop: Array
    speed: Array
    energy: Array
    instant: Array
    step: Array


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


@lru_cache(maxsize=64)
def motion_of(zeta: float, steps: int, linear: bool) -> Motion:
    """`motion_table`, kept."""
    return motion_table(zeta, steps, linear)


@jit
def motion_table(zeta, steps, linear):
    """The scaled normal motion of a whole impact."""
    theta, delta, force, ratio, v_mid, dt = normal_table(zeta, steps, linear)
    drop, speed, energy = np.empty(steps + 1), np.empty(steps + 1), np.zeros(steps + 1)
    instant, step = np.zeros(steps + 1), np.zeros(steps + 1)
    before = 1.0
    for k in range(steps + 1):
        _, speed[k] = phase_point(theta[k], zeta)
        after = v_mid[k] if k < steps else speed[k]
        drop[k] = before - after
        # With a damper the last overlap is elastic energy too, but no force is left to return it to the motion.
        if zeta == 0.0 or k < steps:
            energy[k] = 0.5 * delta[k] ** 2 if linear else 0.4 * delta[k] ** 2.5
        if k < steps:
            step[k] = dt[k]
            instant[k + 1] = instant[k] + dt[k]
        before = after
    return Motion(delta, np.sqrt(delta), force, ratio, drop, speed, energy, instant, step)


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
