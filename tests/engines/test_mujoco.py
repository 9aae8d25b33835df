"""The MuJoCo plugin: the law in unmodified mj_step, its state, its borders."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
numba = pytest.importorskip("numba")
if numba.config.DISABLE_JIT:
    pytest.skip("the MuJoCo plugin needs compiled callbacks", allow_module_level=True)

from contactlaw import LAWS, MATERIALS, ContactPair, ContactWarning, Material, rebound  # noqa: E402
from contactlaw.kernels.contact import NORMAL, OPEN, OVERLAP, PHASE, TANGENTIAL  # noqa: E402
from contactlaw.mujoco_plugin import add_contact, contact_history  # noqa: E402

STEEL = MATERIALS["steel"]
RADIUS = 0.0254
DENSITY = 7833.0
MASS = 4.0 / 3.0 * np.pi * RADIUS**3 * DENSITY
GEOM = mujoco.mjtGeom


def ball_on_floor(pair, timestep=1e-6, plane=None, floor="plane", gravity=0.0):
    spec = mujoco.MjSpec()
    spec.option.timestep = timestep
    spec.option.gravity = [0.0, 0.0, -gravity]
    if floor == "plane":
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    else:
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_BOX, size=[1, 1, 0.1], pos=[0, 0, -0.1])
    body = spec.worldbody.add_body(name="body", pos=[0, 0, RADIUS])
    body.add_freejoint()
    body.add_geom(name="ball", size=[RADIUS, 0, 0], density=DENSITY)
    name = add_contact(spec, "ball", "floor", pair, plane=plane)
    return spec, name


def steel_pair(**changes):
    return ContactPair(STEEL, STEEL, **{"friction": 0.115, "restitution": 0.93, **changes})


def duration(pair, speed=1.0):
    return ContactPair(pair.a, pair.b, pair.friction, pair.restitution, RADIUS).contact_duration(MASS, speed)


def impact_error(pair, psi_1, steps_a_contact, heading=0.3, phase=0.5, plane=None, floor="plane"):
    """psi_2 in the engine less the law's own."""
    step = duration(pair) / steps_a_contact
    spec, _ = ball_on_floor(pair, step, plane, floor)
    model = spec.compile()
    data = mujoco.MjData(model)
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    scale = pair.kappa / pair.friction
    data.qpos[2] += phase * step
    data.qvel[:3] = psi_1 / scale * along - [0, 0, 1]
    mujoco.mj_step(model, data, int(1.3 * steps_a_contact) + 3)
    at_contact = data.qvel[:3] + np.cross(data.qvel[3:], [0, 0, -RADIUS])
    assert data.ncon == 0
    psi_2 = scale * at_contact @ along
    return psi_2 - rebound(psi_1, pair.chi(1.0, 1.0 / 3.5), pair.law, pair.restitution)


@pytest.mark.parametrize(("steps", "allowed"), [(50, 1e-2), (100, 5e-3)])
@pytest.mark.parametrize("psi_1", [0.3, 1.2, 2.5, 4.5])
def test_an_impact_meets_the_law_at_any_phase_and_heading(steps, allowed, psi_1):
    for phase, heading in [(0.0, 0.0), (0.37, 1.1), (0.8, 4.0)]:
        assert abs(impact_error(steel_pair(), psi_1, steps, heading, phase)) <= allowed


@pytest.mark.parametrize("law", LAWS)
def test_every_law_acts(law):
    assert abs(impact_error(steel_pair(law=law), 1.2, 400)) <= 3e-3


def test_the_error_falls_with_the_square_of_the_step():
    phases = (0.1, 0.35, 0.6, 0.85)
    pair = steel_pair(restitution=1.0)
    finest = impact_error(pair, 2.0, 3200)
    errors = [max(abs(impact_error(pair, 2.0, n, phase=f) - finest) for f in phases) for n in (25, 50, 100)]
    assert np.log2(errors[0] / errors[2]) / 2.0 > 1.7, errors


def test_a_planar_contact_gives_what_one_in_space_gives():
    for psi_1 in (0.5, 2.0):
        in_space = impact_error(steel_pair(), psi_1, 100, heading=0.0)
        planar = impact_error(steel_pair(), psi_1, 100, heading=0.0, plane=[0, 1, 0])
        assert planar == pytest.approx(in_space, abs=1e-10)


