"""The greatest reversal of the contact point, from elastic constants alone, against measured constants of rebound."""

from typing import Any

import numpy as np

from contactlaw import LAWS, MATERIALS, Material, rebound
from validation.case import Case, Data, Limit, Outcome, Table
from validation.cases.approximations import ZERODUR
from validation.measured import Array, load
from validation.prediction import REFERENCE, SPHERE, quiet_pair, reference, rms

DELRIN = Material(3.1e9, 0.35, 1440.0, "delrin", "nu as quoted for acetal homopolymer, assumed; E without effect")
POLYURETHANE = Material(1e7, 0.5, 1200.0, "polyurethane", "nu of incompressible elastomers, assumed; E without effect")
GLASS, STEEL, ACETATE = (MATERIALS[name] for name in ("glass", "steel", "cellulose acetate"))
ALUMINIUM = MATERIALS["aluminium"]

PAIRS = {
    "glass soda-lime / same": (GLASS, GLASS, ""),
    "glass fresh / same": (GLASS, GLASS, ""),
    "glass spent / same": (GLASS, GLASS, "worn: almost four times the friction of fresh glass, presumably rough"),
    "cellulose acetate / same": (ACETATE, ACETATE, ""),
    "chrome steel / same": (STEEL, STEEL, "above the greatest value that any law allows; unexplained"),
    "delrin / same": (DELRIN, DELRIN, "near the greatest value, which is within its error; nu is assumed"),
    "polyurethane / same": (POLYURETHANE, POLYURETHANE, "e = 0.6: as lossy in shear, it seems"),
    "glass soda-lime / aluminium plate": (GLASS, ALUMINIUM, "e = 0.83: the plate probably yields"),
    "cellulose acetate / aluminium plate": (ACETATE, ALUMINIUM, ""),
    "steel / Zerodur (air)": (STEEL, ZERODUR, ""),
    "glass / Zerodur (air)": (GLASS, ZERODUR, ""),
}
"""Both materials of each measured pair, and what is particular about it."""

LOSSY = "microslip shear_loss=1"
LAWS_HERE = [*LAWS, LOSSY]
HARD = 0.7  # e above which a pair loses little
CHI_SQUARED = 19.68  # 95 % of chi^2 with eleven degrees of freedom


