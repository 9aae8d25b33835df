"""The law inside PyBullet: impacts against `rebound`, and conservation, with steps long and short.

Tolerances: a contact has 100 substeps at least, which leave below 1.5e-3 in psi_2 for steel, 3e-3 for rubber.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike
from pybullet_scenes import FREE, RADIUS, ball, p, pair_of, plane, shape, step, velocities

from contactlaw import ContactPair, Material
from contactlaw.pybullet_callback import ContactCallback


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
        step(callback, 100)
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
    step(callback, 50)
    assert (p.getBasePositionAndOrientation(body, client), p.getBaseVelocity(body, client)) == alone


@pytest.mark.parametrize("gravity", [0.0, 9.81])
@pytest.mark.parametrize("kick", [((0, 0, -40.0), (0, 0, 0)), ((0.1, 0, 0), (0, 200.0, 0)), ((0, 0, 1.0), (0, 1.0, 0))])
def test_a_velocity_set_far_from_everything_acts_in_the_next_step(client: int, kick: tuple, gravity: float) -> None:
    """It is seen only after Bullet's step, in which a rod may have struck: as if the callback began with that step."""

    def thrown(place: ArrayLike, steps: int) -> list[np.ndarray]:
        """Places before the step of the kick, and the whole state after it; the rod floats at first."""
        p.resetSimulation(client)
        p.setTimeStep(1 / 240, client)
        p.setGravity(0, 0, -gravity, client)
        floor, rod = plane(client), p.createMultiBody(
            1.0, shape(client, p.GEOM_CAPSULE, radius=0.02, height=0.4), physicsClientId=client
        )  # fmt: skip
        p.changeDynamics(rod, -1, physicsClientId=client, **FREE)
        p.resetBasePositionAndOrientation(rod, place[:3], place[3:], client)
        callback = ContactCallback(client)
        callback.add_contact(rod, floor, pair_of(restitution=1.0))
        step(callback, steps)
        before = np.concatenate(p.getBasePositionAndOrientation(rod, client))
        p.resetBaseVelocity(rod, *kick, physicsClientId=client)
        step(callback)
        return [
            before,
            *map(np.concatenate, (p.getBasePositionAndOrientation(rod, client), p.getBaseVelocity(rod, client))),
        ]

    before, *after = thrown([0, 0, 0.12, 0, 0.5**0.5, 0, 0.5**0.5], 4)
    _, *alone = thrown(before, 0)
    for one, two in zip(after, alone, strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-9)
    assert (after[1][2] > 0.0) == (kick[0][2] != 0.0 or abs(kick[1][1]) > 100.0)


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
            for _, callback, _ in scenes:
                step(callback)
        first, second = (p.getBaseVelocity(body, c) for c, _, body in scenes)
        assert first == second
        assert first[0][2] > 0.9
    finally:
        p.disconnect(other)


HINGED = {
    "linkMasses": [0.15], "linkVisualShapeIndices": [-1], "linkPositions": [[0, 0, 0.045]], "linkParentIndices": [0],
    "linkOrientations": [[0, 0, 0, 1]], "linkInertialFramePositions": [[0, 0, 0.03]], "linkJointAxis": [[1, 0, 0]],
    "linkInertialFrameOrientations": [[0, 0, 0, 1]], "linkJointTypes": [p.JOINT_REVOLUTE],
}  # fmt: skip


@pytest.mark.parametrize(
    ("hinged", "seed", "steps", "timestep", "spin", "restitution"),
    [(False, 2, 42, 1e-3, 20.0, 1.0), (True, 13, 14, 1 / 240, 5.0, 0.3)],
)
def test_bullets_greatest_speed_does_not_brake_what_is_slower(
    client: int, hinged: bool, seed: int, steps: int, timestep: float, spin: float, restitution: float
) -> None:
    """Bullet cuts speeds at 100 rad/s. No body here reaches 90: the judge is the same throw with that limit lifted.

    The step after an impact began with its mean force as a push, by which Bullet's speeds passed the limit: the free
    box went on at 23 rad/s instead of 80, with 29 % of its energy, and the joint of the other at 58 instead of 72.
    """
    nylon = Material(youngs_modulus=3e9, poissons_ratio=0.35)
    frictionless = ContactPair(nylon, nylon, friction=0.0, restitution=restitution)

    def thrown(**limit: float) -> np.ndarray:
        p.resetSimulation(client)
        p.setTimeStep(timestep, client)
        p.setGravity(0, 0, -9.81, client)
        rng = np.random.default_rng(seed)
        floor, box = plane(client), shape(client, p.GEOM_BOX, halfExtents=[0.03, 0.02, 0.04])
        links = HINGED | {"linkCollisionShapeIndices": [shape(client, p.GEOM_SPHERE, radius=0.025)]} if hinged else {}
        turn, height = rng.normal(size=4), 0.12 if hinged else 0.08
        body = p.createMultiBody(
            0.2, box, -1, [0, 0, height], turn / np.linalg.norm(turn), physicsClientId=client, **links
        )
        callback = ContactCallback(client)
        if hinged:
            p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
        for link in range(-1, hinged):
            p.changeDynamics(
                body, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client, **limit
            )
            callback.add_contact(body, floor, frictionless, link)
        p.resetBaseVelocity(body, [0.3, 0.1, -1.0], spin * rng.normal(size=3), client)
        out = []
        for _ in range(steps):
            step(callback)
            joint = p.getJointState(body, 0, client)[1] if hinged else 0.0
            out.append([*np.concatenate(velocities(client, body)), joint])
        return np.array(out)

    free = thrown(maxJointVelocity=1e6)
    assert 60.0 < abs(free).max() < 90.0
    np.testing.assert_allclose(thrown(), free, atol=1e-9)