def test_a_box_face_is_a_plane():
    assert impact_error(steel_pair(), 1.2, 100, floor="box") == pytest.approx(
        impact_error(steel_pair(), 1.2, 100), abs=1e-9
    )


def test_a_shape_found_by_the_engine_agrees_with_the_closed_form():
    after = []
    for kind, size in ((GEOM.mjGEOM_SPHERE, [RADIUS, 0, 0]), (GEOM.mjGEOM_ELLIPSOID, [RADIUS] * 3)):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
        body = spec.worldbody.add_body(pos=[0, 0, RADIUS])
        body.add_freejoint()
        body.add_geom(name="round", type=kind, size=size, density=DENSITY)
        add_contact(spec, "round", "floor", steel_pair(radius=RADIUS))
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qvel[:3] = [0.2, 0.1, -1.0]
        mujoco.mj_step(model, data, 150)
        after.append(data.qvel.copy())
    assert after[1] == pytest.approx(after[0], abs=1e-6)


def test_capsule_ends_are_balls_and_give_the_same_bounce():
    """Two capsules end to end strike as two balls of the same mass and inertia do."""
    after = []
    for half in (0.0, 0.04):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
        for name, z in (("low", 0.0), ("high", 2 * RADIUS + 2 * half)):
            body = spec.worldbody.add_body(name=name, pos=[0, 0, z])
            body.add_freejoint()
            body.explicitinertial, body.mass, body.ipos, body.inertia = True, 1.0, [0, 0, 0], [1e-3] * 3
            kind = GEOM.mjGEOM_CAPSULE if half else GEOM.mjGEOM_SPHERE
            body.add_geom(name=name + "_geom", type=kind, size=[RADIUS, half, 0])
        add_contact(spec, "low_geom", "high_geom", steel_pair(friction=0.0, restitution=1.0))
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qvel[8] = -1.0
        mujoco.mj_step(model, data, 300)
        after.append(data.qvel.copy())
    assert after[1] == pytest.approx(after[0], abs=1e-6)
    assert after[0][2] == pytest.approx(-1.0, abs=1e-3)  # equal masses exchange their velocities


