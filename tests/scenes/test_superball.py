"""The superball: it comes back, and what is known of its bounces."""

from math import sqrt

import numpy as np
import pytest

pytest.importorskip("typer")

from sims.bounces import bounces_of
from sims.loaded_rebound import loaded_rebound
from sims.puck import ENGINES
from sims.recording import Recording, Track
from sims.scene import Limit, Settings, find_scenes
from sims.superball import BACKSPIN, RADIUS, flight, garwin
from validation.reference.annulus import rebound_extrapolated

SCENES = find_scenes()


@pytest.mark.parametrize("timestep", [None, 1e-4, 1 / 60])
def test_a_superball_comes_back_bounce_after_bounce(engine, timestep):
    # at 0.1 ms a contact of 3 ms is resolved; 1/60 s is five times as long
    scene = SCENES["superball"]
    measured = scene.measure(scene.run(Settings(engine, timestep=timestep)))
    assert all(check.passed for check in scene.check(measured))
    bounces = measured["bounces"]
    assert len(bounces) == 6
    assert max(abs(one["psi2"] - one["psi2_reference"]) for one in bounces) <= 1e-3  # ten times closer than is asked
    assert all(one["spin_before"] * one["spin_after"] < 0.0 for one in bounces)


def test_the_engines_own_contact_gives_no_superball(engine):
    scene = SCENES["superball"]
    measured = scene.measure(scene.run(Settings(engine, "native")))
    assert all(one["spin_after"] * one["spin_before"] > -1e-3 for one in measured["bounces"])


def test_both_engines_throw_the_same_ball():
    pytest.importorskip("mujoco")
    pytest.importorskip("pybullet")
    scene = SCENES["superball"]
    one, two = (scene.measure(scene.run(Settings(engine)))["bounces"] for engine in ENGINES)
    assert [b["x"] for b in one] == pytest.approx([b["x"] for b in two], abs=1e-3)


def test_a_check_that_is_not_kept_is_seen():
    assert not Limit("error", 0.01, 0.02).passed
    assert not Limit("bounces", 6, 5, at_least=True).passed
    assert not Limit("error", 0.01, float("nan")).passed
    scene = SCENES["superball"]
    measured = scene.measure(scene.run(Settings("pybullet", "coulomb"))) | {"law": "microslip"}
    said = [check.name for check in scene.check(measured) if not check.passed]
    assert "error of psi2 at a bounce" in said and "bounces that reverse the spin" in said


def test_weight_in_the_contact():
    for e in (1.0, 0.9):
        light = loaded_rebound(1.2, 1.05, e, 0.0)
        assert light.psi_2 == pytest.approx(rebound_extrapolated(1.2, 1.05, e)[0], abs=1e-4)
        assert light.restitution == pytest.approx(e, abs=1e-8)
    # sliding throughout friction gives mu times the normal impulse, and that is 2 and the load's over the contact
    heavy = loaded_rebound(6.0, 1.05, 1.0, 0.01)
    assert heavy.psi_2 == pytest.approx(6.0 - 2.0 * 1.05 * (2.0 + 0.01 * heavy.duration), abs=1e-5)
    assert heavy.restitution == pytest.approx(1.0, abs=1e-8)  # a load has a potential
    with pytest.raises(ValueError, match="does not leave"):
        loaded_rebound(1.2, 1.05, 0.5, 5.0)


def throw(speed: float = 1.0, height: float = 0.1) -> Recording:
    """A superball before its first bounce, as a recording of one entry."""
    still = np.zeros((1, 3))
    spin = still - [0.0, BACKSPIN * speed / RADIUS, 0.0]
    track = Track(
        "ball", "ball", (RADIUS,), still + [0, 0, RADIUS + height], np.eye(3)[None], still + [speed, 0, 0], spin
    )
    return Recording(np.zeros(1), [track], facts={"gravity": [0.0, 0.0, -9.81]})


def test_bounces_are_found_between_the_entries_of_a_recording():
    height, speed = 0.1, 1.0
    fall = sqrt(2.0 * height / 9.81)
    bounces = bounces_of(flight(throw(speed, height), garwin, 4), "ball")
    assert [one.time for one in bounces] == pytest.approx([fall, 3 * fall, 5 * fall, 7 * fall], abs=1e-9)
    for number, one in enumerate(bounces):
        side = (-1.0) ** number
        assert one.place == pytest.approx([side * speed * fall, 0.0, RADIUS], abs=1e-9)
        assert one.velocity_before[0] == pytest.approx(side * speed) and one.velocity_after[0] == pytest.approx(
            -side * speed
        )
        assert one.approach == pytest.approx(9.81 * fall) and one.departure == pytest.approx(9.81 * fall)
        before, after = one.sliding(RADIUS)
        assert before == pytest.approx(side * (1.0 + BACKSPIN) * speed) and after == pytest.approx(-before)
        assert one.duration == pytest.approx(0.0, abs=1e-9)
