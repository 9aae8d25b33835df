"""One contact stepped by itself: order, phases of touch, the friction cone, nodes that follow the contact, energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contactlaw import LAWS, ContactPair, rebound
from contactlaw.jit import jit
from contactlaw.laws.hertz import BY_ITSELF, hertz_stiffness
from contactlaw.laws.microslip import Microslip
from contactlaw.laws.record import (
    LASTING,
    OPEN,
    PAIR_SIZE,
    SLIDING,
    SPRUNG,
    UNSHEARED,
    ask_stiffness,
    pair_of,
)
from contactlaw.laws.step import ask, press, reset

MASS, RADIUS, MU = 0.5, 0.02, 0.1
TANGENTIAL_MASS = MASS / 3.5  # solid ball on a plane
PSI_1 = (0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0)
PHASES = (0.03, 0.25, 0.5, 0.75, 0.97)
OVERLAP = 1e-6  # [m]


@jit
def take(p, header, memory, overlap, before, free, du, dv, dt):
    """One step of a contact, in place: normal force and both tangential ones; apart it forgets."""
    contact, pair = header[0], pair_of(p)
    if overlap <= 0.0:
        contact.state, memory[:] = OPEN, 0.0
        return 0.0, 0.0, 0.0
    if contact.state == OPEN:
        reset(contact, pair, pair.radius)
        contact.mass, contact.tangential_mass = MASS, TANGENTIAL_MASS
    contact.overlap, contact.before, contact.closing = overlap, before, (overlap - before) / dt if dt > 0.0 else 0.0
    press(contact, pair, dt, (free, *BY_ITSELF[1:]))
    ask(contact, pair, p[PAIR_SIZE:], memory, du, dv, dt)
    return contact.force, contact.f, contact.g


@jit
def bounce(p, header, memory, velocity, gap, dt, most, weight):
    """Semi-implicit Euler on the relative motion (along x, up), for so many steps or, without weight, until it opens.

    Returns velocity, overlap, normal force.
    """
    u, w = velocity
    overlap, force, touched = -gap, 0.0, False
    for _ in range(most):
        before, overlap = overlap, overlap - dt * w
        force, f, _ = take(p, header, memory, overlap, before, weight, dt * u, 0.0, dt)
        touched |= overlap > 0.0
        if touched and overlap <= 0.0 and weight == 0.0:
            break
        u -= dt * f / TANGENTIAL_MASS
        w += dt * (force / MASS - weight)
    return u, w, overlap, force


class Contact:
    """A steel ball's contact by a law."""

    def __init__(self, law: Any = "microslip", e: float = 1.0, friction: float = MU) -> None:
        self.pair = ContactPair("steel", "steel", friction, e, RADIUS, law)
        self.p = self.pair.parameters()
        self.header, self.memory = self.pair.law.with_nodes(None).new_contact()
        self.slip = friction / self.pair.kappa * OVERLAP  # the displacement at which all slips

    @property
    def now(self) -> Any:
        """Its record."""
        return self.header[0]

    def take(self, overlap: float, before: float, du: float = 0.0, dv: float = 0.0, dt: float = 1e-7) -> Any:
        """One step."""
        return take(self.p, self.header, self.memory, overlap, before, 0.0, du, dv, dt)

    def sheared(self, share: float, steps: int = 100) -> Contact:
        """Pressed, then displaced by this share of the slip length."""
        self.take(OVERLAP, OVERLAP)
        for _ in range(steps):
            self.take(OVERLAP, OVERLAP, share * self.slip / steps)
        return self

    def energy(self) -> float:
        """2 integral q^2/(2 G*) dx over half the line of microslip [J]."""
        q, w = self.memory.reshape(2, -1), self.pair.law.numbers()["w"]
        return float(header_scale(self) * (w * q**2).sum()) / self.pair.effective_shear_modulus


def header_scale(contact: Contact) -> float:
    """Half the line that the nodes span [m]."""
    return float(read_scale(contact.header))


@jit
def read_scale(header):
    """The law's own number of a contact."""
    return header[0].scale


