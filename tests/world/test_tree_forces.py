"""Trees described body by body: damping and forces of joints, contacts of branches, and rest."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from contactlaw.world.data.tree import AXIS
from contactlaw.world.trees.description import Joint, Part, Tree
from contactlaw.world.trees.tree_records import numbers
from tests.world.jointed_scenes import TIP, arm_over_floor
from tests.world.world_scenes import FLOOR, RADIUS, mass_of, steel_pair

INERTIA = 2e-3


def wheel(damping: float, timestep: float, v: float = 5.0) -> World:
    """One body that turns about its centre of mass."""
    world = World(gravity=0.0, timestep=timestep)
    world.add_tree(Tree([Part(0.1, INERTIA, [Joint(armature=INERTIA, damping=damping)])]), v=[v])
    return world


def test_damping_slows_a_wheel_as_its_equation_says() -> None:
    damping, wish, force = 0.2, 2.0, 0.1
    world = wheel(damping, 2e-3)
    numbers(world.arrays, 0, "f")[:], numbers(world.arrays, 0, "v_f")[:] = force, wish
    world.arrays.trees["stale"] = 1
    world.step(20)
    end = wish + force / damping
    decayed = (5.0 - end) * np.exp(-damping / (2.0 * INERTIA) * 0.04)
    np.testing.assert_allclose(world.tree(0)[1][0], end + decayed, atol=1e-6)


@pytest.mark.parametrize("damping", [2.0, 20.0, 2000.0])
def test_damping_that_is_stiff_neither_swings_nor_blows_up(damping: float) -> None:
    world = wheel(damping, 5e-3)
    before = 5.0
    for _ in range(40):
        world.step()
        now = world.tree(0)[1][0]
        assert 0.0 <= now < before or now == 0.0
        before = now
    assert before < 1e-9
    numbers(world.arrays, 0, "f")[:] = 3.0 * damping
    world.arrays.trees["stale"] = 1
    world.step(40)
    np.testing.assert_allclose(world.tree(0)[1][0], 3.0, rtol=1e-9)


@pytest.mark.parametrize(("damping", "timestep"), [(1e5, 2e-3), (1e6, 2e-4), (1e8, 2e-3)])
def test_a_lift_of_any_damping_sinks_as_its_load_says(damping: float, timestep: float) -> None:
    """It carries an arm whose far end comes to lie on the floor, which then bears half of the arm's weight."""
    world = World(timestep=timestep)
    lift, hinge = Joint("slide", axis=(0.0, 0.0, 1.0), damping=damping), Joint("hinge", (-0.15, 0.0, 0.0), damping=0.5)
    parts = [Part(13.0, 1e-2, [lift]), Part(2.0, 2e-2, [hinge], 0, (0.15, 0.0, 0.0))]
    _, bodies = world.add_tree(Tree(parts), [0.021, 0.0])
    rubber = ContactPair("rubber", "steel", friction=0.8, restitution=0.3)
    world.add_contact(world.add_sphere(bodies[1], 0.02, (0.15, 0.0, 0.0)), world.add_plane(None, *FLOOR), rubber)
    fastest, start = 0.0, world.tree(0)[0][0]
    for _ in range(round(0.4 / timestep)):
        world.step()
        fastest = max(fastest, abs(world.tree(0)[1][0]))
    assert damping * fastest < 15.0 * 9.81
    assert damping * world.tree(0)[1][0] == pytest.approx(-14.0 * 9.81, rel=1e-3)
    assert damping * (start - world.tree(0)[0][0]) == pytest.approx(54.92, rel=2e-3)  # by steps of 0.1 ms


