"""Steel balls in free flight that touch each other by the law, in either engine."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import ContactPair
from validation.ball import MASS, RADIUS, STEEL, true_velocity

Array = NDArray[np.float64]


class MujocoBalls:
    """Equal free balls without gravity in MuJoCo.

    Args:
        timestep: [s].
        pair: What the law is told.
        places: Centres [m], shape (n, 3).
        velocities, spins: [m/s], [rad/s], world frame, shape (n, 3).
        integrator: One of `INTEGRATORS`.
    """

    def __init__(
        self, timestep: float, pair: ContactPair, places: ArrayLike, velocities: ArrayLike,
        spins: ArrayLike | None = None, integrator: str = "Euler",
    ) -> None:  # fmt: skip
        import mujoco

        from contactlaw.mujoco_plugin import add_contact

        self._engine = mujoco
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = timestep, np.zeros(3)
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        names = []
        for number, place in enumerate(np.asarray(places, dtype=float)):
            body = spec.worldbody.add_body(pos=place)
            body.add_freejoint()
            names.append(f"ball{number}")
            body.add_geom(name=names[-1], size=[RADIUS, 0.0, 0.0], density=STEEL.density)
        spec.compile()  # bodies are numbered
        self.name = add_contact(spec, names, names, pair, others=False)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        speeds = self.data.qvel.reshape(-1, 2, 3)
        speeds[:, 0], speeds[:, 1] = velocities, 0.0 if spins is None else spins

    def step(self, count: int) -> None:
        """Go on."""
        self._engine.mj_step(self.model, self.data, count)

    def busy(self) -> bool:
        """Whether a contact is open or something owed."""
        from contactlaw.mujoco_plugin import contacts_of

        return bool(contacts_of(self.model, self.data, self.name))

    def motion(self) -> tuple[Array, Array, Array]:
        """Places, true velocities and spins in the world frame, shape (n, 3) each."""
        self._engine.mj_kinematics(self.model, self.data)
        self._engine.mj_comPos(self.model, self.data)
        speeds = true_velocity(self.model, self.data).reshape(-1, 2, 3)
        axes = self.data.xmat[1:].reshape(-1, 3, 3)
        return self.data.xipos[1:].copy(), speeds[:, 0], np.einsum("nij,nj->ni", axes, speeds[:, 1])

    def close(self) -> None:
        """Nothing to do."""


class BulletBalls:
    """The same in a PyBullet client of its own."""

    def __init__(
        self, timestep: float, pair: ContactPair, places: ArrayLike, velocities: ArrayLike,
        spins: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        import pybullet as p

        from contactlaw.pybullet_callback import ContactCallback

        self._engine: Any = p
        self._client = p.connect(p.DIRECT)
        p.setPhysicsEngineParameter(fixedTimeStep=timestep, physicsClientId=self._client)
        p.setGravity(0.0, 0.0, 0.0, physicsClientId=self._client)
        sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS, physicsClientId=self._client)
        self._callback = ContactCallback(self._client)
        self._balls = []
        turning = np.zeros((len(np.asarray(places)), 3)) if spins is None else np.asarray(spins, dtype=float)
        for place, velocity, spin in zip(
            np.asarray(places, dtype=float), np.asarray(velocities, dtype=float), turning, strict=True
        ):
            ball = p.createMultiBody(MASS, sphere, basePosition=place.tolist(), physicsClientId=self._client)
            p.changeDynamics(
                ball, -1, linearDamping=0.0, angularDamping=0.0, maxJointVelocity=1e6, physicsClientId=self._client
            )
            p.resetBaseVelocity(ball, velocity.tolist(), spin.tolist(), self._client)
            self._balls.append(ball)
        self._callback.add_contact(self._balls, self._balls, pair)

    def step(self, count: int) -> None:
        """Go on."""
        for _ in range(count):
            self._callback()
            self._engine.stepSimulation(self._client)

    def motion(self) -> tuple[Array, Array, Array]:
        """Places, true velocities and spins in the world frame, shape (n, 3) each."""
        places = [self._engine.getBasePositionAndOrientation(ball, self._client)[0] for ball in self._balls]
        speeds = np.array([self._callback.velocity(ball) for ball in self._balls])
        return np.array(places), speeds[:, 0], speeds[:, 1]

    def close(self) -> None:
        """Leave the client."""
        self._engine.disconnect(self._client)
