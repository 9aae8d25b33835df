"""Elastic balls between walls, several impacts a step: they keep their speed, and nothing is warned of."""

import warnings

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import MATERIALS, ContactPair
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.laws.record import pair_of as numbers_of
from contactlaw.mujoco_plugin import contacts_of, instances_of, load_model

RADIUS, DENSITY = 0.025, 7833.0
GAPS = [2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2]
SPEEDS = {"steel": (0.1, 0.5, 3.0), "rubber": (0.05, 0.4)}  # [m/s]; such that the overlap stays small


def pair_of(material):
    return ContactPair(MATERIALS[material], MATERIALS[material], friction=0.0, restitution=1.0)


def mujoco_speeds(gap, speed, dt, material, integrator, steps):
    """Speeds [m/s] at the ends of steps in which the ball flies between its two walls."""
    model = load_model(
        f"""<mujoco><option gravity="0 0 0" timestep="{dt}" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 {2 * RADIUS + gap + 0.1}"><geom name="ceiling" type="box" size="1 1 .1"/></body>
        <body pos="0 0 {RADIUS + 0.3 * gap}"><freejoint/><geom name="ball" size="{RADIUS}" density="{DENSITY}"/></body>
        </worldbody></mujoco>""",
        [("ball", ["floor", "ceiling"], pair_of(material))],
    )
    data, out = mujoco.MjData(model), []
    data.qvel[2] = speed
    name = instances_of(model)[0]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        if not any(contact.touching for contact in contacts_of(model, data, name)):
            out.append(abs((data.qvel)[2]))
    return np.array(out)


def pybullet_speeds(gap, speed, dt, material, steps):
    """The same in PyBullet."""
    p = pytest.importorskip("pybullet")
    from pybullet_scenes import FREE, plane, shape

    from contactlaw.pybullet_callback import ContactCallback

    client = p.connect(p.DIRECT)
    try:
        p.setTimeStep(dt, client)
        walls = [plane(client)]
        walls.append(
            p.createMultiBody(
                0.0, shape(client, p.GEOM_BOX, halfExtents=[1, 1, 0.1]), -1, [0, 0, 2 * RADIUS + gap + 0.1],
                physicsClientId=client,
            )
        )  # fmt: skip
        mass = DENSITY * 4.0 / 3.0 * np.pi * RADIUS**3
        ball = p.createMultiBody(
            mass, shape(client, p.GEOM_SPHERE, radius=RADIUS), -1, [0, 0, RADIUS + 0.3 * gap], physicsClientId=client
        )
        p.changeDynamics(ball, -1, physicsClientId=client, **FREE)
        p.resetBaseVelocity(ball, [0, 0, speed], physicsClientId=client)
        contact, out = ContactCallback(client), []
        handle = contact.add_contact(ball, walls, pair_of(material))
        for _ in range(steps):
            contact()
            p.stepSimulation(client)
            if not any(state.overlap > 0.0 for state in contact.states(handle)):
                out.append(abs(p.getBaseVelocity(ball, client)[0][2]))
    finally:
        p.disconnect(client)
    return np.array(out)


@pytest.mark.parametrize("dt", [5e-4, 2e-3, 4e-3, 1e-2])
@pytest.mark.parametrize("material", ["steel", "rubber"])
@pytest.mark.parametrize("engine", ["Euler", "RK4", "pybullet"])
def test_a_ball_that_rattles_between_two_walls_keeps_its_speed(engine, material, dt):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for gap in GAPS:
            for speed in SPEEDS[material]:
                if engine == "pybullet":
                    speeds = pybullet_speeds(gap, speed, dt, material, 100)
                else:
                    speeds = mujoco_speeds(gap, speed, dt, material, engine, 250)
                assert speeds == pytest.approx(speed, rel=0.01), (gap, speed)
    assert not said


