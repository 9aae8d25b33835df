"""The law inside PyBullet: impacts against `rebound`, and conservation, with steps long and short.

Tolerances: a contact has 100 substeps at least, which leave below 1.5e-3 in psi_2 for steel, 3e-3 for rubber.
"""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import LAWS

p = pytest.importorskip("pybullet")

from pybullet_scenes import (  # noqa: E402
    CASES,
    FREE,
    RADIUS,
    ball,
    impact,
    paddle,
    pair_of,
    plane,
    run,
    shape,
    slab,
    velocities,
)

from contactlaw.pybullet_callback import ContactCallback  # noqa: E402
from contactlaw.pybullet_callback.mechanism import Mechanism, read_motion  # noqa: E402
from sims.worlds.pybullet_world import true_velocity  # noqa: E402


@pytest.mark.parametrize("material", CASES)
@pytest.mark.parametrize("launch", ["oblique", "spin"])
@pytest.mark.parametrize("steps", [0.05, 0.7, 9.3, 50])
@pytest.mark.heavy
def test_impact_matches_rebound(client: int, material: str, launch: str, steps: float) -> None:
    for number, psi_1 in enumerate((0.5, 1.2, 2.0, 4.0)):
        for phase in (0.01, 0.37, 0.8):
            angle = 0.7 * number + phase
            error, bounce, sideways = impact(client, material, psi_1, steps, launch=launch, angle=angle, phase=phase)
            assert abs(error) < (1.5e-3 if material == "steel" else 3e-3)
            assert abs(bounce) < 5e-4
            assert abs(sideways) < 1e-12


@pytest.mark.parametrize(
    "options",
    [
        {"gyration2": 0.3},
        {"gyration2": 0.5, "ground": slab},
        {"ball_first": False, "angle": 2.0},
        {"ground": slab, "launch": "spin"},
    ],
    ids=["puck", "puck on slab", "plane first", "slab"],
)
def test_every_set_up_matches_rebound(client: int, options: dict) -> None:
    for psi_1 in (0.5, 2.0):
        assert abs(impact(client, "steel", psi_1, 100, phase=0.3, **options)[0]) < 5e-3


@pytest.mark.parametrize("law", LAWS)
def test_every_law_matches_its_own_rebound(client: int, law: str) -> None:
    assert abs(impact(client, "steel", 1.2, 200, law=law, phase=0.5)[0]) < 6e-3


def test_error_falls_with_the_square_of_the_substeps(client: int) -> None:
    """Against the same impact with fine substeps, over phases: halving them leaves a quarter."""

    def psi_2(substeps: int) -> np.ndarray:
        return np.array(
            [impact(client, "steel", 0.5, 0.1, phase=phase, substeps=substeps)[0] for phase in np.arange(8) / 8]
        )

    fine = psi_2(3000).mean()
    coarse, medium = (np.sqrt(np.mean((psi_2(substeps) - fine) ** 2)) for substeps in (20, 80))
    assert np.log(coarse / medium) / np.log(4.0) > 1.5


@pytest.mark.parametrize("friction", [0.0, 0.115, 2.0])
@pytest.mark.parametrize("slide", [0.02, 0.3, 1.0])
def test_elastic_impact_never_gains_energy(client: int, friction: float, slide: float) -> None:
    """To 1e-3, twice what 50 steps a contact leave of the bounce; without friction none is lost either."""
    speed, mass = 1.0, 0.5
    dt = pair_of(restitution=1.0, radius=RADIUS).contact_duration(mass, speed) / 50
    floor = plane(client)
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    for phase in (0.0, 0.25, 0.5, 0.75):
        body = ball(client, [0, 0, RADIUS + phase * dt], [slide, 0, -speed], [0, 0, 7.0], mass=mass)
        handle = callback.add_contact(body, floor, pair_of(restitution=1.0, friction=friction))
        run(client, callback, 100)
        velocity, spin = velocities(client, body)
        before = speed**2 + slide**2 + 0.4 * RADIUS**2 * 49.0
        ratio = (velocity @ velocity + 0.4 * RADIUS**2 * spin @ spin) / before
        assert ratio < 1.0 + 1e-3
        assert friction > 0.0 or ratio > 1.0 - 1e-3
        callback.remove_contact(handle)
        p.removeBody(body, client)


def test_free_flight_is_untouched(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0], [1.0, 0.5, 0.2], [5, -3, 2])
    p.setGravity(0, 0, -9.81, client)
    start = p.saveState(client)
    for _ in range(50):
        p.stepSimulation(client)
    alone = p.getBasePositionAndOrientation(body, client), p.getBaseVelocity(body, client)
    p.restoreState(start, physicsClientId=client)
    callback = ContactCallback(client)
    callback.add_contact(body, floor, pair_of())
    run(client, callback, 50)
    assert (p.getBasePositionAndOrientation(body, client), p.getBaseVelocity(body, client)) == alone


