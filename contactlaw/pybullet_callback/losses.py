"""Energy that Bullet takes from a body without saying so: its default damping and its clamp of velocities.

Neither can be read through PyBullet (getDynamicsInfo does not hold them), so both are recognised by what they do.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from contactlaw.pair import ContactWarning
from contactlaw.pybullet_callback.shapes import BASE, MULTIBODY, Key

Array = NDArray[np.float64]

DAMPING = 0.04  # Bullet's default linearDamping and angularDamping
CLAMP = 100.0  # Bullet's default maxJointVelocity: limit of each velocity component [m/s], [rad/s]


class Losses:
    """Watches bodies for both and warns once of each.

    Attributes:
        flying: Bodies to look at, in the first steps of a flight.
    """

    def __init__(self, client: int) -> None:
        self._client = client
        self._watched: dict[int, FlightWatch] = {}
        self._clamped: set[int] = set()
        self.flying: dict[int, FlightWatch] = {}

    def adopt(self, body: int) -> None:
        """Watch a body, if it is one that can be judged."""
        if is_free(self._client, body):
            self._watched[body] = self.flying[body] = FlightWatch(self._client, body)

    def release(self, body: int) -> None:
        """Watch a body no more."""
        for known in (self._watched, self.flying):
            known.pop(body, None)
        self._clamped.discard(body)

    def take_off(self, body: int) -> None:
        """A flight of the body begins."""
        watch = self._watched.get(body)
        if watch is not None:
            watch.take_off()
            self.flying[body] = watch

    def watch(self, busy: set[int], parameters: dict[str, Any]) -> None:
        """Look for damping in the bodies whose flight has just begun.

        Args:
            busy: Those that are near others.
            parameters: The engine's.
        """
        gravity = np.array([parameters[f"gravityAcceleration{axis}"] for axis in "XYZ"])
        for body, watch in list(self.flying.items()):
            found = [] if body in busy else watch.look(parameters["fixedTimeStep"], gravity)
            if found or watch.comparisons == 0:
                del self._watched[body]
            if found or watch.looks == 0 or watch.comparisons == 0 or body in busy:
                del self.flying[body]
            if found:
                _warn(
                    f"body {body}: loses speed in free flight, {' = '.join(found)} = {DAMPING}, Bullet's default; call "
                    f"changeDynamics({body}, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e6)"
                )

    def warn_of_clamp(self, key: Key, speeds: Array) -> None:
        """Warn of a base that moves at the limit; speeds: sizes of all components [m/s], [rad/s]."""
        body, link = key
        if link == BASE and body not in self._clamped and CLAMP in speeds:
            self._clamped.add(body)
            _warn(
                f"body {body}: moves at {CLAMP} m/s or rad/s, Bullet's default limit, and loses energy; call "
                f"changeDynamics({body}, -1, maxJointVelocity=1e6)"
            )


class FlightWatch:
    """Recognises Bullet's default damping, which cannot be read, by what it does to a body in free flight.

    Bullet's multibodies lose dv = -d (1 + |v|) v dt, and the same for spin, with d = 0.04 by default.

    Attributes:
        looks: How often to look yet in the flight that has begun.
        comparisons: How many steps of a moving body are left to judge.
    """

    LOOKS = 3  # a body let go from rest moves at the second, and shows its loss at the third

    def __init__(self, client: int, body: int) -> None:
        self._client, self._body = client, body
        self.comparisons = 4
        self.take_off()

    def take_off(self) -> None:
        """A flight begins."""
        self.looks = self.LOOKS
        self._last: tuple[Array, Array] | None = None

    def look(self, dt: float, gravity: Array) -> list[str]:
        """Compare with the velocity one step earlier; returns the names of the damping found."""
        velocity, spin = (np.array(v) for v in p.getBaseVelocity(self._body, self._client))
        last, self._last = self._last, (velocity, spin)
        self.looks -= 1
        found = []
        if last is not None and (last[0].any() or last[1].any()):
            self.comparisons = max(self.comparisons - 1, 0)
            if self._damped(last[0], velocity - gravity * dt, dt):
                found.append("linearDamping")
            if self._damped(last[1], spin, dt):
                found.append("angularDamping")
        return found

    def _damped(self, before: Array, after: Array, dt: float) -> bool:
        loss = DAMPING * (1.0 + float(np.linalg.norm(before))) * dt * before
        return bool(loss.any()) and float(np.linalg.norm(after - before + loss)) < 1e-3 * float(np.linalg.norm(loss))


def is_free(client: int, body: int) -> bool:
    """Whether the body is a multibody without links that can move."""
    info = p.getDynamicsInfo(body, BASE, client)
    return info[0] > 0.0 and info[10] == MULTIBODY and p.getNumJoints(body, client) == 0


def _warn(message: str) -> None:
    warnings.warn(message, ContactWarning, stacklevel=4)
