"""One contact stepped as an engine would: order, phases of touch, frames, history, nodes that follow the contact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from contactlaw import LAWS, MATERIALS, ContactPair, rebound
from contactlaw.kernels import contact
from contactlaw.kernels.frame import tangent, turn_frame
from contactlaw.kernels.rows import FRAME, ROW
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.laws.microslip import Microslip
from contactlaw.laws.record import OPEN, contact_of, pair_of

STEEL = MATERIALS["steel"]
MASS, RADIUS, MU = 0.5, 0.02, 0.1
TANGENTIAL_MASS = MASS / 3.5  # solid ball on a plane
PSI_1 = (0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0)
PHASES = (0.03, 0.25, 0.5, 0.75, 0.97)
UP = np.array([0.0, 0.0, 1.0])
OVERLAP = 1e-6  # [m]
SPRING_LAWS = ["mindlin", "mindlin_rescaled", "microslip"]


@njit
def advance(p, h, overlap, closing, du, dv, dt, mass, tangential_mass, h_out, free=0.0):
    """`contact.step` from one history to another."""
    h_out[:] = h
    before = overlap - closing * dt if h[contact.PHASE] == OPEN else h[contact.OVERLAP]
    return contact.step(p, h_out, overlap, before, closing, free, du, dv, dt, mass, tangential_mass)


@njit
def contact_force(p, h, normal, velocity, spin, overlap, dt, mass, tangential_mass, h_out, force_out, free=0.0):
    """One step of a contact by itself, from the velocity of A relative to B to the force on A, in the world frame."""
    row, turned = np.zeros(ROW), h.copy()
    turn_frame(turned, normal, spin * dt, row)
    axes = row[FRAME : FRAME + 9].copy().reshape(3, 3)
    closing, u, v = axes @ velocity
    force = advance(p, turned, overlap, closing, dt * u, dt * v, dt, mass, tangential_mass, h_out, free)
    force_out[:] = 0.0
    for i in range(3):
        force_out -= force[i] * axes[i]


@njit
def bounce(p, h, spare, normal, velocity, gap, dt, most):
    """Semi-implicit Euler on the relative motion until the contact opens; returns the velocity and counts of steps."""
    v, force, overlap, touched, steps = velocity.copy(), np.zeros(3), -gap, False, 0
    for _ in range(most):
        contact_force(p, h, normal, v, 0.0, overlap, dt, MASS, TANGENTIAL_MASS, spare, force)
        h, spare = spare, h
        if overlap > 0.0:
            touched = True
        elif touched:
            break
        steps += 1
        along = force @ normal
        v += dt * (along * normal / MASS + (force - along * normal) / TANGENTIAL_MASS)
        overlap -= dt * (v @ normal)
    return v, h, steps


def ball_pair(law: object = "microslip", e: float = 1.0, **kwargs: object) -> ContactPair:
    """Steel ball on steel."""
    return ContactPair(STEEL, STEEL, MU, e, RADIUS, law, **kwargs)  # type: ignore[arg-type]


def row_of(pair: ContactPair) -> np.ndarray:
    """An empty contact, as the kernels keep it."""
    return np.zeros(contact.HEADER + pair.memory_size)


def engine_psi_2(pair: ContactPair, psi_1: float, steps: int, phase: float) -> tuple[float, float]:
    """psi_2 and restitution of an impact at 1 m/s with so many steps a contact; phase: of the touch inside its step."""
    dt = pair.contact_duration(MASS, 1.0) / steps
    p, h = pair.parameters(), row_of(pair)
    velocity = np.array([psi_1 * MU / pair.kappa, 0.0, -1.0])
    v, _, _ = bounce(p, h, np.zeros_like(h), UP, velocity, phase * dt, dt, 100 * steps)
    return v[0] * pair.kappa / MU, v[2]


def worst_error(law: str | Microslip, e: float, steps: int, phases: tuple[float, ...] = PHASES) -> float:
    """Largest error in psi_2 over psi_1 and phases of touch."""
    pair, chi = ball_pair(law, e), ball_pair().chi(MASS, TANGENTIAL_MASS)
    fine = rebound(
        PSI_1, chi, law=Microslip(128) if law not in LAWS or law == "microslip" else law, restitution=e, steps=6000
    )
    return max(
        abs(engine_psi_2(pair, psi_1, steps, phase)[0] - exact)
        for psi_1, exact in zip(PSI_1, np.asarray(fine), strict=True)
        for phase in phases
    )


@pytest.mark.heavy
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("e", [1.0, 0.9])
def test_engine_steps_reach_the_rebound_at_any_phase_of_touch(law: str, e: float) -> None:
    """1e-2 with 50 steps a contact, 5e-3 with 100."""
    assert worst_error(law, e, 50) < 1e-2
    assert worst_error(law, e, 100) < 5e-3


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("law", "order"),
    [
        ("linear_spring", 1.8),
        ("mindlin", 1.7),
        ("mindlin_rescaled", 1.0),
        (Microslip(64), 1.7),
    ],
)
def test_elastic_impact_converges_with_the_engine_step(law: str | Microslip, order: float) -> None:
    """Second order at any phase of the touch; the rescaled spring reaches 1.1."""
    errors = [worst_error(law, 1.0, steps) for steps in (50, 100, 200, 400)]
    assert np.log2(errors[0] / errors[-1]) / 3.0 > order


@pytest.mark.heavy
@pytest.mark.parametrize(("e", "order", "bound"), [(1.0, 2.0, 1e-4), (0.9, 1.0, 1e-3), (0.5, 1.0, 5e-3)])
def test_restitution_converges_with_the_engine_step(e: float, order: float, bound: float) -> None:
    """Without damping of higher order; the damper's delta^(1/4) at the touch costs an order."""
    errors = [
        max(abs(engine_psi_2(ball_pair("microslip", e), 0.5, steps, phase)[1] - e) for phase in PHASES)
        for steps in (50, 100, 200, 400)
    ]
    assert errors[0] < bound
    assert np.log2(errors[0] / errors[-1]) / 3.0 > order


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("angle", [0.3, 2.0, 4.4])
@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-1.0, 0.0, 0.0), (0.48, -0.6, -0.64)])
def test_impact_is_the_same_in_every_direction(law: str, angle: float, normal: tuple[float, float, float]) -> None:
    pair, n = ball_pair(law, 0.9), np.array(normal)
    along, _, _ = np.linalg.svd(n[:, None])
    t, b = along[:, 1], along[:, 2]
    direction = np.cos(angle) * t + np.sin(angle) * b
    dt, speed = pair.contact_duration(MASS, 1.0) / 50, 1.3 * MU / pair.kappa
    h = row_of(pair)
    v, _, _ = bounce(pair.parameters(), h, np.zeros_like(h), n, speed * direction - n, 0.4 * dt, dt, 5000)
    expected, _ = engine_psi_2(pair, 1.3, 50, 0.4)
    np.testing.assert_allclose(v - (v @ n) * n, expected * MU / pair.kappa * direction, atol=1e-11)


