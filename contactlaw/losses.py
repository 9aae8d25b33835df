"""Restitution and friction as functions of speed, which `ContactPair` takes in place of numbers.

    ContactPair(steel, steel, friction=FallingFriction(0.118, 0.00995, 0.92), restitution=Viscoelastic(0.9, 1.0))

A contact evaluates them when it begins: restitution at the closing speed, friction at the sliding speed. A persistent
contact evaluates its friction again as it slides. In Python a curve is called like a function, `Viscoelastic(0.9,
1.0)(speeds)`; in XML it is written with its name and fields, "viscoelastic restitution=0.9 speed=1". To add a curve,
subclass `OverSpeed` as a frozen dataclass of numbers, or tuples of numbers, with a `name` and a method `values`.

Kernels read a table, which stands behind a law's own numbers: the numbers of points of the curves e(v) and mu(v); then
ln(speed [m/s]) and values of the first curve, and of the second. Values are interpolated linearly in ln v and constant
beyond the ends. A curve without points leaves the pair's own number in place.
"""

from dataclasses import dataclass
from functools import cached_property
from math import log, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.jit import jit
from contactlaw.laws.base import Array
from contactlaw.laws.oscillator import damping_ratio


@dataclass(frozen=True)
class OverSpeed:
    """A coefficient (restitution or friction) as a function of speed [m/s]."""

    name: ClassVar[str]

    def __init_subclass__(cls) -> None:
        KNOWN[cls.name] = cls

    def __call__(self, speed: ArrayLike) -> Any:
        """Return the coefficient at speeds >= 0 [m/s], an array of their shape, or a float for one speed."""
        out = self.values(np.maximum(checks.finite_array("speed", speed), 1e-300))
        return out if out.ndim else float(out)

    def values(self, speed: Array) -> Array:
        """Return the coefficient at speeds > 0 [m/s], an array of their shape."""
        raise NotImplementedError(f"{type(self).__name__}: needs a method values(self, speed), on arrays [m/s]")

    @cached_property
    def points(self) -> Array:
        """Increasing speeds [m/s] of the table that kernels interpolate linearly in ln v, with an error below 2e-4."""
        return np.geomspace(1e-5, 1e3, 300)


KNOWN: dict[str, type[OverSpeed]] = {}
"""All curves by name."""


@dataclass(frozen=True)
class Viscoelastic(OverSpeed):
    """Restitution of viscoelastic spheres, P = k (delta^1.5 + 3/2 A sqrt(delta) d(delta)/dt), from one measured value.

        e = (1 + c1 x)/(1 + b1 x + b2 x^2 + b3 x^3 + b4 x^4)      x = sqrt(3/2 A) (k/m)^(1/5) v^(1/10)

    Source: Mueller & Poeschel, Phys. Rev. E 84 (2011) 021302; the contact ends when its force vanishes.

    Attributes:
        restitution: e in [1e-6, 1], measured at `speed`.
        speed: Approach speed [m/s], > 0.
    """

    name = "viscoelastic"
    restitution: float
    speed: float = 1.0

    def __post_init__(self) -> None:
        checks.set_fields(self, restitution=checks.restitution, speed=checks.positive)

    def values(self, speed: Array) -> Array:
        """Return e by the rational function above."""
        return _fraction(self._scale * speed**0.1)

    def time(self, mass: float, stiffness: float) -> float:
        """Return A [s] for an effective mass [kg] on a Hertz contact of stiffness k [N/m^1.5]."""
        return self._scale**2 / (1.5 * (checks.positive("stiffness", stiffness) / checks.positive("mass", mass)) ** 0.4)

    @cached_property
    def _scale(self) -> float:
        """x at 1 m/s, by bisection (e decreases with x)."""
        low, high = 0.0, 1e6
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if _fraction(middle) > self.restitution else (low, middle)
        return low / self.speed**0.1


def _fraction(x: Any) -> Any:
    above = 1.0 + 0.501086 * x
    return above / (above + x * x * (1.15345 + x * (0.577977 + x * 0.532178)))


