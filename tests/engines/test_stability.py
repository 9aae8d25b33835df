"""The trials that stability is judged by, and what they found: contacts that last, run out of substeps, or part."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pybullet")

from contactlaw import rebound
from validation.cases.stability_map import DURATIONS, MASS_RATIOS, MODULI
from validation.stability import NOT_FINITE, judged, tally
from validation.stability_draws import EXTREMES, bounces, chattering, extreme, resting
from validation.stability_trials import MASS, RADIUS, SOLID, Trial, pair_of
from validation.stability_worlds import ENGINES, NATIVE, ONCE, STIFF, WAYS, TrialWorld

MADE = {"modulus": 1e9, "poisson": 0.3, "friction": 0.3, "restitution": 1.0}


def oblique(steps: float) -> Trial:
    """A ball that is about to hit a floor at psi_1 = 1.2 without gravity, for two contacts of so many steps each."""
    pair = pair_of(MADE)
    contact = pair.contact_duration(MASS, 1.0)
    step = contact / steps
    velocity = np.array([[1.2 * pair.friction / pair.kappa, 0.0, -1.0]])
    place = np.array([[0.0, 0.0, RADIUS + 0.4 * step]])
    return Trial(MADE, step, 2.0 * contact + 2.0 * step, contact, place, velocity, np.zeros((1, 3)))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("way", WAYS)
def test_a_world_starts_as_its_trial_says(engine: str, way: str) -> None:
    trial = bounces((2, 3), ratio=3.0)
    assert trial is not None
    state = TrialWorld(engine, trial, way).read()
    for found, wanted in zip((state.position, state.velocity, state.spin),
                             (trial.places, trial.velocities, trial.spins), strict=True):  # fmt: skip
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-15)
    places, velocities, spins = trial.places, trial.velocities, trial.spins
    assert trial.first_energy() == pytest.approx(trial.kinetic(velocities, spins) + trial.potential(places), rel=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("cell", "number"), [((3, 1), 1), ((3, 2), 111), ((4, 2), 7), ((6, 0), 115)])
def test_a_ball_in_flight_does_not_pass_through_one_that_lies(engine: str, cell: tuple[int, int], number: int) -> None:
    """In steps of half a second and more: only the one of them falls."""
    row, column = cell
    ratio = 10.0 ** np.random.default_rng([*cell, number, 1]).uniform(*MASS_RATIOS)
    steps, modulus = (DURATIONS[column], DURATIONS[column + 1]), (MODULI[row], MODULI[row + 1])
    trial = bounces((*cell, number), steps, ratio=ratio, modulus=modulus)
    assert trial is not None
    verdict = judged(engine, trial, "microslip")
    assert verdict.gain < 1e-6, str(trial)


@pytest.mark.parametrize("engine", ENGINES)
def test_evaluated_once_a_step_the_law_is_right_where_the_step_resolves_it(engine: str) -> None:
    """Of second order in the step, and against `rebound`."""
    errors = []
    for steps in (100.0, 400.0):
        trial = oblique(steps)
        one = TrialWorld(engine, trial, ONCE)
        one.step(round(trial.duration / trial.step))
        _, _, velocity, spin = one.read()
        pair = trial.pair()
        sliding = velocity[0, 0] - RADIUS * spin[0, 1]
        wanted = float(rebound(1.2, pair.chi(MASS, MASS / (1.0 + 1.0 / SOLID))))
        errors.append(abs(pair.kappa / MADE["friction"] * sliding - wanted))
        assert velocity[0, 2] == pytest.approx(1.0, rel=1e-2)
    assert errors[0] < 2e-2
    assert errors[1] < 4e-3


@pytest.mark.parametrize("engine", ENGINES)
def test_theory_says_where_once_a_step_holds(engine: str) -> None:
    """A ball pressed into a floor by its weight, stuck: omega dt just below and above 2 across the normal.

    The engine keeps the velocity of half a step before, zero: weight and contact are in balance.
    """
    for turn, grows in ((1.9, False), (2.1, True)):
        trial = resting((0, 0), 0.1)
        trial.made["restitution"] = 1.0
        trial.made["friction"] = 1e3
        deep = float(trial.places[0, 2] - trial.datum[0, 2])
        stiffness = 2.0 * trial.pair().effective_shear_modulus * sqrt(RADIUS * deep)
        step = turn / sqrt(stiffness * (1.0 + 1.0 / SOLID) / MASS)
        nudged = Trial(
            trial.made, step, 400.0 * step, trial.contact, trial.datum - [0.0, 0.0, deep],
            np.array([[1e-9 * deep / step, 0.0, 0.5 * step * trial.gravity[2]]]), np.zeros((1, 3)),
            gravity=trial.gravity, datum=trial.datum,
        )  # fmt: skip
        one = TrialWorld(engine, nudged, ONCE)
        one.step(60)
        moved = abs(one.read().spin[0, 1]) * RADIUS * step / deep
        assert (moved > 1e-3) == grows, (turn, moved)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("turn", [0.3, 30.0, 1e3])
@pytest.mark.parametrize("number", range(2, 12, 4))
def test_a_damped_ball_wedged_into_a_groove_comes_to_rest(engine: str, turn: float, number: int) -> None:
    verdict = judged(engine, resting((8, 3, number), turn), "microslip")
    assert not verdict.problem


@pytest.mark.parametrize("engine", ENGINES)
def test_elastic_chatter_keeps_its_energy(engine: str) -> None:
    """Sixty impacts between two walls, three in each step; a sum over steps to their very end gains 1e-5 in each."""
    for number in range(3):
        trial = chattering((5, number), 3.0, 1.0)
        trial.made["friction"] = 0.0
        assert judged(engine, trial, "microslip").left == pytest.approx(1.0, abs=1.2e-4)


def test_trials_are_what_their_names_say() -> None:
    for level, value in enumerate(EXTREMES["psi_1"].levels):
        trial = extreme("psi_1", level, 3, 12)
        assert trial is not None
        sliding = trial.velocities[0] - RADIUS * np.cross(trial.spins[0], [0.0, 0.0, 1.0])
        if trial.made["friction"] > 0.0:
            across = float(np.hypot(*sliding[:2]))
            assert trial.pair().psi(across, -float(trial.velocities[0, 2])) == pytest.approx(value, rel=1e-9)
    for level, value in enumerate(EXTREMES["overlap"].levels):
        trial = extreme("overlap", level, 2, 12)
        assert trial is not None
        assert -trial.gaps(trial.places).min() / RADIUS == pytest.approx(value, rel=1e-6)
    assert extreme("ratio", 0, 1, 12).masses.tolist() == pytest.approx([MASS, 1e6 * MASS])  # type: ignore[union-attr]


def test_a_tally_names_what_fails() -> None:
    """Stiff springs in steps longer than the contact: MuJoCo's explode, and say so."""
    trials = [bounces((4, number), (-2.0, -1.0), restitution=1.0) for number in range(4)]
    found = tally("mujoco", STIFF, [*trials, None])
    assert found["runs"] == 4
    assert found["failures"]
    assert found["gain"] > 1e-3
    assert all(one["problem"] in ("energy gained", NOT_FINITE) and "modulus" in one["trial"]
               for one in found["failures"])  # fmt: skip
    assert tally("mujoco", NATIVE, trials)["kept"] < 0.9
