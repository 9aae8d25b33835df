"""`World` from Python: what it refuses, what it shows, saving and restoring, rest."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
import textwrap
import warnings
from collections.abc import Callable
from copy import copy, deepcopy
from math import inf

import numpy as np
import pytest

from contactlaw import ContactWarning
from contactlaw.world import World
from contactlaw.world.trees.description import Joint, Part, Tree
from tests.world.world_scenes import FLOOR, RADIUS, balls, goes_on_alike, mass_of, steel_pair

WEIGHT = mass_of(RADIUS) * 9.81


def resting(restitution: float = 0.5, **more) -> World:
    """A ball dropped on a floor, some time ago."""
    made = balls(steel_pair(restitution=restitution), [[0.0, 0.0, RADIUS + 0.01]], 0.0, planes=[FLOOR], gravity=9.81,
                 timestep=2e-3, **more)  # fmt: skip
    made.step(1000)
    return made


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: World(gravity=(0.0, 1.0)), "gravity: shape (2,)"),
        (lambda w: World(timestep=0.0), "timestep = 0.0: must be finite and > 0"),
        (lambda w: World(gravity=-9.81), "gravity = -9.81: must be >= 0, as one number acts downward"),
        (lambda w: World(substeps=3.0), "substeps = 3.0: must be in [10, 1e6]"),
        (lambda w: w.add_body(0.0, 1.0), "mass = 0.0: must be finite and > 0"),
        (lambda w: w.add_body(1.0, (1.0, 1.0)), "inertia: shape (2,); must be one number, (3,) or (3, 3)"),
        (lambda w: w.add_body(1.0, (1.0, 1.0, 3.0)), "none above the sum of the others"),
        (lambda w: w.add_body(1.0, [[1.0, 0.2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "must be symmetric"),
        (lambda w: w.add_body(1.0, 1.0, (np.nan, 0.0, 0.0)), "position: holds nan"),
        (lambda w: w.add_body(1.0, 1.0, quaternion=(0.0, 0.0, 0.0, 0.0)), "must be four numbers"),
        (lambda w: w.add_sphere(3, 0.1), "body = 3: there are 1 bodies, counted from 0"),
        (lambda w: w.add_sphere(0, -1.0), "radius = -1.0: must be finite and > 0"),
        (lambda w: w.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 2.0)), "must be a unit vector"),
        (lambda w: w.add_contact([], [0], steel_pair()), "shapes1: is empty"),
        (lambda w: w.add_contact([0], [7], steel_pair()), "shapes2 = 7: there are 1 shapes, counted from 0"),
        (lambda w: w.add_contact(0, [0], steel_pair()), "shapes1 = shapes2 = 0: must be two different shapes"),
        (lambda w: w.add_contact([0], [0], "steel"), "pair = 'steel': must be a contactlaw.ContactPair"),
        (lambda w: w.add_rule(0, w.add_sphere(0, 0.1), 3), "pair = 3: must be an integer from -1 to -1"),
        (lambda w: w.apply_force(0, (1.0, 0.0)), "force: shape (2,)"),
        (lambda w: w.apply_force(0, torque=(0.0, np.inf, 0.0)), "torque: holds inf"),
        (lambda w: w.apply_force(w.add_body(inf, 1.0), (1.0, 0.0, 0.0)), "body = 1: is kinematic"),
        (lambda w: w.apply_force(w.add_tree(Tree([Part(1.0, 1.0, [Joint("hinge")])]))[1][0]), "a tree of joints"),
        (lambda w: w.step(-1), "n = -1: must be an integer >= 0"),
        (lambda w: w.restore(World().save()), "saved: is of another world"),
        (lambda w: w.restore(None), "saved = None: must be a contactlaw.Arrays"),
    ],
)
def test_bad_input_is_named(call, message: str) -> None:
    world = World()
    world.add_sphere(world.add_body(1.0, 1.0), 0.1)
    with pytest.raises(ValueError, match=re.escape(message)):
        call(world)


OTHER_PROCESS = """
import pickle, sys
from tests.world.test_world import rolling
world = rolling(0.2)
world.step(3)
sys.stdout.buffer.write(pickle.dumps((world.save(), world)))
"""


def rolling(friction: float) -> World:
    """A ball, a box and a hinged ball on a floor: functions of a law, of shapes and of trees."""
    world, pair = World(timestep=2e-3), steel_pair(friction, 0.5)
    floor = world.add_plane(None, (0, 0, 0), (0, 0, 1))
    ball = world.add_sphere(world.add_body(0.5, 1.25e-4, (0, 0, 0.03), (1, 0, 0)), 0.025)
    box = world.add_box(world.add_body(1.0, 1e-3, (1, 0, 0.021), (1, 0, 0)), (0.03, 0.02, 0.02))
    arm = Part(0.5, 1.25e-4, [Joint("hinge", at=(0, 0, 0.1))], position=(3, 0, 0.024))
    hung = world.add_sphere(world.add_tree(Tree([arm]), [0.5])[1][0], 0.025)
    world.add_contact([ball, box, hung], floor, pair)
    return world


def test_a_state_from_a_file_goes_on_in_another_process() -> None:
    """To the bit; a saved state has few bytes, and takes materials and friction from the world it is restored to."""
    child = [sys.executable, "-c", OTHER_PROCESS]
    saved, other = pickle.loads(subprocess.run(child, check=True, stdout=subprocess.PIPE).stdout)
    worlds = [rolling(0.2), rolling(0.2), other, rolling(0.1)]
    worlds[0].step(3)
    worlds[1].restore(saved)
    worlds[3].restore(saved)
    for world in worlds:
        world.step(40)
    for world in worlds[1:3]:
        np.testing.assert_array_equal(world.position, worlds[0].position)
        assert world.energy == worlds[0].energy
    assert worlds[3].velocity[1, 0] > worlds[0].velocity[1, 0] + 0.05
    assert len(pickle.dumps(saved)) < 0.5 * len(pickle.dumps(tuple(worlds[1].arrays)))
    worlds[1].add_contact(0, 1, steel_pair())
    with pytest.raises(ValueError, match="bodies, shapes or contacts have been added since"):
        worlds[1].restore(saved)


@pytest.mark.parametrize("copied", [copy, deepcopy])
def test_a_copy_moves_by_itself(copied: Callable[[World], World]) -> None:
    """Also when the world that it is of, and that has been moved after it, is gone."""
    world, alike = rolling(0.2), rolling(0.2)
    world.step(5)
    other = copied(world)
    before = other.position
    world.step(20)
    np.testing.assert_array_equal(other.position, before)
    del world
    other.step(20)
    alike.step(25)
    np.testing.assert_array_equal(other.position, alike.position)
    assert other.energy == alike.energy


def test_what_would_change_nothing_is_refused() -> None:
    world = World()
    world.add_body(1.0, 1.0)
    for name in ("position", "velocity", "spin", "quaternion"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(world, name)[0] = 1.0
    for name in ("position", "gravity", "timstep"):
        with pytest.raises(AttributeError, match=f"{name} = 0: only timestep can be set"):
            setattr(world, name, 0)
    with pytest.raises(ValueError, match="timestep = 0: must be finite and > 0"):
        world.timestep = 0


def test_a_ball_at_rest_is_still_to_the_bit_and_costs_nothing() -> None:
    made = resting()
    before = made.save()
    assert made.asleep.all()
    overlap = RADIUS - made.position[0, 2]
    assert steel_pair().effective_modulus * 4.0 / 3.0 * RADIUS**0.5 * overlap**1.5 == pytest.approx(WEIGHT, rel=1e-5)
    made.step(1000)
    for name in ("position", "velocity", "quaternion", "spin"):
        np.testing.assert_array_equal(before.bodies[name], made.arrays.bodies[name])
    assert made.arrays.world["kicks"] == before.world["kicks"]
    assert made.contacts["force"][0] == pytest.approx([0.0, 0.0, WEIGHT], rel=1e-5, abs=1e-12)


def test_what_sleeps_wakes_when_it_is_hit_or_given_a_motion() -> None:
    made = resting()
    other = made.add_body(0.1, 1e-5, (0.06, 0.0, RADIUS), (-1.0, 0.0, 0.0))
    made.add_contact(made.add_sphere(other, 0.01), 1, steel_pair(restitution=0.5))
    made.step(30)
    assert not made.asleep.any() and made.velocity[0, 0] < -0.05
    made = resting()
    made.place(0, velocity=(0.0, 0.0, 1.0))
    made.step(10)
    assert made.position[0, 2] > RADIUS + 0.015


@pytest.mark.parametrize("timestep", [2e-4, 2e-3])
def test_a_force_rolls_a_sleeping_ball_away_until_it_is_taken_off(timestep: float) -> None:
    """At its centre it gives a ball that rolls 5/7 F/m; a torque M about the axis of rolling 5/7 M/(m R)."""
    made = resting()
    made.timestep, steps, force = timestep, round(0.5 / timestep), 0.1 * WEIGHT
    mass = WEIGHT / 9.81
    made.apply_force(0, (force, 0.0, 0.0))
    made.step(steps)
    speed = 5.0 / 7.0 * force / mass * 0.5
    assert made.velocity[0] == pytest.approx([speed, 0.0, 0.0], rel=1e-4, abs=1e-9)
    made.apply_force(0, torque=(0.0, -force * RADIUS, 0.0))
    made.step(steps)
    assert made.velocity[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-4 * speed)
    made.place(0, velocity=(speed, 0.0, 0.0), spin=(0.0, speed / RADIUS, 0.0))
    made.apply_force(0)
    made.step(steps)
    assert made.velocity[0, 0] == pytest.approx(speed, rel=1e-6)


def test_a_force_moves_a_body_in_flight_by_the_parabola() -> None:
    made = World(timestep=0.01, gravity=9.81)
    made.add_body(2.0, (0.1, 0.2, 0.3))
    made.apply_force(0, (3.0, 0.0, 0.0), (0.0, 0.0, 0.6))
    made.step(50)
    assert made.position[0] == pytest.approx([0.5 * 1.5 * 0.25, 0.0, -0.5 * 9.81 * 0.25], abs=1e-12)
    assert made.spin[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert made.energy.total == pytest.approx(3.0 * made.position[0, 0] + 0.15, rel=1e-12)


def test_a_box_that_is_pushed_within_friction_stands_and_sleeps() -> None:
    made = World(timestep=2e-3)
    floor, mass = made.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), 1.0
    made.add_contact(made.add_box(made.add_body(mass, 1e-3, (0.0, 0.0, 0.05)), (0.05, 0.05, 0.05)), floor,
                     steel_pair(0.5, 0.3))  # fmt: skip
    made.apply_force(0, (0.4 * mass * 9.81, 0.0, 0.0))
    made.step(500)
    assert made.asleep[0] and abs(made.position[0, 0]) < 1e-6
    assert made.contacts["force"].sum(0) == pytest.approx([-0.4 * mass * 9.81, 0.0, mass * 9.81], rel=1e-5, abs=1e-6)


def test_saved_in_mid_contact_it_goes_on_to_the_bit() -> None:
    made = balls(steel_pair(restitution=0.9), [[0.0, 0.0, RADIUS + 1e-4]], [0.3, 0.0, -1.0], planes=[FLOOR],
                 timestep=1e-5)  # fmt: skip
    made.step(15)
    assert made.contacts["closed"].all() and made.contacts.size == 1
    assert made.time == pytest.approx(15e-5)
    goes_on_alike(made, 20)
    assert made.time == pytest.approx(35e-5)


def test_the_ledger_of_an_impact_balances() -> None:
    made = balls(steel_pair(restitution=0.8), [[0.0, 0.0, RADIUS + 5e-4]], [0.3, 0.0, -1.0], planes=[FLOOR],
                 timestep=1e-3)  # fmt: skip
    first, start = made.energy.total, made.velocity[0]
    made.step()
    (row,) = made.contacts
    pair = steel_pair(restitution=0.8, radius=RADIUS)
    np.testing.assert_allclose(row["impulse"], mass_of(RADIUS) * (made.velocity[0] - start), rtol=1e-12, atol=1e-15)
    assert row["normal_work"] + row["friction_work"] == pytest.approx(made.energy.total - first, rel=2e-5)
    assert row["deepest"] == pytest.approx(pair.greatest_overlap(mass_of(RADIUS), 1.0), rel=1e-3)
    assert row["strongest"] == pytest.approx(pair.greatest_force(mass_of(RADIUS), 1.0), rel=1e-2)
    assert row["duration"] == pytest.approx(pair.contact_duration(mass_of(RADIUS), 1.0), rel=2e-2)
    assert not row["closed"] and row["touches"] == 1 and tuple(row["bodies"]) == (0, -1)


def test_a_body_of_infinite_mass_goes_its_way() -> None:
    made = World(timestep=1e-3)
    heavy = np.float32(inf)  # of any kind of float
    moved = made.add_body(heavy, 1.0, velocity=(0.0, 0.0, 1.0))  # type: ignore[arg-type]
    plate = made.add_plane(moved, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    ball = made.add_sphere(made.add_body(mass_of(RADIUS), 1e-4, (0.0, 0.0, RADIUS + 1e-3)), RADIUS)
    made.add_contact(ball, plate, steel_pair(0.0))
    made.step(5)
    assert made.velocity[0] == pytest.approx([0.0, 0.0, 1.0])
    assert made.velocity[1, 2] == pytest.approx(2.0 - 9.81 * 3e-3, abs=2e-3)


def test_a_ball_put_into_the_floor_leaves_with_what_it_holds() -> None:
    """The elastic energy of its overlap, 2/5 P delta."""
    made = balls(steel_pair(), [[0.0, 0.0, RADIUS - 1e-4]], 0.0, planes=[FLOOR], timestep=1e-3)
    made.step(5)
    stored = 0.4 * 4.0 / 3.0 * steel_pair().effective_modulus * RADIUS**0.5 * 1e-4**2.5
    assert made.energy.total == pytest.approx(stored, rel=1e-3)


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    lines = (World.__doc__ or "").splitlines()
    first = next(i for i, line in enumerate(lines) if "from contactlaw import" in line)
    last = next(i for i, line in enumerate(lines) if "print(" in line)
    exec(textwrap.dedent("\n".join(lines[first : last + 1])))
    height = float(capsys.readouterr().out.split("]")[0].split()[-1])
    assert 0.02 < height < 0.3


def test_the_later_rule_holds_and_shapes_without_one_pass() -> None:
    made = balls(steel_pair(restitution=0.9), [[0.0, 0.0, 0.03], [1.0, 0.0, 0.03]], 0.0, planes=[FLOOR], gravity=9.81)
    made.add_contact(2, 0, steel_pair(restitution=0.5))
    third = made.add_body(1.0, 1e-3, (2.0, 0.0, 0.03))
    made.add_sphere(third, RADIUS)
    made.step(36)
    fall = np.sqrt(2.0 * 9.81 * 0.005)
    rest = made.velocity[:, 2] + 9.81 * (0.036 - fall / 9.81)
    np.testing.assert_allclose(rest[:2] / fall, [0.9, 0.5], atol=1e-2)
    assert made.velocity[2, 2] == pytest.approx(-9.81 * 0.036)


def test_a_time_step_without_its_name_is_not_taken_for_gravity():
    with pytest.raises(TypeError, match=re.escape("World(0.002): name the arguments")):
        World(2e-3)  # type: ignore[misc]


def test_a_body_that_is_faster_than_any_is_refused() -> None:
    """Its substeps would become shorter than what time resolves. What it strikes is lost with it, and not named."""
    world = World(timestep=2e-3)
    struck = world.add_sphere(world.add_body(1e3, 1.0, (0.0, 0.0, -RADIUS)), RADIUS)
    ball = world.add_sphere(world.add_body(1.0, 1.0, (0.0, 0.0, 0.999 * RADIUS), (0.0, 0.0, -1e13)), RADIUS)
    world.add_contact([ball], [struck], steel_pair(restitution=0.5))
    with pytest.raises(RuntimeError, match=r"body 1, at 1e\+13 m/s: the motion is no longer finite"):
        world.step(3)
    assert world.time == pytest.approx(2e-3)


@pytest.mark.parametrize("steps", [1, 3])
@pytest.mark.parametrize(("speed", "told"), [(80.0, False), (160.0, True)])
def test_a_warning_tells_once_of_overlaps_too_deep_for_hertz(speed: float, told: bool, steps: int) -> None:
    """Also of an impact that begins and ends in a step; at 80 m/s the overlap is 0.08 of the radius, at 160 0.14. And
    not of those before a state that is restored into another world."""
    made, other = (balls(steel_pair(), [[0.0, 0.0, RADIUS]], [[0.0, 0.0, -speed]], planes=[FLOOR]) for _ in range(2))
    for expected in (told, False, False):
        if made.time > steps * made.timestep:
            other.restore(made.save())
            made = other
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            made.step(steps)
        assert made.velocity[0, 2] > 0.0 and [one.category for one in said] == [ContactWarning] * expected


def test_balls_that_are_added_one_by_one_have_rules_of_their_own() -> None:
    world, shapes = World(), []
    for number in range(160):
        shapes.append(world.add_sphere(world.add_body(1.0, 1.0, (3.0 * number, 0.0, 0.0)), 1.0))
        if number > 0:
            world.add_contact(shapes[-1], shapes[:-1], steel_pair())
            group = world.arrays.shapes["group"]
    later = np.maximum(*np.indices((160, 160)))
    np.testing.assert_array_equal(world.arrays.groups[np.ix_(group, group)], np.where(np.eye(160), -1, later - 1))
