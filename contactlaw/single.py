"""Any law in one contact whose normal motion is known: quasi-static paths, and whole impacts integrated in steps.

Forces F and tractions q point along the motion of body A relative to B: the force on A is P n - F.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from contactlaw.jit import jit_module
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.normal_motion import TRACK, Motion
from contactlaw.laws.record import PAIR_SIZE, ask_energy, ask_stiffness, pair_of, record
from contactlaw.laws.step import ask, prescribe

SUBSTEPS = 256  # per change by the greatest overlap, or by the displacement at which the whole contact slips
MOST_SUBSTEPS = 4096  # per segment of the path


class Scale(NamedTuple):
    """Units of a scaled impact: effective mass [kg], speed of approach [m/s], length [m]; tangential mass [kg]."""

    mass: float
    approach: float
    length: float
    tangential_mass: float


HISTORY = np.dtype((np.record, record(
    "time", "overlap", "normal_force", "kinetic", "elastic_normal", "elastic_tangential", "friction_loss",
    "damping_loss",
)))  # fmt: skip
"""An instant of an impact, as in `collision.Impact`."""


def force_along_path(p, approach, displacement, header, memory, normal_out, tangential_out):
    """Forces [N] along straight segments of overlap (n,) and tangential displacement (n, 2) [m], from zero overlap.

    p: numbers of the pair (`ContactPair.parameters`). header, memory: storage for a contact and the vectors of its law
    (`Law.new_contact`).
    """
    pair, contact, law = pair_of(p), header[0], p[PAIR_SIZE:]
    deepest = max(np.max(approach), 0.0)
    prescribe(contact, pair, deepest)
    finest = deepest / SUBSTEPS
    slip = pair.friction * pair.e_star / pair.g_star * finest
    now, u, v = min(approach[0], 0.0), displacement[0, 0], displacement[0, 1]
    for j in range(approach.size):
        step_n, step_u, step_v = approach[j] - now, displacement[j, 0] - u, displacement[j, 1] - v
        parts = 1.0
        if finest > 0.0:
            parts = max(parts, ceil(abs(step_n) / finest))
        if slip > 0.0:
            parts = max(parts, ceil(sqrt(step_u**2 + step_v**2) / slip))
        count = int(min(parts, MOST_SUBSTEPS))
        for i in range(count):
            before = now + step_n * i / count
            overlap = approach[j] if i == count - 1 else now + step_n * (i + 1) / count
            if overlap <= 0.0:
                prescribe(contact, pair, deepest)
                contact.force, contact.overlap = 0.0, 0.0
                memory[:] = 0.0
                continue
            contact.before, contact.overlap, contact.ratio = before, overlap, 1.0
            contact.force = contact.elastic = elastic_force(contact, pair.linear != 0.0, overlap)
            ask(contact, pair, law, memory, step_u / count, step_v / count, 0.0)
        now, u, v = approach[j], displacement[j, 0], displacement[j, 1]
        normal_out[j], tangential_out[j, 0], tangential_out[j, 1] = contact.force, contact.f, contact.g


def impact_by_steps(p, header, memory, motion: Motion, scale: Scale, deepest, speed, track_out):
    """Sliding speed [m/s] after one impact along a line.

    p, header, memory: as for `force_along_path`. deepest: greatest overlap of the motion [m]. speed: sliding speed at
    the touch [m/s]. track_out: history of `normal_motion.TRACK`, (steps + 1,); empty: not recorded.
    """
    pair, contact, law = pair_of(p), header[0], p[PAIR_SIZE:]
    mass, approach, length, tangential_mass = scale
    prescribe(contact, pair, deepest)
    contact.mass, contact.tangential_mass, contact.closing = mass, tangential_mass, approach
    memory[:] = 0.0
    steps = motion.delta.size - 1
    unit, impulse = mass * approach * approach / length, mass * approach / tangential_mass
    contact.overlap = length * motion.delta[1]
    share, closing = 0.0, approach * motion.delta[1] / motion.step[0]
    if speed != 0.0:  # at the touch: mu if the contact starts sliding, k_T V_x/(k_N V_z) if it starts stuck
        normal = contact.stiffness * (1.0 if pair.linear != 0.0 else 1.5 * sqrt(contact.overlap))
        share = min(ask_stiffness(pair, contact, law) / normal * speed / closing, pair.friction)
    pull, work, elastic, slide = 0.0, 0.0, 0.0, 0.0
    for k in range(steps + 1):
        last, before = pull, speed
        if 0 < k < steps:
            contact.before, contact.overlap = length * motion.delta[k - 1], length * motion.delta[k]
            contact.force, contact.ratio = unit * motion.force[k], motion.ratio[k]
            contact.elastic = elastic_force(contact, pair.linear != 0.0, contact.overlap)
            ask(contact, pair, law, memory, slide, 0.0, length / approach * motion.step[k - 1])
            pull = contact.f
            if track_out.size > 0:
                elastic = ask_energy(pair, contact, law, memory)
            share = pull / contact.force if contact.force > 0.0 else 0.0
        elif k == steps:
            pull, elastic = 0.0, 0.0
        work += 0.5 * (last + pull) * slide
        speed -= share * impulse * motion.drop[k]
        slide = speed * length / approach * motion.step[k]
        now = 0.5 * (before + speed) if 0 < k < steps else before if k == 0 else speed
        if track_out.size > 0:
            one = track_out[k]
            one.force, one.stored, one.work, one.speed = pull, elastic, work, now
    return speed


def write_history(motion: Motion, scale: Scale, track, along, force_out, out):
    """Write the tangential force on A [N], shape (n, 3), and the history of `HISTORY`, (n,).

    track: as `impact_by_steps` leaves it, (n,). along: unit vector of the sliding velocity of A.
    """
    mass, approach, length, tangential_mass = scale
    energy = mass * approach * approach
    for k in range(track.size):
        one, now, square = track[k], out[k], motion.speed[k] * motion.speed[k]
        for i in range(3):
            force_out[k, i] = -along[i] * one.force
        now.time = length / approach * motion.instant[k]
        now.overlap = length * motion.delta[k]
        now.normal_force = energy / length * motion.force[k]
        now.kinetic = 0.5 * energy * square + 0.5 * tangential_mass * one.speed * one.speed
        now.elastic_normal = energy * motion.energy[k]
        now.elastic_tangential = one.stored
        now.friction_loss = one.work - one.stored
        now.damping_loss = 0.5 * energy * (1.0 - square) - now.elastic_normal


def impacts_by_steps(p, header, memory, motion: Motion, deepest, psi_1, chi, psi_2_out):
    """psi_2 of whole impacts, arrays (n,). p: numbers of a pair with E* = G* = 3/4 Pa, R = 1 m and mu = 1."""
    no_track = np.empty(0, TRACK)
    for j in range(psi_1.size):
        side = 1.0 if psi_1[j] >= 0.0 else -1.0
        scale = Scale(1.0, 1.0, 1.0, 0.5 / chi[j])
        psi_2_out[j] = side * impact_by_steps(p, header, memory, motion, scale, deepest, side * psi_1[j], no_track)


jit_module(__name__)
