"""The law at PyBullet's own time step, many times longer than a contact: conservation, chains, rest, slopes."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import FREE, RADIUS, ball, ball_on_plane, p, pair_of, plane, shape, slab, step, velocities

from contactlaw.pybullet_callback import ContactCallback

STEP = 1 / 240


def test_a_kick_for_one_step_gives_what_rests_all_its_momentum(client: int) -> None:
    dt, kick = 2e-3, np.array([200.0, 100.0, 300.0])
    body, callback, _ = ball_on_plane(client, dt, [0, 0, RADIUS])
    step(callback, 100)
    p.applyExternalForce(body, -1, kick.tolist(), [0, 0, 0], p.LINK_FRAME, client)
    p.applyExternalTorque(body, -1, [0, 0.3, 0], p.LINK_FRAME, client)
    step(callback, 2)
    mass, inertia = (p.getDynamicsInfo(body, -1, client)[i] for i in (0, 2))
    velocity, spin = velocities(client, body)
    np.testing.assert_allclose(velocity, kick * dt / mass - [0, 0, 1.5 * dt * 9.81], atol=2e-3)
    np.testing.assert_allclose(spin, [0, 0.3 * dt / inertia[1], 0], atol=0.2)


def test_tilted_and_turned_planes(client: int) -> None:
    """A plane by its orientation and by its normal: a ball thrown along the normal comes back along it."""
    for turn, normal in (([0.3, -0.2, 0.5], [0, 0, 1]), ([0.1, 0.4, 0.0], [0.0, 0.6, 0.8])):
        p.resetSimulation(client)
        quaternion = p.getQuaternionFromEuler(turn)
        shape = p.createCollisionShape(p.GEOM_PLANE, planeNormal=normal, physicsClientId=client)
        floor = p.createMultiBody(0.0, shape, -1, [0.1, 0.2, 0.3], quaternion, physicsClientId=client)
        up = np.array(p.getMatrixFromQuaternion(quaternion)).reshape(3, 3) @ normal
        body = ball(client, np.array([0.1, 0.2, 0.3]) + (RADIUS + 1e-3) * up, -up)
        callback = ContactCallback(client)
        callback.add_contact(floor, body, pair_of())
        step(callback, 3)
        np.testing.assert_allclose(velocities(client, body)[0], 0.93 * up, atol=2e-4)


def test_moving_fixed_body_takes_the_ball_along(client: int) -> None:
    """A plate without mass but with a velocity hits a ball at rest: in its frame the ball comes and bounces."""
    plate = slab(client)
    body = ball(client, [0, 0, RADIUS + 2e-3])
    p.resetBaseVelocity(plate, [0, 0, 1.0], [0, 0, 0], client)
    callback = ContactCallback(client)
    callback.add_contact(body, plate, pair_of())
    step(callback, 3)
    assert velocities(client, body)[0][2] == pytest.approx(1.93, abs=1e-3)


def test_body_that_is_not_a_ball_keeps_its_angular_momentum(client: int) -> None:
    """A long capsule, tumbling, hit by a ball in free fall: momentum and angular momentum of both stay."""
    rod = p.createMultiBody(
        0.4, p.createCollisionShape(p.GEOM_CAPSULE, radius=0.02, height=0.2, physicsClientId=client), -1, [0, 0, 0],
        p.getQuaternionFromEuler([1.2, 0.3, 0.4]), physicsClientId=client,
    )  # fmt: skip
    inertia = [1.5e-3, 1.5e-3, 8e-5]
    p.changeDynamics(
        rod, -1, localInertiaDiagonal=inertia, linearDamping=0, angularDamping=0, maxJointVelocity=1e6,
        physicsClientId=client,
    )  # fmt: skip
    p.resetBaseVelocity(rod, [0, 0, 0], [1.0, -2.0, 0.5], client)
    turn = np.array(p.getMatrixFromQuaternion(p.getBasePositionAndOrientation(rod, client)[1])).reshape(3, 3)
    body = ball(client, 0.1 * turn[:, 2] + [0.0, 0.0, 0.05], [0, 0, -2.0])
    p.setTimeStep(1e-3, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, rod, pair_of())

    def angular() -> tuple[np.ndarray, np.ndarray]:
        total, momentum = np.zeros(3), np.zeros(3)
        for one, mass, diagonal in ((rod, 0.4, inertia), (body, 0.5, [0.2 * RADIUS**2] * 3)):
            place, quaternion = p.getBasePositionAndOrientation(one, client)
            turn = np.array(p.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
            velocity, spin = velocities(client, one)
            own, moments = turn.T @ spin, np.array(diagonal)  # Bullet's spin is that of half a step before
            spin = spin - 0.5e-3 * turn @ (np.cross(own, moments * own) / moments)
            momentum += mass * velocity
            total += mass * np.cross(place, velocity) + turn @ (np.array(diagonal) * (turn.T @ spin))
        return momentum, total

    hits = 0
    for _ in range(10):
        before = angular()
        step(callback)
        after = angular()
        hits = callback.ledger(handle).impacts
        np.testing.assert_allclose(after[0], before[0], atol=1e-13)
        # What is left is the engine's own error in the tumbling of the rod.
        np.testing.assert_allclose(after[1], before[1], atol=3e-8)
    assert hits == 1


def test_what_tumbles_fast_gains_no_energy_where_it_is_pressed_and_let_go(client: int) -> None:
    """Steps that touch, from just before the floor: Bullet's own flight, which changes the energy, has no part in it.

    The spin in PyBullet is half a step behind. With the explicit gyroscopic rate of change that half step raised the
    energy by its square each time.
    """
    half, mass, dt, rng = np.array([0.033, 0.02, 0.0054]), 0.03, 1e-2, np.random.default_rng(0)
    inertia = mass / 3.0 * (half @ half - half**2)
    p.setTimeStep(dt, client)
    box = p.createMultiBody(mass, shape(client, p.GEOM_BOX, halfExtents=half.tolist()), physicsClientId=client)
    p.changeDynamics(box, -1, localInertiaDiagonal=inertia.tolist(), physicsClientId=client, **FREE)
    callback = ContactCallback(client)
    handle = callback.add_contact(box, plane(client), pair_of(friction=0.0, restitution=1.0))

    def energy() -> float:
        turn = np.array(p.getMatrixFromQuaternion(p.getBasePositionAndOrientation(box, client)[1])).reshape(3, 3)
        velocity, spin = velocities(client, box)
        return 0.5 * float(mass * velocity @ velocity + inertia @ (turn.T @ spin) ** 2)

    for _ in range(20):
        spin, turn = 50.0 * rng.normal(size=3), rng.normal(size=4)
        turn /= np.linalg.norm(turn)
        down = np.abs(np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3)[2])
        height = float(down @ half) + 1e-4
        p.resetBasePositionAndOrientation(box, [0, 0, height], turn.tolist(), client)
        p.resetBaseVelocity(box, [0, 0, -0.5], spin.tolist(), client)
        before = energy()
        for _ in range(4):
            callback.step()
            state = callback.states(handle)
            if not state:
                break
            if not any(one.overlap > 0.0 for one in state):
                assert energy() == pytest.approx(before, rel=1e-5)
    assert callback.ledger(handle).impacts > 10


def test_a_step_that_changes_leaves_falls_and_bounces_as_they_are(client: int) -> None:
    """Closed form of the fall, then energy: Bullet's velocity is that of half a step before, which was longer or
    shorter.
    """
    g, now, energies, steps = 9.81, 0.0, list[float](), np.random.default_rng(0).uniform(1e-3, 1e-2, 400).tolist()
    body, callback, handle = ball_on_plane(client, STEP, [0, 0, 0.3], friction=0.0, restitution=1.0)
    for dt in steps:
        p.setTimeStep(dt, client)
        callback.step()
        now += dt
        z, v = p.getBasePositionAndOrientation(body, client)[0][2], velocities(client, body)[0][2] - 0.5 * dt * g
        if now < 0.2:
            assert z == pytest.approx(0.3 - 0.5 * g * now * (now + steps[0]), rel=1e-12)
        if not callback.states(handle):
            energies.append(g * z + 0.5 * v * v)
    assert energies == pytest.approx(energies[:1] * len(energies), rel=1e-6)


def test_a_step_that_changes_takes_no_more_than_bullets_damping_does(client: int) -> None:
    """As much energy is left as with steps of 1 ms, after eight bounces."""
    random, left = np.random.default_rng(0).uniform(1e-3, 1e-2, 360), list[float]()
    for steps in (np.full(2000, 1e-3), 2.0 / random.sum() * random):
        p.resetSimulation(client)
        body, callback, handle = ball_on_plane(client, STEP, [0, 0, 0.3], friction=0.0, restitution=1.0)
        p.changeDynamics(body, -1, linearDamping=0.04, physicsClientId=client)
        for dt in steps.tolist():
            p.setTimeStep(dt, client)
            callback.step()
        z, v = p.getBasePositionAndOrientation(body, client)[0][2], velocities(client, body)[0][2] - 0.5 * dt * 9.81
        assert callback.states(handle) == []
        left.append(9.81 * z + 0.5 * v * v)
    assert left[1] == pytest.approx(left[0], rel=5e-3)
