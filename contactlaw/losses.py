"""Restitution and friction over speed: what `ContactPair` takes instead of a number.

    ContactPair(steel, steel, friction=FallingFriction(0.118, 0.00995, 0.92), restitution=Viscoelastic(0.9, 1.0))

A contact reads them at its touch: restitution by the closing speed, friction by the sliding speed; one that lasts reads
its friction again as it slides. One is asked for its value like a function, `Viscoelastic(0.9, 1.0)(speeds)`, and
written in XML by its name and fields, "viscoelastic restitution=0.9 speed=1". One of your own is a frozen dataclass of
numbers, or tuples of them, with a name and `values`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks

Array = NDArray[np.float64]
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|nan)", re.IGNORECASE)  # as XML writes one


@dataclass(frozen=True)
class OverSpeed:
    """A coefficient over speed [m/s]."""

    name: ClassVar[str]

    def __init_subclass__(cls) -> None:
        KNOWN[cls.name] = cls

    def __call__(self, speed: ArrayLike) -> Any:
        """The value at speeds >= 0 [m/s], shaped as they are; a float for one."""
        out = self.values(np.maximum(checks.finite_array("speed", speed), 1e-300))
        return out if out.ndim else float(out)

    def values(self, speed: Array) -> Array:
        """The value at speeds > 0 [m/s]."""
        raise NotImplementedError

    @cached_property
    def points(self) -> Array:
        """Speeds [m/s], rising, between which the engines go straight over ln v: 2e-5 from these laws at most."""
        return np.geomspace(1e-5, 1e3, 300)


KNOWN: dict[str, type[OverSpeed]] = {}
"""Every curve by its name."""


@dataclass(frozen=True)
class Viscoelastic(OverSpeed):
    """e of spheres that are viscoelastic, P = k (delta^1.5 + 3/2 A sqrt(delta) d(delta)/dt), from one measured value.

        e = (1 + c1 x)/(1 + b1 x + b2 x^2 + b3 x^3 + b4 x^4)      x = sqrt(3/2 A) (k/m)^(1/5) v^(1/10)

    Source: Mueller & Poeschel, Phys. Rev. E 84 (2011) 021302; the contact ends where its force does.

    Attributes:
        restitution: e in [1e-6, 1] at
        speed: an approach speed [m/s].
    """

    name = "viscoelastic"
    restitution: float
    speed: float = 1.0

    def __post_init__(self) -> None:
        checks.restitution("restitution", self.restitution)
        checks.positive("speed", self.speed)

    def values(self, speed: Array) -> Array:
        """By the fraction."""
        return _fraction(self._scale * speed**0.1)

    def time(self, mass: float, stiffness: float) -> float:
        """A [s] of a body of an effective mass [kg] on a Hertz contact of stiffness k [N/m^1.5]."""
        return self._scale**2 / (1.5 * (checks.positive("stiffness", stiffness) / checks.positive("mass", mass)) ** 0.4)

    @cached_property
    def _scale(self) -> float:
        """x at 1 m/s, by bisection: e falls with x."""
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
    """e of spheres that are elastic and perfectly plastic.

        e = sqrt(6 sqrt(3)/5) sqrt(1 - r^2/6) [r/(r + 2 sqrt(6/5 - r^2/5))]^(1/4)      r = v_y/v, at most 1

    Source: Thornton, J. Appl. Mech. 64 (1997) 383.

    Attributes:
        yield_speed: v_y [m/s], at which the middle of the contact begins to yield.
        below: e of slower impacts, in [1e-6, 1], as other losses make it; a factor above. With 1 they bounce for ever.
    """

    name = "plastic"
    yield_speed: float
    below: float = 1.0

    def __post_init__(self) -> None:
        checks.positive("yield_speed", self.yield_speed)
        checks.restitution("below", self.below)

    def values(self, speed: Array) -> Array:
        """By the formula, whose value at v_y is 1."""
        r = np.minimum(self.yield_speed / speed, 1.0)
        part = r / (r + 2.0 * np.sqrt(1.2 - 0.2 * r * r))
        return self.below * np.minimum(np.sqrt(1.2 * np.sqrt(3.0) * (1.0 - r * r / 6.0)) * part**0.25, 1.0)

    @cached_property
    def points(self) -> Array:
        """From the yield speed on."""
        return self.yield_speed * np.geomspace(1.0, 1e6, 300)


@dataclass(frozen=True)
class FallingFriction(OverSpeed):
    """mu that falls from one value at rest to another at high sliding speed: mu = end + (start - end) exp(-v/speed).

    Billiard balls on each other: start 0.11795, end 0.00995, speed 1/1.088 m/s, fitted by D. G. Alciatore (Technical
    Proof TP A.14) to measurements of Marlow (The Physics of Pocket Billiards, 1995).

    Attributes:
        start, end: >= 0.
        speed: [m/s].
    """

    name = "falling"
    start: float
    end: float
    speed: float

    def __post_init__(self) -> None:
        checks.not_negative("start", self.start)
        checks.not_negative("end", self.end)
        checks.positive("speed", self.speed)

    def values(self, speed: Array) -> Array:
        """By the formula."""
        return self.end + (self.start - self.end) * np.exp(-speed / self.speed)

    @cached_property
    def points(self) -> Array:
        """About the speed by which it falls."""
        return self.speed * np.geomspace(1e-4, 40.0, 300)


@dataclass(frozen=True)
class Table(OverSpeed):
    """Measured values over speed: straight over the logarithm of the speed, and as they end beyond.

    Attributes:
        speeds: [m/s], > 0, rising.
        measured: At these.
    """

    name = "table"
    speeds: tuple[float, ...]
    measured: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("speeds", "measured"):
            value = np.atleast_1d(checks.finite_array(name, getattr(self, name)))
            object.__setattr__(self, name, tuple(value.ravel().tolist()))
        if len(self.speeds) != len(self.measured) or min(self.speeds) <= 0.0 or (np.diff(self.speeds) <= 0.0).any():
            raise ValueError(
                f"speeds = {self.speeds!r}: must be > 0, rise, and be as many as measured, {len(self.measured)}"
            )

    def values(self, speed: Array) -> Array:
        """Between the points."""
        return np.interp(np.log(speed), np.log(self.speeds), self.measured)

    @cached_property
    def points(self) -> Array:
        """Those measured."""
        return np.array(self.speeds)


def text_of(value: float | OverSpeed) -> str:
    """What `read` turns back into this number or curve, digit for digit."""
    if not isinstance(value, OverSpeed):
        return repr(value)
    told = ((field.name, np.ravel(getattr(value, field.name)).tolist()) for field in fields(value))
    return " ".join([value.name, *(f"{name}={','.join(map(repr, one))}" for name, one in told)])


def read(name: str, text: str) -> float | OverSpeed:
    """The number or the curve that a text says.

    Raises:
        ValueError: It says neither; the message begins with the name.
    """
    first, *words = [*text.split(), ""]
    words = words[:-1]
    if first not in KNOWN:
        if not NUMBER.fullmatch(text.strip()):
            raise ValueError(f"{name} = {text!r}: must be a number, or one of {', '.join(KNOWN)} with its fields")
        return float(text)
    given = checks.fields_of(f"{name} = {text!r}", first, words, [field.name for field in fields(KNOWN[first])])
    try:
        return KNOWN[first](**given)
    except TypeError:
        raise ValueError(f"{name} = {text!r}: must name every field of {first} that has no default") from None


def numbers_of(restitution: float | OverSpeed, friction: float | OverSpeed) -> Array | None:
    """The numbers that `laws.speeds` reads; None where both are the same at any speed."""
    curves = [value if isinstance(value, OverSpeed) else None for value in (restitution, friction)]
    if not any(curves):
        return None
    parts = [[np.log(curve.points), curve(curve.points)] for curve in curves if curve is not None]
    counts = [0.0 if curve is None else float(curve.points.size) for curve in curves]
    return np.concatenate([np.array(counts), *(one for both in parts for one in both)])
