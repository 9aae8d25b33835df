"""While all bodies are far apart in PyBullet: what the user does, what is read after a step, and who sleeps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pybullet_scenes import FREE, UP, arm, ball, in_contact, p, paddle, pair_of, plane, shape, slab, step, velocities

from contactlaw.pybullet_callback import ContactCallback
from contactlaw.pybullet_callback.trees import Tree
from contactlaw.world import World
from contactlaw.world.trees.tree_records import numbers, write_coordinates

HALF = [0.05, 0.03, 0.02]  # [m] of the box
TURNED = p.getQuaternionFromEuler([0.4, 0.7, 0.2])


def nothing(client: int, slab: int, body: int) -> None:
    pass


def move(client: int, body: int, height: float, velocity: Any, turn: Any = (0, 0, 0, 1)) -> None:
    p.resetBasePositionAndOrientation(body, [0.01, 0.02, height], turn, client)
    p.resetBaseVelocity(body, velocity, [0.5, -0.3, 0.1], client)


def put_close(client: int, slab: int, body: int) -> None:
    move(client, body, 0.1, [0.3, 0, -9.0])


def put_into(client: int, slab: int, body: int) -> None:
    move(client, body, 0.01, [0.0, 0, 0.0])


def strike(client: int, slab: int, body: int) -> None:
    p.resetBaseVelocity(body, [0.3, 0, -200.0], [0.0, 0.0, 1.0], client)


def turn_in_place(client: int, slab: int, body: int) -> None:
    place, velocity = p.getBasePositionAndOrientation(body, client)[0], velocities(client, body)
    p.resetBasePositionAndOrientation(body, place, TURNED, client)
    p.resetBaseVelocity(body, *(one.tolist() for one in velocity), client)


def lift_slab(client: int, slab: int, body: int) -> None:
    height = p.getBasePositionAndOrientation(body, client)[0][2]
    p.resetBasePositionAndOrientation(slab, [0, 0, height - 0.18], [0, 0, 0, 1], client)


def push(client: int, slab: int, body: int) -> None:
    place = p.getBasePositionAndOrientation(body, client)[0]
    p.applyExternalForce(body, -1, [100.0, 30.0, -3e4], place, p.WORLD_FRAME, client)


def longer_step(client: int, slab: int, body: int) -> None:
    p.setTimeStep(0.1, client)
    p.resetBaseVelocity(body, [0, 0, -20.0], physicsClientId=client)


def other_gravity(client: int, slab: int, body: int) -> None:
    p.setGravity(0, 0, -1e5, client)


def paths(client: int, body: int, floor: int, act: Callable[[int, int, int], None], read_all: bool) -> np.ndarray:
    """Positions, orientations, and velocities over 20 steps; `act` is called in flight, before the 6th step.

    read_all: setting the state anew makes each step begin with a reading of everything.
    """
    callback, _ = in_contact(client, body, floor, pair_of(), dt=1 / 240, gravity=9.81)
    out = []
    for i in range(20):
        if i == 5:
            act(client, floor, body)
        if read_all:
            callback.restore(callback.save())
        callback.step()
        x, q = p.getBasePositionAndOrientation(body, client)
        out.append([*x, *q, *np.concatenate(velocities(client, body))])
    return np.array(out)


def box(client: int, spin: Any) -> int:
    """A box that flies and tumbles."""
    body = p.createMultiBody(0.5, shape(client, p.GEOM_BOX, halfExtents=HALF), -1, UP.tolist(), physicsClientId=client)
    p.changeDynamics(body, -1, physicsClientId=client, **FREE)
    p.resetBaseVelocity(body, [0.3, 0, 1.0], spin, client)
    return body


ON_BOXES = (nothing, put_close, put_into, turn_in_place, lift_slab)
ACTS = (*ON_BOXES, strike, push, longer_step, other_gravity)


@pytest.mark.parametrize(
    ("act", "kind"), [(act, "ball") for act in ACTS] + [(act, kind) for act in ON_BOXES for kind in ("box", "fast box")]
)
def test_what_is_done_in_flight_is_noticed_in_the_same_step(act: Callable[[int, int, int], None], kind: str) -> None:
    """As if all bodies had been read before each step."""
    found = []
    for read_all in (False, True):
        client = p.connect(p.DIRECT)
        spin = [3.0, -5.0, 2.0] if kind == "box" else [30.0, 250.0, 20.0]
        body = ball(client, UP, [0.3, 0, 1.0], spin) if kind == "ball" else box(client, spin)
        found.append(paths(client, body, slab(client), act, read_all))
        p.disconnect(client)
    flown, known = found
    assert flown == pytest.approx(known, rel=1e-9, abs=1e-10)


def test_a_mass_that_is_changed_in_flight_counts_in_an_impact_of_the_same_step(client: int) -> None:
    one, other = ball(client, UP), ball(client, UP + [0.3, 0, 0])
    mass, (moment, *_) = (p.getDynamicsInfo(one, -1, client)[i] for i in (0, 2))
    callback, _ = in_contact(client, one, other, pair_of(), dt=1 / 240)
    step(callback, 5)
    p.changeDynamics(one, -1, mass=3.0 * mass, localInertiaDiagonal=[3.0 * moment] * 3, physicsClientId=client)
    p.resetBaseVelocity(one, [100.0, 0, 0], physicsClientId=client)
    step(callback, 2)
    (first, _), (second, _) = (velocities(client, body) for body in (one, other))
    assert second[0] > 0.0
    assert 3.0 * first[0] + second[0] == pytest.approx(300.0, rel=1e-9)


@pytest.mark.parametrize("kind", ["box", "uneven ball"])
def test_what_tumbles_in_flight_keeps_its_energy_and_angular_momentum(client: int, kind: str) -> None:
    """In Bullet's own flight a box's energy falls by half in this second, its angular momentum by a quarter."""
    spin = [30.0, 20.0, 25.0]
    body = box(client, spin) if kind == "box" else ball(client, UP, [0.3, 0, 1.0], spin)
    if kind != "box":
        p.changeDynamics(body, -1, localInertiaDiagonal=[1e-4, 2e-4, 2.5e-4], physicsClientId=client)
    callback, _ = in_contact(client, body, slab(client), pair_of(), dt=1 / 240)
    inertia = np.array(p.getDynamicsInfo(body, -1, client)[2])

    def turning() -> tuple[float, float]:
        axes = np.reshape(p.getMatrixFromQuaternion(p.getBasePositionAndOrientation(body, client)[1]), (3, 3))
        spin = axes.T @ velocities(client, body)[1]
        return float(spin @ (inertia * spin)), float(np.linalg.norm(inertia * spin))

    callback.step()
    before = turning()
    step(callback, 240)
    assert turning() == pytest.approx(before, rel=1e-4)


@pytest.mark.parametrize("damping", [0.0, 1e-4])
def test_a_chain_that_tumbles_in_flight_gains_no_energy(client: int, damping: float) -> None:
    """Nor loses any without damping. In Bullet's own flight it gains a seventh of it in these two seconds."""
    body, dt = arm(client, 2.0, ("REVOLUTE", "SPHERICAL"), (0, 0, 5)), 1 / 240
    p.changeDynamics(body, 0, jointDamping=damping, physicsClientId=client)
    p.resetBaseVelocity(body, [0, 0, 0], [8.0, -6.0, 7.0], client)
    callback, _ = in_contact(client, body, plane(client), pair_of(), dt=dt)
    one, world = Tree(client, [body]), World(gravity=0.0)
    one.add_to(world)
    arrays = world.arrays.bound()

    def energy() -> float:
        q, read, _ = map(np.array, one.read())
        v = read
        for _ in range(30):  # Bullet's velocities are those of half a step before
            write_coordinates(arrays, 0, q, v)
            v = read + 0.5 * dt * numbers(arrays, 0, "a")
        return world.energy.kinetic

    step(callback)
    first, found = energy(), []
    for _ in range(48):
        step(callback, 10)
        found.append(energy() / first)
    assert max(found) < 1.0 + 1e-7
    assert damping > 0.0 or min(found) > 1.0 - 1e-7


