"""Guards: no gap is less than the bound of its guard, however two bodies move, so that no contact is missed."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.jit import jit
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.bodies.bounds import closing_along
from contactlaw.world.bodies.motion import fly
from contactlaw.world.data.access import body_at, guard_at, near_at
from contactlaw.world.data.vec import ZERO
from contactlaw.world.near.guards import gap_bound, path_bound, raise_listed_gap, separate, update_guard
from contactlaw.world.near.listing import list_near
from contactlaw.world.shapes.geometry import meet_near
from contactlaw.world.step import begin
from contactlaw.world.trees.description import Joint, Part, Tree
from tests.world.test_hulls import CUBE, rock
from tests.world.world_scenes import steel_pair

STEP = 0.01
ROUNDING = 1e-9  # [m]
SOLIDS = ["box", "hull", "cylinder"]


@jit
def fly_on(world, times, look, promised, gaps, heights):
    """Fly to times of a step; write bounds on the gaps of all near pairs, their gaps, and bounds by separating planes.

    look: number of times between two updates of the guards; 0: `gap_bound` updates them each time, as in substeps. The
    bounds `promised` are raised by the measured gaps at every seventh time.
    """
    w = world[0]
    w.step = STEP
    begin(w)
    list_near(w)
    for m in range(times.size):
        for k in range(w.nears):
            p = near_at(w.near, k)
            promised[m, k] = p.listed_gap - path_bound(guard_at(w.guards, p.guard), times[m])
        for i in range(w.body_count):
            fly(body_at(w.bodies, i), times[m])
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if look == 0:
                promised[m, k] = gap_bound(w, p, a, b)[0]
            overlap, _, _, _ = meet_near(w, p, a, b)
            gaps[m, k] = p.gap = -overlap
            g = guard_at(w.guards, p.guard)
            _, low, high = separate(w, g.a, g.b, ZERO)
            heights[m, k] = low - high
            if m % 7 == 3:
                raise_listed_gap(w, p, times[m])
        if look > 0 and (m + 1) % look == 0:
            for k in range(w.guard_count):
                update_guard(w, guard_at(w.guards, k), STEP - times[m])
    return w.nears


def solid(world: World, kind: str, rng: np.random.Generator, place, speed: float, turn: float) -> int:
    """Add a body with one shape that is not round; return the shape."""
    velocity, inertia = speed * rng.normal(size=3), np.array([3.0, 4.0, 5.0]) * 1e-5 * rng.uniform(0.9, 1.1, 3)
    if kind == "hull":
        return rock(world, rng, place, velocity, 0.03, turn)
    body = world.add_body(0.1, inertia, place, velocity, rng.normal(size=4), turn * rng.normal(size=3))
    if kind == "box":
        return world.add_box(body, rng.uniform(0.01, 0.03, 3), 0.01 * rng.normal(size=3), rng.normal(size=4))
    return world.add_cylinder(body, rng.uniform(0.01, 0.02), rng.uniform(0.01, 0.03), 0.01 * rng.normal(size=3))


@pytest.mark.parametrize("look", [0, 1, 5, 1000])
@pytest.mark.parametrize(
    ("speed", "turn", "push"), [(3.0, 0.0, 0.0), (0.1, 60.0, 0.0), (1.0, 10.0, 300.0), (0.1, 600.0, 0.0)]
)
def test_no_pair_is_nearer_than_its_guard_promises(speed: float, turn: float, push: float, look: int) -> None:
    rng, least, seen, parted = np.random.default_rng(7), np.inf, 0, 0
    for n in range(27):
        world = World(gravity=0.0, timestep=STEP)
        one = solid(world, SOLIDS[n % 3], rng, (0, 0, 0), speed, turn)
        two = solid(world, SOLIDS[n // 3 % 3], rng, 0.06 * rng.normal(size=3) + (0.08, 0, 0), speed, turn)
        world.add_contact(one, two, steel_pair(0.3))
        while world.arrays.near.size < 4000:
            world._arrays = with_more_room(world.arrays)
        bodies = world.arrays.bodies[1:]
        bodies["acceleration"], bodies["torque"] = push * rng.normal(size=(2, 2, 3)) * [[[1.0]], [[1e-4]]]
        promised, gaps, heights = np.full((40, 4000), -np.inf), np.zeros((40, 4000)), np.full((40, 4000), -np.inf)
        count = fly_on(world.arrays.bound().world, np.linspace(0.0, STEP, 41)[1:], look, promised, gaps, heights)
        assert count <= 4000
        kept = promised > 0.0  # a pair is not measured while this is so
        least, seen = min(least, float((gaps - promised)[kept].min(initial=np.inf))), seen + int(kept.sum())
        over = heights > 0.0  # a plane that separates whole shapes
        least, parted = min(least, float((gaps - heights)[over].min(initial=np.inf))), parted + int(over.sum())
    assert min(seen, parted) > 100  # some are kept apart by what is promised, some by planes
    assert least >= -ROUNDING


@pytest.mark.parametrize("seed", range(4))
def test_parts_are_listed_anew_without_all_the_rest(seed: int) -> None:
    """Tumbling hulls and boxes that strike each other move as with a list of all that is near in each step."""
    moved, lists = [], []
    for every in (False, True):
        rng, world, half = np.random.default_rng(seed), World(gravity=0.0, timestep=1e-3), 0.02
        shapes = []
        for i, j in np.ndindex(3, 2):
            place = (0.06 * i, 0.06 * j, 0.004 * (i - j))
            body = world.add_body(0.5, 0.5 * 2.0 / 3.0 * half**2, place, spin=rng.normal(0.0, 15.0, 3))
            world.place(body, velocity=0.3 * (np.array([0.06, 0.03, 0.0]) - place) / 0.06)
            shapes.append(world.add_hull(body, half * CUBE) if i % 2 else world.add_box(body, [half] * 3))
        world.add_contact(shapes, shapes, steel_pair(0.3))
        for _ in range(150):
            world.arrays.world["stale"] |= every
            world.step()
        moved.append(np.hstack([world.velocity, world.position]))
        lists.append(int(world.arrays.world["lists"][0]))
    assert lists[0] < 0.1 * lists[1], lists
    assert np.abs(moved[0][:, :3]).max() > 0.1
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-3)  # 150 impacts magnify rounding


@pytest.mark.parametrize("timestep", [1e-4, 0.01])
@pytest.mark.parametrize("kind", ["box", "hull"])
def test_two_that_spin_fast_meet_at_their_edges_within_a_long_step(kind: str, timestep: float) -> None:
    """They stand beside each other: without a spin 4 mm are between them, but their corners reach 8 mm further."""
    world, half = World(gravity=0.0, timestep=timestep), 0.02
    shapes = []
    for x, spin in ((0.0, 100.0), (0.044, 100.0)):
        body = world.add_body(0.5, 0.5 * 2.0 / 3.0 * half**2, (x, 0, 0), spin=(0, 0, spin))
        shapes.append(world.add_box(body, [half] * 3) if kind == "box" else world.add_hull(body, half * CUBE))
    world.add_contact(shapes[0], shapes[1], steel_pair(0.0, restitution=1.0))
    start = world.energy.kinetic
    world.step(round(0.01 / timestep))
    assert np.abs(world.velocity[:, 0]).min() > 0.1  # they have met
    assert world.velocity[1, 0] > 0.0 > world.velocity[0, 0]
    assert world.energy.kinetic == pytest.approx(start, rel=1e-3)
    np.testing.assert_allclose(world.velocity.sum(0), 0.0, atol=1e-9)


def test_parts_that_were_away_are_met_when_they_are_back() -> None:
    """A cube is taken a metre off its plate and put back elsewhere and turned: its parts are listed as at first."""
    world, half = World(gravity=0.0, timestep=1e-3), 0.02
    plate = world.add_box(None, (0.5, 0.5, 0.05), (0, 0, -0.05))
    body = world.add_body(0.5, 0.5 * 2.0 / 3.0 * half**2, (0, 0, half + 2e-4))
    world.add_contact(world.add_hull(body, half * CUBE), plate, steel_pair(0.3))
    counts, lists = [], []
    for place in ((0.0, 0.0, half + 2e-4), (0.0, 0.0, 1.0), (0.2, 0.1, half + 2e-4)):
        world.place(body, place)
        world.step()
        counts.append(int(world.arrays.world["nears"][0]))
        lists.append(int(world.arrays.world["lists"][0]))
    assert counts[0] > 4
    assert counts[1] == 0
    assert counts[2] == counts[0]
    assert lists[0] < lists[1] < lists[2]
    world.place(body, velocity=(0.0, 0.0, -1.0))
    world.step(3)
    assert world.velocity[0, 2] > 0.0


@pytest.mark.parametrize(
    ("axes", "held", "listed"),
    [
        ([(0, 0, 1)], True, False),
        ([(0, 0, 1)], False, True),  # the plate may be moved
        ([(0, 0.05, 1)], True, True),  # the corners dip by 1.4 mm
        ([(0, 0, 1), (1, 0, 0)], True, True),
    ],
)
def test_what_turns_about_the_normal_of_a_gap_never_closes_it(axes, held: bool, listed: bool) -> None:
    """A cube 0.2 mm above a plate, on a hinge: it is not looked at where the plane between them stays as it is."""
    world, half = World(gravity=0.0, timestep=1e-3), 0.02
    under = None if held else world.add_body(np.inf, 1.0)
    plate = world.add_hull(under, np.array((0.5, 0.5, 0.05)) * CUBE, at=(0, 0, -0.05))
    joints = [Joint("hinge", axis=np.array(axis) / np.linalg.norm(axis)) for axis in axes]
    tree, (body,) = world.add_tree(
        Tree([Part(0.5, 1e-4, joints, position=(0, 0, half + 2e-4))]), v=[300.0, 0.0][: len(axes)]
    )
    world.add_contact(world.add_hull(body, half * CUBE), plate, steel_pair(0.3, restitution=1.0))
    world.step(20)
    assert (world.arrays.world["nears"][0] > 0) == listed
    if len(axes) == 1:
        touches = axes[0][1] != 0.0
        assert (abs(world.tree(tree)[1][0] - 300.0) > 1.0) == touches
        assert (world.arrays.world["kicks"][0] > 0) == touches


def test_one_look_does_for_all_parts_of_two_shapes_that_are_far_apart() -> None:
    """A cube that slides along over a plate, as far up as it goes in a few steps: its parts are not looked at each."""
    world = World(gravity=0.0, timestep=1e-3)
    plate = world.add_hull(None, np.array((2.0, 2.0, 0.05)) * CUBE, at=(0, 0, -0.05))
    body = world.add_body(0.5, 1e-4, (-0.5, 0, 0.045), (10.0, 0, 0))
    world.add_contact(world.add_hull(body, 0.02 * CUBE), plate, steel_pair(0.3))
    looked = []
    for _ in range(40):
        world.step()
        near = world.arrays.near[: int(world.arrays.world["nears"][0])]
        looked += [set(near["gap"][near["checked"] == 0.0].tolist())]
    assert any(looked)
    assert max(map(len, looked)) == 1
    assert world.arrays.world["kicks"][0] == 0


@jit
def fly_along(world, n, times, slides, places, reach):
    """Fly two bodies to times of a step; write bounds on the mean speed of B against n from the start, and their poses.

    n: fixed to B. slides: bounds on the mean closing speed and on the path by its growth; places (m, 2, 12): positions
    and axes of both.
    """
    w = world[0]
    w.step = STEP
    begin(w)
    a, b = body_at(w.bodies, 1), body_at(w.bodies, 2)
    a.reach = reach
    for m in range(times.size):
        now, growth, mean = closing_along(a, b, (n[0], n[1], n[2]), times[m])
        slides[m, 0] = mean * times[m]
        slides[m, 1] = (now + 0.5 * growth * times[m]) * times[m]
    for m in range(times.size):
        for i in range(2):
            body = body_at(w.bodies, 1 + i)
            fly(body, times[m])
            for k in range(3):
                places[m, i, k] = body.position[k]
            for k in range(9):
                places[m, i, 3 + k] = body.axes[k]


@pytest.mark.parametrize("linked", [False, True])
def test_no_point_comes_down_on_a_plane_faster_than_it_is_promised(linked: bool) -> None:
    """A body in the frame of another one; both fly, or are links of an arm, of which the second carries the first."""
    rng, reach, least, closest = np.random.default_rng(3), 0.05, np.inf, np.inf
    for _ in range(30):
        world, turn = World(gravity=0.0, timestep=STEP), rng.choice([1.0, 30.0])
        inertia = np.array([3.0, 4.0, 5.0]) * 1e-5
        if linked:
            hinges = [[Joint("hinge", axis=axis / np.linalg.norm(axis))] for axis in rng.normal(size=(2, 3))]
            spread = 0.1 * rng.normal(size=(2, 3))
            parts = [Part(0.1, inertia, hinges[0], position=spread[0])]
            parts += [Part(0.1, inertia, hinges[1], parent=0, position=spread[1])]
            world.add_tree(Tree(parts), v=turn * rng.normal(size=2))
        else:
            for place in 0.1 * rng.normal(size=(2, 3)):
                world.add_body(0.1, inertia, place, rng.normal(size=3), rng.normal(size=4), turn * rng.normal(size=3))
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        times = np.linspace(0.0, STEP, 21)
        slides, places = np.zeros((21, 2)), np.zeros((21, 2, 12))
        fly_along(world.arrays.bound().world, n, times, slides, places, reach)
        at, axes = places[..., :3], places[..., 3:].reshape(21, 2, 3, 3)
        points = rng.normal(size=(200, 3))
        points *= reach / np.linalg.norm(points, axis=1)[:, None]
        apart = at[:, None, 0] + np.einsum("mij,pj->mpi", axes[:, 0], points) - at[:, None, 1]
        heights = np.einsum("mpi,mij,j->mp", apart, axes[:, 1], n)
        fallen = (heights[0] - heights).max(axis=1)[1:]
        least = min(least, float((slides[1:] - fallen[:, None]).min()))
        closest = min(closest, float((slides[1:, 0] / np.maximum(fallen, 1e-9)).min()))
    assert least >= -ROUNDING
    assert closest < 1.1  # the bound is not loose
