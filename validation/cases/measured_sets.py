"""Every measured set in one table: this law unfitted, the best other law unfitted, the scatter of the data."""

from contactlaw import LAWS
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register, told
from validation.cases import alumina_on_glass as alumina
from validation.cases import finite_elements as elements
from validation.cases import rebound_constants as constants
from validation.cases import superball_and_golf as balls
from validation.measured import load
from validation.prediction import rms

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
        kinds = (alumina.AluminaOnGlass, elements.FiniteElements, constants.ReboundConstants)
        glass, steel, louge = (kind().run(quick, lambda part: None).data for kind in told(kinds, progress))
        rows = [*_alumina(glass), *_elements(steel), *_louge(louge), _balls()]
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


def _alumina(data: Data) -> list[Data]:
    """All three digitised figures; where two of them say the same, how far they differ."""
    scatter = alumina.scatter()
    return [_row(f"alumina on glass, {quantity}", alumina.UNITS[quantity] or "-", data["shown"][quantity]["points"][0],
                 found["below"], scatter[quantity],
                 "from that of e_t" if quantity == "rebound angle" else "from that of the rebound angle")
            for quantity, found in data["rms"].items()]  # fmt: skip


def _elements(data: Data) -> list[Data]:
    """Both curves below x = 5.8, in v_out/(mu v_n)."""
    part, rows = "partial slip", []
    for (name, found), scale in zip(data["rms"].items(), (1.0, 1.4), strict=True):
        rows.append(_row(f"finite elements, {name}", "v_out/(mu v_n)", data["shown"][name]["points"][part],
                         {law: scale * one for law, one in found[part].items()}, data["curves_disagree"][part],
                         "from each other"))  # fmt: skip
    return rows


def _louge(data: Data) -> list[Data]:
    """Louge's beta_0 as standard errors; all, and without the pair that loses most."""
    rows = []
    for name, least in ((CHART, 0.0), ("the same, e > 0.7", 0.7)):
        own = [row for row in data["rows"] if row["e"] > least]
        found = {law: rms([(row["slope"][law] - row["beta_0"]) / row["error"] for row in own])
                 for law in own[0]["slope"]}  # fmt: skip
        rows.append(_row(name, "beta_0 over its error", len(own), found, 1.0, "as published"))
    return rows


def _balls() -> Data:
    """Superballs and golf balls of 2010: distance of e_t from each law's range over the friction they may have."""
    kappa = balls.KAPPAS["2/3 (incompressible)"]
    rows = balls.rows_2010(load("cross2010_balls"))
    found = {}
    for law in [*LAWS, LOSSY]:
        ranges = [balls.extremes(kappa, row["tangent"], row["e_n"], law) for row in rows]
        found[law] = rms([max(low - row["e_t"], row["e_t"] - high, 0.0)
                          for row, (low, high) in zip(rows, ranges, strict=True)])  # fmt: skip
    return _row(BALLS, "e_t", len(rows), found, balls.E_T_ERROR, "as published")