def test_two_balls_keep_momentum_and_angular_momentum():
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
    places = np.array([[0, 0, 0], [0.3, 0.2, 1.0] / np.linalg.norm([0.3, 0.2, 1.0]) * 2 * RADIUS])
    for i, place in enumerate(places):
        body = spec.worldbody.add_body(pos=place)
        body.add_freejoint()
        body.add_geom(name=f"ball{i}", size=[RADIUS, 0, 0], density=DENSITY)
    add_contact(spec, "ball0", "ball1", steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = [0.1, 0.2, 0.8, 30, -10, 20, -0.3, 0.1, -0.9, 5, 40, -7]

    def momenta():
        mujoco.mj_forward(model, data)
        linear = sum(model.body_mass[b] * data.qvel[6 * (b - 1) : 6 * b - 3] for b in (1, 2))
        spins = [data.xmat[b].reshape(3, 3) @ data.qvel[6 * b - 3 : 6 * b] for b in (1, 2)]
        angular = sum(
            model.body_inertia[b][0] * spins[b - 1]
            + model.body_mass[b] * np.cross(data.xipos[b], data.qvel[6 * (b - 1) : 6 * b - 3])
            for b in (1, 2)
        )
        return linear, angular

    before = momenta()
    mujoco.mj_step(model, data, 300)
    after = momenta()
    assert np.linalg.norm(data.qvel[:3] - [0.1, 0.2, 0.8]) > 0.5
    assert after[0] == pytest.approx(before[0], abs=1e-12)
    assert after[1] == pytest.approx(before[1], abs=1e-10)


def test_a_hinged_paddle_returns_the_ball_without_making_energy():
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
    arm = spec.worldbody.add_body(name="arm")
    arm.add_joint(name="hinge", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    arm.add_geom(name="paddle", type=GEOM.mjGEOM_BOX, size=[0.02, 0.1, 0.1], pos=[0, 0, 0.4], density=2000)
    ball = spec.worldbody.add_body(name="ball", pos=[0.02 + RADIUS, 0, 0.42])
    ball.add_freejoint()
    ball.add_geom(name="ball_geom", size=[RADIUS, 0, 0], density=DENSITY)
    add_contact(spec, "ball_geom", "paddle", steel_pair(restitution=1.0))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[model.jnt_dofadr[1] :][:3] = [-1.0, 0.1, 0.2]
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    mujoco.mj_forward(model, data)
    before = data.energy[1]
    mujoco.mj_step(model, data, 500)
    mujoco.mj_forward(model, data)
    assert data.qvel[0] < -0.5
    assert 0.9 * before < data.energy[1] <= before * (1.0 + 1e-3)


def test_history_is_committed_by_steps_alone():
    spec, name = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.1, 0.0, -1.0]
    mujoco.mj_step(model, data, 40)
    history = contact_history(model, data, name)
    committed = history.copy()
    mujoco.mj_forward(model, data)
    force = data.qfrc_passive.copy()
    mujoco.mj_forward(model, data)
    assert np.array_equal(history, committed)
    assert np.array_equal(data.qfrc_passive, force)
    mujoco.mj_step(model, data)
    assert not np.array_equal(history, committed)
    assert history[0, NORMAL] == pytest.approx(force[2], rel=1e-12)
    assert history[0, OVERLAP] > 0.0
    assert np.hypot(*history[0, TANGENTIAL : TANGENTIAL + 2]) <= 0.115 * history[0, NORMAL] * (1 + 1e-12)


def test_a_restart_in_mid_contact_is_bit_exact():
    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = [0.1, 0.02, -1.0, 1.0, 2.0, 3.0]
    mujoco.mj_step(model, data, 50)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    copy = mujoco.MjData(model)
    mujoco.mj_copyData(copy, model, data)
    mujoco.mj_step(model, data, 100)
    fresh = mujoco.MjData(model)
    mujoco.mj_setState(model, fresh, state, kind)
    for other in (fresh, copy):
        mujoco.mj_step(model, other, 100)
        assert np.array_equal(other.qvel, data.qvel)
        assert np.array_equal(other.plugin_state, data.plugin_state)


def test_a_reset_forgets_the_contact():
    spec, name = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    mujoco.mj_step(model, data, 30)
    assert contact_history(model, data, name)[0, PHASE] != OPEN
    mujoco.mj_resetData(model, data)
    assert not contact_history(model, data, name).any()


def test_many_mjdata_come_and_go():
    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    for _ in range(200):
        data = mujoco.MjData(model)
        data.qvel[2] = -1.0
        mujoco.mj_step(model, data, 3)


def test_the_native_contact_of_the_pair_is_off_and_that_with_others_stays():
    spec, _ = ball_on_floor(steel_pair(), timestep=1e-5)
    spec.worldbody.add_geom(name="wall", type=GEOM.mjGEOM_BOX, size=[0.1, 1, 1], pos=[0.1 + RADIUS - 1e-4, 0, 0.5])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] -= 1e-6
    mujoco.mj_forward(model, data)
    assert [sorted(model.geom(g).name for g in c.geom) for c in data.contact[: data.ncon]] == [["ball", "wall"]]
    assert data.qfrc_passive[2] > 0.0