@pytest.mark.parametrize("damping", [0.2, 0.5])
def test_a_limb_that_damping_all_but_locks_does_not_shorten_the_substeps_of_an_impact(damping: float) -> None:
    """The impact lasts 10 ms, and damping stops the limb within 0.3 or 0.1 ms, a fifth of a substep."""

    def rebound(substeps: int) -> tuple[float, int]:
        world = World(gravity=0.0, timestep=2e-3, crowd_substeps=substeps)
        limb = Joint("hinge", (-0.05, 0.0, 0.0), damping=damping)
        parts = [Part(1.0, 1e-2, [Joint("slide", axis=(0.0, 0.0, 1.0))]), Part(0.02, 1e-5, [limb], 0, (0.05, 0.0, 0.0))]
        _, bodies = world.add_tree(Tree(parts), [0.021, 0.3], [-1.0, 0.0])
        soft = ContactPair("rubber", "steel", friction=0.8, restitution=0.5)
        world.add_contact(world.add_sphere(bodies[0], 0.02), world.add_plane(None, *FLOOR), soft)
        world.step(40)
        return world.tree(0)[1][0], int(world.arrays.world["kicks"][0])

    (speed, kicks), (exact, _) = rebound(20), rebound(1600)
    assert rebound(10) == (speed, kicks)  # with joints there are at least 20
    assert kicks < 50
    assert speed == pytest.approx(exact, abs=1e-3)


def test_a_limb_that_comes_down_in_the_middle_of_an_impact_touches_in_time() -> None:
    """At first it is too far from the floor to be looked at in each substep."""
    world = World(gravity=0.0, timestep=5e-2)
    parts = [
        Part(1.0, 1e-2, [Joint("slide", axis=(0.0, 0.0, 1.0))]),
        Part(0.02, 1e-5, [Joint("hinge", (-0.05, 0.0, 0.0))], 0, (0.05, 0.0, 0.0)),
    ]
    _, bodies = world.add_tree(Tree(parts), [0.0201, -0.1], [-1.0, 8.0])
    tips = [world.add_sphere(bodies[0], 0.02), world.add_sphere(bodies[1], 0.01, (0.05, 0.0, 0.0))]
    world.add_contact(tips, world.add_plane(None, *FLOOR), ContactPair("rubber", "steel", 0.3, 0.5))
    world.step()
    np.testing.assert_array_equal(world.contacts["touches"], [1, 1])
    assert world.arrays.world["late"][0] == 0
    np.testing.assert_allclose(world.tree(0)[1], [0.489, -8.60], rtol=2e-3)


def test_an_impact_on_a_damped_joint_converges_with_substeps_squared() -> None:
    """Damping takes a third of the speed that the impact of 20 ms leaves."""

    def rebound(substeps: int) -> float:
        world = World(gravity=0.0, timestep=3e-2, substeps=substeps)
        rail = Joint("slide", axis=(0.0, 0.0, 1.0), damping=30.0)
        _, (body,) = world.add_tree(Tree([Part(1.0, 1e-2, [rail])]), [0.021], [-1.0])
        soft = ContactPair("rubber", "steel", friction=0.0, restitution=1.0)
        world.add_contact(world.add_sphere(body, 0.02), world.add_plane(None, *FLOOR), soft)
        world.step()
        return float(world.tree(0)[1][0])

    assert rebound(400) == pytest.approx(rebound(3200), abs=1e-5)


def test_the_bound_on_what_damping_does_to_a_tree_is_no_more_than_twice_that() -> None:
    """Its double substeps an impact of a robot with damped joints."""
    world = World(gravity=0.0, timestep=1e-6)
    parents, mass = [-1, 0, 1, 2, 3, 0, 5, 6, 0], [1.0, 0.3, 0.2, 0.1, 0.05, 0.3, 0.1, 0.05, 0.02]
    parts = [
        Part(m, 1e-3 * m, [Joint("hinge", (-0.1, 0.0, 0.0), damping=0.02 * m)], parent, (0.2, 0.0, 0.0))
        for m, parent in zip(mass, parents, strict=True)
    ]
    world.add_tree(Tree(parts))
    axes = numbers(world.arrays, 0, "axes").view(AXIS)
    world.step()
    n, lower = axes.size, np.eye(axes.size)
    factor, damping = (numbers(world.arrays, 0, name).reshape(n, n) for name in ("factor", "d"))
    for k in range(n):
        row, i = [], k
        while (i := int(axes["parent"][i])) >= 0:
            row.insert(0, i)
        lower[k, row] = factor[k, : len(row)]
    inverse = np.linalg.inv(lower.T @ np.diag(1.0 / axes["inverse"]) @ lower)
    greatest = np.linalg.eigvals(inverse @ damping).real.max()
    for found in (world.arrays.trees["decay"][0], 6.0 * world.arrays.trees["swing"][0]):
        assert greatest <= found <= 2.0 * greatest


