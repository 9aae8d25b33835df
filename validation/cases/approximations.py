"""What the theory of oblique impact leaves out, in figures."""

from math import cos, pi, radians, sqrt, tan

import numpy as np

from contactlaw import MATERIALS, RIGID, Body, Material, collide
from sims.puck import SURFACES, Puck
from validation.case import Case, Data, Limit, Outcome, Table
from validation.prediction import quiet_pair

STEEL, RUBBER, GLASS, ALUMINA = (MATERIALS[name] for name in ("steel", "rubber", "glass", "alumina"))
ALUMINIUM, ACETATE = MATERIALS["aluminium"], MATERIALS["cellulose acetate"]
ZERODUR = Material(9.1e10, 0.24, 2530.0, "Zerodur", "glass ceramic of Schott: encyclopaedia article on Zerodur")
GRANITE = Material(6.2e10, 0.293, 2700.0, "granite", "from bulk modulus 50 GPa and shear modulus 24 GPa, as tabulated "
                   "for granite; grades differ by a factor of ten")  # fmt: skip
GOLF = Material(9.3e7, 0.5, 1100.0, "golf ball", "E: Hertz contact of 0.45 ms under a club head of 0.2 kg at 45 m/s "
                "(contact time as quoted since Cochran & Stobbs, The Search for the Perfect Swing, 1968); nu: rubber "
                "core, assumed")  # fmt: skip
BULK_OF_RUBBER = 2e9
"""Bulk modulus [Pa] that pressure waves in rubber see, where nu is taken as 1/2 otherwise (handbook order of size)."""

RATIOS = np.array([0.28, 0.5])  # Poisson's ratio
TYPICAL = 1.2  # psi_1 of the paper's typical impact
PAPERS_TRAVEL = 1.5  # [%], as quoted in the paper for an oblique impact without spin
ANGLES = [0, 40, 80]  # of the centre's velocity from the normal [degrees]
CROSS = 4.0 * cos(radians(25.0))  # 4 m/s, 25 degrees from the normal: Cross, Phys. Teach. 48 (2010)
STRIKES: list[tuple[str, Material, Material, float, float, float]] = [
    ("steel puck", STEEL, STEEL, Puck.radius, Puck("steel").mass, 1.0),
    ("rubber puck", RUBBER, RUBBER, Puck.radius, Puck("rubber").mass, 1.0),
    ("5 mm alumina ball on glass", ALUMINA, GLASS, 2.5e-3, 4.0 / 3.0 * pi * 2.5e-3**3 * 4000.0, 3.9),
    ("superball on granite", RUBBER, GRANITE, 0.029, 0.103, CROSS),
    ("golf ball on granite", GOLF, GRANITE, 0.0214, 0.045, CROSS),
]
"""In words; material of a ball and of the large block it hits, radius [m], mass [kg], approach speed [m/s]."""

PAIRS: list[tuple[str, Material, Material, float | None]] = [
    ("steel / steel", STEEL, STEEL, SURFACES["steel"].friction),
    ("rubber / rubber", RUBBER, RUBBER, SURFACES["rubber"].friction),
    ("alumina / glass", ALUMINA, GLASS, 0.092),
    ("glass / aluminium", GLASS, ALUMINIUM, 0.125),
    ("acetate / aluminium", ACETATE, ALUMINIUM, 0.208),
    ("steel / Zerodur", STEEL, ZERODUR, 0.11),
    ("glass / Zerodur", GLASS, ZERODUR, 0.106),
    ("superball / granite", RUBBER, GRANITE, None),
    ("golf ball / granite", GOLF, GRANITE, None),
    ("rubber / rigid", RUBBER, RIGID, None),
    ("nu = 0.3 / rigid (FE)", Material(2.08e11, 0.3), RIGID, 0.3),
]
"""Materials and friction of the data sets: the paper's pucks, Kharaz, Gorham & Salman (2001), Louge's impact chart,
Joseph & Hunt (2004), Cross (2010), Chung & Ooi (2011)."""


