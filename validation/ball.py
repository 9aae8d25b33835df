"""The steel ball on a plane that the engine cases share; each engine is imported where it is used."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import MATERIALS, ContactPair
from contactlaw.laws import Law

if TYPE_CHECKING:
    import mujoco

RADIUS = 0.0254  # [m]
STEEL = MATERIALS["steel"]
MASS = 4.0 / 3.0 * math.pi * RADIUS**3 * float(STEEL.density or math.nan)  # [kg]
FRICTION, RESTITUTION = 0.115, 0.93  # steel, Maw, Barber & Fawcett (1981)
TANGENTIAL_MASS = MASS / 3.5  # [kg], a solid ball
GRAVITY = 9.81  # [m/s^2]
INTEGRATORS = ("Euler", "implicit", "implicitfast", "RK4")  # MuJoCo's
SUBSTEPS = 100  # the adapters' own default


def steel_pair(law: str | Law = "microslip", restitution: float = RESTITUTION) -> ContactPair:
    """Steel on steel, with the radius of the ball."""
    return ContactPair(STEEL, STEEL, FRICTION, restitution, radius=RADIUS, law=law)


def mujoco_ball(
    timestep: float,
    contact: str,
    pair: ContactPair | None = None,
    *,
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    integrator: str = "Euler",
    substeps: int = SUBSTEPS,
    solref: ArrayLike | None = None,
) -> tuple[mujoco.MjModel, mujoco.MjData, str]:
    """A ball over a floor in MuJoCo.

    Args:
        timestep: [s].
        contact: "law", "law alone": the geoms touch nothing else, "native", or "none": contact is off altogether.
        pair: What the law is told; None: `steel_pair()`.
        gravity: [m/s^2], shape (3,).
        integrator: One of `INTEGRATORS`.
        substeps: What the law is told.
        solref: Stiffness and damping of a native contact; None: the engine's own.

    Returns:
        Model, data, and the name of the contact ("" without one).
    """
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = timestep, np.asarray(gravity, dtype=float)
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    floor = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1])
    body = spec.worldbody.add_body(name="ball", pos=[0.0, 0.0, RADIUS])
    body.add_freejoint()
    ball = body.add_geom(name="ball", size=[RADIUS, 0.0, 0.0], density=STEEL.density)
    name = ""
    if contact.startswith("law"):
        from contactlaw import mujoco_plugin

        others = contact == "law"
        name = mujoco_plugin.add_contact(spec, "ball", "floor", pair or steel_pair(), others=others, substeps=substeps)
    elif contact == "none":
        floor.contype = floor.conaffinity = ball.contype = ball.conaffinity = 0
    elif solref is not None:
        ball.solref, ball.priority, ball.friction = solref, 1, [FRICTION, 0.0, 0.0]
    model = spec.compile()
    return model, mujoco.MjData(model), name


def true_velocity(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Velocities (nv) of free balls at the time of their positions; without gravity or with it alone.

    MuJoCo's semi-implicit integrators keep the velocity of half a step before (Runge-Kutta does not), and the share of
    an impulse that acts in the next step is not in it yet.
    """
    import mujoco

    from contactlaw.mujoco_plugin import owed_velocity

    velocity = data.qvel + owed_velocity(model, data)
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4:
        velocity.reshape(-1, 2, 3)[:, 0] += half_step(model)
    return velocity


def linear_spring(duration: float, restitution: float) -> tuple[float, float]:
    """Stiffness and damping over mass [1/s^2], [1/s] of a linear contact of this duration [s] and restitution."""
    stiffness, rate = (math.pi / duration) ** 2, -math.log(restitution)
    return stiffness, 2.0 * stiffness**0.5 * rate / (rate**2 + math.pi**2) ** 0.5


def half_step(model: mujoco.MjModel) -> np.ndarray:
    """What gravity adds to a velocity in half a step [m/s], shape (3,); zero where the engine's is not behind."""
    import mujoco

    behind = model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4
    return (0.5 * model.opt.timestep if behind else 0.0) * model.opt.gravity


