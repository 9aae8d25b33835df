"""What users do to a running callback in PyBullet: it goes on rightly, or an error names the body."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import FREE, RADIUS, ball, in_contact, p, paddle, pair_of, plane, shape, step, velocities

from contactlaw import ContactWarning
from contactlaw.pybullet_callback import ContactCallback


def resting(client: int) -> tuple[int, ContactCallback, int]:
    """A ball at rest on a plane."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS])
    callback, handle = in_contact(client, body, floor, pair_of(restitution=0.5), gravity=9.81)
    step(callback, 60)
    assert velocities(client, body)[0][2] == 0.0
    return body, callback, handle


def everything(client: int) -> list:
    bodies = [p.getBodyUniqueId(i, client) for i in range(p.getNumBodies(client))]
    return [(p.getBasePositionAndOrientation(b, client), p.getBaseVelocity(b, client)) for b in bodies]


def test_reset_simulation_is_noticed_though_there_are_as_many_bodies(client: int) -> None:
    body, callback, _ = resting(client)
    p.resetSimulation(physicsClientId=client)
    with pytest.raises(ValueError, match=r"body 0: removed.*resetSimulation"):
        callback.step()
    p.setGravity(0, 0, -9.81, client)
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3], [0, 0, -1.0])
    with pytest.raises(ValueError, match=r"body 0: removed.*resetSimulation"):
        step(callback)
    callback.remove_all()
    callback.add_contact(body, floor, pair_of(restitution=1.0))
    step(callback)
    half_step = (
        0.5 * 9.81 / 240
    )  # a body in flight has the velocity of half a step before its position, before and after
    assert velocities(client, body)[0][2] == pytest.approx(1.0 + half_step, abs=1e-3)


def test_reset_simulation_is_noticed_though_all_bodies_are_where_they_were(client: int) -> None:
    body, callback, _ = resting(client)
    place = p.getBasePositionAndOrientation(body, client)[0]
    p.resetSimulation(physicsClientId=client)
    p.setGravity(0, 0, -9.81, client)
    assert plane(client) + 1 == ball(client, list(place)) == body
    with pytest.raises(ValueError, match=r"body 0: removed.*resetSimulation"):
        step(callback)


def test_contacts_are_removed_after_a_new_connection_if_not_before(client: int) -> None:
    """Half of what `remove_all` does was done when PyBullet raised its error; then nothing could be added anew."""
    _, callback, _ = resting(client)
    p.disconnect(client)
    with pytest.raises(ValueError, match=rf"client = {client}: must be the id of a connected physics client"):
        callback.remove_all()
    assert p.connect(p.DIRECT) == client
    callback.remove_all()
    callback.add_contact(ball(client, [0, 0, RADIUS]), plane(client), pair_of(restitution=0.5))
    step(callback)


@pytest.mark.parametrize("which", [0, 1])
def test_another_body_in_the_place_of_a_removed_one_is_noticed(client: int, which: int) -> None:
    """Though it gets the same id, so that there are as many bodies as before, and nothing has moved."""
    body, callback, _ = resting(client)
    place = p.getBasePositionAndOrientation(body, client)[0]
    old = (0, body)[which]
    p.removeBody(old, client)
    assert (ball(client, list(place), radius=3 * RADIUS) if which else plane(client)) == old
    with pytest.raises(ValueError, match=f"body {old}: removed"):
        step(callback, 2)
    with pytest.raises(ValueError, match=f"body {old}: removed"):
        step(callback)


@pytest.mark.parametrize("depth", [0.04, 0.2, 2.0])
@pytest.mark.parametrize("rests", [True, False], ids=["at rest", "in flight"])
def test_a_ball_that_is_put_into_the_floor_is_not_thrown(client: int, rests: bool, depth: float) -> None:
    body, callback, _ = resting(client)
    if not rests:
        p.resetBasePositionAndOrientation(body, [0, 0, 1.0], [0, 0, 0, 1], client)
        step(callback, 5)
    p.resetBasePositionAndOrientation(body, [0, 0, (1.0 - depth) * RADIUS], [0, 0, 0, 1], client)
    text = f"body {body} and body 0: found in each other by {depth:.2g} of the radius: they count as just touching"
    with pytest.warns(ContactWarning, match=text):
        step(callback)
    for _ in range(100):
        step(callback)
        height = p.getBasePositionAndOrientation(body, client)[0][2]
        assert height == pytest.approx((1.0 - depth) * RADIUS, abs=1e-5)


