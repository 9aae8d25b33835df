"""Equality constraints between trees, and between branches of one, answer to impacts within the step."""

import numpy as np
import pytest
from mujoco_scenes import DISCRETE, mujoco

from contactlaw import MATERIALS, ContactPair, ContactWarning
from contactlaw.mujoco_plugin import contacts_of, load_model

RUBBER = ContactPair(MATERIALS["rubber"], MATERIALS["rubber"], 0.3, 0.8)
SPEED, BALL = 0.5, 2.0
STEPS = 5e-4, 2e-3, 1e-2
UNSEEN = 'contype="0" conaffinity="0"'
FREE = "<freejoint/>"
SLIDE = '<joint name="{name}" type="slide" axis="1 0 0"/>'


def struck(bodies, equalities, step, integrator="Euler", seconds=0.22):
    """A ball strikes the hand; returns its last velocity and the greatest kinetic energy, over that of the start."""
    model = load_model(
        f"""<mujoco><option timestep="{step}" gravity="0 0 0" integrator="{integrator}"/><worldbody>{bodies}
        <body name="ball" pos="-.16 0 0"><freejoint/><geom name="ball" size=".05" mass="{BALL}"/></body></worldbody>
        <equality>{equalities}</equality></mujoco>""",
        [("ball", "hand", RUBBER)],
    )
    data, energy, first = mujoco.MjData(model), [], model.body("ball").dofadr[0]
    data.qvel[first] = SPEED
    for _ in range(round(seconds / step)):
        mujoco.mj_step(model, data)
        mujoco.mj_energyVel(model, data)
        energy.append(data.energy[1] / (0.5 * BALL * SPEED**2))
    return data.qvel[first], max(energy)


def box(name, joint, place, mass, rest=""):
    return f"""<body name="{name}" pos="{place} 0 0">{joint.format(name=name)}
        <geom name="{name}" type="box" size=".1 .1 .1" mass="{mass}" {rest}/></body>"""


def two(joint):
    """A light hand and a heavy body, and between them, in the model, one that has nothing to do with them."""
    far = f'<body pos="9 0 0"><freejoint/><geom size=".1" mass="1" {UNSEEN}/></body>'
    return box("hand", joint, 0, 0.2) + far + box("other", joint, 0.3, 20.0, UNSEEN)


JOINED = {
    "weld": (two(FREE), '<weld body1="hand" body2="other"/>'),
    "connect": (two(FREE), '<connect body1="hand" body2="other" anchor=".2 0 0"/>'),
    "slides": (two(SLIDE), '<weld body1="other" body2="hand"/>'),
    "joints": (two(SLIDE), '<joint joint1="hand" joint2="other"/>'),
    "branches": (
        f'<body name="base"><joint type="slide" axis="0 1 0"/><geom size=".1" mass="1" {UNSEEN}/>{two(SLIDE)}</body>'
        .replace("<freejoint/>", ""),
        '<joint joint1="hand" joint2="other"/>',
    ),
}  # fmt: skip


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4", *DISCRETE])
@pytest.mark.parametrize("kind", JOINED)
def test_what_is_joined_to_another_body_is_struck_with_it(kind, integrator):
    """2 kg meet 0.2 kg that an equality joins to 20 kg: alike at any step, with no energy from nothing."""
    runs = [struck(*JOINED[kind], step, integrator) for step in STEPS]
    assert [speed / SPEED for speed, _ in runs] == pytest.approx([runs[0][0] / SPEED] * 3, abs=0.1)
    assert max(most for _, most in runs) < 1.0 + 1e-3


