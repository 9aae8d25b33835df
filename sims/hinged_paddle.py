"""A ball and a paddle on a hinge in either engine: an example of the law on a body with joints.

The hinge's axis is y, through the origin; the paddle stands up from it with its face in the plane x = 0, so that the
point that the ball meets moves along the face's normal alone. The joint has no limit, motor or damping.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array

State = tuple[Array, Array, Array, Array, float, float]
"""Of the ball: position, rotation, true velocity, true spin; of the joint: angle [rad], true rate [rad/s]."""


@dataclass(frozen=True)
class Setup:
    """What is simulated.

    Attributes:
        pair: Ball and paddle.
        radius, mass, inertia: Of the ball [m], [kg], [kg m^2].
        position, velocity, spin: Of the ball at the start.
        half_sizes: Of the paddle [m]; the first across its face.
        height: Of the paddle's centre over the hinge [m].
        paddle_mass: [kg].
        armature: Inertia of the joint besides the paddle's [kg m^2].
        timestep: [s].
    """

    pair: ContactPair
    radius: float
    mass: float
    inertia: float
    position: Array
    velocity: Array
    spin: Array
    half_sizes: tuple[float, float, float]
    height: float
    paddle_mass: float
    armature: float
    timestep: float

    @property
    def centre(self) -> Array:
        """Of the paddle [m]."""
        return np.array([-self.half_sizes[0], 0.0, self.height])

    @property
    def moments(self) -> Array:
        """Of the paddle about its centre [kg m^2], shape (3,)."""
        squares = np.square(self.half_sizes)
        return self.paddle_mass / 3.0 * (squares.sum() - squares)

    @property
    def hinge_inertia(self) -> float:
        """About the hinge [kg m^2]."""
        return float(self.armature + self.moments[1] + self.paddle_mass * self.centre @ self.centre)


def in_mujoco(setup: Setup, count: int) -> Iterator[State]:
    """Simulate in MuJoCo: the state at the start and after each of a number of steps."""
    import mujoco

    from contactlaw import mujoco_plugin
    from sims.worlds.mujoco_world import true_velocity

    engine: Any = mujoco
    spec = engine.MjSpec()
    spec.option.timestep, spec.option.gravity = setup.timestep, [0.0, 0.0, 0.0]
    paddle = spec.worldbody.add_body(name="paddle", explicitinertial=True)
    paddle.mass, paddle.inertia, paddle.ipos = setup.paddle_mass, setup.moments, setup.centre
    paddle.add_joint(type=engine.mjtJoint.mjJNT_HINGE, axis=[0.0, 1.0, 0.0], armature=setup.armature)
    paddle.add_geom(name="face", type=engine.mjtGeom.mjGEOM_BOX, size=setup.half_sizes, pos=setup.centre)
    ball = spec.worldbody.add_body(name="ball", pos=setup.position, explicitinertial=True)
    ball.mass, ball.inertia, ball.ipos = setup.mass, [setup.inertia] * 3, [0.0, 0.0, 0.0]
    ball.add_freejoint()
    ball.add_geom(name="ball", size=[setup.radius, 0.0, 0.0])
    mujoco_plugin.add_contact(spec, "ball", "face", setup.pair)
    model = spec.compile()
    data = engine.MjData(model)
    data.qvel[1:] = [*setup.velocity, *setup.spin]
    for number in range(count + 1):
        if number:
            engine.mj_step(model, data)
        engine.mj_kinematics(model, data)
        engine.mj_comPos(model, data)
        rates = true_velocity(model, data)
        turn = data.body("ball").xmat.reshape(3, 3).copy()
        yield data.qpos[1:4].copy(), turn, rates[1:4], turn @ rates[4:], float(data.qpos[0]), float(rates[0])


def in_pybullet(setup: Setup, count: int) -> Iterator[State]:
    """The same in PyBullet, whose joints have no armature: it is added to the paddle's own inertia."""
    import pybullet as p

    from contactlaw.pybullet_callback import ContactCallback

    client = p.connect(p.DIRECT)
    try:
        p.setTimeStep(setup.timestep, physicsClientId=client)
        face = p.createCollisionShape(p.GEOM_BOX, halfExtents=setup.half_sizes, physicsClientId=client,
                                      collisionFramePosition=setup.centre.tolist())  # fmt: skip
        upright = [0.0, 0.0, 0.0, 1.0]
        paddle = p.createMultiBody(
            0.0, -1, -1, [0.0, 0.0, 0.0],
            linkMasses=[setup.paddle_mass], linkCollisionShapeIndices=[face], linkVisualShapeIndices=[-1],
            linkPositions=[[0.0, 0.0, 0.0]], linkOrientations=[upright],
            linkInertialFramePositions=[setup.centre.tolist()], linkInertialFrameOrientations=[upright],
            linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0.0, 1.0, 0.0]],
            physicsClientId=client,
        )  # fmt: skip
        free = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0, "maxJointVelocity": 1e6}
        moments = (setup.moments + [0.0, setup.armature, 0.0]).tolist()
        p.changeDynamics(paddle, 0, physicsClientId=client, **free)
        p.changeDynamics(paddle, 0, localInertiaDiagonal=moments, physicsClientId=client)  # joint damping undoes it
        p.setJointMotorControl2(paddle, 0, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=setup.radius, physicsClientId=client)
        ball = p.createMultiBody(setup.mass, sphere, -1, setup.position.tolist(), physicsClientId=client)
        p.changeDynamics(ball, -1, localInertiaDiagonal=[setup.inertia] * 3, physicsClientId=client, **free)
        p.resetBaseVelocity(ball, setup.velocity.tolist(), setup.spin.tolist(), physicsClientId=client)
        contact = ContactCallback(client)
        contact.add_contact(ball, paddle, setup.pair, link_b=0)
        for number in range(count + 1):
            if number:
                contact.step()
            place, turn = p.getBasePositionAndOrientation(ball, client)
            matrix = np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3)
            angle, rate = p.getJointState(paddle, 0, physicsClientId=client)[:2]
            velocity, spin = p.getBaseVelocity(ball, client)
            yield np.array(place), matrix, np.array(velocity), np.array(spin), angle, rate
    finally:
        p.disconnect(client)


ENGINES = {"mujoco": in_mujoco, "pybullet": in_pybullet}