def test_a_call_takes_the_next_step_and_no_other(client: int) -> None:
    """And a second call before that is an error, unless the contacts or the state have been set since."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3], [0, 0, -1.0])
    callback, handle = in_contact(client, body, floor, pair_of())
    callback()
    other = p.connect(p.DIRECT)
    p.stepSimulation(other)
    p.disconnect(other)
    for again in (callback, ContactCallback(client)):
        with pytest.raises(ValueError, match=f"client {client}: called again before stepSimulation"):
            again()
    p.stepSimulation(client)
    assert velocities(client, body)[0][2] == pytest.approx(0.93, abs=1e-3)
    for forget in (lambda: callback.restore(callback.save()), lambda: callback.remove_contact(handle)):
        callback()
        forget()
        callback()
        p.stepSimulation(client)
    p.resetBasePositionAndOrientation(body, [0, 0, 1.0], [0, 0, 0, 1], client)
    p.stepSimulation(client)
    assert callback.save().handles == ()


def test_two_callbacks_do_not_share_a_pair(client: int) -> None:
    floor, body, other = plane(client), ball(client, [0, 0, 1.0]), ball(client, [1, 0, 1.0])
    first, second = ContactCallback(client), ContactCallback(client)
    first.add_contact([body, other], floor, pair_of())
    with pytest.raises(ValueError, match=f"body {body} and body {floor}|body {floor}, body {body}.*another"):
        second.add_contact(floor, body, pair_of())
    second.add_contact(body, other, pair_of())
    first.remove_all()
    second.add_contact(floor, body, pair_of())


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_mass_changed_at_rest_is_carried(client: int, factor: float) -> None:
    body, callback, handle = resting(client)
    step(callback, 5)
    before, mass = callback.state(handle), 0.5 * factor
    p.changeDynamics(body, -1, mass=mass, localInertiaDiagonal=[0.4 * mass * RADIUS**2] * 3, physicsClientId=client)
    step(callback, 120)
    after = callback.state(handle)
    assert after.force[2] == pytest.approx(mass * 9.81, rel=1e-6)
    assert after.overlap == pytest.approx(before.overlap * factor ** (2 / 3), rel=1e-4)
    assert velocities(client, body)[0][2] == pytest.approx(0.0, abs=1e-9)


def test_a_mass_changed_within_an_impact_is_the_one_that_leaves(client: int) -> None:
    """In the middle of the compression, at rest there, a ball is made four times as heavy: the spring's energy
    0.5 m v^2 becomes 0.5 (4 m) (v/2)^2."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS], [0, 0, -0.2])
    pair = pair_of(restitution=1.0, friction=0.0)
    dt = pair_of(radius=RADIUS, restitution=1.0).contact_duration(0.5, 0.2) / 200
    callback, _ = in_contact(client, body, floor, pair, dt=dt)
    while velocities(client, body)[0][2] < 0.0:
        step(callback)
    p.changeDynamics(body, -1, mass=2.0, localInertiaDiagonal=[0.8 * RADIUS**2] * 3, physicsClientId=client)
    step(callback, 600)
    assert velocities(client, body)[0][2] == pytest.approx(0.1, rel=0.02)


def test_a_mass_changed_in_flight_is_the_one_that_strikes(client: int) -> None:
    body, other = ball(client, [0, 0, 0], [1.0, 0, 0]), ball(client, [0.2, 0, 0])
    callback, _ = in_contact(client, body, other, pair_of(restitution=1.0))
    step(callback, 5)
    p.changeDynamics(other, -1, mass=1.5, localInertiaDiagonal=[0.6 * RADIUS**2] * 3, physicsClientId=client)
    step(callback, 60)
    np.testing.assert_allclose(
        [velocities(client, one)[0][0] for one in (body, other)], [-0.5, 0.5], atol=1e-3
    )  # of masses 1 : 3


