"""Environments that step PyBullet by themselves: `stepping` takes their steps, and errors go through them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType

import pytest
from pybullet_scenes import RADIUS, ball, in_contact, p, pair_of, plane, velocities


class Env:
    """An environment as there are many: it knows a client, builds its world and steps it."""

    def __init__(self, step: Callable, client: int) -> None:
        self.step_bullet, self.client = step, client

    def reset(self) -> None:
        p.resetSimulation(physicsClientId=self.client)
        p.setGravity(0, 0, -9.81, self.client)
        self.floor, self.ball = plane(self.client), ball(self.client, [0, 0, RADIUS + 0.05])

    def step(self) -> tuple[float, float]:
        for _ in range(4):
            self.step_bullet()
        return p.getBasePositionAndOrientation(self.ball, self.client)[0][2], velocities(self.client, self.ball)[0][2]


def ways(client: int) -> dict[str, Callable]:
    """How a module may call stepSimulation."""
    utils = pytest.importorskip("pybullet_utils.bullet_client")
    own = utils.BulletClient.__new__(utils.BulletClient)
    own._client, own._shapes, own._pid = client, {}, 0
    module = sys.modules["stepper"] = ModuleType("stepper")
    exec("from pybullet import stepSimulation\ndef go(c):\n    stepSimulation(physicsClientId=c)", vars(module))
    return {
        "module": lambda: p.stepSimulation(client),
        "keyword": lambda: p.stepSimulation(physicsClientId=client),
        "bullet client": lambda: own.stepSimulation(),
        "by name": lambda: module.go(client),
    }


@pytest.mark.parametrize("way", ["module", "keyword", "bullet client", "by name"])
def test_an_environment_that_steps_by_itself(client: int, way: str) -> None:
    other = p.connect(p.DIRECT)  # whose steps are left alone
    env = Env(ways(client)[way], client)
    env.reset()
    env_alone = Env(lambda: None, other)
    env_alone.reset()
    callback, _ = in_contact(client, env.ball, env.floor, pair_of())
    with callback.stepping():
        found = [[env.step() for _ in range(10)]]
        p.stepSimulation(other)
    assert velocities(other, env_alone.ball)[0][2] == pytest.approx(-9.81 / 240)
    for take in (callback.step, lambda: (callback(), ways(client)[way]())):  # and so do the two other ways to step
        env.reset()
        env.step_bullet = take
        callback.remove_all()
        callback.add_contact(env.ball, env.floor, pair_of())
        found.append([env.step() for _ in range(10)])
    assert found[0] == found[1] == found[2] and max(speed for _, speed in found[0]) > 0.5
    p.disconnect(other)


def test_errors_go_through_the_environment_and_the_step_is_given_back(client: int) -> None:
    env = Env(lambda: p.stepSimulation(client), client)
    env.reset()
    callback, _ = in_contact(client, env.ball, env.floor, pair_of())
    with callback.stepping():
        env.step()
        with pytest.raises(ValueError, match="inside a `stepping`"):
            callback()
        with pytest.raises(ValueError, match=f"client {client}: its steps are taken"), callback.stepping():
            raise AssertionError("never here")
    env.reset()
    with pytest.raises(ValueError, match=r"body 0: removed.*resetSimulation"), callback.stepping():
        env.step()
    before = velocities(client, env.ball)[0][2]
    env.step()  # Bullet's own
    assert velocities(client, env.ball)[0][2] == pytest.approx(before - 4.0 * 9.81 / 240)
