"""Sets of bodies, piles, and a restart in the middle of contacts, in PyBullet."""

from __future__ import annotations

import numpy as np
import pytest
from pybullet_scenes import RADIUS, arm, ball, in_contact, p, pair_of, plane, shape, step, velocities

from contactlaw.pybullet_callback import ContactCallback, links_of


@pytest.mark.parametrize("dt", [1e-6, 1e-4, 1 / 240])
@pytest.mark.parametrize("before", [1, 2, 60])
def test_restart_within_a_contact_is_exact(client: int, dt: float, before: int) -> None:
    """With a contact under way, and with impulse owed."""
    floor, body = (
        plane(client),
        ball(client, [0, 0, RADIUS + (1e-7 if dt == 1e-6 else 1e-3)], [0.2, 0.1, -1.0], [5, 3, 1]),
    )
    other = ball(client, [0.001, 0.0, 3 * RADIUS + 2e-3], [0, 0, -1.5])
    p.setGravity(0, 0, -9.81, client)
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    assert callback.states() == []
    handles = [callback.add_contact(body, floor, pair_of()), callback.add_contact([other], [body, floor], pair_of())]
    step(callback, before)
    state, saved = p.saveState(client), callback.save()
    forces = [callback.states(handle) for handle in handles]

    def end() -> list:
        step(callback, 200)
        return [(p.getBasePositionAndOrientation(one, client), p.getBaseVelocity(one, client)) for one in (body, other)]

    first = end()
    p.restoreState(state, physicsClientId=client)
    callback.restore(saved)
    assert len(callback.states()) == sum(map(len, forces))
    for handle, old in zip(handles, forces, strict=True):
        for a, b in zip(callback.states(handle), old, strict=True):
            np.testing.assert_array_equal(a.force, b.force)
            np.testing.assert_array_equal(a.tangential_force, b.tangential_force)
    assert end() == first
    with pytest.raises(ValueError, match="saved: is not what"):
        callback.restore({handles[0]: np.zeros(3)})
    callback.remove_contact(handles[1])
    with pytest.raises(ValueError, match="added or removed since"):
        callback.restore(saved)


def test_a_saved_state_is_of_bodies_that_have_mass(client: int) -> None:
    """Of two balls the first one loses it: what moves comes first, so their states would be taken for each other's."""
    balls = [ball(client, [0.2 * i, 0, RADIUS], [0, 0, -0.1]) for i in range(2)]
    callback, _ = in_contact(client, balls, plane(client), pair_of())
    step(callback)
    saved = callback.save()
    p.changeDynamics(balls[0], -1, mass=0.0, physicsClientId=client)
    callback.look()
    with pytest.raises(ValueError, match="contacts or masses have been added or removed since"):
        callback.restore(saved)
    p.changeDynamics(balls[0], -1, mass=1.0, physicsClientId=client)
    callback.look()
    callback.restore(saved)


def test_sets_meet_each_pair_once(client: int) -> None:
    floor, wall = plane(client), plane(client)
    balls = [ball(client, [0.2 * i, 0, RADIUS + 1e-3], [0, 0, -1.0], radius=RADIUS) for i in range(3)]
    callback, handle = in_contact(client, balls, [*balls, floor, (wall, -1)], pair_of())
    assert callback.states(handle) == []
    with pytest.raises(ValueError, match="use states"):
        callback.state(handle)
    with pytest.raises(ValueError, match="have contact 0 already"):
        callback.add_contact(floor, balls[1], pair_of())
    step(callback)
    touching = callback.states(handle)
    assert {(state.a, state.b) for state in touching} == {
        ((body, -1), (ground, -1)) for body in balls for ground in (floor, wall)
    }
    assert all(state.impulse[2] > 0.0 for state in touching)
    callback.remove_contact(handle)
    callback.add_contact(floor, balls[1], pair_of())


def test_two_contacts_share_an_impact(client: int) -> None:
    """A ball falls into a right-angled groove of two planes along its middle: it leaves as it came, by symmetry."""
    walls = [
        p.createMultiBody(
            0.0, shape(client, p.GEOM_PLANE, planeNormal=[s * np.sqrt(0.5), 0, np.sqrt(0.5)]), physicsClientId=client
        )
        for s in (1, -1)
    ]
    body = ball(client, [0, 0, np.sqrt(2.0) * RADIUS + 2e-3], [0, 0, -1.0])
    callback, _ = in_contact(client, body, walls, pair_of(friction=0.0, restitution=1.0))
    step(callback, 3)
    velocity, spin = velocities(client, body)
    np.testing.assert_allclose(velocity, [0, 0, 1.0], atol=1e-3)
    np.testing.assert_allclose(spin, 0.0, atol=1e-9)


