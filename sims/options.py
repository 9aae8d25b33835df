"""What scenes may be told: numbers with a default and a range, and those that every scene with a ball has."""

from math import pi
from typing import NamedTuple

from contactlaw import MATERIALS, checks


class Option(NamedTuple):
    """A number that a scene may be told; whole numbers where the default is one.

    Attributes:
        default: None: the scene finds it out, as `help` says.
        help: What it is, with its unit.
        low, high: The range that is allowed.
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
    """What is told of any ball and its contact; mass None: that of a ball of the material."""
    return of_contact(friction, restitution) | {
        "mass": Option(mass, "of a ball, in kg" + ("" if mass else "; default: by radius and material"), 1e-6, 1e4),
        "radius": Option(radius, "of a ball, in m", 5e-4, 1.0),
    }


def of_contact(friction: float | None, restitution: float | None) -> dict[str, Option]:
    """What is told of any contact; None: by the material."""
    by = "; default: by the material" if friction is None else ""
    return {
        "friction": Option(friction, f"mu of the contact{by}", 1e-3, 10.0),
        "restitution": Option(restitution, f"of the contact{by}", 0.02, 1.0),
    }


def seconds(default: float, least: float = 0.1, most: float = 60.0) -> Option:
    """Of a scene that may go on."""
    return Option(default, "how long it is watched, in s", least, most)


def speed(default: float, text: str, most: float = 1e3) -> Option:
    """One in m/s."""
    return Option(default, f"{text}, in m/s", 1e-3, most)


def length(default: float, text: str) -> Option:
    """One in m."""
    return Option(default, f"{text}, in m", 1e-3, 1e3)


def ball_mass(material: str | None, radius: float) -> float:
    """Of a homogeneous ball [kg]; of water where the material has no density."""
    density = MATERIALS[material].density if material else None
    return 4.0 / 3.0 * pi * radius**3 * (density or 1000.0)