class BulletBall:
    """A ball over a floor in a PyBullet client of its own, without damping.

    Args:
        timestep: [s].
        contact: "law", "native", or "none": contact is off altogether.
        pair: What the law is told; None: `steel_pair()`.
        gravity: [m/s^2], shape (3,).
        substeps: What the law is told.
        left_alone: What the callback is told.
    """

    def __init__(
        self,
        timestep: float,
        contact: str,
        pair: ContactPair | None = None,
        *,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
        substeps: int = SUBSTEPS,
        left_alone: bool = False,
    ) -> None:
        import pybullet as p

        self.engine: Any = p
        self.client = p.connect(p.DIRECT)
        p.setPhysicsEngineParameter(fixedTimeStep=timestep, physicsClientId=self.client)
        p.setGravity(*np.asarray(gravity, dtype=float).tolist(), physicsClientId=self.client)
        floor = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=self.client)
        sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS, physicsClientId=self.client)
        self.floor = p.createMultiBody(0.0, floor, physicsClientId=self.client)
        self.ball = p.createMultiBody(MASS, sphere, basePosition=[0.0, 0.0, RADIUS], physicsClientId=self.client)
        p.changeDynamics(
            self.ball, -1, linearDamping=0.0, angularDamping=0.0, maxJointVelocity=1e6, lateralFriction=FRICTION,
            restitution=RESTITUTION, physicsClientId=self.client,
        )  # fmt: skip
        self.callback = None
        if contact == "law":
            from contactlaw.pybullet_callback import ContactCallback

            self.callback = ContactCallback(self.client, left_alone=left_alone)
            self.handle = self.callback.add_contact(self.ball, self.floor, pair or steel_pair(), substeps=substeps)
        elif contact == "none":
            p.setCollisionFilterPair(self.ball, self.floor, -1, -1, 0, self.client)

    def start(self, height: float, velocity: ArrayLike, spin: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Put the ball at a height over touching [m], with a velocity [m/s] and spin [rad/s]; no contact open."""
        if self.callback is not None:
            self.callback.restore({})
        p = self.engine
        p.resetBasePositionAndOrientation(self.ball, [0.0, 0.0, RADIUS + height], [0, 0, 0, 1], self.client)
        p.resetBaseVelocity(self.ball, list(np.asarray(velocity)), list(np.asarray(spin)), self.client)

    def step(self, count: int) -> None:
        """Step as a user does: the callback, then the engine."""
        simulate, client, callback = self.engine.stepSimulation, self.client, self.callback
        if callback is None:
            for _ in range(count):
                simulate(client)
        else:
            for _ in range(count):
                callback()
                simulate(client)

    @property
    def height(self) -> float:
        """Of the ball over touching [m]."""
        return float(self.engine.getBasePositionAndOrientation(self.ball, self.client)[0][2]) - RADIUS

    @property
    def motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity [m/s] and spin [rad/s] as the engine has them."""
        velocity, spin = self.engine.getBaseVelocity(self.ball, self.client)
        return np.array(velocity), np.array(spin)

    @property
    def true_motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity [m/s] and spin [rad/s] at the time of the position: with what the law still owes."""
        if self.callback is None:
            return self.motion
        velocity, spin = self.callback.velocity(self.ball)
        return np.array(velocity), np.array(spin)

    def close(self) -> None:
        """Leave the client."""
        self.engine.disconnect(self.client)


def energy_of(velocity: np.ndarray, spin: np.ndarray) -> float:
    """Kinetic energy of the ball [J]."""
    return float(0.5 * MASS * velocity @ velocity + 0.2 * MASS * RADIUS**2 * spin @ spin)


def elastic_energy(overlap: float) -> float:
    """Elastic energy of the normal contact of the ball [J]."""
    return 8.0 / 15.0 * steel_pair().effective_modulus * RADIUS**0.5 * max(overlap, 0.0) ** 2.5


def static_overlap() -> float:
    """Of the ball that lies on the floor [m]."""
    return float((MASS * GRAVITY / (4.0 / 3.0 * steel_pair().effective_modulus * RADIUS**0.5)) ** (2.0 / 3.0))
