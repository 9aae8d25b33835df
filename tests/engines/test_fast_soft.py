"""Bodies whose cores lie in each other, as soft ones that meet fast, or whose middles coincide: nothing is gained."""

from pathlib import Path

import numpy as np
import pytest
from mujoco_scenes import mujoco, with_data

from contactlaw import ContactPair, Material
from contactlaw.mujoco_plugin import load_model

SOFT = ContactPair(Material(1e7, 0.45), Material(1e7, 0.45), friction=0.0, restitution=1.0)
STEP, SPEED, STEPS = 1e-3, 10.0, 250  # [s], [m/s]: an impact lies within the first fifty


def words(numbers: object) -> str:
    return " ".join(f"{x:.9g}" for x in np.ravel(np.asarray(numbers)))


def two_of(kinds: tuple[str, str], seed: int) -> str:
    """Two bodies of random sizes and turns, 12 cm apart."""
    rng = np.random.default_rng(seed)
    bodies, meshes = "", ""
    for i, (place, kind) in enumerate(zip((0.0, 0.12), kinds, strict=True)):
        turn, off = rng.normal(size=4), rng.uniform(-0.01, 0.01, 2)
        size = rng.uniform(0.01, 0.04, 3)
        shape = f'size="{words(size)}"'
        if kind == "mesh":
            points = rng.normal(size=(30, 3))
            points *= size / np.linalg.norm(points, axis=1)[:, None]
            meshes += f'<mesh name="m{i}" vertex="{words(points)}"/>'
            shape = f'mesh="m{i}"'
        bodies += (
            f'<body pos="{place} {words(off)}" quat="{words(turn)}"><freejoint/>'
            f'<geom type="{kind}" {shape} density="1200"/></body>'
        )
    option = f'<option timestep="{STEP}" gravity="0 0 0" integrator="RK4"><flag energy="enable"/></option>'
    return f"<mujoco>{option}<asset>{meshes}</asset><worldbody>{bodies}</worldbody></mujoco>"


@pytest.mark.filterwarnings("ignore::contactlaw.ContactWarning")
@pytest.mark.parametrize(
    ("kind", "other", "first"),
    [
        ("mesh", "mesh", 0),
        ("box", "box", 0),
        ("ellipsoid", "box", 0),
        ("ellipsoid", "mesh", 12),
        ("cylinder", "mesh", 12),
    ],
)
def test_cores_in_each_other_give_no_energy(kind: str, other: str, first: int, tmp_path: Path):
    path = tmp_path / "two.xml"
    met = 0
    for seed in range(first, first + 12):
        path.write_text(two_of((kind, other), seed))
        model, data = with_data(load_model(path, [("*", "*", SOFT)]))
        data.qvel[6] = -SPEED
        mujoco.mj_forward(model, data)
        start = data.energy[1]
        mujoco.mj_step(model, data, STEPS)
        mujoco.mj_forward(model, data)
        met += abs(data.qvel[6] + SPEED) > 0.1
        assert data.energy[1] <= 1.01 * start, (kind, other, seed)
    assert met > 6


@pytest.mark.parametrize(
    ("fixed", "free", "inertia"),
    [
        ('type="sphere" size=".35"', 'type="sphere" size=".35"', 0.4 * 10.0 * 0.35**2),
        ('type="ellipsoid" size=".3 .32 .35"', 'type="ellipsoid" size=".3 .32 .35"', 2.0 * (0.3**2 + 0.32**2)),
        ('type="capsule" size=".2 .2"', 'type="ellipsoid" size=".3 .32 .35"', 2.0 * (0.3**2 + 0.32**2)),
    ],
)
def test_concentric_shapes_leave_each_other_alone(fixed, free, inertia):
    """They have no normal; as a zero vector it made positions NaN once something else pressed, or the step endless."""
    model = load_model(
        f"""<mujoco><option gravity="0 0 0"/><worldbody><geom {fixed}/>
        <geom type="capsule" size=".1" fromto="-.35 0 0 -.8 0 0"/><body><joint type="slide" axis="1 0 0"/>
        <joint axis="0 0 1"/><geom {free} mass="10"/></body></worldbody></mujoco>""",
        [("*", "*", ContactPair("rubber", "steel", friction=1.0, restitution=0.5))],
    )
    for push in (5.0, -5.0):
        data = mujoco.MjData(model)
        data.qfrc_applied[:] = push, 5.0
        mujoco.mj_step(model, data, 5)
        alone = np.array([push / 10.0, 5.0 / inertia]) * data.time**2 / 2.0
        if push > 0.0:
            assert data.qpos == pytest.approx(alone, rel=1e-3)
        else:  # it presses on what it touches beside
            assert np.isfinite(data.qpos).all() and (np.abs(data.qpos) <= 1.001 * np.abs(alone)).all()
