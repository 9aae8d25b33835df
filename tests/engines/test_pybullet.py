"""The law inside PyBullet: impacts against `rebound`, conservation, and what the callback asks for.

Tolerances: the scheme is second order; 100 steps a contact leave below 5e-3 in psi_2, 50 below 1e-2, and what does not
fall with the step is the reference's own error and that of 16 nodes.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from contactlaw import LAWS, MATERIALS, ContactPair, ContactWarning, rebound

p = pytest.importorskip("pybullet")

from contactlaw.kernels.contact import MASS  # noqa: E402
from contactlaw.pybullet_callback import ContactCallback  # noqa: E402
from contactlaw.pybullet_callback.geometry import Mechanism, read_motion  # noqa: E402

RADIUS = 0.0254
UP = np.array([0.0, 0.0, 1.0])
FREE = {"linearDamping": 0.0, "angularDamping": 0.0, "maxJointVelocity": 1e6, "jointDamping": 0.0}
# Material, friction, restitution, approach speed [m/s]: such that the overlap stays below a hundredth of the radius.
CASES = {"steel": (0.115, 0.93, 1.0), "rubber": (2.4, 0.86, 0.05)}


@pytest.fixture
def client() -> Iterator[int]:
    number = p.connect(p.DIRECT)
    yield number
    p.disconnect(number)


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


def run(client: int, callback: Callable[[], None], steps: int) -> None:
    for _ in range(steps):
        callback()
        p.stepSimulation(client)


def pair_of(material: str = "steel", **changes: Any) -> ContactPair:
    mu, e, _ = CASES[material]
    m = MATERIALS[material]
    settings: dict[str, Any] = {"friction": mu, "restitution": e} | changes
    return ContactPair(m, m, **settings)


def impact(
    client: int, material: str, psi_1: float, steps: int, *,
    launch: str = "oblique", angle: float = 0.0, phase: float = 0.0, gyration2: float = 0.4,
    ground: Callable[[int], int] = plane, law: str = "microslip", planar: bool = False, ball_first: bool = True,
) -> tuple[float, float, float]:  # fmt: skip
    """One impact of a ball or puck on a flat fixed body: errors of psi_2 and of restitution, sideways velocity."""
    mu, e, speed = CASES[material]
    mass, pair = 0.5, pair_of(material, law=law)
    dt = pair_of(material, radius=RADIUS).contact_duration(mass, speed) / steps
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    sliding = psi_1 * mu / pair.kappa * speed
    if launch == "oblique":
        velocity, spin = sliding * along - speed * UP, np.zeros(3)
    else:
        velocity, spin = -speed * UP, sliding / RADIUS * np.cross(along, UP)
    floor = ground(client)
    body = ball(client, [0, 0, RADIUS + phase * dt * speed], velocity, spin, mass=mass, gyration2=gyration2)
    p.setTimeStep(dt, client)
    callback = ContactCallback(client)
    pairing = (body, floor) if ball_first else (floor, body)
    callback.add_contact(*pairing, pair, plane=np.cross(UP, along) if planar else None)
    run(client, callback, int(2.0 * steps))
    velocity, spin = velocities(client, body)
    contact = velocity - RADIUS * np.cross(spin, UP)
    psi_2 = pair.kappa / mu * float(contact @ along) / speed
    chi = pair.chi(mass, mass / (1.0 + 1.0 / gyration2))
    p.resetSimulation(client)
    error = psi_2 - float(rebound(psi_1, chi, law, e))
    return error, velocity[2] / speed - e, float(contact @ np.cross(UP, along))


@pytest.mark.parametrize("material", CASES)
@pytest.mark.parametrize("launch", ["oblique", "spin"])
@pytest.mark.parametrize(("steps", "tolerance"), [(50, 1e-2), (100, 5e-3)])
def test_impact_matches_rebound(client: int, material: str, launch: str, steps: int, tolerance: float) -> None:
    for number, psi_1 in enumerate((0.5, 1.2, 2.0, 4.0)):
        for phase in (0.0, 0.37, 0.8):
            angle = 0.7 * number + phase
            error, bounce, sideways = impact(client, material, psi_1, steps, launch=launch, angle=angle, phase=phase)
            assert abs(error) < tolerance
            assert abs(bounce) < 2e-3
            assert abs(sideways) < 1e-12


@pytest.mark.parametrize(
    "options",
    [
        {"gyration2": 0.3},
        {"gyration2": 0.5, "ground": slab},
        {"planar": True, "angle": 0.4},
        {"ball_first": False, "angle": 2.0},
        {"ground": slab, "launch": "spin"},
    ],
    ids=["puck", "puck on slab", "planar", "plane first", "slab"],
)
def test_every_set_up_matches_rebound(client: int, options: dict) -> None:
    for psi_1 in (0.5, 2.0):
        assert abs(impact(client, "steel", psi_1, 100, phase=0.3, **options)[0]) < 5e-3


@pytest.mark.parametrize("law", LAWS)
def test_every_law_matches_its_own_rebound(client: int, law: str) -> None:
    assert abs(impact(client, "steel", 1.2, 200, law=law, phase=0.5)[0]) < 6e-3


def test_error_falls_with_the_square_of_the_step(client: int) -> None:
    """Against the same impact at a fine step, averaged over phases: halving the step leaves a quarter."""

    def psi_2(steps: int) -> np.ndarray:
        return np.array([impact(client, "steel", 0.5, steps, phase=phase)[0] for phase in np.arange(8) / 8])

    fine = psi_2(1600).mean()
    coarse, medium = (np.sqrt(np.mean((psi_2(steps) - fine) ** 2)) for steps in (25, 100))
    assert np.log(coarse / medium) / np.log(4.0) > 1.7


def test_two_balls_keep_momentum_and_angular_momentum(client: int) -> None:
    masses, radii = (0.5, 0.2), (RADIUS, 0.018)
    places = [np.zeros(3), np.array([radii[0] + radii[1], 0.004, 0.002]) * 1.0001]
    bodies = [
        ball(client, places[0], [1.0, 0.1, 0.0], [3, 20, -30], radius=radii[0], mass=masses[0]),
        ball(client, places[1], [-0.5, 0.0, 0.2], [-10, 5, 40], radius=radii[1], mass=masses[1]),
    ]

    def totals() -> tuple[np.ndarray, np.ndarray, float]:
        momentum, angular, energy = np.zeros(3), np.zeros(3), 0.0
        for body, m, r in zip(bodies, masses, radii, strict=True):
            velocity, spin = velocities(client, body)
            place = np.array(p.getBasePositionAndOrientation(body, client)[0])
            momentum += m * velocity
            angular += m * np.cross(place, velocity) + 0.4 * m * r * r * spin
            energy += float(0.5 * m * velocity @ velocity + 0.2 * m * r * r * spin @ spin)
        return momentum, angular, energy

    before = totals()
    p.setTimeStep(1e-6, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(bodies[0], bodies[1], pair_of(restitution=1.0))
    forces = []
    for _ in range(300):
        run(client, callback, 1)
        forces.append(callback.state(handle).normal_force)
    after = totals()
    assert max(forces) > 0.0
    assert forces[-1] == 0.0
    np.testing.assert_allclose(after[0], before[0], atol=1e-14)
    np.testing.assert_allclose(after[1], before[1], atol=1e-15)
    assert after[2] < before[2]


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


def test_removing_a_contact_restores_the_native_response(client: int) -> None:
    floor, body, other = plane(client), ball(client, [0, 0, RADIUS]), ball(client, [1, 0, RADIUS])
    p.setGravity(0, 0, -9.81, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, floor, pair_of())
    for _ in range(60):  # without the callback: the one falls through, the other lies on its native contact
        p.stepSimulation(client)
    assert p.getBasePositionAndOrientation(body, client)[0][2] < 0.0
    assert p.getBasePositionAndOrientation(other, client)[0][2] == pytest.approx(RADIUS, abs=1e-3)
    p.resetBasePositionAndOrientation(body, [0, 0, RADIUS], [0, 0, 0, 1], client)
    p.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], client)
    callback.remove_contact(handle)
    run(client, callback, 60)
    assert p.getBasePositionAndOrientation(body, client)[0][2] == pytest.approx(RADIUS, abs=1e-3)
    with pytest.raises(ValueError, match="handle = 0"):
        callback.state(handle)


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


def test_restart_within_a_contact_is_exact(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-7], [0.2, 0.1, -1.0], [5, 3, 1])
    p.setTimeStep(1e-6, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, floor, pair_of())
    run(client, callback, 60)
    state, saved, force = p.saveState(client), callback.save(), callback.state(handle).tangential_force
    run(client, callback, 200)
    first = p.getBaseVelocity(body, client)
    p.restoreState(state, physicsClientId=client)
    callback.restore(saved)
    np.testing.assert_array_equal(callback.state(handle).tangential_force, force)
    run(client, callback, 200)
    assert p.getBaseVelocity(body, client) == first
    with pytest.raises(ValueError, match=r"saved\[0\]: shape"):
        callback.restore({handle: np.zeros(3)})
    with pytest.raises(ValueError, match="handle = 7"):
        callback.restore({7: np.zeros(3)})


def paddle(client: int, base_mass: float = 0.0) -> int:
    """A sphere-headed paddle on a hinge about y, with its head at the end of an arm along x."""
    head = shape(client, p.GEOM_SPHERE, radius=RADIUS)
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


def test_ball_on_a_hinged_paddle_conserves_energy(client: int) -> None:
    """Elastic and without friction: the energy after is that before to 1e-3 at some 70 steps a contact."""
    racket = paddle(client)
    x = p.getCollisionShapeData(racket, 0, client)[0][5][0] + p.getLinkState(racket, 0, 1, 1, client)[0][0]
    body = ball(client, [x + 0.005, 0.0, 2.0 * RADIUS], [0, 0, -1.0])
    p.setTimeStep(2e-6, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, racket, pair_of(restitution=1.0, friction=0.0), link_b=0)
    masses = []
    for _ in range(1500):
        run(client, callback, 1)
        if callback.state(handle).touching:
            masses.append(callback.state(handle).history[MASS])
    velocity, spin = velocities(client, body)
    mass_matrix, rate = Mechanism(client, racket).mass_matrix, p.getJointState(racket, 0, client)[1]
    energy = 0.25 * velocity @ velocity + 0.1 * RADIUS**2 * spin @ spin + 0.5 * mass_matrix[0, 0] * rate**2
    assert 10 < len(masses) < 300
    assert 0.0 < masses[0] < 0.5
    assert rate != 0.0
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


def test_long_step_is_refused_before_anything_changes(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-3], [0, 0, -1.0])
    duration = pair_of(radius=RADIUS).contact_duration(0.5, 1.0)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, floor, pair_of())
    for _ in range(2):  # the touch would be within this step; asking twice changes nothing
        with pytest.raises(ValueError, match=r"fixedTimeStep = 0.004167 s: does not resolve .* at most 1.69e-05 s"):
            callback()
    assert not callback.state(handle).history.any()
    p.setTimeStep(duration / 10.0, client)
    run(client, callback, 80)
    assert velocities(client, body)[0][2] == pytest.approx(0.93, abs=0.03)


def test_step_that_grows_during_a_contact_is_refused(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS], [0, 0, -1.0])
    p.setTimeStep(1e-6, client)
    callback = ContactCallback(client)
    callback.add_contact(body, floor, pair_of())
    run(client, callback, 50)
    p.setTimeStep(1e-4, client)
    with pytest.raises(ValueError, match=r"fixedTimeStep = 0\.0001 s"):
        callback()


def test_nothing_passes_through_unseen(client: int) -> None:
    """A thin plate, a quarter of a step's travel away and twenty times thinner than that."""
    plate = p.createMultiBody(0.0, shape(client, p.GEOM_BOX, halfExtents=[1, 1, 0.001]), physicsClientId=client)
    body = ball(client, [0, 0, 0.5], [0, 0, -50.0])
    callback = ContactCallback(client)
    callback.add_contact(body, plate, pair_of())
    with pytest.raises(ValueError, match="does not resolve"):
        run(client, callback, 10)
    assert p.getBasePositionAndOrientation(body, client)[0][2] > 0.0