def pressed(pair: ContactPair, overlap: float = OVERLAP, dt: float = 1e-7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parameters, history of a contact resting at this overlap without traction, and a spare."""
    p, h = pair.parameters(), row_of(pair)
    out = np.full_like(h, np.nan)
    advance(p, h, overlap, 0.0, 0.0, 0.0, dt, MASS, TANGENTIAL_MASS, out)
    return p, out, np.full_like(h, np.nan)


def sheared(pair: ContactPair, share: float, steps: int = 100) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and history of a resting contact displaced by this share of the slip length."""
    p, h, out = pressed(pair)
    slip = MU / pair.kappa * OVERLAP
    for _ in range(steps):
        advance(p, h, OVERLAP, 0.0, share * slip / steps, 0.0, 1e-7, MASS, TANGENTIAL_MASS, out)
        h, out = out, h
    return p, h


@pytest.mark.parametrize("law", LAWS)
def test_history_is_read_and_a_new_one_written(law: str) -> None:
    """The input stays as it was, the output is filled throughout, and looking twice gives the same."""
    pair = ball_pair(law, 0.8)
    p, h = sheared(pair, 0.4)
    before, force = h.copy(), np.zeros(3)
    first, second = np.full_like(h, np.nan), np.full_like(h, 7.0)
    for overlap in (1.1 * OVERLAP, 100.0 * OVERLAP, 0.5 * OVERLAP, 1e-3 * OVERLAP, -OVERLAP):
        for out in (first, second):
            contact_force(p, h, UP, np.array([0.1, 0.0, -0.1]), 0.2, overlap, 1e-7, MASS, TANGENTIAL_MASS, out, force)
        np.testing.assert_array_equal(h, before)
        np.testing.assert_array_equal(first, second)
        assert np.isfinite(first).all()


@pytest.mark.parametrize("law", LAWS)
def test_history_is_cleared_when_apart(law: str) -> None:
    pair = ball_pair(law)
    p, h = sheared(pair, 0.4)
    out, force = np.full_like(h, np.nan), np.full(3, np.nan)
    for overlap in (0.0, -1e-9):
        contact_force(p, h, UP, np.array([0.1, 0.0, 0.1]), 0.0, overlap, 1e-7, MASS, TANGENTIAL_MASS, out, force)
        assert not out[: contact.TANGENT].any() and not out[contact.HEADER :].any()
        assert not force.any()


@pytest.mark.parametrize("law", LAWS)
@given(
    path=st.lists(
        st.tuples(
            st.one_of(st.floats(-0.3, 0.0), st.floats(1e-15, 1.0)),
            st.floats(-2.0, 2.0),
            st.floats(-2.0, 2.0),
            st.floats(-0.5, 0.5),
        ),
        min_size=1,
        max_size=12,
    ),
    e=st.sampled_from([1.0, 0.7, 0.1]),
)
@settings(max_examples=25)
def test_force_stays_in_the_cone_and_never_pulls(law: str, path: list, e: float) -> None:
    """Any overlaps, velocities and spins, consistent or not: |F| <= mu P and P >= 0."""
    pair = ball_pair(law, e)
    p, h = pair.parameters(), row_of(pair)
    out, force = np.zeros_like(h), np.zeros(3)
    for overlap, u, v, w in path:
        velocity = np.array([u, v, w])
        contact_force(p, h, UP, velocity, 30.0 * u, OVERLAP * overlap, 1e-6, MASS, TANGENTIAL_MASS, out, force)
        h, out = out, h
        assert np.isfinite(force).all()
        assert force[2] >= 0.0
        assert np.hypot(force[0], force[1]) <= MU * force[2] * (1 + 1e-12)


@pytest.mark.xfail(
    strict=True, reason="force/elastic overflows to inf, then inf * 0: below 1e-200 m, no engine goes there"
)
@pytest.mark.parametrize("law", SPRING_LAWS)
def test_vanishing_overlap_gives_no_nan(law: str) -> None:
    p, h, force = ball_pair(law, 0.7).parameters(), row_of(ball_pair(law)), np.zeros(3)
    velocity = np.array([0.0, 0.0, -0.5])
    contact_force(p, h, UP, velocity, 0.0, 1e-230, 1e-6, MASS, TANGENTIAL_MASS, np.zeros_like(h), force)
    assert np.isfinite(force).all()


def elastic_energy(pair: ContactPair, h: np.ndarray) -> float:
    """2 integral q^2/(2 G*) dx over half the line of microslip [J]."""
    q = h[contact.HEADER :].reshape(2, -1)
    return contact_of(h).scale * float((pair.rule.numbers()["w"] * q**2).sum()) / pair.effective_shear_modulus


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6, 0.9])
def test_deeper_push_keeps_locked_in_traction(share: float) -> None:
    """Slowly to a hundred times the overlap, the span widened ten times: force within 3 %, energy never raised."""
    pair = ball_pair()
    p, h = sheared(pair, share)
    out, force, energy, spans = np.empty_like(h), h[contact.TANGENTIAL], elastic_energy(pair, h), {contact_of(h).scale}
    start = force
    for overlap in OVERLAP * np.linspace(1.0, 100.0, 1500)[1:]:
        _, force, _ = advance(
            p, h, overlap, (overlap - h[contact.OVERLAP]) / 1e-7, 0.0, 0.0, 1e-7, MASS, TANGENTIAL_MASS, out
        )
        h, out = out, h
        spans.add(contact_of(h).scale)
        assert force == pytest.approx(start, rel=0.03)
        assert elastic_energy(pair, h) <= energy * (1 + 1e-9)
    assert len(spans) > 5
    assert contact_of(h).scale >= np.sqrt(RADIUS * 100.0 * OVERLAP)


