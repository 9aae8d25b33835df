"""The worlds and recordings that the scenes are made with."""

from math import cos, pi, sin

import numpy as np
import pytest

pytest.importorskip("typer")

from contactlaw import MATERIALS, ContactPair
from sims.outlines import DARK, polygons_of
from sims.recording import Recording, Track
from sims.scene import Settings, find_scenes
from sims.worlds import new_world
from sims.worlds.parts import matrix_to_quaternion, onto

SCENES = find_scenes()


def test_a_recording_is_kept(tmp_path):
    recording = SCENES["under_table"].run(Settings("pybullet"))
    kept = Recording.load(recording.save(tmp_path / "kept.npz"))
    assert kept.facts == recording.facts and kept.view == recording.view
    assert np.array_equal(kept.times, recording.times)
    for one, two in zip(kept.tracks, recording.tracks, strict=True):
        assert (one.name, one.shape, one.size, one.mass, one.inertia) == (
            two.name, two.shape, two.size, two.mass, two.inertia,
        )  # fmt: skip
        for kind in ("positions", "rotations", "velocities", "spins"):
            assert np.array_equal(getattr(one, kind), getattr(two, kind))
    for one, two in zip(kept.scenery, recording.scenery, strict=True):
        assert (one.name, one.solid) == (two.name, two.solid) and np.array_equal(one.points, two.points)
    scene = SCENES["under_table"]
    assert scene.measure(kept) == scene.measure(recording)


def test_velocities_of_a_recording_are_true_ones(engine):
    world = new_world(Settings(engine, timestep=4e-3))
    turn = onto(np.array([0.6, 0.0, 0.8]))
    world.box("brick", [0.1, 0.1, 0.1], 2.0, [0, 0, 1.0], [0.3, -0.2, 1.5], [0.5, -2.0, 1.0], rotation=turn)
    world.plane("floor")
    recording = world.record(0.2)
    brick = recording.track("brick")
    assert brick.velocities[:, 2] == pytest.approx(1.5 - 9.81 * recording.times, abs=1e-9)
    assert brick.positions[:, 2] == pytest.approx(1.0 + 1.5 * recording.times - 4.905 * recording.times**2, abs=1e-9)
    assert np.ptp(brick.energy([0.0, 0.0, -9.81])) < 1e-9
    assert brick.spins == pytest.approx(np.tile([0.5, -2.0, 1.0], (recording.times.size, 1)), abs=1e-9)
    assert brick.rotations[0] == pytest.approx(turn)


def test_a_paddle_follows_its_path_and_gives_a_ball_its_speed(engine):
    def path(time: float) -> list[float]:
        return [0.0, 0.0, -0.01 + 2.0 * time]

    steel = ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.2)
    world = new_world(Settings(engine, timestep=1e-3), gravity=(0, 0, 0))
    world.ball("ball", 0.02, 0.1, [0, 0, 0.05])
    world.paddle("paddle", [0.1, 0.1, 0.01], path)
    world.contact("ball", "paddle", steel)
    recording = world.record(0.05)
    paddle, ball = recording.track("paddle"), recording.track("ball")
    assert paddle.positions == pytest.approx(np.array([path(t) for t in recording.times]), abs=1e-9)
    assert paddle.velocities[1:, 2] == pytest.approx(2.0)
    assert ball.velocities[-1, 2] == pytest.approx(4.0, rel=2e-3)  # elastic, off something that nothing slows


def test_quaternions_turn_as_their_matrices():
    for angle in (0.0, 0.7, 2.5, pi):
        for number in range(3):
            axis = np.roll([1.0, 0.0, 0.0], number)
            skew = np.cross(axis, np.eye(3)).T
            matrix = np.eye(3) + sin(angle) * skew + (1.0 - cos(angle)) * skew @ skew
            expected = np.array([cos(0.5 * angle), *(sin(0.5 * angle) * axis)])
            assert abs(matrix_to_quaternion(matrix) @ expected) == pytest.approx(1.0)
    assert onto(np.array([0.6, 0.0, 0.8])) @ [0, 0, 1] == pytest.approx([0.6, 0.0, 0.8])


@pytest.mark.parametrize(("turn", "dark"), [(0.0, 0.5), (0.5 * pi, 0.0), (-0.5 * pi, 1.0), (-pi / 6, 0.75)])
def test_the_dark_half_of_a_ball_is_seen_as_it_is_turned(turn, dark):
    # the ball's x axis lies in the picture, then points away from who looks along +y, then at them
    matrix = np.array([[cos(turn), -sin(turn), 0.0], [sin(turn), cos(turn), 0.0], [0.0, 0.0, 1.0]])
    still = np.zeros((1, 3))
    track = Track("ball", "ball", (1.0,), still, matrix[None], still, still)
    corners = next(corners for corners, tone in polygons_of(track, 0, (0, 2)) if tone == DARK)
    x, y = corners.T
    area = 0.5 * abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1)))
    assert area == pytest.approx(dark * pi, abs=0.01)


def test_what_is_wrong_with_a_world_is_said():
    pytest.importorskip("pybullet")
    world = new_world(Settings("pybullet"))
    world.plane("floor")
    with pytest.raises(ValueError, match="one of this name"):
        world.ball("floor", 0.1, 1.0, [0, 0, 1])
    with pytest.raises(ValueError, match="name = 'bal'"):
        world.contact("bal", "floor", ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.2))
    world.ball("ball", 0.1, 1.0, [0, 0, 1])
    world.record(0.01)  # and let go of the engine
    with pytest.raises(ValueError, match="bounces = 99"):
        SCENES["superball"].run(Settings("pybullet", options={"bounces": 99}))
    with pytest.raises(ValueError, match="option = 'bounce'"):
        SCENES["superball"].run(Settings("pybullet", options={"bounce": 3}))
