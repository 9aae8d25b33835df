"""Elliptic contacts inside both engines rebound by direction as in a world alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.world.world_scenes import steel_pair
from validation.cases.elliptic import CROSSED, ELLIPSOIDS, FRICTION, MASS, SPEED, impact

PSI = np.array([0.9, 0.9])  # askew
NAME, GAP, STEPS = next(iter(ELLIPSOIDS)), 1e-9, 5


def test_an_ellipsoid_in_mujoco() -> None:
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    half, pair = ELLIPSOIDS[NAME], steel_pair(FRICTION)
    below, inertia = half[2], 0.4 * MASS * half[2] ** 2
    model = load_model(
        f"""<mujoco><option timestep="1e-3" gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="1 1 .1"/>
        <body pos="0 0 {below + GAP!r}"><freejoint/>
        <geom name="thing" type="ellipsoid" size="{half[0]} {half[1]} {below}"/>
        <inertial pos="0 0 0" mass="{MASS}" diaginertia="{inertia} {inertia} {inertia}"/></body>
        </worldbody></mujoco>""",
        [("thing", "floor", pair)],
    )
    data, unit = mujoco.MjData(model), FRICTION / pair.kappa * SPEED
    data.qvel[:3] = *(unit * PSI), -SPEED
    mujoco.mj_step(model, data, STEPS)
    v, w = data.qvel[:3], data.qvel[3:]
    assert v[2] == pytest.approx(SPEED, rel=1e-3)
    found = np.array([v[0] - below * w[1], v[1] + below * w[0]]) / unit
    np.testing.assert_allclose(found, impact(NAME, PSI), atol=1e-3)


def test_crossed_cylinders_in_pybullet() -> None:
    p = pytest.importorskip("pybullet")
    from contactlaw.pybullet_callback import ContactCallback

    pair, client = steel_pair(FRICTION), p.connect(p.DIRECT)
    try:
        p.setTimeStep(1e-3, physicsClientId=client)
        bodies = []
        for radius, mass, height, angles in ((0.01, MASS, 0.04 + GAP, (0.0, np.pi / 2, 0.0)),
                                             (0.03, 0.0, 0.0, (np.pi / 2, 0.0, 0.0))):  # fmt: skip
            shape = p.createCollisionShape(p.GEOM_CYLINDER, radius=radius, height=0.1, physicsClientId=client)
            turn = p.getQuaternionFromEuler(angles)
            bodies.append(p.createMultiBody(mass, shape, -1, (0.0, 0.0, height), turn, physicsClientId=client))
        p.changeDynamics(bodies[0], -1, linearDamping=0.0, angularDamping=0.0, maxJointVelocity=1e6,
                         localInertiaDiagonal=3 * [0.4 * MASS * 1e-4], physicsClientId=client)  # fmt: skip
        contact, unit = ContactCallback(client), FRICTION / pair.kappa * SPEED
        contact.add_contact(bodies[0], bodies[1], pair)
        p.resetBaseVelocity(bodies[0], (*(unit * PSI), -SPEED), physicsClientId=client)
        for _ in range(STEPS):
            contact.step()
        v, w = p.getBaseVelocity(bodies[0], physicsClientId=client)
    finally:
        p.disconnect(client)
    assert v[2] == pytest.approx(SPEED, rel=1e-3)
    found = np.array([v[0] - 0.01 * w[1], v[1] + 0.01 * w[0]]) / unit
    np.testing.assert_allclose(found, impact(CROSSED, PSI), atol=1e-3)
