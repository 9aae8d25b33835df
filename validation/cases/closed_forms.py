"""The laws and the annulus solver against every closed form of impact theory that holds exactly."""

import numpy as np

from contactlaw import LAWS, MATERIALS, RIGID, Body, ContactPair, Material, collide
from contactlaw import force_along_path as law_along_path
from contactlaw import rebound as law_rebound
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.prediction import quiet_pair

EXACT = 1e-6
DEFAULTS = 1e-3  # what `rebound` promises at default settings, chi from 0.5 to 2
REFERENCE = 5e-4  # what is asked of the annulus solver
FINE = 16384  # steps: the error falls with their square, from some 1e-3 at 128
CHIS = [0.3, 0.75, 1.0, 1.256, 1.441, 2.0]
RESTITUTIONS = [1.0, 0.86, 0.5]
SMALL = 1e-8  # psi_1 at which only the last 1e-8 of the time slips


@register
class ClosedForms(Case):
    """Where impact theory has a closed form the package and the annulus solver give it: sliding throughout, loading
    without slip, the Hertz impact, the contact point that bounces like the ball (2 chi = 1), and for linear springs the
    whole rebound.
    """

    place = 12
    title = "Closed forms"
    needs = ("scipy",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        limits = [*_sliding(), *_linear_springs(4096 if quick else FINE)]
        full_stick = {steps: _full_stick_error(steps) for steps in (128, FINE)}
        return Outcome([*limits, *_like_the_ball(), *_hertz(), *_paths()], {"full_stick": full_stick})

    def table(self, data: Data) -> Table:
        return Table("linear_spring against full stick | error in psi_2/psi_1", "{steps} steps | {error:.2g}",
                     ({"steps": steps, "error": error} for steps, error in data["full_stick"].items()))  # fmt: skip


def _sliding() -> list[Limit]:
    """psi_1 - 2 chi (1 + e) from the least psi_1 that slides throughout on."""
    from validation.reference import annulus
    from validation.reference.closed_forms import regimes, rigid

    errors: dict[str, list[float]] = {"laws": [], "annulus": [], "coulomb": []}
    for chi in [*CHIS, 4.5]:
        for e in RESTITUTIONS:
            psi_1 = regimes.slides_throughout_from(chi, e) + np.array([0.0, 1e-6, 0.5, 20.0])
            exact = rigid.gross_slip(psi_1, chi, e)
            later = regimes.rescaled_spring_slides_throughout_from(chi, e) - psi_1[0]
            for name in (name for name in LAWS if name != "coulomb"):
                from_here = later if name == "mindlin_rescaled" else 0.0
                error = law_rebound(psi_1 + from_here, chi, name, e) - (exact + from_here)
                errors["laws"].append(float(np.abs(error).max()))
            reached = np.asarray(annulus.rebound(psi_1[1:], chi, 8, restitution=e))
            errors["annulus"].append(float(np.abs(reached - exact[1:]).max()))
            rolls = np.linspace(-9.0, 9.0, 37)
            error = law_rebound(rolls, chi, "coulomb", e) - rigid.rebound(rolls, chi, e)
            errors["coulomb"].append(float(np.abs(error).max()))
    return [
        Limit("sliding throughout, all elastic laws, error in psi_2", EXACT, max(errors["laws"])),
        Limit("sliding throughout, annulus solver, error in psi_2", EXACT, max(errors["annulus"])),
        Limit("rigid theory, coulomb, error in psi_2", EXACT, max(errors["coulomb"])),
    ]


def _linear_springs(steps: int) -> list[Limit]:
    """`linear_spring` against the exact rebound of the linearised problem, and against full stick."""
    from validation.reference.closed_forms import oscillator

    psi_1 = np.linspace(-6.0, 6.0, 49)
    default, fine = [], []
    for chi in CHIS:
        exact = oscillator.rebound(psi_1, chi)
        default.append(float(np.abs(law_rebound(psi_1, chi, "linear_spring") - exact).max()))
        fine.append(float(np.abs(law_rebound(psi_1, chi, "linear_spring", steps=steps) - exact).max()))
    return [
        Limit("linear springs, default steps, error in psi_2", DEFAULTS, max(default)),
        Limit(f"linear springs, {steps} steps, error in psi_2", EXACT, max(fine)),
        Limit(f"full stick, psi_1 = {SMALL:g}, extrapolated from {steps} steps, error in psi_2/psi_1", EXACT,
              _full_stick_error(steps, extrapolated=True)),
    ]  # fmt: skip


def _full_stick_error(steps: int, *, extrapolated: bool = False) -> float:
    """Largest error in psi_2/psi_1 against cos(pi sqrt(2 chi)) of `linear_spring` at an incidence near zero.

    First order in the step, unlike everything else here: a spring still loaded at the release meets an impulse of the
    last step that the law takes in proportion to the normal one, which falls to zero. The cap makes that a matter of
    psi_1 below the load of one step; there psi_2 is off by a small part of a small psi_1.
    """
    from validation.reference.closed_forms import oscillator

    errors = []
    for chi in CHIS:
        once, twice = (float(law_rebound(SMALL, chi, "linear_spring", steps=n)) / SMALL for n in (steps, 2 * steps))
        reached = 2.0 * twice - once if extrapolated else once
        errors.append(abs(reached - oscillator.full_stick_rebound(1.0, chi)))
    return max(errors)


def _like_the_ball() -> list[Limit]:
    """2 chi = 1 and psi_1 <= 1: the tangential motion repeats the normal one, nothing slips, psi_2 = -e psi_1."""
    from validation.reference import annulus

    psi_1 = np.array([0.1, 0.5, 0.9])
    laws, fine, solver = [], [], []
    for e in RESTITUTIONS:
        for steps, errors in ((None, laws), (FINE, fine)):
            reached = np.asarray(law_rebound(psi_1, 0.5, "microslip", e, steps=steps))
            errors.append(float(np.abs(reached + e * psi_1).max()))
        reached = np.asarray(annulus.rebound(psi_1, 0.5, 20, restitution=e))
        solver.append(float(np.abs(reached + e * psi_1).max()))
    return [
        Limit("2 chi = 1, microslip, default steps, error in psi_2", DEFAULTS, max(laws)),
        Limit(f"2 chi = 1, microslip, {FINE} steps, error in psi_2", EXACT, max(fine)),
        Limit("2 chi = 1, annulus solver of 20, error in psi_2", REFERENCE, max(solver)),
    ]


def _hertz() -> list[Limit]:
    """Duration, overlap and force of normal impacts, as the pair states them and as `collide` reaches them."""
    from validation.reference.closed_forms import hertz
    from validation.reference.normal_motion import impact_motion

    steel, rubber, glass = (MATERIALS[name] for name in ("steel", "rubber", "glass"))
    stated, reached, spin = [], [], []
    for a, b, radius, speed in ((steel, steel, 0.025, 0.8), (rubber, rubber, 0.05, 0.3), (glass, RIGID, 1.5e-3, 4.0)):
        body = Body(4.19 * radius**3 * (a.density or 0.0), radius, velocity=(0.3 * speed, 0.0, -speed))
        pairs = {law: quiet_pair(a, b, 0.2, radius=radius, law=law) for law in ("microslip", "linear_spring")}
        pair = pairs["microslip"]
        exact = hertz.impact(body.mass, radius, pair.effective_modulus, speed)
        figures = np.array(exact[:3])  # duration, overlap, force
        own = [of(body.mass, speed) for of in (pair.contact_duration, pair.greatest_overlap, pair.greatest_force)]
        impact = collide(pair, body)
        run = [impact.time[-1], impact.overlap.max(), impact.normal_force.max()]
        linear = collide(pairs["linear_spring"], body).time[-1]
        stated.append(float(np.abs(own / figures - 1.0).max()))
        reached.append(float(np.abs(np.array([*run, linear]) / [*figures, exact.duration] - 1.0).max()))
        gained = impact.velocity_a - np.asarray(body.velocity)
        spin.append(abs(radius * impact.spin_a[1] + 2.5 * gained[0]) / abs(gained[0]))
    damped = []
    for e in RESTITUTIONS:
        unit = quiet_pair(Material(1.0, 0.0), RIGID, 0.0, e, radius=1.0)
        motion = impact_motion(e, 2, 8)
        damped += [abs(unit.contact_duration(1.0, 1.0) / motion.time[-1] - 1.0),
                   abs(unit.greatest_overlap(1.0, 1.0) / motion.overlap.max() - 1.0)]  # fmt: skip
    return [
        Limit("Hertz impact, figures of ContactPair, relative error", EXACT, max(stated)),
        Limit("Hertz impact, reached by collide(), relative error", EXACT, max(reached)),
        Limit("damped impact against its integrated motion, relative error", EXACT, max(damped)),
        Limit("solid ball: R spin = 5/2 change of velocity, relative error", EXACT, max(spin)),
    ]


def _paths() -> list[Limit]:
    """Displacement in proportion to the overlap: F = kappa r P without slip for kappa r < mu, otherwise mu P."""
    from validation.reference import annulus

    deepest, radius, friction = 1e-5, 0.01, 0.3
    overlap = deepest * np.concatenate([np.linspace(0.0, 1.0, 21), np.linspace(0.95, 0.05, 19)])
    errors: dict[str, list[float]] = {"stick": [], "slip": [], "annulus": []}
    for part in (0.2, 0.7, 0.95, 2.0):  # kappa r/mu
        kind, way = ("stick", overlap) if part < 1.0 else ("slip", overlap[:21])
        for law in ("linear_spring", "mindlin", "microslip"):
            pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction, radius=radius, law=law)
            normal, pull = law_along_path(pair, way, part * friction / pair.kappa * way)
            exact = min(part, 1.0) * friction * normal
            errors[kind].append(float(np.abs(pull - exact).max() / exact.max()))
        way = overlap[:21] / radius
        pull = annulus.force_along_path(way, part * friction * way, friction=friction)
        exact = min(part, 1.0) * friction * 4.0 / 3.0 * way**1.5
        errors["annulus"].append(float(np.abs(pull - exact).max() / exact.max()))
    return [
        Limit("loading and unloading without slip, F = kappa r P, three laws, relative error", EXACT,
              max(errors["stick"])),
        Limit("loading that slides, F = mu P, three laws, relative error", EXACT, max(errors["slip"])),
        Limit("both on loading, annulus solver of 40, relative error", REFERENCE, max(errors["annulus"])),
    ]  # fmt: skip
