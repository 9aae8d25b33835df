"""Velocities from a stroboscopic picture, as Maw, Barber & Fawcett (1981) read them, with the error of the reading.

The picture shows, at each flash, the centre of a puck and some markers on it. Each point is transferred by hand, with
a drafting error alike in both directions. Before the impact and after it the puck moves freely: the centre along a
straight line, the markers around it at an even rate. Both are fitted at once, by least squares over all points of one
flight; with a known drafting error that gives the covariance of velocity and spin too.

Units: metres on the table, seconds, radians; points have shape (..., 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.case import Array

MOST_ROUNDS = 50
SETTLED = 1e-12  # largest change of a round, over the size of the flight


@dataclass(frozen=True)
class Motion:
    """Free motion of a puck as read from a picture.

    Attributes:
        velocity: Of the centre [m/s], shape (2,).
        spin: Counterclockwise [rad/s].
        covariance: Of (velocity x, velocity y, spin), shape (3, 3).
        residual: Root mean square of what the fit leaves, a coordinate [m].
    """

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
    """Where the centre and the markers of a freely moving puck are at the flashes.

    Args:
        times: Of the flashes [s], shape (n,).
        centre: At time zero [m], shape (2,).
        velocity: Of the centre [m/s], shape (2,).
        angles: Of the markers at time zero [rad], shape (m,).
        spin: Counterclockwise [rad/s].
        radii: Of the markers [m], shape (m,).

    Returns:
        Centres, shape (n, 2), and markers, shape (m, n, 2) [m].
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
        centres: Points of the centre [m], shape (n, 2).
        markers: Points of the markers [m], shape (m, n, 2), m >= 1.
        radii: Distances of the markers from the centre [m], shape (m,), taken as exact.
        error: Drafting error, standard deviation of each coordinate on the table [m], > 0.

    Raises:
        ValueError: Shapes that do not match, too few flashes, or a value outside its range.
        RuntimeError: The fit does not settle; the points are no flight.
    """
    t, c, p, r = (np.asarray(x, dtype=float) for x in (times, centres, markers, radii))
    _check(t, c, p, r, error)
    middle = t.mean()
    t = t - middle
    (velocity, centre) = np.polyfit(t, c, 1)
    arms = p - c
    angle = np.unwrap(np.arctan2(arms[..., 1], arms[..., 0]), axis=1)
    spin, angles = np.polyfit(t, angle.T, 1)
    unknown: Array = np.concatenate([velocity, [spin.mean()], centre, angles])
    size = max(float(np.abs(c - c.mean(axis=0)).max()), float(r.max()))
    for _ in range(MOST_ROUNDS):
        left, jacobian = _misfit(unknown, t, c, p, r)
        change: Array = np.linalg.lstsq(jacobian, left, rcond=None)[0].astype(np.float64)
        unknown = np.add(unknown, change)
        if np.abs(jacobian @ change).max() <= SETTLED * size:
            break
    else:
        raise RuntimeError(f"markers: the fit of {t.size} flashes does not settle; the points are no free flight")
    left, jacobian = _misfit(unknown, t, c, p, r)
    covariance: Array = error**2 * np.linalg.inv(jacobian.T @ jacobian)[:3, :3].astype(np.float64)
    return Motion(unknown[:2], float(unknown[2]), covariance, float(np.sqrt(np.mean(left**2))))


def read_impact(before: Motion, after: Motion, *, normal: ArrayLike, radius: float, inertia_factor: float) -> Reading:
    """Angles, restitution and friction of an impact from the flights before and after it.

    Args:
        before, after: The two flights.
        normal: Unit vector from the block to the puck, shape (2,).
        radius: Of the puck, from the centre to the contact [m].
        inertia_factor: 1 + 1/K^2; 3 for a disk.

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
    flashes, count = t.size, r.size
    jacobian = np.zeros((1 + count, flashes, 2, unknown.size))
    for axis in range(2):
        jacobian[:, :, axis, axis] = t
        jacobian[:, :, axis, 3 + axis] = 1.0
    arms = markers - centres
    turning = np.stack([-arms[..., 1], arms[..., 0]], axis=-1)
    jacobian[1:, :, :, 2] = turning * t[:, None]
    for number in range(count):
        jacobian[1 + number, :, :, 5 + number] = turning[number]
    return left, jacobian.reshape(-1, unknown.size)


def _check(t: Array, c: Array, p: Array, r: Array, error: float) -> None:
    """Refuse what cannot be fitted."""
    if t.ndim != 1 or t.size < 2 or not (np.diff(t) > 0.0).all():
        raise ValueError(f"times: shape {t.shape}; must be (n,) with n >= 2, rising")
    if c.shape != (t.size, 2):
        raise ValueError(f"centres: shape {c.shape}; must be ({t.size}, 2) to match times")
    if r.ndim != 1 or r.size < 1 or not (r > 0.0).all():
        raise ValueError(f"radii: {r!r}; must be (m,) with m >= 1, all > 0")
    if p.shape != (r.size, t.size, 2):
        raise ValueError(f"markers: shape {p.shape}; must be ({r.size}, {t.size}, 2) to match radii and times")
    if not all(np.isfinite(values).all() for values in (t, c, p, r)):
        raise ValueError("times, centres, markers, radii: every value must be finite")
    if not (np.isfinite(error) and error > 0.0):
        raise ValueError(f"error = {error!r}: must be > 0")
