"""Tables of impacts to calibrate from: those that the paper's figures would be, and published ones."""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, radians
from typing import NamedTuple

import numpy as np

from validation.case import Array
from validation.cases import alumina_on_glass as glass
from validation.cases import superball_and_golf as superballs
from validation.measured import load
from validation.prediction import reference

Columns = tuple[Array, Array, Array, Array]
"""V_z1, V_x1, V_z2, V_x2 [m/s], shape (n,) each."""

DISK, SPHERE = 0.5, 0.4
"""K^2 of the paper's pucks, and of a solid ball."""
COUNT = 18  # impacts of one figure of the paper
CROSS_ANGLE = radians(1.0)  # [rad] how well the angle before is known


@dataclass(frozen=True)
class PuckTable:
    """One of the paper's pucks, as its figure would have measured it: friction and restitution as the paper has them,
    kappa = 2(1 - nu)/(2 - nu), psi_1, shape (n,), and standard deviations of the four velocities from the true ones.
    """

    name: str
    friction: float
    restitution: float
    kappa: float
    incidences: tuple[float, ...]
    noise: Callable[[Columns], Columns]

    def true(self) -> Columns:
        """The impacts without errors, by the annulus reference, at 1 m/s."""
        psi_1 = np.array(self.incidences)
        unit, chi = self.friction / self.kappa, 0.5 * self.kappa * (1.0 + 1.0 / DISK)
        ones, after = np.ones(psi_1.size), reference(psi_1, chi, self.restitution)
        return ones, unit * psi_1, self.restitution * ones, unit * after

    def measured(self, seed: int) -> tuple[Columns, Columns]:
        """The impacts with errors, and the standard deviations of these."""
        true, generator = self.true(), np.random.default_rng(seed)
        errors = self.noise(true)
        z1, x1, z2, x2 = (v + e * generator.standard_normal(v.size) for v, e in zip(true, errors, strict=True))
        return (z1, x1, z2, x2), errors


def steel_noise(true: Columns) -> Columns:
    """One error in all velocities, such that mu of a single sliding impact is good to 5 % (two deviations)."""
    mu, e, ratio = STEEL_FRICTION, STEEL_RESTITUTION, 1.0 + 1.0 / DISK
    single = np.sqrt(2.0 + 2.0 * (mu * ratio) ** 2) / (ratio * (1.0 + e))  # error of one mu over that of a velocity
    error = np.full(true[0].size, 0.025 * mu / single)
    return error, error, error, error


def rubber_noise(true: Columns) -> Columns:
    """7 % in the angle before and 5 % in that after (two deviations), 1 % of the approach speed at least."""
    z1, x1, _, x2 = true
    floor = 0.01 * z1
    return floor, np.hypot(0.035 * x1, floor), floor, np.hypot(0.025 * x2, floor)


STEEL_FRICTION, STEEL_RESTITUTION = 0.115, 0.93
STEEL = PuckTable("steel", STEEL_FRICTION, STEEL_RESTITUTION, 2 * 0.72 / 1.72,
                  tuple(np.linspace(0.4, 8.0, COUNT).round(3)), steel_noise)  # fmt: skip
RUBBER = PuckTable("rubber", 2.4, 0.86, 2 / 3, tuple(np.linspace(0.3, 6.5, COUNT).round(3)), rubber_noise)


class Published(NamedTuple):
    """A published table at the contact point [m/s]: V_z1 and V_x1, V_z2 (None: not measured, but e) and V_x2, the error
    of the tangential ones before and after, shape (2, n), and of the normal ones."""

    name: str
    before: tuple[Array, Array]
    after: tuple[Array | None, Array]
    tangential_error: Array
    normal_error: float
    restitution: float | None = None


def alumina() -> list[Published]:
    """Kharaz, Gorham & Salman: alumina spheres on glass, by e_t, by spin, and both together.

    A homogeneous sphere that did not spin before: V_x2 = V_x1 - 3.5 (v_t1 - v_t2) = V_x1 - 1.4 R omega_2.
    """
    error, parts = glass.SPEED * radians(glass.UNSURE), {}
    for name, quantity in (("tangential restitution", "e_t"), ("spin", "spin")):
        theta, value = glass.measured(quantity)
        z1, x1 = glass.SPEED * np.cos(np.radians(theta)), glass.SPEED * np.sin(np.radians(theta))
        lost = 1.4 * glass.RADIUS * value if name == "spin" else 3.5 * (1.0 - value) * x1
        parts[name] = np.stack([z1, x1, x1 - lost])
    parts["both"] = np.concatenate([*parts.values()], axis=1)
    return [Published(name, (z1, x1), (None, x2), np.outer([error, 3.5 * error], np.ones(x2.size)), error,
                      glass.RESTITUTION) for name, (z1, x1, x2) in parts.items()]  # fmt: skip


def balls() -> list[Published]:
    """Cross: one impact each of a superball or golf ball (2010, 2002), over its speed of approach."""
    out = []
    for row in [*superballs.rows_2010(load("cross2010_balls")), superballs.row_2002(load("cross2002_superball"))]:
        x1 = row["tangent"]
        before, after = CROSS_ANGLE * hypot(1.0, x1), 0.01 * x1
        errors = (before, after, 0.01) if row["year"] == 2010 else (0.025 * x1,) * 3  # 2 to 3 %
        out.append(Published(row["name"], _one(1.0, x1), _one(row["e_n"], -row["e_t"] * x1),
                             np.array(errors[:2])[:, None], errors[2]))  # fmt: skip
    return out


def _one(normal: float, tangential: float) -> tuple[Array, Array]:
    return np.array([normal]), np.array([tangential])