class ReboundConstants(Case):
    """Experimenters describe impacts by Walton's three constants. One of them, beta_0, is the share of the contact
    point's velocity that a sticking impact reverses, -psi_2/psi_1, taken as constant. In the laws -psi_2/psi_1 is not
    constant: it rises from nearly zero to a maximum and falls again. The table therefore gives two values, neither
    fitted: the maximum, and the slope of the line through the origin that an experimenter would fit to impacts spread
    evenly over the range that Walton's model calls sticking. The slope is what was measured; by it `microslip` is
    nearer to the measured constants than by the maximum, which is an upper bound. The errors, 0.02 to 0.1, exclude
    rigid friction, but hardly distinguish the laws with compliance. Losses in shear as in compression, `shear_loss`,
    which add no parameter, reduce chi^2 of the eleven from 65 to 17, above all for polyurethane. No law here explains
    rough and worn surfaces, plastic flow, and the constant of steel, which is too high.
    """

    place = 14
    title = "Measured constants of rebound"

    def run(self, quick: bool) -> Outcome:
        table = load("louge_impact_table")
        rows: list[dict[str, Any]] = []
        for number, name in enumerate(table.words["pair"]):
            a, b, remark = PAIRS[name]
            restitution, friction = float(table["e"][number]), float(table["mu"][number])
            pair = quiet_pair(a, b, friction, restitution)
            chi = SPHERE * pair.kappa / 2.0
            readings = both_readings(chi, restitution, 60 if quick else 200, 16 if quick else 40)
            rows.append({"pair": name, "nu": [a.poissons_ratio, b.poissons_ratio], "remark": remark,
                         "chi": chi, "coupling": pair.coupling, "e": restitution,
                         "beta_0": float(table["beta0"][number]), "error": float(table["beta0_err"][number]),
                         "greatest": readings[0], "slope": readings[1]})  # fmt: skip
        summary = {reading: {law: {"rms": rms([row[reading][law] - row["beta_0"] for row in rows])}
                             for law in rows[0]["slope"]} for reading in ("greatest", "slope")}  # fmt: skip
        squares, harder = ({law: sum(((row["slope"][law] - row["beta_0"]) / row["error"]) ** 2 for row in rows
                                     if row["e"] > least) for law in LAWS_HERE} for least in (0.0, HARD))  # fmt: skip
        limits = [
            Limit(f"chi^2 of {len(rows)} slopes with losses in shear, beside its 95 % quantile", CHI_SQUARED,
                  squares[LOSSY]),
            Limit("the same over that without such losses", 1.0, squares[LOSSY] / squares["microslip"]),
            Limit(f"chi^2 of microslip where e > {HARD:g}, over the best other law's", 1.0,
                  harder["microslip"] / min(harder[law] for law in LAWS if law != "microslip")),
        ]  # fmt: skip
        return Outcome(limits, {"rows": rows, "summary": summary, "chi_squared": squares, "harder": harder})

    def table(self, data: Data) -> Table:
        laws = [*LAWS_HERE, REFERENCE]
        table = Table(["pair", "nu", "chi", "coupling", "e", "measured beta_0",
                       *(f"{law}: slope (maximum)" for law in laws),
                       "error of microslip's slope, in standard errors", "remark"])  # fmt: skip
        of = data["summary"]
        found = (f"{of['slope'][law]['rms']:.2f} ({of['greatest'][law]['rms']:.2f})" for law in laws)
        for name, key in (("of all slopes", "chi_squared"), (f"of those with e > {HARD:g}", "harder")):
            squares = (f"{data[key][law]:.0f}" for law in LAWS_HERE)
            table.add(f"chi^2 {name} | | | | | | {' | '.join(squares)}")
        table.add(f"rms from the measured | | | | | | {' | '.join(found)}")
        for row in data["rows"]:
            off = (row["slope"]["microslip"] - row["beta_0"]) / row["error"]
            nu = " and ".join(f"{value:g}" for value in dict.fromkeys(row["nu"]))
            found = " | ".join(f"{row['slope'][law]:.2f} ({row['greatest'][law]:.2f})" for law in laws)
            table.add(f"{{pair}} | {nu} | {{chi:.3f}} | {{coupling:.2f}} | {{e:g}} | {{beta_0:.2f}} +- {{error:.2f}} | "
                      f"{found} | {off:+.1f} | {{remark}}", row)  # fmt: skip
        return table


def both_readings(
    chi: float, restitution: float, count: int, reference_count: int
) -> tuple[dict[str, float], dict[str, float]]:
    """The greatest -psi_2/psi_1, not below 0, and the slope over the sticking range, by law; counts: of incidences."""
    greatest, slope = {}, {}
    for law in [*LAWS_HERE, REFERENCE]:
        number = reference_count if law == REFERENCE else count
        psi_1 = 2.0 * chi * (1.0 + restitution) * (np.arange(number) + 0.5) / number
        psi_2 = reference(psi_1, chi, restitution) if law == REFERENCE else rebound(psi_1, chi, law, restitution)
        psi_2 = np.asarray(psi_2)
        greatest[law] = max(0.0, float((-psi_2 / psi_1).max()))
        slope[law] = walton_slope(psi_1, psi_2, chi, restitution)
    return greatest, slope


def walton_slope(psi_1: Array, psi_2: Array, chi: float, restitution: float) -> float:
    """beta_0 of a line psi_2 = -beta_0 psi_1 by least squares over the impacts that Walton's model calls sticking.

    These are psi_1 < 2 chi (1 + e)/(1 + beta_0), where the line meets that of gross slip, psi_1 - 2 chi (1 + e); the
    range and the slope are made to agree. Source of the model: Walton (1993), in Foerster, Louge, Chang & Allia, Phys.
    Fluids 6 (1994) 1108.
    """
    # Sums from the left: the slope over each first part of the range, and the part that this slope itself implies.
    slopes = -np.cumsum(psi_1 * psi_2) / np.cumsum(psi_1**2)
    end = 2.0 * chi * (1.0 + restitution) / (1.0 + slopes)
    agree = psi_1 - end
    crossing = int(np.argmax(agree >= 0.0))  # beyond it more impacts are taken than the slope calls sticking
    if agree[crossing] < 0.0 or crossing == 0:
        return max(0.0, float(slopes[-1]))
    share = agree[crossing - 1] / (agree[crossing - 1] - agree[crossing])
    return float(slopes[crossing - 1] + share * (slopes[crossing] - slopes[crossing - 1]))