@pytest.mark.parametrize("near", [False, True], ids=["far", "along the slab"])
def test_balls_in_flight_are_read_once_a_step(client: int, monkeypatch: pytest.MonkeyPatch, near: bool) -> None:
    """Their velocities follow from their poses. Two that fly side by side do not near each other, nor the slab."""
    places = [[-0.5, y, 0.06] for y in (0.0, 0.06)] if near else [UP]
    bodies = [ball(client, place, [10.0, 0, 0] if near else [0.3, 0, 1.0]) for place in places]
    calls: Counter[str] = Counter()

    def counted(name: str) -> Callable[..., Any]:
        own = getattr(p, name)

        def call(*args: Any) -> Any:
            calls[name] += 1
            return own(*args)

        return call

    for name in ("getBasePositionAndOrientation", "getBaseVelocity"):
        monkeypatch.setattr(p, name, counted(name))
    callback, _ = in_contact(client, bodies, [*bodies, slab(client)], pair_of(), dt=1 / 240, gravity=9.81)
    step(callback, 5)
    calls.clear()
    step(callback, 10)
    assert calls == {"getBasePositionAndOrientation": 10 * len(bodies) + 10}  # of balls and slab


@pytest.mark.parametrize("link", [-1, 0], ids=["ball", "on a joint"])
def test_bullet_puts_no_body_to_sleep_that_the_law_may_hit(client: int, link: int) -> None:
    """Bullet would set the velocity that an impact gives it to zero in the next step, and leave it where it is."""
    target = paddle(client) if link == 0 else ball(client, [0.4, 0, 0])
    p.changeDynamics(target, -1, activationState=p.ACTIVATION_STATE_ENABLE_SLEEPING, physicsClientId=client)
    hits = ball(client, [0.4, 0, 0.5], [0, 0, -0.2])
    callback, handle = in_contact(client, target, hits, pair_of(), dt=0.01, link_a=link)
    step(callback, 300)
    assert callback.ledger(handle).impacts == 1
    speed = 0.4 * p.getJointState(target, 0, client)[1] if link == 0 else -velocities(client, target)[0][2]
    assert speed + velocities(client, hits)[0][2] == pytest.approx(0.93 * 0.2, rel=2e-2)