def test_deeper_push_in_one_step_keeps_locked_in_traction() -> None:
    pair = ball_pair()
    p, h = sheared(pair, 0.5)
    out = np.empty_like(h)
    _, force, _ = advance(p, h, 20 * OVERLAP, 190.0, 0.0, 0.0, 1e-7, MASS, TANGENTIAL_MASS, out)
    assert force == pytest.approx(h[contact.TANGENTIAL], rel=0.05)
    assert elastic_energy(pair, out) <= elastic_energy(pair, h) * (1 + 1e-9)


def test_deeper_push_keeps_balanced_traction() -> None:
    """Sheared and brought back to no net force, the contact holds tractions of both signs; all are dropped."""
    pair = ball_pair()
    p, h = sheared(pair, 0.8)
    out, force = np.empty_like(h), h[contact.TANGENTIAL]
    while force > 0.0:
        _, force, _ = advance(
            p, h, OVERLAP, 0.0, -2e-3 * MU / pair.kappa * OVERLAP, 0.0, 1e-7, MASS, TANGENTIAL_MASS, out
        )
        h, out = out, h
    before = elastic_energy(pair, h)
    advance(p, h, 1.7 * OVERLAP, 0.0, 0.0, 0.0, 1e-7, MASS, TANGENTIAL_MASS, out)
    assert contact_of(out).scale != contact_of(h).scale
    assert 0.5 * before < elastic_energy(pair, out) <= before


