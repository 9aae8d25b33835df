"""What touches in more than one point is refused in both engines, whatever radius is given; what does not is served."""

import numpy as np
import pytest

from contactlaw import ContactPair

PAIR = ContactPair("steel", "steel", friction=0.3, restitution=0.8, radius=0.02)
CORNERS = [[x, y, z] for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.02, 0.02)]
VERTICES = " ".join(str(x) for corner in CORNERS for x in corner)
GEOMS = {
    "plane": 'type="plane" size="1 1 1"',
    "box": 'type="box" size=".02 .02 .02"',
    "cylinder": 'type="cylinder" size=".02 .02"',
    "mesh": 'type="mesh" mesh="cube"',
    "ellipsoid": 'type="ellipsoid" size=".02 .03 .025"',
    "round ellipsoid": 'type="ellipsoid" size=".02 .02 .02"',
    "capsule": 'type="capsule" size=".02 .02"',
    "sphere": 'type="sphere" size=".02"',
    "hfield": 'type="hfield" hfield="hills"',
}
REFUSED = [("plane", "plane")]
SERVED = [
    ("sphere", "plane"), ("sphere", "box"), ("sphere", "cylinder"), ("sphere", "mesh"), ("sphere", "ellipsoid"),
    ("sphere", "sphere"), ("sphere", "capsule"), ("capsule", "plane"), ("capsule", "box"), ("capsule", "capsule"),
    ("round ellipsoid", "plane"), ("round ellipsoid", "mesh"), ("box", "sphere"), ("mesh", "sphere"),
    ("mesh", "plane"), ("mesh", "box"), ("mesh", "mesh"), ("capsule", "mesh"), ("ellipsoid", "plane"),
    ("ellipsoid", "box"), ("ellipsoid", "ellipsoid"), ("ellipsoid", "mesh"), ("capsule", "ellipsoid"),
    ("box", "plane"), ("box", "box"), ("cylinder", "plane"), ("cylinder", "box"), ("cylinder", "cylinder"),
    ("capsule", "cylinder"), ("ellipsoid", "cylinder"), ("mesh", "cylinder"), ("sphere", "hfield"), ("box", "hfield"),
    ("capsule", "hfield"), ("mesh", "hfield"), ("ellipsoid", "hfield"), ("cylinder", "hfield"),
]  # fmt: skip


def model_of(moving, ground, joint="<freejoint/>"):
    return f"""<mujoco><asset><mesh name="cube" vertex="{VERTICES}"/>
      <hfield name="hills" nrow="2" ncol="2" size="1 1 .1 .1" elevation="0 0 0 0"/></asset><worldbody>
      <body pos="0 0 -.02"><geom name="ground" {GEOMS[ground]}/></body>
      <body pos="0 0 .1">{joint}<geom name="moving" {GEOMS[moving]} density="2000"/></body></worldbody></mujoco>"""


TORUS = """<mujoco><extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>
  <asset><mesh name="torus"><plugin instance="t"/></mesh></asset><worldbody>
  <geom name="ground" type="sdf" mesh="torus"><plugin instance="t"/></geom>
  <body pos="0 0 1"><freejoint/><geom name="moving" size=".02"/></body></worldbody></mujoco>"""


@pytest.fixture
def load_model():
    pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import load_model

    return load_model


@pytest.mark.parametrize("other", [True, False])
@pytest.mark.parametrize("ground", ["box", "mesh", "ellipsoid", "cylinder", "plane", "hfield"])
@pytest.mark.parametrize("moving", ["mesh", "ellipsoid", "sphere"])
def test_mujoco_pushes_nothing_that_the_law_has(load_model, moving, ground, other):
    mujoco = pytest.importorskip("mujoco")
    model = load_model(model_of(moving, ground), [("moving", "ground", PAIR, {"others": other})], overlaps="keep")
    data = mujoco.MjData(model)
    data.qpos[2] = 0.01 if ground not in ("plane", "hfield") else 0.0
    mujoco.mj_forward(model, data)
    assert data.nefc == 0


@pytest.mark.parametrize(("moving", "ground"), SERVED)
def test_mujoco_serves_what_touches_in_a_point(load_model, moving, ground):
    load_model(model_of(moving, ground), [("moving", "ground", PAIR)])


