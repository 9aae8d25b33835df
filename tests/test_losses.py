"""Restitution and friction over speed: formulas against the motions they stand for, texts, tables, `collide`."""

from __future__ import annotations

from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np
import pytest

from contactlaw import Body, ContactPair, collide, force_along_path
from contactlaw.checks import text_of
from contactlaw.jit import INTERPRETED
from contactlaw.laws.oscillator import restitution
from contactlaw.laws.record import CONTACT, PAIR_SIZE, pair_of
from contactlaw.laws.step import reset
from contactlaw.losses import FallingFriction, OverSpeed, Plastic, Table, Viscoelastic, read, set_losses

CURVES = [
    Viscoelastic(0.8, 1.5),
    Plastic(0.02, 0.97),
    FallingFriction(0.118, 0.00995, 0.92),
    Table((0.1, 1.0, 10.0), (0.9, 0.8, 0.5)),
]


def viscoelastic_impact(time: float, speed: float) -> float:
    """e of delta'' = -(delta^1.5 + 1.5 A sqrt(delta) delta'), m = k = 1, until the force is zero (Runge-Kutta)."""

    def rate(x: float, v: float) -> float:
        return -(max(x, 0.0) ** 1.5 + 1.5 * time * sqrt(max(x, 0.0)) * v)

    h, x, v = 2e-4 * speed**-0.2, 0.0, speed
    while True:
        a1 = rate(x, v)
        x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
        a2 = rate(x2, v2)
        x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
        a3 = rate(x3, v3)
        x4, v4 = x + h * v3, v + h * a3
        a4 = rate(x4, v4)
        x, v = x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        if v < 0.0 and rate(x, v) >= 0.0:
            return -v / speed


@pytest.mark.parametrize("speed", [0.01, 1.0, 30.0])
def test_viscoelastic_restitution_is_that_of_its_equation_of_motion(speed: float) -> None:
    """The published fraction is within a few thousandths of its motion."""
    law = Viscoelastic(0.85, 1.0)
    assert law(1.0) == pytest.approx(0.85, abs=1e-12)
    time = law.time(1.0, 1.0)
    assert law(speed) == pytest.approx(viscoelastic_impact(time, speed), abs=4e-3)


@pytest.mark.parametrize("ratio", [1.0, 1.5, 5.0, 100.0])
def test_plastic_restitution_is_the_work_of_a_truncated_hertz_pressure(ratio: float) -> None:
    """k = R = 1: Hertz up to delta_y = 1, then dP/d(delta) as at yield; unloading by Hertz with the radius that fits.

    Thornton's equations: P = P_y + 3/2 (delta - delta_y); a Hertz contact of the radius R_p that has the final contact
    radius at the final force, R_p P = R P_H with P_H the Hertz force of that contact radius.
    """
    yield_work = 0.4  # of k delta_y^2.5
    kinetic = yield_work * ratio**2
    more = np.roots([0.75, 1.0, yield_work - kinetic])  # work beyond yield: d + 3/4 d^2
    d = float(more.real.max())
    force, hertz = 1.0 + 1.5 * d, (1.0 + d) ** 1.5
    radius = hertz / force  # R_p/R
    recovered = (force / sqrt(radius)) ** (2.0 / 3.0)  # delta of P = sqrt(R_p) delta^1.5
    e = sqrt(0.4 * force * recovered / kinetic)
    assert Plastic(0.3)(0.3 * ratio) == pytest.approx(min(e, 1.0), abs=1e-3)


def test_plastic_restitution_falls_with_the_fourth_root_of_speed() -> None:
    law = Plastic(1e-3, 0.9)
    assert law([1e-4, 1e-3]) == pytest.approx(0.9, rel=1e-14)
    assert law(160.0) / law(10.0) == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize("curve", CURVES, ids=lambda curve: curve.name)
def test_a_touch_reads_the_curve(curve: OverSpeed) -> None:
    """What compiled code goes by is the curve itself, to the straight pieces between its points."""
    is_friction = isinstance(curve, FallingFriction)
    pair = ContactPair("steel", "steel", curve if is_friction else 0.3, 1.0 if is_friction else curve, radius=0.01)
    numbers, header = pair.parameters(), np.zeros(1, CONTACT)
    own, contact = pair_of(numbers), header[0]
    assert int(own.speeds) > PAIR_SIZE
    for speed in np.geomspace(1e-4, 50.0, 41).tolist():
        reset(contact, own, 0.01)
        contact.mass, contact.closing = 0.1, speed
        set_losses(contact, numbers[int(own.speeds) :], 0.0, speed)
        if is_friction:
            assert contact.mu == contact.friction == pytest.approx(curve(speed), abs=2e-5)
            assert contact.zeta == 0.0
        else:
            assert restitution(contact.zeta) == pytest.approx(curve(speed), abs=3e-5)
            assert contact.mu == 0.3


