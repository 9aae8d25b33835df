"""Hulls: their cores, where two are nearest, energy and rest; a cube is a cube."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.jit import jit
from contactlaw.world import World
from contactlaw.world.data.access import body_at, near_address, near_at, shape_at
from contactlaw.world.data.frames import matrix_of
from contactlaw.world.data.kinds import CORNER, DISC, EDGE
from contactlaw.world.shapes.curvature import effective_radius, equivalent_radius
from contactlaw.world.shapes.geometry import BACK, meet
from contactlaw.world.shapes.hulls import convex_hull, core_of
from tests.world.long_shapes import sphere
from tests.world.world_scenes import FLOOR, box_of_planes, refuses, steel_pair

DENSITY = 7800.0
CUBE = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])


def solid(points: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Points from the centre of mass of their hull, its mass and inertia."""
    v, faces = convex_hull(points)
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for face in faces:
        corners = v[face]
        own = np.linalg.det(corners) / 6.0
        volume, first = volume + own, first + own * corners.sum(0) / 4.0
        second += own / 20.0 * (np.outer(corners.sum(0), corners.sum(0)) + corners.T @ corners)
    middle = first / volume
    second -= volume * np.outer(middle, middle)
    return points - middle, DENSITY * volume, DENSITY * (np.trace(second) * np.eye(3) - second)


def rock(world: World, rng: np.random.Generator, place, velocity, size: float, turn: float) -> int:
    """A body that is the hull of random points."""
    points = rng.normal(size=(rng.integers(5, 20), 3))
    points *= size * rng.uniform(0.5, 1.0, 3) / np.linalg.norm(points, axis=1)[:, None]
    own, mass, inertia = solid(points)
    return world.add_hull(
        world.add_body(mass, inertia, place, velocity, rng.normal(size=4), turn * rng.normal(size=3)), own
    )


def cube(world: World, half: float, place, **motion) -> tuple[int, float]:
    """A body as heavy as a cube of steel."""
    mass = DENSITY * 8.0 * half**3
    return world.add_body(mass, mass * 2.0 / 3.0 * half**2, place, **motion), mass


@jit
def joined(p, q):
    """`equivalent_radius` of two curvatures."""
    return equivalent_radius(p, q)


@jit
def meeting(world, i, j):
    """`meet` of two shapes of a world, and their effective radius."""
    w = world[0]
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    a, b = body_at(w.bodies, sa.body), body_at(w.bodies, sb.body)
    found = meet(sa, a, sb, b)
    return found, effective_radius(sa, a, sb, b, *found[1:])[0]


@jit
def meeting_with_and_without(world, i, j):
    """`meet` of two shapes of a world, without what is known of them, and with what the first near pair knows."""
    w = world[0]
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    a, b = body_at(w.bodies, sa.body), body_at(w.bodies, sb.body)
    return meet(sa, a, sb, b), meet(sa, a, sb, b, near_address(near_at(w.near, 0)))


@pytest.mark.parametrize(("cube", "rims"), [(False, False), (True, False), (False, True)])
def test_where_two_were_nearest_before_does_not_change_where_they_are(cube: bool, rims: bool) -> None:
    rng, world = np.random.default_rng(3), World()
    rest, above = (0.0, 0.0, 0.0), (0.0, 0.0, 0.11)
    upper, lower = (rock(world, rng, place, rest, 0.05, 0.0) for place in (above, rest))
    if rims:
        upper = world.add_cylinder(world.add_body(1.0, 1e-3), 0.04, 0.03, rounding=0.002)
    if cube:  # whose faces are of four corners
        lower = world.add_hull(world.add_body(1.0, 1e-3), 0.04 * CUBE)
    world.add_contact([upper], [lower], steel_pair())
    arrays = world.arrays.bound()
    body, near = arrays.bodies[arrays.shapes["body"][upper]], arrays.near[:1]
    of_kind = np.flatnonzero(np.isin(arrays.shapes["kind"], (CORNER, EDGE, DISC)))
    parts = [i for i in of_kind if world.owners[i] == upper]
    known = 0
    for i in parts:
        near["vertices"], near["place"] = 0, 0.0
        turn, place = rng.normal(size=4), np.array([0.0, 0.0, 0.11])
        for step in range(60):
            if step % 20 == 0:  # far from where it was
                turn, place = rng.normal(size=4), 0.12 * rng.normal(size=3)
                place *= max(0.11 / np.linalg.norm(place), 1.0)
            turn = turn / np.linalg.norm(turn) + rng.choice([1e-9, 1e-3, 0.1]) * rng.normal(size=4)
            body["position"], body["axes"] = place, matrix_of(turn / np.linalg.norm(turn)).ravel()
            known += int(near["vertices"][0] > 0)
            (overlap, n, arm, _), (same, m, other, _) = meeting_with_and_without(arrays.world, i, lower)
            assert same == pytest.approx(overlap, abs=1e-15)
            close = 1e-8 if rims else 1e-9  # round a rim the overlap is least only to its square
            assert np.allclose(n, m, rtol=0.0, atol=close)
            assert np.allclose(arm, other, rtol=0.0, atol=0.1 * close)
    assert known > 50 * len(parts)


