"""Elliptic contacts: their longer axis, what their springs hold, rebounds and friction by direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from contactlaw import ContactPair, rebound
from contactlaw.jit import jit
from contactlaw.laws.ellipse import force_on_ellipse, returned, share_along
from contactlaw.laws.microslip import Microslip
from contactlaw.laws.record import CONTACT
from contactlaw.world import World
from contactlaw.world.shapes.curvature import radius_between
from tests.world.world_scenes import FLOOR, steel_pair
from validation.cases import elliptic
from validation.cases.elliptic import CROSSED, ELLIPSOIDS, impact, partial_curvatures
from validation.cases.shapes import PLASTIC, elongation
from validation.prediction import SPHERE


@jit
def shares(lengths, out):
    """`share_along` of each."""
    for i in range(lengths.size):
        out[i] = share_along(lengths[i])


@jit
def held(tractions, limit, skew, out):
    """`returned` of each, shape (n, 2)."""
    for i in range(tractions.shape[0]):
        out[i, 0], out[i, 1] = returned(tractions[i, 0], tractions[i, 1], limit, 1.0 + skew, 1.0 - skew)


@jit
def joined(one, two):
    """`radius_between` of two bodies."""
    return radius_between(one, two)


def softer(q_over_p: float) -> float:
    """D/K - 1/2 by elliptic integrals."""
    m = -np.expm1(-2.0 * elongation(1.0, q_over_p))
    return float((ellipk(m) - ellipe(m)) / m / ellipk(m) - 0.5)


def test_the_share_is_that_of_the_elliptic_integrals() -> None:
    ratios = np.geomspace(1.01, 9e4, 40)
    found = np.empty(ratios.size)
    shares(np.log(ratios), found)
    np.testing.assert_allclose(found, [softer(one) for one in ratios], atol=3e-4)


def test_a_spring_keeps_the_nearest_traction_by_energy() -> None:
    """C (t - q) = lambda q at |q| = 1; far beyond its limit along the displacement C t, whatever the compliances."""
    rng = np.random.default_rng(1)
    t = rng.normal(size=(500, 2))
    t *= ((1.0 + rng.exponential(2.0, 500)) / np.linalg.norm(t, axis=1))[:, None]
    for skew in (0.0, 0.05, -0.1, 0.2):
        compliance, q = np.array([1.0 + skew, 1.0 - skew]), np.empty_like(t)
        held(t, 1.0, skew, q)
        slip = compliance * (t - q)
        np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, rtol=1e-14)
        assert np.abs(slip[:, 0] * q[:, 1] - slip[:, 1] * q[:, 0]).max() < 1e-9
        assert ((slip * q).sum(1) > 0.0).all()
        held(1e9 * t, 1.0, skew, q)
        np.testing.assert_allclose(q, compliance * t / np.linalg.norm(compliance * t, axis=1)[:, None], atol=1e-8)


def test_the_longer_axis_is_where_the_curvatures_of_both_are_the_least() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        angles, least, more = rng.uniform(0.0, 7.0, 2), rng.uniform(-5.0, 20.0, 2), rng.exponential(30.0, 2)
        more *= rng.integers(0, 2, 2)
        least += 6.0
        axes = np.stack([np.cos(angles), np.sin(angles), np.zeros(2)], 1)
        total = np.zeros((2, 2))
        for e, k, d in zip(axes[:, :2], least, more, strict=True):
            total += k * np.eye(2) + d * (np.eye(2) - np.outer(e, e))
        bodies = [(float(k), float(k + d), (float(e[0]), float(e[1]), 0.0))
                  for e, k, d in zip(axes, least, more, strict=True)]  # fmt: skip
        _, along = joined(*bodies)
        values, vectors = np.linalg.eigh(total)
        assert np.linalg.norm(along) == pytest.approx(np.log(values[1] / values[0]), abs=1e-9)
        assert abs(np.array(along[:2]) @ vectors[:, 1]) < 1e-7 * max(1.0, float(np.linalg.norm(along)))


@pytest.mark.parametrize("name", [*ELLIPSOIDS, CROSSED])
@pytest.mark.parametrize(("axis", "sign"), [(0, 1.0), (1, -1.0)])
def test_a_rebound_has_the_stiffness_of_its_direction(name: str, axis: int, sign: float) -> None:
    kappa = steel_pair().kappa
    p, q = partial_curvatures(ELLIPSOIDS[name]) if name in ELLIPSOIDS else (1.0 / 0.03, 1.0 / 0.01)
    stretch = 1.0 + sign * 2.0 * (1.0 - kappa) * softer(q / p)  # kappa over that of the direction
    for psi in (0.4, 1.2, 3.0):
        found = impact(name, psi * np.eye(2)[axis])
        expected = stretch * float(rebound(psi / stretch, SPHERE * kappa / 2.0 / stretch))
        assert found[axis] == pytest.approx(expected, abs=1.5e-3)
        assert abs(found[1 - axis]) < 1e-9


def test_the_law_for_slides_that_turn_has_the_same_springs_on_an_ellipse(monkeypatch) -> None:
    name, psi = CROSSED, np.array([0.5, 0.5])
    expected = impact(name, psi)
    monkeypatch.setattr(elliptic, "PAIR", replace(elliptic.PAIR, law="microslip_turning"))
    np.testing.assert_allclose(impact(name, psi), expected, atol=2e-3)


@pytest.mark.parametrize("timestep", [1e-5, 2e-3])
def test_friction_is_opposite_to_a_slide_askew(timestep: float) -> None:
    """Of a body that hardly turns, substep by substep and in implicit steps."""
    pair = ContactPair(PLASTIC, PLASTIC, 0.3, 0.5)
    world = World(gravity=9.81, timestep=timestep)
    depth = (9.81 / (4.0 / 3.0 * pair.effective_modulus * 0.05)) ** (2.0 / 3.0)
    body = world.add_body(1.0, 1e6, (0.0, 0.0, 0.02 - depth), (2.0, 1.0, 0.0))
    world.add_contact(world.add_ellipsoid(body, (0.06, 0.015, 0.02)), world.add_plane(None, *FLOOR), pair)
    world.step(round(0.02 / timestep))
    assert abs(world.arrays.contacts["touch"]["skew"][0]) > 0.01
    force, way = world.contacts["force"][0], world.velocity[body]
    assert force[:2] @ way[:2] == pytest.approx(-np.linalg.norm(force[:2]) * np.linalg.norm(way[:2]), rel=1e-9)
    assert np.linalg.norm(force[:2]) == pytest.approx(0.3 * force[2], rel=1e-6)


@jit
def along_path(header, memory, own, path, out):
    """Of a contact along a path of overlaps and displacements (n, 3): work done on its springs, less what they hold."""
    contact, law, count, work = header[0], own[0], memory.shape[1], 0.0
    contact.e_star, contact.g_star, contact.radius, contact.friction, contact.ratio = 1.0, 0.8, 1.0, 0.3, 1.0
    contact.mass, contact.stiffness, contact.skew = 1e300, 4.0 / 3.0, 0.15
    contact.before, contact.reach = -1e-9, 4.0
    for k in range(path.shape[0]):
        contact.overlap = path[k, 0]
        contact.elastic = contact.force = 4.0 / 3.0 * contact.overlap**1.5
        f, g = force_on_ellipse(contact, law, memory, path[k, 1], path[k, 2])
        work += f * path[k, 1] + g * path[k, 2]
        kept = 0.0
        for i in range(count):
            kept += law.w[i] * (1.15 * memory[0, i] ** 2 + 0.85 * memory[1, i] ** 2)
        out[k] = work - contact.scale * kept / contact.g_star
        contact.before = contact.overlap


def test_passive_on_random_paths() -> None:
    """In the plane at constant loads: what the springs hold was put in."""
    own = Microslip(16).numbers()
    for seed in range(300):
        rng = np.random.default_rng(seed)
        path = np.column_stack([np.full(300, rng.uniform(0.5, 3.0)), rng.normal(0.0, 0.2, (300, 2))])
        header, memory, out = np.zeros(1, CONTACT), np.zeros((2, 16)), np.empty(300)
        along_path(header, memory, own, path, out)
        assert out.min() > -1e-12 and (np.diff(out) > -2e-3 * np.abs(out).max()).all()


@pytest.mark.parametrize("tilt", [0.0, 1e-14, 1e-8])
def test_a_cylinder_that_lands_flat_gets_no_spin_about_its_axis(tilt: float) -> None:
    """Its rim touches within the disc: the direction in which rounding tilts it is no axis of an ellipse."""
    world = World(timestep=1e-3, gravity=0.0)
    body = world.add_body(0.15, (3e-5, 3e-5, 4e-5), (0, 0, 0.014), (0.38, 0.12, -1.5), (1, tilt, 0, 0))
    floor = world.add_plane(None, point=(0, 0, 0), normal=(0, 0, 1))
    world.add_contact(world.add_cylinder(body, 0.022, 0.0124), floor, ContactPair("steel", "rubber", friction=0.3))
    world.step(20)
    assert world.velocity[body, 2] > 1.4
    assert abs(world.spin[body, 2]) < 1e-4
