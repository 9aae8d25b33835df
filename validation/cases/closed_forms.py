"""The laws and the annulus solver against the exact closed forms of impact theory."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from contactlaw import LAWS, MATERIALS, RIGID, Body, ContactPair, Material, collide
from contactlaw import force_along_path as law_along_path
from contactlaw import rebound as law_rebound
from validation.case import Array, Case, Limit, Outcome
from validation.prediction import quiet_pair

EXACT = 1e-6
DEFAULTS = 1e-3  # what `rebound` promises at default settings, chi from 0.5 to 2
REFERENCE = 5e-4  # what is asked of the annulus solver
FINE = 16384  # steps: the error falls with their square, from some 1e-3 at 128
CHIS = [0.3, 0.75, 1.0, 1.256, 1.441, 2.0]
RESTITUTIONS = [1.0, 0.86, 0.5]
Add = Callable[..., None]
SMALL = 1e-8  # psi_1 at which only the last 1e-8 of the time slips


class ClosedForms(Case):
    """Wherever impact theory has a closed form, the package and the annulus solver reproduce it: sliding throughout,
    loading without slip, the Hertz impact, the contact point that bounces like the ball (2 chi = 1), and the whole
    rebound for linear springs.
    """

    place = 12
    title = "Closed forms"

    def run(self, quick: bool) -> Outcome:
        found: dict[str, Limit] = {}

        def add(name: str, error: Any, asked: float = EXACT) -> None:
            """Add errors; the limit of this name applies to the largest."""
            before = found[name].reached if name in found else 0.0
            found[name] = Limit(name, asked, max(before, float(np.abs(error).max())))

        _sliding(add)
        _linear_springs(add, 4096 if quick else FINE)
        for judge in (_like_the_ball, _hertz, _paths):
            judge(add)
        return Outcome([*found.values()], {})


def _sliding(add: Add) -> None:
    """psi_1 - 2 chi (1 + e) for all psi_1 that slide throughout."""
    from validation.reference import annulus
    from validation.reference.closed_forms import regimes, rigid

    rolls = np.linspace(-9.0, 9.0, 37)
    for chi, e in product([*CHIS, 4.5], RESTITUTIONS):
        psi_1 = regimes.slides_throughout_from(chi, e) + np.array([0.0, 1e-6, 0.5, 20.0])
        exact = rigid.gross_slip(psi_1, chi, e)
        later = regimes.rescaled_spring_slides_throughout_from(chi, e) - psi_1[0]
        for name in (name for name in LAWS if name != "coulomb"):
            from_here = later if name == "mindlin_rescaled" else 0.0
            add("sliding throughout, all elastic laws, error in psi_2",
                law_rebound(psi_1 + from_here, chi, name, e) - (exact + from_here))  # fmt: skip
        add("sliding throughout, annulus solver, error in psi_2",
            annulus.rebound(psi_1[1:], chi, 8, restitution=e) - exact[1:])  # fmt: skip
        add("rigid theory, coulomb, error in psi_2",
            law_rebound(rolls, chi, "coulomb", e) - rigid.rebound(rolls, chi, e))  # fmt: skip


def _linear_springs(add: Add, steps: int) -> None:
    """`linear_spring` against the exact rebound of the linearised problem, and against full stick."""
    from validation.reference.closed_forms import oscillator

    psi_1 = np.linspace(-6.0, 6.0, 49)
    for chi in CHIS:
        exact = oscillator.rebound(psi_1, chi)
        add("linear springs, default steps, error in psi_2", law_rebound(psi_1, chi, "linear_spring") - exact, DEFAULTS)
        add(f"linear springs, {steps} steps, error in psi_2",
            law_rebound(psi_1, chi, "linear_spring", steps=steps) - exact)  # fmt: skip
    add(f"full stick, psi_1 = {SMALL:g}, extrapolated from {steps} steps, error in psi_2/psi_1",
        2.0 * _full_stick(2 * steps) - _full_stick(steps))  # fmt: skip


def _full_stick(steps: int) -> Array:
    """Error in psi_2/psi_1 of `linear_spring` at an incidence near zero, against cos(pi sqrt(2 chi)), for each chi.

    First order in the step, unlike everything else here: a spring still loaded at the release receives in the last
    step an impulse that the law takes in proportion to the normal one, which falls to zero. The Coulomb limit confines
    this to psi_1 below the load of one step, where psi_2 is off by a small part of a small psi_1.
    """
    from validation.reference.closed_forms import oscillator

    exact = np.array([oscillator.full_stick_rebound(1.0, chi) for chi in CHIS])
    return law_rebound(SMALL, CHIS, "linear_spring", steps=steps) / SMALL - exact


def _like_the_ball(add: Add) -> None:
    """2 chi = 1 and psi_1 <= 1: the tangential motion repeats the normal one, nothing slips, psi_2 = -e psi_1."""
    from validation.reference import annulus

    psi_1 = np.array([0.1, 0.5, 0.9])
    for e in RESTITUTIONS:
        for words, steps, asked in (("default", None, DEFAULTS), (str(FINE), FINE, EXACT)):
            add(f"2 chi = 1, microslip, {words} steps, error in psi_2",
                law_rebound(psi_1, 0.5, "microslip", e, steps=steps) + e * psi_1, asked)  # fmt: skip
        add("2 chi = 1, annulus solver of 20, error in psi_2",
            annulus.rebound(psi_1, 0.5, 20, restitution=e) + e * psi_1, REFERENCE)  # fmt: skip


def _hertz(add: Add) -> None:
    """Duration, overlap and force of normal impacts, as the pair states them and as `collide` reaches them."""
    from validation.reference.closed_forms import hertz
    from validation.reference.normal_motion import impact_motion

    steel, rubber, glass = (MATERIALS[name] for name in ("steel", "rubber", "glass"))
    spins = []
    for a, b, radius, speed in ((steel, steel, 0.025, 0.8), (rubber, rubber, 0.05, 0.3), (glass, RIGID, 1.5e-3, 4.0)):
        body = Body(4.19 * radius**3 * (a.density or 0.0), radius, velocity=(0.3 * speed, 0.0, -speed))
        pair, linear = (quiet_pair(a, b, 0.2, radius=radius, law=law) for law in ("microslip", "linear_spring"))
        exact = hertz.impact(body.mass, radius, pair.effective_modulus, speed)
        figures = np.array(exact[:3])  # duration, overlap, force
        own = [of(body.mass, speed) for of in (pair.contact_duration, pair.greatest_overlap, pair.greatest_force)]
        impact = collide(pair, body)
        run = [impact.time[-1], impact.overlap.max(), impact.normal_force.max(), collide(linear, body).time[-1]]
        add("Hertz impact, figures of ContactPair, relative error", own / figures - 1.0)
        add("Hertz impact, reached by collide(), relative error", run / np.append(figures, exact.duration) - 1.0)
        gained = (impact.velocity_a - np.asarray(body.velocity))[0]
        spins.append((radius * impact.spin_a[1] + 2.5 * gained) / gained)
    for e in RESTITUTIONS:
        unit, motion = quiet_pair(Material(1.0, 0.0), RIGID, 0.0, e, radius=1.0), impact_motion(e, 2, 8)
        add("damped impact against its integrated motion, relative error",
            [unit.contact_duration(1.0, 1.0) / motion.time[-1] - 1.0,
             unit.greatest_overlap(1.0, 1.0) / motion.overlap.max() - 1.0])  # fmt: skip
    add("solid ball: R spin = 5/2 change of velocity, relative error", spins)


def _paths(add: Add) -> None:
    """Displacement in proportion to the overlap: F = kappa r P without slip for kappa r < mu, otherwise mu P."""
    from validation.reference import annulus

    deepest, radius, friction = 1e-5, 0.01, 0.3
    overlap = deepest * np.concatenate([np.linspace(0.0, 1.0, 21), np.linspace(0.95, 0.05, 19)])
    names = {True: "loading and unloading without slip, F = kappa r P, three laws, relative error",
             False: "loading that slides, F = mu P, three laws, relative error"}  # fmt: skip
    for part, law in product((0.2, 0.7, 0.95, 2.0), ("linear_spring", "mindlin", "microslip")):  # kappa r/mu
        sticks, way = part < 1.0, overlap if part < 1.0 else overlap[:21]
        pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction, radius=radius, law=law)
        normal, pull = law_along_path(pair, way, part * friction / pair.kappa * way)
        exact = min(part, 1.0) * friction * normal
        add(names[sticks], (pull - exact) / exact.max())
    for part in (0.2, 0.7, 0.95, 2.0):
        way = overlap[:21] / radius
        pull = annulus.force_along_path(way, part * friction * way, friction=friction)
        exact = min(part, 1.0) * friction * 4.0 / 3.0 * way**1.5
        add("both on loading, annulus solver of 40, relative error", (pull - exact) / exact.max(), REFERENCE)