def test_a_contact_that_is_pressed_has_the_restitution_of_that() -> None:
    """At no speed: the speed of its swing under its load, sqrt(2 a (m a/k)^(2/3))."""
    curve = Viscoelastic(0.8, 1.0)
    pair = ContactPair("steel", "steel", 0.3, curve, radius=0.01)
    numbers = pair.parameters()
    own, contact = pair_of(numbers), np.zeros(1, CONTACT)[0]
    reset(contact, own, 0.01)
    contact.mass = 0.1
    set_losses(contact, numbers[int(own.speeds) :], 9.81, 0.0)
    speed = sqrt(2.0 * 9.81 * (0.1 * 9.81 / contact.stiffness) ** (2.0 / 3.0))
    assert restitution(contact.zeta) == pytest.approx(curve(speed), abs=3e-5)


def test_plain_numbers_leave_no_table() -> None:
    pair = ContactPair("steel", "steel", 0.3, 0.9, radius=0.01)
    assert pair_of(pair.parameters()).speeds == 0.0
    assert pair.at(3.0, 2.0) is pair


class _Geom(NamedTuple):
    """As much of an mjsGeom as is written."""

    name: str


@pytest.mark.parametrize("curve", CURVES, ids=lambda curve: curve.name)
def test_texts_of_curves_and_of_models(curve: OverSpeed) -> None:
    assert read("restitution", text_of(curve)) == curve
    if INTERPRETED:
        pytest.skip("the MuJoCo plugin needs compiled callbacks")
    config = pytest.importorskip("contactlaw.mujoco_plugin.config")
    pair = ContactPair("steel", "steel", curve, rolling_resistance=0.01, law="microslip shear_loss=1")
    back = config.read(tuple(config.write(config.Contact([_Geom("a")], [_Geom("b")], pair)).items())).pair
    assert back.friction == curve and back.rolling_resistance == 0.01 and back.law == pair.law


def test_collide_takes_restitution_and_friction_at_its_own_speeds() -> None:
    e, mu = Viscoelastic(0.7, 1.0), FallingFriction(0.2, 0.02, 0.5)
    ball = Body(0.1, 0.01, velocity=(0.8, 0.0, -2.0))
    found = collide(ContactPair("steel", "steel", mu, e), ball)
    plain = collide(ContactPair("steel", "steel", mu(0.8), e(2.0)), ball)
    np.testing.assert_array_equal(found.velocity_a, plain.velocity_a)
    assert found.velocity_a[2] == pytest.approx(2.0 * e(2.0), rel=1e-12)
    assert found.psi_1 == plain.psi_1


def test_friction_at_rest_along_a_path() -> None:
    pair = ContactPair("steel", "steel", FallingFriction(0.2, 0.02, 0.5), radius=0.01)
    normal, tangential = force_along_path(pair, [1e-6, 1e-6], [0.0, 1e-3])
    assert tangential[1] == pytest.approx(0.2 * normal[1], rel=1e-12)


def test_what_does_not_belong_is_refused() -> None:
    for bad in (lambda: Viscoelastic(1.2), lambda: Plastic(0.0), lambda: Table((1.0, 0.5), (0.9, 0.8)),
                lambda: Table((0.1, 0.2), (0.9,)), lambda: FallingFriction(-0.1, 0.0, 1.0)):  # fmt: skip
        with pytest.raises(ValueError):
            bad()
    with pytest.raises(ValueError, match=r"friction = <function .* must be a number, or one of contactlaw\.losses"):
        ContactPair("steel", "steel", lambda speed: 0.3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="restitution at some speed"):
        ContactPair("steel", "steel", 0.3, Table((0.1, 1.0), (1.1, 0.8)))
    with pytest.raises(ValueError, match="friction at some speed"):
        ContactPair("steel", "steel", Table((0.1, 1.0), (-0.1, 0.8)))
    with pytest.raises(ValueError, match="restitution = 'slow 1'"):
        read("restitution", "slow 1")
    with pytest.raises(ValueError, match="did you mean"):
        read("restitution", "plastic yield_sped=1")
    with pytest.raises(ValueError, match="every field"):
        read("restitution", "viscoelastic speed=1")


def test_a_curve_without_its_method_says_which() -> None:
    with pytest.raises(NotImplementedError, match=r"OverSpeed: needs a method values\(self, speed\)"):
        OverSpeed()(1.0)


def test_a_table_goes_straight_over_the_logarithm() -> None:
    table = Table((0.1, 10.0), (0.9, 0.5))
    assert table(1.0) == pytest.approx(0.7)
    assert table([0.01, 100.0]).tolist() == [0.9, 0.5]
    assert table(exp(0.5 * log(10.0))) == pytest.approx(0.6)
