"""Friction and stiffness ratio from tables of impacts as in the paper, and from published ones."""

import numpy as np

from contactlaw import Calibration, calibrate
from validation import calibration_tables as tables
from validation.case import Case, Data, Limit, Outcome, Table
from validation.cases.alumina_on_glass import PAIR

NAMES = ("friction", "restitution", "stiffness_ratio")
BAND = {"steel": 0.02, "rubber": 0.25}  # of mu as the paper states it, taken as two standard uncertainties
FURTHEST = 3.0  # standard uncertainties that a value may lie from the truth


class CalibrationCase(Case):
    """From 18 impacts, measured as accurately as the paper's, `contactlaw.calibrate` finds friction, restitution and
    stiffness ratio, and the stated uncertainties match the scatter of repeated tables. The synthetic tables come from
    the annulus reference, not from the law that is fitted. Steel: if one sliding impact gives friction to 5 %, as in
    the paper, the table gives it to less than the 2 % that the paper states. Rubber: the stated errors of the angles (7
    % and 5 %) explain half of the stated 25 % in friction at grazing incidence, even for a single impact; the rest was
    scatter of the impacts themselves, as the authors suspected. Alumina on glass: friction agrees with the published
    value and kappa with the elastic constants, but tangential restitution and spin scatter more than an angle error of
    0.1 degrees explains. Tables that do not determine a value are recognised: Cross's single impacts bound friction
    from below and no more.
    """

    place = 17
    title = "Calibration from a table of impacts"

    def run(self, quick: bool) -> Outcome:
        repeats = 12 if quick else 150
        pucks = {table.name: _repeated(table, repeats) for table in (tables.STEEL, tables.RUBBER)}
        mu, kappa = PAIR.friction, PAIR.kappa
        real = {one.name: _as_data(_of(one, kappa), mu, kappa) for one in tables.alumina()}
        single = {one.name: _as_data(_of(one)) for one in tables.balls()}
        data = {"pucks": pucks, "alumina": real, "alumina_kappa": kappa, "balls": single, "repeats": repeats,
                "impacts": len(tables.STEEL.incidences)}  # fmt: skip
        limits = []
        for name, puck in pucks.items():
            limits += [
                Limit(f"{name}: tables with every value within {FURTHEST:g} standard uncertainties", 0.95,
                      puck["within"], at_least=True),
                Limit(f"{name}: scatter of repeated values over their uncertainty, largest", 1.25, max(puck["pull"])),
                Limit(f"{name}: the same, smallest", 0.8, min(puck["pull"]), at_least=True),
                Limit(f"{name}: two standard uncertainties of friction", 100.0 * BAND[name],
                      200.0 * puck["relative"]["friction"], "%"),
            ]  # fmt: skip
        both = real["both"]
        limits += [
            *(Limit(f"alumina on glass: {what}, in standard uncertainties", FURTHEST,
                    np.inf if both[key] is None else both[key])
              for what, key in (("friction from the published one", "off_friction"),
                                ("kappa from that of the elastic constants", "off_stiffness_ratio"))),
            Limit("single impacts of Cross that are given a friction", 0.0,
                  float(sum(one["friction"]["value"] is not None for one in single.values()))),
        ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table("table | impacts | mu | mu from sliding impacts alone | e | kappa | for comparison")
        for name, puck in data["pucks"].items():
            shares = {key: f"{100 * part:.2g} %" for key, part in puck["relative"].items()}
            table.add(
                f"{name} puck, {data['repeats']} synthetic tables: standard uncertainty | {data['impacts']} | "
                "{friction} | {sliding_friction} | {restitution} | {stiffness_ratio} | "
                f"paper: mu to {100 * BAND[name]:.0f} %; here one sliding impact tells mu to "
                f"{200 * puck['single_first']:.0f} to {200 * puck['single_last']:.0f} % (two standard uncertainties); "
                f"2 for 1 + e puts mu off by {100 * puck['two']:.1f} %",
                shares,
            )
        cells = "{friction[text]} | {sliding_friction[text]} | {restitution[text]} | {stiffness_ratio[text]}"
        for name, one in data["alumina"].items():
            table.add(f"alumina on glass, {name} | {{impacts}} | {cells} | mu {PAIR.friction}, "
                      f"kappa {data['alumina_kappa']:.3f} (elastic constants)", one)  # fmt: skip
        for name, one in data["balls"].items():
            table.add(f"{name} | {{impacts}} | {cells}", one)
        return table


def _of(table: tables.Published | tables.PuckTable, kappa: float | None = None, seed: int = 1) -> Calibration:
    """Calibrate one table."""
    if isinstance(table, tables.PuckTable):
        (z1, x1, z2, x2), (s_z1, s_x1, s_z2, s_x2) = table.measured(seed)
        return calibrate((z1, x1), (z2, x2), tables.DISK, normal_error=np.stack([s_z1, s_z2]),
                         tangential_error=np.stack([s_x1, s_x2]))  # fmt: skip
    return calibrate(
        table.before, table.after, tables.SPHERE, normal_error=table.normal_error,
        tangential_error=table.tangential_error, stiffness_ratio=kappa, restitution=table.restitution,
    )  # fmt: skip


def _repeated(table: tables.PuckTable, repeats: int) -> Data:
    """Results of calibrating noisy tables with the same true values."""
    truth = dict(zip(NAMES, (table.friction, table.restitution, table.kappa), strict=True))
    pulls, shares, sliding = [], [], []
    for seed in range(repeats):
        result = _of(table, seed=seed)
        estimates = {name: getattr(result, name) for name in NAMES}
        known = {name: one for name, one in estimates.items() if None not in (one.value, one.uncertainty)}
        pulls.append([(known[name].value - truth[name]) / known[name].uncertainty if name in known else np.inf
                      for name in NAMES])  # fmt: skip
        shares.append([known[name].uncertainty / truth[name] if name in known else np.inf for name in NAMES])
        sliding.append(result.sliding_friction.uncertainty or np.nan)
    z1, x1, z2, x2 = table.true()
    ratio = 1.0 + 1.0 / tables.DISK
    slides = np.array(table.incidences) >= table.kappa * ratio * (1.0 + table.restitution) - table.restitution
    paper = float(np.mean((x1 - x2)[slides] / (2.0 * z1[slides] * ratio)))
    s_z1, s_x1, s_z2, s_x2 = table.noise(table.true())
    one = np.sqrt(s_x1**2 + s_x2**2 + (table.friction * ratio) ** 2 * (s_z1**2 + s_z2**2)) / (ratio * (z1 + z2))
    told = np.isfinite(pulls).all(axis=1)
    return {
        "within": float(np.mean((np.abs(pulls) <= FURTHEST).all(axis=1))),
        "pull": np.std(np.array(pulls)[told], axis=0).tolist(),
        "relative": dict(zip(NAMES, np.median(shares, axis=0).tolist(), strict=True))
        | {"sliding_friction": float(np.nanmedian(sliding)) / table.friction},
        "two": paper / table.friction - 1.0,
        "single_first": float(one[slides][0]) / table.friction,
        "single_last": float(one[slides][-1]) / table.friction,
    }


def _as_data(result: Calibration, friction: float | None = None, kappa: float | None = None) -> Data:
    """A calibration as JSON types."""
    out: Data = {"impacts": len(result.regimes), "verdict": result.verdict, "chi_squared": result.chi_squared}
    for name in (*NAMES, "sliding_friction"):
        one = getattr(result, name)
        out[name] = {"text": str(one), "value": one.value, "uncertainty": one.uncertainty}
    for name, truth in (("friction", friction), ("stiffness_ratio", kappa)):
        one = getattr(result, name)
        if truth is not None:
            out[f"off_{name}"] = abs(one.value - truth) / one.uncertainty if one.value is not None else None
    return out
