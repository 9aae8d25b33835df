"""Boxes and cylinders on planes, boxes and each other: statics, periods, energy, rest; deepest points by search."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from contactlaw import ContactPair, Material
from contactlaw.world import World
from contactlaw.world.data.frames import matrix_of
from contactlaw.world.data.kinds import DISC, SIDE
from sims.contact_point import static_overlap
from tests.world.test_hulls import meeting_with_and_without
from tests.world.test_shapes import meeting
from tests.world.world_scenes import FLOOR, refuses, steel_pair

SOFT = Material(1e9, 0.3)
G = 9.81
HALF = np.array([0.03, 0.02, 0.025])
STEPS = pytest.mark.parametrize("timestep", [5e-4, 2e-3, 1e-2])


def box(world: World, half, place, quaternion=(1, 0, 0, 0), velocity=(0, 0, 0), spin=(0, 0, 0)) -> int:
    """A box of 2000 kg/m^3; its shape."""
    half = np.asarray(half)
    mass = 8.0 * half.prod() * 2000.0
    inertia = mass / 3.0 * (half @ half - half * half)
    return world.add_box(world.add_body(mass, inertia, place, velocity, quaternion, spin), half)


def cylinder(world: World, radius, half, place, quaternion=(1, 0, 0, 0), velocity=(0, 0, 0), spin=(0, 0, 0)) -> int:
    """A cylinder of 2000 kg/m^3; its shape."""
    mass = 2.0 * pi * radius**2 * half * 2000.0
    across = mass * (3.0 * radius**2 + 4.0 * half**2) / 12.0
    inertia = (across, across, 0.5 * mass * radius**2)
    return world.add_cylinder(world.add_body(mass, inertia, place, velocity, quaternion, spin), radius, half)


def falls(world: World, time: float) -> float:
    """Step so long, or until all sleep; returns the greatest gain of energy over what there was last, as a share."""
    start = least = world.energy.total
    gain = 0.0
    for _ in range(round(time / world.timestep)):
        world.step()
        energy = world.energy.total
        gain, least = max(gain, energy - least), min(least, energy)
        if world.asleep.all():
            break
    return gain / abs(start)


def on_floor(timestep: float) -> tuple[World, int]:
    world = World(timestep=timestep)
    return world, world.add_plane(None, *FLOOR)


def period(angles: np.ndarray, timestep: float) -> float:
    """From the first to the last upward zero."""
    k = np.flatnonzero((angles[:-1] < 0.0) & (angles[1:] >= 0.0))
    times = k + angles[k] / (angles[k] - angles[k + 1])
    return float(times[-1] - times[0]) * timestep / (k.size - 1)


def test_a_box_on_a_plane_is_four_springs() -> None:
    """Depth, 4 P(depth) = m g; bounce, 4 k/m; and rocking, (4 k x^2 - m g z)/I, by the stiffness k = 2 E* sqrt(r d)."""
    world, floor = on_floor(1e-5)
    shape = box(world, HALF, (0.0, 0.0, 0.0))
    pair = ContactPair(SOFT, SOFT, 0.0, 1.0)
    world.add_contact(shape, floor, pair)
    r, mass = 0.1 * HALF.min(), 8.0 * HALF.prod() * 2000.0
    depth = static_overlap(pair, 0.25 * mass * G, r)
    k = 2.0 * pair.effective_modulus * sqrt(r * depth)
    x, z = HALF[0] - r, HALF[2] - r
    inertia = mass / 3.0 * (HALF[0] ** 2 + HALF[2] ** 2)
    tilt = 1e-3 * depth / x
    for mode, stiffness in ((0, 4.0 * k / mass), (1, (4.0 * k * x * x - mass * G * z) / inertia)):
        lifted = depth * (1.0 - 1e-3 * (mode == 0))
        turn = tilt * mode
        place = (0.0, 0.0, HALF[2] - lifted)
        world.place(0, place, (0, 0, 0), (cos(0.5 * turn), 0.0, sin(0.5 * turn), 0.0), (0, 0, 0))
        track = []
        for _ in range(3000):
            world.step()
            track.append(world.quaternion[0, 2] if mode else world.position[0, 2] - HALF[2] + depth)
        assert period(np.array(track), 1e-5) == pytest.approx(2.0 * pi / sqrt(stiffness), rel=1e-3)


@STEPS
@pytest.mark.parametrize("ground", ["plane", "table"])
@pytest.mark.parametrize(
    ("quaternion", "height"),
    [((1, 0, 0, 0), HALF[2]), ((0.96, 0.3, 0, 0), None), ((0.9, 0.3, 0.2, 0.2), None)],
)
def test_a_dropped_box_comes_to_rest(timestep: float, ground: str, quaternion, height) -> None:
    """Flat, on an edge and on a corner."""
    world, floor = on_floor(timestep)
    if ground == "table":
        floor = world.add_box(None, (0.2, 0.2, 0.05), (0.0, 0.0, -0.05))
    shape = box(world, HALF, (0.0, 0.0, 0.06), quaternion)
    world.add_contact(shape, floor, steel_pair(0.3, 0.6))
    assert falls(world, 2.0) < 1e-9
    assert world.asleep.all()
    assert np.abs(world.position[0, 2] - HALF).min() < 1e-6
    assert height is None or world.position[0, 2] == pytest.approx(height, abs=1e-6)
    rows = world.contacts
    assert rows.size == 4
    assert set(rows["shapes"].ravel()) == {shape, floor}
    assert rows["force"][:, 2].sum() == pytest.approx(8.0 * HALF.prod() * 2000.0 * G, rel=1e-6)


@STEPS
def test_a_puck_stands_on_its_end_and_penetrates_as_four_feet_do(timestep: float) -> None:
    for quaternion in ((1, 0, 0, 0), (0.9, 0.3, 0.2, 0.2)):
        world, floor = on_floor(timestep)
        shape = cylinder(world, 0.03, 0.01, (0.0, 0.0, 0.05), quaternion)
        pair = ContactPair(SOFT, SOFT, 0.3, 0.6)
        world.add_contact(shape, floor, pair)
        assert falls(world, 3.0) < 1e-9
        mass = 2.0 * pi * 0.03**2 * 0.01 * 2000.0
        depth = static_overlap(pair, 0.25 * mass * G, 1e-3)
        assert 0.01 - world.position[0, 2] == pytest.approx(depth, rel=1e-4)
        assert np.abs(world.velocity).max() < 1e-9


@STEPS
@pytest.mark.parametrize("ground", ["plane", "table"])
def test_a_can_rolls_straight_and_for_ever(timestep: float, ground: str) -> None:
    """Thrown without spin it comes to roll at 2/3 of its speed, and nothing slows it."""
    world, floor = on_floor(timestep)
    if ground == "table":
        floor = world.add_box(None, (5.0, 0.5, 0.05), (0.0, 0.0, -0.05))
    shape = cylinder(world, 0.03, 0.05, (0.0, 0.0, 0.03), (sqrt(0.5), sqrt(0.5), 0.0, 0.0), (1.0, 0.0, 0.0))
    world.add_contact(shape, floor, steel_pair(0.3, 0.6))
    assert falls(world, 1.0) < 1e-9
    energy = world.energy.total
    assert falls(world, 1.0) < 1e-9
    assert world.energy.total == pytest.approx(energy, rel=1e-9)
    assert world.velocity[0, 0] == pytest.approx(2.0 / 3.0, rel=1e-5)
    np.testing.assert_allclose(world.velocity[0, 1:], 0.0, atol=1e-8)
    assert abs(world.position[0, 1]) < 1e-8


@STEPS
@pytest.mark.parametrize("count", [2, 3])
def test_equal_boxes_stand_on_each_other(timestep: float, count: int) -> None:
    world, floor = on_floor(timestep)
    boxes = [box(world, HALF, (0.0, 0.0, HALF[2] + 1e-4 + (2.0 * HALF[2] + 1e-4) * i)) for i in range(count)]
    world.add_contact(boxes, [floor, *boxes], steel_pair(0.3, 0.6))
    assert falls(world, 1.0) < 1e-9
    assert world.asleep.all()
    np.testing.assert_allclose(world.position[:, 2], HALF[2] * (1.0 + 2.0 * np.arange(count)), atol=2e-6)
    np.testing.assert_allclose(world.position[:, :2], 0.0, atol=1e-6)


@pytest.mark.parametrize(("count", "shift", "restitution"), [(2, 4e-3, 0.02), (3, 5e-3, 0.1), (3, 2e-3, 0.3)])
def test_many_dampers_on_one_body_bring_it_to_rest(count: int, shift: float, restitution: float) -> None:
    """Up to twelve contacts between two boxes, which together damp more than a substep of one of them can follow."""
    half, soft = (0.03, 0.03, 0.02), Material(1e8, 0.3)
    world = World(timestep=2e-3)
    floor = world.add_plane(None, *FLOOR)
    boxes = [box(world, half, (shift * (i % 2), 0.0, 0.02 + 0.0402 * i)) for i in range(count)]
    world.add_contact(boxes, [floor, *boxes], ContactPair(soft, soft, 0.4, restitution))
    world.step(500)
    world.place(count - 1, velocity=(0.0, 0.0, -2.0))
    world.step(1500)
    assert world.contacts.size > 8 and world.energy.kinetic < 1e-20


def drop(seed: int, restitution: float | None = None) -> World:
    """Up to three boxes and cylinders of random sizes fall on a plane, or a table, and on each other."""
    rng = np.random.default_rng(seed)
    world, ground = on_floor(float(rng.choice([5e-4, 1e-3, 2e-3, 5e-3, 1e-2])))
    if seed % 2:
        ground = world.add_box(None, (0.5, 0.5, 0.05), (0.0, 0.0, -0.05))
    shapes = []
    for i in range(1 + seed % 3):
        sizes = np.exp(rng.uniform(np.log(0.005), np.log(0.04), 3))
        place, turn = (0.02 * rng.normal(), 0.02 * rng.normal(), 0.08 + 0.11 * i), rng.normal(size=4)
        velocity, spin = 0.3 * rng.normal(size=3), rng.choice([0.0, 5.0, 30.0]) * rng.normal(size=3)
        if rng.random() < 0.5:
            shapes.append(box(world, sizes, place, turn, velocity, spin))
        else:
            shapes.append(cylinder(world, sizes[0], sizes[1], place, turn, velocity, spin))
    material = (SOFT, Material(2e11, 0.3), Material(3e9, 0.35))[rng.integers(3)]
    pair = ContactPair(material, material, rng.uniform(0.0, 0.8), restitution or rng.uniform(0.2, 0.9))
    world.add_contact(shapes, [ground, *shapes], pair)
    return world


@pytest.mark.parametrize("first", range(0, 40, 10))
def test_random_drops_gain_nothing_and_come_to_rest(first: int) -> None:
    """Boxes sleep; cylinders may roll on, with their middle at the height of their radius, or wobble to the ground."""
    for seed in range(first, first + 10):
        world = drop(seed)
        assert falls(world, 2.0) < 1e-6, seed
        assert world.arrays.world["latest"][0] < 1e-5, seed
        at = world.position
        on = np.abs(at[:, :2]).max(1) < 0.45
        assert at[on, 2].min(initial=1.0) > 0.0048, seed


@pytest.mark.parametrize("kind", ["box", "cylinder"])
@pytest.mark.parametrize("timestep", [5e-4, 2e-3])
def test_elastic_impacts_without_friction_keep_energy(kind: str, timestep: float) -> None:
    """Two that tumble between four boxes and two planes."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        world = World(gravity=0.0, timestep=timestep)
        walls = [world.add_plane(None, (0, 0, -s * 0.1), (0, 0, s)) for s in (1.0, -1.0)]
        walls += [world.add_box(None, (0.2, 0.05, 0.2), (0.0, 0.15 * s, 0.0)) for s in (1.0, -1.0)]
        walls += [world.add_box(None, (0.05, 0.2, 0.2), (0.15 * s, 0.0, 0.0)) for s in (1.0, -1.0)]
        made = []
        for x in (-0.045, 0.045):
            place, turn, velocity, spin = (
                (x, 0.0, 0.0),
                rng.normal(size=4),
                rng.normal(size=3),
                5.0 * rng.normal(size=3),
            )
            if kind == "box":
                made.append(box(world, HALF, place, turn, velocity, spin))
            else:
                made.append(cylinder(world, 0.03, 0.02, place, turn, velocity, spin))
        world.add_contact(made, [*walls, *made], steel_pair(0.0, 1.0))
        start = world.energy.total
        world.step(round(1.0 / timestep))
        assert world.arrays.contacts.size > 0
        assert world.energy.kinetic + world.energy.elastic == pytest.approx(start, rel=1e-3)
        assert np.abs(world.position).max() < 0.1