class Approximations(Case):
    """The theory behind the laws takes the tangential displacement as axisymmetric, the contact as quasi-static, its
    patch as fixed in place, and the materials as alike. This chapter estimates the error of each approximation for the
    impacts that the laws are compared with.
    """

    place = 95
    title = "What the theory leaves out"

    def run(self, quick: bool) -> Outcome:
        shape = _shape()
        waves = [_waves(*strike) for strike in STRIKES]
        travel = [_travel(angle) for angle in ANGLES]
        no_spin = _travel(None)
        coupling = [_coupling(*pair) for pair in PAIRS]
        data = {"shape": shape, "waves": waves, "travel": travel, "no_spin": no_spin, "coupling": coupling}
        limits = [
            Limit("contact time over wave transit 2R/c_d, least", 1.0, min(one["over_transit"] for one in waves),
                  at_least=True),
            Limit("contact time over period of the slowest mode, least", 1.0, min(one["over_mode"] for one in waves),
                  at_least=True),
            Limit("ContactPair.coupling against 2 beta, largest difference", 1e-12,
                  max(one["difference"] for one in coupling)),
        ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table("approximation | where | effect")
        for nu in (0.28, 0.5):
            known = data["shape"]
            shape = {key: 100 * np.interp(nu, known["nu"], known[key]) for key in ("rim", "rms_x", "rms")}
            table.add(f"non-axisymmetric displacement | nu = {nu:g}, gross slip | U_x and U_y {{rim:.1f}} % of the "
                      "mean at the rim; rms {rms_x:.1f} % (U_x), {rms:.1f} % (both)", shape)  # fmt: skip
        for one in data["waves"]:
            more = {"us": 1e6 * one["duration"], "radiated": _percent(one["share"]), "most": sqrt(1.0 - one["share"])}
            table.add("waves | {name}, {speed:.2g} m/s | contact {us:.0f} us = {over_transit:.3g} x 2R/c_d = "
                      "{over_mode:.2g} slowest periods; {radiated} of the energy into the block (e <= {most:.3f}); "
                      "overlap/R {depth:.2g}", one, more)  # fmt: skip
        labels = ("no spin", "straight, back-spin", *(f"{angle} degrees, spin" for angle in ANGLES[1:]))
        for label, one in zip(labels, [data["no_spin"], *data["travel"]], strict=True):
            table.add(f"travel of the patch | steel puck, {label} | {{block:.2g}} % of the greatest radius over the "
                      "block, {ball:.2g} % over the puck", one)  # fmt: skip
        faster = (PAPERS_TRAVEL / data["no_spin"]["block"]) ** 2.5
        table.add(f"travel of the patch | {PAPERS_TRAVEL} %, as the paper quotes | "
                  f"reached without spin at {faster:.1f} m/s (it grows with V^(2/5))")  # fmt: skip
        for one in data["coupling"]:
            ratio = ""
            if one["over_friction"] is not None:
                ratio = ", over mu {over_friction:.2g}: pressing alone sticks to {stick_radius:.2f} a"
            table.add(f"unlike materials | {{name}} | beta = {{beta:.2g}}, paper's footnote {2 * one['beta']:.2g}"
                      f"{ratio}; normal stiffness at most +{_percent(one['stiffening'])}", one)  # fmt: skip
        return table


def _percent(part: float) -> str:
    return "0 %" if part == 0.0 else f"{100.0 * part:.2g} %"


def _shape() -> Data:
    """U_x, U_y of gross slip against the mean over all directions at the same radius, over nu."""
    from validation.reference.closed_forms import gross_slip

    nodes, weights = np.polynomial.legendre.leggauss(24)
    r = np.append(0.5 * (nodes + 1.0), 1.0)[:, None]  # the last one is the rim, for the greatest value
    area = weights * r[:-1, 0] / np.sum(weights * r[:-1, 0])
    theta = 2.0 * pi * np.arange(64) / 64.0
    found: dict[str, list[float]] = {"rim": [], "rms_x": [], "rms": []}
    for nu in RATIOS:
        u_x, u_y = gross_slip.displacement(r, theta, float(nu))
        mean = u_x.mean(axis=1, keepdims=True)
        part_x, part_y = u_x - mean, u_y
        whole, x, y = (float(area @ np.mean(one[:-1] ** 2, axis=1)) for one in (mean, part_x, part_y))
        found["rim"].append(float(max(np.abs(part_x / mean).max(), np.abs(part_y / mean).max())))
        found["rms_x"].append(sqrt(x / whole))
        found["rms"].append(sqrt((x + y) / whole))
    return {"nu": RATIOS, **found}


def _waves(name: str, ball: Material, block: Material, radius: float, mass: float, speed: float) -> Data:
    """Duration of contact against waves through the ball, and energy radiated into the block."""
    from validation.reference.closed_forms import hertz, waves

    pair = quiet_pair(ball, block, 0.1, radius=radius)
    impact = hertz.impact(mass, radius, pair.effective_modulus, speed)
    slowness = waves.slowness_ratio(ball.poissons_ratio)
    density = ball.density or 0.0
    shear = waves.shear_speed(ball.shear_modulus, density)
    pressure = shear / slowness if slowness else sqrt((BULK_OF_RUBBER + 4.0 / 3.0 * ball.shear_modulus) / density)
    period = waves.mode_period(radius, ball.poissons_ratio, ball.shear_modulus, density)
    ground = {"shear": block.shear_modulus, "density": block.density or 0.0, "nu": block.poissons_ratio}
    share = waves.radiated_share(impact, mass, speed, **ground)
    return {"name": name, "speed": speed, "duration": impact.duration,
            "over_transit": impact.duration * pressure / (2.0 * radius), "over_mode": impact.duration / period,
            "share": share, "depth": impact.overlap / radius}  # fmt: skip


def _travel(angle: float | None) -> Data:
    """Travel of the contact patch over block and puck during one impact, over its greatest radius [%].

    Integrals over the impact of the speed of the centre and of the rim, from the forces of `collide`. angle: of the
    centre's velocity from the normal [degrees], with the spin that keeps psi_1; None: no spin.
    """
    from scipy.integrate import cumulative_trapezoid

    puck = Puck("steel", TYPICAL)
    sliding = TYPICAL * puck.pair.friction / puck.pair.kappa * puck.speed
    centre = sliding if angle is None else tan(radians(angle)) * puck.speed
    spin = (centre - sliding) / puck.radius
    body = Body(puck.mass, puck.radius, puck.inertia, (centre, 0.0, -puck.speed), (0.0, spin, 0.0))
    impact = collide(puck.pair, body)

    gained = cumulative_trapezoid(impact.tangential_force[:, 0], impact.time, initial=0.0)
    speeds = {"block": centre + gained / puck.mass, "ball": puck.radius * (spin - puck.radius / puck.inertia * gained)}
    widest = sqrt(puck.radius * float(impact.overlap.max()))
    return {name: 100.0 * float(np.trapezoid(speed, impact.time)) / widest for name, speed in speeds.items()}


def _coupling(name: str, a: Material, b: Material, friction: float | None) -> Data:
    """Dundurs' second parameter of a pair, and its possible effects."""
    from validation.reference.closed_forms import dundurs

    beta = dundurs.beta(1.0 / a.shear_modulus, a.poissons_ratio, 1.0 / b.shear_modulus, b.poissons_ratio)
    return {
        "name": name, "beta": beta,
        "over_friction": None if friction is None else abs(beta) / friction,
        "stick_radius": None if friction is None else dundurs.stick_radius(beta, friction),
        "stiffening": dundurs.stiffening(beta) - 1.0,
        "difference": abs(quiet_pair(a, b, 0.1, radius=1.0).coupling - 2.0 * beta),
    }  # fmt: skip
