"""MuJoCo, and scenes that the tests of its plugin share; a test that imports them is skipped where MuJoCo is not."""

import numpy as np
import pytest

from contactlaw import ContactPair

mujoco = pytest.importorskip("mujoco")

from contactlaw.mujoco_plugin import add_contact  # noqa: E402

RADIUS, DENSITY = 0.0254, 7833.0
MASS = 4.0 / 3.0 * np.pi * RADIUS**3 * DENSITY
GEOM = mujoco.mjtGeom
WHOLE = mujoco.mjtState.mjSTATE_FULLPHYSICS
DISCRETE = ["discrete"] if hasattr(mujoco.mjtIntegrator, "mjINT_DISCRETE") else []  # from MuJoCo 3.13 on


def state_of(model, data):
    """All that a run goes on from."""
    state = np.empty(mujoco.mj_stateSize(model, WHOLE))
    mujoco.mj_getState(model, data, state, WHOLE)
    return state


BALL = """<mujoco><option timestep=".002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="b" pos="0 0 .025"><freejoint/><geom name="ball" size=".025" density="7833"/></body></worldbody></mujoco>"""
"""A ball at rest."""


FEET = "".join(f'<geom name="foot{i}" size=".02" pos="{x} {y} -.05"/>' for i, (x, y) in enumerate(
    [(-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.1, 0.1)]))  # fmt: skip
SLED = f"""<mujoco><option timestep=".002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="sled" pos="0 0 .07"><freejoint/><inertial pos="0 0 0" mass="2" diaginertia=".02 .02 .02"/>{FEET}</body>
</worldbody></mujoco>"""
"""A body on four balls."""


def with_data(model):
    return model, mujoco.MjData(model)


def free_ball(spec, place, name="ball", radius=RADIUS):
    """A steel ball; the name is that of its geom."""
    body = spec.worldbody.add_body(name=f"body of {name}", pos=place)
    body.add_freejoint()
    return body.add_geom(name=name, size=[radius, 0, 0], density=DENSITY)


def ball_on_floor(pair, timestep=1e-6, floor="plane", gravity=0.0, **settings):
    spec = mujoco.MjSpec()
    spec.option.timestep = timestep
    spec.option.gravity = [0.0, 0.0, -gravity]
    if floor == "plane":
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    else:
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_BOX, size=[1, 1, 0.1], pos=[0, 0, -0.1])
    free_ball(spec, [0, 0, RADIUS])
    return spec, add_contact(spec, "ball", "floor", pair, **settings)


def steel_pair(**changes):
    return ContactPair("steel", "steel", **{"friction": 0.115, "restitution": 0.93, **changes})


def duration(pair, speed=1.0):
    return ContactPair(pair.a, pair.b, pair.friction, pair.restitution, RADIUS).contact_duration(MASS, speed)


def bounce_of(model):
    """Upward velocity of the only free body after it has struck at 1 m/s."""
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.1, 0.0, -1.0]
    mujoco.mj_step(model, data, 300)
    return data.qvel[2]
