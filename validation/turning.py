"""What case and tests of slides that turn share: forces along the reference's paths, and impacts."""

from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair, Material, force_along_path
from contactlaw.laws import Law
from contactlaw.turning import MicroslipTurning
from validation.case import Array
from validation.ledger import DEEPEST, FRICTION, RADIUS, pair_of_law
from validation.reference.turning_data import BALL_CHI
from validation.reference.turning_paths import MARKS, path

TURNING = MicroslipTurning()

MASS, SPEED = 0.3, 0.3  # [kg], [m/s]


def forces(law: str | Law, name: str, amplitude: float, fine: int = 4) -> Array:
    """Force over mu P_max at the marks of a path of the reference, shape (n, 2)."""
    pair, (approach, slide) = pair_of_law(law), path(name, amplitude, fine)
    normal, force = force_along_path(pair, DEEPEST * approach, FRICTION / pair.kappa * DEEPEST * slide)
    return force[::fine] / (FRICTION * normal.max())


def impacts_world(rows: list[Any], law: str | Law = TURNING) -> tuple[Any, list[int]]:
    """A world of balls about to hit a plane, far from each other, and the balls.

    rows: chi along two directions, psi_1, its angle from the first [degrees], whatever follows. The moments of inertia
    make chi.
    """
    from contactlaw.world import World

    world, pair = World(gravity=0.0, timestep=1e-3), pair_of_law(law, None)
    plane, bodies, spheres = world.add_plane(None, (0, 0, 0), (0, 0, 1)), [], []
    for number, (chi_1, chi_2, psi, heading, *_) in enumerate(rows):
        about_y, about_x = (MASS * RADIUS**2 / (2.0 * chi / pair.kappa - 1.0) for chi in (chi_1, chi_2))
        angle, slide = np.radians(heading), psi * FRICTION * SPEED / pair.kappa
        velocity = slide * np.cos(angle), slide * np.sin(angle), -SPEED
        inertia = about_x, about_y, about_x + about_y
        bodies.append(world.add_body(MASS, inertia, (0.1 * number, 0.0, RADIUS + 1e-5), velocity))
        spheres.append(world.add_sphere(bodies[-1], RADIUS))
    world.add_contact(spheres, plane, pair)
    return world, bodies


def psi_2(world: Any, bodies: list[int]) -> Array:
    """Along both directions, shape (n, 2), after the impacts."""
    v, spin = world.velocity[bodies], world.spin[bodies]
    slide = np.stack([v[:, 0] - RADIUS * spin[:, 1], v[:, 1] + RADIUS * spin[:, 0]], 1)
    return slide * pair_of_law(TURNING, None).kappa / (FRICTION * SPEED)


def spun_world(rows: list[Any], heading: float = 0.0) -> tuple[Any, list[int]]:
    """The same of balls that spin about the normal too.

    rows: nu, chi_s, psi_1, sigma_1, whatever follows, as in `turning.json`; a chi_s of less than that of the ball is
    taken for that. heading: of the slide [rad].
    """
    from contactlaw.world import World

    world, bodies = World(gravity=0.0, timestep=1e-3), []
    plane = world.add_plane(None, (0, 0, 0), (0, 0, 1))
    for number, (nu, chi_s, psi, sigma, *_) in enumerate(rows):
        steel = Material(MATERIALS["steel"].youngs_modulus, nu)
        pair = ContactPair(steel, steel, FRICTION, radius=RADIUS)
        deepest = pair.greatest_overlap(MASS, SPEED)
        unit, a = FRICTION * SPEED / pair.kappa, np.sqrt(RADIUS * deepest)
        across = MASS * RADIUS**2 / (2.0 * BALL_CHI / pair.kappa - 1.0)
        about = min(across, 0.5 * pair.kappa * MASS * deepest * RADIUS / max(chi_s, 1e-9))
        velocity = psi * unit * np.cos(heading), psi * unit * np.sin(heading), -SPEED
        place, spin = (0.1 * number, 0.0, RADIUS + 1e-5), (0.0, 0.0, sigma * unit / a)
        bodies.append(world.add_body(MASS, (across, across, about), place, velocity, spin=spin))
        world.add_contact(world.add_sphere(bodies[-1], RADIUS), plane, pair)
    return world, bodies


def spun_errors(rows: list[Any], heading: float = 0.0) -> Array:
    """By how much psi_2 along the slide is off from the rows', shape (n,)."""
    world, bodies = spun_world(rows, heading)
    world.step(3)
    v, spin = world.velocity[bodies], world.spin[bodies]
    along, across = v[:, 0] - RADIUS * spin[:, 1], v[:, 1] + RADIUS * spin[:, 0]
    kappa = np.array([2.0 * (1.0 - row[0]) / (2.0 - row[0]) for row in rows])
    found = (along * np.cos(heading) + across * np.sin(heading)) * kappa / (FRICTION * SPEED)
    return found - np.array([row[4] for row in rows])


def loss(force: Array, name: str, amplitude: float) -> float:
    """Work of a turn, the last (of a square the only) one, over mu P_max times the displacement of full slip."""
    _, slide = path(name, amplitude)
    turn = slice(0 if name == "square" else len(slide) - MARKS - 1, None)
    mean, moved = 0.5 * (force[turn][1:] + force[turn][:-1]), np.diff(slide[turn], axis=0)
    return float((mean * moved).sum())
