"""A humanoid in PyBullet: motors of its spherical joints, and what PyBullet does to them."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import FREE, in_contact, p, pair_of, plane, step

from contactlaw.pybullet_callback import ContactCallback, links_of


def humanoid(client: int) -> tuple[int, ContactCallback, list[int]]:
    """The humanoid of pybullet_data, a quarter of its size, above steel; and its spherical joints."""
    path = pytest.importorskip("pybullet_data").getDataPath() + "/humanoid/humanoid.urdf"
    upright = {"basePosition": [0, 0, 0.882], "baseOrientation": p.getQuaternionFromEuler([0.5 * np.pi, 0, 0])}
    body = p.loadURDF(path, **upright, globalScaling=0.25, physicsClientId=client)
    for link in range(-1, p.getNumJoints(body, client)):
        p.changeDynamics(body, link, physicsClientId=client, **FREE)
    pair = pair_of(friction=0.9, restitution=0.3)
    callback, _ = in_contact(client, links_of(body, client=client), plane(client), pair, gravity=9.81)
    kinds = [p.getJointInfo(body, link, client)[2] for link in range(p.getNumJoints(body, client))]
    for link in (link for link, kind in enumerate(kinds) if kind == p.JOINT_REVOLUTE):
        p.setJointMotorControl2(body, link, p.POSITION_CONTROL, 0, force=400, physicsClientId=client)
    return body, callback, [link for link, kind in enumerate(kinds) if kind == p.JOINT_SPHERICAL]


def test_a_humanoid_stands_on_the_motors_of_its_spherical_joints(client: int) -> None:
    """Without the share of these motors in its contacts it began to sway, and fell after two seconds."""
    body, callback, balls = humanoid(client)
    for link in balls:
        p.setJointMotorControlMultiDof(
            body, link, p.POSITION_CONTROL, [0, 0, 0, 1], targetVelocity=[0, 0, 0], positionGain=0.1, velocityGain=1,
            force=[400] * 3, physicsClientId=client,
        )  # fmt: skip
    step(callback, 720)
    assert abs(p.getBasePositionAndOrientation(body, client)[0][0]) < 2e-3


def test_a_spherical_joint_that_pybullet_has_driven_to_nan_is_an_error_that_tells_how_to_drive_it(client: int) -> None:
    body, callback, balls = humanoid(client)
    for link in balls:
        p.setJointMotorControl2(body, link, p.POSITION_CONTROL, 0, force=400, physicsClientId=client)
    with pytest.raises(ValueError, match=r"spherical joints so: use setJointMotorControlMultiDof"):
        step(callback, 3)
