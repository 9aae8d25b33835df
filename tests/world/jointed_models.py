"""Random branching models for MuJoCo, and their trees in a world."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from contactlaw.world.arrays import empty, with_bodies, with_tree
from contactlaw.world.data.records import Arrays
from contactlaw.world.trees.tree_records import TreeRecords, numbers, write_coordinates

FREE, BALL, SLIDE, HINGE = (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_SLIDE,
                            mujoco.mjtJoint.mjJNT_HINGE)  # fmt: skip
CHOICES = [[HINGE], [SLIDE], [BALL], [HINGE, HINGE, SLIDE], [SLIDE, BALL], [], [HINGE, HINGE], [HINGE]]


def random_model(seed: int, bodies: int = 7, base: str = "random", damping: float = 0.0) -> mujoco.MjModel:
    """One tree, on a static body that stands askew; a body without joints is among its bodies now and then.

    base: "free", or "fixed": the first body has a hinge; else one of both.
    """
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    spec.option.gravity = [1.0, -2.0, -9.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    free = base == "free" or (base == "random" and rng.random() < 0.5)
    stand = spec.worldbody
    if not free:
        stand = stand.add_body(pos=rng.normal(size=3), quat=quaternion(rng))
        stand = stand.add_body(pos=rng.normal(size=3), quat=quaternion(rng))
    made: list[Any] = [stand]
    for number in range(bodies):
        parent = made[0] if number == 0 else made[1 + rng.integers(max(0, number - 3), number)]
        massless = number > 0 and rng.random() < 0.15
        inertia = rng.uniform(0.5, 1.0, 3) * 1e-3
        more = {} if massless else {"mass": rng.uniform(0.1, 1.0), "inertia": inertia, "explicitinertial": True}
        body = parent.add_body(pos=0.2 * rng.normal(size=3), quat=quaternion(rng), **more)
        if not massless:
            body.ipos, body.iquat = 0.05 * rng.normal(size=3), quaternion(rng)
        made.append(body)
        kinds = ([FREE] if free else [HINGE]) if number == 0 else CHOICES[rng.integers(len(CHOICES))]
        for kind in [] if massless else kinds:
            body.add_joint(
                type=kind, axis=rng.normal(size=3), pos=0.05 * rng.normal(size=3) * (kind != FREE),
                ref=rng.normal(), armature=0.01 * rng.random(), damping=[damping * rng.random(), 0.0, 0.0],
            )  # fmt: skip
    return spec.compile()


def quaternion(rng: np.random.Generator) -> np.ndarray:
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_state(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """Coordinates, velocities and applied forces of ordinary size."""
    rng, data = np.random.default_rng(seed), mujoco.MjData(model)
    data.qpos[:] = model.qpos0 + rng.normal(size=model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qvel[:] = 3.0 * rng.normal(size=model.nv)
    data.qfrc_applied[:] = rng.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    return data


def tree_of(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Arrays, TreeRecords, list[int]]:
    """A world with the model's one tree in its state; the rows, and the tree's bodies in the model."""
    bodies = [i for i in range(1, model.nbody) if model.body_treeid[i] >= 0]
    return *made_of(model, data, bodies), bodies


def made_of(model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int]) -> tuple[Arrays, TreeRecords]:
    """A world with the tree that these bodies are, in the state and under the applied forces of the data."""
    rows = TreeRecords(model, bodies)
    world = with_bodies(empty(), rows.bodies())
    stand = model.body_parentid[bodies[0]]
    own = {"first": 1, "gravity": model.opt.gravity, "base": data.xpos[stand], "base_turn": data.xquat[stand]}
    world = with_tree(world, rows.fields() | own).bound()
    rows.write(world, 0)
    numbers(world, 0, "f")[:] = data.qfrc_applied[rows.v_of]
    write_coordinates(world, 0, data.qpos[rows.q_of], data.qvel[rows.v_of])
    return world, rows
