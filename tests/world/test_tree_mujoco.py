"""Trees of joints against MuJoCo: mass matrix, forces, Jacobians, accelerations, and free flight."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from contactlaw.world.data.frames import matrix_of
from contactlaw.world.data.records import Array, Arrays
from contactlaw.world.data.tree import AXIS, LINK
from contactlaw.world.step import step
from contactlaw.world.trees.tree_records import coordinates, numbers
from tests.world.jointed_models import made_of, random_model, random_state, tree_of
from tests.world.jointed_scenes import mass_matrix

SEEDS = range(40)


def jacobian(world: Arrays, number: int, member: int) -> Array:
    """Velocity of the centre of mass of a tree's body, and its spin, by the tree's velocities; shape (6, v_size)."""
    axes, tree = numbers(world, number, "axes").view(AXIS), world.trees[number]
    link = numbers(world, number, "links").view(LINK)[member]
    arm = world.bodies["position"][int(tree["first"]) + member] - tree["origin"]
    out = np.zeros((6, axes.size))
    k = int(link["first_axis"] + link["axes"]) - 1
    while k >= 0:
        spin = axes["spin"][k]
        out[:3, k], out[3:, k] = axes["velocity"][k] + np.cross(spin, arm), spin
        k = int(axes["parent"][k])
    return out


@pytest.mark.parametrize("seed", SEEDS)
def test_mass_matrix_forces_and_accelerations_are_those_of_mujoco(seed: int) -> None:
    model = random_model(seed, damping=0.1)
    data = random_state(model, seed)
    world, rows, _ = tree_of(model, data)
    full, bias = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    mujoco.mj_fullM(model, data, full)
    mujoco.mj_rne(model, data, 0, bias)
    np.testing.assert_array_equal(rows.q_of, np.arange(model.nq))
    np.testing.assert_allclose(mass_matrix(world, 0), full, rtol=0.0, atol=1e-12 * np.abs(full).max())
    a = numbers(world, 0, "a")
    ours = data.qfrc_applied - rows.damping * data.qvel - full @ a
    np.testing.assert_allclose(ours, bias, rtol=0.0, atol=1e-10 * np.abs(bias).max())
    condition = np.linalg.cond(full)
    np.testing.assert_allclose(a, data.qacc, rtol=0.0, atol=1e-14 * condition * np.abs(data.qacc).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_bodies_are_where_mujoco_has_them_and_move_so(seed: int) -> None:
    model = random_model(seed)
    data = random_state(model, seed)
    world, rows, bodies = tree_of(model, data)
    turn, place = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    for i, body in enumerate(bodies):
        member = int(rows.row[i])
        own = world.bodies[1 + member]
        axes = own["axes"].reshape(3, 3)
        np.testing.assert_allclose(own["position"] + axes @ rows.at[i], data.xpos[body], atol=1e-13)
        np.testing.assert_allclose(axes @ matrix_of(rows.quaternion[i]), data.xmat[body].reshape(3, 3), atol=1e-13)
        mujoco.mj_jac(model, data, place, turn, own["position"], body)
        np.testing.assert_allclose(jacobian(world, 0, member), np.vstack([place, turn]), atol=1e-13)
        np.testing.assert_allclose(own["velocity"], place @ data.qvel, atol=1e-12)
        np.testing.assert_allclose(own["spin"], turn @ data.qvel, atol=1e-12)


def accelerations(model: mujoco.MjModel, data: mujoco.MjData, body: int, point: np.ndarray) -> np.ndarray:
    """Of a point of a body, and its spin, by MuJoCo: J qacc + dJ/dt qvel."""
    turn, place = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, place, turn, point, body)
    out = np.concatenate([place @ data.qacc, turn @ data.qacc])
    mujoco.mj_jacDot(model, data, place, turn, point, body)
    return out + np.concatenate([place @ data.qvel, turn @ data.qvel])


@pytest.mark.parametrize("seed", range(10))
def test_accelerations_of_bodies_hold_what_turns(seed: int) -> None:
    model = random_model(seed)
    data = random_state(model, seed)
    world, rows, bodies = tree_of(model, data)
    for i, body in enumerate(bodies):
        own = world.bodies[1 + int(rows.row[i])]
        theirs = accelerations(model, data, body, own["position"])
        scale = np.abs(theirs).max()
        np.testing.assert_allclose(own["acceleration"], theirs[:3], atol=1e-9 * scale)
        np.testing.assert_allclose(own["turning"], theirs[3:], atol=1e-9 * scale)


@pytest.mark.parametrize("seed", range(8))
def test_a_tree_flies_as_by_fine_steps_of_mujoco(seed: int) -> None:
    """0.2 s with applied forces and damping; steps of 2 ms against Runge-Kutta steps of 20 us."""
    model = random_model(seed, damping=0.05)
    model.opt.timestep = 2e-5
    data = random_state(model, seed)
    world, _, _ = tree_of(model, data)
    mujoco.mj_step(model, data, 10000)
    step(world.world, 2e-3, 100)
    q, v = coordinates(world, 0)
    np.testing.assert_allclose(q, data.qpos, atol=1e-5)
    np.testing.assert_allclose(v, data.qvel, atol=1e-4 * np.abs(data.qvel).max())


def test_two_trees_of_a_model_have_their_own_places() -> None:
    """A free body comes before an arm on a stand; each is a world's tree of its own, and what welds is one body."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option gravity="0 0 -9.81"/><worldbody>
        <body pos="1 2 3"><freejoint/><geom size=".1"/></body>
        <body name="stand" mocap="true"><body><joint axis="0 1 0" armature=".1"/><geom size=".1" pos=".2 0 0"/>
        <body pos=".4 0 0" euler="0 30 0"><geom type="box" size=".1 .05 .02" pos=".1 0 0"/><geom size=".03"/>
        <body pos=".2 0 0"><joint type="ball"/><geom type="capsule" size=".02" fromto="0 0 0 .2 0 .1"/></body>
        </body></body></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.mocap_pos[:], data.mocap_quat[:] = [0.3, 0.2, 0.1], [0.6, 0.0, 0.8, 0.0]
    data.qvel[:] = np.linspace(-1.0, 2.0, model.nv)
    mujoco.mj_forward(model, data)
    roots = [1, 3]
    for root, (q, v) in zip(roots, ((0, 0), (7, 6)), strict=True):
        bodies = [i for i in range(1, model.nbody) if model.body_treeid[i] == model.body_treeid[root]]
        world, rows = made_of(model, data, bodies)
        np.testing.assert_array_equal(rows.q_of, q + np.arange(rows.start.size))
        np.testing.assert_array_equal(rows.v_of, v + np.arange(rows.axes.size))
        np.testing.assert_allclose(numbers(world, 0, "a"), data.qacc[rows.v_of], rtol=1e-9, atol=1e-9)
    assert rows.links.size == 2 and list(rows.row) == [0, 0, 1]
