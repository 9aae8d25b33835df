"""What the fronts are measured with: impacts as asked, balls that are judged rightly, the table of the law."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import collide
from sims.worlds import State
from validation.ball import FRICTION, RADIUS, RESTITUTION, SPEED, launch, steel_pair
from validation.cases import front_engines
from validation.cases.front_engines import CHI, DURATION, KAPPA, Way
from validation.front_ways import thrown


@pytest.mark.parametrize(("psi_1", "chi"), [(0.3, 0.5), (2.0, 1.441), (5.0, 2.0)])
def test_a_body_is_thrown_with_the_numbers_asked(psi_1, chi):
    impact = collide(*thrown("microslip", psi_1, chi), steps=100)
    assert impact.psi_1 == pytest.approx(psi_1, rel=1e-12) and impact.chi == pytest.approx(chi, rel=1e-12)


@pytest.mark.parametrize("spinning", [False, True])
def test_a_launch_slides_as_asked(spinning):
    velocity, spin, along = launch(0.3, 0.7, spinning=spinning)
    point = velocity + np.cross(spin, [0.0, 0.0, -RADIUS])
    assert point @ along == pytest.approx(0.3, rel=1e-12) and velocity[2] == -SPEED
    assert bool(spin.any()) == spinning


class Mirror:
    """A ball that turns its normal velocity round, scaled, when it comes to the floor; its sliding goes on."""

    def __init__(self, restitution: float) -> None:
        self.restitution, self.dt = restitution, DURATION

    def start(self, state):
        (_, _, z), velocity, spin = state
        self.height, self.velocity, self.spin = z - RADIUS, np.array(velocity), np.array(spin)

    def step(self, count=1):
        for _ in range(count):
            self.height += self.dt * self.velocity[2]
            if self.height < 0.0 and self.velocity[2] < 0.0:
                self.velocity[2] *= -self.restitution

    def place(self):
        return np.array([0.0, 0.0, RADIUS + self.height])

    def read(self):
        return State(self.place()[None], np.eye(3)[None], self.velocity[None], self.spin[None])


def thrown_all(restitution: float) -> front_engines._Bounces:
    psi_1 = [0.5, 2.0]
    way = Way("mirror", DURATION, lambda: Mirror(restitution), patience=50 * DURATION)
    bounces = front_engines._Bounces(way, psi_1, np.array([0.1, 0.2]))
    bounces.throw_all()
    return bounces


def test_errors_and_steps_of_a_ball_are_as_they_are():
    bounces = thrown_all(RESTITUTION)
    assert not bounces.problem
    assert bounces.errors.reshape(-1, 2) == pytest.approx(np.tile([0.4, 1.8], (bounces.way.phases.size, 1)), abs=1e-12)
    # Depth after the step of the touch is (1 - phase) steps at the speed; the way out at e times that speed.
    out = np.ceil((1.0 - bounces.way.phases) / RESTITUTION)
    assert bounces.counts.reshape(-1, 2).tolist() == [[1 + n, 1 + n] for n in out.astype(int)]


def test_a_ball_that_gains_energy_does_not_count():
    assert "energy grown" in thrown_all(1.2).problem


def test_rounds_meet_the_impacts_in_turn():
    bounces = thrown_all(RESTITUTION)
    steps = []
    for _ in range(2 + 5):
        bounces.next()
        steps.append(bounces.count)
    assert bounces.counts_of(5).tolist() == steps[2:]


def test_friction_beyond_its_limit_does_not_count(monkeypatch):
    monkeypatch.setattr(front_engines, "CHI", 0.01)  # so little that what stops the sliding is too much
    way = Way("sticky", DURATION, lambda: Sticky(1.0), patience=50 * DURATION)
    bounces = front_engines._Bounces(way, [2.0], np.array([0.0]))
    bounces.throw_all()
    assert "friction cone" in bounces.problem


class Sticky(Mirror):
    """The same, which stops all sliding."""

    def step(self, count=1):
        super().step(count)
        self.velocity[:2] = 0.0
        self.spin[:] = 0.0


def test_the_scaled_launch_is_that_of_the_reference():
    pair = steel_pair()
    assert pair.psi(2.0 * FRICTION / KAPPA * SPEED, SPEED) == pytest.approx(2.0)
    assert pytest.approx(1.44, abs=0.03) == CHI
