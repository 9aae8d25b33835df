"""Slides that change direction: force, loss, rebound, cost and energy balance of the laws."""

from functools import partial
from time import process_time
from typing import Any

import numpy as np

from contactlaw.laws.microslip import Microslip
from contactlaw.turning import MicroslipTurning
from validation import ledger, spinning, turning
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.measure import interleaved, spread
from validation.picture import BROAD, legend_below
from validation.reference.turning_data import load
from validation.reference.turning_paths import MARKS

LAWS: dict[str, Any] = {"turning": MicroslipTurning(), "springs": "microslip"}
SPINS, HEADINGS = [0.05, 0.1, 0.18, 0.3], [0.0, 0.7, 2.3]  # sigma; [rad]
SHOWN = [("circle", 0.8), ("eight", 0.8)]
LASTING = "circle, touch to release"  # no turn of it is like another
CYCLES = [(4, 1, True), (6, 1, True), (5, 16, False)]  # corners, steps from one to the next, load and place in turn


class Turning(Case):
    """Where a slide changes direction, `MicroslipTurning` applies the friction limit on the surface of the contact, not
    on its line of springs. Force, loss per turn and rebound then agree with those of rings with local Coulomb friction,
    at some five times the cost of a straight step; a straight slide costs nothing extra. The default law follows an
    impact that spins about its normal, on rings divided into sectors, as the grid solver does. On no path, and at no
    step size, does it give energy back beyond the errors below. The same holds for the springs of contacts that hardly
    spin or that persist.
    """

    place = 24
    title = "Slides that turn"
    sheet = {"columns": 2}
    caption = (
        "Force along the motion at constant load: out from the centre and round a circle (left), and along a figure "
        "of eight (right), with amplitudes of 0.8 of the displacement at which everything slips."
    )

    def run(self, quick: bool) -> Outcome:
        saved = load()
        paths = {name: _paths(saved["forces"], law) for name, law in LAWS.items()}
        impacts = {name: _impacts(saved["uneven"], law) for name, law in LAWS.items()}
        energy = _energy(1000 if quick else 20_000)
        spun = {way: spinning.most_given(way, 400 if quick else 20_000) for way in spinning.WAYS}
        rng = np.random.default_rng(5)
        cycles = max(spinning.worst_cycle("sectors", rng, *kind, looks=300)
                     for kind in CYCLES for _ in range(2 if quick else 10))  # fmt: skip
        cost = _cost(saved["uneven"], 9 if quick else 41)
        spin = {f"{s:g}": _spin(saved["spinning"], s) for s in SPINS}
        own, load_changes = paths["turning"], max(energy[kind] for kind in ledger.KINDS[1:])
        data: Data = {
            "paths": paths, "impacts": impacts, "energy": energy, "cost": cost, "spin": spin, "spun": spun,
            "cycles": cycles,
            "shown": {f"{name}, {amplitude}": _shown(saved["forces"], name, amplitude) for name, amplitude in SHOWN},
        }  # fmt: skip
        limits = [
            Limit("force along 36 paths that turn, F/(mu P)", 0.02, max(one["force"] for one in own)),
            Limit("loss a turn, amplitude from 0.2", 0.03, max(abs(one["loss"] or 0.0) for one in own)),
            Limit("psi_2, tangential masses 3:1", 5e-3, impacts["turning"]),
            Limit("psi_2 of impacts with spin about the normal, sigma to 0.3, default law", 5e-3, max(spin.values())),
            Limit("energy given back at constant load, over mu P and path", 1e-12, energy["steady"]),
            Limit("the same as the load changes, load and place in turn", 1e-12, load_changes),
            Limit("the same at once, 16 steps a leg, over what the mean of Coulomb's own force misses", 1.0,
                  energy["together"] / energy["coulomb"]),
            Limit("energy given back on 100,000 paths that turn, spin and open, in sectors", 1e-13,
                  max(spun["sectors"][kind] for kind in ledger.KINDS)),
            Limit("the same, load and place changed at once, 16 steps a leg", 1e-4, spun["sectors"]["together"]),
            Limit("energy given back at constant load, springs with torsion", 1e-13, spun["springs"]["steady"]),
            Limit("the same as the load changes, load and place in turn", 1e-13,
                  max(spun["springs"][kind] for kind in ledger.KINDS[1:])),
            Limit("energy given back by the most generous cycle found, in sectors", 1e-13, cycles),
            Limit("force over its limit, less 1", 1e-12, max(energy["cone"], *(one["cone"] for one in spun.values()))),
            Limit("time of a contact's substep that turns over a straight one", 6.0, cost["turning"]["median"]),
            Limit("straight substep over one that never looks", 1.02, cost["straight"]["median"]),
        ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table("path | error of the force | the same, springs | error of the loss | the same, springs")
        for path in dict.fromkeys(one["path"] for one in data["paths"]["turning"]):
            own, other = ([one for one in data["paths"][law] if one["path"] == path] for law in LAWS)
            force, loss = (
                [max(abs(one[key] or 0.0) for one in ran) for ran in (own, other)] for key in ("force", "loss")
            )
            table.add(f"{path} | {force[0]:.4f} | {force[1]:.4f} | {loss[0]:.1%} | {loss[1]:.1%}")
        return table

    def draw(self, data: Data, *axes: Axes) -> None:
        styles = {
            "rings": BROAD, "springs": {"color": "black", "linestyle": (0, (2, 2)), "linewidth": 1.0},
            "turning": {"color": "black", "linewidth": 1.0, "marker": "o", "markevery": 4, "markersize": 3.0},
        }  # fmt: skip
        labels = {"rings": "rings (reference)", "springs": "springs (microslip)", "turning": "MicroslipTurning"}
        for one, (name, shown) in zip(axes, data["shown"].items(), strict=True):
            for key, style in styles.items():
                one.plot(np.arange(len(shown[key])) / MARKS, shown[key], label=labels[key], **style)
            one.set(xlabel="turns [-]", ylabel=r"force along the motion, over $\mu P$ [-]", title=name)
        legend_below(axes[0], 3)


def _paths(saved: list[Data], law: Any) -> list[Data]:
    """Largest error of the force and, of paths that turn on, of the loss, over the rings'."""
    rows = []
    for one in saved:
        known, force = np.array(one["force"]), turning.forces(law, one["path"], one["amplitude"])
        named = one["path"], one["amplitude"]
        ratio = None if one["path"] == LASTING else turning.loss(force, *named) / turning.loss(known, *named) - 1.0
        rows.append({"path": one["path"], "amplitude": one["amplitude"], "force": float(np.abs(force - known).max()),
                     "loss": ratio})  # fmt: skip
    return rows


def _impacts(rows: list[Any], law: Any) -> float:
    """Largest error in psi_2, of both directions."""
    world, bodies = turning.impacts_world(rows, law)
    world.step(3)
    return float(np.abs(turning.psi_2(world, bodies) - np.array(rows)[:, 4:6]).max())


def _spin(rows: list[Any], sigma: float) -> float:
    """Largest error in psi_2 of the default law, for psi_1 from 0.2 to 5, nu = 0 and 0.28, sliding three ways."""
    own = [row for row in rows if row[3] == sigma]
    return float(max(np.abs(turning.spun_errors(own, heading)).max() for heading in HEADINGS))


def _energy(count: int) -> dict[str, float]:
    """Largest energy given back on random paths by either law, by kind of load; largest excess of force over its limit.

    "together": where load and place change at once, and the same of Coulomb's own force ("coulomb"), which stores
    nothing: what its mean force misses of the work.
    """
    own, springs, coulomb = (spinning.most_given(law, count, 17, spins=False) for law in (*LAWS.values(), "coulomb"))
    found = {kind: max(own[kind], springs[kind]) for kind in (*ledger.KINDS, "cone")}
    return found | {"together": own["together"], "coulomb": coulomb["together"]}


def _cost(rows: list[Any], rounds: int) -> dict[str, dict[str, float]]:
    """Ratios of processor times, side by side: impacts in a world that turn and that do not, the law with and without
    its look, and the law alone."""
    straight, worlds = [[*row[:3], 0.0] for row in rows], {}
    scenes = {"turning": (rows, LAWS["turning"]), "straight": (straight, LAWS["turning"]),
              "never looks": (straight, Microslip(MicroslipTurning.nodes))}  # fmt: skip
    angle = np.linspace(0.0, 3.0 * np.pi, 145)
    around = np.tile(0.6 * np.stack([1.0 - np.cos(angle[1:]), np.sin(angle[1:])], 1), (20, 1))
    lines = {"circle": around, "line": around * [0.0, 1.0]}

    def prepare(name: str) -> None:
        worlds[name], _ = turning.impacts_world(*scenes[name])
        _ = worlds[name].arrays  # are made when first asked for

    runs: Data = {name: lambda name=name: worlds[name].step(3) for name in scenes}
    runs |= {name: partial(ledger.dissipated, LAWS["turning"], np.ones(len(around)), lines[name]) for name in lines}
    times = interleaved(runs, rounds, {name: partial(prepare, name) for name in scenes}, clock=process_time)
    pairs = {"turning": ("turning", "straight"), "straight": ("straight", "never looks"),
             "law alone": ("circle", "line")}  # fmt: skip
    return {name: spread(times[one] / times[other]) for name, (one, other) in pairs.items()}


def _shown(saved: list[Data], name: str, amplitude: float) -> dict[str, list[float]]:
    """Force along the motion over mu P at the marks but for the last, where the motion's direction has one side."""
    (known,) = [one["force"] for one in saved if one["path"] == name and one["amplitude"] == amplitude]
    along = np.gradient(turning.path(name, amplitude)[1], axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    found = {"rings": known} | {key: turning.forces(law, name, amplitude) for key, law in LAWS.items()}
    return {key: (np.array(force) * along).sum(axis=1)[:-1].tolist() for key, force in found.items()}
