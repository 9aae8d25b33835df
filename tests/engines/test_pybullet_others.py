"""Bullet's own response, turned off for the pairs of contacts by rules, and for whole bodies by masks."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from pybullet_scenes import RADIUS, ball, in_contact, p, pair_of, plane, step, velocities

from contactlaw.pybullet_callback import ContactCallback
from sims.contact_point import static_overlap


def native_pairs(client: int, bodies: list[int]) -> set[tuple[int, int]]:
    """The pairs of bodies at one place that Bullet finds in contact."""
    p.performCollisionDetection(client)
    return {(a, b) for a, b in combinations(bodies, 2) if p.getContactPoints(a, b, physicsClientId=client)}


@pytest.mark.parametrize("seed", range(8))
def test_just_what_contacts_say_is_turned_off(client: int, seed: int) -> None:
    """Random sets with common members, in two callbacks: their pairs, or all pairs of their bodies; and given back."""
    rng = np.random.default_rng(seed)
    free = [ball(client, [1e-3 * i, 0, RADIUS - 1e-3]) for i in range(9)]
    bodies = [*free, plane(client), plane(client)]
    before = native_pairs(client, bodies)
    assert len(before) == 9 * 8 / 2 + 9 * 2
    callbacks, added, ruled = (ContactCallback(client), ContactCallback(client)), {}, []

    def held() -> set[tuple[int, int]]:
        return set[tuple[int, int]]().union(*added.values())

    for number in range(12):
        ones, twos = (rng.choice(bodies, int(rng.integers(1, 4)), replace=False).tolist() for _ in range(2))
        callback, others = callbacks[int(rng.integers(2))], number % 4 == 3
        try:
            handle = callback.add_contact(ones, twos, pair_of(radius=0.01), others=others)
        except ValueError:  # the two sets hold a pair of another contact, or no pair that may touch
            continue
        pairs = {(a, b) for a, b in before if (a in ones and b in twos) or (b in ones and a in twos)}
        own = {*ones, *twos}
        ruled += [(callback, handle)] if others else []
        added[callback, handle] = pairs if others else {(a, b) for a, b in before if a in own or b in own}
        assert native_pairs(client, bodies) == before - held()
    assert len(added) > 2
    for callback, handle in sorted(added, key=ruled.__contains__):  # a rule that is given back goes before masks
        callback.remove_contact(handle)
        del added[callback, handle]
        assert native_pairs(client, bodies) == before - held()


def test_it_takes_no_rule_a_pair(client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    floor, balls = plane(client), [ball(client, [0.1 * i, 0, 1]) for i in range(60)]
    calls, own = [], p.setCollisionFilterGroupMask
    monkeypatch.setattr(p, "setCollisionFilterPair", lambda *a: pytest.fail("a rule"))
    monkeypatch.setattr(p, "setCollisionFilterGroupMask", lambda *a: calls.append(own(*a)))
    ContactCallback(client).add_contact(balls, [*balls, floor], pair_of(), others=False)
    assert len(calls) == 61


@pytest.mark.parametrize(("before", "steps"), [(0, 3), (0, 40), (2, 1), (2, 40), (2, 0)])
def test_a_body_held_by_zero_mass_has_the_law_alone_when_it_is_let_go(client: int, before: int, steps: int) -> None:
    """Bullet puts a body that gets a mass into its own group again; its contact here does not bounce."""
    floor, held = plane(client), ball(client, [0, 0, 0.1])
    others = [ball(client, [0.2 + 0.1 * i, 0, RADIUS]) for i in range(2)]
    callback = ContactCallback(client)
    callback.add_contact([held, *others], [held, *others, floor], pair_of(restitution=1.0), others=False)
    p.setGravity(0, 0, -9.81, client)
    step(callback, before)
    p.resetBaseVelocity(held, [0, 0, 0], physicsClientId=client)
    p.changeDynamics(held, -1, mass=0.0, physicsClientId=client)
    step(callback, steps)
    step(callback, before)
    p.resetBaseVelocity(held, [0, 0, 0], physicsClientId=client)
    p.changeDynamics(held, -1, mass=0.5, localInertiaDiagonal=[0.2 * RADIUS**2] * 3, physicsClientId=client)
    if steps == 0:  # no step could show it
        callback.look()
    speeds = []
    for _ in range(60):
        step(callback)
        speeds.append(velocities(client, held)[0][2])
    assert max(speeds) == pytest.approx(-min(speeds), rel=0.06) and max(speeds) > 1.1


def test_it_is_true_or_false(client: int) -> None:
    with pytest.raises(ValueError, match="others = 1"):
        ContactCallback(client).add_contact(ball(client, [0, 0, 1]), plane(client), pair_of(), others=1)  # type: ignore


def test_after_reset_simulation_the_sets_may_be_added_again(client: int) -> None:
    callback = ContactCallback(client)
    for _ in range(2):
        floor, body, beside = plane(client), ball(client, [0, 0, RADIUS + 1e-3]), ball(client, [0.2, 0, RADIUS - 1e-3])
        p.setGravity(0, 0, -9.81, client)
        callback.add_contact([body], [floor], pair_of(restitution=0.5), others=False)
        step(callback, 60)
        assert velocities(client, body)[0][2] == 0.0
        assert native_pairs(client, [floor, body, beside]) == set()
        p.resetSimulation(client)
        callback.remove_all()


def test_a_contact_in_place_of_another_has_its_own_pair(client: int) -> None:
    """A ball that slides begins to roll faster; one that sleeps sinks to the overlap at rest of a softer material."""
    floor, sliding, lying = plane(client), ball(client, [0, 0, RADIUS], [2.0, 0, 0]), ball(client, [1, 0, RADIUS])
    callback, handle = in_contact(
        client, [sliding, lying], floor, pair_of(friction=0.02, restitution=0.3), dt=2e-3, gravity=9.81
    )
    step(callback, 50)
    callback.remove_contact(handle)
    new = pair_of("rubber", friction=0.1, restitution=0.3)
    callback.add_contact([sliding, lying], floor, new)
    before = velocities(client, sliding)[0][0]
    step(callback, 200)
    assert before - velocities(client, sliding)[0][0] == pytest.approx(0.1 * 9.81 * 0.4, rel=5e-3)
    depth = RADIUS - p.getBasePositionAndOrientation(lying, client)[0][2]
    assert depth == pytest.approx(static_overlap(new, 0.5 * 9.81, RADIUS), rel=1e-6)