def test_substeps_are_refused(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS])
    p.setPhysicsEngineParameter(numSubSteps=4, physicsClientId=client)
    callback = ContactCallback(client)
    with pytest.raises(ValueError, match="numSubSteps = 4"):
        callback.add_contact(body, floor, pair_of())


def test_shapes_without_a_radius_are_refused(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    tin = p.createMultiBody(1.0, shape(client, p.GEOM_CYLINDER, radius=0.1, height=0.2), physicsClientId=client)
    callback = ContactCallback(client)
    with pytest.raises(ValueError, match=r"radius = None: body 2 \(body_a\) is a cylinder"):
        callback.add_contact(tin, floor, pair_of())
    with pytest.raises(ValueError, match="both flat"):
        callback.add_contact(slab(client), floor, pair_of())
    callback.add_contact(tin, body, pair_of(radius=0.02))


@pytest.mark.parametrize("upright", [True, False])
def test_capsule_bounces_on_its_end_and_may_not_lie(client: int, upright: bool) -> None:
    floor = plane(client)
    turn = p.getQuaternionFromEuler([0, 0 if upright else np.pi / 2, 0])
    rod = p.createMultiBody(
        1.0, shape(client, p.GEOM_CAPSULE, radius=RADIUS, height=0.1), -1,
        [0, 0, RADIUS + (0.05 if upright else 0.0)], turn, physicsClientId=client,
    )  # fmt: skip
    p.changeDynamics(rod, -1, physicsClientId=client, **FREE)
    p.resetBaseVelocity(rod, [0, 0, -1.0], physicsClientId=client)
    p.setTimeStep(2e-6, client)
    callback = ContactCallback(client)
    callback.add_contact(rod, floor, pair_of())
    if upright:
        run(client, callback, 300)
        assert velocities(client, rod)[0][2] == pytest.approx(0.93, abs=1e-3)
    else:
        with pytest.raises(ValueError, match="capsule"):
            run(client, callback, 300)


@pytest.mark.parametrize("kind", ["edge", "side"])
def test_edges_and_sides_need_a_radius(client: int, kind: str) -> None:
    if kind == "edge":
        target, place = slab(client), [1.0 + 0.68 * RADIUS, 0, 0.68 * RADIUS]
    else:
        bar = shape(client, p.GEOM_CAPSULE, radius=RADIUS, height=0.2)
        target, place = p.createMultiBody(0.0, bar, physicsClientId=client), [1.99 * RADIUS, 0, 0.02]
    body = ball(client, place)
    p.setTimeStep(1e-7, client)
    callback = ContactCallback(client)
    handle = callback.add_contact(body, target, pair_of())
    with pytest.raises(ValueError, match=f"touches with the {kind} of its"):
        callback()
    callback.remove_contact(handle)
    callback.add_contact(body, target, pair_of(radius=0.6 * RADIUS))
    callback()


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
        ({"plane": (1.0, 1.0, 0.0)}, "plane = "),
    ],
)
def test_bad_input_is_refused_and_changes_nothing(client: int, change: dict, message: str) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    callback = ContactCallback(client)
    with pytest.raises(ValueError, match=message):
        callback.add_contact(**({"body_a": body, "body_b": floor, "pair": pair_of()} | change))
    assert callback.save() == {}