def engine_psi_2(law: Any, e: float, psi_1: float, steps: int, phase: float) -> tuple[float, float]:
    """psi_2 and restitution of an impact at 1 m/s with so many steps a contact; phase: of the touch inside its step."""
    one = Contact(law, e)
    dt, scale = one.pair.contact_duration(MASS, 1.0) / steps, one.pair.kappa / MU
    u, w, _, _ = bounce(one.p, one.header, one.memory, (psi_1 / scale, -1.0), phase * dt, dt, 100 * steps, 0.0)
    return u * scale, w


def worst_error(law: Any, e: float, steps: int, phases: tuple[float, ...] = PHASES) -> float:
    """Largest error in psi_2 over psi_1 and phases of touch."""
    chi = Contact().pair.chi(MASS, TANGENTIAL_MASS)
    fine = Microslip(128) if law not in LAWS or law == "microslip" else law
    exact = np.asarray(rebound(PSI_1, chi, law=fine, restitution=e, steps=6000))
    return max(abs(engine_psi_2(law, e, psi, steps, phase)[0] - one)
               for psi, one in zip(PSI_1, exact, strict=True) for phase in phases)  # fmt: skip


@pytest.mark.heavy
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("e", [1.0, 0.9])
def test_steps_reach_the_rebound_at_any_phase_of_touch(law: str, e: float) -> None:
    """1e-2 with 50 steps a contact, 5e-3 with 100."""
    assert worst_error(law, e, 50) < 1e-2
    assert worst_error(law, e, 100) < 5e-3


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("law", "order"), [("linear_spring", 1.8), ("mindlin", 1.7), ("mindlin_rescaled", 1.0), (Microslip(64), 1.7)]
)
def test_elastic_impact_converges_with_the_step(law: str | Microslip, order: float) -> None:
    """Second order at any phase of the touch; the rescaled spring reaches 1.1."""
    errors = [worst_error(law, 1.0, steps) for steps in (50, 100, 200, 400)]
    assert np.log2(errors[0] / errors[-1]) / 3.0 > order


@pytest.mark.heavy
@pytest.mark.parametrize(("e", "order", "bound"), [(1.0, 2.0, 1e-4), (0.9, 1.0, 1e-3), (0.5, 1.0, 5e-3)])
def test_restitution_converges_with_the_step(e: float, order: float, bound: float) -> None:
    """Without damping of higher order; the damper's delta^(1/4) at the touch costs an order."""
    errors = [
        max(abs(engine_psi_2("microslip", e, 0.5, steps, phase)[1] - e) for phase in PHASES)
        for steps in (50, 100, 200, 400)
    ]
    assert errors[0] < bound
    assert np.log2(errors[0] / errors[-1]) / 3.0 > order


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("angle", [0.3, 2.0, 4.4])
def test_force_is_the_same_in_every_direction(law: str, angle: float) -> None:
    one, two = Contact(law, 0.9), Contact(law, 0.9)
    before = -OVERLAP
    for depth, slide in ((1.0, 0.5), (2.0, 0.4), (2.5, -0.7), (2.0, 1.5), (0.5, -0.3)):
        du = slide * one.slip
        normal, f, _ = one.take(depth * OVERLAP, before, du)
        other, *both = two.take(depth * OVERLAP, before, du * np.cos(angle), du * np.sin(angle))
        before = depth * OVERLAP
        assert other == normal
        np.testing.assert_allclose(both, [f * np.cos(angle), f * np.sin(angle)], atol=1e-11 * MU * normal)


@pytest.mark.parametrize("law", LAWS)
@given(
    path=st.lists(
        st.tuples(st.one_of(st.floats(-0.3, 0.0), st.floats(1e-15, 1.0)), *[st.floats(-2.0, 2.0)] * 2),
        min_size=1, max_size=12,
    ),
    e=st.sampled_from([1.0, 0.7, 0.1]),
)  # fmt: skip
@settings(max_examples=25)
def test_force_stays_in_the_cone_and_never_pulls(law: str, path: list, e: float) -> None:
    """Any overlaps and displacements, consistent or not: |F| <= mu P and P >= 0."""
    one, before = Contact(law, e), -OVERLAP
    for depth, u, v in path:
        normal, f, g = one.take(depth * OVERLAP, before, 1e-6 * u, 1e-6 * v, 1e-6)
        before = depth * OVERLAP
        assert np.isfinite([normal, f, g]).all()
        assert normal >= 0.0
        assert np.hypot(f, g) <= MU * normal * (1 + 1e-12)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6, 0.9])
