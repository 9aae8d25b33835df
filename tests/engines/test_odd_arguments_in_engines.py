"""Arrays for numbers, text, None, NaN, extremes: the adapters give a result or an error that names the argument."""

from __future__ import annotations

import pytest

from contactlaw import ContactPair
from tests.odd_arguments import check_odd_arguments

PAIR = ContactPair("steel", "steel", 0.3, 0.9)
SCENE = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body pos="0 0 1"><freejoint/><geom name="ball" size=".1"/></body></worldbody></mujoco>"""
SETTINGS = {"pair": PAIR, "substeps": 100, "rounding": None}


def test_additions_to_mujoco_name_what_they_refuse():
    mujoco = pytest.importorskip("mujoco")
    from contactlaw.mujoco_plugin import add_contact, geoms_of, load_model

    def add(**named):
        add_contact(**{"spec": mujoco.MjSpec.from_string(SCENE), **named})

    check_odd_arguments(add, {**SETTINGS, "geom1": "ball", "geom2": "floor", "others": True, "overlaps": "relax"})
    check_odd_arguments(lambda spec: geoms_of(spec, "ball"), {"spec": mujoco.MjSpec.from_string(SCENE)})
    contacts = {"model": SCENE, "contacts": [("ball", "floor", PAIR)], "assets": None, "overlaps": "relax"}
    check_odd_arguments(load_model, contacts)
    table = {"model": SCENE, "contacts": {"*": "steel"}, "friction": 0.1, "restitution": 0.9, "skip": []}
    check_odd_arguments(load_model, table)
    entry, words = {"one": "ball", "two": "floor", "pair": PAIR}, dict.fromkeys(("one", "two"), "contacts[0]")
    check_odd_arguments(lambda one, two, pair: load_model(SCENE, [(one, two, pair)]), entry, words)


def test_readouts_of_mujoco_name_what_they_refuse():
    mujoco = pytest.importorskip("mujoco")
    from contactlaw import mujoco_plugin as plugin

    model = plugin.load_model(SCENE, [("ball", "floor", PAIR)])
    data = mujoco.MjData(model)
    (name,) = plugin.instances_of(model)
    check_odd_arguments(plugin.instances_of, {"model": model})
    for function in (plugin.contact_wrenches, plugin.overlaps_of):
        check_odd_arguments(function, {"model": model, "data": data})
    for function in (plugin.contacts_of, plugin.ledger_of):
        check_odd_arguments(function, {"model": model, "data": data, "name": name})
    check_odd_arguments(plugin.set_friction, {"model": model, "data": data, "name": name, "friction": 0.1})


def test_pybullets_callback_names_what_it_refuses(client):
    pybullet = pytest.importorskip("pybullet")
    from contactlaw.pybullet_callback import ContactCallback, links_of, load_urdf

    data = pytest.importorskip("pybullet_data").getDataPath()
    files = (f"{data}/{name}.urdf" for name in ("plane", "plane", "sphere2"))
    _, floor, ball = (pybullet.loadURDF(file, physicsClientId=client) for file in files)
    check_odd_arguments(ContactCallback, {"client": client, "fixed_bodies_move": True})
    check_odd_arguments(lambda body, client: links_of(body, "*", client=client), {"body": ball, "client": client})
    callback = ContactCallback(client)

    def add(**named):
        callback.remove_all()
        callback.add_contact(**named)

    def load(**named):
        callback.remove_all()
        load_urdf(**{"callback": callback, "contacts": [("*", floor, PAIR)], **named})

    words = {"body_a": "link_a", "body_b": "link_b"}  # of a body and its link
    check_odd_arguments(add, {**SETTINGS, "body_a": ball, "body_b": floor, "link_a": -1, "link_b": -1}, words)
    path = f"{data}/sphere2.urdf"
    check_odd_arguments(load, {"path": path, "undamped": True, "contacts": [("*", floor, PAIR)]})
    options: dict[str, object] = {"basePosition": [0, 0, 1], "baseOrientation": [0, 0, 0, 1], "useFixedBase": False}
    options |= {"useMaximalCoordinates": False, "flags": 0, "globalScaling": 1.0}
    outcome = dict.fromkeys(("globalScaling", "useFixedBase"), "contacts[0]")  # the law serves no such body
    check_odd_arguments(lambda **named: load(path=path, **named), options, outcome)
    with pytest.raises(ValueError, match="option = 'physicsClientId': must be one of"):
        load(path=path, physicsClientId=client)
    with pytest.raises(ValueError, match=r"option = 'basePositon': must be one of .*did you mean 'basePosition'"):
        load(path=path, basePositon=[0, 0, 1])
    entry = {"links": "*", "other": floor, "pair": PAIR, "own": {}}
    words |= dict.fromkeys(entry, "contacts[0]")
    check_odd_arguments(lambda **named: load(path=path, contacts=[tuple(named.values())]), entry, words)
    for name in ("state", "states", "ledger", "remove_contact"):
        check_odd_arguments(lambda handle, name=name: getattr(callback, name)(handle), {"handle": 99})