def test_a_rim_over_a_cylinder_counts_the_curvatures_of_both() -> None:
    world, pair = World(), steel_pair()
    inertia, r, rounding = (1e-5, 1e-5, 1e-5), (0.02, 0.03), (0.002, 0.003)
    upper = world.add_cylinder(world.add_body(0.1, inertia), r[0], 0.01, axis=(1.0, 0.0, 0.0), rounding=rounding[0])
    place = (0.008, 0.0, -0.05 - 1e-6)  # the end of the upper one is over the crest of the lower one
    lower = world.add_cylinder(
        world.add_body(0.1, inertia, place), r[1], 0.05, axis=(0.0, 1.0, 0.0), rounding=rounding[1]
    )
    world.add_contact([upper], [lower], pair)
    arrays = world.arrays.bound()
    rims = [i for i in np.flatnonzero(arrays.shapes["kind"] == DISC) if world.owners[i] == upper]
    (overlap, *_), radius = max(meeting(arrays.world, i, lower) for i in rims)
    far = rounding[0] + np.linalg.norm(arrays.shapes["half"][rims[0]])
    assert abs(overlap) < 1e-4
    assert radius == pytest.approx(joined(1.0 / far, 1.0 / rounding[0] + 1.0 / r[1]), rel=1e-6)


def test_a_ball_meets_a_cube_as_its_core_within_a_radius() -> None:
    """And with the curvatures of its faces, edges and corners."""
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(200):
        world = World(gravity=0.0)
        place = 0.05 * rng.uniform(-1.0, 1.0, 3)
        ball = sphere(world, place, (0, 0, 0))
        turn = rng.normal(size=4)
        hull = world.add_hull(world.add_body(1.0, 1.0, quaternion=turn), 0.02 * CUBE, 0.002)
        own = matrix_of(world.quaternion[1]).T @ place
        out = own - np.clip(own, -0.018, 0.018)
        far = np.linalg.norm(out)
        if far < 1e-3:
            continue
        (overlap, normal, arm_a, arm_b), radius = meeting(world.arrays.bound().world, ball, hull)
        assert overlap == pytest.approx(0.012 - far, abs=1e-15)
        np.testing.assert_allclose(normal, matrix_of(world.quaternion[1]) @ out / far, rtol=0, atol=1e-12)
        np.testing.assert_allclose(place + arm_a, arm_b, rtol=0, atol=1e-15)
        beyond = int((np.abs(own) > 0.018).sum())
        seen.add(beyond)
        if beyond != 2:
            assert radius == pytest.approx(0.01 if beyond == 1 else 0.002 / 1.2, rel=1e-12)
        else:
            assert 0.002 / 1.2 < radius < 0.01
    assert seen == {1, 2, 3}


def test_a_line_through_a_cube_is_pushed_across_itself() -> None:
    """Not along: its middle is far off the cube, and says nothing of the way out."""
    world = World(gravity=0.0)
    hull = world.add_hull(cube(world, 0.1, (0.0, 0.0, 0.0))[0], 0.1 * CUBE)
    rod = world.add_body(1.0, np.eye(3), (0.3, 0.02, 0.05))
    side = world.add_capsule(rod, 0.02, 0.4, axis=(1.0, 0.0, 0.0))[0]
    (_, normal, _, _), _ = meeting(world.arrays.bound().world, side, hull)
    assert normal == pytest.approx((0.0, 0.02 / np.hypot(0.02, 0.05), 0.05 / np.hypot(0.02, 0.05)), abs=1e-12)


