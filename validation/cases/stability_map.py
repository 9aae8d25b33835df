"""Anything that may be asked of the law: soft and stiff, slow and fast, coarse and fine steps; nothing may blow up."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

import warnings
from itertools import pairwise
from math import inf, isfinite, isnan, nan, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contactlaw import ContactPair, Material
from validation.ball import half_step
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.picture import panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

RADIUS, DENSITY = 0.01, 7800.0  # [m], [kg/m^3]
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY  # [kg]
DURATIONS = np.arange(-3.0, 3.1, 0.5)  # edges, log10 of contact duration over engine step
MODULI = np.arange(3.0, 12.1, 1.0)  # edges, log10 of E / Pa
RESTITUTIONS = [1.0, 0.5, 0.05]
GAIN = 1e-3
DEEPEST = 0.1  # overlap over radius
LIVELY = 3.0  # what a light ball between two heavy ones may gain in speed
ACCELERATION = 1e10  # [m/s^2] or [rad/s^2]; more, and MuJoCo resets the state
REFUSED = "beyond the engine's range"
FLIGHTS = 8
LOOKS = 60


@register
class StabilityMap(Case):
    """Bounces with random properties in every cell of a map."""

    name = "stability_map"
    place = 47
    title = "Where it is stable"
    claim = (
        "Whatever is asked, contacts a thousand times shorter or longer than the engine's step, moduli from 1 kPa to "
        "1 TPa, friction up to 10, mass ratios up to a million, 0.1 mm/s to 100 m/s, restitution from 1 to 0.05, no "
        "state ever is not finite and no bouncing gains more than 0.1 % of energy, however far the balls go in a step."
    )
    caption = (
        "Largest gain of energy in a cell, log10 (white: less than 1e-7, or nothing); a cross marks a cell with a run "
        "that fails. Each cell holds a ball on a floor, and a ball on a second one of another mass on a floor, with "
        "friction, Poisson's ratio, speed, spin, heading and restitution at random."
    )
    needs = ("mujoco",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every cell."""
        count = 1 if quick else 5
        shape = (len(MODULI) - 1, len(DURATIONS) - 1)
        gain, runs, skipped, refused = np.full(shape, -inf), 0, 0, 0
        failures: list[Data] = []
        kinds: dict[str, float] = {}
        for cell in np.ndindex(shape):
            for number in range(2 * count):
                one = sample(cell, number)
                if one is None:
                    skipped += 1
                    continue
                grown, problem = bounce(one)
                if problem == REFUSED:
                    refused += 1
                    continue
                runs += 1
                label = f"{'ball on ball on floor' if number % 2 else 'ball on floor'}, e = {one['restitution']:g}"
                grown = inf if isnan(grown) else max(grown, -1.0)
                kinds[label] = max(kinds.get(label, -1.0), grown)
                gain[cell] = max(gain[cell], grown)
                if problem or grown > GAIN:
                    failures.append({"cell": list(cell), "number": number, "gain": grown if isfinite(grown) else None,
                                     "problem": problem or "energy gained", **one})  # fmt: skip
            progress((cell[0] * shape[1] + cell[1] + 1) / (shape[0] * shape[1]))
        data = {
            "runs": runs, "skipped": skipped, "refused": refused, "durations": DURATIONS, "moduli": MODULI,
            "gain": np.clip(gain, -1.0, 1e300), "failures": failures[:40],
            "failed": len(failures), "kinds": dict(sorted(kinds.items())),
        }  # fmt: skip
        infinite = sum(one["problem"] == "not finite" for one in failures)
        limits = [
            Limit("runs that are not finite", 0.0, float(infinite)),
            Limit("runs that gain more than 0.1 % of energy", 0.0, float(len(failures) - infinite)),
        ]
        return Outcome(limits, data, [_named(one) for one in failures if one["problem"] == "not finite"])

    def table(self, data: Data) -> Table:
        """What was run, and every cell that fails."""
        table = Table(["scene", "largest gain of energy"])
        for kind, gain in data["kinds"].items():
            table.rows.append([kind, f"{gain:.1e}"])
        table.rows.append(["runs", str(data["runs"])])
        table.rows.append(["skipped: contact too deep at any speed", str(data["skipped"])])
        table.rows.append(["skipped: accelerations beyond 1e10, which MuJoCo resets", str(data["refused"])])
        for one in data["failures"]:
            table.rows.append([f"FAILS: {_named(one)}", nan_or(one["gain"])])
        return table

    def draw(self, data: Data) -> Figure:
        """The map."""
        figure, (axes,) = panels(1, width=6.5)
        gain = np.log10(np.clip(np.array(data["gain"]), 1e-7, 1.0))
        edges = [10.0 ** np.array(data[key]) for key in ("durations", "moduli")]
        mesh = axes.pcolormesh(*edges, gain, cmap="Greys",
                               vmin=-7.0, vmax=-1.0, edgecolor="#bbbbbb", linewidth=0.3)  # fmt: skip
        for one in data["failures"]:
            row, column = one["cell"]
            middle = 10.0 ** (data["durations"][column] + 0.25), 10.0 ** (data["moduli"][row] + 0.5)
            axes.plot(*middle, "x", color="white", markersize=11, markeredgewidth=4)
            axes.plot(*middle, "x", color="black", markersize=9, markeredgewidth=1.5)
        axes.set(xscale="log", yscale="log", xlabel="contact duration over engine step [-]",
                 ylabel="Young's modulus [Pa]")  # fmt: skip
        axes.grid(visible=False)
        bar = figure.colorbar(mesh, ax=axes)
        bar.set_label("log10 of the largest gain of energy [-]")
        return figure


