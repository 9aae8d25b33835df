"""One tangential spring for the whole contact with a Coulomb limit: shared by linear_spring and both mindlin laws."""

from __future__ import annotations

from functools import partial
from math import sqrt
from typing import ClassVar

from contactlaw.jit import jit, jit_of_sums
from contactlaw.laws.base import Impacts, Law
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.normal_motion import SQRT_5_4, first_stick, normal_motion, time_of_phases
from contactlaw.laws.oscillator import phase_point
from contactlaw.laws.record import SLIDING, SPRUNG
from contactlaw.laws.slip import carried, held, slides_on, sliding_direction

RESCALED = 1.0 / 3.0  # relative loss of a rescaled spring over that of P as the contact shrinks, (da/a)/(dP/P)


@jit
def spring_force(contact, memory, linear, rescaled, du, dv):
    """Tangential force [N] of the spring, dF = k_T ds, |F| <= mu P; memory holds its elastic part.

    linear: k_T = kappa k_N; else k_T = 2 G* a averaged over the step. rescaled: while the contact shrinks the force is
    reduced by a/a_old.
    """
    if contact.state != SPRUNG and slides_on(contact, du, dv, RESCALED if rescaled else 0.0):
        return contact.f, contact.g
    overlap, before = contact.overlap, contact.before
    start = max(before, 0.0)
    if contact.state == SLIDING:
        x, y = sliding_direction(contact)
        limit = contact.friction * elastic_force(contact, linear, start)
        memory[0, 0], memory[1, 0] = limit * x, limit * y
    contact.state = SPRUNG
    part = 1.0 if before >= 0.0 else overlap / (overlap - before)
    shrink = 1.0  # square root of a/a_old, applied half before and half after the displacement: second order
    if linear:
        stiffness = contact.g_star / contact.e_star * contact.stiffness
    else:
        a, b = sqrt(contact.radius * start), sqrt(contact.radius * overlap)
        stiffness = 4.0 / 3.0 * contact.g_star * (a * a + a * b + b * b) / (a + b)
        if rescaled and b < a:
            shrink = sqrt(b / a)
    f = shrink * (shrink * memory[0, 0] + stiffness * part * du)
    g = shrink * (shrink * memory[1, 0] + stiffness * part * dv)
    share = held(contact, f, g)
    memory[0, 0], memory[1, 0] = f, g = share * f, share * g
    return carried(contact, f, g)


@jit
def spring_energy(contact, memory, stiffness):
    """F^2/(2 k_T) [J]."""
    limit = contact.friction * contact.elastic
    square = limit * limit if contact.state == SLIDING else memory[0, 0] ** 2 + memory[1, 0] ** 2
    return 0.5 * square / stiffness if contact.overlap > 0.0 else 0.0


class SingleSpring(Law):
    """Base class of laws with one spring."""

    rescaled: ClassVar[bool] = False

    @staticmethod
    def energy(contact, law, memory):
        """F^2/(4 G* a)."""
        return spring_energy(contact, memory, 2.0 * contact.g_star * sqrt(contact.radius * contact.overlap))

    def impacts(self, zeta: float, steps: int) -> Impacts:
        """Integrate the same spring in scaled variables."""
        motion = normal_motion(zeta, steps, self.linear)
        known = motion.theta, motion.delta, motion.v_mid, motion.step
        return partial(rebound_single_spring, known, zeta, self.linear, self.rescaled)


@jit_of_sums
def rebound_single_spring(motion, zeta, linear, rescaled, psi_1, chi, psi_2_out):
    """psi_2 of whole impacts, arrays (n,). motion: theta, delta, v_mid and step of `Motion`."""
    theta, delta, v_mid, dt = motion
    steps = v_mid.size
    _, v_end = phase_point(theta[steps], zeta)
    held = 1.0 - RESCALED if rescaled else 1.0
    for j in range(psi_1.size):
        side = 1.0 if psi_1[j] >= 0.0 else -1.0
        psi, c = side * psi_1[j], 2.0 * chi[j]
        if psi > 1.0 and psi >= c * (1.0 - v_end) + held * v_end:
            psi_2_out[j] = side * (psi - c * (1.0 - v_end))
            continue
        start, v, share, length, q, before = 0, v_mid[0], 0.0, dt[0], 0.0, 0.0
        if psi > 1.0:
            phase, start, psi, v = first_stick(psi, chi[j], zeta, theta, held)
            y, w_now = phase_point(phase, zeta)
            before = y if linear else (SQRT_5_4 * y) ** 0.8
            q = before if linear else before**1.5
            length = theta[start + 1] - phase if linear else time_of_phases(phase, theta[start + 1], zeta)
            psi -= c * (w_now - v)
        else:
            psi -= c * psi * (1.0 - v)
        for k in range(start + 1, steps):
            a, b = sqrt(before), sqrt(delta[k])
            shrink = sqrt(b / a) if rescaled and b < a else 1.0
            stiffness = 1.0 if linear else (a * a + a * b + b * b) / (a + b)  # 3/2 a averaged over the overlap
            q = shrink * (shrink * q + stiffness * psi * length)
            load = delta[k] if linear else delta[k] ** 1.5
            q = min(max(q, -load), load)
            share = q / load
            psi -= c * share * (v - v_mid[k])
            v, length, before = v_mid[k], dt[k], delta[k]
        psi_2_out[j] = side * (psi - c * share * (v - v_end))