def test_two_hulls_meet_where_no_plane_parts_them_further() -> None:
    """The gap is that of a plane across the normal, on which one vertex of each core lies (separating axis)."""
    rng = np.random.default_rng(2)
    found = 0
    for number in range(200):
        world = World(gravity=0.0)
        cores, hulls = [], []
        for k in range(2):
            points = rng.normal(size=(rng.integers(4, 30), 3))
            if number % 4 == 0:
                points = np.round(points)
            try:
                cores.append(core_of(points, 0.01)[0])
            except ValueError:
                break
            turn = (1.0, 0.0, 0.0, 0.0) if number % 8 == 0 else rng.normal(size=4)
            place = k * rng.normal(size=3) * 3.0
            hulls.append(world.add_hull(world.add_body(1.0, 1.0, place, quaternion=turn), points, 0.01))
        if len(hulls) < 2:
            continue
        (overlap, normal, arm_a, arm_b), radius = meeting(world.arrays.bound().world, hulls[1], hulls[0])
        first, second = (world.position[k] + cores[k] @ matrix_of(world.quaternion[k]).T for k in range(2))
        gap = (second @ normal).min() - (first @ normal).max()
        if gap > 1e-3:
            found += 1
            assert overlap == pytest.approx(0.02 * (1.0 - BACK) - gap, abs=1e-12)
            assert radius == pytest.approx(0.01)
            np.testing.assert_allclose(world.position[1] + arm_a, world.position[0] + arm_b, rtol=0, atol=1e-14)
    assert found > 60


def keep_their_energy(timestep: float, half: float, fill) -> None:
    """What `fill` puts between six walls, elastic and without friction, for a second, three times."""
    impacts = 0
    for seed in range(3):
        world = World(gravity=0.0, timestep=timestep)
        walls = [world.add_plane(None, *wall) for wall in box_of_planes(half)]
        shapes = walls + fill(world, np.random.default_rng(seed))
        world.add_contact(shapes, shapes, steel_pair(0.0))
        start = world.energy.total
        for _ in range(round(1.0 / timestep)):
            world.step()
            rows = world.contacts
            impacts += int((rows["touches"] * ~rows["closed"]).sum())
        assert world.energy.total == pytest.approx(start, rel=1e-3)
        assert np.abs(world.position).max() < half
    assert impacts > 50


@pytest.mark.parametrize("timestep", [5e-4, 2e-3, 1e-2])
def test_elastic_hulls_keep_their_energy(timestep: float) -> None:
    def fill(world: World, rng: np.random.Generator) -> list[int]:
        rocks = [rock(world, rng, (x, 0.0, 0.0), 0.4 * rng.normal(size=3), 0.03, 10.0) for x in (-0.04, 0.04)]
        return [*rocks, sphere(world, (0.0, 0.05, 0.0), 0.4 * rng.normal(size=3))]

    keep_their_energy(timestep, 0.08, fill)