def test_deeper_push_keeps_locked_in_traction(share: float) -> None:
    """Slowly to a hundred times the overlap, the span widened ten times: force within 3 %, energy never raised."""
    one = Contact().sheared(share)
    start, energy, before, spans = one.take(OVERLAP, OVERLAP)[1], one.energy(), OVERLAP, {header_scale(one)}
    for overlap in OVERLAP * np.linspace(1.0, 100.0, 1500)[1:]:
        _, force, _ = one.take(overlap, before)
        before = overlap
        spans.add(header_scale(one))
        assert force == pytest.approx(start, rel=0.03)
        assert one.energy() <= energy * (1 + 1e-9)
    assert len(spans) > 5
    assert header_scale(one) >= np.sqrt(RADIUS * 100.0 * OVERLAP)


def test_deeper_push_in_one_step_keeps_locked_in_traction() -> None:
    one = Contact().sheared(0.5)
    start, energy = one.take(OVERLAP, OVERLAP)[1], one.energy()
    assert one.take(20 * OVERLAP, OVERLAP)[1] == pytest.approx(start, rel=0.05)
    assert one.energy() <= energy * (1 + 1e-9)


def test_deeper_push_keeps_balanced_traction() -> None:
    """Sheared and brought back to no net force, the contact holds tractions of both signs; all are dropped."""
    one, force = Contact().sheared(0.8), 1.0
    while force > 0.0:
        _, force, _ = one.take(OVERLAP, OVERLAP, -2e-3 * one.slip)
    before, span = one.energy(), header_scale(one)
    one.take(1.7 * OVERLAP, OVERLAP)
    assert header_scale(one) != span
    assert 0.5 * before < one.energy() <= before * (1 + 1e-9)


@jit
def stuck(p, header):
    """Stiffness of the contact where it sticks everywhere [N/m]."""
    return ask_stiffness(pair_of(p), header[0], p[PAIR_SIZE:])


@pytest.mark.heavy
@pytest.mark.parametrize(("e", "steps", "weight"), [(0.5, 50, 9.81), (0.2, 20, 981.0)])
def test_settled_contact_rests_at_its_static_overlap_and_spans_what_is_left_of_it(e, steps, weight) -> None:
    """P = k delta^1.5 at rest, whatever the damping; nodes follow from the bounce down to rest, a third in contact."""
    one = Contact(e=e)
    dt = one.pair.contact_duration(MASS, 0.3) / steps
    _, speed, overlap, force = bounce(one.p, one.header, one.memory, (0.0, -0.3), 0.0, dt, 500_000, weight)
    assert abs(speed) < 1e-9
    assert force == pytest.approx(MASS * weight, rel=1e-6)
    assert overlap == pytest.approx((MASS * weight / hertz_stiffness(pair_of(one.p))) ** (2 / 3), rel=1e-3)
    a = np.sqrt(RADIUS * overlap)
    assert 1.0 <= header_scale(one) / a < 3.0
    du = 1e-3 * MU / one.pair.kappa * overlap
    before = one.take(overlap, overlap)[1]
    after = one.take(overlap, overlap, du)[1]
    assert (after - before) / du == pytest.approx(2 * one.pair.effective_shear_modulus * a, rel=0.15)


@pytest.mark.heavy
def test_damped_contact_in_a_driven_cycle_gives_no_energy() -> None:
    """Overlap and displacement swing together about a held shear: were F = F_el P/P_el, as while bodies bounce, more
    work would come out (tangential) than goes in (normal damper)."""
    one = Contact(e=0.2, friction=0.3)
    one.take(OVERLAP, OVERLAP)
    omega = 3.0 * np.sqrt(1.5 * hertz_stiffness(pair_of(one.p)) * np.sqrt(OVERLAP) / MASS)
    n = 400
    dt = 2.0 * np.pi / omega / n
    t = np.arange(3 * n + 1) * dt
    overlap = OVERLAP * (1.0 + 0.001 * np.sin(omega * t))
    place = one.slip * (0.3 - 0.1 * np.sin(omega * t))
    forces = [one.take(overlap[0], overlap[0], place[0], 0.0, dt)[:2]]
    forces += [one.take(overlap[i], overlap[i - 1], place[i] - place[i - 1], 0.0, dt)[:2] for i in range(1, t.size)]
    normal, f = np.array(forces).T
    work = 0.5 * (normal[1:] + normal[:-1]) * np.diff(overlap) + 0.5 * (f[1:] + f[:-1]) * np.diff(place)
    assert work[2 * n :].sum() > -1e-4 * 0.25 * 0.3 * normal.max() * one.slip


