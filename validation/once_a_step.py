"""The law as discrete-element codes have theirs: evaluated once in an engine step, at the positions of its start.

This is what sub-cycling is measured against. It is a leapfrog: a stuck contact of frequency omega grows without bound
where omega dt > 2, whatever the law, and loses or gains a part of the energy long before.
"""

from __future__ import annotations

from hashlib import sha256
from itertools import combinations
from math import inf, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import jit_for
from contactlaw.kernels import contact, frame
from contactlaw.kernels.rows import FRAME, ROW
from validation.stability_trials import RADIUS, Trial

Array = NDArray[np.float64]

jit = jit_for(sha256(Path(__file__).read_bytes()).hexdigest())


class OnceAStep:
    """Forces of all contacts of a trial.

    Args:
        trial: Of balls on planes.
        law: Name in `contactlaw.LAWS`.
    """

    def __init__(self, trial: Trial, law: str = "microslip") -> None:
        pair = trial.pair(law)
        count, planes = len(trial.masses), len(trial.planes)
        self.couples = np.array(
            [(ball, -1 - plane) for plane in range(planes) for ball in range(count)] + [*combinations(range(count), 2)]
        )
        self.points = np.array([point for point, _ in trial.planes], dtype=float)
        self.normals = np.array([normal for _, normal in trial.planes], dtype=float)
        self.parameters = pair.parameters()
        self.histories = np.zeros((len(self.couples), contact.HEADER + pair.memory_size))
        self.overlaps = np.full(len(self.couples), -inf)
        self.inverse = np.column_stack([1.0 / trial.masses, 1.0 / trial.inertias])
        self.gravity, self.step = trial.gravity, trial.step

    def push(self, places: Array, velocities: Array, spins: Array) -> Array:
        """Force [N] and torque [N m] on every ball, shape (n, 6), for the coming step.

        Args:
            places: At its start [m], shape (n, 3).
            velocities, spins: Of half a step before, as a semi-implicit engine keeps them, shape (n, 3).
        """
        out = np.zeros((len(places), 6))
        _push(
            self.couples, self.points, self.normals, self.parameters, self.histories, self.overlaps,
            self.inverse, self.gravity, self.step, places, velocities, spins, np.zeros(ROW), out,
        )  # fmt: skip
        return out


@jit
def _push(
    couples, points, normals, p, histories, overlaps, inverse, gravity, dt, places, velocities, spins, row,
    out,
):  # fmt: skip
    for number in range(couples.shape[0]):
        a, b = couples[number]
        h = histories[number]
        arm = RADIUS
        if b < 0:
            normal = normals[-1 - b]
            overlap = RADIUS - np.sum((places[a] - points[-1 - b]) * normal)
            velocity = velocities[a] - RADIUS * np.cross(spins[a], normal)
            free = -np.sum(gravity * normal)
            twist = 0.5 * dt * np.sum(spins[a] * normal)
            normal_mobility = inverse[a, 0]
            turning = RADIUS**2 * inverse[a, 1]
        else:
            between = places[a] - places[b]
            distance = sqrt(np.sum(between * between))
            normal = between / distance
            overlap = 2.0 * RADIUS - distance
            arm = 0.5 * distance
            velocity = velocities[a] - velocities[b] - arm * np.cross(spins[a] + spins[b], normal)
            free = 0.0
            twist = 0.5 * dt * np.sum((spins[a] + spins[b]) * normal)
            normal_mobility = inverse[a, 0] + inverse[b, 0]
            turning = arm**2 * (inverse[a, 1] + inverse[b, 1])
        closing = -np.sum(velocity * normal)
        before = overlaps[number]
        if before == -np.inf:  # the first step of the trial
            before = overlap
        overlaps[number] = overlap
        frame.turn_frame(h, normal, twist, row)
        first, second = row[FRAME + 3 : FRAME + 6], row[FRAME + 6 : FRAME + 9]
        force, f, g = contact.step(
            p, h, overlap, before, closing, free, dt * np.sum(velocity * first), dt * np.sum(velocity * second), dt,
            1.0 / normal_mobility, 1.0 / (normal_mobility + turning),
        )  # fmt: skip
        if force == 0.0:
            continue
        total = force * normal - f * first - g * second
        torque = -arm * np.cross(normal, total)
        out[a, :3] += total
        out[a, 3:] += torque
        if b >= 0:
            out[b, :3] -= total
            out[b, 3:] += torque
