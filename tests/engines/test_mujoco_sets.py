"""Large sets of geoms in MuJoCo: nothing of a model grows with the square of how many there are."""

import numpy as np
import pytest
from mujoco_scenes import GEOM, free_ball, mujoco, steel_pair, with_data

from contactlaw.mujoco_plugin import add_contact, contacts_of, overlaps_of

RADIUS = 0.01


def lattice(count, gap=2.5):
    """Balls in a cube over a floor, a gap of so many radii from centre to centre."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 2e-3
    spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    across = int(np.ceil(count ** (1 / 3)))
    for i in range(count):
        place = gap * RADIUS * np.array([i % across, i // across % across, i // across**2 + 0.6])
        free_ball(spec, place, f"ball{i}", RADIUS)
    return spec, [f"ball{i}" for i in range(count)]


def touching(model):
    """Names of the geoms in contact, natively, by two."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return {frozenset((model.geom(a).name, model.geom(b).name)) for a, b in data.contact.geom}


@pytest.mark.parametrize("others", [True, False])
def test_a_model_grows_as_its_geoms(others):
    """Five times as many balls: 25 times as many pairs."""
    sizes = []
    for count in (100, 500):
        spec, balls = lattice(count)
        add_contact(spec, balls, [*balls, "floor"], steel_pair(), others=others)
        model = spec.compile()
        again = mujoco.MjModel.from_xml_string(spec.to_xml())
        assert again.npluginstate == model.npluginstate
        sizes.append([len(spec.to_xml()), model.npluginstate, model.npluginattr, model.nbuffer, 100 + model.npair])
    assert np.all(np.array(sizes[1]) < 6 * np.array(sizes[0]))


def test_a_set_touches_others_natively_and_its_own_not():
    spec, balls = lattice(30, 1.9)  # each overlaps the next ones
    for name, contype, conaffinity in (("both", 1, 1), ("sends", 1, 0), ("receives", 0, 1), ("neither", 0, 0)):
        body = spec.worldbody.add_body(name=name, pos=[0.0, 0.0, 0.006])
        body.add_freejoint()
        body.add_geom(name=name, size=[0.011, 0, 0], contype=contype, conaffinity=conaffinity)

    before = touching(spec.copy().compile())
    add_contact(spec, balls, [*balls, "floor"], steel_pair())
    after = touching(spec.compile())
    own = {pair for pair in before if pair <= {*balls, "floor"}}
    assert len(own) > 30 and after == before - own
    assert {frozenset(("ball0", name)) for name in ("both", "sends", "receives")} <= after


def test_two_sets_that_touch_each_other_keep_what_is_native_within_each():
    spec, balls = lattice(40, 1.9)
    first, second = balls[::2], balls[1::2]

    before = touching(spec.copy().compile())
    add_contact(spec, first, second, steel_pair())
    after = touching(spec.compile())
    assert after == {pair for pair in before if pair <= set(first) or pair <= set(second) or "floor" in pair}
    assert not spec.pairs  # one for each two of them would be 400


def test_contacts_of_large_sets_are_those_that_overlap():
    spec, balls = lattice(343, 1.999)
    name = add_contact(spec, balls, [*balls, "floor"], steel_pair(), others=False)
    model, data = with_data(spec.compile())
    mujoco.mj_forward(model, data)
    expected = 3 * 7 * 7 * 6
    assert len(overlaps_of(model, data)) == expected
    model.opt.timestep = 1e-9
    mujoco.mj_step(model, data)
    found = contacts_of(model, data, name)
    assert len(found) == expected and all(contact.touching for contact in found)
    assert len({frozenset((contact.geom1, contact.geom2)) for contact in found}) == expected
