"""What the text of Maw, Barber & Fawcett (1981) says of an impact, of the annulus solution and of the law.

Where the converged solution has a sharper figure than the text, the test holds that figure and the comment says so.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from contactlaw import rebound
from sims.puck import Puck
from validation.rebound_figure import INCH, sized, thrown
from validation.reference.annulus import impact
from validation.reference.annulus import rebound as reference_rebound

pytestmark = pytest.mark.heavy

STEEL, RUBBER = 1.256, 1.0  # chi of the paper's pucks
ANNULI = 60
PARTIAL_STICK = {STEEL: [0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 3.8], RUBBER: [0.25, 0.5, 1.0, 1.2, 2.0, 2.8]}
EVERY = [(chi, psi_1) for chi, values in PARTIAL_STICK.items() for psi_1 in values]
AN_INSTANT = 2e-3  # of the duration: the steps of the histories are shorter


@cache
def history(psi_1, chi=STEEL):
    return impact(psi_1, chi, ANNULI, steps=1600)


@cache
def law_history(psi_1, material="steel"):
    """Time over duration, F/(mu P_max) and P/P_max of the law."""
    puck = Puck(material=material, psi_1=psi_1, restitution=1.0)
    found = thrown(puck, steps=1000)
    largest = found.normal_force.max()
    force = -found.tangential_force @ puck.tangent / (puck.pair.friction * largest)
    return found.time / found.time[-1], force, found.normal_force / largest


def sticks_from(psi_1, chi=STEEL):
    one = history(psi_1, chi)
    return float(one.time[one.stuck.any(axis=1).argmax()])


def sticks_until(psi_1, chi=STEEL):
    one = history(psi_1, chi)
    return float(one.time[np.flatnonzero(one.stuck.any(axis=1))[-1]])


def reverses_at(time, force):
    return float(time[np.flatnonzero(force < -1e-9)[0]])


def normal_speed(one):
    """Approach speed over the first one, of an elastic Hertz impact."""
    return np.sqrt(np.maximum(1.0 - one.overlap**2.5, 0.0)) * np.where(one.time <= 0.5, 1.0, -1.0)


# Figs. 1 and 2: the impact at psi_1 = 1.2.


def test_gross_slip_turns_into_stick_between_a_fifth_and_three_tenths_of_the_impact():
    assert 0.2 < sticks_from(1.2) < 0.3
    time, force, limit = law_history(1.2)
    slipping = force[1:-1] > limit[1:-1] * (1.0 - 1e-9)
    assert time[1:-1][~slipping][0] == pytest.approx(sticks_from(1.2), abs=AN_INSTANT)


def test_force_falls_from_about_four_tenths_on():
    # The greatest force is at 0.357; by tenths of the impact, as Fig. 2 shows it, that is 0.4.
    one = history(1.2)
    assert round(float(one.time[one.tangential_force.argmax()]), 1) == 0.4
    assert one.time[one.tangential_force.argmax()] == pytest.approx(0.357, abs=AN_INSTANT)
    time, force, _ = law_history(1.2)
    assert time[force.argmax()] == pytest.approx(0.357, abs=2 * AN_INSTANT)


def test_nothing_is_stuck_from_about_nine_tenths_on():
    # The last stuck annulus lets go at 0.870.
    assert round(sticks_until(1.2), 1) == 0.9
    one = history(1.2)
    late = one.time > sticks_until(1.2)
    assert one.traction[late] == pytest.approx(-one.pressure[late], abs=1e-7)
    time, force, limit = law_history(1.2)
    assert force[time > 0.88] == pytest.approx(-limit[time > 0.88], abs=1e-9)
    assert np.all(np.abs(force)[(time > 0.45) & (time < 0.85)] < limit[(time > 0.45) & (time < 0.85)] - 1e-3)


def test_counter_slip_grows_from_the_edge_inwards():
    one = history(1.2)
    inner = np.array([one.stuck[k].sum() for k in np.flatnonzero((one.time > 0.5) & (one.time < sticks_until(1.2)))])
    assert np.all(np.diff(inner) <= 0) and inner[0] > 0.85 * ANNULI and inner[-1] <= 0.25 * ANNULI
    for k in np.flatnonzero((one.time > 0.5) & (one.time < 0.87)):
        stuck = np.flatnonzero(one.stuck[k])
        assert stuck.size == 0 or np.array_equal(stuck, np.arange(stuck.size))  # a core without gaps


# The three regimes.


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
@pytest.mark.parametrize("psi_1", [0.1, 0.5, 1.0])
def test_up_to_psi_1_of_one_the_impact_starts_stuck(psi_1, chi):
    one = history(psi_1, chi)
    growing = (one.time > 0.0) & (one.time < 0.35)
    covered = (one.pressure > 0.0).sum(axis=1)
    # The edge cuts the outermost annulus, whose guess may be slip; all others stick.
    assert np.all(one.stuck.sum(axis=1)[growing] >= covered[growing] - 1)
    assert one.stuck[growing, 0].all()


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
@pytest.mark.parametrize("part", [0.02, 0.2, 0.5, 0.9])
def test_between_one_and_4_chi_less_1_sliding_ends_everywhere_at_once(part, chi):
    psi_1 = 1.0 + part * (4.0 * chi - 2.0)
    one = history(psi_1, chi)
    covered = (one.pressure > 0.0).sum(axis=1)
    first = int(one.stuck.any(axis=1).argmax())
    assert first > 1 and not one.stuck[:first].any()
    assert one.tangential_force[1:first] == pytest.approx(one.normal_force[1:first], rel=1e-9)
    assert one.stuck[first].sum() >= covered[first] - 1
    # The appendix: all of the surface moves at the overlap's rate v, and the body's psi falls to it at this v.
    closing = (2.0 * chi - psi_1) / (2.0 * chi - 1.0)
    speed = normal_speed(one)
    assert speed[first] == pytest.approx(closing, abs=3.0 * np.abs(np.diff(speed)).max())  # to three steps


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
@pytest.mark.parametrize("beyond", [0.0, 0.3, 0.999, 1.0, 2.5])
def test_from_4_chi_less_1_on_everything_slides_though_rigid_theory_says_4_chi(beyond, chi):
    psi_1 = 4.0 * chi - 1.0 + beyond
    one = history(psi_1, chi)
    # With equality the velocities of sliding vanish together at the very end.
    assert not one.stuck[: -2 if beyond == 0.0 else None].any()
    assert one.psi_2 == pytest.approx(psi_1 - 4.0 * chi, abs=1e-9)
    assert rebound(psi_1, chi) == pytest.approx(psi_1 - 4.0 * chi, abs=1e-9)


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
def test_just_below_4_chi_less_1_it_sticks(chi):
    assert history(4.0 * chi - 1.0 - 0.02, chi).stuck.any()


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
def test_elastic_recovery_keeps_the_surfaces_sliding_when_the_body_no_longer_does(chi):
    one = history(4.0 * chi - 0.5, chi)
    assert one.psi[-1] < 0.0  # the puck's own contact point has come back
    surface = one.psi - normal_speed(one)  # less the velocity of the elastic displacement
    assert surface.min() > 0.0


# The tangential force as an oscillation.


@pytest.mark.parametrize(("chi", "psi_1"), EVERY)
def test_the_force_makes_a_full_cycle_wherever_anything_sticks(chi, psi_1):
    one = history(psi_1, chi)
    assert one.tangential_force.max() > 0.1 and one.tangential_force.min() < -1e-3
    after = reverses_at(one.time, one.tangential_force)
    assert one.tangential_force[(one.time > after) & (one.time < 1.0)].max() < 0.0  # one reversal, no more
    time, force, _ = law_history(psi_1, "steel" if chi == STEEL else "rubber")
    assert force.max() > 0.1 and force.min() < -1e-3
    # The law's chi of steel is 1.2558, the paper's 1.256; that moves times by less than an instant.
    assert reverses_at(time, force) == pytest.approx(after, abs=2 * AN_INSTANT)


def test_near_4_chi_less_1_little_is_left_of_the_cycle():
    # At psi_1 = 4 and chi = 1.256 the force turns at 0.998, and reaches 1e-4 of mu P_max.
    one = history(4.0)
    assert reverses_at(one.time, one.tangential_force) > 0.997
    assert -3e-4 < one.tangential_force.min() < -1e-5


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
def test_reversal_and_stick_come_later_as_psi_1_grows(chi):
    values = PARTIAL_STICK[chi]
    reversals = [reverses_at(history(p, chi).time, history(p, chi).tangential_force) for p in values]
    assert np.all(np.diff(reversals) > AN_INSTANT)
    sticks = [sticks_from(p, chi) for p in values if p > 1.0]
    assert np.all(np.diff(sticks) > 10.0 * AN_INSTANT)


@pytest.mark.parametrize(("psi_1", "at"), [(0.5, 0.4355), (1.0, 0.407)])
def test_up_to_psi_1_of_one_microslip_starts_shortly_before_the_greatest_compression(psi_1, at):
    # Where the surface moves back faster than the overlap grows, -psi = v; ever later for smaller psi_1.
    one = history(psi_1)
    begins = float(one.time[np.flatnonzero(-one.psi > normal_speed(one))[0]])
    assert begins == pytest.approx(at, abs=AN_INSTANT)
    slipping = ((one.pressure > 0.0) & ~one.stuck).sum(axis=1)
    assert slipping[(one.time > 0.0) & (one.time < begins)].max() <= 1  # the annulus that the edge cuts
    wide = float(one.time[np.flatnonzero(slipping >= 2)[0]])
    assert begins < wide < 0.5


@pytest.mark.parametrize("psi_1", [1.2, 1.6, 2.0, 2.4])
def test_after_sticking_the_spring_still_extends(psi_1):
    one = history(psi_1)
    start = int(one.stuck.any(axis=1).argmax())
    assert one.psi[start] > 0.0
    assert one.tangential_force.max() > one.tangential_force[start]
    assert one.tangential_force[start : start + 10].min() >= one.tangential_force[start]


@pytest.mark.parametrize("psi_1", [2.6, 3.0, 3.8])
def test_from_2_chi_on_sticking_comes_after_the_greatest_compression_and_the_spring_shortens(psi_1):
    # The surfaces then meet while the overlap falls: psi = v < 0.
    one = history(psi_1)
    start = int(one.stuck.any(axis=1).argmax())
    assert one.time[start] > 0.5 and one.psi[start] < 0.0
    assert one.tangential_force[start:].max() <= one.tangential_force[start]


def test_frequencies_of_linear_springs_are_as_the_square_root_of_2_chi():
    puck = Puck(material="steel")
    tangential = puck.pair.kappa / (puck.mass / 3.0)
    assert np.sqrt(tangential / (1.0 / puck.mass)) == pytest.approx(1.58, abs=0.005)
    assert np.sqrt(2.0 * puck.chi) == pytest.approx(np.sqrt(tangential * puck.mass))


# Fig. 3, and the experiments.


@pytest.mark.parametrize("chi", [STEEL, RUBBER])
def test_angles_of_reflexion_are_negative_below_4_chi_and_positive_beyond(chi):
    psi_1 = np.linspace(0.1, 4.0 * chi - 0.02, 25)
    assert (np.asarray(reference_rebound(psi_1, chi, 20)) < 0.0).all()
    assert (np.asarray(rebound(psi_1, chi)) < 0.0).all()
    assert rebound(4.0 * chi + 0.02, chi) > 0.0


def test_results_do_not_depend_on_the_approach_speed_nor_on_the_size_of_the_puck():
    base = Puck(material="steel", psi_1=2.0)
    throws = [sized(replace(base, speed=s), d * INCH) for s in (0.5, 1.5) for d in (3.0, 4.0)]
    assert len({round(puck.contact_duration, 9) for puck in throws}) == 4  # they are different impacts
    assert np.ptp([thrown(puck).psi_2 for puck in throws]) < 1e-9


@pytest.mark.parametrize("psi_1", [0.5, 3.0, 5.0])
def test_spun_and_aimed_pucks_rebound_alike(psi_1):
    found = [thrown(Puck(material="steel", psi_1=psi_1, launch=launch)) for launch in ("oblique", "spin")]
    assert found[0].psi_1 == pytest.approx(psi_1) and found[1].psi_1 == pytest.approx(psi_1)
    assert found[0].psi_2 == pytest.approx(found[1].psi_2, abs=1e-9)


def test_an_aimed_puck_rolls_by_some_hundredths_of_the_contact_radius():
    # 1.5 % is typical by the text: at psi_1 = 1.2 that is met at 1.7 m/s, and it goes with V^(2/5), 1.2 % at 1 m/s.
    puck = Puck(material="steel", psi_1=1.2, restitution=1.0)

    def rolled(one):
        impact = thrown(one)
        push = impact.tangential_force @ one.tangent / one.mass
        gain = np.concatenate([[0.0], np.cumsum(0.5 * (push[1:] + push[:-1]) * np.diff(impact.time))])
        speed = one.start_motion[0] @ one.tangent + gain
        way = np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(impact.time))
        return float(way / np.sqrt(one.radius * impact.overlap.max()))

    assert rolled(puck) == pytest.approx(0.0121, abs=1e-4)
    assert rolled(replace(puck, speed=1.7)) == pytest.approx(0.015, abs=2e-4)
    assert rolled(replace(puck, speed=0.3)) == pytest.approx(rolled(puck) * 0.3**0.4, rel=1e-3)
    assert abs(rolled(replace(puck, launch="spin"))) < rolled(puck)