def test_no_step_ends_short_of_its_end():
    """now + (dt - now) is less than dt for one now in some: such a step is over, and nothing is brought to a stand."""
    rng = np.random.default_rng(7)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for _ in range(12):
            gap, speed, dt = rng.uniform(0.004, 0.03), rng.uniform(0.5, 3.0), float(rng.choice([5e-3, 1e-2]))
            assert mujoco_speeds(gap, speed, dt, "steel", "Euler", 1000) == pytest.approx(speed, rel=0.01)
    assert not said


@pytest.mark.parametrize("overlap", [5e-4, 2e-3])
def test_what_a_compressed_contact_throws_off_meets_what_is_in_its_way(overlap):
    """A ball that is put into the floor, at rest: within the step it flies up to the ceiling and comes back."""
    gap, dt, material = 2e-2, 1e-2, "rubber"
    pair = pair_of(material)
    model = load_model(
        f"""<mujoco><option gravity="0 0 0" timestep="{dt}"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 {2 * RADIUS + gap + 0.1}"><geom name="ceiling" type="box" size="1 1 .1"/></body>
        <body pos="0 0 {RADIUS - overlap}"><freejoint/><geom name="ball" size="{RADIUS}" density="1"/></body>
        </worldbody></mujoco>""",
        [("ball", ["floor", "ceiling"], pair)],
        overlaps="keep",
    )
    data = mujoco.MjData(model)
    stiffness = hertz_stiffness(numbers_of(pair.parameters(RADIUS)))
    speed = np.sqrt(0.8 * stiffness * overlap**2.5 / model.body_mass[2])
    assert speed * dt > gap
    name, speeds = instances_of(model)[0], []
    for _ in range(20):
        mujoco.mj_step(model, data)
        assert -0.1 * RADIUS < data.qpos[2] - RADIUS < gap + 0.1 * RADIUS
        if not any(contact.touching for contact in contacts_of(model, data, name)):
            speeds.append(abs((data.qvel)[2]))
    assert speeds == pytest.approx(len(speeds) * [speed], rel=0.02) and speeds


def gas(seed, dt, radius=0.04, half=0.15):
    """Eight balls at 1 m/s each in a box."""
    rng = np.random.default_rng(seed)
    corners = half + 0.5 * half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    balls = "".join(
        f'<body pos="{x} {y} {z}"><freejoint/><geom name="ball{i}" size="{radius}" density="{DENSITY}"/></body>'
        for i, (x, y, z) in enumerate(corners + rng.uniform(-0.004, 0.004, (8, 3)))
    )
    walls = "".join(
        f'<geom name="wall{2 * i + j}" type="plane" size="1 1 1" pos="{a}" zaxis="{n}"/>'
        for i in range(3)
        for j, (a, n) in enumerate(
            (
                " ".join(str(2 * half * j * (k == i)) for k in range(3)),
                " ".join(str((1 - 2 * j) * (k == i)) for k in range(3)),
            )
            for j in range(2)
        )
    )
    names = [f"ball{i}" for i in range(8)]
    model = load_model(
        f'<mujoco><option gravity="0 0 0" timestep="{dt}"/><worldbody>{walls}{balls}</worldbody></mujoco>',
        [(names, [*names, *(f"wall{i}" for i in range(6))], pair_of("steel"))],
        others=False,
    )
    data = mujoco.MjData(model)
    directions = rng.normal(size=(8, 3))
    data.qvel.reshape(8, 6)[:, :3] = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return model, data


@pytest.mark.parametrize("seed", range(6))
def test_a_gas_of_elastic_balls_keeps_its_energy(seed):
    model, data = gas(seed, 5e-3)
    name = instances_of(model)[0]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, 600)
        while any(contact.touching for contact in contacts_of(model, data, name)):
            mujoco.mj_step(model, data)
        velocities = (data.qvel).reshape(8, 6)
    assert np.mean(np.sum(velocities[:, :3] ** 2, axis=1)) == pytest.approx(1.0, abs=0.05)
    assert not said
