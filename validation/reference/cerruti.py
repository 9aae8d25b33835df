"""Tangential displacement of a half-space under tractions that are uniform over square cells, by FFT.

Cerruti's solution for two like half-spaces, in units of annulus_kernel.py (the mean over all directions is 1/(pi r)):

    u_x = 1/pi integral [(A/r + B x^2/r^3) t_x + B x y/r^3 t_y]       A = 2 (1 - nu)/(2 - nu), B = 2 nu/(2 - nu)

and likewise for u_y. Over a square all three integrals are elementary; antiderivatives in both coordinates:

    x^2/r^3: y asinh(x/|y|)       y^2/r^3: x asinh(y/|x|)       x y/r^3: -r       1/r: the first two together

Displacements are those of the cells' middles. Convolution is exact, on a grid padded to twice its size.

Sources: Johnson, Contact Mechanics (1985), sections 3.6 (a) and 7.2; integrals: Kalker, Three-Dimensional Elastic
Bodies in Rolling Contact (1990), appendix C; FFT: Stanley & Kato, J. Tribology 119 (1997) 481.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.fft import irfft2, rfft2
from scipy.fft import next_fast_len

from validation.reference.normal_motion import Array


def square_influence(cells: int, nu: float, height: float = 1.0) -> tuple[Array, Array, Array]:
    """Displacements xx, yy and xy = yx at whole offsets -cells < i, j < cells, of a unit square with unit traction.

    Shape (2 cells - 1, 2 cells - 1) each, first axis x; height: along y, of a rectangle in place of the square.
    """
    edges = np.arange(-cells, cells, dtype=np.float64) + 0.5
    x, y = np.meshgrid(edges, height * edges, indexing="ij")

    def squares(corner: Array) -> Array:
        return np.diff(np.diff(corner, axis=0), axis=1)

    along = squares(y * np.arcsinh(x / np.abs(y)))  # x^2/r^3
    across = squares(x * np.arcsinh(y / np.abs(x)))  # y^2/r^3
    mixed = squares(-np.hypot(x, y))  # x y/r^3
    even, odd = 2.0 * (1.0 - nu) / (2.0 - nu) / math.pi, 2.0 * nu / (2.0 - nu) / math.pi
    return even * (along + across) + odd * along, even * (along + across) + odd * across, odd * mixed


@lru_cache(maxsize=128)
def _transforms(cells: int, nu: float, height: float) -> tuple[int, tuple[Array, Array, Array]]:
    size = int(next_fast_len(2 * cells - 1, real=True))  # type: ignore[arg-type]
    shift = np.arange(-cells + 1, cells) % size
    found = []
    for kernel in square_influence(cells, nu, height):
        wrapped = np.zeros((size, size))
        wrapped[np.ix_(shift, shift)] = kernel
        found.append(rfft2(wrapped))
    return size, (found[0], found[1], found[2])


def displacement(traction: Array, nu: float, height: float = 1.0) -> Array:
    """Displacement in units of a cell's width, shape (2, n, n), under the traction of the same shape."""
    cells = traction.shape[-1]
    size, (xx, yy, xy) = _transforms(cells, nu, height)
    x, y = rfft2(traction, s=(size, size))
    both = np.stack([xx * x + xy * y, xy * x + yy * y])
    return irfft2(both, s=(size, size))[:, :cells, :cells]