def sample(cell: tuple[int, ...], number: int) -> Data | None:
    """What a run is made of; None where no speed in the range keeps the contact small."""
    random = np.random.default_rng([*cell, number])
    (low, high), (short, long) = list(pairwise(MODULI))[cell[0]], list(pairwise(DURATIONS))[cell[1]]
    one: Data = {
        "modulus": float(10.0 ** random.uniform(low, high)),
        "poisson": float(random.uniform(0.01, 0.4999)),
        "friction": float(0.0 if random.uniform() < 0.1 else 10.0 ** random.uniform(-3.0, 1.0)),
        "restitution": RESTITUTIONS[int(random.integers(len(RESTITUTIONS)))],
        "ratio": float(10.0 ** random.uniform(-6.0, 6.0)) if number % 2 else 0.0,
        "seed": [*cell, number],
    }
    pair, heavy = pair_of(one), MASS * max(1.0, one["ratio"])
    unit = pair.greatest_overlap(heavy, LIVELY) / RADIUS  # at 1 m/s; grows with the power 4/5 of speed
    fastest = np.log10((0.4 * DEEPEST / unit) ** 1.25)
    if fastest < -4.0:
        return None
    one["speed"] = float(10.0 ** random.uniform(-4.0, min(2.0, fastest)))
    mass = MASS * min(1.0, one["ratio"] or 1.0)
    duration = pair.contact_duration(mass, one["speed"])
    one["step"] = float(duration / 10.0 ** random.uniform(short, long))
    one["flight"] = float(random.uniform(2.0, 6.0) * max(duration, one["step"]))
    return one


def pair_of(one: Data) -> ContactPair:
    """The contact of a run."""
    material = Material(one["modulus"], one["poisson"], DENSITY)
    return ContactPair(material, material, one["friction"], one["restitution"], radius=RADIUS)


def bounce(one: Data) -> tuple[float, str]:
    """Largest gain of energy at any look with no contact open, over the first energy; and what is wrong, "" if nothing.

    Gravity is such that a flight at the run's speed takes as long as sampled.
    """
    import mujoco

    from contactlaw.mujoco_plugin import add_contact, contacts_of

    random = np.random.default_rng([*one["seed"], 1])
    gravity = 2.0 * one["speed"] / one["flight"]
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = one["step"], [0.0, 0.0, -gravity]
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1])
    lean = random.uniform(-0.5, 0.5, 2)
    gap = random.uniform(0.1, 1.0) * one["speed"] * one["step"]
    top = np.array([*lean, 1.0]) / np.linalg.norm([*lean, 1.0]) * (2.0 * RADIUS + gap)
    place = np.array([0.0, 0.0, RADIUS + gap])
    names = []
    masses = [MASS, MASS * one["ratio"]] if one["ratio"] else [MASS]
    for number, mass in enumerate(masses[::-1]):
        body = spec.worldbody.add_body(pos=place + number * top)
        body.add_freejoint()
        names.append(f"ball{number}")
        body.add_geom(name=names[-1], size=[RADIUS, 0.0, 0.0], mass=mass)
    spec.compile()  # bodies are numbered
    name = add_contact(spec, names, [*names, "floor"], pair_of(one), others=False)
    model = spec.compile()
    data = mujoco.MjData(model)
    inertia = model.body_inertia[1:].ravel()
    mass = model.body_mass[1:]
    speeds = data.qvel.reshape(-1, 2, 3)
    speeds[:, 0] = one["speed"] * random.uniform(-1.0, 1.0, (len(mass), 3))
    speeds[:, 0, 2] = -one["speed"]
    speeds[:, 1] = one["speed"] / RADIUS * random.uniform(-1.0, 1.0, (len(mass), 3))

    def energy() -> float:
        linear = speeds[:, 0] + half_step(model)
        kinetic = 0.5 * mass @ (linear**2).sum(axis=1) + 0.5 * inertia @ speeds[:, 1].ravel() ** 2
        return float(kinetic + gravity * mass @ (data.qpos.reshape(-1, 7)[:, 2] - RADIUS))

    first, worst = energy(), -inf
    steps = FLIGHTS * one["flight"] / one["step"]
    steps = min(steps, max(200.0, 0.3 * steps))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(min(LOOKS, int(steps))):
            fastest = max(float(np.abs(data.qvel).max()), one["speed"] / RADIUS)
            mujoco.mj_step(model, data, max(1, int(steps / LOOKS)))
            if data.warning.number.any():
                return nan, REFUSED if fastest / one["step"] > 0.01 * ACCELERATION else "not finite"
            if not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
                return nan, "not finite"
            if not contacts_of(model, data, name):
                worst = max(worst, energy() / first - 1.0)
    return worst, ""


def nan_or(value: float | None) -> str:
    """A gain as text."""
    return "not finite" if value is None else f"{value:.1e}"


def _named(one: Data) -> str:
    facts = ("modulus", "poisson", "friction", "restitution", "ratio", "speed", "step")
    return f"{one['problem']}, cell {one['cell']} run {one['number']}: " + ", ".join(f"{k} {one[k]:.3g}" for k in facts)
