"""A trial inside an engine, with the law, with its own contact, or with the law evaluated but once a step."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from functools import cache
from math import sqrt
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from contactlaw import LAWS
from sims.panel import ENGINE_NAMES as TITLES
from validation.ball import linear_spring, true_velocity
from validation.once_a_step import OnceAStep
from validation.stability_trials import MASS, RADIUS, Trial

Array = NDArray[np.float64]

ENGINES = tuple(TITLES)
SUB_CYCLED = tuple(LAWS)[::-1]
ONCE, NATIVE, STIFF = "microslip, once a step", "native", "native, as stiff"
WAYS = (*SUB_CYCLED, ONCE, NATIVE, STIFF)
"""The laws, sub-cycled; microslip as a discrete-element code would have it; the engine's own contact, as a user has it
who sets friction (and in PyBullet restitution), and with a spring and damper of the contact's duration and
restitution."""


class World(Protocol):
    """A trial in an engine."""

    def step(self, count: int) -> None:
        """Go on."""
        ...

    def motion(self) -> tuple[Array, Array, Array]:
        """Places, and velocities and spins at the time of the places, shape (n, 3) each."""
        ...

    def broken(self) -> bool:
        """Whether the engine itself says that something went wrong."""
        ...


def world(engine: str, trial: Trial, way: str) -> World:
    """The trial in an engine."""
    return (MujocoWorld if engine == "mujoco" else BulletWorld)(trial, way)


def kept(trial: Trial) -> Array:
    """Velocities as semi-implicit engines keep them, of half a step before the places [m/s], shape (n, 3)."""
    return trial.velocities - 0.5 * trial.step * trial.gravity


class MujocoWorld:
    """In MuJoCo."""

    def __init__(self, trial: Trial, way: str) -> None:
        import mujoco

        self.engine: Any = mujoco
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = trial.step, trial.gravity
        planes = [
            spec.worldbody.add_geom(name=f"plane{number}", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1],
                                    pos=point, quat=_turn(normal))
            for number, (point, normal) in enumerate(trial.planes)
        ]  # fmt: skip
        balls = []
        for number, (place, mass, inertia) in enumerate(zip(trial.places, trial.masses, trial.inertias, strict=True)):
            body = spec.worldbody.add_body(
                pos=place, mass=mass, inertia=[inertia] * 3, ipos=[0.0, 0.0, 0.0], explicitinertial=True
            )
            body.add_freejoint()
            balls.append(body.add_geom(name=f"ball{number}", size=[RADIUS, 0.0, 0.0], mass=0.0))
        self.once = None
        if way in LAWS:
            from contactlaw.mujoco_plugin import add_contact

            names = [ball.name for ball in balls]
            spec.compile()  # bodies are numbered
            add_contact(spec, names, [*names, *(plane.name for plane in planes)], trial.pair(way), others=False)
        else:
            for geom in [*planes, *balls]:
                geom.friction, geom.condim = [trial.made["friction"], 0.0, 0.0], 3
                if way == ONCE:
                    geom.contype = geom.conaffinity = 0
                if way == STIFF:
                    geom.solref = [-value for value in linear_spring(trial.contact, trial.made["restitution"])]
            self.once = OnceAStep(trial) if way == ONCE else None
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        speeds = self.data.qvel.reshape(-1, 2, 3)
        speeds[:, 0], speeds[:, 1] = kept(trial), trial.spins

    def step(self, count: int) -> None:
        """Go on."""
        if self.once is None:
            self.engine.mj_step(self.model, self.data, count)
            return
        for _ in range(count):
            self.data.xfrc_applied[1:] = self.once.push(*self._motion(self.data.qvel))
            self.engine.mj_step(self.model, self.data)

    def motion(self) -> tuple[Array, Array, Array]:
        """As `World` has it."""
        return self._motion(true_velocity(self.model, self.data))

    def _motion(self, velocity: Array) -> tuple[Array, Array, Array]:
        speeds, places = velocity.reshape(-1, 2, 3), self.data.qpos.reshape(-1, 7)
        spins = np.empty_like(speeds[:, 1])
        for number, (place, spin) in enumerate(zip(places, speeds[:, 1], strict=True)):
            self.engine.mju_rotVecQuat(spins[number], spin, place[3:])
        return places[:, :3].copy(), speeds[:, 0].copy(), spins

    def broken(self) -> bool:
        """Whether the state was reset."""
        return bool(self.data.warning.number.any())


class BulletWorld:
    """In PyBullet."""

    def __init__(self, trial: Trial, way: str) -> None:
        p, client = _bullet()
        self.engine, self.client, self.trial = p, client, trial
        p.resetSimulation(client)
        p.setPhysicsEngineParameter(fixedTimeStep=trial.step, physicsClientId=client)
        p.setGravity(*trial.gravity.tolist(), physicsClientId=client)
        flat = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=client)
        round_ = p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS, physicsClientId=client)
        planes = [
            p.createMultiBody(0.0, flat, basePosition=point, baseOrientation=np.roll(_turn(normal), -1).tolist(),
                              physicsClientId=client)
            for point, normal in trial.planes
        ]  # fmt: skip
        self.balls = [
            p.createMultiBody(float(mass), round_, basePosition=place.tolist(), physicsClientId=client)
            for mass, place in zip(trial.masses, trial.places, strict=True)
        ]
        # Bullet multiplies friction and restitution of two bodies
        native = {"lateralFriction": sqrt(trial.made["friction"]), "restitution": sqrt(trial.made["restitution"])}
        if way == STIFF:
            stiffness, damping = (MASS * value for value in linear_spring(trial.contact, trial.made["restitution"]))
            native = {"lateralFriction": native["lateralFriction"], "contactStiffness": stiffness,
                      "contactDamping": damping}  # fmt: skip
        for body in [*planes, *self.balls]:
            p.changeDynamics(body, -1, **native, physicsClientId=client)
        for ball, inertia in zip(self.balls, trial.inertias, strict=True):
            p.changeDynamics(
                ball, -1, linearDamping=0.0, angularDamping=0.0, maxJointVelocity=1e12,
                localInertiaDiagonal=[float(inertia)] * 3, physicsClientId=client,
            )  # fmt: skip
        for ball, velocity, spin in zip(self.balls, kept(trial), trial.spins, strict=True):
            p.resetBaseVelocity(ball, velocity.tolist(), spin.tolist(), client)
        self.callback, self.once = None, None
        if way in LAWS:
            from contactlaw.pybullet_callback import ContactCallback

            self.callback = ContactCallback(client)
            self.callback.add_contact(self.balls, [*self.balls, *planes], trial.pair(way))
        elif way == ONCE:
            self.once = OnceAStep(trial)
            for ball in self.balls:
                for other in [*self.balls, *planes]:
                    p.setCollisionFilterPair(ball, other, -1, -1, 0, client)

    def step(self, count: int) -> None:
        """Go on."""
        p, client = self.engine, self.client
        for _ in range(count):
            if self.callback is not None:
                self.callback()
            elif self.once is not None:
                places, velocities, spins = self._motion()
                for ball, place, push in zip(
                    self.balls, places.tolist(), self.once.push(places, velocities, spins).tolist(), strict=True
                ):
                    p.applyExternalForce(ball, -1, push[:3], place, p.WORLD_FRAME, client)
                    p.applyExternalTorque(ball, -1, push[3:], p.WORLD_FRAME, client)
            p.stepSimulation(client)

    def motion(self) -> tuple[Array, Array, Array]:
        """As `World` has it."""
        places, velocities, spins = self._motion()
        if self.callback is not None:
            speeds = np.array([self.callback.velocity(ball) for ball in self.balls])
            velocities, spins = speeds[:, 0], speeds[:, 1]
        else:
            velocities = velocities + 0.5 * self.trial.step * self.trial.gravity
        return places, velocities, spins

    def _motion(self) -> tuple[Array, Array, Array]:
        p, client = self.engine, self.client
        places = np.array([p.getBasePositionAndOrientation(ball, client)[0] for ball in self.balls])
        speeds = np.array([p.getBaseVelocity(ball, client) for ball in self.balls])
        return places, speeds[:, 0], speeds[:, 1]

    def broken(self) -> bool:
        """It never says so."""
        return False


@cache
def _bullet() -> tuple[Any, int]:
    """The module, and a client for all trials."""
    import pybullet as p

    return p, p.connect(p.DIRECT)


def _turn(normal: tuple[float, float, float]) -> Array:
    """Quaternion (w, x, y, z) that brings the z axis to a unit vector."""
    x, y, z = normal
    if z < -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + z, -y, x, 0.0])
    return turn / np.linalg.norm(turn)
