"""Meshes and ellipsoids in both engines: they fall, come to rest where their shapes say, and gain nothing."""

import warnings

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world.shapes import hulls
from contactlaw.world.shapes.hulls import convex_hull

PAIR = ContactPair("steel", "steel", friction=0.4, restitution=0.5)
CORNERS = [[x, y, z] for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.02, 0.02)]


def text(points) -> str:
    return " ".join(str(x) for x in np.ravel(points))


def heap(timestep: float) -> str:
    """A cube, an ellipsoid and two rocks over a floor and a block."""
    rng = np.random.default_rng(4)
    rocks = [rng.normal(size=(12, 3)) for _ in range(2)]
    rocks = [0.02 * rock / np.linalg.norm(rock, axis=1)[:, None] for rock in rocks]
    meshes = "".join(f'<mesh name="m{i}" vertex="{text(points)}"/>' for i, points in enumerate([CORNERS, *rocks]))
    bodies = "".join(
        f'<body pos="{x} 0 {z}" euler="{text(turn)}"><freejoint/><geom name="{name}" {kind} density="7800"/></body>'
        for name, x, z, turn, kind in (
            ("cube", 0.0, 0.04, (10, 20, 30), 'type="mesh" mesh="m0"'),
            ("egg", 0.1, 0.04, (40, 50, 60), 'type="ellipsoid" size=".03 .02 .012"'),
            ("rock", 0.2, 0.08, (70, 80, 90), 'type="mesh" mesh="m1"'),
            ("stone", 0.2, 0.13, (0, 80, 90), 'type="mesh" mesh="m2"'),
        )
    )
    return f"""<mujoco><option timestep="{timestep}"/><asset>{meshes}</asset><worldbody>
      <geom name="floor" type="plane" size="1 1 1"/>
      <geom name="block" type="box" size=".05 .05 .01" pos=".2 0 .02"/>{bodies}</worldbody></mujoco>"""


