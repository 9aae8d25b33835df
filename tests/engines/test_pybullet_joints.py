"""Bodies with joints in PyBullet: the model against the engine's own motion, energy, motors, grasps, restarts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from pybullet_scenes import FREE, RADIUS, arm, ball, in_contact, p, paddle, pair_of, plane, shape, step, velocities

from contactlaw import MATERIALS, ContactPair, Material
from contactlaw.pybullet_callback import ContactCallback
from contactlaw.pybullet_callback.trees import Tree
from contactlaw.world import World
from contactlaw.world.trees.tree_records import numbers, write_coordinates
from sims.quadrupeds import ROBOTS, standing
from tests.world.jointed_scenes import mass_matrix

pybullet_data = pytest.importorskip("pybullet_data")
G = 9.81


JOINTS = [
    ("REVOLUTE", "PRISMATIC"),
    ("SPHERICAL", "REVOLUTE"),
    ("FIXED", "REVOLUTE"),
    ("REVOLUTE", "FIXED", "REVOLUTE"),
]


@pytest.mark.parametrize("base_mass", [0.0, 2.0])
@pytest.mark.parametrize("joints", JOINTS)
def test_the_model_moves_as_the_engine_does(client: int, base_mass: float, joints: tuple[str, ...]) -> None:
    """Acceleration in one short step under gravity and a force on the last link, and where the links are."""
    body, dt = arm(client, base_mass, joints), 1e-6
    p.setGravity(1.0, 2.0, -G, client)
    p.setTimeStep(dt, client)
    one, world = Tree(client, [body]), World(gravity=0.0)
    one.add_to(world)
    arrays = world.arrays.bound()
    one.bind(arrays)
    arrays.trees["gravity"] = [1.0, 2.0, -G]
    one.begin_step()
    for _, link in one.links:
        member, (at, _) = one.place_of((body, link))
        own = arrays.bodies[one.first + 1 + member]
        pose = p.getBasePositionAndOrientation(body, client) if link < 0 else p.getLinkState(body, link, 0, 1, client)
        np.testing.assert_allclose(own["position"] + own["axes"].reshape(3, 3) @ at, pose[0], atol=1e-12)
    matrix = mass_matrix(arrays, 0)
    acceleration = one.numbers["free_acceleration"].copy()
    p.stepSimulation(client)
    _, v, _ = map(np.array, one.read())
    np.testing.assert_allclose((v - one.numbers["start_v"]) / dt, acceleration, rtol=1e-6, atol=1e-5)
    one.read_forces(dt)
    np.testing.assert_allclose(one.numbers["matrix"], matrix, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(one.numbers["force"], 0.0, atol=1e-5)
    one.begin_step()
    one.numbers["push"][:] = np.arange(1.0, one.v_size + 1.0)
    one.apply_push()
    p.stepSimulation(client)
    _, v, _ = map(np.array, one.read())
    gained = one.numbers["matrix"] @ ((v - one.numbers["start_v"]) / dt - one.numbers["free_acceleration"])
    np.testing.assert_allclose(gained, one.numbers["push"], atol=1e-4)


@pytest.mark.parametrize("dt", [2e-6, 2e-3, 1 / 240])
@pytest.mark.parametrize("base_mass", [0.0, 2.0])
def test_ball_on_a_hinged_paddle_conserves_energy(client: int, dt: float, base_mass: float) -> None:
    """Elastic and without friction: the energy after is that before to 3e-4, however long the step."""
    racket = paddle(client, base_mass)
    body = ball(client, [0.405, 0.0, 2.0 * RADIUS], [0, 0, -1.0])
    callback, handle = in_contact(client, body, racket, pair_of(restitution=1.0, friction=0.0), link_b=0, dt=dt)
    steps = 3 + int(8e-4 / dt)
    step(callback, steps)
    velocity, spin = velocities(client, body)
    one, world = Tree(client, [racket]), World(gravity=0.0)
    one.add_to(world)
    q, v, _ = map(np.array, one.read())
    write_coordinates(world.arrays.bound(), 0, q, v)
    energy = 0.25 * velocity @ velocity + 0.1 * RADIUS**2 * spin @ spin + 0.5 * v @ mass_matrix(world.arrays, 0) @ v
    assert callback.ledger(handle).impacts == 1
    assert -0.9 < velocity[2] < 0.0
    assert abs(v).max() > 0.1
    assert energy == pytest.approx(0.25, rel=3e-4)


def test_momentum_of_a_free_tree_and_a_ball(client: int) -> None:
    """A ball hits the last link of a free arm: what one gives the other gets."""
    body = arm(client, 2.0, ("REVOLUTE", "SPHERICAL"))
    target = np.array(p.getLinkState(body, 1, 0, 1, client)[4])
    bullet = ball(client, target + [0.0, 0.0, 0.1 + RADIUS + 0.01], [0, 0, -3.0])
    callback, handle = in_contact(client, bullet, body, pair_of(friction=0.0), link_b=1, dt=1e-3)

    one, world = Tree(client, [body]), World(gravity=0.0)
    one.add_to(world)
    arrays = world.arrays.bound()

    def momentum() -> np.ndarray:
        q, v, _ = map(np.array, one.read())
        write_coordinates(arrays, 0, q, v)
        write_coordinates(
            arrays, 0, q, v + 0.5e-3 * numbers(arrays, 0, "a")
        )  # Bullet's are those of half a step before
        return 0.5 * velocities(client, bullet)[0] + world.momentum[0]

    before, steps = momentum(), 0
    while callback.ledger(handle).impacts == 0 and steps < 15:
        step(callback)
        steps += 1
    assert steps < 15
    assert np.linalg.norm(velocities(client, bullet)[0] - [0, 0, -3.0]) > 0.5
    np.testing.assert_allclose(momentum(), before, atol=1e-4)


def press(client: int, callback: ContactCallback, push: Callable[[], None], steps: int) -> None:
    for _ in range(steps):
        push()
        callback.step()


def test_a_motor_presses_a_ball_as_hard_as_its_torque_says(client: int) -> None:
    """A hinged arm presses with a constant torque on a ball that lies on the floor."""
    floor = plane(client)
    body = ball(client, [0.4, 0, RADIUS])
    racket = paddle(client)
    p.resetBasePositionAndOrientation(racket, [0, 0, 3 * RADIUS + 1e-5], [0, 0, 0, 1], client)
    callback, on_floor = in_contact(client, body, floor, pair_of(restitution=0.5, friction=0.5), dt=1 / 240, gravity=G)
    handle = callback.add_contact(body, racket, pair_of(restitution=0.5, friction=0.5), link_b=0)
    torque = 2.0

    def push() -> None:
        p.setJointMotorControl2(racket, 0, p.TORQUE_CONTROL, force=torque, physicsClientId=client)

    press(client, callback, push, 600)
    force = callback.state(handle).force
    weight = 0.3 * G * 0.2
    assert -force[2] * 0.4 == pytest.approx(torque + weight, rel=1e-2)
    assert callback.state(on_floor).force[2] == pytest.approx(-force[2] + 0.5 * G, rel=1e-3)
    assert np.abs(velocities(client, body)[0]).max() < 1e-3


def test_a_position_motor_carries_a_ball(client: int) -> None:
    """A tray on a slide that a motor holds: the ball on it stays, and the motor carries its weight."""
    tray = shape(client, p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.02])
    lift = p.createMultiBody(
        0.0, -1, -1, [0, 0, 0.5],
        linkMasses=[1.0], linkCollisionShapeIndices=[tray], linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 0]],
        linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0], linkJointTypes=[p.JOINT_PRISMATIC],
        linkJointAxis=[[0, 0, 1]], physicsClientId=client,
    )  # fmt: skip
    p.changeDynamics(lift, 0, physicsClientId=client, **FREE)
    p.setJointMotorControl2(lift, 0, p.POSITION_CONTROL, targetPosition=0.0, force=500.0, physicsClientId=client)
    body = ball(client, [0.0, 0.0, 0.52 + RADIUS + 1e-3])
    callback, handle = in_contact(client, body, lift, pair_of(restitution=0.5, friction=0.5), link_b=0, gravity=G)
    step(callback, 1500)
    forces = []
    for _ in range(200):
        step(callback)
        forces.append(callback.state(handle).force[2])
    assert np.mean(forces) == pytest.approx(0.5 * G, rel=1e-3)
    assert np.ptp(forces) < 0.05 * 0.5 * G
    assert p.getBasePositionAndOrientation(body, client)[0][2] == pytest.approx(0.52 + RADIUS, abs=1e-3)


def test_light_fingers_hold_a_soft_ball_with_the_greatest_force_of_their_motors(client: int) -> None:
    """They close fast, are at the limit of their motors as soon as they touch, and neither bounce nor let go."""
    radius, limit, rail = 0.02, 20.0, shape(client, p.GEOM_BOX, halfExtents=[0.01, 0.02, 0.02])
    hand = p.createMultiBody(
        0.0, -1, -1, [0, 0, 1.0], linkMasses=[0.1, 0.1], linkCollisionShapeIndices=[rail, rail],
        linkVisualShapeIndices=[-1, -1], linkPositions=[[-0.05, 0, 0], [0.05, 0, 0]],
        linkOrientations=[[0, 0, 0, 1]] * 2, linkInertialFramePositions=[[0, 0, 0]] * 2,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2, linkParentIndices=[0, 0],
        linkJointTypes=[p.JOINT_PRISMATIC] * 2, linkJointAxis=[[1, 0, 0], [-1, 0, 0]],
        physicsClientId=client,
    )  # fmt: skip
    for link in range(2):
        p.changeDynamics(hand, link, physicsClientId=client, **FREE)
    body = ball(client, [0, 0, 1.0], radius=radius, mass=0.1)
    pair = ContactPair("rubber", "steel", friction=0.8, restitution=0.3)
    callback, handle = in_contact(client, [(hand, 0), (hand, 1)], [(body, -1)], pair, dt=1 / 240)
    forces = []
    for number in range(480):
        p.setJointMotorControlArray(
            hand, [0, 1], p.POSITION_CONTROL, [0.04, 0.04], forces=[limit] * 2, physicsClientId=client
        )
        if number == 120:
            p.setGravity(0, 0, -G, client)
        callback.step()
        forces.append([state.normal_force for state in callback.states(handle)])
    assert max(max(one, default=0.0) for one in forces) < 4.0 * limit
    np.testing.assert_allclose(forces[120:], limit, rtol=2e-3)
    assert abs(p.getBasePositionAndOrientation(body, client)[0][2] - 1.0) < 5e-5


def test_a_restart_is_exact_with_joints(client: int) -> None:
    racket = paddle(client, 2.0)
    body = ball(client, [0.405, 0.0, 2.0 * RADIUS + 2e-3], [0.1, 0, -1.0], [3, 4, 5])
    callback, _ = in_contact(client, body, racket, pair_of(), link_b=0)

    def go(steps: int) -> list:
        step(callback, steps)
        places = [p.getBasePositionAndOrientation(one, client) for one in (body, racket)]
        return [*places, p.getBaseVelocity(body, client), p.getJointState(racket, 0, client)[:2]]

    go(2)
    state, saved = p.saveState(client), callback.save()
    first = go(20)
    p.restoreState(state, physicsClientId=client)
    callback.restore(saved)
    assert go(20) == first
    assert numbers(callback._scene.bodies.arrays, 0, "q").size == 8


@pytest.mark.parametrize("lift", [-0.0075, -0.007])
def test_a_robot_stands_still_on_steel(client: int, lift: float) -> None:
    steel = MATERIALS["steel"]
    pair = ContactPair(steel, steel, friction=0.8, restitution=0.5, radius=0.02)
    robot, contact, _ = standing(client, "a1", pair, lift)
    p.setPhysicsEngineParameter(solverResidualThreshold=0.0, physicsClientId=client)  # else motors stop short of theirs
    fastest = 0.0
    for k in range(1500):
        contact.step()
        if k >= 1000:
            fastest = max(fastest, *np.abs(p.getBaseVelocity(robot, client)[0]))
    assert fastest < 1e-9


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_stands_still_on_the_motors_that_hold_it(client: int, name: str) -> None:
    stiff = Material(1e8, 0.4)
    rubber = ContactPair(stiff, stiff, friction=0.8, restitution=0.5)
    robot, contact, handle = standing(client, name, rubber)
    heights = []
    for _ in range(1500):
        contact.step()
        heights.append(p.getBasePositionAndOrientation(robot, client)[0][2])
    assert np.ptp(heights[1000:]) < 1e-4
    weight = 9.81 * sum(p.getDynamicsInfo(robot, link, client)[0] for link in range(-1, p.getNumJoints(robot, client)))
    assert sum(state.normal_force for state in contact.states(handle)) == pytest.approx(weight, rel=1e-3)


def test_what_presses_on_a_base_with_something_heavy_fixed_to_it_turns_it_as_it_should(client: int) -> None:
    """Held up by a wheel on a hinge, 2 kg fixed 0.2 m off a base of 0.1 kg: the push of each step gives what it is to.

    Were it applied at the centre of both, and not at the base's own, each step would turn the base.
    """
    lump = shape(client, p.GEOM_SPHERE, radius=0.05)
    body = p.createMultiBody(
        0.1, lump, -1, [0, 0, 0.2], linkMasses=[2.0, 0.3], linkCollisionShapeIndices=[lump, lump],
        linkVisualShapeIndices=[-1, -1], linkPositions=[[0.2, 0.05, 0.1], [-0.1, 0, -0.1]],
        linkOrientations=[[0, 0, 0, 1]] * 2, linkInertialFramePositions=[[0, 0, 0]] * 2,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2, linkParentIndices=[0, 0],
        linkJointTypes=[p.JOINT_FIXED, p.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1], [0, 1, 0]], physicsClientId=client,
    )  # fmt: skip
    for link in range(-1, 2):
        p.changeDynamics(body, link, localInertiaDiagonal=[1e-3] * 3, physicsClientId=client, **FREE)
    p.setJointMotorControl2(body, 1, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
    contact, _ = in_contact(client, [(body, link) for link in (-1, 0, 1)], plane(client), pair_of("rubber"))
    contact.step()
    one = contact._scene.bodies.trees[0]
    for k in range(3):
        one.begin_step()
        one.numbers["push"][:] = 10.0 * (np.arange(one.v_size) == k)
        one.apply_push()
        p.stepSimulation(client)
        _, v, _ = map(np.array, one.read())
        gained = (v - one.numbers["start_v"]) * 240.0 - one.numbers["free_acceleration"]
        masses = mass_matrix(contact._scene.bodies.arrays, 0)
        np.testing.assert_allclose(masses @ gained, one.numbers["push"], atol=1e-6)


@pytest.mark.parametrize("name", ["racecar/racecar.urdf", "husky/husky.urdf"])
def test_a_car_that_falls_on_its_wheels_gains_no_energy(client: int, name: str) -> None:
    """Cars of pybullet_data have much that is fixed to their base: one reached sixty times its energy."""
    p.setAdditionalSearchPath(pybullet_data.getDataPath(), client)
    p.setGravity(0, 0, -G, client)
    floor = p.loadURDF("plane.urdf", physicsClientId=client)
    for turn in ((0, 0, 0, 1), (0.36, -0.48, 0.48, 0.64)):
        car = p.loadURDF(name, [0, 0, 0.7], turn, physicsClientId=client)
        links = range(-1, p.getNumJoints(car, client))
        for link in links:
            p.changeDynamics(car, link, physicsClientId=client, **FREE)
        for link in links[1:]:
            p.setJointMotorControl2(car, link, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
        contact = ContactCallback(client)
        shaped = [(car, link) for link in links if p.getCollisionShapeData(car, link, client)]
        contact.add_contact(shaped, floor, ContactPair("rubber", "steel", friction=0.6, restitution=0.5))
        energies = []
        for _ in range(360):
            energies.append(energy_of(client, car))
            contact.step()
        assert max(energies) <= energies[0] * (1.0 + 1e-3)
        p.removeBody(car, client)


def energy_of(client: int, body: int) -> float:
    """Of its motion and its height [J]."""
    total = 0.0
    for link in range(-1, p.getNumJoints(body, client)):
        mass, _, moments = p.getDynamicsInfo(body, link, client)[:3]
        if link < 0:
            (place, turn), (velocity, spin) = (
                p.getBasePositionAndOrientation(body, client),
                p.getBaseVelocity(body, client),
            )
        else:
            place, turn, *_, velocity, spin = p.getLinkState(body, link, 1, 1, client)
        own = np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3).T @ spin
        total += 0.5 * mass * np.dot(velocity, velocity) + 0.5 * own @ (moments * own) + mass * G * place[2]
    return total


def test_what_the_engine_s_own_contact_pushes_into_the_floor_is_not_thrown(client: int) -> None:
    """A ball that Bullet lets strike an arm puts it a millimetre deeper than foreseen: it had 28 times its energy."""
    floor = plane(client)
    capsule, lump = shape(client, p.GEOM_CAPSULE, radius=0.02, height=0.1), shape(client, p.GEOM_SPHERE, radius=0.03)
    body = p.createMultiBody(
        0.5, capsule, -1, [0, 0, 0.35], linkMasses=[0.3] * 2, linkCollisionShapeIndices=[lump] * 2,
        linkVisualShapeIndices=[-1] * 2, linkPositions=[[0.12, 0, 0], [0.12, 0, -0.02]],
        linkOrientations=[[0, 0, 0, 1]] * 2, linkInertialFramePositions=[[0.01, 0, 0]] * 2,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2, linkParentIndices=[0, 1],
        linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[0, 1, 0]] * 2, physicsClientId=client,
    )  # fmt: skip
    striker = p.createMultiBody(0.5, lump, -1, [0.24, 0, 0.5], physicsClientId=client)
    p.changeDynamics(striker, -1, physicsClientId=client, **FREE)
    for link in range(-1, 2):
        p.changeDynamics(body, link, physicsClientId=client, **FREE)
    for link in range(2):
        p.setJointMotorControl2(body, link, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
    p.setTimeStep(1.0 / 240.0, client)
    p.setGravity(0, 0, -G, client)
    callback = ContactCallback(client)
    steel = ContactPair("steel", "steel", friction=0.3, restitution=0.7)
    callback.add_contact([(body, link) for link in range(-1, 2)], floor, steel)
    start = energy_of(client, body) + energy_of(client, striker)
    for _ in range(240):
        step(callback)
        assert energy_of(client, body) + energy_of(client, striker) <= start * (1.0 + 1e-3)


def test_contacts_of_joints_are_saved_and_added_before_the_first_step(client: int) -> None:
    racket, body = paddle(client, 2.0), ball(client, [0.405, 0.0, 2.0 * RADIUS + 2e-3], [0.1, 0, -1.0])
    callback, handle = in_contact(client, body, racket, pair_of(), link_b=0)
    callback.restore(callback.save())
    assert not callback.state(handle).touching
    callback.add_contact(plane(client), body, pair_of())
    step(callback, 3)
    assert callback.ledger(handle).impacts + callback.state(handle).touching > 0


def test_a_joint_that_carries_no_mass_is_refused_before_the_first_step(client: int) -> None:
    """As those are that loadMJCF puts between the links; the mass of a link that is fixed to it counts."""
    body, floor, callback = arm(client, 1.0, ("REVOLUTE", "FIXED", "REVOLUTE")), plane(client), ContactCallback(client)
    p.changeDynamics(body, 0, mass=0.0, physicsClientId=client)
    callback.remove_contact(callback.add_contact(body, floor, pair_of()))
    p.changeDynamics(body, 1, mass=0.0, physicsClientId=client)
    with pytest.raises(ValueError, match=f"body_a = {body}: its link 'link1' has a joint and no mass"):
        callback.add_contact(body, floor, pair_of())
