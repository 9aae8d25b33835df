"""The list of near pairs against all pairs: mixed sizes, boxes, planes."""

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World

BOX = np.array([0.4, 0.2, 0.1])


SLACK = 0.2  # of its radius: what a ball at rest may move by before the list is made anew


def near(places, radii):
    """Pairs of balls at rest whose margins meet, by looking at all; who is near the floor, and who near the box."""
    reach = (1.0 + SLACK) * radii
    gaps = np.linalg.norm(places[:, None] - places[None], axis=2) - reach[:, None] - reach
    a, b = np.nonzero(np.tril(gaps < 0.0, -1))
    beside = np.linalg.norm(np.maximum(np.abs(places) - BOX, 0.0), axis=1)
    return set(zip(a.tolist(), b.tolist(), strict=True)), places[:, 2] + 1.0 < reach, beside < reach


@pytest.mark.parametrize(("count", "spread"), [(60, 1.0), (60, 100.0), (1000, 100.0), (1000, 1.0)])
@pytest.mark.parametrize("seed", range(4))
def test_every_near_pair_is_found_among_sizes_of_one_to_a_hundred(count, spread, seed):
    rng = np.random.default_rng(seed)
    radii = (0.002 if spread > 1.0 else 0.05) * spread ** rng.uniform(0.0, 1.0, count)
    radii[:2] = radii.min(), radii.min() * spread
    places = rng.uniform(-1.0, 1.0, (count, 3)) * rng.choice([1.0, 0.4])
    places[: count // 4, 2] = -1.0 + rng.uniform(0.0, 1.5, count // 4) * radii[: count // 4]
    pairs, at_floor, at_box = near(places, radii)
    world = World(gravity=0.0, timestep=1e-12)
    floor = world.add_plane(None, (0, 0, -1), (0, 0, 1))
    box = world.add_box(None, BOX)
    balls = [world.add_sphere(world.add_body(1.0, 1e-3, place), radius)
             for place, radius in zip(places, radii, strict=True)]  # fmt: skip
    world.add_contact(balls, [*balls, floor, box], ContactPair("steel", "steel", 0.1))
    world.step()
    listed = world.arrays.near[: int(world.arrays.world["nears"][0])]
    found = list(zip(listed["a"].tolist(), listed["b"].tolist(), strict=True))
    assert found == sorted(set(found))
    first = balls[0]
    assert {(a - first, b - first) for a, b in found if b >= first} == pairs
    assert {a - first for a, b in found if b == floor} == set(np.flatnonzero(at_floor).tolist())
    assert {a - first for a, b in found if b == box} == set(np.flatnonzero(at_box).tolist())
    assert (pairs or count < 100) and at_floor.any()


def test_a_cell_of_another_level_with_the_same_key_lists_no_pair_twice():
    """As 121248 cells from the origin: two balls there had two contacts, each with the whole stiffness."""
    world = World(timestep=1e-3, gravity=0)
    small, large = 1e-3, 1.5e-3
    x, y, z = 2.4 * small * np.array([121248.5, 0.2, 0.3])  # cells are as wide as a small ball with its margin
    places = [(x + 0.1 * k, 1.0, 1.0) for k in range(60)] + [(x, y, z), (x, y + small + large - 1e-7, z)]
    radii = [small] * 61 + [large]
    balls = [world.add_sphere(world.add_body(1.0, 1.0, at), r) for at, r in zip(places, radii, strict=True)]
    world.add_contact(balls, balls, ContactPair("steel", "steel", 0.1))
    world.step()
    assert world.contacts.size == 1


@pytest.mark.parametrize("count", [200, 400])
def test_near_pairs_of_a_lattice_grow_as_its_balls(count):
    world = World(gravity=0.0, timestep=1e-6)
    places = 0.021 * np.stack(np.meshgrid(np.arange(count // 20), np.arange(20), [0.0]), -1).reshape(-1, 3)
    balls = [world.add_sphere(world.add_body(1.0, 1e-3, place), 0.01) for place in places]
    world.add_contact(balls, balls, ContactPair("steel", "steel", 0.1))
    world.step()
    assert int(world.arrays.world["nears"][0]) == 2 * count - 20 - count // 20


def test_two_boxes_do_not_widen_the_margins_of_many_balls():
    """They have parts; where most shapes have, margins are for four times as many steps."""
    world = World(gravity=0.0, timestep=2e-3)
    row = [world.add_sphere(world.add_body(0.03, 1e-6, (0.06 * i, 0.0, 0.0)), 0.01) for i in range(20)]
    boxes = [world.add_box(world.add_body(1.0, 1e-3, (0.0, 0.0, z)), BOX) for z in (9.0, 99.0)]
    world.add_contact([*row, *boxes], [*row, *boxes], ContactPair("steel", "steel", 0.1))
    for i in range(20):
        world.place(i, velocity=(0.0, 1.0, 0.0))
    world.step()
    assert world.arrays.world["nears"][0] == 0


@pytest.mark.parametrize("x", [0.8, -0.8])
def test_what_stands_beside_a_height_field_is_not_near_it(x):
    """By the plane at its top alone it would be, with all parts below that."""
    world = World(gravity=0.0, timestep=2e-3)
    field = world.add_height_field(None, np.full((2, 2), 0.3), (0.2, 0.2))
    box = world.add_box(world.add_body(1.0, 1e-3, (x, 0.0, 0.1)), BOX)
    world.add_contact(box, field, ContactPair("steel", "steel", 0.1))
    world.step()
    assert world.arrays.world["nears"][0] == 0
    world.place(0, position=(0.1, 0.0, 0.4001))
    world.step()
    assert world.arrays.world["nears"][0] > 0


def test_moving_balls_meet_whoever_comes_in_their_way():
    """In a crowd, lists last a step: a fast ball drives through those at rest, and none is passed unseen."""
    world = World(gravity=0.0, timestep=2e-3)
    row = [world.add_sphere(world.add_body(0.03, 1e-6, (0.1 * i, 0.0, 0.0)), 0.01) for i in range(400)]
    world.place(0, velocity=(40.0, 0.0, 0.0))
    world.add_contact(row, row, ContactPair("steel", "steel", 0.0, 1.0))
    world.step(300)
    assert world.velocity[:, 0].sum() == pytest.approx(40.0, rel=1e-9)
    reached = 0.6 * 40.0 / 0.08  # balls, if impacts took no time
    assert 0.97 * reached <= np.argmax(world.velocity[:, 0]) <= reached
    assert world.velocity[:, 0].max() == pytest.approx(40.0, rel=1e-3)


def test_a_ball_struck_beside_a_crowd_meets_what_was_not_near():
    """Windows are long in a crowd of persistent contacts: in one, a ball may be thrown far out of its margin."""
    world, steel = World(timestep=2e-3), ContactPair("steel", "steel", 0.2, 0.9)
    floor = world.add_plane(None, (0, 0, 0), (0, 0, 1))
    row = [world.add_sphere(world.add_body(0.5, 1.25e-4, (x, 0, 9)), 0.025) for x in (-0.052, 0.0, 0.062)]
    crowd = [world.add_sphere(world.add_body(0.5, 1.25e-4, (0.1 * i, 1, 0.025), (0.25, 0, 0)), 0.025) for i in range(6)]
    world.add_contact(row, row, steel)
    world.add_contact(crowd, floor, ContactPair("steel", "steel", 0.2, 0.5, law="coulomb"))
    world.step(20)
    for body, (x, speed) in enumerate([(-0.052, 10.0), (0.0, 0.0), (0.062, 0.0)]):
        world.place(body, (x, 0, 9), (speed, 0, 0))
    world.step()
    assert world.velocity[:3, 0] == pytest.approx([0.5, 0.475, 9.025], abs=1e-3)


def test_of_a_wide_floor_only_what_is_beneath_a_box_is_near_it():
    """Its far edges and corners end in the plane that the box stands on; there four corners of the box touch it."""
    world = World()
    box = world.add_box(world.add_body(1.0, 1e-3, (0.0, 0.0, 0.02)), (0.03, 0.02, 0.02))
    world.add_contact(
        box, world.add_box(None, (5.0, 5.0, 0.1), (0.0, 0.0, -0.1)), ContactPair("steel", "steel", 0.3, 0.5)
    )
    world.step(50)
    assert world.contacts["closed"].sum() == world.arrays.world["nears"][0] == 4


def test_boxes_that_spin_out_of_reach_are_looked_at_once_a_step():
    """Their surfaces are fast, but stay in spheres: no window of a fifth of a radian, of which a step has thousands."""
    world = World(gravity=0.0, timestep=1e-3)
    inertia, spin = [2e-5, 3e-5, 4e-5], (0, 1e6, 1e5)
    bodies = [world.add_body(0.1, inertia, (x, 0, 0), spin=spin) for x in (0.0, 0.1)]
    world.add_contact(
        *(world.add_box(body, (0.02, 0.02, 0.02)) for body in bodies), ContactPair("steel", "steel", 0.3, 0.5)
    )
    world.step(3)
    listed = world.arrays.near[: world.arrays.world["nears"][0]]
    assert listed.size > 0 and (listed["checked"] == 0.0).all()  # [s] of the step, at the last look


@pytest.mark.parametrize(
    ("masses", "speed", "timestep"), [((1, 1, 1, 1), 10, 5e-3), ((0.053, 0.406, 0.5, 0.18), 25, 1e-2)]
)
def test_a_ball_thrown_from_afar_meets_two_that_touch_by_rounding(masses, speed: float, timestep: float) -> None:
    """A contact without load is soft: its window, or a substep of it, is the whole step, and past the ball's margin."""
    row, places = World(timestep=timestep, gravity=0), np.cumsum([0.0, 0.05, 0.07, 0.04])
    shapes = [row.add_sphere(row.add_body(m, 1.6e-4 * m, (x, 0, 0)), 0.02) for m, x in zip(masses, places, strict=True)]
    row.place(0, velocity=(speed, 0, 0))
    row.add_contact(shapes, shapes, ContactPair("steel", "steel", friction=0.0))
    row.step()
    assert (np.diff(row.position[:, 0]) > 0.0399).all()


def test_a_body_that_is_lost_is_near_nothing() -> None:
    """All others meet as without it: what is not a number has no place in the order of a sweep."""
    speeds = []
    for lost in (False, True):
        world, balls = World(timestep=1e-3), []
        for k in range(9):
            place = 0.2 * ((7 * k) % 9)
            balls.append(world.add_sphere(world.add_body(0.5, 1e-4, (place, 0.0, 0.0)), 0.025))
            body = world.add_body(0.5, 1e-4, (place + 0.06, 0.0, 0.0), (-1.0, 0.0, 0.0))
            balls.append(world.add_sphere(body, 0.025))
        balls.append(world.add_sphere(world.add_body(0.5, 1e-4, (0.7, 3.0, 1.0)), 0.025))
        world.add_contact(balls, balls, ContactPair("steel", "steel", friction=0.3, restitution=0.5))
        world.arrays.bodies["spin"][-1] = np.nan if lost else 0.0
        world.step(30)
        speeds.append(world.velocity[:-1, 0])
    np.testing.assert_array_equal(*speeds)
    assert np.all(speeds[0] < 0.0)
