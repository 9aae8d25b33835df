"""Slides that turn: the paths on which laws are judged, in units in which the whole contact slips from 1 on.

A path starts at rest without traction and has marks at which forces are compared: MARKS a turn, on straight lines as
many as a quarter turn has. Between two marks it can be sampled as finely as wanted.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from validation.reference.normal_motion import Array

MARKS = 24
LEG = MARKS // 4
TURNS = 1.5


def _around(fine: int) -> Array:
    return np.linspace(0.0, 2.0 * math.pi * TURNS, int(TURNS * MARKS) * fine + 1)


def _line(start: tuple[float, float], end: tuple[float, float], fine: int) -> Array:
    return np.linspace(start, end, LEG * fine + 1)


def _ellipse(ratio: float, fine: int) -> Array:
    angle = _around(fine)
    return np.concatenate(
        [_line((0.0, 0.0), (1.0, 0.0), fine)[:-1], np.stack([np.cos(angle), ratio * np.sin(angle)], 1)]
    )


def _square(fine: int) -> Array:
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    sides = [_line(*ends, fine)[1:] for ends in pairwise(corners)]
    return np.concatenate([[[0.0, 0.0]], *sides])


def _eight(fine: int) -> Array:
    angle = _around(fine)
    return np.stack([np.sin(angle), 0.5 * np.sin(2.0 * angle)], 1)


def _through_middle(fine: int) -> Array:
    angle = _around(fine)
    return np.stack([1.0 - np.cos(angle), np.sin(angle)], 1)


def path(name: str, amplitude: float, fine: int = 1) -> tuple[Array, Array]:
    """Overlap and displacement along a path.

    Args:
        name: One of NAMES.
        amplitude: Size over the displacement of full slip at overlap 1, > 0.
        fine: Steps from mark to mark, >= 1.

    Returns:
        Overlap, shape (n,), and displacement, shape (n, 2), n = 1 + fine times the number of marks after the first.

    Raises:
        ValueError: An argument is outside its range.
    """
    if name not in NAMES:
        raise ValueError(f"name is {name!r}; it must be one of {', '.join(NAMES)}")
    shape, overlap = NAMES[name]
    slide = amplitude * shape(fine)
    part = np.linspace(0.0, 1.0, len(slide))
    return overlap(part), slide


def _steady(part: Array) -> Array:
    return np.ones_like(part)


def _swinging(part: Array) -> Array:
    return 1.0 - 0.3 * np.sin(5.0 * math.pi * part) ** 2


def _bounce(part: Array) -> Array:
    return np.sin(math.pi * part)


NAMES = {
    "circle": (lambda fine: _ellipse(1.0, fine), _steady),
    "ellipse": (lambda fine: _ellipse(0.4, fine), _steady),
    "square": (_square, _steady),
    "eight": (_eight, _steady),
    "circle, swinging load": (lambda fine: _ellipse(1.0, fine), _swinging),
    "circle, touch to release": (_through_middle, _bounce),
}
"""Shape of size 1 and overlap, by name: circle and ellipse (0.4) from the middle out and around, a square from its
corner, a figure of eight; then circles under a load that changes."""
