"""Constraints of `createConstraint` hold within a step: what they join answers a contact as joints would make it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pybullet_scenes import FREE, RADIUS, ball, in_contact, p, pair_of, plane, shape

from contactlaw.pybullet_callback import ContactCallback

G = 9.81
BOTH = {p.JOINT_FIXED: p.JOINT_FIXED, p.JOINT_POINT2POINT: p.JOINT_SPHERICAL, p.JOINT_PRISMATIC: p.JOINT_PRISMATIC}
"""Constraints, and the joints that do the same."""


def in_law(client: int, ones: Any, twos: Any) -> ContactCallback:
    return in_contact(client, ones, twos, pair_of(restitution=0.5), dt=1e-3, gravity=G)[0]


def hold(client: int, body: int, place: list[float]) -> int:
    """Fix a body to the world where it is."""
    return p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0] * 3, [0] * 3, place, physicsClientId=client)


@pytest.mark.parametrize("mass", [0.05, 5.0])
@pytest.mark.parametrize("chained", [False, True])
def test_a_held_plate_is_as_heavy_as_what_holds_it(client: int, mass: float, chained: bool) -> None:
    """A ball of 0.5 kg leaves it with the restitution, and then lies still; felt alone, the plate throws it off."""
    box = shape(client, p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.05])
    plate, holder = (p.createMultiBody(m, box, -1, [0, 0, z], physicsClientId=client) for m, z in ((mass, 1), (1, 0.5)))
    hold(client, holder, [0, 0, 0.5])
    if chained:
        places = [0, 0, -0.25], [0, 0, 0.25]
        p.createConstraint(plate, -1, holder, -1, p.JOINT_FIXED, [0, 0, 0], *places, physicsClientId=client)
    else:
        hold(client, plate, [0, 0, 1])
    load = ball(client, [0, 0, 1.051 + RADIUS], [0, 0, -1.0])
    callback, speeds, heights, forces = in_law(client, load, plate), [], [], []
    for _ in range(1500):
        callback.step()
        forces.append(sum(state.force[2] for state in callback.states()))
        speeds.append(p.getBaseVelocity(load, client)[0][2])
        heights.append(p.getBasePositionAndOrientation(load, client)[0][2])
    assert max(speeds[:20]) == pytest.approx(0.5 * np.hypot(1.0, np.sqrt(0.002 * G)), rel=0.02)
    assert np.ptp(heights[-100:]) < 1e-6
    assert np.mean(forces[-100:]) == pytest.approx(0.5 * G, rel=1e-6)


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_a_light_plate_that_is_held_gives_back_no_more_than_the_restitution(client: int, restitution: float) -> None:
    """By momentum and restitution, with its 10,000fold inertia: with 1 g it had given 0.78 for 0.5, and 1.005 for 1."""
    box = shape(client, p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.01])
    plate = p.createMultiBody(1e-3, box, -1, [0, 0, 0], physicsClientId=client)
    hold(client, plate, [0, 0, 0])
    load = ball(client, [0, 0, 0.0103 + RADIUS], [0, 0, -1.0])
    callback = in_contact(client, load, plate, pair_of(friction=0.0, restitution=restitution), dt=1e-3)[0]
    callback.step()
    ones, twos = (p.getBaseVelocity(body, client)[0][2] for body in (load, plate))
    assert ones - twos == pytest.approx(restitution, abs=3e-4)


def bodies(client: int, constraint: int, joined: bool) -> list[tuple[int, int]]:
    """Two balls on a rod with a joint of one body in its middle, or a constraint of two bodies; askew, and turning."""
    turn = p.getQuaternionFromEuler((0.0, 0.5, 0.0))
    start = np.array([0.0, 0.0, 0.25])
    one = shape(client, p.GEOM_SPHERE, radius=RADIUS)
    spin, middle = np.array([0.0, 3.0, 2.0]), [0.15, 0.0, 0.0]
    if joined:
        two = shape(client, p.GEOM_SPHERE, radius=RADIUS, collisionFramePosition=middle)
        body = p.createMultiBody(
            1.0, one, -1, start.tolist(), turn, linkMasses=[0.2], linkCollisionShapeIndices=[two],
            linkVisualShapeIndices=[-1], linkPositions=[middle], linkOrientations=[[0, 0, 0, 1]],
            linkInertialFramePositions=[middle], linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
            linkJointTypes=[BOTH[constraint]], linkJointAxis=[[1, 0, 0]], physicsClientId=client,
        )  # fmt: skip
        if constraint == p.JOINT_POINT2POINT:
            off = {"targetPosition": [0, 0, 0, 1], "positionGain": 0, "velocityGain": 0, "force": [0, 0, 0]}
            p.setJointMotorControlMultiDof(body, 0, p.POSITION_CONTROL, physicsClientId=client, **off)
        elif constraint == p.JOINT_PRISMATIC:
            p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
        ends = [(body, -1), (body, 0)]
    else:
        arm = np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3) @ [0.3, 0.0, 0.0]
        places = [start, start + arm]
        ends = [
            (p.createMultiBody(m, one, -1, x.tolist(), turn, physicsClientId=client), -1)
            for m, x in zip((1.0, 0.2), places, strict=True)
        ]
        far = [-0.15, 0.0, 0.0]
        p.createConstraint(
            ends[0][0], -1, ends[1][0], -1, constraint, [1, 0, 0], middle, far, physicsClientId=client
        )  # fmt: skip
        p.resetBaseVelocity(ends[1][0], np.cross(spin, arm).tolist(), spin.tolist(), physicsClientId=client)
    p.resetBaseVelocity(ends[0][0], [0, 0, 0], spin.tolist(), physicsClientId=client)
    for body, link in ends:
        p.changeDynamics(body, link, physicsClientId=client, **FREE)
    return ends


@pytest.mark.parametrize(
    ("constraint", "error"), [(p.JOINT_FIXED, 1e-3), (p.JOINT_POINT2POINT, 1e-3), (p.JOINT_PRISMATIC, 6e-3)]
)
def test_a_constraint_is_as_a_joint(client: int, constraint: int, error: float) -> None:
    """Two balls fall and bounce as if they were one body with that joint."""
    paths = []
    for joined in (True, False):
        p.resetSimulation(client)
        floor, ends = plane(client), bodies(client, constraint, joined)
        callback, path = in_law(client, ends, [(floor, -1)]), []
        for _ in range(300):
            callback.step()
            path.append(p.getBasePositionAndOrientation(ends[0][0], client)[0])
        callback.remove_all()
        paths.append(path)
    np.testing.assert_allclose(paths[1], paths[0], atol=error)


@pytest.mark.parametrize("ratio", [-1.0, 2.0])
def test_a_gear_shares_the_impact(client: int, ratio: float) -> None:
    """A ball falls on one of two arms with v1 + ratio v2 = 0, which then is as heavy as I (1 + 1/ratio^2)."""
    speeds = []
    for geared in (True, False):
        p.resetSimulation(client)
        mass = 1.0 if geared else 1.0 + 1.0 / ratio**2
        bar = shape(client, p.GEOM_BOX, halfExtents=[0.02, 0.2, 0.02])
        arms = p.createMultiBody(
            0.0, -1, -1, [0, 0, 1], linkMasses=[mass] * 2, linkCollisionShapeIndices=[bar] * 2,
            linkVisualShapeIndices=[-1] * 2, linkPositions=[[0, 0, 0], [1, 0, 0]], linkOrientations=[[0, 0, 0, 1]] * 2,
            linkInertialFramePositions=[[0, 0, 0]] * 2, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
            linkParentIndices=[0, 0], linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[1, 0, 0]] * 2,
            physicsClientId=client,
        )  # fmt: skip
        for link in range(2):
            p.setJointMotorControl2(arms, link, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
            p.changeDynamics(arms, link, physicsClientId=client, **FREE)
        if geared:
            gear = p.createConstraint(
                arms, 0, arms, 1, p.JOINT_GEAR, [1, 0, 0], [0] * 3, [0] * 3, physicsClientId=client
            )  # fmt: skip
            p.changeConstraint(gear, gearRatio=ratio, maxForce=1e4, physicsClientId=client)
        load = ball(client, [0, 0.15, 1.021 + RADIUS], [0, 0, -1.0])
        callback = in_law(client, (load,), [(arms, 0)])
        for _ in range(10):
            callback.step()
        speeds.append((p.getBaseVelocity(load, client)[0][2], p.getJointState(arms, 0, client)[1]))
    np.testing.assert_allclose(speeds[0], speeds[1], rtol=2e-3)


def test_what_a_constraint_grasps_and_lets_go_under_way(client: int) -> None:
    """A light block is lifted off the floor, pressed on it, and let go: as heavy as its gripper, then by itself."""
    floor = plane(client)
    block, hand = (
        p.createMultiBody(
            m, shape(client, p.GEOM_BOX, halfExtents=[0.05] * 3), -1, [0, 0, z], physicsClientId=client
        ) for m, z in ((0.02, 0.05), (2.0, 0.2))
    )  # fmt: skip
    callback, forces, heights = in_law(client, block, floor), [], []
    held = hold(client, hand, [0, 0, 0.2])
    grip = None
    for number in range(1500):
        if number == 300:
            grip = p.createConstraint(
                block, -1, hand, -1, p.JOINT_FIXED, [0] * 3, [0, 0, 0.075], [0, 0, -0.075], physicsClientId=client
            )
        if 300 < number < 600:  # up by 60 mm, and down again
            p.changeConstraint(held, [0, 0, 0.2 + 0.06 * np.sin(np.pi * (number - 300) / 300)], physicsClientId=client)
        if number == 700:
            p.removeConstraint(held, client)
        if number == 1200:
            p.removeConstraint(grip, client)
            p.resetBasePositionAndOrientation(hand, [1, 0, 1], [0, 0, 0, 1], client)
        callback.step()
        forces.append(sum(state.force[2] for state in callback.states()))
        heights.append(p.getBasePositionAndOrientation(block, client)[0][2])
    assert max(heights) == pytest.approx(0.11, abs=2e-3)
    assert np.mean(forces[1100:1200]) == pytest.approx(2.02 * G, rel=1e-3)
    assert np.mean(forces[1400:]) == pytest.approx(0.02 * G, rel=1e-3)
    assert np.ptp(heights[900:]) < 1e-4


def test_a_constraint_presses_with_no_more_than_its_greatest_force(client: int) -> None:
    """A box that is lowered to 0.1 mm below the surface of the floor, and then dragged over it."""
    floor = plane(client)
    box = p.createMultiBody(
        1.0, shape(client, p.GEOM_BOX, halfExtents=[0.05] * 3), -1, [0, 0, 0.06], physicsClientId=client
    )
    callback, most, forces = in_law(client, box, floor), 100.0, []
    held = p.createConstraint(
        box, -1, -1, -1, p.JOINT_POINT2POINT, [0] * 3, [0] * 3, [0, 0, 0.06], physicsClientId=client
    )
    for number in range(800):
        place = [1e-4 * max(number - 500, 0), 0, max(0.06 - 5e-5 * number, 0.0499)]
        p.changeConstraint(held, place, maxForce=most, physicsClientId=client)
        callback.step()
        forces.append(sum(state.force[2] for state in callback.states()))
    np.testing.assert_allclose(forces[250:], most + G, rtol=1e-3)
    assert p.getBasePositionAndOrientation(box, client)[0][0] == pytest.approx(place[0], abs=1e-3)
