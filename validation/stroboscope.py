"""Velocities from a stroboscopic picture, as Maw, Barber & Fawcett (1981) read them, with the error of the reading.

The picture shows, at each flash, the centre of a puck and some markers on it. Each point is transferred by hand, with
a drafting error alike in both directions. Before the impact and after it the puck moves freely: the centre along a
straight line, the markers around it at an even rate. Both are fitted at once, by least squares over all points of one
flight; with a known drafting error that gives the covariance of velocity and spin too.

Units: metres on the table, seconds, radians; points have shape (..., 2).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from validation.case import Array

MOST_ROUNDS = 50
SETTLED = 1e-12  # largest change of a round, over the size of the flight


class Motion(NamedTuple):
    """Free motion of a puck as read from a picture: velocity of the centre [m/s], spin counterclockwise [rad/s], the
    covariance of these three, shape (3, 3), and the root mean square of what the fit leaves, a coordinate [m]."""

    velocity: Array
    spin: float
    covariance: Array
    residual: float


@dataclass(frozen=True)
class Reading:
    """What a picture says of an impact.

    Attributes:
        incidence: V_x1/V_z1 of the contact point.
        reflexion: V_x2/V_z1, over the approach speed as psi_2 is.
        restitution: V_z2/V_z1.
        friction: mu by eq. (6) of the paper; right for gross slip and restitution 1, (1 + e)/2 of mu below that.
        covariance: Of these four, shape (4, 4), to first order in the drafting error.
    """

    incidence: float
    reflexion: float
    restitution: float
    friction: float
    covariance: Array

    def psi(self, kappa: float, friction: float) -> tuple[Array, Array]:
        """psi_1 and psi_2 for a stiffness ratio and a friction taken as exact, and their standard errors."""
        scale = kappa / friction
        return (scale * np.array([self.incidence, self.reflexion]), scale * np.sqrt(np.diag(self.covariance)[:2]))


def pictured(
    times: Array, centre: ArrayLike, velocity: ArrayLike, angles: Array, spin: float, radii: Array
) -> tuple[Array, Array]:
    """Where the centre, (n, 2), and the markers, (m, n, 2), of a freely moving puck are at the flashes [m].

    times: of the flashes [s], shape (n,); centre and angles [rad] of the markers, shape (m,), are at time zero;
    velocity [m/s], spin counterclockwise [rad/s], radii of the markers [m], shape (m,).
    """
    centres = np.asarray(centre, dtype=float) + times[:, None] * np.asarray(velocity, dtype=float)
    turned = angles[:, None] + spin * times
    around = radii[:, None, None] * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    return centres, centres + around


def fit_motion(times: ArrayLike, centres: ArrayLike, markers: ArrayLike, radii: ArrayLike, error: float) -> Motion:
    """Velocity and spin of a free flight from the points of a picture.

    Args:
        times: Of the flashes [s], shape (n,), n >= 2, rising. Between two of them the puck turns by less than half a
            turn; a faster one is taken for a slower one, as in any stroboscopic picture.
        centres, markers: Their points [m], shape (n, 2) and (m, n, 2), m >= 1.
        radii: Distances of the markers from the centre [m], shape (m,), taken as exact.
        error: Drafting error, standard deviation of each coordinate on the table [m], > 0.

    Raises:
        RuntimeError: The fit does not settle; the points are no flight.
    """
    t, c, p, r = (np.asarray(x, dtype=float) for x in (times, centres, markers, radii))
    t = t - t.mean()
    velocity, centre = np.polyfit(t, c, 1)
    arms = p - c
    spin, angles = np.polyfit(t, np.unwrap(np.arctan2(arms[..., 1], arms[..., 0]), axis=1).T, 1)
    unknown: Array = np.concatenate([velocity, [spin.mean()], centre, angles])
    size = max(float(np.abs(c - c.mean(axis=0)).max()), float(r.max()))
    for _ in range(MOST_ROUNDS):
        left, jacobian = _misfit(unknown, t, c, p, r)
        change: Array = np.linalg.lstsq(jacobian, left, rcond=None)[0].astype(np.float64)
        unknown = np.add(unknown, change)
        if np.abs(jacobian @ change).max() <= SETTLED * size:
            left, jacobian = _misfit(unknown, t, c, p, r)
            covariance: Array = error**2 * np.linalg.inv(jacobian.T @ jacobian)[:3, :3].astype(np.float64)
            return Motion(unknown[:2], float(unknown[2]), covariance, float(np.sqrt(np.mean(left**2))))
    raise RuntimeError(f"markers: the fit of {t.size} flashes does not settle; the points are no free flight")


def read_impact(before: Motion, after: Motion, *, normal: ArrayLike, radius: float, inertia_factor: float) -> Reading:
    """Angles, restitution and friction of an impact from the flights before and after it.

    normal: unit vector from the block to the puck, shape (2,); radius [m]; inertia_factor: 1 + 1/K^2, 3 for a disk.

    Raises:
        ValueError: The puck does not approach the block before the impact.
    """
    n = np.asarray(normal, dtype=float)
    along = np.array([-n[1], n[0], -radius])  # of the contact point: v . t - omega R
    across = np.array([n[0], n[1], 0.0])
    first, second = (np.append(motion.velocity, motion.spin) for motion in (before, after))
    x1, z1, x2, z2 = along @ first, -across @ first, along @ second, across @ second
    if z1 <= 0.0:
        raise ValueError(f"before: the puck moves from the block at {-z1!r} m/s; it must approach")
    of_velocities = np.array([[*along, 0, 0, 0], [*-across, 0, 0, 0], [0, 0, 0, *along], [0, 0, 0, *across]])
    share = 2.0 * inertia_factor
    reading = np.array([x1, x2, z2, (x1 - x2) / share]) / z1
    of_reading = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [1 / share, 0, -1 / share, 0]], dtype=float)
    of_reading[:, 1] = -reading
    jacobian = of_reading / z1 @ of_velocities
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:] = before.covariance, after.covariance
    return Reading(*(float(value) for value in reading), covariance=jacobian @ both @ jacobian.T)


def _misfit(unknown: Array, t: Array, c: Array, p: Array, r: Array) -> tuple[Array, Array]:
    """Points less the model, flat, and the derivative of the model by (velocity, spin, centre, angles)."""
    velocity, spin, centre, angles = unknown[:2], float(unknown[2]), unknown[3:5], unknown[5:]
    centres, markers = pictured(t, centre, velocity, angles, spin, r)
    left = np.concatenate([(c - centres).ravel(), (p - markers).ravel()])
    jacobian = np.zeros((1 + r.size, t.size, 2, unknown.size))
    for axis in range(2):
        jacobian[:, :, axis, axis], jacobian[:, :, axis, 3 + axis] = t, 1.0
    arms = markers - centres
    turning = np.stack([-arms[..., 1], arms[..., 0]], axis=-1)
    jacobian[1:, :, :, 2] = turning * t[:, None]
    for number, one in enumerate(turning):
        jacobian[1 + number, :, :, 5 + number] = one
    return left, jacobian.reshape(-1, unknown.size)
