"""Boxes and cylinders in both engines: random drops gain nothing and do not sink; the radius of edges is heeded."""

from __future__ import annotations

import warnings
from math import pi

import numpy as np
import pytest

from contactlaw import ContactPair, ContactWarning, Material

PLASTIC = Material(3e9, 0.35)
PAIR = ContactPair(PLASTIC, PLASTIC, friction=0.3, restitution=0.5)
COUNT, DENSITY = 3, 2000.0
DROPS = [(timestep, seed) for timestep in (5e-4, 2e-3, 1e-2) for seed in range(3)]


def bodies(seed: int) -> list[tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Kind, sizes, place, quaternion, and velocity with spin."""
    rng = np.random.default_rng(seed)
    out = []
    for i in range(COUNT):
        kind = str(rng.choice(["box", "cylinder"]))
        sizes = rng.uniform(0.01, 0.03, 3 if kind == "box" else 2)
        place = np.array([0.01 * rng.normal(), 0.01 * rng.normal(), 0.06 + 0.09 * i])
        turn = rng.normal(size=4)
        motion = np.append(0.2 * rng.normal(size=3), 2.0 * rng.normal(size=3))
        out.append((kind, sizes, place, turn / np.linalg.norm(turn), motion))
    return out


def moments(kind: str, sizes: np.ndarray) -> tuple[float, np.ndarray]:
    """Mass and moments of inertia."""
    if kind == "box":
        mass = 8.0 * sizes.prod() * DENSITY
        return mass, mass / 3.0 * (sizes @ sizes - sizes**2)
    mass = 2.0 * pi * sizes[0] ** 2 * sizes[1] * DENSITY
    across = mass * (3.0 * sizes[0] ** 2 + 4.0 * sizes[1] ** 2) / 12.0
    return mass, np.array([across, across, 0.5 * mass * sizes[0] ** 2])


def settled(energies: list[float], heights: np.ndarray) -> None:
    """Whatever fell has lost energy, by much, and never risen by a thousandth; nothing is below the floor."""
    start, least = energies[0], np.minimum.accumulate(energies)
    assert (np.array(energies[1:]) - least[:-1]).max() < 1e-3 * start
    assert energies[-1] < 0.5 * start
    assert heights.min() > 0.0099


@pytest.mark.parametrize(("timestep", "seed"), DROPS)
def test_mujoco_drops(timestep: float, seed: int) -> None:
    """Under Runge-Kutta, whose flight keeps energy; looked at each tenth of a second."""
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    made = bodies(seed)
    geoms = "".join(
        f'<body pos="{" ".join(map(str, place))}" quat="{" ".join(map(str, turn))}"><freejoint/><geom name="g{i}" '
        f'type="{kind}" size="{" ".join(map(str, sizes))}" density="{DENSITY}"/></body>'
        for i, (kind, sizes, place, turn, _) in enumerate(made)
    )
    ground = 'type="plane" size="1 1 1"' if seed % 2 else 'type="box" size="2 2 .1" pos="0 0 -.1"'
    text = f"""<mujoco><option timestep="{timestep}" integrator="RK4"/><worldbody><geom name="ground" {ground}/>{geoms}
      </worldbody></mujoco>"""
    names = [f"g{i}" for i in range(COUNT)]
    model = load_model(text, [(names, ["ground", *names], PAIR)])
    data = mujoco.MjData(model)
    data.qvel[:] = np.concatenate([motion for *_, motion in made])

    def energy() -> float:
        out = 0.0
        for i, (kind, sizes, *_) in enumerate(made):
            mass, inertia = moments(kind, sizes)
            q, v = data.qpos[7 * i : 7 * i + 7], data.qvel[6 * i : 6 * i + 6]
            out += mass * (0.5 * v[:3] @ v[:3] + 9.81 * q[2]) + 0.5 * v[3:] @ (inertia * v[3:])
        return float(out)

    energies = [energy()]
    for _ in range(20):
        mujoco.mj_step(model, data, round(0.1 / timestep))
        energies.append(energy())
    settled(energies, data.qpos.reshape(-1, 7)[:, 2])


@pytest.mark.parametrize(("timestep", "seed"), DROPS)
def test_pybullet_drops(client: int, timestep: float, seed: int) -> None:
    p = pytest.importorskip("pybullet")
    from contactlaw.pybullet_callback import ContactCallback

    made = bodies(seed)
    p.setTimeStep(timestep, client)
    p.setGravity(0, 0, -9.81, physicsClientId=client)
    half = [2.0, 2.0, 0.1]
    floor = (
        p.createMultiBody(0.0, p.createCollisionShape(p.GEOM_PLANE, physicsClientId=client), physicsClientId=client)
        if seed % 2 else
        p.createMultiBody(0.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=client), -1,
                          [0.0, 0.0, -0.1], physicsClientId=client)
    )  # fmt: skip
    ids = []
    for kind, sizes, place, turn, motion in made:
        mass, inertia = moments(kind, sizes)
        more = {"halfExtents": sizes.tolist()} if kind == "box" else {"radius": sizes[0], "height": 2.0 * sizes[1]}
        shape = p.createCollisionShape(getattr(p, f"GEOM_{kind.upper()}"), physicsClientId=client, **more)
        body = p.createMultiBody(mass, shape, -1, place, np.roll(turn, -1), physicsClientId=client)
        p.changeDynamics(body, -1, linearDamping=0, angularDamping=0, maxJointVelocity=1e6, physicsClientId=client,
                         localInertiaDiagonal=inertia.tolist())  # fmt: skip
        p.resetBaseVelocity(body, motion[:3].tolist(), motion[3:].tolist(), client)
        ids.append(body)
    contact = ContactCallback(client)
    handle = contact.add_contact(ids, [floor, *ids], PAIR)

    def energy() -> float:
        out = 0.0
        touching = {one[0] for state in contact.states(handle) if state.overlap > 0.0 for one in (state.a, state.b)}
        for body, (kind, sizes, *_) in zip(ids, made, strict=True):
            mass, inertia = moments(kind, sizes)
            place, turn = p.getBasePositionAndOrientation(body, client)
            v, w = (np.array(one) for one in p.getBaseVelocity(body, client))
            own = w @ np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3)
            # Bullet's velocity is half a step behind, but that of what touches something is the true one.
            lead = 0.5 * timestep * 9.81 * (body not in touching)
            v[2] -= lead
            out += mass * (0.5 * v @ v + 9.81 * place[2]) + 0.5 * own @ (inertia * own)
        return float(out)

    energies = [energy()]
    for _ in range(20):
        for _ in range(round(0.1 / timestep)):
            contact.step()
        energies.append(energy())
    settled(energies, np.array([p.getBasePositionAndOrientation(body, client)[0][2] for body in ids]))


def test_mujoco_stands_on_edges_of_a_given_radius() -> None:
    """A box on a plane sinks by 4 P = m g; nothing is warned of."""
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    text = """<mujoco><option timestep="2e-3"/><worldbody><geom name="ground" type="plane" size="1 1 1"/>
      <body pos="0 0 .02"><freejoint/><geom name="box" type="box" size=".03 .02 .02" mass="1"/></body>
      </worldbody></mujoco>"""
    with warnings.catch_warnings():
        warnings.simplefilter("error", ContactWarning)
        for rounding in (None, 0.005):
            model = load_model(text, [("box", "ground", PAIR)], rounding=rounding)
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 500)
            stiffness = 4.0 / 3.0 * PAIR.effective_modulus * (rounding or 0.002) ** 0.5
            assert 0.02 - data.qpos[2] == pytest.approx((0.25 * 9.81 / stiffness) ** (2.0 / 3.0), rel=1e-6)
    with pytest.raises(ValueError, match="rounding = -1"):
        load_model(text, [("box", "ground", PAIR)], rounding=-1.0)


@pytest.mark.parametrize("seed", [3, 14, 22])
def test_an_edge_that_comes_to_lie_over_a_face_gives_back_its_energy(seed: int) -> None:
    """A brick that tumbles between walls without friction and loss; single impacts took up to 22 % of its energy."""
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    sides = [(side, axis) for side in (-1, 1) for axis in np.eye(3)]
    walls = "".join(
        f'<geom name="wall{i}" type="box" size="{" ".join(map(str, 0.3 - 0.25 * axis))}" '
        f'pos="{" ".join(map(str, 0.25 * side * axis))}"/>'
        for i, (side, axis) in enumerate(sides)
    )
    text = f"""<mujoco><option timestep="2e-3" integrator="RK4" gravity="0 0 0"/><worldbody>{walls}
      <body><freejoint/><geom name="brick" type="box" size=".05 .03 .015" mass=".1"/></body></worldbody></mujoco>"""
    pair = ContactPair("nylon", "nylon", friction=0.0, restitution=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)  # overlaps of a third of the edges' radius
        model = load_model(text, [("brick", "wall*", pair)])
        data = mujoco.MjData(model)
        data.qvel = np.random.default_rng(seed).normal(size=6) * [2, 2, 2, 40, 40, 40]
        weights, energies = np.append(np.full(3, 0.1), model.body_inertia[1]), list[float]()
        for _ in range(180):
            energies.append(float(weights @ data.qvel**2))
            mujoco.mj_step(model, data)
    assert max(energies[-10:]) == pytest.approx(energies[0], rel=2e-3)  # in some of these steps nothing touches
