"""Models of other packages with the law for all contacts: stability, and cost of a step.

The packages require different versions of MuJoCo. `validation.census` runs their models where they are installed, and
saves the results in validation/data/census.json, which this case reports.
"""

import json
from pathlib import Path
from statistics import median

from validation.case import Case, Data, Limit, Outcome, Table

FOUND = Path(__file__).parents[1] / "data" / "census.json"
HANDLED = FOUND.with_name("handling.json")  # by `validation.handling`
COST, WORST = 1.5, 3.0  # over the engine's own contact
GAIN = 1e-2  # of the weight times 1 m
WAYS = "law", "native"
CHANCE = 0.01  # that a model is said to be unstable more often than natively and is not
SUNK, CREPT, LIFT = 1e-3, 1e-5, 0.2  # [m] of a cube of 2 kg on four corners; in 10 s and in a minute; asked
PALM = 0.04  # [m], height below which the package's own environment takes its block for dropped
SLIP, RAISED = 5e-5, 0.1  # [m] in 10 s; asked


def by_chance(often: Data | None) -> float:
    """Chance that as many of the unstable runs or more are the law's, were both ways alike: Fisher's exact test."""
    from scipy.stats import hypergeom

    if not often:  # not finished
        return 0.0
    bad, runs = (often["law"][key] + often["native"][key] for key in ("bad", "runs"))
    return float(hypergeom.sf(often["law"]["bad"] - 1, runs, bad, often["law"]["runs"]))


class Models(Case):
    """Models of other packages, loaded with `load_model(file, [("*", "*", rubber_on_steel)])`, run with random actions
    for up to 10 s, as far as the processor time allows, and then fall passively for 2 s. The cost of a step is its
    processor time over that with the engine's own contact, both measured in turn. The energy gained is the largest
    during the fall less that at its start, over the weight times 1 m. Files that hold no whole model are not counted. A
    model that becomes unstable is run again with further seeds, 60 natively and up to 10 with the law; it counts as
    missed if the law's share is larger than chance allows one time in a hundred. robosuite's spot_arm, undamped and
    driven by torques, is such a model: it also becomes unstable natively, though not with the first seed. Four further
    scenes use their robots for what they are made for, steel on steel; `validation.handling` sets them up.
    """

    title = "Whole models of other packages"
    place = 61

    def run(self, quick: bool) -> Outcome:
        found = json.loads(FOUND.read_text())
        rows = found["rows"]
        ran = [row for row in rows if "failed" not in row]
        costs = [row["cost"] for row in ran]
        gains = [row["law"]["gain"] - max(row["native"]["gain"], 0.0) for row in ran]
        shaken = [row for row in ran if row["law"]["unstable"] and by_chance(row.get("often")) < CHANCE]
        limits = [
            Limit("cost over the engine's own contact, median", COST, median(costs)),
            Limit("cost over the engine's own contact, worst", WORST, max(costs)),
            Limit("models unstable more often than natively", 0.0, float(len(shaken))),
            Limit("models refused, or not finished in the time given", 0.0, float(len(rows) - len(ran))),
            Limit("files of the five packages not examined", 0.0, float(sum(found["left"].values()))),
            Limit("energy gained in a fall beyond the native model's", GAIN, max(gains)),
        ]
        scenes = json.loads(HANDLED.read_text())
        pushed, held, hand, lift = (scenes[name]["by_law"] for name in ("pushed", "held", "hand", "lift"))
        limits += [
            Limit("FetchPush: the cube at rest lies in the table [m]", SUNK, abs(pushed["sunk"])),
            Limit("FetchPush: creeps in 10 s once it has been pushed [m]", CREPT, pushed["crept"]),
            Limit("FetchPickAndPlace: lifted by less than asked [m]", 0.1 * LIFT, LIFT - held["lifted"]),
            Limit("FetchPickAndPlace: creeps in the fingers in a minute [m]", CREPT, held["crept"]),
            Limit("Shadow hand: the block lies below the palm after 10 s [m]", 0.0, max(PALM - hand["height"], 0.0)),
            Limit("Shadow hand: energy that the block gains", GAIN, hand["gain"]),
            Limit("robosuite's Lift: lifted by less than asked [m]", 0.1 * RAISED, RAISED - lift["lifted"]),
            Limit("robosuite's Lift: slips in the fingers in 10 s [m]", SLIP, lift["crept"]),
            Limit(
                "cost of these four scenes over the engine's own contact, worst", WORST,
                max(one["by_law"]["us"] / one["natively"]["us"] for one in scenes.values()),
            ),
        ]  # fmt: skip
        return Outcome(limits, found)

    def table(self, data: Data) -> Table:
        table = Table("package | models | native step [us] | cost, median | cost, largest | of the model | "
                      "largest gain, law / native | became unstable, law / native, or failed")  # fmt: skip
        for package in dict.fromkeys(row["package"] for row in data["rows"]):
            rows = [row for row in data["rows"] if row["package"] == package]
            own = [row for row in rows if "cost" in row]
            costs, gains = [row["cost"] for row in own], [max(row[way]["gain"] for row in own) for way in WAYS]
            bad = [f"{row['name']}: {' / '.join('{bad} of {runs}'.format_map(row['often'][way]) for way in WAYS)}"
                   for row in own if row.get("often")]  # fmt: skip
            bad += [f"{row['name']}: {row['failed']}" for row in rows if "failed" in row]
            if not own:
                table.add(f"{package} | 0 | | | | | | {'; '.join(bad)}")
                continue
            table.add(
                f"{{versions}} | {len(own)} | {median(row['native']['us'] for row in own):.0f} | {median(costs):.2f} | "
                f"{max(costs):.3g} | {{name}} | {gains[0]:.1e} / {gains[1]:.1e} | {'; '.join(bad)}",
                own[costs.index(max(costs))],
            )
        return table