def creature(timestep: float, restitution: float = 1.0, gravity: float = 0.0) -> World:
    """A free body with a limb on a ball joint, one on two hinges, and a piston; a ball of steel at each end."""
    arm, inertia = (0.06, 0.0, 0.0), (1e-5, 6e-5, 6e-5)
    back = (-0.06, 0.0, 0.0)
    parts = [
        Part(0.3, (2e-4, 3e-4, 3.5e-4), [Joint("free")]),
        Part(0.1, inertia, [Joint("ball", back)], 0, (0.12, 0.0, 0.0)),
        Part(0.1, inertia, [Joint("hinge", back, (0.0, 1.0, 0.0), 1e-5), Joint("hinge", back, (0.0, 0.0, 1.0), 1e-5)],
             0, (0.0, 0.12, 0.0), (0.8, 0.0, 0.0, 0.6)),
        Part(0.1, inertia, [Joint("slide", axis=(1.0, 0.0, 0.0), armature=0.05)], 2, (0.12, 0.0, 0.0)),
    ]  # fmt: skip
    tree = Tree(parts)
    world = World(gravity=gravity, timestep=timestep)
    rng = np.random.default_rng(3)
    q = tree.start + 0.0
    q[2] = 0.12
    v = np.zeros(tree.v_size) if gravity > 0.0 else 2.0 * rng.normal(size=tree.v_size)
    v[:3] = [0.0, 0.0, -1.0]
    v[-1] = 0.0
    _, bodies = world.add_tree(tree, q, v)
    ends = [world.add_sphere(body, TIP, arm) for body in bodies]
    ends += [world.add_sphere(bodies[0], TIP, at) for at in ((-0.06, 0.06, 0.0), (-0.06, -0.06, 0.0))]
    floor, roof = world.add_plane(None, *FLOOR), world.add_plane(None, (0.0, 0.0, 0.4), (0.0, 0.0, -1.0))
    world.add_contact(ends, [floor, roof], steel_pair(0.3 if gravity > 0.0 else 0.0, restitution))
    return world


@pytest.mark.parametrize("timestep", [1e-3, 5e-3])
def test_a_branching_tree_keeps_its_energy_between_two_planes(timestep: float) -> None:
    world = creature(timestep)
    energy, impacts = world.energy.total, 0
    for _ in range(round(12.0 / timestep)):
        world.step()
        rows = world.contacts
        impacts += int(rows["touches"][~rows["closed"]].sum())
    assert impacts >= 20
    assert world.arrays.world["late"][0] == 0
    assert world.energy.total == pytest.approx(energy, rel=1e-5 * impacts)


def test_a_fast_limb_that_all_but_grazes_a_plane_keeps_its_energy() -> None:
    """So slowly does it come near that conservative advancement does not get there, and it is stepped towards."""
    world = creature(1e-6)
    at = [-0.381877, -1.11354, 0.090226, 0.63157, -0.138391, 0.187442, -0.739481]
    numbers(world.arrays, 0, "q")[:] = [*at, 0.854678, 0.492602, -0.157961, -0.043783, -27.174298, -4.857173, 6.458794]
    numbers(world.arrays, 0, "v")[:] = [
        -0.302273, -0.490711, 0.672507, 14.101544, 25.421195, 18.556549, -16.891523, -43.924928, 31.613276, 31.728013,
        33.980693, 0.388652,
    ]  # fmt: skip
    world.arrays.trees["stale"] = 1
    world.step()
    energy = world.energy.total
    world.timestep = 5e-3
    world.step()
    assert world.arrays.world["kicks"][0] > 0
    assert world.energy.total == pytest.approx(energy, rel=1e-5)