def test_what_lies_on_bullets_own_ground_is_at_rest(client: int) -> None:
    """A chain whose contacts with the ground are Bullet's own, with the law for a ball that is far away. Read half a
    step of fall before that, it would rise by 20 mm/s."""
    p.setGravity(0, 0, -9.81, client)
    p.setTimeStep(1 / 240, client)
    plane(client)
    chain, far = arm(client, 1.0, ("REVOLUTE", "PRISMATIC"), (0, 0, 0.12)), ball(client, [9, 0, 1])
    p.changeDynamics(chain, 0, jointDamping=0.1, physicsClientId=client)
    callback = ContactCallback(client)
    callback.add_contact(far, chain, pair_of(radius=0.1))
    step(callback, 1200)
    assert np.linalg.norm(velocities(client, chain)[0]) < 2e-3


def test_a_ball_that_strikes_what_lies_on_bullets_own_ground_does_not_lift_it(client: int) -> None:
    """The ground's push on it is an impulse of Bullet's step, as of gravity alone it would rise by 20 mm/s; the ball
    has the momentum for 9 mm/s."""
    p.setTimeStep(1 / 240, client)
    plane(client)
    sled = p.createMultiBody(
        5.0, shape(client, p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.1]), -1, [0, 0, 0.1], linkMasses=[0.5],
        linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1], linkPositions=[[0.3, 0, 0]],
        linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, -0.05]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE],
        linkJointAxis=[[0, 1, 0]], physicsClientId=client,
    )  # fmt: skip
    p.changeDynamics(sled, 0, jointDamping=0.05, physicsClientId=client)
    p.setJointMotorControl2(sled, 0, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
    hits = ball(client, [0, 0, 0.4], radius=0.02, mass=0.01)
    callback, handle = in_contact(client, hits, sled, pair_of(restitution=0.8, radius=0.02), gravity=9.81)
    step(callback, 20)
    for _ in range(200):
        step(callback)
        assert abs(velocities(client, sled)[0][2]) < 0.01
    assert callback.ledger(handle).impacts >= 3