@njit
def settle(p, h, spare, dt, weight, steps):
    """Drop at 0.3 m/s under a steady weight [m/s^2]; returns overlap, normal speed, force and history at the end."""
    v, force, overlap = np.array([0.0, 0.0, -0.3]), np.zeros(3), 0.0
    for _ in range(steps):
        contact_force(p, h, np.array([0.0, 0.0, 1.0]), v, 0.0, overlap, dt, MASS, TANGENTIAL_MASS, spare, force, weight)
        h, spare = spare, h
        v[2] += dt * (force[2] / MASS - weight)
        overlap -= dt * v[2]
    return overlap, v[2], force[2], h


@pytest.mark.heavy
def test_settled_contact_spans_what_is_left_of_it() -> None:
    """Nodes follow from the bounce down to rest: a third or more of them in contact, stiffness 2 G* a within 15 %.

    Sixteen nodes err by -11 to +15 % for spans of 1 to 3 contact radii, as nodes enter at the edge.
    """
    pair = ball_pair(e=0.5)
    p, h, dt = pair.parameters(), row_of(pair), pair.contact_duration(MASS, 0.3) / 50
    overlap, speed, force, h = settle(p, h, np.zeros_like(h), dt, 9.81, 500_000)
    assert abs(speed) < 1e-9
    assert force == pytest.approx(MASS * 9.81, rel=1e-6)
    a = np.sqrt(RADIUS * overlap)
    assert 1.0 <= contact_of(h).scale / a < 3.0
    out, du = np.empty_like(h), 1e-3 * MU / pair.kappa * overlap
    before = h[contact.TANGENTIAL]
    _, after, _ = advance(p, h, overlap, 0.0, du, 0.0, dt, MASS, TANGENTIAL_MASS, out)
    assert (after - before) / du == pytest.approx(2 * pair.effective_shear_modulus * a * h[contact.RATIO], rel=0.15)


@pytest.mark.heavy
def test_settled_contact_rests_at_its_static_overlap() -> None:
    """P = k delta^1.5 at rest, whatever the damping: here e = 0.2 with 20 steps a contact: 5 % too deep."""
    pair = ball_pair(e=0.2)
    p, h, dt = pair.parameters(), row_of(pair), pair.contact_duration(MASS, 0.3) / 20
    overlap, speed, _, _ = settle(p, h, np.zeros_like(h), dt, 981.0, 100_000)
    assert abs(speed) < 1e-9
    assert overlap == pytest.approx((MASS * 981.0 / hertz_stiffness(pair_of(p))) ** (2 / 3), rel=1e-3)


