"""Slides that turn: the paths on which laws are judged, in units in which the whole contact slips from 1 on.

A path starts at rest without traction and has marks at which forces are compared: MARKS a turn, on straight lines as
many as a quarter turn has. Between two marks it can be sampled as finely as wanted.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from validation.reference.normal_motion import Array

MARKS = 24
LEG = MARKS // 4
TURNS = 1.5


def _line(start: tuple[float, float], end: tuple[float, float], fine: int) -> Array:
    return np.linspace(start, end, LEG * fine + 1)


def _around(fine: int, shape: Callable[[Array], list[Array]]) -> Array:
    """A shape over the angle, through `TURNS` turns."""
    return np.stack(shape(np.linspace(0.0, 2.0 * math.pi * TURNS, int(TURNS * MARKS) * fine + 1)), 1)


def _ellipse(ratio: float) -> Callable[[int], Array]:
    return lambda fine: np.concatenate([_line((0.0, 0.0), (1.0, 0.0), fine)[:-1],
                                        _around(fine, lambda a: [np.cos(a), ratio * np.sin(a)])])  # fmt: skip


def _square(fine: int) -> Array:
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    return np.concatenate([[[0.0, 0.0]], *(_line(*ends, fine)[1:] for ends in pairwise(corners))])


def path(name: str, amplitude: float, fine: int = 1) -> tuple[Array, Array]:
    """Overlap, shape (n,), and displacement, shape (n, 2), along a path.

    Args:
        name: One of NAMES.
        amplitude: Size over the displacement of full slip at overlap 1, > 0.
        fine: Steps from mark to mark, >= 1: n = 1 + fine times the number of marks after the first.

    Raises:
        ValueError: No such path.
    """
    if name not in NAMES:
        raise ValueError(f"name is {name!r}; it must be one of {', '.join(NAMES)}")
    shape, overlap = NAMES[name]
    slide = amplitude * shape(fine)
    return overlap(np.linspace(0.0, 1.0, len(slide))), slide


NAMES: dict[str, tuple[Callable[[int], Array], Callable[[Array], Array]]] = {
    "circle": (_ellipse(1.0), np.ones_like),
    "ellipse": (_ellipse(0.4), np.ones_like),
    "square": (_square, np.ones_like),
    "eight": (lambda fine: _around(fine, lambda a: [np.sin(a), 0.5 * np.sin(2.0 * a)]), np.ones_like),
    "circle, swinging load": (_ellipse(1.0), lambda part: 1.0 - 0.3 * np.sin(5.0 * math.pi * part) ** 2),
    "circle, touch to release": (
        lambda fine: _around(fine, lambda a: [1.0 - np.cos(a), np.sin(a)]), lambda part: np.sin(math.pi * part)
    ),
}  # fmt: skip
"""Shape of size 1 and overlap, by name: circle and ellipse (0.4) from the middle out and around, a square from its
corner, a figure of eight; then circles under a load that changes."""