def test_momentum_of_bodies_that_an_equality_joins_is_kept():
    """Off the centres of mass, so that all turn; linear and angular momentum about the world's origin."""
    hand, other = (box(*row) for row in (("hand", FREE, 0, 0.2), ("other", FREE, 0.3, 3)))
    model = load_model(
        f"""<mujoco><option timestep=".002" gravity="0 0 0"/><worldbody>{hand}{other}
        <body pos="-.2 .05 .07"><freejoint/><geom name="ball" size=".05" mass="2"/></body></worldbody>
        <equality><weld body1="hand" body2="other"/></equality></mujoco>""",
        [("ball", "hand", RUBBER)],
    )
    data = mujoco.MjData(model)
    data.qvel[-6:-3] = SPEED, 0.0, 0.0

    def momenta():
        mujoco.mj_subtreeVel(model, data)
        centre, speed = data.subtree_com[0], data.subtree_linvel[0]
        mass = model.body_subtreemass[0]
        return np.array([*(mass * speed), *(data.subtree_angmom[0] + mass * np.cross(centre, speed))])

    mujoco.mj_forward(model, data)
    start = momenta()
    mujoco.mj_step(model, data, 200)
    mujoco.mj_forward(model, data)
    assert abs(data.qvel[3:6]).max() > 0.1, "it has been struck"
    assert momenta() == pytest.approx(start, abs=1e-3 * BALL * SPEED)


ARMS = f"""<mujoco><option timestep="{{step}}" gravity="0 0 0"/><worldbody>
    <body name="first" pos="-.3 0 .3"><joint axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 .3 0 -.3" size=".02" mass=".5" {UNSEEN}/>
    <geom name="hand" pos=".3 0 -.3" size=".03" mass=".05"/></body>
    <body pos=".3 0 .3"><joint axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 -.3 0 -.3" size=".02" mass=".5" {UNSEEN}/>
    <body name="end" pos="-.3 0 -.3"><joint axis="0 1 0"/><geom size=".02" mass=".1" {UNSEEN}/></body></body>
    <body name="ball" pos="0 0 -.1"><freejoint/><geom name="ball" size=".04" mass=".3"/></body></worldbody>
    <equality><connect body1="end" body2="first" anchor="0 0 0"/></equality></mujoco>"""


def test_two_arms_that_a_connect_closes_are_struck_alike_at_any_step():
    """Two arms, together a truss, meet a ball at 0.5 m/s; the truss hardly yields, and the ball comes back."""
    speeds = []
    for step in STEPS:
        model = load_model(ARMS.format(step=step), [("ball", "hand", RUBBER)])
        data = mujoco.MjData(model)
        data.qvel[-4] = 0.5
        mujoco.mj_step(model, data, round(0.3 / step))
        speeds.append(data.qvel[-4])
    assert speeds == pytest.approx([speeds[0]] * 3, abs=0.05)
    assert speeds[0] < 0.0


def test_bodies_that_a_weld_holds_in_each_other_do_not_touch():
    """Two boxes reach 20 mm into each other; the floor holds both, and nothing throws them about."""
    bodies = (box(name, FREE, place, 0.5) for name, place in (("one", 0), ("two", 0.18)))
    xml = f"""<mujoco><option timestep=".002" integrator="RK4"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/>
        {"".join(bodies)}</worldbody><equality><weld body1="one" body2="two"/></equality></mujoco>"""
    with pytest.warns(ContactWarning, match="parts are built into each other: 'one' and 'two' by 20 mm"):
        model = load_model(xml.replace(' 0 0">', ' 0 .2">'), [("*", "*", RUBBER)])
    data = mujoco.MjData(model)
    data.qvel[:] = [0.5, 0.0, 0.0, 1.0, 2.0, 0.0, 0.5, 0.0, -0.36, 1.0, 2.0, 0.0]
    mujoco.mj_step(model, data, 500)
    assert model.nexclude == 1
    assert np.linalg.norm(data.body("two").xpos - data.body("one").xpos) == pytest.approx(0.18, abs=2e-3)
    assert abs(data.qvel).max() < 0.05


