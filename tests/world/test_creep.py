"""Creep of what rolls and is driven or pushed, without spin: as Kalker's table has it, by the shape of the contact."""

from __future__ import annotations

from math import log, pi, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from contactlaw import MATERIALS, ContactPair
from contactlaw.laws import kalker
from contactlaw.laws.ellipse import elongation, half_axes
from contactlaw.world import World
from contactlaw.world.trees.description import Joint, Part, Tree
from tests.world.world_scenes import FLOOR, goes_on_alike

STEEL = MATERIALS["steel"]
RADIUS, MASS, WEIGHT = 0.1, 1.0, 9.81


def ratio_of(p: float, q: float) -> float:
    """a/b of the contact of curvatures p <= q along a and b, by Hertz's equation."""

    def rest(ratio: float) -> float:
        square = 1.0 - ratio**-2
        return (ratio**2 * ellipe(square) - ellipk(square)) / (ellipk(square) - ellipe(square)) - q / p

    return brentq(rest, 1.0 + 1e-9, 1e5) if q > 1.000001 * p else 1.0


@pytest.mark.parametrize(("ratio", "along", "across"), [
    (0.1, 3.31, 2.52), (0.5, 3.62, 3.01), (1.0, 4.12, 3.67), (2.0, 5.10, 4.90), (10.0, 11.7, 12.8),
])  # fmt: skip
def test_coefficients_are_those_of_the_table_at_a_quarter(ratio: float, along: float, across: float) -> None:
    """Which has rows for Poisson's ratios of 0, 1/4 and 1/2; the law knows the others."""
    assert [1.0 / one for one in kalker.compliances(log(ratio), 0.25)] == pytest.approx([along, across], rel=3e-3)


def test_long_contacts_have_the_asymptotes() -> None:
    """Of ratios 100 and 10: 2 pi a/b [1 + (3 - ln 4)/L]/L for nu = 0."""
    lengths = np.log(16.0 * np.array([100.0, 10.0]) ** 2)
    due = 10.0 * np.divide(*((1.0 + (3.0 - log(4.0)) / lengths) / lengths))
    of_ten, of_hundred = (kalker.compliances(log(ratio), 0.0)[0] for ratio in (10.0, 100.0))
    assert of_ten / of_hundred == pytest.approx(due, rel=1e-3)


@pytest.mark.parametrize("curved", [1.0, 1.3, 10.0, 1e3, 1e5])
def test_half_axes_are_those_of_hertz(curved: float) -> None:
    ratio = ratio_of(1.0, curved)
    assert elongation(log(curved)) == pytest.approx(log(ratio), abs=2e-3)
    circle = 0.5 * pi * ratio / ellipk(1.0 - ratio**-2)  # in units of b
    assert half_axes(log(ratio)) == pytest.approx((ratio / circle, 1.0 / circle), rel=1e-7)
    assert half_axes(-log(ratio)) == pytest.approx((1.0 / circle, ratio / circle), rel=1e-7)


