"""The state right after a step in PyBullet: of an impact, in flight, at rest, and under forces of others."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import (
    FREE,
    RADIUS,
    ball,
    impact,
    in_contact,
    p,
    pair_of,
    plane,
    shape,
    slab,
    step,
    velocities,
)

from contactlaw.world import World

G = 9.81


def in_world(dt: float, height: float, speed: float, spin: float, steps: int) -> World:
    """A ball over a plane in a world, started as PyBullet's reading rule has it."""
    world = World(timestep=dt)
    body = world.add_body(
        0.5, 0.2 * RADIUS**2, [0, 0, RADIUS + height], [0.3, 0, -speed - 0.5 * dt * G], spin=(0, spin, 0)
    )
    world.add_contact(world.add_sphere(body, RADIUS), world.add_plane(None, (0, 0, 0), (0, 0, 1)), pair_of())
    world.step(steps)
    return world


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 2e-3, 1e-4])
@pytest.mark.parametrize("phase", [0.01, 0.4, 0.97])
def test_after_the_step_of_an_impact_the_state_is_right(client: int, dt: float, phase: float) -> None:
    """As a world by itself has it, at every step."""
    speed, spin = 1.0, 30.0
    height = phase * dt * speed
    floor, body = plane(client), ball(client, [0, 0, RADIUS + height], [0.3, 0, -speed], [0, spin, 0])
    callback, handle = in_contact(client, body, floor, pair_of(), dt=dt, gravity=G)
    impacts = 0
    for number in range(1, 9):
        step(callback)
        world = in_world(dt, height, speed, spin, number)
        velocity, turning = velocities(client, body)
        closed = world.contacts["closed"].any()
        np.testing.assert_allclose(velocity, world.velocity[0] + [0, 0, 0 if closed else 0.5 * dt * G], atol=1e-9)
        np.testing.assert_allclose(turning, world.spin[0], atol=1e-7)
        impacts += callback.state(handle).touching
        place = p.getBasePositionAndOrientation(body, client)[0]
        np.testing.assert_allclose(place, world.position[0], atol=1e-10)
    assert impacts


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1e-3, 3e-5, 1e-6])
@pytest.mark.heavy
def test_psi_2_does_not_depend_on_the_step(client: int, dt: float) -> None:
    steps = pair_of(radius=RADIUS).contact_duration(0.5, 1.0) / dt
    for number, psi_1 in enumerate((0.5, 1.2, 2.0, 4.0)):
        for phase in (0.02, 0.33, 0.71):
            error, bounce, sideways = impact(client, "steel", psi_1, steps, angle=number, phase=phase)
            assert abs(error) < 5e-4
            assert abs(bounce) < 1e-4
            assert abs(sideways) < 1e-12


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1e-3])
def test_energy_of_elastic_bounces(client: int, dt: float) -> None:
    """Ten seconds, spinning and rough: where the ball flies its energy is that of the start."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 0.2], [0.2, 0, 0], [5, 20, 3])
    callback, handle = in_contact(client, body, floor, pair_of(restitution=1.0, friction=0.0), dt=dt, gravity=G)

    def energy() -> float:
        velocity, spin = velocities(client, body)
        velocity = velocity - [0, 0, 0.5 * dt * G]
        height = p.getBasePositionAndOrientation(body, client)[0][2] - RADIUS
        return float(0.25 * velocity @ velocity + 0.1 * RADIUS**2 * spin @ spin + 0.5 * G * height)

    first, seen = energy(), []
    for _ in range(int(10.0 / dt)):
        step(callback)
        if not callback.state(handle).touching:
            seen.append(energy())
    assert callback.ledger(handle).impacts > 20
    np.testing.assert_allclose(seen, first, rtol=2e-4)


@pytest.mark.parametrize("seed", range(3))
def test_a_gas_of_elastic_balls_keeps_its_energy(client: int, seed: int) -> None:
    rng, half, dt = np.random.default_rng(seed), 0.15, 5e-3
    walls = [
        p.createMultiBody(
            0.0, shape(client, p.GEOM_PLANE, planeNormal=(sign * axis).tolist()), -1, (-sign * half * axis).tolist(),
            physicsClientId=client,
        )
        for axis in np.eye(3) for sign in (1.0, -1.0)
    ]  # fmt: skip
    balls = []
    for corner in 0.5 * half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]):
        direction = rng.normal(size=3)
        balls.append(
            ball(client, corner + rng.uniform(-4e-3, 4e-3, 3), direction / np.linalg.norm(direction), radius=0.04)
        )
    callback, handle = in_contact(client, balls, [*balls, *walls], pair_of(friction=0.0, restitution=1.0), dt=dt)
    step(callback, 600)
    while callback.states(handle):
        step(callback)
    assert callback.ledger(handle).impacts > 200
    assert np.mean([velocities(client, body)[0] @ velocities(client, body)[0] for body in balls]) == pytest.approx(
        1.0, abs=2e-3
    )


def test_what_rests_stands_still_to_the_bit_and_wakes(client: int) -> None:
    floor, body = plane(client), ball(client, [0.1, 0.2, RADIUS + 0.01])
    callback, _ = in_contact(client, body, floor, pair_of(restitution=0.5), gravity=G)
    step(callback, 500)
    place = p.getBasePositionAndOrientation(body, client)
    for _ in range(100):
        step(callback)
        assert p.getBasePositionAndOrientation(body, client) == place
        assert p.getBaseVelocity(body, client) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    p.resetBaseVelocity(body, [0, 0, 1.0], physicsClientId=client)
    step(callback, 2)
    assert p.getBasePositionAndOrientation(body, client)[0][2] > place[0][2] + 5e-3


def test_what_stands_on_a_body_that_is_taken_away_falls(client: int) -> None:
    plate, body = slab(client), ball(client, [0, 0, RADIUS + 1e-3])
    callback, _ = in_contact(client, body, plate, pair_of(restitution=0.5), gravity=G)
    step(callback, 500)
    assert p.getBaseVelocity(body, client)[0] == (0.0, 0.0, 0.0)
    p.resetBasePositionAndOrientation(plate, [0, 0, -1.1], [0, 0, 0, 1], client)
    step(callback, 24)
    assert velocities(client, body)[0][2] == pytest.approx(-G * 0.1, rel=0.05)


def test_a_force_of_the_user_is_part_of_the_step(client: int) -> None:
    """A ball that is pressed on the floor with twenty times its weight comes to rest at the overlap of both."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3])
    callback, handle = in_contact(client, body, floor, pair_of(restitution=0.5), gravity=G)
    extra = 20.0 * 0.5 * G
    for _ in range(500):
        p.applyExternalForce(body, -1, [0, 0, -extra], [0, 0, 0], p.LINK_FRAME, client)
        callback.step()
    state = callback.state(handle)
    assert state.normal_force == pytest.approx(0.5 * G + extra, rel=1e-6)
    assert state.force[2] == pytest.approx(0.5 * G + extra, rel=1e-6)
    assert np.abs(velocities(client, body)[0]).max() < 1e-12


