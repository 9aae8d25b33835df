"""Arguments checked where they enter: each error names the argument, its value and what is allowed."""

from __future__ import annotations

import math
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


def check_finite(name: str, value: float) -> None:
    """Raise ValueError unless the value is finite."""
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value!r}; it must be finite")


def check_positive(name: str, value: float) -> None:
    """Raise ValueError unless the value is finite and above zero."""
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} is {value!r}; it must be finite and above 0")


def check_poisson(nu: float) -> None:
    """Raise ValueError unless -1 < nu <= 1/2."""
    if not -1.0 < nu <= 0.5:
        raise ValueError(f"nu is {nu!r}; it must lie in (-1, 0.5]")


def check_restitution(restitution: float) -> None:
    """Raise ValueError unless 0 < restitution <= 1 (zero would need infinite damping)."""
    if not 0.0 < restitution <= 1.0:
        raise ValueError(f"restitution is {restitution!r}; it must lie in (0, 1]")


def check_annuli(annuli: int, name: str = "annuli") -> None:
    """Raise ValueError unless there are at least two annuli (rings, cells)."""
    if not isinstance(annuli, Integral) or annuli < 2:
        raise ValueError(f"{name} is {annuli!r}; it must be an integer, at least 2")


def check_steps(steps: int | None, name: str = "steps") -> None:
    """Raise ValueError unless the number of steps is left open or at least one."""
    if steps is not None and (not isinstance(steps, Integral) or steps < 1):
        raise ValueError(f"{name} is {steps!r}; it must be None or an integer, at least 1")


def vectors(name: str, values: ArrayLike, size: int) -> Array:
    """Finite vectors of the given size, shape (size,) or (n, size); ValueError otherwise."""
    array = np.array(values, dtype=float)
    if array.ndim not in (1, 2) or array.shape[-1] != size:
        raise ValueError(f"{name} has shape {array.shape}; its last axis must have {size} components")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} has the value {array[~np.isfinite(array)][0]}; all values must be finite")
    return array


def series(name: str, values: ArrayLike, size: int | None = None) -> Array:
    """Finite values of shape (n,), n >= 2, of the given size if there is one; ValueError otherwise."""
    array = np.array(values, dtype=float)
    if array.ndim != 1 or array.size < 2 or (size is not None and array.size != size):
        raise ValueError(f"{name} has shape {array.shape}; it must be ({size or 'n'},) with n at least 2")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} has the value {array[~np.isfinite(array)][0]}; all values must be finite")
    return array