def test_two_clients_at_once_give_the_same(client: int) -> None:
    other = p.connect(p.DIRECT)
    try:
        scenes = []
        for c in (client, other):
            floor, body = plane(c), ball(c, [0, 0, RADIUS + 1e-7], [0.2, 0.1, -1.0], [5, 3, 1])
            p.setTimeStep(1e-6, c)
            callback = ContactCallback(c)
            callback.add_contact(body, floor, pair_of())
            scenes.append((c, callback, body))
        for _ in range(200):
            for c, callback, _ in scenes:
                run(c, callback, 1)
        first, second = (p.getBaseVelocity(body, c) for c, _, body in scenes)
        assert first == second
        assert first[0][2] > 0.9
    finally:
        p.disconnect(other)


@pytest.mark.parametrize("dt", [2e-6, 2e-3])
@pytest.mark.parametrize("base_mass", [0.0, 2.0])
def test_ball_on_a_hinged_paddle_conserves_energy(client: int, dt: float, base_mass: float) -> None:
    """Elastic and without friction: the energy after is that before to 1e-3, however long the step."""
    racket = paddle(client, base_mass)
    body = ball(client, [0.405, 0.0, 2.0 * RADIUS], [0, 0, -1.0])
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, racket, pair_of(restitution=1.0, friction=0.0), link_b=0, ledger=True)
    run(client, callback, 3 + int(8e-4 / dt))
    velocity, spin = true_velocity(callback, body)
    rate = np.array([p.getJointState(racket, 0, client)[1]])
    if base_mass:
        rate = np.concatenate([*p.getBaseVelocity(racket, client), rate])
    matrix = Mechanism(client, racket).mass_matrix
    energy = 0.25 * velocity @ velocity + 0.1 * RADIUS**2 * spin @ spin + 0.5 * rate @ matrix @ rate
    assert callback.ledger(handle).impacts == 1
    assert -0.9 < velocity[2] < 0.0
    assert abs(rate).max() > 0.1
    assert energy == pytest.approx(0.25, rel=1e-3)


@pytest.mark.parametrize("base_mass", [0.0, 2.0])
@pytest.mark.parametrize("joints", [("REVOLUTE", "PRISMATIC"), ("SPHERICAL", "REVOLUTE"), ("FIXED", "REVOLUTE")])
def test_mobility_is_what_the_engine_answers(client: int, base_mass: float, joints: tuple[str, str]) -> None:
    """J M^-1 J^T against the velocity gained in one short step under a force, after changeDynamics."""
    lump, turned = shape(client, p.GEOM_SPHERE, radius=0.1), p.getQuaternionFromEuler([0.5, -0.4, 0.8])
    types = [getattr(p, f"JOINT_{joint}") for joint in joints]
    body = p.createMultiBody(
        base_mass, lump, -1, [0, 0, 1], p.getQuaternionFromEuler([0.1, 0.2, 0.3]), [0.01, 0.02, 0.03], turned,
        linkMasses=[1.0, 0.5], linkCollisionShapeIndices=[lump] * 2, linkVisualShapeIndices=[-1] * 2,
        linkPositions=[[0.2, 0, 0], [0, 0.3, 0]], linkOrientations=[turned] * 2,
        linkInertialFramePositions=[[0.05, 0.02, 0.01], [0.1, 0, 0]], linkInertialFrameOrientations=[turned] * 2,
        linkParentIndices=[0, 1], linkJointTypes=types, linkJointAxis=[[0, 1, 0], [0, 0, 1]], physicsClientId=client,
    )  # fmt: skip
    for link in range(-1, 2):
        p.changeDynamics(body, link, localInertiaDiagonal=[0.01, 0.02, 0.025], physicsClientId=client, **FREE)
    for link, kind in enumerate(types):
        if kind in (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC):
            p.resetJointState(body, link, 0.7, physicsClientId=client)
            p.setJointMotorControl2(body, link, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
        elif kind == p.JOINT_SPHERICAL:
            p.resetJointStateMultiDof(body, link, turned, physicsClientId=client)
            p.setJointMotorControlMultiDof(
                body, link, p.POSITION_CONTROL, targetPosition=[0, 0, 0, 1], force=[0, 0, 0], positionGain=0,
                velocityGain=0, physicsClientId=client,
            )  # fmt: skip
    dt, start, mechanism = 1e-6, p.saveState(client), Mechanism(client, body)
    p.setTimeStep(dt, client)
    for link in range(-1, 2):
        place = np.array(read_motion(client, body, link).position) + [0.03, 0.05, -0.02]
        answer = np.zeros((3, 3))
        for j in range(3):
            p.restoreState(start, physicsClientId=client)
            p.applyExternalForce(body, link, np.eye(3)[j].tolist(), place.tolist(), p.WORLD_FRAME, client)
            p.stepSimulation(client)
            motion = read_motion(client, body, link)
            answer[:, j] = (motion.velocity + np.cross(motion.spin, place - motion.position)) / dt
        np.testing.assert_allclose(mechanism.mobility(mechanism.jacobian(link, place)), answer, atol=1e-9)