@pytest.mark.parametrize("timestep", [1e-3, 1e-2])
def test_mujoco_lets_them_fall_and_rest(timestep):
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    moving = ["cube", "egg", "rock", "stone"]
    model = load_model(heap(timestep), [(moving, ["floor", "block", *moving], PAIR)])
    data = mujoco.MjData(model)
    masses = model.body_mass[1:]

    def energy():
        """Velocities of Euler's method are those of half a step before: without that error of flight."""
        v, w = data.qvel.reshape(-1, 6)[:, :3].copy(), data.qvel.reshape(-1, 6)[:, 3:]
        mujoco.mj_kinematics(model, data)
        moments = np.array([model.body_inertia[i + 1] for i in range(4)])
        turn = [data.ximat[i + 1].reshape(3, 3).T @ data.xmat[i + 1].reshape(3, 3) @ w[i] for i in range(4)]
        kinetic = 0.5 * (masses * (v**2).sum(1)).sum() + 0.5 * (moments * np.square(turn)).sum()
        return kinetic + 9.81 * (masses * data.xipos[1:, 2]).sum()

    start = energy()
    own = 9.81 * timestep * np.sqrt(2.0 * 9.81 * 0.1) * masses.sum()  # g dt v m, which that error makes of a bounce
    before = start
    for _ in range(round(4.0 / timestep)):
        mujoco.mj_step(model, data)
        now = energy()
        assert now < before + own
        before = now
    assert now < start
    np.testing.assert_allclose(data.qvel.reshape(-1, 6)[[0, 2, 3]], 0.0, rtol=0.0, atol=1e-6)  # the egg rolls on
    heights = data.geom_xpos[2:, 2]
    assert heights[0] == pytest.approx(0.02, abs=1e-5)
    assert 0.012 - 1e-5 < heights[1] < 0.02
    for mesh, body in enumerate((1, 3, 4)):  # on something, and in nothing
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        geom = model.body_geomadr[body]
        own = model.mesh_vert[first : first + count] @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        assert min(abs(own[:, 2].min() - top) for top in (0.0, 0.03)) < 1e-4 or body == 4
        assert own[:, 2].min() > -1e-5
    saved = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    data.qvel[:] = 0.1
    mujoco.mj_step(model, data, 3)
    mujoco.mj_getState(model, data, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_step(model, data, 20)
    mujoco.mj_step(model, other, 20)
    np.testing.assert_array_equal(data.qpos, other.qpos)
    np.testing.assert_array_equal(data.qvel, other.qvel)


@pytest.mark.parametrize("timestep", [1e-3, 4e-3])
def test_pybullet_lets_a_mesh_fall_and_rest(client, timestep):
    p = pytest.importorskip("pybullet")
    from contactlaw.pybullet_callback import ContactCallback

    p.setGravity(0, 0, -9.81, physicsClientId=client)
    p.setTimeStep(timestep, physicsClientId=client)
    floor = p.createMultiBody(0.0, p.createCollisionShape(p.GEOM_PLANE, physicsClientId=client), physicsClientId=client)
    bodies = []
    for i, shift in enumerate(([0.0, 0.0, 0.0], [0.005, 0.0, 0.002])):  # of the centre of mass
        mesh = p.createCollisionShape(p.GEOM_MESH, vertices=CORNERS, physicsClientId=client)
        turn = p.getQuaternionFromEuler([0.2, 0.3, 0.1])
        bodies.append(p.createMultiBody(0.5, mesh, -1, [0.2 * i, 0, 0.05], turn, shift, physicsClientId=client))
        p.changeDynamics(bodies[-1], -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    callback = ContactCallback(client)
    callback.add_contact(bodies, [floor], PAIR)
    for _ in range(round(1.5 / timestep)):
        callback.step()
    for body, depth in zip(bodies, (0.0, 0.002), strict=True):
        place, turn = p.getBasePositionAndOrientation(body, physicsClientId=client)
        axes = np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3)
        lowest = (place[2] + (np.array(CORNERS) - (0.005 if depth else 0.0, 0.0, depth)) @ axes.T[:, 2]).min()
        assert lowest == pytest.approx(0.0, abs=1e-5)
        assert np.abs(axes).max() == pytest.approx(1.0, abs=1e-6)
        assert np.abs(p.getBaseVelocity(body, physicsClientId=client)).max() < 1e-6


def wheels() -> str:
    """A ball on a floor beside twelve spinning rocks: in the frame of one all parts of the others go round it fast."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(40, 3))
    points *= 0.05 / np.linalg.norm(points, axis=1)[:, None]
    rocks = "".join(
        f'<body pos="{0.12 * x} {0.12 * y} .3"><joint axis="0 0 1"/><geom type="mesh" mesh="m" mass="1"/></body>'
        for x, y in np.ndindex(4, 3)
    )
    return f"""<mujoco><option timestep=".002"/><asset><mesh name="m" vertex="{text(points)}"/></asset><worldbody>
      <geom name="floor" type="plane" size="1 1 1"/>{rocks}
      <body pos=".1 0 .05"><freejoint/><geom name="ball" size=".05" mass="1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("room", [None, 1])
def test_fast_parts_do_not_crowd_a_ball_out_of_the_list(room, monkeypatch):
    """Room follows from what can meet; where it falls short, a warning says what is left out."""
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model
    from contactlaw.world import arrays

    if room is not None:
        monkeypatch.setattr(arrays, "NEAR_PAIRS", room)
    model = load_model(wheels(), [("*", "*", PAIR)])
    data = mujoco.MjData(model)
    data.qvel[:12] = np.resize([-300.0, 300.0], 12)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, 25)
    assert [str(one.message) for one in said if "pairs of near shapes" not in str(one.message)] == []
    assert len(said) == (0 if room is None else 1)
    if room is None:
        assert data.qpos[14] == pytest.approx(0.05, abs=1e-5)


def test_mujoco_finds_the_hull_of_a_mesh_once(monkeypatch):
    """Not for each mjData, nor after each edit of the model: a robot's hulls take half a second."""
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    model = load_model(heap(1e-3), [("*", "*", PAIR)])
    data, found = mujoco.MjData(model), []
    monkeypatch.setattr(hulls, "convex_hull", lambda *what, **more: found.append(what) or convex_hull(*what, **more))
    mujoco.MjData(model)
    model.body_mass[1:] *= 1.1
    mujoco.mj_step(model, data)
    assert not found
