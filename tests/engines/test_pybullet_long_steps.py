"""The law at PyBullet's own time step, many times longer than a contact: conservation, chains, rest, slopes."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import RADIUS, ball, ball_on_plane, p, pair_of, plane, slab, step, totals, velocities

from contactlaw.pybullet_callback import ContactCallback
from sims.contact_point import static_overlap

STEP = 1 / 240


@pytest.mark.parametrize("dt", [STEP, 2e-3, 1e-4, 1e-6])
@pytest.mark.parametrize("start", [0.3e-3, 2.2e-3])
def test_two_balls_keep_momentum_and_angular_momentum(client: int, dt: float, start: float) -> None:
    """Spinning, off centre, in every step of the impact; start: the time of the touch [s]."""
    masses, radii = (0.5, 0.2), (RADIUS, 0.018)
    apart = (radii[0] + radii[1]) * np.array([0.8, 0.5, np.sqrt(1 - 0.64 - 0.25)])
    speeds = np.array([[1.0, 0.1, 0.0], [-0.5, 0.0, 0.2]])
    if dt == 1e-6:
        start = 2e-6
    bodies = {
        ball(client, -start * speeds[0], speeds[0], [3, 20, -30], radius=radii[0], mass=masses[0]): (0.5, RADIUS),
        ball(client, apart - start * speeds[1], speeds[1], [-10, 5, 40], radius=radii[1], mass=masses[1]): (0.2, 0.018),
    }
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(*bodies, pair_of(restitution=1.0))
    before = totals(client, bodies)
    for _ in range(int((start + 3e-4) / dt) + 3):
        step(callback)
        after = totals(client, bodies)
        np.testing.assert_allclose(after[0], before[0], atol=1e-14)
        np.testing.assert_allclose(after[1], before[1], atol=1e-14)
    assert callback.ledger(handle).impacts == 1
    assert not callback.state(handle).touching
    assert 0.9 * before[2] < after[2] < before[2]


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


@pytest.mark.parametrize(
    ("count", "chain"),
    [
        (3, [-0.07095, 0.07640, 0.99455]),
        (4, [-0.07109, -0.02963, 0.10974, 0.99097]),
        (5, [-0.07109, -0.03027, -0.01446, 0.12704, 0.98878]),
    ],
)
@pytest.mark.parametrize("dt", [STEP, 2e-3, 1e-5])
@pytest.mark.heavy
def test_row_of_balls_in_touch_is_the_hertz_chain(client: int, dt: float, count: int, chain: list[float]) -> None:
    """Known velocities of a chain of equal elastic balls over that of the first."""
    bodies = [ball(client, [2 * RADIUS * i - (0.0003 if i == 0 else 0.0), 0, 0]) for i in range(count)]
    p.resetBaseVelocity(bodies[0], [1, 0, 0], physicsClientId=client)
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    callback.add_contact(bodies, bodies, pair_of(friction=0.0, restitution=1.0))
    step(callback, int(2e-3 / dt) + 4)
    speeds = [velocities(client, body)[0][0] for body in bodies]
    np.testing.assert_allclose(speeds, chain, atol=5e-4)
    assert 0.5 * np.sum(np.square(speeds)) == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize("restitution", [0.5, 0.9])
@pytest.mark.heavy
def test_ball_comes_to_rest_at_its_static_overlap_and_stays(client: int, restitution: float) -> None:
    body, callback, handle = ball_on_plane(client, STEP, [0, 0, RADIUS + 0.02], restitution=restitution)
    step(callback, 1500)
    pair = pair_of()
    overlap = static_overlap(pair, 0.5 * 9.81, RADIUS)
    heights = []
    for _ in range(200):
        step(callback)
        heights.append(p.getBasePositionAndOrientation(body, client)[0][2])
        state = callback.state(handle)
        assert state.overlap == pytest.approx(overlap, rel=1e-6)
        assert state.normal_force == pytest.approx(0.5 * 9.81, rel=1e-9)
        assert state.force[2] == pytest.approx(0.5 * 9.81, rel=1e-9)
    assert RADIUS - heights[-1] == pytest.approx(overlap, rel=1e-9)
    assert np.ptp(heights) < 1e-16
    assert np.abs(velocities(client, body)[0]).max() < 1e-12


@pytest.mark.parametrize("angle", [10.0, 30.0, 50.0])
@pytest.mark.parametrize("ground", [plane, slab])
@pytest.mark.parametrize("dt", [STEP, 2e-3])
def test_ball_on_a_slope_rolls_or_slides(client: int, angle: float, ground, dt: float) -> None:
    """g sin(a)/1.4 where friction holds, else g (sin(a) - mu cos(a)), from its static overlap on; height unchanged."""
    a, mu = np.radians(angle), 0.3
    pair = pair_of(friction=mu, restitution=0.5)
    floor = ground(client)
    overlap = static_overlap(pair, 0.5 * 9.81 * np.cos(a), RADIUS)
    body = ball(client, [-0.2, 0, RADIUS - overlap])
    p.setGravity(9.81 * np.sin(a), 0, -9.81 * np.cos(a), client)
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    callback.add_contact(body, floor, pair)
    step(callback, 20)
    before = velocities(client, body)
    step(callback, 60)
    after = velocities(client, body)
    gain = (after[0] - before[0]) / (60 * dt)
    spin = (after[1] - before[1]) / (60 * dt)
    rolls = np.tan(a) < 3.5 * mu
    expected = 9.81 * (np.sin(a) / 1.4 if rolls else np.sin(a) - mu * np.cos(a))
    assert gain[0] == pytest.approx(expected, rel=1e-3)
    assert spin[1] * RADIUS == pytest.approx(expected if rolls else 2.5 * mu * 9.81 * np.cos(a), rel=1e-3)
    assert p.getBasePositionAndOrientation(body, client)[0][2] == pytest.approx(RADIUS - overlap, abs=1e-13)


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
