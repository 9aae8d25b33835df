"""The state right after a step in PyBullet: of an impact, in flight, at rest, and under forces of others."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import (
    FREE,
    RADIUS,
    ball,
    in_contact,
    p,
    paddle,
    pair_of,
    plane,
    shape,
    slab,
    step,
    velocities,
)

from contactlaw.pybullet_callback import ContactCallback
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


@pytest.mark.parametrize("link", [-1, 0])
def test_what_stands_on_a_body_that_is_taken_away_falls(client: int, link: int) -> None:
    """Also on a fixed link, whose readings tell a sleeping ball that it has moved."""
    if link == 0:
        box, none = shape(client, p.GEOM_BOX, halfExtents=[1.0, 1.0, 0.1]), [[0, 0, 0, 1]]
        plate = p.createMultiBody(
            0.0, linkMasses=[0.0], linkCollisionShapeIndices=[box], linkVisualShapeIndices=[-1],
            linkPositions=[[0, 0, -0.1]], linkOrientations=none, linkInertialFramePositions=[[0, 0, 0]],
            linkInertialFrameOrientations=none, linkParentIndices=[0], linkJointTypes=[p.JOINT_FIXED],
            linkJointAxis=[[0, 0, 1]], physicsClientId=client,
        )  # fmt: skip
    else:
        plate = slab(client)
    body = ball(client, [0, 0, RADIUS + 1e-3])
    callback = ContactCallback(client)
    callback.add_contact(body, plate, pair_of(restitution=0.5), link_b=link)
    p.setGravity(0, 0, -G, client)
    step(callback, 500)
    assert p.getBaseVelocity(body, client)[0] == (0.0, 0.0, 0.0)
    assert callback._scene.bodies.arrays.bodies["asleep"][1:].any()
    down = p.getBasePositionAndOrientation(plate, client)[0][2] - 1.0
    p.resetBasePositionAndOrientation(plate, [0, 0, down], [0, 0, 0, 1], client)
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


@pytest.mark.parametrize("others", [False, True], ids=["alone", "beside one that sleeps on"])
def test_what_sleeps_is_pushed_no_longer_once_it_is_thrown(client: int, others: bool) -> None:
    """It flies on the parabola of its throw: the push that carried it while it slept ends with the contact."""
    dt, speed = 1e-3, 0.3
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-4])
    bodies = [body, ball(client, [0.5, 0, RADIUS + 1e-4])] if others else [body]
    callback, _ = in_contact(client, bodies, floor, pair_of(restitution=0.5), dt=dt, gravity=G)
    step(callback, 400)
    height = p.getBasePositionAndOrientation(body, client)[0][2]
    assert p.getBaseVelocity(body, client) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    p.resetBaseVelocity(body, [0, 0, speed], physicsClientId=client)
    for number in range(1, 21):
        step(callback)
        t = number * dt
        place = p.getBasePositionAndOrientation(body, client)[0][2]
        assert place == pytest.approx(height + speed * t - 0.5 * G * t**2, abs=1e-5)
    assert velocities(client, body)[0][2] == pytest.approx(speed - G * (t - 0.5 * dt), abs=1e-3)


@pytest.mark.parametrize("jointed", [False, True])
def test_what_rests_on_a_body_that_is_placed_elsewhere_falls_from_the_first_step(client: int, jointed: bool) -> None:
    """The push of the contact that is no more stayed in Bullet's step: it hung for one step."""
    low = p.createMultiBody(0.0, shape(client, p.GEOM_PLANE), -1, [0, 0, -0.1 - RADIUS], physicsClientId=client)
    box = shape(client, p.GEOM_BOX, halfExtents=[0.05] * 3)
    support = p.createMultiBody(1.0, box, -1, [0.4, 0, -0.05 - RADIUS], physicsClientId=client)
    body = paddle(client) if jointed else ball(client, [0.4, 0, 0])
    links = (body, 0) if jointed else body
    callback, _ = in_contact(
        client, [links, support], [low, support], pair_of("rubber", restitution=0.3), dt=1 / 240, gravity=G
    )
    step(callback, 120)
    p.resetBasePositionAndOrientation(support, [2.0, 0, -0.05 - RADIUS], [0, 0, 0, 1], client)
    inertia = p.getDynamicsInfo(body, 0, client)[2][1] if jointed else 0.0
    fall = 0.3 * 0.2 * G / (inertia + 0.3 * 0.2**2) if jointed else -G  # the arm's centre of mass is at 0.2 m
    for count in range(3):
        step(callback)
        speed = p.getJointState(body, 0, client)[1] if jointed else p.getBaseVelocity(body, client)[0][2]
        assert speed == pytest.approx((count + 0.5) * fall / 240, rel=1e-3)  # half a step behind, as Bullet keeps it


