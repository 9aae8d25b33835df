"""Many contacts in MuJoCo: sets of geoms, heaps, readouts, ledgers."""

import numpy as np
import pytest
from mujoco_scenes import DENSITY, GEOM, MASS, RADIUS, free_ball, mujoco, steel_pair, with_data

from contactlaw import ContactPair, rebound
from contactlaw.mujoco_plugin import add_contact, contacts_of, instances, ledger_of


def balls(places, timestep=2e-3, gravity=0.0, floor=False):
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = timestep, [0, 0, -gravity]
    if floor:
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    for i, place in enumerate(places):
        free_ball(spec, place, f"ball{i}")
    return spec


@pytest.mark.parametrize("psi_1", [0.5, 1.2, 3.0])
@pytest.mark.parametrize("timestep", [2e-3, 1e-5])
def test_a_ball_on_a_free_block_meets_the_law(psi_1, timestep):
    """The block's arm to the point grows as they slide past each other, that of the ball stays."""
    spec, half, block = balls([[0.0, 0.0, RADIUS + 1.3e-3]], timestep), 0.05, DENSITY * 0.1**3
    body = spec.worldbody.add_body(pos=[0, 0, -half])
    body.add_freejoint()
    body.add_geom(name="block", type=GEOM.mjGEOM_BOX, size=[half] * 3, mass=block)
    pair = steel_pair()
    add_contact(spec, "ball0", "block", pair)
    model, data = with_data(spec.compile())
    scale = pair.kappa / pair.friction
    data.qpos[0] -= 1.3e-3 * psi_1 / scale
    data.qvel[:3] = psi_1 / scale, 0.0, -1.0
    mujoco.mj_step(model, data, int(4e-3 / timestep))
    ball, other = data.qvel.reshape(2, 6)
    sliding = ball[0] - RADIUS * ball[4] - other[0] - half * other[4]
    normal = 1.0 / (1.0 / MASS + 1.0 / block)
    across = 1.0 / (3.5 / MASS + (1.0 + 1.5) / block)
    expected = rebound(psi_1, pair.chi(normal, across), restitution=pair.restitution)
    assert scale * sliding == pytest.approx(expected, abs=1.5e-3)


def test_sets_are_what_the_pairs_by_hand_are():
    places = [[0, 0, RADIUS], [2.02 * RADIUS, 0, RADIUS], [1.01 * RADIUS, 0.3 * RADIUS, 2.9 * RADIUS]]
    names = [f"ball{i}" for i in range(3)]
    after = []
    for in_sets in (True, False):
        spec = balls(places, 2e-3, 9.81, floor=True)
        if in_sets:
            add_contact(spec, names, [*names, "floor"], steel_pair())
        else:
            for i in range(3):
                for other in [*names[i + 1 :], "floor"]:
                    add_contact(spec, names[i], other, steel_pair())
        model, data = with_data(spec.compile())
        mujoco.mj_step(model, data, 150)
        assert data.ncon == 0
        after.append(np.concatenate([data.qpos, data.qvel]))
    assert after[1] == pytest.approx(after[0], abs=1e-7)


def test_the_configurations_that_are_read_grow_with_the_contacts_not_with_their_square(monkeypatch):
    """Of contacts added one by one: at first each was read twice for each other one while the model was compiled."""
    read, counts = instances.configured, []
    monkeypatch.setattr(instances, "configured", lambda *given: counts.append(given) or read(*given))
    calls = []
    for n in (10, 20):
        spec = balls([[0.1 * i, 0.0, 0.1] for i in range(n)], floor=True)
        for i in range(n):
            add_contact(spec, f"ball{i}", "floor", steel_pair())
        counts.clear()
        mujoco.MjData(spec.compile())
        calls.append(len(counts))
    assert calls[1] < 2.5 * calls[0]


def test_a_set_survives_copies_xml_and_attachment():
    names = ["ball0", "ball1"]
    spec = balls([[0, 0, 1.2 * RADIUS], [0, 0, 3.4 * RADIUS]], 2e-3, 9.81, floor=True)
    add_contact(spec, names, [*names, "floor"], steel_pair(), substeps=50)

    def run(spec):
        model, data = with_data(spec.compile())
        mujoco.mj_step(model, data, 100)
        return data.qpos.copy()

    expected = run(spec)
    parent = mujoco.MjSpec()
    parent.attach(spec.copy(), prefix="left_", suffix="_x", frame=parent.worldbody.add_frame())
    assert np.array_equal(run(parent), expected)
    assert run(mujoco.MjSpec.from_string(spec.to_xml())) == pytest.approx(expected, abs=1e-9)


