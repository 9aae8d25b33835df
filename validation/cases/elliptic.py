"""Elliptic contacts: the rebound along the longer axis, across it and askew, against the grid."""

from itertools import product
from math import cos, exp, radians, sin

import numpy as np

from contactlaw import ContactPair, rebound
from contactlaw.world import World
from validation.ball import FLOOR, STEEL
from validation.case import Array, Case, Data, Limit, Outcome, Table, worst
from validation.cases.shapes import elongation, struck
from validation.prediction import SPHERE

ASKED = 1e-2  # in psi_2, where 1 is friction times the speed of approach
FRICTION, MASS, SPEED = 0.3, 0.3, 1e-3  # slow: the patch hardly travels over long bodies, which rigid motion makes turn
PAIR = ContactPair(STEEL, STEEL, FRICTION)
PSI = (0.4, 1.2, 2.5, 4.0)
WAYS = {"along": 0.0, "askew": 45.0, "across": 90.0}  # [degrees] from the longer axis
ELLIPSOIDS = {"ellipsoid 5 : 2 : 2 on a plane": (0.03, 0.012, 0.012), "the same, 10 : 1 : 2": (0.06, 0.006, 0.012)}
CROSSED = "crossed cylinders, radii 1 : 3"


class Elliptic(Case):
    """An elliptic contact is softer along its longer axis than across it, as given by elliptic integrals, while
    Coulomb's limit is the same in all directions. With both in the law, rebounds of ellipsoids and crossed cylinders
    agree in each direction with those of a grid with Hertz's elliptic pressure and Cerruti's kernel. The last column
    gives the error if the contact is taken as a circle of the same normal stiffness.
    """

    place = 53
    title = "Elliptic contacts"

    def run(self, quick: bool) -> Outcome:
        kappa, rows = float(PAIR.kappa), []
        nu = 2.0 * (1.0 - kappa) / (2.0 - kappa)  # of like materials
        chi = SPHERE * kappa / 2.0
        bodies = {name: partial_curvatures(half) for name, half in ELLIPSOIDS.items()}
        bodies[CROSSED] = (1.0 / 0.03, 1.0 / 0.01)
        for (name, curvatures), (way, angle) in product(bodies.items(), WAYS.items()):
            ratio, found, circle = exp(-elongation(*curvatures)), [], []
            along = np.array([cos(radians(angle)), sin(radians(angle))])
            for psi in PSI[1:3] if quick else PSI:
                truth = by_grid(psi * along, chi, nu, ratio, quick)
                found.append(np.abs(impact(name, psi * along) - truth).max())
                circle.append(np.abs(float(rebound(psi, chi)) * along - truth).max())
            rows.append({"name": name, "way": way, "ratio": ratio, "error": max(found), "circle": max(circle)})
        limits = [Limit(f"psi_2 from the grid, {name}", ASKED, worst(rows, "error", name=name)) for name in bodies]
        return Outcome(limits, {"rows": rows})

    def table(self, data: Data) -> Table:
        return Table("contact | b/a | direction of the slide | error of psi_2 | error as a circle",
                     "{name} | {ratio:.3f} | {way} | {error:.1e} | {circle:.1e}", data["rows"])  # fmt: skip


def partial_curvatures(half: tuple[float, float, float]) -> tuple[float, float]:
    """Curvatures [1/m] of an ellipsoid that stands on a plane along its third axis, the smaller one along x."""
    return half[2] / half[0] ** 2, half[2] / half[1] ** 2


def impact(name: str, psi_1: Array) -> Array:
    """psi_2 along and across the longer axis of a body whose moments of inertia are a ball's, in a world."""
    world, unit = World(gravity=0.0, timestep=1e-3), FRICTION / PAIR.kappa * SPEED
    below, rest = (ELLIPSOIDS[name][2], 0.0) if name in ELLIPSOIDS else (0.01, 0.03)
    place, velocity = (0.0, 0.0, below + rest + 1e-9), (*(unit * psi_1), -SPEED)
    body = world.add_body(MASS, 0.4 * MASS * below**2, place, velocity)
    if name in ELLIPSOIDS:
        shapes = world.add_ellipsoid(body, ELLIPSOIDS[name]), world.add_plane(None, *FLOOR)
    else:
        other = world.add_cylinder(None, 0.03, 0.05, axis=(0.0, 1.0, 0.0))
        shapes = world.add_cylinder(body, 0.01, 0.05, axis=(1.0, 0.0, 0.0)), other
    world.add_contact(*shapes, PAIR)
    struck(world)
    v, w = world.velocity[body], world.spin[body]
    return np.array([v[0] - below * w[1], v[1] + below * w[0]]) / unit


def by_grid(psi_1: Array, chi: float, nu: float, ratio: float, quick: bool) -> Array:
    """The same by the grid, extrapolated to first order in the width of its cells."""
    from validation.reference import grid

    coarse, fine = (
        grid.rebound((*psi_1, 0.0), (chi, chi, 0.0), nu=nu, cells=cells, steps=4 * cells, ratio=ratio)[:2]
        for cells in ((8, 16) if quick else (16, 32))
    )
    return 2.0 * fine - coarse
