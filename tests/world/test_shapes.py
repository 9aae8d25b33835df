"""Capsules and boxes: energy, momenta, spin, nothing falls through; nearest points against a search."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.jit import jit
from contactlaw.world import World
from contactlaw.world.data.access import body_at, shape_at
from contactlaw.world.data.frames import matrix_of
from contactlaw.world.data.kinds import BOX as BOX_KIND
from contactlaw.world.data.kinds import SEGMENT
from contactlaw.world.shapes.description import tangent
from contactlaw.world.shapes.geometry import meet
from tests.world.long_shapes import BOX, HALF, RADIUS, capsule, free_box, scene, sphere
from tests.world.world_scenes import FLOOR, balls, refuses, steel_pair
from validation.ball import DENSITY

KINDS = ("planes", "capsule on edges", "sphere on edges", "crossing capsules", "free box")


def bounce(world: World, impacts: int, steps: int = 60000) -> tuple[int, int]:
    """Step until so many have parted, and none is closed; returns how many, and those of a capsule's side on a box."""
    found = edges = 0
    for _ in range(steps):
        world.step()
        rows = world.contacts
        if rows.size:
            kinds = world.arrays.shapes["kind"][rows["shapes"]]
            parted = rows["touches"] * ~rows["closed"]
            found += int(parted.sum())
            edges += int(parted[(kinds[:, 0] == SEGMENT) & (kinds[:, 1] == BOX_KIND)].sum())
        if found >= impacts and not rows["closed"].any():
            break
    return found, edges


def inside(world: World, half: float) -> bool:
    """No ball, middle of a capsule or box has left its walls, nor is a centre inside the fixed box."""
    places = world.position
    fixed = [s for s in world.arrays.shapes if s["kind"] == BOX_KIND and s["body"] == 0]
    out = all((np.abs(s["axes"].reshape(3, 3).T @ x) > s["half"]).any() for s in fixed for x in places)
    return out and bool(np.abs(places).max() < half)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("timestep", [pytest.param(5e-4, marks=pytest.mark.slow), 2e-3, 1e-2])
def test_a_hundred_elastic_impacts_keep_energy(kind: str, timestep: float) -> None:
    edges = 0
    for seed in range(4):
        world = scene(kind, seed, timestep, steel_pair(0.0))
        start = world.energy.total
        found, some = bounce(world, 100)
        edges += some
        assert found >= 100
        assert world.energy.total == pytest.approx(start, rel=1e-3)
        # a tumbling body flies by parts of 0.1 rad, of which the second order is right: it is off by as much in a step
        assert world.arrays.world["latest"][0] < 1e-6
        assert kind == "planes" or inside(world, 0.12)
    assert edges > 5 or kind != "capsule on edges"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("restitution", [1.0, 0.5])