@pytest.mark.parametrize("other", ["plane", "box", "cylinder"])
def test_rims_and_sides_are_met_where_they_are_deepest(other: str) -> None:
    """Against a search over all points of the crowned disc; edges of what is met are rounded by a tenth."""
    radius, half = 0.02, 0.01
    circle, share = np.linspace(0.0, 2.0 * pi, 361)[:-1], np.linspace(0.0, 1.0, 41)
    searched = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        world = World(gravity=0.0)
        one = cylinder(world, radius, half, 0.04 * rng.normal(size=3), rng.normal(size=4))
        body = world.add_body(1.0, 1.0, quaternion=rng.normal(size=4))
        if other == "plane":
            two = world.add_plane(body, (0.0, 0.0, -0.03), (0.0, 0.0, 1.0))
        else:
            two = world.add_box(body, HALF) if other == "box" else world.add_cylinder(body, 0.015, 0.03)
        world.add_contact(one, two, steel_pair())
        arrays = world.arrays.bound()
        turn, back = matrix_of(world.quaternion[0]), matrix_of(world.quaternion[1])
        for number in np.flatnonzero(world.owners == one):
            s = arrays.shapes[number]
            if s["kind"] not in (DISC, SIDE):
                continue
            along = s["half"] @ s["normal"]
            across = s["half"] - along * s["normal"]
            places = np.linspace(-1.0, 1.0, 21 if s["kind"] == SIDE else 1)
            t, u, phi = np.meshgrid(places if places.size > 1 else [0.0], share, circle[:: 4 if places.size > 1 else 1],
                                    indexing="ij")  # fmt: skip
            own = t[..., None] * along * s["normal"] + u[..., None] * (
                np.cos(phi)[..., None] * across + np.sin(phi)[..., None] * np.cross(s["normal"], across)
            )
            p = (world.position[0] + (s["at"] + own) @ turn.T) @ back
            if other == "plane":
                far = p[..., 2] + 0.03
            elif other == "box":
                far = np.linalg.norm(p - np.clip(p, 0.002 - HALF, HALF - 0.002), axis=-1) - 0.002
            else:
                out = np.hypot(np.hypot(p[..., 0], p[..., 1]) - 0.0135, 0.0) * (np.hypot(p[..., 0], p[..., 1]) > 0.0135)
                far = np.hypot(out, np.maximum(np.abs(p[..., 2]) - 0.0285, 0.0)) - 0.0015
            r = s["radius"]
            overlap = (r * (1.0 - 0.01 * (1.0 + t * t + u * u)) - far).max()
            if other != "plane" and far.min() < 0.5 * r:
                continue
            searched += 1
            found, normal, arm_a, arm_b = meeting(arrays.world, int(number), two)
            assert overlap - 1e-9 < found < overlap + 0.1 * r
            assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
            np.testing.assert_allclose(world.position[0] + arm_a, world.position[1] + arm_b, rtol=0.0, atol=1e-15)
    assert searched > 60


