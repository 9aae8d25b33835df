"""The puck in MuJoCo: a free body without gravity, or one on a table."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from math import log, pi, sqrt
from time import perf_counter

import mujoco
import numpy as np

from contactlaw import mujoco_plugin
from sims.puck import Outcome, Puck
from sims.scene import NATIVE_DAMPED, NATIVES

BLOCK = (0.1, 4.0, 0.2)  # half lengths [m]; long, as fast rubber pucks travel far while they touch
GRAVITY = 9.81


def simulate(puck: Puck) -> Outcome:
    """Throw the puck."""
    model = build(puck).compile()
    data = mujoco.MjData(model)
    velocity, spin = puck.start_motion
    data.qvel[:] = [*velocity, 0.0, 0.0, spin]
    begin = perf_counter()
    mujoco.mj_step(model, data, puck.steps)
    wall_time = perf_counter() - begin
    after = data.qvel
    return Outcome(np.array([after[0], after[1], 0.0]), float(after[-1]), wall_time)


def build(puck: Puck) -> mujoco.MjSpec:
    """The scene before it is compiled."""
    spec = mujoco.MjSpec()
    spec.option.timestep = puck.step
    spec.option.gravity = [0.0, 0.0, -GRAVITY if puck.table else 0.0]
    turn = [np.cos(0.5 * puck.heading), 0.0, 0.0, np.sin(0.5 * puck.heading)]
    block = spec.worldbody.add_geom(
        name="block", type=mujoco.mjtGeom.mjGEOM_BOX, size=BLOCK, pos=-BLOCK[0] * puck.normal, quat=turn
    )
    body = spec.worldbody.add_body(name="puck", pos=puck.start)
    body.explicitinertial = True
    body.mass, body.ipos = puck.mass, [0.0, 0.0, 0.0]
    body.inertia = [0.6 * puck.inertia, 0.6 * puck.inertia, puck.inertia]
    ball = body.add_geom(name="rim", size=[puck.radius, 0.0, 0.0])
    body.add_freejoint()
    if puck.table:
        _add_table(puck, spec, body)
    if puck.law in NATIVES:
        _use_native(puck, spec)
    else:
        mujoco_plugin.add_contact(spec, ball, block, puck.pair, others=False)
    return spec


def _add_table(puck: Puck, spec: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
    half = 0.5 * puck.thickness
    spec.worldbody.add_geom(
        name="table", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], pos=[0, 0, -half], condim=1
    )
    slice_radius = sqrt(puck.radius**2 - half**2)
    body.add_geom(name="slice", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[slice_radius, half, 0.0], condim=1)


def _use_native(puck: Puck, spec: mujoco.MjSpec) -> None:
    """MuJoCo's own contact, as stiff as the law's, damped to the restitution by the formula for a linear spring.

    Or with the friction right and the restitution not: an elliptic cone, and friction critically damped.
    """
    stiffness = (pi / puck.contact_duration) ** 2
    rate = -log(puck.pair.restitution)
    damping = 2.0 * sqrt(stiffness) * rate / sqrt(rate**2 + pi**2)
    mu = puck.pair.friction
    pair = spec.add_pair(
        geomname1="rim", geomname2="block", condim=3, friction=[mu, mu, 0.005, 1e-4, 1e-4],
        solref=[-stiffness, -damping], solimp=[0.9999, 0.9999, 1e-3, 0.5, 2.0],
    )  # fmt: skip
    if puck.law == NATIVE_DAMPED:
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        pair.solreffriction = [-stiffness, -2.0 * sqrt(stiffness)]
