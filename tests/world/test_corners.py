"""One place, one contact: corners, edges and faces of boxes and hulls against closed forms, also pressed deep."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from contactlaw import ContactPair, Material
from contactlaw.world import World
from contactlaw.world.data.frames import matrix_of
from contactlaw.world.shapes.core import CROWN
from tests.world.test_hulls import CUBE

SOFT = Material(1e7, 0.3)
R = 0.002
CORNER_DOWN = np.array([0.85, 0.3, 0.25, 0.1]) / np.linalg.norm([0.85, 0.3, 0.25, 0.1])
KINDS = pytest.mark.parametrize("kind", ["box", "hull"])


def solid(world: World, kind: str, half, place, quaternion=(1, 0, 0, 0), velocity=(0, 0, 0), spin=(0, 0, 0)) -> int:
    """A box of 2000 kg/m^3, as such or as a hull."""
    half = np.asarray(half)
    mass = 8.0 * half.prod() * 2000.0
    body = world.add_body(mass, mass / 3.0 * (half @ half - half * half), place, velocity, quaternion, spin)
    return world.add_box(body, half, rounding=R) if kind == "box" else world.add_hull(body, half * CUBE, R)


def table(world: World, kind: str) -> int:
    half, place = np.array([0.1, 0.1, 0.02]), (0.0, 0.0, -0.02)
    if kind == "box":
        return world.add_box(None, half, place, rounding=R)
    return world.add_hull(None, half * CUBE, R, at=place)


def pressed(kind: str, how: str, overlap: float) -> tuple[float, float]:
    """Force [N] of two boxes that overlap so, by all their contacts; and by a single one of radius R."""
    world = World(gravity=0.0, timestep=1e-7)
    pair = ContactPair(SOFT, SOFT, 0.0, 1.0)
    if how == "edges":
        high = 2.0 * (sqrt(2.0) * 0.018 + R) - overlap
        shapes = [solid(world, kind, (0.02, 0.02, 0.02), (0, 0, high), (cos(pi / 8), sin(pi / 8), 0, 0)),
                  solid(world, kind, (0.02, 0.02, 0.02), (0, 0, 0), (cos(pi / 8), 0, sin(pi / 8), 0))]  # fmt: skip
    else:
        half, turn = np.array([0.03, 0.02, 0.025]), CORNER_DOWN if how == "corner" else np.array([1.0, 0.0, 0.0, 0.0])
        low = (matrix_of(turn) @ ((half - R) * CUBE).T)[2].min() - R
        place = 0.005, 0.012, -low - overlap
        shapes = [solid(world, kind, half, place, turn), table(world, kind)]
    world.add_contact(shapes[0], shapes[1], pair)
    world.step()
    rows = world.contacts
    total = np.linalg.norm((rows["force"] * np.where(rows["bodies"][:, :1] == 0, 1.0, -1.0)).sum(0))
    return float(total), 4.0 / 3.0 * pair.effective_modulus * sqrt(R) * overlap**1.5


@KINDS
@pytest.mark.parametrize("overlap", [0.005 * R, 0.05 * R, 0.1 * R])
def test_a_corner_carries_alone(kind: str, overlap: float) -> None:
    """The edges that end there, and the cores, pressed beside it: four times as hard."""
    total, one = pressed(kind, "corner", overlap)
    assert total == pytest.approx(one, rel=1e-6)


@KINDS
@pytest.mark.parametrize("overlap", [0.05 * R, 0.1 * R])
def test_two_crossed_edges_are_one_contact(kind: str, overlap: float) -> None:
    total, one = pressed(kind, "edges", overlap)
    assert total == pytest.approx(one * (1.0 - CROWN * R / overlap) ** 1.5, rel=1e-6)


@KINDS
def test_a_face_is_carried_by_its_four_corners(kind: str) -> None:
    total, one = pressed(kind, "face", 0.008 * R)
    assert total == pytest.approx(4.0 * one, rel=1e-6)


def test_crossed_edges_have_the_restitution_of_one_contact() -> None:
    world = World(gravity=0.0, timestep=1e-3)
    shapes = [solid(world, "box", (0.02, 0.02, 0.02), (0, 0, 0.056), (cos(pi / 8), sin(pi / 8), 0, 0), (0, 0, -0.1)),
              solid(world, "box", (0.02, 0.02, 0.02), (0, 0, 0), (cos(pi / 8), 0, sin(pi / 8), 0))]  # fmt: skip
    world.add_contact(shapes[0], shapes[1], ContactPair(Material(1e9, 0.3), Material(1e9, 0.3), 0.0, 0.6))
    world.step(100)
    assert world.velocity[0, 2] - world.velocity[1, 2] == pytest.approx(0.06, rel=2e-3)


def gained(kind: str, ground: str, place, turn, velocity, spin, time: float) -> float:
    """Energy [J] that an elastic, soft box without friction gains at most on a table."""
    world = World(timestep=1e-3)
    shape = solid(world, kind, (0.03, 0.02, 0.025), place, turn, velocity, spin)
    world.add_contact(shape, table(world, ground), ContactPair(SOFT, SOFT, 0.0, 1.0))
    start, most = world.energy.total, 0.0
    for _ in range(round(time * 1e3)):
        world.step()
        most = max(most, world.energy.total - start)
    return most


def test_an_edge_takes_over_from_a_corner_without_energy() -> None:
    """Slid over the border of a table, pressed deep: edges that were not listed over its face came in at full force."""
    weight = 8.0 * 0.03 * 0.02 * 0.025 * 2000.0 * 9.81
    assert (
        gained("hull", "box", (0.0, 0.0, 0.026), (1, 0, 0, 0), (0.3, 0.13, 0.0), (0.0, 0.0, 0.5), 0.5) < 4e-5 * weight
    )
    for kind in ("box", "hull"):  # rocks over an edge onto a corner and back
        edge_down = (cos(0.35), sin(0.35), 0.0, 0.0)
        assert gained(kind, "box", (0.0, 0.0, 0.033), edge_down, (0, 0, 0), (0.0, 0.6, 0.0), 0.3) < 4e-5 * weight