def rotation(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """Rodrigues."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def drift_of_force(law: str, axis: tuple[float, float, float], angle: float, steps: int) -> float:
    """Relative change of a locked-in tangential force, seen by the scene that turns with the contact."""
    pair, force = ball_pair(law), np.zeros(3)
    p, h = sheared(pair, 0.3)
    h[contact.TANGENT : contact.TANGENT + 3] = (1.0, 0.0, 0.0)
    start, out, dt = np.array([-h[contact.TANGENTIAL], 0.0, h[contact.NORMAL]]), np.empty_like(h), 1e-6
    unit = np.array(axis) / np.linalg.norm(axis)
    for k in range(1, steps + 1):
        turn = rotation(axis, angle * k / steps)
        n = turn @ UP
        contact_force(
            p, h, n, np.zeros(3), unit @ n * angle / steps / dt, OVERLAP, dt, MASS, TANGENTIAL_MASS, out, force
        )
        h, out = out, h
    return float(np.linalg.norm(turn.T @ force - start) / h[contact.TANGENTIAL])


@pytest.mark.parametrize("law", SPRING_LAWS)
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
def test_locked_in_force_turns_with_the_contact(law: str, axis: tuple[float, float, float]) -> None:
    """Spinning about the normal, or rolling along or across the force: exact at any step."""
    assert drift_of_force(law, axis, 2.0, 7) < 1e-9


@pytest.mark.parametrize("axis", [(0.6, 0.8, 0.0), (1.0, 1.0, 1.0), (0.2, -0.5, 0.4)])
def test_locked_in_force_turns_with_a_scene_that_rotates_about_any_axis(axis: tuple[float, float, float]) -> None:
    """Error of first order in the angle per step: one radian in 100, 200, 400 steps."""
    errors = [drift_of_force("mindlin", axis, 1.0, steps) for steps in (100, 200, 400)]
    assert errors[0] < 3e-3
    assert np.log2(errors[0] / errors[2]) / 2.0 > 0.95


def test_frame_follows_the_normal_without_twist() -> None:
    """A full turn about a tilted axis brings the force back to where it was, to second order in the step."""
    coarse, fine = (drift_of_force("mindlin", (0.6, 0.8, 0.0), 2.0 * np.pi, steps) for steps in (50, 200))
    assert coarse < 5e-3
    assert fine < coarse / 12.0


@given(st.floats(0.0, 2 * np.pi), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0), st.booleans())
def test_tangent_is_a_unit_vector_across_the_normal(angle: float, height: float, twist: float, fresh: bool) -> None:
    h = row_of(ball_pair())
    flat = np.sqrt(1.0 - height**2)
    n = np.array([flat * np.cos(angle), flat * np.sin(angle), height])
    if not fresh:
        h[contact.TANGENT] = 1.0
    t = np.array(tangent(h, n, twist))
    assert np.linalg.norm(t) == pytest.approx(1.0, rel=1e-12)
    assert t @ n == pytest.approx(0.0, abs=1e-9)


@pytest.mark.heavy
def test_damped_contact_in_a_driven_cycle_gives_no_energy() -> None:
    """Overlap and displacement swing together about a held shear: were F = F_el P/P_el, as while bodies bounce, more
    work would come out (tangential) than goes in (normal damper)."""
    pair, friction = ContactPair(STEEL, STEEL, 0.3, 0.2, RADIUS), 0.3
    p, h, out = pressed(pair)
    omega = 3.0 * np.sqrt(1.5 * hertz_stiffness(pair_of(p)) * np.sqrt(OVERLAP) / MASS)
    n, slip = 400, friction / pair.kappa * OVERLAP
    dt = 2.0 * np.pi / omega / n
    t = np.arange(3 * n + 1) * dt
    overlap, place = OVERLAP * (1.0 + 0.001 * np.sin(omega * t)), slip * (0.3 - 0.1 * np.sin(omega * t))
    advance(p, h, overlap[0], 0.0, place[0], 0.0, dt, MASS, TANGENTIAL_MASS, out)
    h, out = out, h
    forces = [(h[contact.NORMAL], h[contact.TANGENTIAL])]
    for i in range(1, t.size):
        closing, du = (overlap[i] - overlap[i - 1]) / dt, place[i] - place[i - 1]
        normal, f, _ = advance(p, h, overlap[i], closing, du, 0.0, dt, MASS, TANGENTIAL_MASS, out)
        h, out = out, h
        forces.append((normal, f))
    normal, f = np.array(forces).T
    work = 0.5 * (normal[1:] + normal[:-1]) * np.diff(overlap) + 0.5 * (f[1:] + f[:-1]) * np.diff(place)
    assert work[2 * n :].sum() > -1e-4 * 0.25 * friction * normal.max() * slip
