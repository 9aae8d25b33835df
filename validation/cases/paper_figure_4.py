"""Fig. 4 of Maw, Barber & Fawcett (1981): the apparatus, with the sizes of the simulated scene."""

import numpy as np

from contactlaw import rebound
from sims.puck import SURFACES, Puck
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.rebound_figure import INCH, sized

PUCKS = {"3 in steel": ("steel", 3.0), "4 in steel": ("steel", 4.0), "4 in rubber": ("rubber", 4.0)}


class PaperFigure4(Case):
    """The scene is the paper's: a puck cut from a ball floats on an air table, a pendulum throws it at a clamped block
    of the same material, and a stroboscope lights it from above. The paper treats the puck as a flat disk. For slices
    an inch thick (the paper gives no thickness) this makes chi 1 to 3 % too small.
    """

    place = 5
    title = "Paper, figure 4: the apparatus"
    sheet = {"width": 5.2, "height": 4.6}
    caption = (
        "The apparatus from above, with the sizes of the simulated scene. Table and launcher are not simulated: they "
        "only keep the motion plane and frictionless, and start it."
    )

    def run(self, quick: bool) -> Outcome:
        pucks = {}
        for name, (material, inches) in PUCKS.items():
            puck = sized(Puck(material=material), inches * INCH)
            gyration = _gyration(puck.radius, 0.5 * puck.thickness)
            round_chi = puck.pair.chi(puck.mass, puck.mass / (1.0 + 1.0 / gyration))
            psi = np.linspace(0.0, 6.0, 121)
            e = puck.pair.restitution
            change = np.abs(np.asarray(rebound(psi, round_chi, restitution=e)) - rebound(psi, puck.chi, restitution=e))
            pucks[name] = {"radius": puck.radius, "mass": puck.mass, "chi": puck.chi, "chi_round": round_chi,
                           "mu": puck.pair.friction, "restitution": e, "kappa": puck.pair.kappa,
                           "contact_duration": puck.contact_duration, "change": float(change.max()),
                           "greatest_overlap": puck.pair.greatest_overlap(puck.mass, puck.speed)}  # fmt: skip
        incidence = SURFACES["steel"].friction / Puck().pair.kappa * 3.0  # of psi_1 = 3
        data = {"pucks": pucks, "incidence": incidence}
        flat = max(abs(puck["chi"] / (1.5 * puck["kappa"]) - 1.0) for puck in pucks.values())  # 1 + 1/K^2 = 3
        return Outcome([Limit("chi of a flat disk: relative difference from 3/2 kappa", 1e-12, flat)], data)

    def table(self, data: Data) -> Table:
        table = Table("puck | radius [mm] | mass [kg] | mu | e | contact at 1 m/s [us] | overlap [um] | chi, disk | "
                      "chi, slice of a ball | largest change in psi_2 by this")  # fmt: skip
        for name, puck in data["pucks"].items():
            table.add("{name} | {mm:.1f} | {mass:.3f} | {mu:g} | {restitution:g} | {us:.0f} | {um:.0f} | {chi:.4f} | "
                      "{chi_round:.4f} | {change:.3f}", puck, name=name, mm=1e3 * puck["radius"],
                      us=1e6 * puck["contact_duration"], um=1e6 * puck["greatest_overlap"])  # fmt: skip
        return table

    def draw(self, data: Data, axes: Axes) -> None:
        from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

        r, slope = 1e3 * data["pucks"]["4 in steel"]["radius"], data["incidence"]
        start = (-slope * (230.0 - r), -230.0)
        axes.add_patch(Rectangle((-230, -320), 460, 420, facecolor="#f7f7f7", edgecolor="black"))
        axes.add_patch(Rectangle((-75, 0), 150, 50, facecolor="#cccccc", edgecolor="black"))
        axes.add_patch(Circle((0, -r), r, facecolor="none", edgecolor="black", linestyle=(0, (4, 2))))
        axes.add_patch(Circle(start, r, facecolor="white", edgecolor="black"))
        axes.plot([start[0]] * 2, [start[1] + r - 16, start[1] + r - 1], "-", color="#c44e00", linewidth=5.0)
        axes.add_patch(FancyArrowPatch(start, (0, -r), arrowstyle="-|>", mutation_scale=11, linewidth=1.2))
        axes.plot([0, 0], [0, -200], color="black", linewidth=0.6, linestyle=(0, (8, 3, 2, 3)))
        for text, place, label in (
            ("clamped block", (20, 30), (150, 75)),
            ("puck: slice of a ball,\nmarker on its rim", (start[0] + 30, start[1] + 10), (130, -235)),
            ("air table, no friction", (-200, -130), (-150, -40)),
            ("common normal", (0, -150), (110, -140)),
        ):
            axes.annotate(text, place, xytext=label, fontsize=8, ha="center", va="center",
                          arrowprops={"arrowstyle": "-", "linewidth": 0.6})  # fmt: skip
        axes.set(
            aspect="equal",
            xlim=(-240, 240),
            ylim=(-330, 110),
            xlabel="along the block [mm]",
            ylabel="normal to the block [mm]",
        )
        axes.grid(visible=False)


def _gyration(radius: float, half: float) -> float:
    """K^2 of a slice of a ball, cut at +-half from its middle: I/(M R^2), below the 1/2 of a disk."""
    s = (half / radius) ** 2
    return 0.5 * (1.0 - 2.0 * s / 3.0 + s**2 / 5.0) / (1.0 - s / 3.0)
