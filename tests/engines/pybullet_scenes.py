"""PyBullet, and scenes that the tests of its callback share; a test that imports them is skipped where it is not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from contactlaw import MATERIALS, ContactPair

p = pytest.importorskip("pybullet")

from contactlaw.pybullet_callback import ContactCallback  # noqa: E402

RADIUS = 0.0254
UP = np.array([0.0, 0.0, 1.0])
FREE = {"linearDamping": 0.0, "angularDamping": 0.0, "maxJointVelocity": 1e6, "jointDamping": 0.0}
# Material, friction, restitution, approach speed [m/s]: such that the overlap stays below a hundredth of the radius.
CASES = {"steel": (0.115, 0.93, 1.0), "rubber": (2.4, 0.86, 0.05)}


def shape(client: int, kind: int, **size: Any) -> int:
    return p.createCollisionShape(kind, physicsClientId=client, **size)


def plane(client: int) -> int:
    return p.createMultiBody(0.0, shape(client, p.GEOM_PLANE), physicsClientId=client)


def slab(client: int) -> int:
    """A fixed box with its top at z = 0."""
    box = shape(client, p.GEOM_BOX, halfExtents=[1.0, 1.0, 0.1])
    return p.createMultiBody(0.0, box, -1, [0, 0, -0.1], physicsClientId=client)


def ball(
    client: int, place: ArrayLike, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0), *,
    radius: float = RADIUS, mass: float = 0.5, gyration2: float = 0.4,
) -> int:  # fmt: skip
    """A sphere, or a puck cut from one where gyration2 = K^2 is not 2/5."""
    body = p.createMultiBody(
        mass, shape(client, p.GEOM_SPHERE, radius=radius), -1, np.asarray(place, float).tolist(), physicsClientId=client
    )  # fmt: skip
    inertia = [gyration2 * mass * radius**2] * 3
    p.changeDynamics(body, -1, localInertiaDiagonal=inertia, physicsClientId=client, **FREE)
    p.resetBaseVelocity(
        body, np.asarray(velocity, float).tolist(), np.asarray(spin, float).tolist(), physicsClientId=client
    )
    return body


def velocities(client: int, body: int) -> tuple[np.ndarray, np.ndarray]:
    velocity, spin = p.getBaseVelocity(body, client)
    return np.array(velocity), np.array(spin)


def step(callback: ContactCallback, steps: int = 1) -> None:
    for _ in range(steps):
        callback.step()


def pair_of(material: str = "steel", **changes: Any) -> ContactPair:
    mu, e, _ = CASES[material]
    m = MATERIALS[material]
    settings: dict[str, Any] = {"friction": mu, "restitution": e} | changes
    return ContactPair(m, m, **settings)


def in_contact(
    client: int, a: Any, b: Any, pair: ContactPair, *, dt: float | None = None, gravity: float = 0.0, **settings: Any
) -> tuple[ContactCallback, int]:
    """A callback with one contact, and its handle; sets step and gravity where they are given."""
    if dt is not None:
        p.setTimeStep(dt, client)
    if gravity:
        p.setGravity(0, 0, -gravity, client)
    callback = ContactCallback(client)
    return callback, callback.add_contact(a, b, pair, **settings)


def paddle(client: int, base_mass: float = 0.0) -> int:
    """A sphere-headed paddle on a hinge about y, with its head at the end of an arm along x."""
    head = shape(client, p.GEOM_SPHERE, radius=RADIUS, collisionFramePosition=[0.4, 0, 0])
    body = p.createMultiBody(
        base_mass, -1, -1, [0, 0, 0],
        linkMasses=[0.3], linkCollisionShapeIndices=[head], linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 0]],
        linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0.2, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE],
        linkJointAxis=[[0, 1, 0]], physicsClientId=client,
    )  # fmt: skip
    for link in range(-1, 1):
        p.changeDynamics(body, link, localInertiaDiagonal=[1e-4, 2e-4, 3e-4], physicsClientId=client, **FREE)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
    return body


def arm(client: int, base_mass: float, joints: tuple[str, ...], place: Any = (0, 0, 1)) -> int:
    """Bodies in a row with inertial frames that are off and turned, at coordinates that are not zero."""
    lump, turned = shape(client, p.GEOM_SPHERE, radius=0.1), p.getQuaternionFromEuler([0.5, -0.4, 0.8])
    kinds, n = [getattr(p, f"JOINT_{joint}") for joint in joints], len(joints)
    body = p.createMultiBody(
        base_mass, lump, -1, list(place), p.getQuaternionFromEuler([0.1, 0.2, 0.3]), [0.01, 0.02, 0.03], turned,
        linkMasses=[1.0, 0.5, 0.7][:n], linkCollisionShapeIndices=[lump] * n, linkVisualShapeIndices=[-1] * n,
        linkPositions=[[0.2, 0, 0], [0, 0.3, 0], [0.1, 0.1, 0.2]][:n], linkOrientations=[turned] * n,
        linkInertialFramePositions=[[0.05, 0.02, 0.01], [0.1, 0, 0], [0, 0.04, 0]][:n],
        linkInertialFrameOrientations=[turned] * n, linkParentIndices=list(range(n)), linkJointTypes=kinds,
        linkJointAxis=[[0, 1, 0], [0, 0, 1], [1, 0, 0]][:n], physicsClientId=client,
    )  # fmt: skip
    for link in range(-1, n):
        p.changeDynamics(body, link, localInertiaDiagonal=[0.01, 0.02, 0.025], physicsClientId=client, **FREE)
    turn = p.getQuaternionFromEuler([0.3, 0.2, -0.5])
    for link, kind in enumerate(kinds):
        if kind in (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC):
            p.resetJointState(body, link, 0.3, 0.6, physicsClientId=client)
            p.setJointMotorControl2(body, link, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
        elif kind == p.JOINT_SPHERICAL:
            p.resetJointStateMultiDof(body, link, turn, [0.4, -0.3, 0.5], physicsClientId=client)
            p.setJointMotorControlMultiDof(
                body, link, p.POSITION_CONTROL, targetPosition=[0, 0, 0, 1], force=[0, 0, 0], positionGain=0,
                velocityGain=0, physicsClientId=client,
            )  # fmt: skip
    if base_mass > 0.0:
        p.resetBaseVelocity(body, [0.3, -0.2, 0.1], [0.5, 0.4, -0.6], physicsClientId=client)
    return body


def ball_on_plane(
    client: int, dt: float, place: ArrayLike, velocity: ArrayLike = (0, 0, 0), **changes: Any
) -> tuple[int, ContactCallback, int]:
    """A steel ball over a plane under gravity: body, callback, handle."""
    floor, body = plane(client), ball(client, place, velocity)
    return body, *in_contact(client, body, floor, pair_of(**changes), dt=dt, gravity=9.81)
