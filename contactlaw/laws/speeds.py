"""Restitution and friction that depend on speed, evaluated in kernels.

The table stands behind a law's own numbers: the numbers of points of the curves e(v) and mu(v); then ln(speed [m/s])
and values of the first curve, and of the second. Values are interpolated linearly in ln v and constant beyond the ends.
A curve without points leaves the pair's own number in place. A contact evaluates both curves at its first touch; a
persistent contact evaluates its friction again at its sliding speed.
"""

from math import log, sqrt

from contactlaw.jit import jit
from contactlaw.laws.oscillator import damping_ratio


@jit
def read(contact, numbers, push, sliding):
    """Set damping ratio and friction of a contact at its touch; its closing speed, overlap and mass must be set.

    e is that of the speed at zero overlap which has the present energy, and that gained over the overlap at rest by
    `push`, the closing acceleration [m/s^2] due to all other forces. sliding: speed [m/s].
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
    """Set the friction of a contact for a sliding speed [m/s]; a reduction by spin is kept."""
    count = int(numbers[1])
    if count > 0:
        mu = value_at(numbers, 2 + 2 * int(numbers[0]), count, sliding)
        contact.friction, contact.mu = mu * (contact.friction / contact.mu if contact.mu > 0.0 else 1.0), mu


@jit
def value_at(numbers, first, count, speed):
    """Value at a speed [m/s] of the curve of `count` points that begins at numbers[first]."""
    x, values = log(max(speed, 1e-300)), first + count
    if x <= numbers[first]:
        return numbers[values]
    for i in range(1, count):
        if x <= numbers[first + i]:
            start, slope = numbers[first + i - 1], numbers[values + i] - numbers[values + i - 1]
            return numbers[values + i - 1] + slope * (x - start) / (numbers[first + i] - start)
    return numbers[values + count - 1]