def test_geoms_without_others_leave_the_collision_detection_and_bounce_alike():
    after = []
    for others in (True, False):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
        floor = spec.worldbody.add_geom(type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
        body = spec.worldbody.add_body(pos=[0, 0, RADIUS])
        body.add_freejoint()
        ball = body.add_geom(size=[RADIUS, 0, 0], density=DENSITY)
        add_contact(spec, ball, floor, steel_pair(), others=others)
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qvel[:3] = [0.1, 0, -1]
        mujoco.mj_step(model, data, 150)
        after.append(data.qvel.copy())
        assert (model.npair, ball.contype) == ((1, 1) if others else (0, 0))
    assert np.array_equal(*after)


def test_a_deep_overlap_does_not_bring_the_native_contact_back():
    for floor in ("plane", "box"):
        spec, _ = ball_on_floor(steel_pair(radius=1e6), floor=floor)  # so flat that no warning of depth is due
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qpos[2] = 0.2 * RADIUS
        mujoco.mj_forward(model, data)
        assert data.ncon == 0


XML = """<mujoco><option timestep="1e-6" gravity="0 0 0" {option}/>
<extension><plugin plugin="contactlaw.contact"><instance name="bounce">{config}</instance></plugin></extension>
<worldbody><geom name="floor" type="plane" size="1 1 .1"/>
<body pos="0 0 .0254"><freejoint/><geom name="ball" size=".0254" density="7833"/></body></worldbody>
<contact>{native}</contact></mujoco>"""
KEYS = {"geom1": "ball", "geom2": "floor", "material1": "steel", "material2": "steel", "friction": "0.115"}
OFF = '<pair geom1="ball" geom2="floor" margin="-1e6"/>'


def xml(option="", native=OFF, **changes):
    config = "".join(f'<config key="{k}" value="{v}"/>' for k, v in {**KEYS, **changes}.items() if v)
    return XML.format(option=option, config=config, native=native)


def test_xml_and_add_contact_make_the_same_contact():
    spec, _ = ball_on_floor(steel_pair())
    after = []
    for model in (spec.compile(), mujoco.MjModel.from_xml_string(xml(restitution="0.93"))):
        data = mujoco.MjData(model)
        data.qvel[:3] = [0.1, 0.0, -1.0]
        mujoco.mj_step(model, data, 150)
        after.append(data.qvel.copy())
    assert np.array_equal(*after)


def test_a_spec_with_the_law_survives_a_round_trip_through_xml():
    pair = ContactPair(Material(1.1e9, 0.31), Material(2e9, 0.4), 0.3, 0.7, law="mindlin", stiffness_ratio=0.6)
    spec, name = ball_on_floor(pair, plane=[0, 1, 0])
    model = mujoco.MjModel.from_xml_string(spec.to_xml())
    data = mujoco.MjData(model)
    original = spec.compile()
    other = mujoco.MjData(original)
    for m, d in ((model, data), (original, other)):
        d.qvel[:3] = [0.1, 0.0, -1.0]
        mujoco.mj_step(m, d, 100)
    assert np.array_equal(data.qvel, other.qvel)
    assert contact_history(model, data, name).shape == contact_history(original, other, name).shape


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"friction": "-0.1"}, "friction = -0.1: must be finite and >= 0"),
        ({"friction": ""}, "friction: missing"),
        ({"law": "mindlim"}, "did you mean 'mindlin'"),
        ({"geom2": "flor"}, "geom2 = 'flor'"),
        ({"geom2": "ball"}, "another geom"),
        ({"material1": "cheese"}, "material1 = 'cheese'"),
        ({"restitution": "0"}, "restitution = 0.0: must be in (0, 1]"),
        ({"native": ""}, '<pair geom1="ball" geom2="floor"'),
        ({"option": 'integrator="RK4"'}, "integrator = RK4"),
        ({"option": '><flag spring="disable" damper="disable"/></option><option'}, "disableflags"),
    ],
)
def test_xml_that_cannot_be_is_refused_with_the_reason(changes, said, capfd):
    with pytest.raises(ValueError, match="init failed"):
        mujoco.MjModel.from_xml_string(xml(**changes))
    assert said in capfd.readouterr().err


def test_an_unknown_key_is_refused():
    with pytest.raises(ValueError, match="frictoin"):
        mujoco.MjModel.from_xml_string(xml(frictoin="0.1"))


