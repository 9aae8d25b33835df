"""Common part of Figs. 3 and 5 of Maw, Barber & Fawcett (1981): psi_2 over psi_1 of a puck, and effects of friction.

An experiment gives V_x2/V_z1 over V_x1/V_z1; both become psi when multiplied by kappa/mu. Where the true friction is r
times the one used, a point of the true curve psi_2 = f(psi_1) is recorded r times too far from the origin, on the
curve r f(psi/r). The paper found psi_2 of too small a size in the range of partial stick, and that 20 % more friction
would mend it: r = 1.2.

Restitution below 1 does something of the kind by itself, in two ways: the curve f_e of the law is not f_1, and eq. (6)
of the paper, which takes e = 1, gives from gross slip a friction that is (1 + e)/2 of the true one.
"""

from dataclasses import replace
from itertools import product
from typing import Any, ClassVar

import numpy as np

from contactlaw.collision import Body, Impact, collide
from sims import puck as scene
from sims.puck import SURFACES, Puck
from validation.case import Array, Axes, Case, Data, Limit, Outcome, Table
from validation.reference.annulus import rebound

INCH = 0.0254  # [m]
MORE_FRICTION = 1.2  # what the paper says would restore the measured psi_2
FACTORS = np.linspace(0.8, 1.5, 1401)  # of friction, tried
ENGINES = {"mujoco": ("MuJoCo", "^"), "pybullet": ("PyBullet", "s")}


def thrown(puck: Puck, steps: int = 400) -> Impact:
    """The throw without an engine: `contactlaw.collide` with the law, the material and the motion of the puck."""
    velocity, spin = puck.start_motion
    body = Body(puck.mass, puck.radius, puck.inertia, velocity, (0.0, 0.0, spin))
    return collide(puck.pair, body, normal=puck.normal, steps=steps)


def sized(puck: Puck, diameter: float) -> Puck:
    """The same throw of a puck of another diameter [m]."""
    return replace(puck, radius=0.5 * diameter)


def recorded(psi: Array, curve: Array, factor: float) -> Array:
    """The curve psi_2 over psi, both shape (n,), as recorded where friction is a factor above the one used."""
    return factor * np.interp(psi / factor, psi, curve)


def friction_factor(psi: Array, measured: Array, wanted: Array, upper: float) -> tuple[float, float]:
    """By which factor friction must be raised to bring one curve nearest to another, and the rms of what is left.

    psi: incidences of both curves, rising, well beyond `upper`, up to which the misfit is taken.
    """
    inside = psi <= upper
    rms = [float(np.sqrt(np.mean((recorded(psi, measured, 1.0 / factor) - wanted)[inside] ** 2))) for factor in FACTORS]
    best = int(np.argmin(rms))
    return float(FACTORS[best]), rms[best]