def test_a_link_s_mass_changed_in_flight_is_the_one_that_strikes(client: int) -> None:
    """A paddle's hinge feels I and a ball m at an arm L: by energy and angular momentum the ball leaves at
    v (k - 1)/(k + 1), k = m L^2 / I."""
    arm, mass = paddle(client), 0.5
    body = ball(client, [0.4, 0, 2.0 * RADIUS + 0.1], [0, 0, -1.0], mass=mass)
    callback, _ = in_contact(client, arm, body, pair_of(restitution=1.0, friction=0.0), link_a=0)
    step(callback, 5)
    p.changeDynamics(arm, 0, mass=3.0, localInertiaDiagonal=[1e-3, 2e-2, 3e-2], physicsClientId=client)
    step(callback, 30)
    k = mass * 0.4**2 / (3.0 * 0.2**2 + 2e-2)
    assert velocities(client, body)[0][2] == pytest.approx((1.0 - k) / (1.0 + k), abs=1e-3)


@pytest.mark.parametrize("beside", [True, False])
def test_a_step_made_longer_passes_nothing(client: int, beside: bool) -> None:
    """The step's length is not asked for where what falls shows it: far from everything, or close by another ball."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 0.05], [0, 0, -5.0])
    p.setGravity(0, 0, -9.81, client)
    p.setTimeStep(1e-5, client)
    callback = ContactCallback(client)
    others = [ball(client, [2.0 * RADIUS + 1e-6, 0, RADIUS + 0.05], [0, 0, -5.0])] if beside else []
    callback.add_contact([body, *others], [body, *others, floor], pair_of(restitution=1.0))
    step(callback, 4)
    p.setTimeStep(1 / 60, client)
    callback.step()
    assert p.getBasePositionAndOrientation(body, client)[0][2] > RADIUS
    assert velocities(client, body)[0][2] == pytest.approx(5.0, abs=0.2)


def test_a_step_made_longer_while_a_ball_rolls_is_noticed(client: int) -> None:
    body, callback, _ = resting(client)
    p.resetBaseVelocity(body, [1.0, 0, 0], [0, 1.0 / RADIUS, 0], client)
    step(callback, 20)
    dt = 2.0 * p.getPhysicsEngineParameters(client)["fixedTimeStep"]
    p.setTimeStep(dt, client)
    before = p.getBasePositionAndOrientation(body, client)[0][0]
    callback.step()
    assert p.getBasePositionAndOrientation(body, client)[0][0] - before == pytest.approx(dt, rel=1e-6)


@pytest.mark.parametrize("pull", [-20.0, 9.81])
def test_gravity_changed_while_all_sleeps_is_noticed(client: int, pull: float) -> None:
    body, callback, handle = resting(client)
    p.setGravity(0, 0, pull, client)
    p.setTimeStep(1e-3, client)
    callback.step()
    if pull > 0.0:
        assert velocities(client, body)[0][2] > 0.0
    else:
        step(callback, 200)
        assert callback.state(handle).force[2] == pytest.approx(0.5 * 20.0, rel=1e-6)


def chain(client: int, links: int = 3) -> int:
    """Balls on a line that overlap at their joints, the next but one by nothing."""
    own = shape(client, p.GEOM_SPHERE, radius=0.05)
    return p.createMultiBody(
        1.0, own, -1, [0, 0, 1], linkMasses=[1.0] * links, linkCollisionShapeIndices=[own] * links,
        linkVisualShapeIndices=[-1] * links, linkPositions=[[0.08, 0, 0]] * links,
        linkOrientations=[[0, 0, 0, 1]] * links, linkInertialFramePositions=[[0, 0, 0]] * links,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * links, linkParentIndices=list(range(links)),
        linkJointTypes=[p.JOINT_REVOLUTE] * links, linkJointAxis=[[0, 1, 0]] * links, physicsClientId=client,
    )  # fmt: skip


def test_sets_leave_out_a_link_and_its_parent(client: int) -> None:
    body = chain(client)
    callback, sides = ContactCallback(client), [(body, link) for link in range(-1, 3)]
    handle = callback.add_contact(sides, sides, pair_of())
    for link in range(3):
        p.setJointMotorControl2(body, link, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
    step(callback, 5)
    assert callback.states(handle) == []
    assert velocities(client, body)[0].tolist() == [0.0, 0.0, 0.0]
    for link, angle in enumerate((0.0, 2.0, 0.0)):
        p.resetJointState(body, link, angle, 0.0, client)
    with pytest.warns(match="found in each other"):
        callback.step()
    assert {(one.a[1], one.b[1]) for one in callback.states(handle)} <= {(-1, 1), (-1, 2), (0, 2)}
    assert callback.states(handle)


@pytest.mark.parametrize("fault", ["not finite", "joints", "gone", "substeps"])
def test_a_call_that_raised_leaves_the_engine_as_it_was(client: int, fault: str) -> None:
    arm, body, other = paddle(client), ball(client, [1.0, 0, RADIUS - 0.999], [0, 0, -1.0]), ball(client, [2.0, 0, 1.0])
    floor = p.createMultiBody(0.0, shape(client, p.GEOM_PLANE), -1, [0, 0, -1.0], physicsClientId=client)
    callback, _ = in_contact(client, [(body, -1), (other, -1), (arm, 0)], floor, pair_of(), gravity=9.81)
    callback.step()
    if fault == "not finite":
        p.resetBaseVelocity(other, [np.nan, 0, 0], physicsClientId=client)
    elif fault == "joints":
        p.resetJointState(arm, 0, np.nan, 0.0, client)
    elif fault == "gone":
        p.removeBody(other, client)
    else:
        p.setPhysicsEngineParameter(numSubSteps=4, physicsClientId=client)
    before = repr((everything(client), p.getJointState(arm, 0, client)))
    name = {"joints": f"body {arm}", "substeps": "numSubSteps"}.get(fault, f"body {other}")
    for _ in range(2):
        with pytest.raises(ValueError, match=name):
            callback.step()
        assert repr((everything(client), p.getJointState(arm, 0, client))) == before


def test_of_bodies_that_are_lost_together_the_first_is_named(client: int) -> None:
    heavy, fast = ball(client, [0, 0, -RADIUS], mass=1e3), ball(client, [0, 0, 0.999 * RADIUS])
    p.changeDynamics(fast, -1, maxJointVelocity=1e20, physicsClientId=client)
    callback, _ = in_contact(client, heavy, fast, pair_of(), dt=2e-3)
    p.resetBaseVelocity(fast, [0, 0, -1e13], physicsClientId=client)
    with pytest.raises(ValueError, match=f"body {fast}: its position, velocity, or gravity is not finite"):
        step(callback, 2)


def test_a_set_is_taken_from_bullet_and_given_back(client: int) -> None:
    """Bullet's own contact, without restitution, never acts on the balls of a row that is hit fast: elastic ones hand
    the velocity on. It acts again when the contact has been removed."""
    own, speed = shape(client, p.GEOM_SPHERE, radius=RADIUS), 30.0  # m/s, 2.5 diameters a step
    balls = [p.createMultiBody(0.5, own, -1, [0.3 * i, 0, 1.0], physicsClientId=client) for i in range(20)]
    for body in balls:
        p.changeDynamics(body, -1, localInertiaDiagonal=[0.2 * RADIUS**2] * 3, physicsClientId=client, **FREE)
    p.resetBaseVelocity(balls[3], [speed, 0, 0], physicsClientId=client)
    callback, handle = in_contact(client, balls, balls, pair_of(restitution=1.0, friction=0.0))
    step(callback, 40)
    found = [velocities(client, body)[0][0] for body in balls]
    fastest = int(np.argmax(found))
    assert fastest > 10 and found[fastest] == pytest.approx(speed, rel=1e-3)
    assert sum(abs(one) for one in found) == pytest.approx(speed, rel=2e-3)
    callback.remove_contact(handle)
    for number, body in enumerate(balls[3:5]):
        p.resetBasePositionAndOrientation(body, [0.06 * number, 5.0, 1.0], [0, 0, 0, 1], client)
    p.resetBaseVelocity(balls[3], [1.0, 0, 0], physicsClientId=client)
    for _ in range(20):
        p.stepSimulation(client)
    np.testing.assert_allclose([velocities(client, body)[0][0] for body in balls[3:5]], 0.5, atol=0.05)


@pytest.mark.parametrize("lift", [0.2, 0.9, 24.0])
def test_a_force_on_a_body_at_rest_relieves_what_carries_it(client: int, lift: float) -> None:
    """Before a step was Bullet's first, what slept left with g h more, or hopped.

    lift: the force over the weight, for one step.
    """
    body, callback, _ = resting(client)
    fall, place = 9.81 * p.getPhysicsEngineParameters(physicsClientId=client)["fixedTimeStep"], [0.0, 0.0, RADIUS]
    p.applyExternalForce(body, -1, [0.0, 0.0, lift * 0.5 * 9.81], place, p.WORLD_FRAME, physicsClientId=client)
    callback.step()
    callback.step()
    left = (lift - 1.5) * fall if lift > 1.0 else 0.0  # in free flight Bullet's velocity is half a step behind
    assert velocities(client, body)[0][2] == pytest.approx(left, abs=0.02 * fall)


@pytest.mark.parametrize("begun", [False, True], ids=["new", "running"])
def test_a_body_held_by_zero_mass_falls_and_bounces_once_it_has_its_mass(client: int, begun: bool) -> None:
    """It has the law on the floor, and Bullet's own contact (which does not bounce) stays off, also in sets to which
    it was added while it could not move."""
    floor, held, other = plane(client), ball(client, [0, 0, 0.1]), ball(client, [0.2, 0, RADIUS])
    p.changeDynamics(held, -1, mass=0.0, physicsClientId=client)
    callback = ContactCallback(client)
    if begun:
        callback.add_contact([held, other], [held, other, floor], pair_of(restitution=1.0))
    else:
        p.changeDynamics(held, -1, mass=0.5, physicsClientId=client)
        callback.add_contact(held, floor, pair_of(restitution=1.0))
        p.changeDynamics(held, -1, mass=0.0, physicsClientId=client)
    p.setGravity(0, 0, -9.81, client)
    p.setTimeStep(1 / 240, client)
    step(callback, 20)
    assert p.getBasePositionAndOrientation(held, client)[0][2] == 0.1
    p.changeDynamics(held, -1, mass=0.5, localInertiaDiagonal=[0.2 * RADIUS**2] * 3, physicsClientId=client)
    heights = []
    for _ in range(120):
        step(callback)
        heights.append(p.getBasePositionAndOrientation(held, client)[0][2])
    assert RADIUS - 1e-4 < min(heights) < RADIUS + 0.01
    assert max(heights[40:]) == pytest.approx(0.1, rel=0.03)
    p.changeDynamics(held, -1, mass=0.0, physicsClientId=client)
    p.resetBaseVelocity(held, [0, 0, 0], physicsClientId=client)
    place = p.getBasePositionAndOrientation(held, client)[0]
    step(callback, 60)
    assert p.getBasePositionAndOrientation(held, client)[0] == place


def test_each_contact_is_warned_of_though_it_takes_the_room_of_another(client: int) -> None:
    """Two soft balls strike hard, the second in the step after that in which the first one leaves."""
    floor = plane(client)
    balls = [ball(client, [x, 0, RADIUS + gap], [0, 0, -10.0]) for x, gap in enumerate((0.02, 0.187))]
    callback = ContactCallback(client)
    callback.add_contact(balls, floor, pair_of("rubber", friction=0.0))
    p.setTimeStep(1 / 60, client)
    with pytest.warns(ContactWarning) as caught:
        step(callback, 4)
    assert [str(one.message).split(" and ")[0] for one in caught] == [f"body {one}" for one in balls]


def test_a_joint_that_bullet_s_explicit_damping_drives_off_is_an_error(client: int) -> None:
    """Its speed grew to Bullet's limit; with six such joints a step then took minutes."""
    arm, floor = paddle(client), plane(client)
    p.resetBasePositionAndOrientation(arm, [0, 0, 1], [0, 0, 0, 1], client)
    p.changeDynamics(arm, 0, jointDamping=100.0, physicsClientId=client)
    callback, _ = in_contact(client, arm, floor, pair_of(), gravity=9.81, link_a=0)
    with pytest.raises(ValueError, match=r"has brought it to .* a step: shorten the step; or its joints"):
        step(callback, 20)