@dataclass(frozen=True)
class Plastic(OverSpeed):
    """Restitution of elastic-perfectly plastic spheres.

        e = sqrt(6 sqrt(3)/5) sqrt(1 - r^2/6) [r/(r + 2 sqrt(6/5 - r^2/5))]^(1/4)      r = v_y/v, at most 1

    Source: Thornton, J. Appl. Mech. 64 (1997) 383.

    Attributes:
        yield_speed: v_y [m/s], > 0, at which the centre of the contact begins to yield.
        below: e in [1e-6, 1] of slower impacts, due to other losses; it multiplies e of faster ones. With 1, slow
            impacts are elastic and a ball never comes to rest.
    """

    name = "plastic"
    yield_speed: float
    below: float = 1.0

    def __post_init__(self) -> None:
        checks.set_fields(self, yield_speed=checks.positive, below=checks.restitution)

    def values(self, speed: Array) -> Array:
        """Return e by the formula, which gives `below` at v_y."""
        r = np.minimum(self.yield_speed / speed, 1.0)
        part = r / (r + 2.0 * np.sqrt(1.2 - 0.2 * r * r))
        return self.below * np.minimum(np.sqrt(1.2 * np.sqrt(3.0) * (1.0 - r * r / 6.0)) * part**0.25, 1.0)

    @cached_property
    def points(self) -> Array:
        """Speeds [m/s] of the table, from the yield speed on; e is constant below."""
        return self.yield_speed * np.geomspace(1.0, 1e6, 300)


@dataclass(frozen=True)
class FallingFriction(OverSpeed):
    """Friction that changes from one value at rest to another at high speed: mu = end + (start - end) exp(-v/speed).

    Billiard balls on each other: start 0.11795, end 0.00995, speed 1/1.088 m/s, fitted by D. G. Alciatore (Technical
    Proof TP A.14) to measurements of Marlow (The Physics of Pocket Billiards, 1995).

    Attributes:
        start, end: mu at rest and at high sliding speed, >= 0.
        speed: Sliding speed [m/s], > 0, over which the difference falls by a factor of e.
    """

    name = "falling"
    start: float
    end: float
    speed: float

    def __post_init__(self) -> None:
        checks.set_fields(self, start=checks.not_negative, end=checks.not_negative, speed=checks.positive)

    def values(self, speed: Array) -> Array:
        """Return mu by the formula."""
        return self.end + (self.start - self.end) * np.exp(-speed / self.speed)

    @cached_property
    def points(self) -> Array:
        """Speeds [m/s] of the table, from 1e-4 to 40 times `speed`."""
        return self.speed * np.geomspace(1e-4, 40.0, 300)


@dataclass(frozen=True)
class Table(OverSpeed):
    """Measured values, interpolated linearly in the logarithm of the speed and constant beyond both ends.

    Attributes:
        speeds: [m/s], > 0, increasing.
        measured: Values at these speeds.
    """

    name = "table"
    speeds: tuple[float, ...]
    measured: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("speeds", "measured"):
            value = np.atleast_1d(checks.finite_array(name, getattr(self, name)))
            object.__setattr__(self, name, tuple(value.ravel().tolist()))
        alike = 0 < len(self.speeds) == len(self.measured)
        if not alike or min(self.speeds) <= 0.0 or (np.diff(self.speeds) <= 0.0).any():
            raise ValueError(
                f"speeds = {self.speeds!r}: must be one or more, > 0, rise, and be as many as measured, "
                f"{len(self.measured)}"
            )

    def values(self, speed: Array) -> Array:
        """Return the interpolated values."""
        return np.interp(np.log(speed), np.log(self.speeds), self.measured)

    @cached_property
    def points(self) -> Array:
        """The measured speeds [m/s]."""
        return np.array(self.speeds)


def read(name: str, text: str) -> float | OverSpeed:
    """Return the number or the curve that a text describes, as `checks.text_of` writes it."""
    if "".join(text.split()[:1]) in KNOWN:
        return checks.named(name, text, KNOWN)
    return checks.number_in(name, text, f", or one of {', '.join(KNOWN)} with its fields")


def numbers_of(restitution: float | OverSpeed, friction: float | OverSpeed) -> Array | None:
    """Return the table that kernels read, or None if neither depends on speed."""
    curves = [value if isinstance(value, OverSpeed) else None for value in (restitution, friction)]
    if not any(curves):
        return None
    parts = [[np.log(curve.points), curve(curve.points)] for curve in curves if curve is not None]
    counts = [0.0 if curve is None else float(curve.points.size) for curve in curves]
    return np.concatenate([np.array(counts), *(one for both in parts for one in both)])


@jit
def set_losses(contact, numbers, push, sliding):
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