def test_an_arm_that_lies_sleeps_until_it_is_pulled_or_hit() -> None:
    world = arm_over_floor(0.03, 0.1, timestep=2e-3)
    mass = mass_of(RADIUS)
    ball = world.add_body(mass, 0.4 * mass * RADIUS**2, (0.1, 0.0, 20.0))
    world.add_contact(world.add_sphere(ball, RADIUS), 1, steel_pair(0.3, 0.5))
    world.step(250)
    assert world.asleep[0]
    lying, kicks = world.tree(0), world.arrays.world["kicks"][0]
    world.step(100)
    np.testing.assert_array_equal(world.tree(0), lying)
    assert world.arrays.world["kicks"][0] == kicks
    saved = world.save()
    numbers(world.arrays, 0, "f")[0] = -0.3
    world.arrays.trees["stale"] = 1
    world.step(2)
    assert not world.asleep[0] and world.tree(0)[1][0] < -0.1
    world.restore(saved)
    tip = world.position[0] + [0.2 - world.position[0][0], 0.0, 0.0]
    world.place(ball, [tip[0], 0.0, RADIUS + TIP + 5e-3], [0.0, 0.0, -1.0])
    world.step(4)
    assert not world.asleep[0] and world.arrays.world["kicks"][0] > kicks


@pytest.mark.parametrize(("change", "sleeps"), [(4e-15, True), (1e-10, False)])
def test_an_arm_is_not_woken_by_the_rounding_of_the_forces_on_it(change: float, sleeps: bool) -> None:
    world = arm_over_floor(0.03, 0.1, timestep=2e-3)
    force = numbers(world.arrays, 0, "f")
    force[0] = 0.01
    world.arrays.trees["stale"] = 1
    world.step(250)
    assert world.asleep[0]
    before = world.arrays.world["implicit"][0]
    force[0] *= 1.0 + change
    world.arrays.trees["stale"] = 1
    world.step()
    assert (world.arrays.world["implicit"][0] == before) == sleeps