def test_a_native_contact_feels_what_presses(client: int) -> None:
    """A box of Bullet's own carries a ball of the law: the floor bears both, and nothing sinks."""
    floor = plane(client)
    box = p.createMultiBody(
        2.0, shape(client, p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.05]), -1, [0, 0, 0.05], physicsClientId=client
    )
    p.changeDynamics(box, -1, physicsClientId=client, **FREE)
    body = ball(client, [0.01, 0.005, 0.1 + RADIUS + 1e-4])
    callback, handle = in_contact(client, body, box, pair_of(restitution=0.5, friction=0.5), gravity=G)
    step(callback, 1000)
    weights = []
    for _ in range(100):
        step(callback)
        weights.append(sum(point[9] for point in p.getContactPoints(box, floor, physicsClientId=client)))
    assert np.mean(weights) == pytest.approx(2.5 * G, rel=1e-3)
    assert callback.state(handle).force[2] == pytest.approx(0.5 * G, rel=1e-2)
    assert p.getBasePositionAndOrientation(body, client)[0][2] == pytest.approx(0.1 + RADIUS, abs=1e-3)


def test_a_place_given_by_the_user_stays(client: int) -> None:
    """Moved right after an impact: nothing that the place lacked is added to it."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3], [0, 0, -1.0])
    callback, _ = in_contact(client, body, floor, pair_of())
    step(callback)
    p.resetBasePositionAndOrientation(body, [0, 0, 5.0], [0, 0, 0, 1], client)
    p.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], client)
    step(callback, 3)
    assert p.getBasePositionAndOrientation(body, client)[0][2] == 5.0
