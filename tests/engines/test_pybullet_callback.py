"""What the callback refuses, warns of and asks for."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from pybullet_scenes import FREE, RADIUS, ball, in_contact, p, pair_of, plane, shape, slab, step, velocities

from contactlaw import ContactWarning
from contactlaw.pybullet_callback import ContactCallback


@pytest.mark.parametrize("height", [0.5, 0.4987, 0.41])
def test_nothing_passes_through_unseen(client: int, height: float) -> None:
    """A thin plate, a hundredth of what the ball goes in a step, in its middle."""
    plate = p.createMultiBody(0.0, shape(client, p.GEOM_BOX, halfExtents=[1, 1, 0.001]), physicsClientId=client)
    body = ball(client, [0, 0, height], [0, 0, -50.0])
    callback, _ = in_contact(client, body, plate, pair_of())
    step(callback, 5)
    assert velocities(client, body)[0][2] == pytest.approx(50.0 * 0.93, rel=1e-3)


def test_step_may_change_during_a_contact(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-9], [0, 0, -1.0])
    callback, _ = in_contact(client, body, floor, pair_of())
    for dt in (1e-6, 1e-5, 2e-6, 3e-5, 1e-4, 1e-3):
        p.setTimeStep(dt, client)
        step(callback, 3)
    assert velocities(client, body)[0][2] == pytest.approx(0.93, abs=5e-3)


def test_it_is_not_copied_or_pickled_with_its_client(client: int) -> None:
    for copy in (pickle.dumps, deepcopy):
        with pytest.raises(TypeError, match="pickle what `save` returns"):
            copy(ContactCallback(client))


def test_substeps_are_refused(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS])
    p.setPhysicsEngineParameter(numSubSteps=4, physicsClientId=client)
    callback = ContactCallback(client)
    with pytest.raises(ValueError, match="numSubSteps = 4"):
        callback.add_contact(body, floor, pair_of())


def test_shapes_without_a_radius_are_refused(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    two = p.createCollisionShapeArray(
        [p.GEOM_SPHERE, p.GEOM_PLANE], radii=[0.1, 0.0], planeNormals=[[0, 0, 1]] * 2, physicsClientId=client
    )
    tin = p.createMultiBody(1.0, two, physicsClientId=client)
    callback = ContactCallback(client)
    with pytest.raises(ValueError, match=r"radius = None: body 2 \(body_a\) is a compound"):
        callback.add_contact(tin, body, pair_of())
    with pytest.raises(ValueError, match="neither can move"):
        callback.add_contact(slab(client), floor, pair_of())
    callback.add_contact(tin, body, pair_of(radius=0.02))


def test_a_compound_of_balls_and_boxes_falls_as_links_fixed_to_each_other_do(client: int) -> None:
    """And lies on the floor with its weight."""
    p.setGravity(0, 0, -9.81, client)
    places, turn = [[-0.1, 0, 0], [0.1, 0, 0]], p.getQuaternionFromEuler([0.0, 0.0, 0.8])
    both = p.createCollisionShapeArray(
        [p.GEOM_SPHERE, p.GEOM_BOX], radii=[0.05, 0], halfExtents=[[0, 0, 0], [0.05, 0.03, 0.02]],
        collisionFramePositions=places, collisionFrameOrientations=[turn, turn], physicsClientId=client,
    )  # fmt: skip
    pieces = [shape(client, p.GEOM_SPHERE, radius=0.05), shape(client, p.GEOM_BOX, halfExtents=[0.05, 0.03, 0.02])]
    tilt = [0.3, 0.1, 0.2, 0.9]
    one = p.createMultiBody(1.0, both, -1, [0, 0, 0.3], tilt, physicsClientId=client)
    other = p.createMultiBody(
        1.0, -1, -1, [0, 2, 0.3], tilt, linkMasses=[0, 0], linkCollisionShapeIndices=pieces,
        linkVisualShapeIndices=[-1, -1], linkPositions=places, linkOrientations=[turn] * 2,
        linkInertialFramePositions=[[0, 0, 0]] * 2, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 0], linkJointTypes=[p.JOINT_FIXED] * 2, linkJointAxis=[[0, 0, 1]] * 2,
        physicsClientId=client,
    )  # fmt: skip
    for body in (one, other):
        p.changeDynamics(body, -1, localInertiaDiagonal=[2e-3, 6e-3, 7e-3], physicsClientId=client, **FREE)
    callback, floor = ContactCallback(client), plane(client)
    handle = callback.add_contact(one, floor, pair_of("rubber", restitution=0.5))
    callback.add_contact([(other, 0), (other, 1)], floor, pair_of("rubber", restitution=0.5))
    for _ in range(60):
        callback.step()
    places = [np.array(p.getBasePositionAndOrientation(body, client)[0]) for body in (one, other)]
    assert np.abs(places[1] - places[0] - [0, 2, 0]).max() < 1e-6
    for _ in range(1500):  # rubber rocks for seconds
        callback.step()
    assert sum(state.force[2] for state in callback.states(handle)) == pytest.approx(9.81, rel=1e-4)


CUBE = "vn 0 0 1\n" + "".join(
    "f " + " ".join(f"{{{corner}}}//1" for corner in face) + "\n"
    for face in ((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6),
                 (0, 6, 2), (1, 3, 7), (1, 7, 5))
)  # fmt: skip


def test_a_mesh_of_several_objects_is_a_hull_for_each(client: int, tmp_path: Path) -> None:
    """A ball falls between two cubes, which stand on the floor."""
    text, half = "", 0.05
    for number, x in enumerate((-0.1, 0.1)):
        corners = [f"v {x + a * half} {b * half} {c * half}\n" for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
        text += f"o cube{number}\n" + "".join(corners) + CUBE.format(*range(8 * number + 1, 8 * number + 9))
    (tmp_path / "cubes.obj").write_text(text)
    cubes = p.createMultiBody(
        1.0, shape(client, p.GEOM_MESH, fileName=str(tmp_path / "cubes.obj")), -1, [0, 0, half], physicsClientId=client
    )  # fmt: skip
    p.changeDynamics(cubes, -1, **FREE, physicsClientId=client)
    p.setGravity(0, 0, -9.81, client)
    body, floor = ball(client, [0, 0, 0.2]), plane(client)
    callback, _ = in_contact(client, [cubes, body], [cubes, body, floor], pair_of(restitution=0.5))
    step(callback, 400)
    assert p.getBasePositionAndOrientation(body, client)[0][2] == pytest.approx(RADIUS, rel=1e-3)
    assert p.getBasePositionAndOrientation(cubes, client)[0][2] == pytest.approx(half, rel=1e-3)


def test_shapes_that_pybullet_measures_are_those_of_its_own_client(client: int) -> None:
    other = p.connect(p.DIRECT)
    try:
        field = shape(other, p.GEOM_HEIGHTFIELD, meshScale=[1, 1, 1], heightfieldData=[0.0] * 16, numHeightfieldRows=4,
                      numHeightfieldColumns=4)  # fmt: skip
        table = p.createMultiBody(
            0.0, -1, -1, [0, 0, 0], linkMasses=[0.0], linkCollisionShapeIndices=[field],
            linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]],
            linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
            linkParentIndices=[0], linkJointTypes=[p.JOINT_FIXED], linkJointAxis=[[0, 0, 1]], physicsClientId=other,
        )  # fmt: skip
        p.setGravity(0, 0, -9.81, other)
        body, callback = ball(other, [0, 0, 0.1]), ContactCallback(other)
        handle = callback.add_contact(body, table, pair_of(radius=RADIUS), link_b=0)
        step(callback, 60)
        assert callback.ledger(handle).impacts > 0
    finally:
        p.disconnect(other)


@pytest.mark.parametrize("ground", [plane, slab])
@pytest.mark.parametrize("upright", [True, False])
@pytest.mark.parametrize("dt", [2e-6, 1 / 240])
def test_capsule_bounces_on_its_end_and_may_lie(client: int, dt: float, upright: bool, ground: Callable) -> None:
    floor = ground(client)
    turn = p.getQuaternionFromEuler([0, 0 if upright else np.pi / 2, 0])
    rod = p.createMultiBody(
        1.0, shape(client, p.GEOM_CAPSULE, radius=RADIUS, height=0.1), -1,
        [0, 0, RADIUS + 1e-6 + (0.05 if upright else 0.0)], turn, physicsClientId=client,
    )  # fmt: skip
    p.changeDynamics(rod, -1, physicsClientId=client, **FREE)
    p.resetBaseVelocity(rod, [0, 0, -1.0], physicsClientId=client)
    callback, handle = in_contact(client, rod, floor, pair_of(), dt=dt)
    step(callback, 2 + int(6e-4 / dt))
    velocity, spin = velocities(client, rod)
    assert velocity[2] == pytest.approx(0.93, abs=1e-3 if upright else 5e-3)
    assert np.abs(spin).max() < (1e-9 if upright else 2e-3)
    assert callback.ledger(handle).impacts == (1 if upright else 2)


def test_a_box_s_edge_without_a_radius_is_warned_of_once(client: int) -> None:
    target, body = slab(client), ball(client, [1.0 + 0.707 * RADIUS, 0, 0.707 * RADIUS])
    callback, handle = in_contact(client, body, target, pair_of(), dt=1e-7)
    with pytest.warns(ContactWarning, match=rf"body {body} and body {target}: touching at the edge of a box"):
        callback.step()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        step(callback, 3)
        callback.remove_contact(handle)
        callback.add_contact(body, target, pair_of(radius=0.6 * RADIUS))
        callback.step()


def test_a_ball_on_a_capsule_s_side_has_the_radius_of_both(client: int) -> None:
    bar = shape(client, p.GEOM_CAPSULE, radius=RADIUS, height=0.2)
    target = p.createMultiBody(0.0, bar, physicsClientId=client)
    body = ball(client, [2.0 * RADIUS + 1e-3, 0, 0], [-1.0, 0, 0])
    callback, handle = in_contact(client, body, target, pair_of(restitution=1.0))
    callback.step()
    ball_on_ball, on_plane = (
        (1.25 * 0.5 / (4 / 3 * pair_of(radius=r).effective_modulus * np.sqrt(r))) ** 0.4 for r in (0.5 * RADIUS, RADIUS)
    )  # Hertz's deepest overlap, 0.5 m v^2 = 0.4 k delta^2.5
    assert on_plane < callback.ledger(handle).greatest_overlap < ball_on_ball
    np.testing.assert_allclose(velocities(client, body)[0], [1.0, 0.0, 0.0], atol=1e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"body_a": 99}, "body_a = 99"),
        ({"body_a": True}, "body_a = True"),
        ({"body_b": 1.5}, "body_b = 1.5"),
        ({"link_a": 3}, "link_a = 3"),
        ({"link_b": -2}, "link_b = -2"),
        ({"body_a": 0}, "the same as a"),
        ({"pair": "steel"}, "pair = 'steel'"),
        ({"substeps": 9}, "substeps = 9"),
        ({"substeps": 20.5}, "substeps = 20.5"),
        ({"body_a": []}, "holds no bodies"),
        ({"body_a": [(1, -1, 0)]}, r"holds \(1, -1, 0\)"),
        ({"body_a": [1, 1], "body_b": [(1, -1)]}, "the same as a"),
    ],
)
def test_bad_input_is_refused_and_changes_nothing(client: int, change: dict, message: str) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    callback = ContactCallback(client)
    with pytest.raises(ValueError, match=message):
        callback.add_contact(**({"body_a": body, "body_b": floor, "pair": pair_of()} | change))
    assert callback.save().handles == ()


def test_a_pair_is_added_once(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    callback, _ = in_contact(client, body, floor, pair_of())
    with pytest.raises(ValueError, match="have contact 0 already"):
        callback.add_contact(floor, body, pair_of())
    with pytest.raises(ValueError, match="client = 77"):
        ContactCallback(77)


def test_a_body_that_has_gone_is_an_error_until_its_contact_goes(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    callback, handle = in_contact(client, body, floor, pair_of())
    callback.step()
    p.removeBody(body, client)
    with pytest.raises(ValueError, match=f"body {body}: removed"):
        callback.step()
    assert ball(client, [0, 0, RADIUS - 1e-6]) == body  # PyBullet gives the id away again
    with pytest.raises(ValueError, match=f"body {body}: removed, or no longer the one"):
        callback.step()
    callback.remove_contact(handle)
    callback.step()


def test_contacts_may_go_after_their_bodies(client: int) -> None:
    floor, body, other = plane(client), ball(client, [0, 0, 1.0]), ball(client, [1, 0, RADIUS + 1e-3], [0, 0, -1.0])
    callback, _ = in_contact(client, [body, other], [body, other], pair_of())
    handle = callback.add_contact(body, floor, pair_of())
    kept = callback.add_contact(other, floor, pair_of())
    step(callback)
    assert callback.state(kept).touching
    p.removeBody(body, client)
    callback.remove_contact(0)
    assert callback.state(kept).touching
    with pytest.raises(ValueError, match=f"body {body}: removed"):
        callback.step()
    callback.remove_contact(handle)
    step(callback)
    assert velocities(client, other)[0][2] == pytest.approx(0.93, abs=1e-3)
    callback.remove_all()
    callback.step()


def test_clean_bodies_raise_no_warning(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-6], [0.1, 0, -1.0], [0, 0, 5.0])
    callback, _ = in_contact(client, body, floor, pair_of(), dt=1e-6, gravity=9.81)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        step(callback, 300)


def test_deep_overlap_is_warned_of_once(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS], [0, 0, -80.0])
    callback, _ = in_contact(client, body, floor, pair_of("rubber"))

    def fall_twice() -> None:
        step(callback, 3)
        p.resetBaseVelocity(body, [0, 0, -90.0], [0, 0, 0], client)
        step(callback, 10)

    with pytest.warns(ContactWarning, match=f"body {body} and body {floor}: overlap over radius is") as caught:
        fall_twice()
    assert len(caught) == 1


@pytest.mark.parametrize("place", ["ball", "floor"])
def test_what_is_not_finite_is_refused_by_name(client: int, place: str) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3], [0, 0, -1.0])
    callback, handle = in_contact(client, body, floor, pair_of())
    bad = body if place == "ball" else floor
    p.resetBaseVelocity(bad, [np.nan, 0, 0], [0, 0, 0], client)
    with pytest.raises(ValueError, match=f"body {bad}: .* not finite"):
        callback.step()
    assert not callback.state(handle).touching


def test_removing_a_contact_restores_the_native_response(client: int) -> None:
    floor, body, other = plane(client), ball(client, [0, 0, RADIUS]), ball(client, [1, 0, RADIUS])
    callback, handle = in_contact(client, body, floor, pair_of(), gravity=9.81)
    for _ in range(60):  # without the callback: the one falls through, the other lies on its native contact
        p.stepSimulation(client)
    assert p.getBasePositionAndOrientation(body, client)[0][2] < 0.0
    assert p.getBasePositionAndOrientation(other, client)[0][2] == pytest.approx(RADIUS, abs=1e-3)
    p.resetBasePositionAndOrientation(body, [0, 0, RADIUS], [0, 0, 0, 1], client)
    p.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], client)
    callback.remove_contact(handle)
    step(callback, 60)
    assert p.getBasePositionAndOrientation(body, client)[0][2] == pytest.approx(RADIUS, abs=1e-3)
    with pytest.raises(ValueError, match="handle = 0"):
        callback.state(handle)


def test_ledgers_go_on_where_contacts_are_added_and_removed(client: int) -> None:
    floor, bodies = plane(client), [ball(client, [x, 0, RADIUS + 1e-3], [0, 0, -1.0]) for x in (0, 1)]
    callback, kept = in_contact(client, bodies[0], floor, pair_of())
    other = callback.add_contact(bodies[1], floor, pair_of())
    step(callback, 3)
    callback.remove_contact(other)
    ledger, pair = callback.ledger(kept), pair_of(radius=RADIUS)
    assert ledger.impacts == 1
    assert ledger.greatest_overlap == pytest.approx(pair.greatest_overlap(0.5, 1.0), rel=1e-3)
    assert ledger.greatest_force == pytest.approx(pair.greatest_force(0.5, 1.0), rel=1e-3)
    assert ledger.time_in_contact == pytest.approx(pair.contact_duration(0.5, 1.0), rel=0.05)
    assert ledger.normal_work == pytest.approx(0.25 * (1 - 0.93**2), rel=0.02)
    assert ledger.tangential_work == 0.0
    callback.add_contact(bodies[1], floor, pair_of())
    step(callback)
    assert callback.ledger(kept) == ledger


def test_masses_are_those_at_the_touch(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3], [0, 0, -1.0])
    callback, handle = in_contact(client, body, floor, pair_of())
    p.changeDynamics(body, -1, mass=2.0, localInertiaDiagonal=[0.8 * RADIUS**2] * 3, physicsClientId=client)
    step(callback)
    assert callback.state(handle).impulse[2] == pytest.approx(2.0 * 1.93, rel=1e-3)
    step(callback, 2)
    assert velocities(client, body)[0][2] == pytest.approx(0.93, abs=1e-3)


def test_bodies_of_a_batch_have_the_law(client: int) -> None:
    floor, places = plane(client), [[x, 0, RADIUS] for x in (0, 1, 2)]
    batch = p.createMultiBody(
        0.5, shape(client, p.GEOM_SPHERE, radius=RADIUS), batchPositions=places, physicsClientId=client
    )
    callback, _ = in_contact(client, batch, floor, pair_of())
    step(callback, 100)
    for body in batch:
        height = p.getBasePositionAndOrientation(body, physicsClientId=client)[0][2]
        assert height == pytest.approx(RADIUS, abs=1e-6)
    with pytest.raises(ValueError, match="body_a = 9: must be one of the bodies"):
        callback.add_contact(9, floor, pair_of())