def test_limbs_that_lie_on_the_floor_come_to_rest() -> None:
    world = creature(2e-3, restitution=0.2, gravity=9.81)
    damping, axes = numbers(world.arrays, 0, "d"), numbers(world.arrays, 0, "axes").view(AXIS)
    damping.reshape(axes.size, axes.size)[range(6, axes.size), range(6, axes.size)] = 2e-3
    top = world.energy.total
    for _ in range(1500):
        world.step()
        assert world.energy.total <= top * (1.0 + 1e-9) + 1e-9
        top = min(top, world.energy.total)
    assert np.abs(world.tree(0)[1]).max() < 1e-3


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ([], r"parts = \[\]: must be a sequence of Part, not empty"),
        ([Part(1.0, 1.0, [])], r"joints = \[\] of part 0: must be"),
        ([Part(1.0, 1.0, [Joint("screw")])], "kind = 'screw': must be one of"),
        ([Part(1.0, 1.0, [Joint()], 0)], "parent = 0 of part 0: must be -1, for none, or an earlier part"),
        ([Part(1.0, 1.0, [Joint()]), Part(1.0, 1.0, [Joint("free")], 0)], "free joint behind another"),
        ([Part(-1.0, 1.0, [Joint()])], "mass = -1.0"),
    ],
)
def test_bad_trees_are_named(parts: list[Part], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Tree(parts)


@pytest.mark.parametrize("timestep", [2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3])
def test_what_swings_on_a_sled_that_slides_keeps_its_amplitude(timestep: float) -> None:
    """The sled is slowed by mu g, so that a plumb line on it hangs at atan mu; it turns by 0.17 rad in a long step."""
    length, mu, angle = 5e-3, 0.02, 0.3
    world = World(timestep=timestep)
    sled = Part(50.0, 1.0, [Joint("slide", axis=(1.0, 0.0, 0.0)), Joint("slide", axis=(0.0, 0.0, 1.0))])
    bob = Part(0.3, 1e-9, [Joint("hinge", (0.0, 0.0, length))], 0, (0.0, 0.0, -length))
    _, bodies = world.add_tree(Tree([sled, bob]), [0.0, 0.05, angle], [2.0, 0.0, 0.0])
    world.add_contact(world.add_sphere(bodies[0], 0.05), world.add_plane(None, *FLOOR), steel_pair(mu, 0.5))
    angles = []
    for _ in range(round(1.0 / timestep)):
        world.step()
        angles.append(world.tree(0)[0][2])
    last = angles[-round(0.2 / timestep) :]
    assert 0.5 * np.ptp(last) == pytest.approx(angle + np.arctan(mu), rel=3e-3)


def test_a_tree_that_swings_on_a_sled_converges_by_the_second_order_of_the_step() -> None:
    """A double pendulum, 0.8 and 0.3 rad from the vertical; masses and centripetal terms change within the steps."""

    def end(timestep: float) -> np.ndarray:
        world = World(timestep=timestep)
        sled = Part(1.0, 1.0, [Joint("slide", axis=(1.0, 0.0, 0.0)), Joint("slide", axis=(0.0, 0.0, 1.0))])
        upper = Part(0.5, 1e-3, [Joint("hinge", (0.0, 0.0, 0.1))], 0, (0.0, 0.0, -0.1))
        lower = Part(0.3, 5e-4, [Joint("hinge", (0.0, 0.0, 0.1))], 1, (0.0, 0.0, -0.2))
        _, bodies = world.add_tree(Tree([sled, upper, lower]), [0.0, 0.05 - 3e-6, 0.8, -0.5], [3.0, 0.0, 0.0, 0.0])
        world.add_contact(world.add_sphere(bodies[0], 0.05), world.add_plane(None, *FLOOR), steel_pair(0.2, 0.5))
        world.step(round(0.24 / timestep))
        return world.tree(0)[0]

    exact = end(1e-4)
    errors = [float(np.abs(end(timestep) - exact).max()) for timestep in (2e-3, 4e-3, 8e-3)]
    assert errors[0] < 4e-4  # [rad]
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.15) == errors[2] / errors[1]


@pytest.mark.parametrize("timestep", [1e-3, 4e-3])
def test_a_swing_that_carries_a_box_keeps_its_energy(timestep: float) -> None:
    """A compound pendulum of 0.5 rad: its rate where it is after 2 s, by the energy that it had at rest."""
    world, angle, half, swing, mass = World(timestep=timestep), 0.5, 0.03, 0.3, 0.5
    seat = Part(1.0, 0.01, [Joint("hinge", (0.0, 0.0, swing), (0.0, -1.0, 0.0))], position=(0.0, 0.0, -swing))
    _, (body,) = world.add_tree(Tree([seat]), [angle])
    arm, inertia = swing - 0.01 - half, mass * half**2 * 2.0 / 3.0
    place, turned = (arm * np.sin(angle), 0.0, -arm * np.cos(angle)), (np.cos(angle / 2), 0.0, -np.sin(angle / 2), 0.0)
    box = world.add_box(world.add_body(mass, inertia, place, quaternion=turned), [half] * 3)
    world.add_contact(box, world.add_box(body, (0.15, 0.1, 0.01)), steel_pair(1.5, 0.3))
    world.step(round(2.0 / timestep))
    (now,), (rate,) = world.tree(0)
    gained = 9.81 * (swing + mass * arm) * (np.cos(now) - np.cos(angle))
    kinetic = 0.5 * (0.01 + swing**2 + inertia + mass * arm**2) * rate**2
    assert kinetic == pytest.approx(gained, rel=3e-4)