def test_pile_in_a_box_comes_to_rest(client: int) -> None:
    """Nine balls in a box of planes: they lose their energy, and the floor and walls carry their weight."""
    g, radius = 9.81, 0.02
    room = [plane(client)] + [
        p.createMultiBody(
            0.0, shape(client, p.GEOM_PLANE, planeNormal=[*normal, 0]), -1, [-0.05 * normal[0], -0.05 * normal[1], 0],
            physicsClientId=client,
        )
        for normal in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]  # fmt: skip
    rng = np.random.default_rng(1)
    places = [[x, y, 0.03 + z] for z in (0.0, 0.05) for x in (-0.025, 0.025) for y in (-0.025, 0.025)]
    balls = [ball(client, np.array(place) + rng.uniform(-2e-3, 2e-3, 3), radius=radius, mass=0.26) for place in places]
    balls.append(ball(client, [0.003, 0.004, 0.15], radius=radius, mass=0.26))
    p.setGravity(0, 0, -g, client)
    callback, handle = in_contact(client, balls, [*balls, *room], pair_of(restitution=0.5, friction=0.3), substeps=30)
    step(callback, 600)
    carried = []
    for _ in range(50):
        step(callback)
        carried.append(sum(state.impulse[2] for state in callback.states(handle) if state.b[0] in room) * 240)
    assert np.mean(carried) == pytest.approx(9 * 0.26 * g, rel=1e-3)
    for body in balls:
        place = np.array(p.getBasePositionAndOrientation(body, client)[0])
        assert place[2] > radius - 1e-5
        assert np.abs(place[:2]).max() < 0.03 + 1e-5
        assert np.linalg.norm(velocities(client, body)[0]) < 0.02


def test_a_ball_on_a_sloping_height_field_moves_as_on_a_plane(client: int) -> None:
    """PyBullet does not list height fields among the collision shapes of a body."""
    count, slope = 33, 0.2
    heights = [0.1 * slope * (i - count // 2) for _ in range(count) for i in range(count)]
    field = shape(
        client, p.GEOM_HEIGHTFIELD, meshScale=[0.1, 0.1, 1.0], heightfieldData=heights,
        numHeightfieldRows=count, numHeightfieldColumns=count,
    )  # fmt: skip
    p.setGravity(0, 0, -9.81, client)
    ends = []
    for number, ground in enumerate((field, shape(client, p.GEOM_PLANE, planeNormal=[-slope, 0.0, 1.0]))):
        floor = p.createMultiBody(0.0, ground, physicsClientId=client)
        body, callback = ball(client, [0.217, 0.031, 0.2]), ContactCallback(client)
        callback.add_contact(body, links_of(floor, client=client) if number == 0 else floor, pair_of(radius=RADIUS))
        for _ in range(240):
            callback.step()
        ends.append(np.concatenate([p.getBasePositionAndOrientation(body, client)[0], *velocities(client, body)]))
        callback.remove_all()
        p.removeBody(body, client)
        p.removeBody(floor, client)
    assert ends[0][0] < 0.1  # it has bounced and rolled down
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-4)


def test_a_ball_on_a_mesh_or_cylinder_is_measured(client: int) -> None:
    """With a radius given: the engine finds the place, the law bounces it."""
    corners = [[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]
    grounds = [
        shape(client, p.GEOM_MESH, vertices=corners), shape(client, p.GEOM_CYLINDER, radius=0.1, height=0.2),
    ]  # fmt: skip
    callback = ContactCallback(client)
    p.setTimeStep(1e-4, client)
    balls = []
    for i, kind in enumerate(grounds):
        ground = p.createMultiBody(0.0, kind, -1, [i, 0, -0.1], physicsClientId=client)
        balls.append(ball(client, [i, 0, RADIUS + 2e-3], [0, 0, -1.0]))
        for body in (ground, balls[-1]):
            p.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=client)
        callback.add_contact(balls[-1], ground, pair_of(radius=RADIUS, friction=0.0))
    step(callback, 30)
    for body in balls:
        assert velocities(client, body)[0][2] == pytest.approx(0.93, abs=2e-3)


@pytest.mark.parametrize("ball_first", [True, False])
def test_forces_told_are_those_on_a(client: int, ball_first: bool) -> None:
    """A ball that slides along x on a plane: the plane pushes it up and back, and itself is pushed down and on."""
    floor, body = plane(client), ball(client, [0, 0, RADIUS - 3e-7], [1.0, 0, 0])
    p.setGravity(0, 0, -9.81, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(*((body, floor) if ball_first else (floor, body)), pair_of(restitution=0.5))
    step(callback, 40)
    state, sign = callback.state(handle), 1.0 if ball_first else -1.0
    assert (state.a[0] == body) == ball_first
    weight = 0.5 * 9.81
    np.testing.assert_allclose(state.force, sign * weight * np.array([-0.115, 0, 1]), rtol=1e-3, atol=1e-9)
    np.testing.assert_allclose(state.tangential_force, [-sign * 0.115 * weight, 0, 0], rtol=1e-3, atol=1e-9)
    assert state.normal_force == pytest.approx(weight, rel=1e-3)


def test_a_body_and_its_link_as_a_tuple_are_not_taken_for_two_bodies(client: int) -> None:
    """`links_of` gives such tuples; (arm, 1) was a set of the arm's base and of body 1."""
    robot, thing = arm(client, 0.0, ("REVOLUTE", "REVOLUTE")), ball(client, [0, 0, 5])
    callback, link = ContactCallback(client), (robot, 1)
    with pytest.raises(ValueError, match=r"body_a = \(0, 1\): two bodies, or a body's link\?.* \[0, 1\] or \[\("):
        callback.add_contact(link, thing, pair_of())
    callback.add_contact([link], (thing, ball(client, [0, 0, 6])), pair_of())
    assert {key for key, _ in callback.save().rows_of} == {link, (thing, -1), (2, -1)}
