"""Quadrupeds of pybullet_data that stand on the motors of their joints, by the law and by Bullet's own contact."""

from typing import Any

from contactlaw import ContactPair
from contactlaw.pybullet_callback import ContactCallback

UPRIGHT, LYING_Y = (0.0, 0.0, 0.0, 1.0), (0.0, 0.5, 0.5, 0.0)
ROBOTS = {
    "a1": ("a1/a1.urdf", 0.28, UPRIGHT, [0.0, 0.9, -1.8] * 4),
    "laikago": ("laikago/laikago_toes.urdf", 0.561, LYING_Y, [0.0, -0.7, 0.7] * 4),
    "cheetah": ("mini_cheetah/mini_cheetah.urdf", 0.287, UPRIGHT, [0.0, -0.8, 1.6] * 4),
}
"""File, height of the base [m], how it is turned, angles of the joints [rad]."""
TIMESTEP, TORQUE = 2e-3, 40.0  # [s], and of a motor at most [N m]


def standing(client: int, name: str, pair: ContactPair | None, lift: float = 0.0) -> tuple[int, Any, int]:
    """A robot let go in the pose that its motors hold; its feet touch the floor.

    Args:
        client: Of PyBullet, empty.
        name: One of `ROBOTS`.
        pair: Of feet and floor; None: Bullet's own contact.
        lift: Of the base above its place [m].

    Returns:
        The robot's id, its callback (None without a pair), and the handle of the contact.
    """
    import pybullet as p
    import pybullet_data

    file, height, turn, pose = ROBOTS[name]
    p.setAdditionalSearchPath(pybullet_data.getDataPath(), client)
    p.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
    p.setTimeStep(TIMESTEP, client)
    floor = p.loadURDF("plane.urdf", physicsClientId=client)
    robot = p.loadURDF(file, [0.0, 0.0, height + lift], turn, physicsClientId=client)
    names = {link: p.getJointInfo(robot, link, client) for link in range(p.getNumJoints(robot, client))}
    joints = [link for link, info in names.items() if info[2] != p.JOINT_FIXED]
    for link, place in zip(joints, pose, strict=True):
        p.resetJointState(robot, link, place, physicsClientId=client)
        p.setJointMotorControl2(robot, link, p.POSITION_CONTROL, place, force=TORQUE, physicsClientId=client)
        p.changeDynamics(robot, link, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    if pair is None:
        return robot, None, 0
    feet = [(robot, link) for link, info in names.items() if b"toe" in info[12]]
    contact = ContactCallback(client)
    return robot, contact, contact.add_contact(feet, [floor], pair)
