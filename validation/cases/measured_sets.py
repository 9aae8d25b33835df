"""Every measured set in one table: this law unfitted, the best other law unfitted, the scatter of the data."""

from __future__ import annotations

import numpy as np

from contactlaw import LAWS
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.cases import alumina_on_glass as alumina
from validation.cases import finite_elements as elements
from validation.cases import rebound_constants as constants
from validation.cases import superball_and_golf as balls
from validation.measured import load
from validation.prediction import SPHERE, quiet_pair, rebounds, rms

LOSSY = constants.LOSSY
CHART, BALLS = "Louge's chart", "superball and golf ball"
SOFT = (CHART, BALLS)  # sets with materials that lose much or deform as a whole: outside of what the law is for
OTHERS = [name for name in LAWS if name != "microslip"]


@register
class MeasuredSets(Case):
    """Nothing here is fitted. Where the rms of a law is below the scatter of the data no better law can be told; where
    it is above, something is missing. `microslip` is within the scatter of e_t and spin of alumina on glass and nearest
    of all laws in all that is hard and loses little. Above it are: finite elements on a rigid plane (coupling of unlike
    materials), Louge's constants, where a single pair, polyurethane, puts simpler laws ahead until shear loses as well,
    and soft balls that deform as a whole, to which it is no nearer than others.
    """

    place = 11
    title = "All measured sets"

    def run(self, quick: bool, progress: Progress) -> Outcome:
        rows = [*_alumina(), *_elements(), *_louge(), _balls()]
        progress(1.0)
        limits = [
            Limit(f"{row['set']}: rms of microslip over the larger of scatter and the best other law's", 1.0,
                  row["law"] / max(row["scatter"], row["peer"]))
            for row in rows if row["hard"]
        ]  # fmt: skip
        return Outcome(limits, {"rows": rows})

    def table(self, data: Data) -> Table:
        table = Table("set | quantity | points | microslip, rms | best other law, rms | with losses in shear, rms | "
                      "scatter of the data | where it comes from")  # fmt: skip
        for row in data["rows"]:
            shear = "" if row["lossy"] is None else f"{row['lossy']:.3g}"
            table.add("{set} | {quantity} | {points} | {law:.3g} | {peer:.3g} ({peer_name}) | {shear} | "
                      "{scatter:.3g} | {from}", row, shear=shear)  # fmt: skip
        return table


def _row(name: str, quantity: str, points: int, found: dict[str, float], scatter: float, source: str) -> Data:
    peer = min(OTHERS, key=lambda law: found[law])
    return {"set": name, "quantity": quantity, "points": points, "law": found["microslip"], "peer": found[peer],
            "peer_name": peer, "lossy": found.get(LOSSY), "scatter": scatter, "from": source,
            "hard": name not in SOFT}  # fmt: skip


def _alumina() -> list[Data]:
    """All three digitised figures; where two of them say the same, how far they differ."""
    scatter, rows = alumina.scatter(), []
    for quantity, (name, column) in alumina.TABLES.items():
        table = load(name)
        theta = table["theta_deg"]
        below = theta < alumina.STICKING
        laws = alumina.quantities(alumina.PAIR, theta, with_reference=False)
        found = {law: rms((values[quantity] - table[column])[below]) for law, values in laws.items()}
        source = "from that of e_t" if quantity == "rebound angle" else "from that of the rebound angle"
        rows.append(_row(f"alumina on glass, {quantity}", alumina.UNITS[quantity] or "-", int(below.sum()), found,
                         scatter[quantity], source))  # fmt: skip
    return rows


def _elements() -> list[Data]:
    """Both curves below x = 5.8, in v_out/(mu v_n)."""
    pair = quiet_pair(elements.STEEL, elements.RIGID, elements.FRICTION)
    recoil, spin = load("chungooi5_recoil_fem_wu"), load("chungooi5_spin_fem_wu")
    x, other = recoil["x_incident"], spin["x_incident"]
    both = (x, recoil["y_recoil"]), (other, spin["y_spin"])
    scatter = elements.disagreement(*both, pair.kappa, SPHERE * pair.kappa / 2.0)["partial slip"]
    rows = []
    for name, (at, y) in zip(("recoil", "spin"), both, strict=True):
        part = at < elements.PARTIAL
        laws = rebounds(pair.kappa * at, SPHERE * pair.kappa / 2.0, with_reference=False)
        after = {law: psi_2 / pair.kappa for law, psi_2 in laws.items()}
        wanted = y if name == "recoil" else at + 1.4 * y
        found = {law: rms((values - wanted)[part]) for law, values in after.items()}
        rows.append(_row(f"finite elements, {name}", "v_out/(mu v_n)", int(part.sum()), found, scatter,
                         "from each other"))  # fmt: skip
    return rows


def _louge() -> list[Data]:
    """Louge's beta_0 as standard errors; all, and without the pair that loses most."""
    rows = []
    for name, kept in ((CHART, lambda e: True), ("the same, e > 0.7", lambda e: e > 0.7)):
        found: dict[str, list[float]] = {law: [] for law in [*LAWS, LOSSY]}
        table = load("louge_impact_table")
        for number, pair in enumerate(table.words["pair"]):
            e = float(table["e"][number])
            if kept(e):
                a, b, _ = constants.PAIRS[pair]
                chi = SPHERE * quiet_pair(a, b, 0.1, e).kappa / 2.0
                for law, slope in constants.slopes(chi, e, 60).items():
                    found[law].append((slope - float(table["beta0"][number])) / float(table["beta0_err"][number]))
        rows.append(_row(name, "beta_0 over its error", len(found["microslip"]),
                         {law: rms(np.array(off)) for law, off in found.items()}, 1.0, "as published"))  # fmt: skip
    return rows


def _balls() -> Data:
    """Superballs and golf balls of 2010: distance of e_t from each law's range over the friction they may have."""
    kappa = balls.KAPPAS["2/3 (incompressible)"]
    rows = balls.rows_2010(load("cross2010_balls"))
    found = {}
    for law in [*LAWS, LOSSY]:
        ranges = [balls.extremes(kappa, row["tangent"], row["e_n"], law) for row in rows]
        found[law] = rms(np.array([max(low - row["e_t"], row["e_t"] - high, 0.0)
                                   for row, (low, high) in zip(rows, ranges, strict=True)]))  # fmt: skip
    return _row(BALLS, "e_t", len(rows), found, balls.E_T_ERROR, "as published")
