"""One step of the grid solver: the traction, within Coulomb's caps, that ends it.

With w = (w_x - theta y, w_y + theta x) the rigid displacement, u(t) the elastic one and S what has slipped before, the
traction t of every cell has

    |t| < p: w - S - u = 0        |t| = p: the slip of the step, w - S - u, is along t

the minimum of 1/2 t.u(t) - t.(w - S) within the caps p, unique as u is positive. Of a body that moves freely,
w = free - C Q with Q = (F_x, F_y, M/a_max): one more positive term. The minimum is found by projected gradients with
Nesterov's momentum, given up where it points uphill.

Sources: the principle: Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 4.3; convergence:
Beck & Teboulle, SIAM J. Imaging Sci. 2 (2009) 183; momentum given up: O'Donoghue & Candes, Found. Comput. Math. 15
(2015) 715; for frictional contact: Mazhar, Heyn, Negrut & Tasora, ACM Trans. Graph. 34 (2015) 32.
"""

import math
from dataclasses import dataclass

import numpy as np

from validation.reference.cerruti import displacement
from validation.reference.normal_motion import Array

TOLERANCE = 1e-6  # of the normal force: change of all cell forces together in the last iteration
MOST_ITERATIONS = 5000
ON_THE_CAP = 1.0 - 1e-12  # share of the cap from which a cell slips: projection leaves it there up to rounding
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)  # across a cell, for its share of the pressure


def cell_pressure(a: float, h: float, cells: int) -> Array:
    """Mean over each cell, of width h, of the pressure (2/pi) sqrt(a^2 - r^2), shape (cells, cells); sums to P.

    Exact along one axis, by Gauss points along the other, and the mean of both ways; all share what is missing of P.
    """
    if a == 0.0:
        return np.zeros((cells, cells))
    edges = h * (np.arange(cells + 1) - 0.5 * cells)
    x = edges[:-1, None] + 0.5 * h * (1.0 + POINTS)
    width = np.sqrt(np.maximum(a * a - x * x, 1e-300))[..., None]
    share = np.clip(edges / width, -1.0, 1.0)
    strips = np.diff(0.5 * width**2 * (share * np.sqrt(1.0 - share**2) + np.arcsin(share)), axis=-1)
    force = np.tensordot(strips, WEIGHTS, axes=(1, 0))
    force += force.T
    return force * (4.0 / 3.0 * a**3 / (force.sum() * h * h))


def sizes(vectors: Array) -> Array:
    """Lengths of vectors, shape (2, ...)."""
    return np.sqrt(vectors[0] ** 2 + vectors[1] ** 2)


def capped(traction: Array, caps: Array) -> Array:
    """The nearest traction within the caps."""
    size = sizes(traction)
    over = size > caps
    return traction * np.where(over, caps / np.where(over, size, 1.0), 1.0)


@dataclass(frozen=True)
class Step:
    """The problem of one step, on a square window of cells around the middle of the contact.

    Attributes:
        h, height: Width of a cell, and its height along y over that.
        nu, radius: Poisson's ratio; contact radius a at the end of the step.
        caps, arms: Pressure of the cells, shape (n, n); -y/a_max and x/a_max of their middles, shape (2, n, n).
        free: w that the step would end with if there were no force at its end: w_x, w_y, theta a_max.
        compliance, slipped: C, shape (3,), zeros for a given path; S, shape (2, n, n).
    """

    h: float
    nu: float
    radius: float
    caps: Array
    arms: Array
    free: Array
    compliance: Array
    slipped: Array
    height: float = 1.0

    def resultant(self, traction: Array) -> Array:
        """F_x, F_y and M/a_max."""
        return self.h**2 * self.height * np.array([traction[0].sum(), traction[1].sum(), (self.arms * traction).sum()])

    def slip(self, traction: Array) -> Array:
        """Slip of the step, shape (2, n, n), for a traction at its end."""
        w = self.free - self.compliance * self.resultant(traction)
        rigid = w[:2, None, None] + self.arms * w[2]
        return rigid - self.slipped - self.h * displacement(traction, self.nu, self.height)

    def solve(self, guess: Array) -> Array:
        """The traction, found from a guess.

        Raises:
            RuntimeError: The iterations do not end.
        """
        # Uniform traction 1 on a disc of radius a moves its middle by 2 a if nu = 0, never by more than 2 a (A + B).
        softest = 4.0 / (2.0 - self.nu) * (self.radius + self.h)
        softest += float(self.compliance.sum()) * math.pi * (self.radius + self.h) ** 2
        enough = TOLERANCE * self.caps.sum()
        traction = ahead = capped(guess, self.caps)
        momentum = 1.0
        for _ in range(MOST_ITERATIONS):
            slip = self.slip(ahead)
            new = capped(ahead + slip / softest, self.caps)
            if sizes(new - ahead).sum() <= enough:
                return new
            if (slip * (new - traction)).sum() < 0.0:
                momentum = 1.0
            following = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * momentum**2))
            ahead = new + (momentum - 1.0) / following * (new - traction)
            traction, momentum = new, following
        raise RuntimeError(f"stick and slip did not settle in {MOST_ITERATIONS} iterations")

    def slipped_after(self, traction: Array) -> Array:
        """S at the end of the step; the residual of a cell that sticks is no slip, one without pressure follows w."""
        return self.slipped + np.where(sizes(traction) >= self.caps * ON_THE_CAP, self.slip(traction), 0.0)
