"""Coupling of normal and tangential motion of unlike materials: in finite elements, not in alumina on glass."""

import numpy as np

from contactlaw import RIGID, ContactPair
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.cases import alumina_on_glass as alumina
from validation.cases import finite_elements as elements
from validation.measured import Array
from validation.picture import legend_below
from validation.prediction import SPHERE, quiet_pair, reference, rms

PSI = np.array([0.1, 0.3, 0.6, 0.9, 1.1, 1.3, 1.6, 2.0, 2.5, 3.0, 3.5, 4.0, 4.4, 4.8, 5.2, 6.5])  # then all slides
FRICTIONS = (alumina.FRICTION, 0.2, 0.5)  # of the points that slip in a contact that sticks elsewhere
ASKED = 0.03  # what the coupling was said to bring the finite elements' recoil to, before this was built
WAYS = ("as like materials", "with the coupling")


class UnlikeMaterials(Case):
    """Pressing unlike bodies together shears their surfaces (Dundurs' beta), which the laws and the reference neglect.
    With this coupling, the grid solver agrees with the finite elements of a sphere on a rigid plane as well as their
    own two curves agree with each other. Alumina on glass has nearly as large a beta and a third of the friction, and
    there the data contradict the coupling: with local friction as in gross slip, pressing alone would make nearly the
    whole contact slip, and at small angles the contact could hold hardly any tangential force, whereas the measured
    spheres grip as like materials do. The coupling would go unnoticed only if points that slip in a contact that sticks
    elsewhere had several times the friction of gross slip. As no measurement gives that friction, the laws neglect the
    coupling.
    """

    place = 14
    title = "Unlike materials"
    sheet = {"columns": 2, "width": 4.4}
    caption = (
        "With and without the coupling of unlike materials: velocity of the contact point after an impact, beside "
        "finite elements on a rigid plane (left); tangential restitution of alumina on glass, beside measurements "
        "(right)."
    )

    def run(self, quick: bool) -> Outcome:
        pair = quiet_pair(elements.STEEL, RIGID, elements.FRICTION)
        fine = np.linspace(0.05, 6.5, 60)
        change = coupled_change(pair, pair.friction, PSI, quick)
        both = elements.published()
        found: dict[str, list[float]] = {}
        for name, (x, y) in both.items():
            part = x < elements.PARTIAL
            after = [psi / pair.kappa for psi in both_ways(pair, pair.kappa * x[part], change)]
            found[name] = [rms((v if name == "recoil" else elements.spin_of(x[part], v)) - y[part]) for v in after]
        own = elements.disagreement(both["recoil"], both["spin"], pair.kappa, SPHERE * pair.kappa / 2.0)["partial slip"]
        glass, (theta, e_t) = alumina.PAIR, alumina.measured("e_t")
        theta, e_t = theta[theta < alumina.STICKING], e_t[theta < alumina.STICKING]
        psi_1 = glass.kappa / glass.friction * np.tan(np.radians(theta))
        before = both_ways(glass, psi_1, np.zeros(PSI.size))[0]
        held = {0.0: rms(restored(psi_1, before) - e_t)}
        for friction in FRICTIONS:
            psi = glass.kappa / friction * np.tan(np.radians(theta))
            after = before + psi_1 * coupled_change(glass, friction, psi, quick)
            held[friction] = rms(restored(psi_1, after) - e_t)
        glass_fine = coupled_change(glass, glass.friction, PSI, quick)
        data = {
            "beta": {"finite elements": 0.5 * pair.coupling, "alumina on glass": 0.5 * glass.coupling},
            "rms": found, "own": own, "held": [[friction, value] for friction, value in held.items()],
            "scatter": alumina.consistency()["e_t"][0],
            "x": fine / pair.kappa, "recoil": dict(zip(WAYS, [v / pair.kappa for v in both_ways(pair, fine, change)],
                                                       strict=True)),
            "points": both["recoil"], "measured": [theta, e_t],
            "theta": np.degrees(np.arctan(fine * glass.friction / glass.kappa)),
            "e_t": dict(zip(WAYS, [restored(fine, v) for v in both_ways(glass, fine, glass_fine)], strict=True)),
        }  # fmt: skip
        limits = [
            Limit("finite elements: rms in v_out/(mu v_n) with the coupling, recoil", ASKED, found["recoil"][1]),
            Limit("finite elements: the same over what their two curves differ by", 1.0, found["recoil"][1] / own),
            Limit("finite elements: rms with the coupling over that without, spin", 1.0,
                  found["spin"][1] / found["spin"][0]),
            Limit("alumina on glass: rms in e_t with the coupling, over the scatter of the data", 1.0,
                  held[alumina.FRICTION] / data["scatter"], at_least=True),
        ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table(["rms from", *WAYS, "scatter"])
        for name, (without, coupled) in data["rms"].items():
            own = data["own"] if name == "recoil" else data["own"] / 1.4
            table.add(f"finite elements, {name} (beta = {{beta[finite elements]:.2f}}) | {without:.3f} | "
                      f"{coupled:.3f} | {own:.3f}", data)  # fmt: skip
        (_, without), *held = data["held"]
        for friction, value in held:
            table.add("alumina on glass, e_t (beta = {beta[alumina on glass]:.2f}), points slip at mu = "
                      f"{friction:g} | {without:.3f} | {value:.3f} | {{scatter:.3f}}", data)  # fmt: skip
        return table

    def draw(self, data: Data, left: Axes, right: Axes) -> None:
        for axes, x, lines, (at, y) in ((left, data["x"], data["recoil"], data["points"]),
                                        (right, data["theta"], data["e_t"], data["measured"])):  # fmt: skip
            for way, style in zip(WAYS, ("--", "-"), strict=True):
                axes.plot(x, lines[way], style, label=way)
            axes.plot(at, y, "ko", markersize=4, label="finite elements (left), measured (right)")
        left.set(xlabel=r"incidence $x = v_t/(\mu v_n)$ [-]", ylabel=r"contact point after, $v_t'/(\mu v_n)$ [-]",
                 xlim=(0.0, 8.0), ylim=(-2.1, 2.6), title="finite elements on a rigid plane")  # fmt: skip
        right.set(xlabel="angle of incidence [degrees]", ylabel=r"$e_t$ of the centre of mass [-]",
                  xlim=(0.0, 33.0), title="alumina on glass")  # fmt: skip
        legend_below(left, 3)


def coupled_change(pair: ContactPair, friction: float, psi_1: Array, quick: bool) -> Array:
    """Change of psi_2/psi_1 by the coupling, at incidences (n,), by the grid, whose own error cancels."""
    from validation.reference import grid

    a, b = pair.a, pair.b
    compliances = 1.0 / np.array([a.shear_modulus, b.shear_modulus])
    nu = float(compliances @ [a.poissons_ratio, b.poissons_ratio] / compliances.sum())  # that of the kernel of both
    chi = SPHERE * pair.kappa / 2.0
    cells, steps = (12, 48) if quick else (24, 128)
    found = []
    for psi in psi_1:
        told = (psi, 0.0, 0.0), (chi, chi, 0.0)
        after = [grid.rebound(*told, nu=nu, cells=cells, steps=steps, coupling=coupling)[0]
                 for coupling in (0.0, pair.kappa / friction * 0.5 * pair.coupling)]  # fmt: skip
        found.append((after[1] - after[0]) / psi)
    return np.array(found)


def both_ways(pair: ContactPair, psi_1: Array, change: Array) -> tuple[Array, Array]:
    """psi_2 without the coupling and with it, whose change is known at PSI."""
    without = reference(psi_1, SPHERE * pair.kappa / 2.0, float(pair.restitution))
    return without, without + psi_1 * np.interp(psi_1, PSI, change, right=0.0)


def restored(psi_1: Array, psi_2: Array) -> Array:
    """e_t of the centre of a homogeneous sphere."""
    return 1.0 - (1.0 - psi_2 / psi_1) / SPHERE