@pytest.mark.parametrize("other", ["box", "cylinder", "hull"])
def test_a_rim_is_met_where_it_is_deepest_wherever_the_search_begins(other: str) -> None:
    """Nearly touching, where rims run along rims and edges: a search that gave up there missed contacts by 0.1 mm."""
    rng, searched = np.random.default_rng(7), 0
    for _ in range(60):
        radius, half, *sizes = rng.uniform(0.01, 0.04, 5)
        world = World(gravity=0.0)
        one = cylinder(world, radius, half, (0.0, 0.0, 0.0), rng.normal(size=4))
        body = world.add_body(1.0, 1.0, quaternion=rng.normal(size=4))
        if other == "hull":
            two = world.add_hull(body, rng.normal(size=(12, 3)) * sizes)
        else:
            two = world.add_box(body, sizes) if other == "box" else world.add_cylinder(body, *sizes[:2])
        world.add_contact(one, two, steel_pair())
        arrays = world.arrays.bound()
        rims = np.flatnonzero((arrays.shapes["kind"] == DISC) & (world.owners == one)).tolist()
        way, low, high = rng.normal(size=3), 0.0, 1.0
        for _ in range(30):
            arrays.bodies["position"][2] = (middle := 0.5 * (low + high)) * way
            arrays.near["place"][0], arrays.near["vertices"][0] = 0.0, 0
            apart = all(meeting_with_and_without(arrays.world, rim, two)[0][0] < 0.0 for rim in rims)
            low, high = (low, middle) if apart else (middle, high)
        for rim in rims:
            for angle in rng.uniform(0.0, 2.0 * pi, 5):
                arrays.near["place"][0] = 0.9 * radius * cos(angle), 0.9 * radius * sin(angle), 0.0
                arrays.near["vertices"][0] = 0
                (overlap, *_), (same, *_) = meeting_with_and_without(arrays.world, rim, two)
                searched += abs(overlap) < radius
                assert same == pytest.approx(overlap, abs=1e-9)
    assert searched > 200


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.add_box(0, (1, 1, 1), rounding=0.6), "rounding = 0.6: must be at most half"),
        (lambda w: w.add_box(0, (1, 1, 1), rounding=0.0), "rounding = 0.0: must be finite and > 0"),
        (lambda w: w.add_cylinder(0, 0.0, 1.0), "radius = 0.0: must be finite and > 0"),
        (lambda w: w.add_cylinder(0, 1.0, -1.0), "half_length = -1.0: must be finite and > 0"),
        (lambda w: w.add_cylinder(0, 1.0, 1.0, axis=(0, 0, 2)), "must be a unit vector"),
    ],
)
def test_bad_solids_are_named(call, message: str) -> None:
    refuses(call, message)


