"""All laws against published finite elements of an elastic sphere."""

import numpy as np

from contactlaw import LAWS, RIGID, Material
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.measured import Array, load
from validation.picture import curves, legend_below, points
from validation.prediction import REFERENCE, SPHERE, over_the_next_best, quiet_pair, rebounds, reference, rms

STEEL = Material(2.08e11, 0.30, 7850.0, "steel of the finite elements")
FRICTION = 0.3
PARTIAL = 5.8  # x up to which the published points are impacts that stick somewhere, or nearly
COUPLING = (1.0 - 2.0 * STEEL.poissons_ratio) / (1.0 - STEEL.poissons_ratio)  # of a sphere on a rigid plane
SHOWN = 9.5  # beyond, all laws and points lie on one line


class FiniteElements(Case):
    """Velocity and spin after the impact of an elastic sphere on a rigid plane, no figure fitted."""

    place = 12
    title = "Published finite elements"
    claim = (
        "Published finite elements of an elastic sphere on a rigid plane agree with the law without fitting, though "
        "less closely than their own two curves agree with each other. Their Poisson's ratio is not stated; 0.30 is "
        "assumed, as for the steel of that benchmark. The remaining difference is the same for the law and for the "
        "reference, so it is due to neither. Most of it comes from the coupling of normal and tangential motion of a "
        f"sphere on a rigid plane ({COUPLING:.2f}), which both neglect ([unlike materials](#unlike-materials)), the "
        "rest from reading the figure, as the disagreement of the two curves indicates."
    )
    sheet = {"columns": 2, "width": 4.4}
    caption = (
        "Velocity of the contact point (left) and spin (right) after an impact, over the incidence x = v_t/(mu v_n): "
        "finite elements (points; error bars: rms disagreement of the two published curves) and laws."
    )

    def run(self, quick: bool) -> Outcome:
        pair = quiet_pair(STEEL, RIGID, FRICTION)
        kappa, chi = pair.kappa, SPHERE * pair.kappa / 2.0
        both = published()
        measures, shown, found = {}, {}, {}
        for name, (x, y) in both.items():
            after = found[name] = {law: psi_2 / kappa for law, psi_2 in rebounds(kappa * x, chi).items()}
            differences = {law: (v if name == "recoil" else spin_of(x, v)) - y for law, v in after.items()}
            part = x < PARTIAL
            measures[name] = {of: {law: rms(difference[inside]) for law, difference in differences.items()}
                              for of, inside in (("partial slip", part), ("all", x > 0.0))}  # fmt: skip
            shown[name] = {"x": x, "y": y, "points": {"partial slip": int(part.sum()), "all": x.size}}
        x, laws = both["recoil"][0], found["recoil"]
        grid = np.linspace(0.01, 14.0, 57 if quick else 141)
        data = {
            "chi": chi, "below": PARTIAL, "rms": measures, "shown": shown,
            "curves_disagree": disagreement(both["recoil"], both["spin"], kappa, chi), "grid": grid,
            "laws": {law: psi_2 / kappa for law, psi_2 in rebounds(kappa * grid, chi).items()},
        }  # fmt: skip
        partial = {name: found["partial slip"] for name, found in measures.items()}
        limits = [
            Limit(f"rms of microslip from the reference in v_out/(mu v_n), x < {PARTIAL}", 4e-3 / kappa,
                  rms((laws["microslip"] - laws[REFERENCE])[x < PARTIAL])),
            Limit("rms of microslip over the next best law's, recoil", 1.0, over_the_next_best(partial["recoil"])),
            Limit("rms of microslip over the next best law's, spin", 1.0, over_the_next_best(partial["spin"])),
        ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        parts = [(name, part) for name in ("recoil", "spin") for part in ("partial slip", "all")]
        heads = [f"{name}, {'all x' if part == 'all' else 'x < {below:g}'.format(**data)} "
                 f"({data['shown'][name]['points'][part]} points)" for name, part in parts]  # fmt: skip
        table = Table(["law, rms from the finite elements", *heads])
        for law in [*LAWS, REFERENCE]:
            table.add(f"{law} | " + " | ".join(f"{data['rms'][name][part][law]:.3f}" for name, part in parts))
        found = data["curves_disagree"]
        each = " | ".join(f"{found[part] / scale:.3f}" for scale in (1.0, 1.4) for part in ("partial slip", "all"))
        table.add(f"(the two published curves from each other) | {each}")
        return table

    def draw(self, data: Data, left: Axes, middle: Axes) -> None:
        x = data["grid"]
        spins = {law: spin_of(np.array(x), np.array(v)).tolist() for law, v in data["laws"].items()}
        error = data["curves_disagree"]["all"]
        for axes, name, lines, scale in ((left, "recoil", data["laws"], 1.0), (middle, "spin", spins, 1.4)):
            curves(axes, x, lines)
            points(axes, data["shown"][name]["x"], data["shown"][name]["y"], error / scale, "finite elements")
            axes.set(xlabel=r"incidence $x = v_t/(\mu v_n)$ [-]", xlim=(0.0, SHOWN))
        left.set(ylabel=r"contact point after, $v_t'/(\mu v_n)$ [-]", ylim=(-2.1, 2.6),
                 title=rf"recoil ($\chi$ = {data['chi']:.3f}, e = 1)")  # fmt: skip
        middle.set(ylabel=r"spin after, $R\omega/(\mu v_n)$ [-]", title="spin")
        legend_below(left, 4)


def published() -> dict[str, tuple[Array, Array]]:
    """Incidence, and velocity of the contact point ("recoil") or spin after, of both curves."""
    tables = {name: load(f"chungooi5_{name}_fem_wu") for name in ("recoil", "spin")}
    return {name: (table["x_incident"], table[f"y_{name}"]) for name, table in tables.items()}


def spin_of(x: Array, after: Array) -> Array:
    """R omega/(mu v_n) of a homogeneous sphere, from x and v_out/(mu v_n): v_out = v_in + 1.4 R omega."""
    return (after - x) / 1.4


def disagreement(recoil: tuple[Array, Array], spin: tuple[Array, Array], kappa: float, chi: float) -> dict[str, float]:
    """Difference of two curves of the same impacts, in v_out/(mu v_n), rms.

    v_out = x + 1.4 y_spin holds exactly for one impact, but the two curves were read at slightly different x. So the
    recoil curve is carried to the x of the spin curve: its distance from the reference is interpolated, which is small
    and smooth where the curve itself bends.
    recoil, spin: x and what is over it, shape (n,) each, x rising. Returns it over x < 5.8, and over all.
    """
    both = spin[0] <= recoil[0].max()
    x = spin[0][both]
    offset = recoil[1] - reference(kappa * recoil[0], chi) / kappa
    carried = np.interp(x, recoil[0], offset) + reference(kappa * x, chi) / kappa
    difference = x + 1.4 * spin[1][both] - carried
    return {"partial slip": rms(difference[x < PARTIAL]), "all": rms(difference)}
