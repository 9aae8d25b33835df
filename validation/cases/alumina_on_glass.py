"""All laws against impacts of alumina spheres on glass, measured by Kharaz, Gorham & Salman."""

import numpy as np

from contactlaw import LAWS, MATERIALS, ContactPair
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.measured import Array, load
from validation.picture import curves, legend_below, points
from validation.prediction import REFERENCE, SPHERE, over_the_next_best, quiet_pair, rebounds, rms

FRICTION, RESTITUTION = 0.092, 0.98
SPEED = 3.875  # [m/s]: the middle of the range that is published
RADIUS = 2.5e-3  # [m]
STICKING = 33.0  # [deg] incidence beyond which the contact slides throughout, by every law
TABLES = {"e_t": ("kharaz_et_lethe", "e_t_cm"), "spin": ("kharaz_omega_lethe", "omega_abs_rad_s"),
          "rebound angle": ("kharaz_rebound_cm_lethe", "rebound_cm_deg")}  # fmt: skip
UNITS = {"e_t": "", "spin": "rad/s", "rebound angle": "deg"}
UNSURE = 0.1  # [deg] how well an angle of a velocity is taken to be known; it makes e_t unsure by UNSURE/theta


PAIR = quiet_pair(MATERIALS["alumina"], MATERIALS["glass"], FRICTION, RESTITUTION)


class AluminaOnGlass(Case):
    """Tangential restitution, spin and rebound angle, from published elastic constants and friction alone."""

    place = 13
    title = "Alumina spheres on glass"
    claim = (
        "The rebound of a 5 mm alumina sphere from glass, measured by Kharaz, Gorham & Salman, follows from the "
        "published elastic constants, friction 0.092 and restitution 0.98; nothing is fitted. From 33 degrees on the "
        "contact slides throughout, all laws agree, and the remaining differences lie in the data: a sphere's spin "
        "follows from its tangential restitution, yet the two as measured differ from each other as much as from the "
        "laws. From 20 degrees on the measured angle is 0.4 to 0.7 degrees below the laws', gross slip included, and "
        "at 20 and 30 degrees 0.5 to 0.7 below the angle that follows from the measured spin and e_t; so the missed "
        "limit reflects the data, not the law. Laws and reference neglect the coupling of normal and tangential motion "
        f"({PAIR.coupling:.2f} for this pair), which the data contradict "
        "([unlike materials](#unlike-materials))."
    )
    sheet = {"columns": 3, "width": 3.9}
    caption = (
        "Tangential restitution of the centre of mass, spin, and rebound angle over the angle of incidence. Error "
        f"bars of e_t: for an uncertainty of {UNSURE} degrees in the angle, which matters below 5 degrees."
    )

    def run(self, quick: bool) -> Outcome:
        pair, measures, shown = PAIR, {}, {}
        for quantity in TABLES:
            theta, value = measured(quantity)
            differences = {law: found[quantity] - value for law, found in quantities(pair, theta).items()}
            below = theta < STICKING
            measures[quantity] = {part: {law: rms(difference[inside]) for law, difference in differences.items()}
                                  for part, inside in (("below", below), ("all", theta < 90.0))}  # fmt: skip
            shown[quantity] = {"theta": theta, "value": value, "points": [int(below.sum()), theta.size]}
        grid = np.linspace(0.25, 62.0, 60 if quick else 160)
        lines = quantities(pair, grid)
        data = {
            "chi": SPHERE * pair.kappa / 2.0, "rms": measures, "shown": shown,
            "each_from_each": consistency(), "angle_from_others": angles_from_others(), "grid": grid,
            "laws": {quantity: {law: found[quantity] for law, found in lines.items()} for quantity in TABLES},
        }  # fmt: skip
        limits = []
        for quantity, asked in scatter().items():
            below = measures[quantity]["below"]
            limits.append(Limit(f"rms of microslip in {quantity}, below {STICKING:g} degrees, beside the scatter",
                                asked, below["microslip"], UNITS[quantity]))  # fmt: skip
            over = over_the_next_best(below)
            limits.append(Limit(f"rms of microslip over the next best law's, {quantity}", 1.0, over))
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        heads = ["law, rms from the measurement"]
        for quantity, shown in data["shown"].items():
            unit = f" [{UNITS[quantity]}]" if UNITS[quantity] else ""
            heads += [f"{quantity}{unit}, below {STICKING:g} degrees ({shown['points'][0]})",
                      f"all ({shown['points'][1]})"]  # fmt: skip
        table = Table(heads)
        for law in [*LAWS, REFERENCE]:
            found = (data["rms"][quantity][part][law] for quantity in TABLES for part in ("below", "all"))
            table.add(f"{law} | " + " | ".join(f"{value:.3g}" for value in found))
        table.add("(measured, from the measured rebound angle) | {e_t[0]:.3g} | {e_t[1]:.3g} | {spin[0]:.3g} | "
                  "{spin[1]:.3g}", data["each_from_each"])  # fmt: skip
        for quantity, (below, every) in data["angle_from_others"].items():
            table.add(f"(measured, from the measured {quantity}) | | | | | {below:.3g} | {every:.3g}")
        return table

    def draw(self, data: Data, *axes: Axes) -> None:
        labels = {"e_t": r"$e_t$ of the centre of mass [-]", "spin": "spin after [rad/s]",
                  "rebound angle": "rebound angle [degrees]"}  # fmt: skip
        for one, quantity in zip(axes, TABLES, strict=True):
            shown = data["shown"][quantity]
            curves(one, data["grid"], data["laws"][quantity])
            error = [UNSURE / theta * value for theta, value in zip(shown["theta"], shown["value"], strict=True)]
            points(one, shown["theta"], shown["value"], error if quantity == "e_t" else None, "measured")
            one.set(xlabel="angle of incidence [degrees]", ylabel=labels[quantity], xlim=(0.0, 63.0))
        axes[0].set(ylim=(0.5, 1.0), title=rf"$\chi$ = {data['chi']:.3f}, e = {RESTITUTION:g}")
        axes[1].set(ylim=(0.0, 720.0))
        axes[2].set(ylim=(0.0, 60.0))
        legend_below(axes[0], 7)


