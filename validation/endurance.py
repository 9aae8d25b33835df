"""A ball that bounces to rest and is kicked, again and again: memory stays what it is."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair

RADIUS, MASS, HEIGHT = 0.02, 0.26, 0.05  # [m], [kg], [m]
KICKS = 200  # in a run
STEP = 2e-3  # [s]


def resident() -> float:
    """Memory [MB] of this process that is in use."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20


def in_world() -> tuple[Callable[[int], Any], Callable[[Any], None]]:
    """What steps a ball without an engine, and what gives it a velocity [m/s]."""
    from contactlaw.world import World

    world = World(timestep=STEP)
    body = world.add_body(MASS, 0.4 * MASS * RADIUS**2, (0.0, 0.0, RADIUS + HEIGHT))
    world.add_contact(world.add_sphere(body, RADIUS), world.add_plane(None, (0, 0, 0), (0, 0, 1)), _pair())
    return world.step, lambda v: world.place(body, velocity=v)


def in_mujoco() -> tuple[Callable[[int], Any], Callable[[Any], None]]:
    """The same by the plugin."""
    import mujoco

    from contactlaw.mujoco_plugin import load_model

    model = load_model(
        f'<mujoco><option timestep="{STEP}"/><worldbody><geom name="floor" type="plane" size="9 9 1"/><body pos="0 0 '
        f'{RADIUS + HEIGHT}"><freejoint/><geom name="ball" size="{RADIUS}" mass="{MASS}"/></body></worldbody></mujoco>',
        [("ball", "floor", _pair())],
    )
    data = mujoco.MjData(model)

    def kick(velocity: Any) -> None:
        data.qvel[:3] = velocity

    return lambda n: mujoco.mj_step(model, data, n), kick


def _pair() -> ContactPair:
    return ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.2, 0.7)


def endure(engine: str, steps: int) -> dict[str, Any]:
    """So many steps; memory [MB] before and after."""
    step, kick = in_world() if engine == "none" else in_mujoco()
    rng = np.random.default_rng(0)
    step(2000)
    before = resident()
    for _ in range(KICKS):
        kick([*(0.05 * rng.normal(size=2)), np.sqrt(2.0 * 9.81 * HEIGHT) * rng.uniform(0.1, 0.9)])
        step(steps // KICKS)
    return {"engine": engine, "steps": steps, "before": before, "after": resident()}
