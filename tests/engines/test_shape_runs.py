"""Random drops in the worlds of the scenes: what is thrown lands, whatever its shape and the engine."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.world.data.frames import matrix_of
from validation.shape_draws import WALL, draw
from validation.shape_runs import ENGINES, judge

pytest.importorskip("mujoco")
pytest.importorskip("pybullet")


@pytest.mark.filterwarnings("ignore::contactlaw.ContactWarning")
@pytest.mark.parametrize(
    ("engine", "kind"), [("mujoco", "hull"), ("mujoco", "ellipsoid"), ("pybullet", "hull"), ("none", "hull")]
)
def test_a_drop_begins_as_drawn_and_lands(engine, kind):
    drop = draw(3, (kind,))
    run = ENGINES[engine](drop)
    places, turns, velocities, spins = run.states()
    for number, thing in enumerate(drop.things):
        np.testing.assert_allclose(places[number], thing.place, atol=1e-12)
        np.testing.assert_allclose(turns[number], matrix_of(thing.turn), atol=1e-12)
        np.testing.assert_allclose(velocities[number], thing.velocity, atol=1e-12)
        np.testing.assert_allclose(spins[number], thing.spin, atol=1e-12)
    first = run.look()
    looks = []
    for _ in range(round(0.3 / drop.step)):
        run.world.step()
        looks.append(run.look())
    assert any(look.touched.any() for look in looks) and looks[-1].energy.sum() < 1.01 * first.energy.sum()
    assert run.sunk() < 1e-3 and np.abs(run.states()[0][:, :2]).max() < WALL
    run.world.close()


def test_what_spins_on_a_patch_beside_its_centre_is_at_rest():
    """A tilted ellipsoid rolls for more than three seconds, then spins about its point of contact for seventeen."""
    verdict = judge("mujoco", draw(130))
    assert not verdict.wrong
    assert 3.0 < verdict.rest < 4.5
