"""The law in URDF files that others wrote: those that come with PyBullet."""

import pytest
from pybullet_scenes import p

from contactlaw import MATERIALS, ContactPair
from contactlaw.pybullet_callback import ContactCallback, links_of, load_urdf

pybullet_data = pytest.importorskip("pybullet_data")
STEEL, RUBBER = MATERIALS["steel"], MATERIALS["rubber"]
PAIR = ContactPair(STEEL, STEEL, friction=0.3, restitution=0.8)
TYRE = ContactPair(RUBBER, STEEL, friction=0.8, restitution=0.5, radius=0.05)
CAR, WHEELS = "racecar/racecar.urdf", [2, 3, 5, 7]


@pytest.fixture
def floor(client):
    """A floor in a world where Bullet finds its own files."""
    p.setAdditionalSearchPath(pybullet_data.getDataPath(), client)
    return p.loadURDF("plane.urdf", physicsClientId=client)


@pytest.fixture
def callback(client):
    return ContactCallback(client)


def run(callback, client, steps):
    for _ in range(steps):
        callback.step()


def test_links_are_chosen_by_name_and_pattern(client, floor):
    car = p.loadURDF(CAR, physicsClientId=client)
    assert links_of(floor, client=client) == [(floor, -1)]
    assert links_of(floor, "planeLink", client=client) == [(floor, -1)]
    assert links_of(car, "*_wheel", client=client) == [(car, link) for link in WHEELS]
    both = links_of(car, ["right_front_wheel", "*_wheel"], "left_rear_wheel", client=client)
    assert both == [(car, link) for link in (7, 2, 3, 5)]
    shaped = [key for key in links_of(car, client=client) if not p.getCollisionShapeData(*key, client)]
    assert shaped == [] and len(links_of([car, floor], client=client)) == 7


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("left_rear_whel", "names = 'left_rear_whel': no link has such a name; did you mean 'left_rear_wheel'"),
        ("*_whel", "did you mean 'left_front_wheel' or 'left_rear_wheel'"),
        ("chassis", "names = 'chassis': has no collision shape to touch with"),
        ("*hinge", "has no collision shape"),
        ("qqq", "links with a collision shape are laser, left_front_wheel"),
        (7, "names = 7: must be the name of a link"),
    ],
)
def test_a_wrong_name_is_told_with_the_nearest(client, floor, names, message):
    car = p.loadURDF(CAR, physicsClientId=client)
    with pytest.raises(ValueError) as error:
        links_of(car, names, client=client)
    assert message in str(error.value)


@pytest.mark.parametrize("body", [77, True, "car"])
def test_a_body_must_be_there(client, floor, body):
    with pytest.raises(ValueError, match=r"body = "):
        links_of(body, client=client)


@pytest.mark.parametrize("file", ["sphere_small.urdf", "sphere2.urdf", "soccerball.urdf"])
def test_a_ball_from_a_file_bounces_and_flies_undamped(client, floor, callback, file):
    loaded = load_urdf(callback, file, [("*", floor, PAIR)], basePosition=[0, 0, 0.6])
    p.resetBaseVelocity(loaded.body, [0, 0, -3.0], [0, 0, 0], client)
    run(callback, client, 100)
    velocity = p.getBaseVelocity(loaded.body, client)[0]
    assert velocity[2] == pytest.approx(2.4, rel=1e-3)
    assert callback.ledger(loaded.handles[0]).impacts == 1


def test_a_text_is_no_answer_to_yes_or_no(callback, floor):
    with pytest.raises(ValueError, match="undamped = 'no': must be True or False"):
        load_urdf(callback, "sphere_small.urdf", [("*", floor, PAIR)], undamped="no")


def test_damping_of_the_file_stays_if_asked_for(client, floor, callback):
    loaded = load_urdf(callback, "sphere_small.urdf", [("*", floor, PAIR)], undamped=False, basePosition=[0, 0, 2])
    p.resetBaseVelocity(loaded.body, [1.0, 0, 0], [0, 0, 0], client)
    run(callback, client, 30)
    assert p.getBaseVelocity(loaded.body, client)[0][0] < 0.999


@pytest.mark.parametrize(
    ("file", "links"),
    [(CAR, "*_wheel"), ("r2d2.urdf", "*_wheel"), ("husky/husky.urdf", "*_wheel_link")],
)
def test_wheels_that_are_meshes_are_served(client, floor, callback, file, links):
    """As convex hulls; no radius is asked for."""
    before = p.getNumBodies(client)
    loaded = load_urdf(callback, file, [(links, floor, PAIR)])
    assert len(loaded.handles) == 1
    assert p.getNumBodies(client) == before + 1


def test_links_of_one_file_may_touch_and_several_contacts_are_had(client, floor, callback):
    balls = [p.loadURDF("sphere_small.urdf", [1.0, y, 1.0], physicsClientId=client) for y in (0.0, 1.0)]
    contacts = [("*_wheel", balls[0], TYRE), ("left_front_wheel", balls[1], TYRE, {"substeps": 50})]
    loaded = load_urdf(callback, CAR, contacts)
    assert len(loaded.handles) == 2


@pytest.mark.parametrize(
    ("file", "contacts", "message"),
    [
        ("nowhere.urdf", [("*", 0, PAIR)], r"path = 'nowhere.urdf': .*setAdditionalSearchPath"),
        (CAR, [("*_wheel", 1, TYRE), ("*_whel", 1, TYRE)], r"contacts\[1\], links = '\*_whel'"),
        (CAR, [("*_wheel", "base", TYRE)], r"contacts\[0\], other = 'base'"),
        (CAR, [("*_wheel", 99, TYRE)], r"contacts\[0\]: body_b = 99"),
        (CAR, [("*_wheel", 0)], r"contacts\[0\] = .*must be \(links, other, pair\)"),
        (CAR, [("*_wheel", 0, "steel")], r"contacts\[0\]: pair = 'steel'"),
        (CAR, [], "contacts = "),
        (CAR, "wheels", "contacts = "),
    ],
)
def test_after_an_error_nothing_is_left(client, floor, callback, file, contacts, message):
    p.loadURDF("sphere_small.urdf", [1.0, 0.0, 1.0], physicsClientId=client)
    before = p.getNumBodies(client)
    with pytest.raises(ValueError, match=message):
        load_urdf(callback, file, contacts)
    assert p.getNumBodies(client) == before
    run(callback, client, 1)  # the callback looks for none of its bodies


def test_the_callback_must_be_one(client, floor):
    with pytest.raises(ValueError, match="callback = None"):
        load_urdf(None, CAR, [("*_wheel", floor, TYRE)])


def test_the_example_reverses_the_point_of_contact():
    from sims import urdf_example

    assert urdf_example.check()["law"].along[1] > 0.0


@pytest.mark.parametrize(("name", "told"), [("capsule", True), ("capsule_fromtoX", False), ("ant", False)])
def test_a_capsule_that_pybullet_does_not_tell_is_refused_before_it_ends_the_process(client, floor, name, told):
    body = p.loadMJCF(f"mjcf/{name}.xml", physicsClientId=client)[-1]
    if told:
        assert links_of(body, client=client) == [(body, -1)]
        return
    with pytest.raises(ValueError, match=rf"^body {body}.* has a capsule that loadMJCF made by fromto"):
        links_of(body, client=client)