def test_mujoco_refuses_from_xml_too(load_model, capfd):
    mujoco = pytest.importorskip("mujoco")
    keys = {"geom1": "moving", "geom2": "ground", "material1": "steel", "material2": "steel", "friction": "0.3",
            "radius": "0.02"}  # fmt: skip
    config = "".join(f'<config key="{key}" value="{value}"/>' for key, value in keys.items())
    plugin = (
        f'<extension><plugin plugin="contactlaw.contact"><instance name="x">{config}</instance></plugin></extension>'
    )
    pair = '<contact><pair geom1="moving" geom2="ground" margin="-1e6"/></contact>'
    text = TORUS.replace("<asset>", plugin + pair + "<asset>")
    with pytest.raises(ValueError, match="init failed"):
        mujoco.MjModel.from_xml_string(text)
    assert "sdf 'ground': MuJoCo computes no reliable distance" in capfd.readouterr().err


@pytest.mark.parametrize("ground", ["cylinder", "mesh", "ellipsoid"])
def test_mujoco_serves_a_capsule_on_any_shape_where_neither_is_free(load_model, ground):
    slide = '<joint type="slide" axis="0 0 1"/>'
    load_model(model_of("capsule", ground, slide), [("moving", "ground", PAIR)])


def pybullet_shape(p, client, kind):
    size = {
        "plane": {}, "box": {"halfExtents": [0.02] * 3}, "cylinder": {"radius": 0.02, "height": 0.04},
        "mesh": {"vertices": CORNERS}, "capsule": {"radius": 0.02, "height": 0.04}, "sphere": {"radius": 0.02},
        "flat mesh": {"vertices": [[x, y, 0] for x in (-1, 1) for y in (-1, 1)]},
    }  # fmt: skip
    shape = getattr(p, f"GEOM_{kind.split()[-1].upper()}")
    return p.createCollisionShape(shape, physicsClientId=client, **size[kind])


def add(client, moving, ground):
    p = pytest.importorskip("pybullet")
    from contactlaw.pybullet_callback import ContactCallback

    place = p.createMultiBody(0.0, pybullet_shape(p, client, ground), physicsClientId=client)
    body = p.createMultiBody(1.0, pybullet_shape(p, client, moving), -1, [0, 0, 0.1], physicsClientId=client)
    callback = ContactCallback(client)
    callback.add_contact(body, place, PAIR)
    callback.step()


IN_PYBULLET = {"plane", "box", "cylinder", "mesh", "capsule", "sphere"}


@pytest.mark.parametrize(("moving", "ground"), [pair for pair in REFUSED if set(pair) <= IN_PYBULLET])
def test_pybullet_refuses_by_the_bodies(client, moving, ground):
    with pytest.raises(
        ValueError, match=rf"body 1 \({moving}\) and body 0 \({ground}\).*point; the law serves spheres"
    ):
        add(client, moving, ground)


@pytest.mark.parametrize(("moving", "ground"), [pair for pair in SERVED if set(pair) <= IN_PYBULLET])
def test_pybullet_serves_what_touches_in_a_point(client, moving, ground):
    add(client, moving, ground)


def test_pybullet_measures_a_mesh_all_in_a_plane(client):
    with pytest.raises(ValueError, match=r"body 1 \(box\) and body 0 \(concave or flat mesh\)"):
        add(client, "box", "flat mesh")
    add(client, "sphere", "flat mesh")


def test_a_ball_on_a_mesh_or_cylinder_bounces_as_on_a_box(load_model):
    mujoco = pytest.importorskip("mujoco")
    speeds = []
    for ground in ("box", "mesh", "cylinder"):
        model = load_model(model_of("sphere", ground), [("moving", "ground", PAIR)])
        model.opt.gravity[:] = 0.0
        data = mujoco.MjData(model)
        data.qvel[:3] = [0.01, 0.0, -1.0]
        mujoco.mj_step(model, data, 70)
        speeds.append(data.qvel * ([1.0] * 3 + [0.02] * 3))
    assert speeds[0][2] == pytest.approx(0.8, rel=1e-3)
    np.testing.assert_allclose(speeds[1:], 2 * [speeds[0]], atol=1e-3)
