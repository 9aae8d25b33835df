"""What case and tests of slides that turn share: forces along the reference's paths, impacts, energy along any path."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair, Material, force_along_path
from contactlaw.jit import jit
from contactlaw.laws import Law
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import PAIR_SIZE, ask_energy, contact_of, pair_of
from contactlaw.laws.step import ask, prescribe
from contactlaw.turning import MicroslipTurning
from validation.case import Array
from validation.reference.turning_data import BALL_CHI
from validation.reference.turning_paths import MARKS, path

TURNING = MicroslipTurning()

FRICTION, RADIUS, DEEPEST = 0.1, 0.02, 2e-5  # mu; [m]
MASS, SPEED = 0.3, 0.3  # [kg], [m/s]
KINDS = ["steady", "growing", "shrinking", "any", "opening"]


def pair_of_law(law: str | Law = TURNING, radius: float | None = RADIUS) -> ContactPair:
    """Steel on steel."""
    return ContactPair(MATERIALS["steel"], MATERIALS["steel"], FRICTION, radius=radius, law=law)


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

    world, pair = World(0.0, 1e-3), pair_of_law(law, None)
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
    return slide * pair_of_law(radius=None).kappa / (FRICTION * SPEED)


def spun_world(rows: list[Any], heading: float = 0.0) -> tuple[Any, list[int]]:
    """The same of balls that spin about the normal too.

    rows: nu, chi_s, psi_1, sigma_1, whatever follows, as in `turning.json`; a chi_s of less than that of the ball is
    taken for that. heading: of the slide [rad].
    """
    from contactlaw.world import World

    world, bodies = World(0.0, 1e-3), []
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


def random_path(rng: np.random.Generator, kind: str, parts: int) -> tuple[Array, Array]:
    """Overlap over the deepest and displacement over that of full slip, a few straight legs in so many parts each."""
    legs = int(rng.integers(3, 10))
    overlap = {
        "steady": np.ones(legs + 1),
        "growing": np.sort(rng.uniform(0.02, 1.0, legs + 1)),
        "shrinking": -np.sort(-rng.uniform(0.02, 1.0, legs + 1)),
        "any": rng.uniform(0.12, 1.0, legs + 1),
        "opening": rng.uniform(-0.3, 1.0, legs + 1),
    }[kind]
    corners = np.cumsum(rng.normal(size=(legs + 1, 2)), axis=0) * 10.0 ** rng.uniform(-2.0, 0.5)
    at = np.linspace(0.0, legs, legs * parts + 1)
    place = np.stack([np.interp(at, np.arange(legs + 1), one) for one in corners.T], 1)
    # pressed in straight before it slides
    return np.append(0.0, np.interp(at, np.arange(legs + 1), overlap)), np.concatenate([place[:1], place])


def in_turn(overlap: Array, place: Array) -> tuple[Array, Array]:
    """The path on which each step changes the load first, then the place.

    Every path is the limit of such. Along them the work of the mean force is exact; where both change at once it is off
    by the square of the step, for any law: Coulomb's own force gives back 1e-3 in 16 steps a leg, 5e-5 in 64.
    """
    return np.repeat(overlap, 2)[1:], np.repeat(place, 2, axis=0)[:-1]


def dissipated(law: str | Law, overlap: Array, place: Array) -> tuple[Array, Array]:
    """Work done on a contact along a path less the energy that it holds, over mu P_max times the length of the path.

    One step from point to point; the second is the force over mu P_max, (n, 2). Overlap and place as in `random_path`.
    """
    pair, p = _numbers(law)
    unit, out = FRICTION / pair.kappa * DEEPEST, np.zeros((overlap.size, 3))
    _ledger(p, DEEPEST * overlap, unit * place, *pair.rule.new_contact(), out)
    limit = FRICTION * 4.0 / 3.0 * pair.effective_modulus * np.sqrt(RADIUS) * DEEPEST**1.5
    force, moved = out[:, :2] / limit, np.diff(place, axis=0)
    work = np.append(0.0, np.cumsum(0.5 * ((force[1:] + force[:-1]) * moved).sum(axis=1)))
    return (work - out[:, 2] / (limit * unit)) / np.hypot(*moved.T).sum(), force


@lru_cache
def _numbers(law: str | Law) -> tuple[ContactPair, Array]:
    pair = pair_of_law(law)
    return pair, pair.parameters()


@jit
def _ledger(p, overlap, place, header, memory, out):
    """Force along both tangents [N] and energy [J] at each point of a path."""
    pair, contact, law = pair_of(p), contact_of(header), p[PAIR_SIZE:]
    prescribe(contact, pair, np.max(overlap))
    for k in range(1, overlap.size):
        contact.before, contact.overlap, contact.ratio = overlap[k - 1], overlap[k], 1.0
        if contact.overlap <= 0.0:
            prescribe(contact, pair, np.max(overlap))
            memory[:] = 0.0
            continue
        contact.force = contact.elastic = elastic_force(contact, False, contact.overlap)
        du, dv = place[k, 0] - place[k - 1, 0], place[k, 1] - place[k - 1, 1]
        ask(contact, pair, law, memory, du, dv, 0.0)
        out[k, 0], out[k, 1], out[k, 2] = contact.f, contact.g, ask_energy(pair, contact, law, memory)


def loss(force: Array, name: str, amplitude: float) -> float:
    """Work of a turn, the last (of a square the only) one, over mu P_max times the displacement of full slip."""
    _, slide = path(name, amplitude)
    turn = slice(0 if name == "square" else len(slide) - MARKS - 1, None)
    mean, moved = 0.5 * (force[turn][1:] + force[turn][:-1]), np.diff(slide[turn], axis=0)
    return float((mean * moved).sum())


def fall(lost: Array) -> float:
    """Largest energy given back along a path: the deepest fall of what is dissipated."""
    return float((np.maximum.accumulate(lost) - lost).max())