def test_a_joint_damped_hard_holds_still_in_a_contact_of_what_is_welded():
    """A lift of 1e7 N s/m moves by micrometres a second, as natively; Fetch's moved at 1 m/s, until all was lost."""
    free = 'contype="0" conaffinity="0"'
    link = f'<joint axis="0 1 0" armature="1"/><geom size=".02" mass="2" {free}/>'
    scene = f"""<mujoco><worldbody><geom name="floor" type="box" size="1 1 .2" pos=".6 0 .347"/>
    <body name="lead" mocap="true" pos=".6 0 .577"/><body pos="0 0 .5"><joint name="lift" type="slide" axis="0 0 1"
    damping="1e7"/><geom size=".05" mass="13" {free}/><body pos="0 0 .1">{link}<body pos=".3 0 .1">{link}
    <body name="hand" pos=".3 0 -.1"><joint axis="0 1 0" armature="1"/><geom name="hand" type="box" mass="1"
    size=".03 .03 .05"/></body></body></body></body></worldbody><equality>
    <weld body1="lead" body2="hand" relpose="0 0 0 1 0 0 0"/></equality></mujoco>"""
    rubber = ContactPair("rubber", "steel", friction=1.0, restitution=0.3)
    model = load_model(scene, [("hand", "floor", rubber)])
    data, fastest = mujoco.MjData(model), 0.0
    for _ in range(50):
        mujoco.mj_step(model, data)
        fastest = max(fastest, abs(float(data.joint("lift").qvel[0])))
    assert fastest < 1e-3


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("timeconst", [2e-3, 2e-2])
def test_a_balance_that_connects_close_moves_as_freely_as_rigid_joints(timeconst: float, integrator: str):
    """Roberval's: two beams, and pans that they keep upright; 0.2 kg more on one side, off the middle of its pan.

    Connects as hard as the engine allows in steps of 1 ms damped each joint by itself: it moved at 0.08 of its speed.
    """
    arm, more = 0.2, 0.2
    beam = f'<geom type="box" size="{arm} .005 .005" mass=".1" {UNSEEN}/>'
    pans = "".join(
        f'<body pos="{side * arm} 0 0"><joint axis="0 1 0"/><site name="foot{side}" pos="0 0 -.1"/>'
        f'<geom name="pan{side}" type="box" size=".12 .05 .005" pos="0 0 .03" mass=".2"/></body>'
        for side in (-1, 1)
    )
    loads = "".join(
        f'<body pos="{place} 0 .355"><freejoint/><geom name="load{mass}" type="box" size=".02 .02 .02" mass="{mass}"/>'
        "</body>"
        for place, mass in ((arm, 1.0), (-arm - 0.05, 1.0 + more))
    )
    ends = "".join(f'<site name="end{side}" pos="{side * arm} 0 0"/>' for side in (-1, 1))
    ties = "".join(f'<connect site1="foot{s}" site2="end{s}" solref="{timeconst} 1"/>' for s in (-1, 1))
    scene = f"""<mujoco><option timestep="1e-3" integrator="{integrator}"/><worldbody>
        <body pos="0 0 .3"><joint name="beam" axis="0 1 0"/>{beam}{pans}</body>
        <body pos="0 0 .2"><joint axis="0 1 0"/>{beam}{ends}</body>{loads}</worldbody>
        <equality>{ties}</equality></mujoco>"""
    model = load_model(scene, [("load*", "pan*", RUBBER)])
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 300)
    moved = 2.0 + more + 0.4 + 2.0 * 0.1 / 3.0 * (1.0 + (0.005 / arm) ** 2)  # masses, and both beams at their ends
    assert data.joint("beam").qvel[0] * arm == pytest.approx(-0.3 * more * 9.81 / moved, rel=0.01)


def test_what_has_no_contacts_of_the_law_may_be_joined_to_what_has():
    """All bodies of the model are then in the world, and its own row: there was no room for that. They stand still."""
    model = load_model(
        f"""<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><body name="foot" pos="0 0 .02">{FREE}
        <geom name="foot" size=".02" mass=".5"/></body><body name="load" pos="0 0 .05">{FREE}
        <geom size=".005" mass=".3" {UNSEEN}/></body></worldbody>
        <equality><weld body1="foot" body2="load"/></equality></mujoco>""",
        [("foot", "floor", RUBBER)],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    assert contacts_of(model, data)[0].normal_force == pytest.approx(0.8 * 9.81, rel=1e-6)
