"""Tables of impacts to calibrate from: those that the paper's figures would be, and published ones."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, radians, sin
from typing import NamedTuple

import numpy as np

from validation.case import Array
from validation.measured import load
from validation.prediction import reference

Columns = tuple[Array, Array, Array, Array]
"""V_z1, V_x1, V_z2, V_x2 [m/s], shape (n,) each."""

DISK, SPHERE = 0.5, 0.4
"""K^2 of the paper's pucks, and of a solid ball."""
COUNT = 18  # impacts of one figure of the paper
KHARAZ_SPEED, KHARAZ_RADIUS = 3.875, 2.5e-3  # [m/s], [m]
KHARAZ_RESTITUTION, KHARAZ_FRICTION = 0.98, 0.092
KHARAZ_ANGLE = radians(0.1)  # [rad] how well an angle of a velocity is taken to be known; the source does not say
CROSS_ANGLE = radians(1.0)  # [rad]


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
    slowed, spun = load("kharaz_et_lethe"), load("kharaz_omega_lethe")
    error, parts = KHARAZ_SPEED * KHARAZ_ANGLE, {}
    for name, table in (("tangential restitution", slowed), ("spin", spun)):
        theta = np.radians(table["theta_deg"])
        z1, x1 = KHARAZ_SPEED * np.cos(theta), KHARAZ_SPEED * np.sin(theta)
        lost = 1.4 * KHARAZ_RADIUS * spun["omega_abs_rad_s"] if name == "spin" else 3.5 * (1.0 - slowed["e_t_cm"]) * x1
        parts[name] = np.stack([z1, x1, x1 - lost])
    parts["both"] = np.concatenate([*parts.values()], axis=1)
    return [Published(name, (z1, x1), (None, x2), np.outer([error, 3.5 * error], np.ones(x2.size)), error,
                      KHARAZ_RESTITUTION) for name, (z1, x1, x2) in parts.items()]  # fmt: skip


def balls() -> list[Published]:
    """Cross: one impact each of a superball or golf ball (2010, at 4 m/s and 25 degrees), and of a superball (2002)."""
    table, block = load("cross2010_balls"), load("cross2002_superball")
    speed, angle = 4.0, radians(25.0)
    z1, x1, error = speed * cos(angle), speed * sin(angle), speed * CROSS_ANGLE
    out = []
    for row, (ball, surface) in enumerate(zip(table.words["ball"], table.words["surface"], strict=True)):
        z2, x2 = table["e_n"][row] * z1, -table["e_t_contact"][row] * x1
        spread = np.array([[error], [0.01 * x1]])
        name = f"{ball} on {surface.replace('_', ' ')}"
        out.append(Published(name, _one(z1, x1), _one(z2, x2), spread, 0.01 * z1))
    v = {name: float(block[name][0]) for name in ("vx_in", "vy_in", "vx_out", "vy_out", "omega_out", "R_m")}
    before, after = _one(-v["vy_in"], v["vx_in"]), _one(v["vy_out"], v["vx_out"] - v["R_m"] * v["omega_out"])
    error = 0.025 * v["vx_in"]  # 2 to 3 %
    return [*out, Published("superball on block (2002)", before, after, np.full((2, 1), error), error)]


def _one(normal: float, tangential: float) -> tuple[Array, Array]:
    return np.array([normal]), np.array([tangential])
