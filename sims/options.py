"""Numeric options of scenes, with default and range, and those that every scene with a ball has."""

from math import pi
from typing import NamedTuple

from contactlaw import MATERIALS, checks


class Option(NamedTuple):
    """A numeric option of a scene; a whole number if the default is one.

    Attributes:
        default: None: the scene computes it, as `help` says.
        help: Meaning and unit.
        low, high: Range allowed.
    """

    default: float | None
    help: str
    low: float
    high: float

    def read(self, name: str, value: float | None) -> float | None:
        """The value asked for, or the default.

        Raises:
            ValueError: It is outside the range.
        """
        if value is None:
            return self.default
        told = checks.number(name, value, f"in [{self.low:g}, {self.high:g}]", low=self.low, high=self.high)
        return round(told) if type(self.default) is int else told


def of_ball(
    radius: float | None, friction: float | None, restitution: float | None, mass: float | None = None
) -> dict[str, Option]:
    """Options of a ball and its contact; mass None: computed from radius and material."""
    by = "" if mass else "; default: from radius and material"
    return of_contact(friction, restitution) | {
        "mass": Option(mass, f"mass of a ball, in kg{by}", 1e-6, 1e4),
        "radius": Option(radius, "radius of a ball, in m", 5e-4, 1.0),
    }


def of_contact(friction: float | None, restitution: float | None) -> dict[str, Option]:
    """Options of a contact; None: value of the material."""
    by = "; default: that of the material" if friction is None else ""
    return {
        "friction": Option(friction, f"friction coefficient{by}", 1e-3, 10.0),
        "restitution": Option(restitution, f"coefficient of restitution{by}", 0.02, 1.0),
    }


def seconds(default: float, least: float = 0.1, most: float = 60.0) -> Option:
    """Option for the duration of a scene."""
    return Option(default, "duration of the recording, in s", least, most)


def speed(default: float, text: str, most: float = 1e3) -> Option:
    """Option for a speed."""
    return Option(default, f"{text}, in m/s", 1e-3, most)


def length(default: float, text: str) -> Option:
    """Option for a length."""
    return Option(default, f"{text}, in m", 1e-3, 1e3)


def ball_mass(material: str | None, radius: float) -> float:
    """Mass of a homogeneous ball [kg], of the density of water if the material has none."""
    density = MATERIALS[material].density if material else None
    return 4.0 / 3.0 * pi * radius**3 * (density or 1000.0)