def test_a_pair_is_added_once(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    callback = ContactCallback(client)
    callback.add_contact(body, floor, pair_of())
    with pytest.raises(ValueError, match="have contact 0 already"):
        callback.add_contact(floor, body, pair_of())
    with pytest.raises(ValueError, match="client = 77"):
        ContactCallback(77)


def test_motion_out_of_the_plane_is_refused(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS], [0, 0, -1.0])
    p.setTimeStep(1e-6, client)
    callback = ContactCallback(client)
    callback.add_contact(body, floor, pair_of(), plane=(0.0, 0.6, 0.8))
    with pytest.raises(ValueError, match="plane = "):
        run(client, callback, 3)


def test_a_body_that_has_gone_is_an_error_until_its_contact_goes(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, 1.0])
    callback = ContactCallback(client)
    handle = callback.add_contact(body, floor, pair_of())
    callback()
    p.removeBody(body, client)
    with pytest.raises(ValueError, match=f"body {body}: removed"):
        callback()
    assert ball(client, [0, 0, RADIUS - 1e-6]) == body  # PyBullet gives the id away again
    with pytest.raises(ValueError, match=f"body {body}: removed, or no longer the one"):
        callback()
    callback.remove_contact(handle)
    callback()


def test_damping_and_clamp_are_warned_of_once(client: int) -> None:
    floor = plane(client)
    damped = ball(client, [0, 0, 1.0], [1, 0, 0], [0, 0, 5.0])
    p.changeDynamics(damped, -1, linearDamping=0.04, angularDamping=0.04, physicsClientId=client)
    clamped = ball(client, [1, 0, RADIUS], [0, 0, -1.0], [0, 150.0, 0])
    p.changeDynamics(clamped, -1, maxJointVelocity=100, physicsClientId=client)
    p.setTimeStep(1e-6, client)
    callback = ContactCallback(client)
    for body in (damped, clamped):
        callback.add_contact(body, floor, pair_of())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run(client, callback, 20)
    messages = [str(w.message) for w in caught if issubclass(w.category, ContactWarning)]
    assert len(messages) == 2
    assert f"body {clamped}: moves at 100.0" in messages[0] + messages[1]
    assert f"body {damped}: loses speed in free flight, linearDamping = angularDamping = 0.04" in "".join(messages)


def test_clean_bodies_raise_no_warning(client: int) -> None:
    floor, body = plane(client), ball(client, [0, 0, RADIUS + 1e-6], [0.1, 0, -1.0], [0, 0, 5.0])
    p.setGravity(0, 0, -9.81, client)
    p.setTimeStep(1e-6, client)
    callback = ContactCallback(client)
    callback.add_contact(body, floor, pair_of())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(client, callback, 300)
