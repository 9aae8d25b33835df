"""What an impact did, instant by instant, and the normal motion that it is laid on.

The normal motion does not feel the tangential one: it is tabulated once for a restitution and a number of steps, scaled
so that m = V_z1 = 1 and P = delta^1.5 (delta with linear springs), and shared by all impacts (`rebound.normal_table`).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.oscillator import phase_point
from contactlaw.kernels.rebound import normal_table

# Rows of the table of a normal motion, shape (TABLE_ROWS, steps + 1). RATIO: force over the undamped one; DROP: of the
# closing speed, from half a step before the instant to half a step after; STEP: time to the next instant.
DELTA, ROOT, FORCE, RATIO, DROP, SPEED, ENERGY, INSTANT, STEP = range(9)
TABLE_ROWS = 9

# Rows of what an impact did, shape (LEDGER_ROWS, steps + 1), SI units, in the order of `collision.Impact`.
TIME, OVERLAP, NORMAL_FORCE, KINETIC, ELASTIC_NORMAL, ELASTIC_TANGENTIAL, FRICTION_LOSS, DAMPING_LOSS = range(8)
LEDGER_ROWS = 8


@jit
def motion_table(zeta, steps, linear):
    """The scaled normal motion, shape (TABLE_ROWS, steps + 1)."""
    theta, delta, force, ratio, v_mid, dt = normal_table(zeta, steps, linear)
    out = np.zeros((TABLE_ROWS, steps + 1))
    before = 1.0
    for k in range(steps + 1):
        _, v = phase_point(theta[k], zeta)
        after = v_mid[k] if k < steps else v
        out[DELTA, k], out[ROOT, k], out[FORCE, k], out[RATIO, k] = delta[k], sqrt(delta[k]), force[k], ratio[k]
        out[DROP, k], out[SPEED, k] = before - after, v
        # With a damper the last overlap is elastic energy too, but no force is left to return it to the motion.
        if zeta == 0.0 or k < steps:
            out[ENERGY, k] = 0.5 * delta[k] ** 2 if linear else 0.4 * delta[k] ** 2.5
        if k < steps:
            out[STEP, k] = dt[k]
            out[INSTANT, k + 1] = out[INSTANT, k] + dt[k]
        before = after
    return out


@jit
def note(
    table, k, mass, approach, length, tangential_mass, speed, pull, elastic, work, x, y, z, ledger_out, force_out
):  # fmt: skip
    """Write one instant of an impact.

    table: of the normal motion. mass, tangential_mass: effective [kg]. approach: speed [m/s]. length: of the scaled
    motion [m]. speed: tangential, now [m/s]. pull: F [N]. elastic: stored by F [J]. work: of F until now [J]. x, y, z:
    direction of the slide. force_out: on body A [N], shape (steps + 1, 3).
    """
    energy = mass * approach * approach
    v, stored = table[SPEED, k], energy * table[ENERGY, k]
    ledger_out[TIME, k] = length / approach * table[INSTANT, k]
    ledger_out[OVERLAP, k] = length * table[DELTA, k]
    ledger_out[NORMAL_FORCE, k] = energy / length * table[FORCE, k]
    ledger_out[KINETIC, k] = 0.5 * energy * v * v + 0.5 * tangential_mass * speed * speed
    ledger_out[ELASTIC_NORMAL, k] = stored
    ledger_out[ELASTIC_TANGENTIAL, k] = elastic
    ledger_out[FRICTION_LOSS, k] = work - elastic
    ledger_out[DAMPING_LOSS, k] = 0.5 * energy * (1.0 - v * v) - stored
    force_out[k, 0], force_out[k, 1], force_out[k, 2] = -pull * x, -pull * y, -pull * z