def wheel(timestep: float, width: float, pushed: tuple[float, float], **other: Any) -> World:
    """An ellipsoid that rolls along x at 0.5 m/s on a hinge, held upright by slides; pushed along them [m/s^2]."""
    world = World(gravity=(*pushed, -WEIGHT / MASS), timestep=timestep)
    slides = [Joint("slide", axis=axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    part = Part(MASS, 0.4 * MASS * RADIUS**2, [*slides, Joint(axis=(0.0, 1.0, 0.0))], position=(0.0, 0.0, RADIUS))
    _, (body,) = world.add_tree(Tree([part]))
    shape = world.add_ellipsoid(body, (RADIUS, width, RADIUS))
    world.add_contact(shape, world.add_plane(None, *FLOOR), ContactPair(STEEL, STEEL, 0.3, 0.5, **other))
    world.place_tree(0, [0.0] * 4, [0.5, 0.0, 0.0, 0.5 / RADIUS])
    return world


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("width", [0.5 * RADIUS, RADIUS, 4.0 * RADIUS])
@pytest.mark.parametrize("timestep", [1e-3, 5e-3])
def test_a_wheel_creeps_as_it_is_pushed(timestep: float, width: float, across: bool) -> None:
    """Half way to slip; the contact is longer than wide, round, or wider than long."""
    share = 0.5
    push = share * 0.3 * WEIGHT / MASS
    world = wheel(timestep, width, (0.0, push) if across else (3.5 * push, 0.0))  # 2/7 of the push is friction
    world.step(round(0.1 / timestep))
    _, (u, v, _, spin) = world.tree(0)
    touch = world.arrays.contacts[0]["touch"]
    assert np.hypot(touch["f"], touch["g"]) == pytest.approx(share * 0.3 * WEIGHT, rel=1e-3)
    along, sidewise = RADIUS, width**2 / RADIUS
    ratio = ratio_of(1.0 / max(along, sidewise), 1.0 / min(along, sidewise))
    a, b = (1.0, 1.0 / ratio) if along > sidewise else (1.0 / ratio, 1.0)
    circle = 0.5 * pi / ellipk(1.0 - ratio**-2)
    area = a * b / circle**2 * touch["radius"] * touch["overlap"]
    compliance = kalker.compliances(log(a / b), STEEL.poissons_ratio)[1 if across else 0]
    creep = share * 0.3 * WEIGHT / (STEEL.shear_modulus * area) * compliance
    slip = v if across else u - RADIUS * spin
    assert slip / (RADIUS * spin) == pytest.approx(creep, rel=3e-3)
    assert world.arrays.world["implicit"][0] > 0.9 * round(0.1 / timestep)


@pytest.mark.parametrize("other", [{"law": "mindlin"}, {"law": "linear_spring"}, {"stiffness_ratio": 0.7}])
def test_other_laws_creep_alike(other: dict[str, Any]) -> None:
    """And with a measured ratio of stiffnesses: creep does not depend on the stiffness of what sticks."""
    worlds = [wheel(2e-3, RADIUS, (1.0, 0.0), **one) for one in ({}, other)]
    slips = []
    for world in worlds:
        world.step(100)
        _, (u, _, _, spin) = world.tree(0)
        touch = world.arrays.contacts[0]["touch"]
        slips.append((u / (RADIUS * spin) - 1.0) * touch["radius"] * touch["overlap"])
    assert slips[1] == pytest.approx(slips[0], rel=1e-2)


def test_without_friction_nothing_creeps_and_nothing_is_kept() -> None:
    world = World(timestep=1e-3)
    body = world.add_body(MASS, 0.4 * MASS * RADIUS**2, (0.0, 0.0, RADIUS), (1.0, 0.0, 0.0), spin=(0.0, 50.0, 0.0))
    world.add_contact(world.add_sphere(body, RADIUS), world.add_plane(None, *FLOOR), ContactPair(STEEL, STEEL, 0.0))
    world.step(100)
    assert not world.arrays.contacts[0]["passed"].any() and not world.arrays.contacts[0]["torsion"]["passed"].any()


@pytest.mark.parametrize("crowd", [0, 4])
def test_a_pushed_ball_goes_on_from_a_copy_to_the_bit(crowd: int) -> None:
    world = World(timestep=1e-3, gravity=(1.0, 0.0, -9.81), crowd=crowd)
    body = world.add_body(MASS, 0.4 * MASS * RADIUS**2, (0.0, 0.0, RADIUS))
    pair = ContactPair(STEEL, STEEL, 0.3, 0.5)
    world.add_contact(world.add_sphere(body, RADIUS), world.add_plane(None, *FLOOR), pair)
    world.step(50)
    assert np.hypot(*world.arrays.contacts[0]["torsion"]["passed"]) > 0.0
    goes_on_alike(world, 50)


def test_what_rolls_to_and_fro_within_its_contact_does_not_creep() -> None:
    """A heavy stick on a round foot that nods by less than the contact's radius; one that nods by more does."""
    lost = []
    for angle in (1e-4, 1e-2):
        world = World(timestep=1e-3)
        radius, depth = 0.05, 0.02  # the centre of mass is below that of the foot
        body = world.add_body(1.0, 1e-3, (0.0, 0.0, radius - depth), quaternion=(1.0, 0.0, 0.5 * angle, 0.0))
        foot = world.add_sphere(body, radius, (0.0, 0.0, depth))
        world.add_contact(foot, world.add_plane(None, *FLOOR), ContactPair(STEEL, STEEL, 0.5, 0.5))
        rolled = 0.0
        for _ in range(1000):
            world.step()
            rolled = max(rolled, world.arrays.contacts[0]["torsion"]["rolled"])
        touch = world.arrays.contacts[0]["touch"]
        lost.append((radius * angle / sqrt(touch["radius"] * touch["overlap"]), rolled))
    assert lost[0][0] < 1.0 and lost[0][1] == 0.0
    assert lost[1][0] > 1.0 and lost[1][1] > 0.0


@pytest.mark.parametrize("ratio", [0.1, 5.0])
def test_any_ratio_of_stiffnesses_loses_energy(ratio: float) -> None:
    world = wheel(2e-3, 2.0 * RADIUS, (0.0, 1.0), stiffness_ratio=ratio)
    world.step(50)
    _, (u, v, _, spin) = world.tree(0)
    assert 0.0 < v < 1e-4 * u and abs(u - RADIUS * spin) < 1e-6 * u
