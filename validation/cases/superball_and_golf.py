"""Reversing balls: superballs and golf balls measured by Cross, with unknown friction."""

from math import radians, sin, tan

import numpy as np

from contactlaw import LAWS, MATERIALS, RIGID, ContactPair, rebound
from validation.case import Case, Data, Limit, Outcome, Table
from validation.cases.rebound_constants import LAWS_HERE
from validation.measured import Array, Measured, load
from validation.prediction import REFERENCE, SPHERE, reference, rms

INCIDENCE = 25.0  # [deg] from the normal, of the measurements of 2010
RUBBER = "2/3 (incompressible)"
KAPPAS = {RUBBER: ContactPair(MATERIALS["rubber"], RIGID, 1.0).kappa, "0.60 (comparison)": 0.60}
"""kappa of rubber on anything rigid or of rubber, from nu = 1/2; and the value that superballs are said to need."""
GRIPPING = (0.5, 1.5)  # friction of dry rubber on clean solids and on rubber: assumed, not measured on these pairs
E_T_ERROR = 0.01  # as published
SHOWN = [*LAWS_HERE, REFERENCE]


class SuperballAndGolf(Case):
    """A superball that strikes a hard surface at 25 degrees leaves with about half of its contact point's velocity
    reversed. The friction of these pairs was not published, so the table gives each law's range over the friction that
    dry rubber may have (0.5 to 1.5, assumed; at least the ratio of the impulses). Rigid friction reverses nothing. With
    elastic constants alone (kappa = 2/3) `microslip` is the law nearest to most measured values of 2010, though by rms
    no nearer than a linear spring, and still falls short of them; it agrees with that of 2002. A kappa of 0.60, given
    for comparison and not used, closes half of the gap or more. Either friction was far lower than assumed, or these
    balls are softer in shear than a small contact of incompressible rubber; the data cannot decide. No law here covers
    balls that deform over a large part of themselves, a normal force that acts off the centre (the measured spin
    differs by up to 11 % from that of the measured e_t), sliding of a hard golf ball, and strings.
    """

    place = 15
    title = "Superballs and golf balls"

    def run(self, quick: bool) -> Outcome:
        balls, block = load("cross2010_balls"), load("cross2002_superball")
        rows = rows_2010(balls) + [row_2002(block)]
        for row in rows:
            row["laws"] = {label: {law: extremes(kappa, row["tangent"], row["e_n"], law) for law in SHOWN}
                           for label, kappa in KAPPAS.items()}  # fmt: skip
            row["friction_at_least"] = impulse_ratio(row["tangent"], row["e_t"], row["e_n"])
        apart = [{law: _apart(found, row["e_t"]) for law, found in row["laws"][RUBBER].items()} for row in rows[:-1]]
        nearest = [min(LAWS, key=lambda law, one=one: one[law]) == "microslip" for one in apart]
        data = {"kappas": KAPPAS, "gripping": GRIPPING, "rows": rows,
                "apart": {law: rms([one[law] for one in apart]) for law in SHOWN}}  # fmt: skip
        limits = [Limit("balls of 2010 to which microslip is the nearest law, over half of them", 1.0,
                        2.0 * sum(nearest) / len(nearest), at_least=True)]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        first, second = data["kappas"]
        low, high = data["gripping"]
        table = Table(["ball on surface", "e_n", "measured e_t", *(f"{law}, mu {low:g} to {high:g}" for law in SHOWN),
                       f"microslip, kappa = {second}", "measured spin over that from e_t", "least mu"])  # fmt: skip
        for row in data["rows"]:
            ranges = [*(row["laws"][first][law] for law in SHOWN), row["laws"][second]["microslip"]]
            found = " | ".join(f"{below:.2f} to {above:.2f}" for below, above in ranges)
            table.add(f"{{name}} | {{e_n:g}} | {{e_t:.2f}} +- {{error:.2f}} | {found} | {{spin_ratio:.3f}} | "
                      "{friction_at_least:.2f}", row)  # fmt: skip
        apart = " | ".join(f"{data['apart'][law]:.3f}" for law in SHOWN)
        table.add(f"rms of those of 2010 from each range, as measured to {E_T_ERROR:g} | | | {apart}")
        return table


def _apart(bounds: tuple[float, float], measured: float) -> float:
    """Distance of a measured value from a range."""
    return max(bounds[0] - measured, measured - bounds[1], 0.0)


def e_t(kappa: float, friction: Array, tangent: float, e_n: float, law: str) -> Array:
    """-psi_2/psi_1, the part of the contact point's velocity that is reversed, at some friction coefficients, (n,)."""
    psi_1, chi = kappa / friction * tangent, SPHERE * kappa / 2.0
    psi_2 = reference(psi_1, chi, e_n) if law == REFERENCE else np.asarray(rebound(psi_1, chi, law, e_n))
    return 0.0 - psi_2 / psi_1


def extremes(kappa: float, tangent: float, e_n: float, law: str) -> tuple[float, float]:
    """Least and greatest e_t over the assumed friction; 15 values of it."""
    found = e_t(kappa, np.linspace(*GRIPPING, 15), tangent, e_n, law)
    return float(found.min()), float(found.max())


def impulse_ratio(tangent: float, e_t_measured: float, e_n: float) -> float:
    """Tangential over normal impulse of a measured impact, a homogeneous sphere; friction must be at least this."""
    return tangent * (1.0 + e_t_measured) / (SPHERE * (1.0 + e_n))


def rows_2010(table: Measured) -> list[Data]:
    """Each ball and surface of Cross (2010).

    `spin_ratio`: measured spin over that which follows from the measured e_t for a homogeneous sphere whose contact
    forces act at one point, S = (1 + e_t) sin(25 deg)/(1.4 R); 1 where nothing else acts.
    """
    rows = []
    for number in range(len(table)):
        ball, surface = table.words["ball"][number], table.words["surface"][number]
        measured, e_n, radius = (float(table[name][number]) for name in ("e_t_contact", "e_n", "R_m"))
        spin = (1.0 + measured) * sin(radians(INCIDENCE)) / (1.4 * radius)
        rows.append({"year": 2010, "ball": ball, "surface": surface, "name": f"{ball} on {surface.replace('_', ' ')}",
                     "tangent": tan(radians(INCIDENCE)), "e_n": e_n, "e_t": measured, "error": E_T_ERROR,
                     "spin_ratio": float(table["S_rad_per_m"][number]) / spin})  # fmt: skip
    return rows


def row_2002(table: Measured) -> Data:
    """The superball of Cross (2002), on a block that recoils; errors of 2.5 % in the two velocities after."""
    vx, vy, vx_out, omega, radius, e_n = (
        float(table[name][0]) for name in ("vx_in", "vy_in", "vx_out", "omega_out", "R_m", "e_y")
    )
    measured = -(vx_out - radius * omega) / vx
    return {
        "year": 2002, "ball": "superball", "surface": "block", "name": "superball on a block, 54 degrees (2002)",
        "tangent": vx / -vy, "e_n": e_n, "e_t": measured, "error": 0.025 * float(np.hypot(vx_out, radius * omega)) / vx,
        "spin_ratio": 1.4 * radius * omega / ((1.0 + measured) * vx),
    }  # fmt: skip