@pytest.mark.parametrize("timestep", [5e-4, 2e-3, 1e-2])
def test_hulls_fall_and_come_to_rest(timestep: float) -> None:
    """Two on each other in a pit: no energy from nothing, nobody sinks, all sleep; weight is what the floor carries."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        world = World(timestep=timestep)
        shapes = [world.add_plane(None, *FLOOR)]
        for angle in np.arange(4) * np.pi / 2.0:
            inward = -np.array([np.cos(angle), np.sin(angle), 0.0])
            shapes.append(world.add_plane(None, -0.04 * inward, inward))
        for z in (0.03, 0.08):
            shapes.append(rock(world, rng, (0.0, 0.0, z), 0.2 * rng.normal(size=3), 0.02, 5.0))
        world.add_contact(shapes, shapes, steel_pair(0.4, 0.5))
        energies = [world.energy.total]
        for _ in range(round(4.0 / timestep)):
            world.step()
            assert world.energy.total <= max(energies[-10:]) + 1e-6 * energies[0]  # errors of steps come back
            energies.append(world.energy.total)
            if world.asleep.all():
                break
        assert world.asleep.all()
        rows = world.contacts[world.contacts["closed"]]
        assert rows["overlap"].max() < 1e-6
        weight = 9.81 / world.arrays.bodies["inverse_mass"][1:].astype(float)
        from_walls = rows[(rows["bodies"][:, 1] == -1)]
        assert from_walls["force"][:, 2].sum() == pytest.approx(weight.sum(), rel=1e-6)


def test_a_cube_is_a_body_on_eight_balls() -> None:
    """On a plane it moves as this does; and one on another lies on four corners or more, square or not."""
    places = []
    for as_hull in (True, False):
        world = World(timestep=1e-3)
        body, _ = cube(world, 0.02, (0.0, 0.0, 0.05), quaternion=(0.9, 0.2, 0.3, 0.1), spin=(3.0, 1.0, 2.0))
        if as_hull:
            shapes = world.add_hull(body, 0.02 * CUBE, 0.003)
        else:
            shapes = [world.add_sphere(body, 0.003, corner) for corner in 0.017 * CUBE]
        world.add_contact(shapes, world.add_plane(None, *FLOOR), steel_pair(0.3, 0.5))
        world.step(300)
        places.append(np.concatenate([world.position[0], world.quaternion[0]]))
    np.testing.assert_allclose(places[0], places[1], rtol=0, atol=1e-9)
    for angle in (0.0, 0.4):
        world = World(timestep=2e-3)
        shapes = [world.add_plane(None, *FLOOR)]
        weight = 0.0
        for z, turn in ((0.0201, 0.0), (0.0603, angle)):
            body, mass = cube(world, 0.02, (0.0, 0.0, z), quaternion=(np.cos(turn), 0.0, 0.0, np.sin(turn)))
            weight = 9.81 * mass
            shapes.append(world.add_hull(body, 0.02 * CUBE))
        world.add_contact(shapes, shapes, steel_pair(0.3, 0.5))
        world.step(1000)
        assert world.asleep.all()
        back = 0.02 * 0.002 if angle > 0.0 else 0.0  # edges, on which alone the turned one lies, are set back
        assert world.position[0, 2] == pytest.approx(0.02, abs=2e-6)
        assert 0.06 - back - 2e-6 < world.position[1, 2] < 0.06 + 2e-6
        rows = world.contacts[world.contacts["closed"]]
        between = rows[(rows["bodies"] >= 0).all(1)]
        assert len(between) >= 4
        assert np.abs(between["force"][:, 2]).sum() == pytest.approx(weight, rel=1e-6)


@pytest.mark.parametrize("lies", [False, True])
def test_a_can_stands_and_lies_on_a_hull(lies: bool) -> None:
    world = World(timestep=2e-3)
    block = world.add_hull(None, 0.05 * CUBE)
    mass, radius, half = 0.1, 0.01, 0.02
    across = mass * (radius**2 / 4.0 + half**2 / 3.0)
    angle = 0.5 * (0.5 * np.pi * lies + 0.02)
    place = (0.01, 0.02, 0.051 + (radius if lies else half))
    body = world.add_body(mass, (across, across, 0.5 * mass * radius**2), place,
                          quaternion=(np.cos(angle), np.sin(angle), 0.0, 0.0))  # fmt: skip
    can = world.add_cylinder(body, radius, half)
    world.add_contact(can, block, steel_pair(0.4, 0.5, rolling_resistance=0.05))
    energy = scale = world.energy.total
    for _ in range(1500):
        world.step()
        assert world.energy.total <= energy + 1e-6 * scale
        energy = world.energy.total
    assert world.position[0, 2] == pytest.approx(0.05 + (radius if lies else half), abs=3e-6)
    assert np.abs(world.velocity).max() < 1e-6
    assert world.contacts["force"][:, 2].sum() == pytest.approx(9.81 * mass, rel=1e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.add_hull(0, np.zeros((4, 2))), "points: shape (4, 2); must be (n, 3)"),
        (lambda w: w.add_hull(0, np.eye(3)), "points: lie in a plane"),
        (lambda w: w.add_hull(0, CUBE, 0.6), "rounding = 0.6: must be > 0 and at most half"),
        (lambda w: w.add_hull(3, CUBE), "body = 3: there are 1 bodies, counted from 0"),
        (lambda w: w.add_hull(0, np.full((4, 3), np.nan)), "points: holds nan"),
        (lambda w: w.add_ellipsoid(0, (1.0, 0.0, 1.0)), "half_axes = [1.0, 0.0, 1.0]: must be > 0"),
    ],
)
def test_bad_hulls_are_named(call, message: str) -> None:
    refuses(call, message)