def measured(quantity: str) -> tuple[Array, Array]:
    """Angles of incidence [deg] and the values measured there."""
    name, column = TABLES[quantity]
    table = load(name)
    return table["theta_deg"], table[column]


def quantities(
    pair: ContactPair, theta: Array, speed: float = SPEED, *, with_reference: bool = True
) -> dict[str, dict[str, Array]]:
    """Predictions of every law for angles of incidence [deg] > 0, shape (n,), and a speed [m/s].

    By law: e_t of the centre of mass, spin [rad/s], rebound angle of the centre of mass [deg], shape (n,) each. e_t is
    formed from psi_2/psi_1, not from velocities: at small angles both vanish.
    """
    angle = np.radians(theta)
    psi_1 = pair.kappa / pair.friction * np.tan(angle)
    found = {}
    psi_2_by_law = rebounds(psi_1, SPHERE * pair.kappa / 2.0, pair.restitution, with_reference=with_reference)
    for law, psi_2 in psi_2_by_law.items():
        e_t = 1.0 - (1.0 - psi_2 / psi_1) / SPHERE
        found[law] = {
            "e_t": e_t,
            "spin": 2.5 * (1.0 - e_t) * speed * np.sin(angle) / RADIUS,
            "rebound angle": np.degrees(np.arctan(e_t * np.tan(angle) / pair.restitution)),
        }
    return found


def consistency() -> dict[str, tuple[float, float]]:
    """Difference of the measured e_t and spin from those that follow from the measured rebound angle alone.

    A homogeneous sphere without spin before leaves with e_t = e tan(rebound)/tan(theta) and R omega = 2.5 v_t
    (1 - e_t), whatever the contact law. The angle is interpolated to the incidence of the other quantity. Returns the
    rms below 33 degrees and over all angles, in the quantity's unit.
    """
    # The ratio of the angles varies slowly; the first point, at 0.016 degrees, is all reading error.
    at, rebound = (one[1:] for one in measured("rebound angle"))
    found = {}
    for quantity in ("e_t", "spin"):
        theta, seen = measured(quantity)
        angle = np.radians(np.interp(theta, at, rebound / at) * theta)
        e_t = RESTITUTION * np.tan(angle) / np.tan(np.radians(theta))
        value = e_t if quantity == "e_t" else 2.5 * (1.0 - e_t) * SPEED * np.sin(np.radians(theta)) / RADIUS
        found[quantity] = rms((value - seen)[theta < STICKING]), rms(value - seen)
    return found


def angles_from_others() -> dict[str, tuple[float, float]]:
    """Difference of the measured rebound angle from those that follow from e_t and spin, rms [deg] as in `consistency`.

    Their ratio to the law's e_t is interpolated, since it varies slowly.
    """
    theta, angle = measured("rebound angle")
    found = {}
    for quantity in ("e_t", "spin"):
        at, value = measured(quantity)
        own = value if quantity == "e_t" else 1.0 - value * RADIUS / (2.5 * SPEED * np.sin(np.radians(at)))
        e_t, law = (quantities(PAIR, x, with_reference=False)["microslip"]["e_t"] for x in (theta, at))
        reflected = e_t * np.interp(theta, at, own / law) * np.tan(np.radians(theta)) / RESTITUTION
        difference = np.degrees(np.arctan(reflected)) - angle
        found[quantity] = rms(difference[theta < STICKING]), rms(difference)
    return found


def scatter() -> dict[str, float]:
    """Scatter of the data below 33 degrees, rms by quantity; for the angle, what the disagreement of e_t causes."""
    found, theta = consistency(), measured("rebound angle")[0]
    theta = theta[theta < STICKING]
    e_t = quantities(PAIR, theta, with_reference=False)["microslip"]["e_t"]
    reflected = np.tan(np.radians(theta)) / RESTITUTION
    slope = np.degrees(reflected / (1.0 + (e_t * reflected) ** 2))
    return {"e_t": found["e_t"][0], "spin": found["spin"][0], "rebound angle": rms(found["e_t"][0] * slope)}