@pytest.mark.parametrize("other", [box, cylinder])
@pytest.mark.parametrize("restitution", [0.5, 0.8])
def test_a_rim_strikes_an_edge_or_a_rim_with_the_restitution_given(other, restitution: float) -> None:
    """Both bodies' parts meet the other one there; each with all the stiffness and mass 0.5 became 0.41 and 0.39."""
    world = World(timestep=1e-4, gravity=0)
    above = cylinder(world, 0.02, 0.02, (0, 0, 0.06), (cos(pi / 8), sin(pi / 8), 0, 0), (0, 0, -0.5))
    sizes = [(0.02, 0.02, 0.02)] if other is box else [0.02, 0.02]
    below = other(world, *sizes, (0, 0, 0), (cos(pi / 8), 0, sin(pi / 8), 0), (0, 0, 0.5))
    world.add_contact(above, below, steel_pair(friction=0.0, restitution=restitution))
    world.step(200)
    assert world.velocity[0, 2] - world.velocity[1, 2] == pytest.approx(restitution, abs=0.05)


@pytest.mark.parametrize("timestep", [1e-3, 5e-3])
def test_a_coin_that_wobbles_stays_on_its_rim_and_gains_nothing(timestep: float) -> None:
    """Euler's disk, set rolling at a tilt of 0.2: 4 g/(R sin tilt) is the square of its rate, to the tilt's square."""
    radius, half, tilt = 0.0375, 0.0064, 0.2
    world, floor = on_floor(timestep)
    r = 0.1 * half
    rate = sqrt(4.0 * G / (radius * sin(tilt)))
    spin = -rate * sin(tilt) * np.array([0.0, cos(tilt), sin(tilt)])
    height = (half - r) * cos(tilt) + (radius - r) * sin(tilt) + r
    coin = cylinder(
        world, radius, half, (0.0, 0.0, height), (cos(0.5 * tilt), sin(0.5 * tilt), 0.0, 0.0), (0, 0, 0), spin
    )
    world.add_contact(coin, floor, steel_pair(0.3, 0.6))
    assert falls(world, 1.0) < 1e-9
    energy = world.energy.total
    turned, before = 0.0, None
    for _ in range(round(1.0 / timestep)):
        world.step()
        axis = matrix_of(world.quaternion[0])[:, 2]
        assert 0.1 < sqrt(1.0 - axis[2] ** 2) < 0.3
        now = np.arctan2(axis[1], axis[0])
        turned += 0.0 if before is None else (now - before + pi) % (2.0 * pi) - pi
        before = now
    assert abs(turned) == pytest.approx(rate, rel=0.15)
    rows = world.contacts
    assert rows.size == 1
    assert rows["touches"].tolist() == [1] or rows["duration"][0] > 1.0
    assert 0.95 * energy < world.energy.total < energy


def test_a_coin_that_is_laid_down_tilted_settles() -> None:
    world, floor = on_floor(1e-3)
    coin = cylinder(world, 0.0125, 0.001, (0.0, 0.0, 0.0025), (cos(0.05), sin(0.05), 0.0, 0.0))
    world.add_contact(coin, floor, steel_pair(0.3, 0.6))
    assert falls(world, 3.0) < 1e-9
    assert np.abs(world.velocity).max() < 1e-9
    assert world.position[0, 2] == pytest.approx(0.001, abs=1e-7)
    assert world.contacts.size == 4