def shapes_spec():
    return mujoco.MjSpec.from_string(
        '<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/><body name="b" pos="0 0 .1"><freejoint/>'
        '<geom name="can" type="cylinder" size=".1 .1"/><geom name="ball" size=".1"/></body></worldbody></mujoco>'
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"geom2": "flor"}, "geom2 = 'flor': must be one of .*did you mean 'floor'"),
        ({"geom1": 3}, "geom1 = 3"),
        ({"geom1": "can"}, "cylinder 'can' on plane 'floor' has no one clear radius"),
        ({"geom2": "ball"}, "another geom"),
        ({"pair": 0.1}, "pair = 0.1"),
        ({"spec": shapes_spec().compile()}, "before the model is compiled"),
        ({"plane": [0, 0, 2]}, "plane = .*unit vector"),
        ({"plane": [0, 0, np.nan]}, "plane: holds nan"),
    ],
)
def test_bad_input_is_refused_and_changes_nothing(change, said):
    spec = shapes_spec()
    arguments = {"spec": spec, "geom1": "ball", "geom2": "floor", "pair": steel_pair(), **change}
    before = spec.to_xml()
    with pytest.raises(ValueError, match=said):
        add_contact(**arguments)
    assert spec.to_xml() == before


def test_a_pair_is_added_once():
    spec = shapes_spec()
    add_contact(spec, "ball", "floor", steel_pair())
    for geoms in (("ball", "floor"), ("floor", "ball")):
        with pytest.raises(ValueError, match="added before"):
            add_contact(spec, *geoms, steel_pair())


def test_geoms_without_names_get_one():
    spec = mujoco.MjSpec()
    floor = spec.worldbody.add_geom(type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    body = spec.worldbody.add_body(pos=[0, 0, 1])
    body.add_freejoint()
    ball = body.add_geom(size=[0.1, 0, 0])
    add_contact(spec, ball, floor, steel_pair())
    assert ball.name != floor.name
    mujoco.MjData(spec.compile())


def test_a_step_too_long_for_the_contact_is_named_with_the_one_to_use():
    spec, _ = ball_on_floor(steel_pair(), timestep=1e-4)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    with pytest.warns(ContactWarning, match="use 1.74e-05 s or less"):
        mujoco.mj_step(model, data, 3)


def test_a_deep_contact_is_warned_of():
    spec, _ = ball_on_floor(ContactPair(Material(1e5, 0.5), Material(1e5, 0.5), 0.1), timestep=1e-5)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = 0.8 * RADIUS
    with pytest.warns(ContactWarning, match="overlap over radius is 0.2"):
        mujoco.mj_step(model, data)


def test_a_box_edge_asks_for_a_radius():
    for radius, warned in ((None, True), (RADIUS, False)):
        spec, _ = ball_on_floor(steel_pair(radius=radius), floor="box")
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qpos[0] = 1.0 + 0.5 * RADIUS
        data.qpos[2] = np.sqrt(0.75) * RADIUS - 1e-6
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            mujoco.mj_step(model, data)
        assert any("edge" in str(w.message) for w in caught) == warned


def test_free_flight_is_untouched():
    spec, _ = ball_on_floor(steel_pair(), timestep=1e-3)
    plain = mujoco.MjSpec.from_string("<mujoco><option gravity='0 0 0' timestep='1e-3'/></mujoco>")
    body = plain.worldbody.add_body(pos=[0, 0, RADIUS])
    body.add_freejoint()
    body.add_geom(size=[RADIUS, 0, 0], density=DENSITY)
    after = []
    for model in (spec.compile(), plain.compile()):
        data = mujoco.MjData(model)
        data.qpos[2] = 1.0
        data.qvel[:] = [1, 2, 3, 4, 5, 6]
        mujoco.mj_step(model, data, 100)
        after.append(np.concatenate([data.qpos, data.qvel]))
    assert np.array_equal(*after)


def test_a_process_ends_cleanly_with_the_plugin_in_use():
    code = (
        "import mujoco, contactlaw.mujoco_plugin as p, contactlaw as c;"
        "s = mujoco.MjSpec(); s.worldbody.add_geom(name='f', type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1]);"
        "b = s.worldbody.add_body(); b.add_freejoint(); b.add_geom(name='b', size=[.1, 0, 0]);"
        "m = c.MATERIALS['steel']; p.add_contact(s, 'b', 'f', c.ContactPair(m, m, .1)); m = s.compile();"
        "d = [mujoco.MjData(m) for _ in range(3)]; mujoco.mj_step(m, d[0]); print('done')"
    )
    finished = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=False)
    assert (finished.returncode, finished.stdout.strip()) == (0, "done"), finished.stderr


