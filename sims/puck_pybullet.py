"""The puck in PyBullet: a free body without gravity, or one on a table."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from time import perf_counter

import numpy as np
import pybullet

from contactlaw.pybullet_callback import ContactCallback
from sims.puck import Outcome, Puck
from sims.scene import NATIVE_DAMPED

BLOCK = (0.1, 4.0, 0.2)  # half lengths [m]
GRAVITY = 9.81
RIM = 0  # link of the rim where a table is simulated
RIM_MASS = 1e-9  # of the puck's; a link must have some


def simulate(puck: Puck) -> Outcome:
    """Throw the puck."""
    if puck.law == NATIVE_DAMPED:
        raise ValueError(f"law = {puck.law!r}: is MuJoCo's")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body, block = _build(puck, client)
        before_step = _use_native(puck, client, body, block) if puck.law == "native" else ContactCallback(client)
        if isinstance(before_step, ContactCallback):
            rim = RIM if puck.table else -1
            before_step.add_contact(body, block, puck.pair, link_a=rim)
        velocity, spin = puck.start_motion
        pybullet.resetBaseVelocity(body, velocity.tolist(), [0.0, 0.0, spin], physicsClientId=client)
        begin = perf_counter()
        for _ in range(puck.steps):
            before_step()
            pybullet.stepSimulation(client)
        wall_time = perf_counter() - begin
        linear, angular = pybullet.getBaseVelocity(body, client)
    finally:
        pybullet.disconnect(client)
    return Outcome(np.array([linear[0], linear[1], 0.0]), angular[2], wall_time)


def _build(puck: Puck, client: int) -> tuple[int, int]:
    """The puck and the block; both bodies' ids."""
    pybullet.setTimeStep(puck.step, physicsClientId=client)
    pybullet.setGravity(0.0, 0.0, -GRAVITY if puck.table else 0.0, physicsClientId=client)
    turn = pybullet.getQuaternionFromEuler([0.0, 0.0, puck.heading])
    face = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=BLOCK, physicsClientId=client)
    block = pybullet.createMultiBody(0.0, face, -1, (-BLOCK[0] * puck.normal).tolist(), turn, physicsClientId=client)
    ball = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=puck.radius, physicsClientId=client)
    if puck.table:
        body = _on_table(puck, client, ball)
        pybullet.setCollisionFilterPair(body, block, -1, -1, 0, client)  # a soft rim gives by more than it stands out
    else:
        body = pybullet.createMultiBody(puck.mass, ball, -1, puck.start.tolist(), physicsClientId=client)
    pybullet.changeDynamics(
        body, -1, localInertiaDiagonal=[0.6 * puck.inertia, 0.6 * puck.inertia, puck.inertia],
        linearDamping=0.0, angularDamping=0.0, maxJointVelocity=1e6, physicsClientId=client,
    )  # fmt: skip
    return body, block


def _on_table(puck: Puck, client: int, ball: int) -> int:
    """The puck as a slice that rests on a frictionless table; its round rim is a link that does not touch the table."""
    half = 0.5 * puck.thickness
    slab = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[9.0, 9.0, 0.5], physicsClientId=client)
    table = pybullet.createMultiBody(0.0, slab, -1, [0.0, 0.0, -half - 0.5], physicsClientId=client)
    pybullet.changeDynamics(table, -1, lateralFriction=0.0, physicsClientId=client)
    face = pybullet.createCollisionShape(
        pybullet.GEOM_CYLINDER, radius=sqrt(puck.radius**2 - half**2), height=puck.thickness, physicsClientId=client
    )
    upright = [0.0, 0.0, 0.0, 1.0]
    body = pybullet.createMultiBody(
        puck.mass, face, -1, puck.start.tolist(),
        linkMasses=[RIM_MASS * puck.mass], linkCollisionShapeIndices=[ball], linkVisualShapeIndices=[-1],
        linkPositions=[[0.0, 0.0, 0.0]], linkOrientations=[upright], linkInertialFramePositions=[[0.0, 0.0, 0.0]],
        linkInertialFrameOrientations=[upright], linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_FIXED],
        linkJointAxis=[[0, 0, 1]], physicsClientId=client,
    )  # fmt: skip
    pybullet.setCollisionFilterPair(body, table, RIM, -1, 0, client)
    return body


def _use_native(puck: Puck, client: int, body: int, block: int) -> Callable[[], None]:
    """Bullet's own contact with the settings that let it bounce; restitution and friction are products over bodies."""
    pybullet.setPhysicsEngineParameter(
        contactERP=0.0, contactSlop=0.0, restitutionVelocityThreshold=0.0, physicsClientId=client
    )  # fmt: skip
    pybullet.changeDynamics(
        body, -1, restitution=puck.pair.restitution, lateralFriction=puck.pair.friction, rollingFriction=0.0,
        contactProcessingThreshold=0.0, physicsClientId=client,
    )  # fmt: skip
    pybullet.changeDynamics(
        block, -1, restitution=1.0, lateralFriction=1.0, contactProcessingThreshold=0.0, physicsClientId=client
    )
    return lambda: None