@pytest.mark.parametrize("timestep", [5e-4, 2e-3, 1e-2])
def test_friction_and_damping_never_give_energy(kind: str, restitution: float, timestep: float) -> None:
    """Of what there is, an impact gives no more than elastic ones err; and nothing falls through in long runs."""
    for seed in range(2):
        world = scene(kind, seed, timestep, steel_pair(0.3, restitution))
        before = start = world.energy.total
        for _ in range(30):
            world.step(round(0.1 / timestep))
            energy = world.energy.total
            assert energy <= before + 1e-4 * start
            before = energy
        assert energy < 0.9 * start
        assert kind == "planes" or inside(world, 0.12)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_free_pairs_keep_momenta(friction: float) -> None:
    for timestep in (5e-4, 1e-2):
        for seed in range(6):
            rng = np.random.default_rng(seed)
            world = World(gravity=0.0, timestep=timestep)
            if seed < 3:
                box, _ = free_box(world, rng, (0.0, 0.0, 0.0), 10.0 * rng.normal(size=3))
                others = sphere(world, (0.07, 0.005, 0.003), (-1.0, 0.0, 0.0))
            else:
                box = capsule(world, rng, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
                others = capsule(world, rng, (0.07, 0.005, 0.003), (-1.0, 0.0, 0.0))
            world.add_contact(others, box, steel_pair(friction))
            linear, angular = world.momentum
            touched = 0
            for _ in range(round(0.1 / timestep)):
                world.step()
                touched += world.contacts.size
            assert touched > 0
            assert np.abs(world.momentum[0] - linear).max() < 1e-12 * np.linalg.norm(linear)
            assert np.abs(world.momentum[1] - angular).max() < 1e-12 * max(np.linalg.norm(angular), 1e-3)


def test_spheres_get_no_spin_without_friction() -> None:
    for kind in ("sphere on edges", "free box"):
        world = scene(kind, 1, 2e-3, steel_pair(0.0))
        bounce(world, 60)
        round_ones = world.arrays.bodies["isotropic"][1:] != 0
        assert round_ones.any()
        assert RADIUS * np.abs(world.spin[round_ones]).max() < 1e-14 * np.abs(world.velocity[round_ones]).max()


@jit
def meeting(world, i, j):
    """`meet` of two shapes of a world."""
    w = world[0]
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    return meet(sa, body_at(w.bodies, sa.body), sb, body_at(w.bodies, sb.body))


@pytest.mark.parametrize("other", ["capsule", "box"])
def test_a_capsule_is_met_where_its_line_is_nearest(other: str) -> None:
    """Against a search; crowned by 1 or 2 thousandths of a radius, by 2 % on boxes, and both points are one.

    The place found is that of the crowned side where contact begins; further off it may be as much again away.
    """
    s = np.linspace(-1.0, 1.0, 801)[:, None]
    searched = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        world = World(gravity=0.0)
        first, *_ = capsule(world, rng, 0.06 * rng.normal(size=3), (0.0, 0.0, 0.0))
        line = world.position[0] + s * HALF * matrix_of(world.quaternion[0])[:, 2]
        if other == "capsule":
            second, *_ = capsule(world, rng, (0.01, 0.0, 0.0), (0.0, 0.0, 0.0))
            points = world.position[1] + s * HALF * matrix_of(world.quaternion[1])[:, 2]
            far = np.linalg.norm(line[:, None] - points[None], axis=-1).min() - RADIUS
        else:
            second = world.add_box(world.add_body(1.0, 1.0, quaternion=rng.normal(size=4)), BOX)
            own = line @ matrix_of(world.quaternion[1])
            far = np.linalg.norm(own - np.clip(own, -BOX, BOX), axis=-1).min()
        if far < RADIUS:
            continue
        searched += 1
        overlap, normal, arm_a, arm_b = meeting(world.arrays.bound().world, first, second)
        least = 4e-3 * RADIUS if other == "capsule" else 3e-2 * RADIUS
        assert RADIUS - far - least - 1e-6 < overlap < RADIUS - far + 1e-9
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(world.position[0] + arm_a, world.position[1] + arm_b, rtol=0.0, atol=1e-15)
    assert searched > 30


def test_a_capsule_rests_on_a_box_and_on_its_edge() -> None:
    """Flat on a box it lies on its ends; over an edge, on one end and its side."""
    for place, ends in ((0.0, 2), (0.042, 1)):
        world = World(timestep=2e-3)
        body = world.add_body(0.05, (9e-6, 9e-6, 2e-6), (place, 0.0, 0.1 + RADIUS + 1e-4), quaternion=(1, 0, 1, 0))
        shapes = world.add_capsule(body, RADIUS, HALF)
        world.add_contact(shapes, world.add_box(None, (0.05, 0.05, 0.05), (0.0, 0.0, 0.05)), steel_pair(0.3, 0.5))
        world.step(2000)
        assert world.position[0, 2] == pytest.approx(0.1 + RADIUS, abs=3e-4)
        rows = world.contacts[world.contacts["closed"]]
        assert rows["force"][:, 2].sum() == pytest.approx(0.05 * 9.81, rel=1e-3)
        assert np.isin(rows["shapes"][:, 0], shapes[1:]).sum() == ends
        assert world.asleep.all()


def test_a_large_slab_is_a_floor_and_costs_no_more_pairs() -> None:
    places = [(0.06 * i, 0.06 * j, 0.03) for i in range(6) for j in range(6)]
    made = balls(steel_pair(0.1, 0.5), places, 0.0, gravity=9.81, timestep=2e-3)
    made.add_contact(range(36), made.add_box(None, (50.0, 50.0, 1.0), (0.0, 0.0, -1.0)), steel_pair(0.1, 0.5))
    made.step(1000)
    np.testing.assert_allclose(made.position[:, 2], 0.025, atol=1e-6)
    assert made.asleep.all()
    assert made.arrays.world["nears"][0] < 36 + 36 * 8


def with_tangent(place, timestep: float, pair) -> World:
    """A ball, and a tangent plane that it alone meets."""
    made = World(gravity=9.81, timestep=timestep)
    radius = 0.025  # and all else as of `balls`
    mass = DENSITY * 4.0 / 3.0 * np.pi * radius**3
    body = made.add_body(mass, 0.4 * mass * radius**2, place, [0.1, 0.0, 0.0])
    sphere = made.add_sphere(body, radius)
    made._shape(tangent(0, sphere, 1.0))
    made.add_contact(sphere, 1, pair)
    return made


def test_a_tangent_plane_that_is_placed_along_a_floor_is_the_floor() -> None:
    place = [0.0, 0.0, 0.026]
    made = with_tangent(place, 1e-3, steel_pair(0.2, 0.7))
    true = balls(steel_pair(0.2, 0.7), [place], [0.1, 0.0, 0.0], planes=[FLOOR], gravity=9.81, timestep=1e-3)
    for _ in range(400):
        made.arrays.shapes[1]["at"] = made.position[0] * (1.0, 1.0, 0.0)
        made.step()
        true.step()
    np.testing.assert_allclose(made.position, true.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(made.spin, true.spin, rtol=0.0, atol=1e-9)


def test_a_ball_stays_in_a_bowl_of_tangent_planes() -> None:
    """Their lag behind the curve feeds it, by an error of first order in the step."""
    gained = []
    for timestep in (1e-3, 5e-4):
        made = with_tangent([0.05, 0.0, -np.sqrt(0.175**2 - 0.05**2) + 1e-5], timestep, steel_pair(0.0, 0.3))
        start = made.energy.total
        for _ in range(round(1.5 / timestep)):
            x = made.position[0]
            made.arrays.shapes[1]["normal"] = -x / np.linalg.norm(x)
            made.arrays.shapes[1]["at"] = 0.2 * x / np.linalg.norm(x)
            made.step()
            assert np.linalg.norm(made.position[0]) < 0.175 + 2e-5
        gained.append(abs(made.energy.total - start))
    assert gained[1] < 0.6 * gained[0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.add_capsule(3, 0.1, 0.1), "body = 3: there are 1 bodies, counted from 0"),
        (lambda w: w.add_capsule(0, 0.0, 0.1), "radius = 0.0: must be finite and > 0"),
        (lambda w: w.add_capsule(0, 0.1, -1.0), "half_length = -1.0: must be finite and > 0"),
        (lambda w: w.add_capsule(0, 0.1, 0.1, axis=(0, 0, 2)), "must be a unit vector"),
        (lambda w: w.add_box(2, (1, 1, 1)), "body = 2: there are 1 bodies, counted from 0"),
        (lambda w: w.add_box(None, (1, 0, 1)), "half_lengths = [1.0, 0.0, 1.0]: must be > 0"),
        (lambda w: w.add_box(None, (1, 1, 1), quaternion=(0, 0, 0, 0)), "must be four numbers"),
        (lambda w: w.add_box(None, (1, 1, 1), (np.inf, 0, 0)), "at: holds inf"),
    ],
)
def test_bad_shapes_are_named(call, message: str) -> None:
    refuses(call, message)


def test_shapes_of_one_body_pass_each_other() -> None:
    world = World(timestep=1e-3)
    body = world.add_body(1.0, 1e-3, (0.0, 0.0, 0.02))
    box = world.add_box(body, (0.01, 0.01, 0.01))
    own = world.add_sphere(body, 0.01)
    world.add_contact([box, own], [box, own], steel_pair())
    world.step(100)
    assert world.position[0, 2] == pytest.approx(0.02 - 0.5 * 9.81 * 0.01)