def test_a_mujoco_whose_structs_lie_elsewhere_is_refused(monkeypatch):
    from contactlaw.mujoco_plugin import layout

    layout.check()
    monkeypatch.setitem(layout.DATA, "cvel", layout.DATA["cvel"] + 8)
    with pytest.raises(ImportError, match=r"does not fit MuJoCo .*mjData\.cvel"):
        layout.check()


def test_a_mujoco_of_another_age_is_refused(monkeypatch):
    from contactlaw.mujoco_plugin.register import register

    monkeypatch.setattr(mujoco, "__version__", "3.2.1")
    with pytest.raises(ImportError, match=r"MuJoCo 4\.0 and later 4\.x, not 3\.2\.1"):
        register()


def bounce_of(model):
    """Upward velocity of the only free body after it has struck at 1 m/s."""
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.1, 0.0, -1.0]
    mujoco.mj_step(model, data, 300)
    return data.qvel[2]


def test_the_contact_is_kept_when_a_spec_is_copied_or_attached():
    spec, _ = ball_on_floor(steel_pair())
    expected = bounce_of(spec.compile())
    assert expected == pytest.approx(0.93, abs=1e-3)
    assert bounce_of(spec.copy().compile()) == expected
    for prefix in ("x_", ""):
        child, _ = ball_on_floor(steel_pair())
        parent = mujoco.MjSpec()
        parent.option.timestep, parent.option.gravity = 1e-6, [0, 0, 0]
        parent.attach(child, frame=parent.worldbody.add_frame(), prefix=prefix)
        assert bounce_of(parent.compile()) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("radius", [None, 0.025])
def test_the_side_of_a_capsule_does_not_pass_through_a_box(radius):
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
    spec.worldbody.add_geom(name="block", type=GEOM.mjGEOM_BOX, size=[0.05] * 3, pos=[0, 0, -0.05])
    body = spec.worldbody.add_body(pos=[0, 0, 0.025])
    body.add_freejoint()
    body.add_geom(
        name="bar",
        type=GEOM.mjGEOM_CAPSULE,
        size=[0.025, 0.2, 0],
        quat=[np.sqrt(0.5), 0, np.sqrt(0.5), 0],
        density=1000,
    )
    add_contact(spec, "bar", "block", steel_pair(radius=radius, friction=0.0))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, 600)
    assert data.qvel[2] > 0.5
    assert any("side of a capsule" in str(w.message) for w in caught) == (radius is None)


def test_a_deep_start_at_rest_with_a_long_step_is_said():
    spec, _ = ball_on_floor(steel_pair(restitution=1.0), timestep=2e-3)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] -= 1.5e-3
    with pytest.warns(ContactWarning, match="does not resolve the contact"):
        mujoco.mj_step(model, data)


def test_a_contact_out_of_the_plane_it_was_given_is_said_and_does_nothing():
    spec, _ = ball_on_floor(steel_pair(), plane=[0, 0, 1])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    with pytest.warns(ContactWarning, match="not in the plane of motion"):
        mujoco.mj_step(model, data, 20)
    assert np.isfinite(data.qvel).all()
    assert data.qvel[2] == -1.0


def test_sleeping_bodies_are_refused(capfd):
    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    with pytest.raises(mujoco.FatalError, match="init failed"):
        mujoco.MjData(model)
    assert "sleep must be off" in capfd.readouterr().err


def test_a_geom_of_another_spec_is_refused():
    spec, other = shapes_spec(), shapes_spec()
    with pytest.raises(ValueError, match="must be a geom of the spec"):
        add_contact(spec, other.geom("ball"), "floor", steel_pair())


def test_rollouts_on_two_threads_give_the_bits_of_one():
    from mujoco import rollout

    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    states = []
    for speed in (0.5, 1.0, 1.5, 2.0):
        mujoco.mj_resetData(model, data)
        data.qvel[:3] = [0.1, 0.05, -speed]
        mujoco.mj_step(model, data, 20)  # each starts in mid-contact
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        states.append(state)
    results = []
    for threads in (1, 2):
        datas = [mujoco.MjData(model) for _ in range(threads)]
        out, _ = rollout.rollout(model, datas, initial_state=np.array(states), nstep=150)
        results.append(out)
    assert np.array_equal(*results)