@pytest.mark.parametrize("law", ["microslip", "microslip shear_loss=1"])
@pytest.mark.parametrize("pressed", [1, 7, 40])
def test_nodes_rest_until_a_contact_is_sheared(law: str, pressed: int) -> None:
    """To the last bit as if they had run from the touch on, while it outgrows them and after."""
    idle, running, before = Contact(law, 0.9), Contact(law, 0.9), -1e-9
    for k in range(60):
        overlap = OVERLAP * (1.0 + 3.0 * np.sin(0.05 * k))
        moved = (1e-9 * np.sin(k), 5e-10, 1e-7) if k >= pressed else (0.0, 0.0, 1e-7)
        forces = idle.take(overlap, before, *moved)
        assert forces == running.take(overlap, before, *moved)
        assert np.array_equal(idle.memory, running.memory) and idle.now.scale == running.now.scale
        assert (idle.now.state == UNSHEARED and forces[1:] == (0.0, 0.0)) if k < pressed else idle.now.state == SPRUNG
        running.now.state = SPRUNG
        before = overlap
    assert np.any(idle.memory)


def test_a_persistent_contact_that_slides_as_a_whole_is_as_its_nodes_say() -> None:
    """Implicit steps follow it without them until it sticks, also if friction falls and grows while it slides."""
    lasting, nodes = Contact(), Contact()
    path = [(0.3, 1.0)] * 12 + [(0.3, 0.5)] * 4 + [(0.1, 0.8)] * 2 + [(0.6, 0.7), (0.3, 0.6)] + [(-0.1, 1.0)] * 30
    states = []
    for number, (share, friction) in enumerate(path):
        slide, found = share * lasting.slip, []
        for contact in (lasting, nodes):
            contact.now.friction = friction * MU if number else MU
            before, dt = (OVERLAP, 0.0) if number else (0.0, 1e-7)
            found.append(contact.take(OVERLAP, before, 0.6 * slide, 0.8 * slide, dt))
        np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-12 * found[0][0])
        lasting.now.course = LASTING
        states.append(lasting.now.state)
        if states[-1] == SPRUNG:
            assert lasting.energy() == pytest.approx(nodes.energy(), rel=1e-12)
    assert states[8:16] == [SLIDING] * 8 and states[20:34] == [SPRUNG] * 14 and states[-1] == SLIDING
    assert nodes.now.state == SPRUNG


def test_a_slide_that_turns_slowly_is_as_its_nodes_say() -> None:
    """All have one direction then, are not displaced one by one, and dissipate energy in every step."""
    one, nodes = Contact(), Contact()
    states, before, last, stored = [], OVERLAP, (0.0, 0.0), 0.0
    for number in range(600):
        overlap = OVERLAP * (1.0 + 0.3 * np.sin(0.05 * number))
        way = one.slip * np.array([np.cos(0.003 * number), np.sin(0.003 * number)]) * (0.3 if number < 400 else -0.05)
        found = one.take(overlap, before, *way)
        exact = nodes.take(overlap, before, way[0], way[1], 1e-7 if number == 0 else 0.0)
        np.testing.assert_allclose(found, exact, rtol=0.0, atol=2e-3 * MU * found[0])
        states.append(one.now.state)
        energy = 0.3 * (MU * found[0]) ** 2 / (one.now.g_star * np.sqrt(RADIUS * overlap))
        if states[-1] == SLIDING:
            assert 0.5 * np.dot(np.add(found[1:], last), way) > energy - stored
        before, last, stored = overlap, found[1:], energy
    assert states[20:400] == [SLIDING] * 380 and states[-1] == SPRUNG == nodes.now.state