def test_what_sleeps_on_a_body_whose_contact_is_removed_falls_from_the_next_step(client: int) -> None:
    """With a contact of its own that is added anew: it was taken over as asleep, and hung in the air."""
    floor, bodies = plane(client), [ball(client, [x, 0, RADIUS + 1e-4]) for x in (0.0, 0.2)]
    callback, handle = in_contact(client, bodies, floor, pair_of(restitution=0.5), dt=1 / 240, gravity=G)
    step(callback, 240)
    assert callback._scene.bodies.arrays.bodies["asleep"][1:3].all()
    callback.remove_contact(handle)
    p.removeBody(floor, client)
    callback.add_contact(*bodies, pair_of())
    step(callback, 24)
    for body in bodies:
        assert velocities(client, body)[0][2] == pytest.approx(-23.5 * G / 240, rel=1e-6)


def test_what_sleeps_elsewhere_goes_on_sleeping_where_a_contact_is_removed(client: int) -> None:
    """Of a tower of two the upper one falls with the lower one; a ball beside it does not notice."""
    floor, bodies = plane(client), [ball(client, [x, 0, z]) for x, z in ((0.2, RADIUS), (0, RADIUS), (0, 3 * RADIUS))]
    callback, handle = in_contact(client, bodies[1], floor, pair_of(restitution=0.5), dt=1 / 240, gravity=G)
    callback.add_contact(bodies[2], bodies[1], pair_of(restitution=0.5))
    callback.add_contact(bodies[0], floor, pair_of(restitution=0.5))
    step(callback, 240)
    callback.remove_contact(handle)
    p.setCollisionFilterPair(bodies[1], floor, -1, -1, 0, client)  # nor by Bullet's own response
    rows = [1 + callback._scene._row[body, -1] for body in bodies]
    records = callback._scene.bodies.arrays.bodies
    assert records["asleep"][rows].all() and np.isnan(records["held"][rows, 0]).tolist() == [False, True, False]
    step(callback, 2)
    assert velocities(client, bodies[0])[0][2] == 0.0
    assert velocities(client, bodies[2])[0][2] == pytest.approx(-1.5 * G / 240, rel=0.1)


def test_a_fixed_body_with_a_velocity_keeps_nothing_awake_that_it_does_not_touch(client: int) -> None:
    """A belt far from a ball at rest: the ball was woken in each step, and fell asleep again."""
    floor, belt, body = plane(client), slab(client), ball(client, [0, 0, RADIUS])
    contact, _ = in_contact(client, [body], [floor, belt], pair_of(restitution=0.5), dt=1 / 240, gravity=G)
    for count in range(300):
        p.resetBasePositionAndOrientation(belt, [5 + 0.1 * count / 240, 0, -0.1], [0, 0, 0, 1], client)
        p.resetBaseVelocity(belt, [0.1, 0, 0], physicsClientId=client)
        step(contact)
        if count == 250:
            before = contact._scene.bodies.arrays.world[["kicks", "implicit"]].copy()
    assert contact._scene.bodies.arrays.world[["kicks", "implicit"]] == before