class ReboundFigure(Case):
    """psi_2 over psi_1 for a puck; a subclass says of which material."""

    material: ClassVar[str]
    tolerance: ClassVar[float]
    """What the paper says of the accuracy of its mu, relative."""
    diameters: ClassVar[dict[str, float]]
    speeds: ClassVar[tuple[float, float]]
    span: ClassVar[float]
    incidences: ClassVar[list[float]]
    """psi_1 of the throws."""
    sheet = {"width": 6.4, "height": 4.8}  # noqa: RUF012

    def run(self, quick: bool) -> Outcome:
        """Curves by the annuli, throws by the law alone and in both engines."""
        restitution = SURFACES[self.material].restitution
        base = Puck(material=self.material)
        psi = np.linspace(0.0, 1.4 * self.span, 281)
        annuli = 20 if quick else 40
        elastic, damped = (np.asarray(rebound(psi, base.chi, annuli, restitution=e)) for e in (1.0, restitution))
        incidences = self.incidences[::3] if quick else self.incidences
        throws, problems = self._throws(incidences, base)
        reference, reference_elastic = (
            [scene.reference(round(psi_1, 12), base.chi, e) for psi_1 in incidences] for e in (restitution, 1.0)
        )
        everything = np.array(list(throws.values()))
        spread = everything.max(axis=(0, 2)) - everything.min(axis=(0, 2))
        collapse = float(spread.max())
        error = float(np.abs(everything - np.array(reference)[None, :, None]).max())
        data = {
            "material": self.material, "chi": base.chi, "mu": base.pair.friction, "restitution": restitution,
            "psi": psi, "elastic": elastic, "damped": damped, "incidences": incidences, "reference": reference,
            "reference_elastic": reference_elastic,
            "throws": throws, "throws_each": everything.shape[2], "spread": spread,
            "friction": self._friction(psi, elastic, damped, base.chi, restitution),
        }  # fmt: skip
        limits = [
            Limit(f"spread of psi_2 over {'pucks, ' * (len(self.diameters) > 1)}speeds and routes", 1e-2, collapse),
            Limit("the same, stricter target", 2e-3, collapse),
            Limit("largest error in psi_2 of any throw", 4e-3, error),
            Limit("friction that restitution explains with eq. (6), of the 20 % that the paper misses", 0.1,
                  abs(data["friction"]["with_equation_6"] - 1.0) / (MORE_FRICTION - 1.0)),
        ]  # fmt: skip
        return Outcome(limits, data, problems)

    def _throws(self, incidences: list[float], base: Puck) -> tuple[dict[str, Any], list[str]]:
        """psi_2 by route, shape (incidences, throws), over sizes, speeds and ways to launch; and what is not sane."""
        found: dict[str, list[list[float]]] = {"microslip": [], **{name: [] for name in ENGINES}}
        problems = []
        for psi_1 in incidences:
            pucks = [sized(replace(base, psi_1=psi_1, speed=speed, launch=launch), diameter)
                     for diameter, speed, launch
                     in product(self.diameters.values(), self.speeds, scene.LAUNCHES)]  # fmt: skip
            found["microslip"].append([thrown(puck).psi_2 for puck in pucks])
            for engine in ENGINES:
                results = [scene.run(puck, engine) for puck in pucks]
                found[engine].append([result.psi2 for result in results])
                grown = max(result.energy_ratio for result in results)
                if grown > 1.001:
                    problems.append(f"{engine}, psi_1 = {psi_1:g}: energy grown to {grown:.4f}")
        return found, problems

    def _friction(self, psi: Array, elastic: Array, damped: Array, chi: float, restitution: float) -> Data:
        """How much of the 20 % restitution explains, over all partial stick."""
        by_equation_6 = 2.0 / (1.0 + restitution)
        upper = 4.0 * chi - 1.0
        factor, left = friction_factor(psi, damped, elastic, upper)
        return {
            "mu_corrected": SURFACES[self.material].friction * by_equation_6,
            "upper": upper, "factor": factor, "rms_left": left, "with_equation_6": factor * by_equation_6,
            "rms_before": float(np.sqrt(np.mean((damped - elastic)[psi <= upper] ** 2))),
        }  # fmt: skip

    def table(self, data: Data) -> Table:
        """A row an incidence; then what of the 20 % restitution explains."""
        table = Table(f"psi_1 | annuli, e = 1 | annuli, e = {data['restitution']:g} | law alone | MuJoCo | PyBullet | "
                      f"spread of {3 * data['throws_each']} throws")  # fmt: skip
        columns = (data[key] for key in ("incidences", "reference_elastic", "reference", "spread"))
        for number, (psi_1, elastic, damped, spread) in enumerate(zip(*columns, strict=True)):
            means = " | ".join(f"{np.mean(found[number]):.4f}" for found in data["throws"].values())
            table.add(f"{psi_1:g} | {elastic:.4f} | {damped:.4f} | {means} | {spread:.1e}")
        table.add("all partial stick (psi_1 <= {upper:.2f}) | mu factor that maps e = {e:g} on e = 1 | {factor:.3f} | "
                  "and eq. (6) with e: {with_equation_6:.3f} | | | rms {rms_before:.3f} -> {rms_left:.3f}",
                  data["friction"], e=data["restitution"])  # fmt: skip
        table.add("mu | {mu:g} by the paper | {friction[mu_corrected]:.4f} by eq. (6) with (1 + e) for 2", data)
        return table

    def draw(self, data: Data, axes: Axes) -> None:
        """The paper's figure."""
        psi, elastic = np.array(data["psi"]), np.array(data["elastic"])
        axes.fill_between(
            psi, elastic, recorded(psi, elastic, MORE_FRICTION), facecolor="#e6e6e6", edgecolor="#aaaaaa", hatch="///",
            linewidth=0.0, label=r"$\mu$ up to 20 % too low",
        )  # fmt: skip
        low, high = (recorded(psi, elastic, 1.0 + sign * self.tolerance) for sign in (-1.0, 1.0))
        axes.fill_between(psi, low, high, color="#0072b2", alpha=0.30, linewidth=0.0,
                          label=rf"$\mu$ $\pm${100 * self.tolerance:.0f} %")  # fmt: skip
        axes.plot(psi, np.maximum(psi - 4.0 * data["chi"], 0.0), color="black", linewidth=2.2, linestyle=(0, (5, 3)),
                  label="rigid theory")  # fmt: skip
        axes.plot(psi, elastic, color="black", linewidth=1.6, label="annuli, e = 1")
        axes.plot(psi, data["damped"], color="#c44e00", linestyle="-.", label=f"annuli, e = {data['restitution']:g}")
        styles = {"microslip": ("microslip law", "o", 4.5)} | {name: (*one, 8.0) for name, one in ENGINES.items()}
        for name, found in data["throws"].items():
            label, marker, size = styles[name]
            axes.plot(data["incidences"], np.mean(found, axis=1), marker, color="#c44e00", markersize=size,
                      fillstyle="full" if name == "microslip" else "none",
                      label=f"{label}, e = {data['restitution']:g}")  # fmt: skip
        axes.set(xlabel=r"incidence $\psi_1$ [-]", ylabel=r"reflection $\psi_2$ [-]", xlim=(0.0, self.span),
                 ylim=(-2.0, 2.6), title=f"{data['material']} puck, $\\chi$ = {data['chi']:.3f}")  # fmt: skip
        axes.legend(loc="upper left", fontsize=8)