def test_a_heap_comes_to_rest_and_weighs_what_its_balls_weigh():
    rng = np.random.default_rng(3)
    places = [[2.2 * RADIUS * (i % 2), 2.2 * RADIUS * (i // 2 % 2), RADIUS * (1.5 + 2.2 * (i // 4))] for i in range(8)]
    spec = balls(np.array(places) + rng.uniform(-1e-3, 1e-3, (8, 3)), 2e-3, 9.81, floor=True)
    walls = []
    for name, place, quat in (
        ("left", [-1.2 * RADIUS, 0, 0], [0.5**0.5, 0, 0.5**0.5, 0]),
        ("right", [3.4 * RADIUS, 0, 0], [0.5**0.5, 0, -(0.5**0.5), 0]),
        ("front", [0, -1.2 * RADIUS, 0], [0.5**0.5, -(0.5**0.5), 0, 0]),
        ("back", [0, 3.4 * RADIUS, 0], [0.5**0.5, 0.5**0.5, 0, 0]),
    ):
        walls.append(name)
        spec.worldbody.add_geom(name=name, type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1], pos=place, quat=quat)
    names = [f"ball{i}" for i in range(8)]
    name = add_contact(spec, names, [*names, "floor", *walls], steel_pair(friction=0.3, restitution=0.5), others=False)
    model, data = with_data(spec.compile())
    mujoco.mj_step(model, data, 1500)
    v = (data.qvel).reshape(-1, 6)[:, :3]
    assert np.abs(v).max() < 5e-3
    floor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor")
    lift = sum(contact.force[2] for contact in contacts_of(model, data, name) if contact.geom2 == floor)
    lift += sum(c.force[2] for c in contacts_of(model, data, name) if floor not in (c.geom1, c.geom2)
                and 0 in (model.geom_bodyid[c.geom1], model.geom_bodyid[c.geom2]))  # fmt: skip
    assert lift == pytest.approx(8 * MASS * 9.81, rel=2e-2)


@pytest.mark.parametrize("swapped", [False, True])
def test_a_bounce_is_read_out(swapped):
    pair = steel_pair(friction=0.2, restitution=0.8)
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = 2e-3, [0, 0, 0]
    spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    free_ball(spec, [0, 0, RADIUS + 1e-3])
    geoms = ("floor", "ball") if swapped else ("ball", "floor")
    name = add_contact(spec, *geoms, pair)
    model, data = with_data(spec.compile())
    data.qvel[:3] = [0.1, 0.05, -1.0]
    before, impulse = data.qvel[:3].copy(), np.zeros(3)
    for _ in range(5):
        mujoco.mj_step(model, data)
        for contact in contacts_of(model, data, name):
            impulse += contact.impulse
            assert contact.normal[2] == (-1.0 if swapped else 1.0)
    assert impulse == pytest.approx((-1 if swapped else 1) * MASS * (data.qvel[:3] - before), rel=1e-9)
    ledger = ledger_of(model, data, name)
    known = ContactPair(pair.a, pair.b, pair.friction, pair.restitution, RADIUS)
    assert ledger.impacts == 1
    assert ledger.greatest_overlap == pytest.approx(known.greatest_overlap(MASS, 1.0), rel=1e-3)
    assert ledger.greatest_force == pytest.approx(known.greatest_force(MASS, 1.0), rel=1e-2)
    assert ledger.time_in_contact == pytest.approx(known.contact_duration(MASS, 1.0), rel=0.02)
    assert ledger.normal_work == pytest.approx(0.5 * MASS * (1.0 - 0.8**2), rel=1e-2)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"substeps": 5}, "substeps = 5: must be an integer >= 10"),
        ({"substeps": 20.5}, "substeps = 20.5"),
        ({"crowd_substeps": 5}, "crowd_substeps = 5: must be an integer >= 10"),
    ],
)
def test_bad_settings_are_refused(arguments, said):
    spec = balls([[0, 0, 0], [1, 0, 0]])
    with pytest.raises(ValueError, match=said):
        add_contact(spec, "ball0", "ball1", steel_pair(), **arguments)
    assert not list(spec.plugins)


def test_sets_without_a_pair_are_refused():
    spec = balls([[0, 0, 0], [1, 0, 0]])
    with pytest.raises(ValueError, match="geom1: holds no geoms"):
        add_contact(spec, [], "ball1", steel_pair())
