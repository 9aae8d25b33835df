"""Elastic balls between two walls, several impacts a step, from any gap and speed; what an overlap throws off."""

import warnings

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import MATERIALS, ContactPair
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.laws.record import pair_of as numbers_of
from contactlaw.mujoco_plugin import contacts_of, instances_of, load_model
from contactlaw.mujoco_plugin.readout import view_of

RADIUS, DENSITY = 0.025, 7833.0


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


@pytest.mark.parametrize("friction", [0.0, 1e-9])
@pytest.mark.parametrize("play", [0.0, 2e-5])
def test_a_crank_whose_pin_slides_in_a_slot_keeps_its_energy(play, friction):
    """At 0.1 rad a step. Pressed on one side, the pin went along a chord in the first stage, and struck the other side.

    Implicit steps took 2 % in half a second; without friction there were none.
    """
    size, radius, walls = 0.01, 0.1, ""
    for name, side in (("left", -1.0), ("right", 1.0)):
        place = side * (size + 0.02 + 0.5 * play)
        walls += f'<geom name="{name}" type="box" size=".02 .3 .05" pos="{place} 0 0" mass="0"/>'
    model = load_model(
        f"""<mujoco><option gravity="0 0 0" timestep="5e-3" integrator="implicitfast"/><worldbody>
        <body><joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/>
        <geom name="pin" size="{size}" pos="{radius} 0 0" mass="0"/></body>
        <body pos="{radius} 0 0"><joint type="slide" axis="1 0 0"/>
        <inertial pos="0 0 0" mass=".5" diaginertia=".01 .01 .01"/>{walls}</body></worldbody></mujoco>""",
        [("pin", ["left", "right"], ContactPair("steel", "steel", friction=friction, restitution=0.5))],
    )
    data, energies = mujoco.MjData(model), []
    data.qvel[0] = 20.0
    for _ in range(110):
        mujoco.mj_step(model, data)
        energies.append(0.005 * data.qvel[0] ** 2 + 0.25 * data.qvel[1] ** 2)
    assert energies[-1] == pytest.approx(energies[9], rel=1e-3)
    assert view_of(model, data).world["implicit"] > 60
