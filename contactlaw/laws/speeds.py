"""Restitution and friction that depend on speed, as a contact reads them at its touch.

The numbers behind a law's own: how many points the curve of e has, and that of mu; then the logarithms of the speeds
[m/s] and the values of one, and of the other. Between points values go straight over ln v, beyond them they stay; no
points: the pair's own number holds. What a contact has read holds through an impact; one that lasts reads its friction
again at each speed that it slides with.
"""

from __future__ import annotations

from math import log, sqrt

from contactlaw.jit import jit
from contactlaw.laws.oscillator import damping_ratio


@jit
def read(contact, numbers, push, sliding):
    """Give a contact the damping ratio and the friction of its touch; closing speed, overlap and mass are in place.

    push: closing acceleration [m/s^2] by all but the contact. A contact that is pressed together is as fast as its
    overlap at rest makes it, however slowly it began. sliding: speed [m/s].
    """
    count = int(numbers[0])
    if count > 0:
        overlap = max(contact.overlap, 0.0)
        square = contact.closing**2 + 0.8 * contact.stiffness * overlap * overlap * sqrt(overlap) / contact.mass
        if push > 0.0:
            square += 2.0 * push * (contact.mass * push / contact.stiffness) ** (2.0 / 3.0)
        contact.zeta = damping_ratio(value_at(numbers, 2, count, sqrt(square)))
    read_friction(contact, numbers, sliding)


@jit
def read_friction(contact, numbers, sliding):
    """Give a contact the friction that it has at a sliding speed [m/s]."""
    count = int(numbers[1])
    if count > 0:
        mu = value_at(numbers, 2 + 2 * int(numbers[0]), count, sliding)
        contact.friction, contact.mu = mu * (contact.friction / contact.mu if contact.mu > 0.0 else 1.0), mu


@jit
def value_at(numbers, first, count, speed):
    """Value at a speed [m/s] of the curve of so many points whose numbers begin there."""
    x, values = log(max(speed, 1e-300)), first + count
    if x <= numbers[first]:
        return numbers[values]
    for i in range(1, count):
        if x <= numbers[first + i]:
            start, slope = numbers[first + i - 1], numbers[values + i] - numbers[values + i - 1]
            return numbers[values + i - 1] + slope * (x - start) / (numbers[first + i] - start)
    return numbers[values + count - 1]
