"""Fig. 4 of Maw, Barber & Fawcett (1981): the apparatus, as the simulated scene has it."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from contactlaw import rebound
from sims.puck import SURFACES, Puck
from validation.case import Case, Data, Outcome, Progress, Table, register
from validation.picture import panels
from validation.rebound_figure import INCH, sized

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PUCKS = {"3 in steel": ("steel", 3.0), "4 in steel": ("steel", 4.0), "4 in rubber": ("rubber", 4.0)}
SHOWN_BLOCK = (0.05, 0.075)  # half lengths of the block that is drawn [m]; the scene's is longer
PENDULUM = 0.17  # from its pivot to the head [m]
JETS = 0.025  # between the table's jets [m]


@register
class PaperFigure4(Case):
    """The scene and its sizes."""

    name = "paper_figure_4"
    place = 5
    title = "Paper, figure 4: the apparatus"
    claim = (
        "The scene is the paper's: a puck cut from a ball floats on an air table, a pendulum throws it at a clamped "
        "block of its own material, and a stroboscope lights it from above. The paper takes the puck for a flat disk; "
        "for slices an inch thick (the paper gives no thickness) that makes chi 1 to 3 % too small."
    )
    caption = (
        "The apparatus from above (left) and from the side (right), drawn with the sizes of the simulated scene. "
        "Table, launcher and light are not simulated: they make the motion plane and frictionless, and start it."
    )

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Sizes of the pucks, and what their roundness does."""
        pucks = {}
        for name, (material, inches) in PUCKS.items():
            puck = sized(Puck(material=material), inches * INCH)
            gyration = _gyration(puck.radius, 0.5 * puck.thickness)
            round_chi = puck.pair.chi(puck.mass, puck.mass / (1.0 + 1.0 / gyration))
            psi = np.linspace(0.0, 6.0, 121)
            e = puck.pair.restitution
            change = np.abs(np.asarray(rebound(psi, round_chi, restitution=e)) - rebound(psi, puck.chi, restitution=e))
            pucks[name] = {
                "radius": puck.radius, "mass": puck.mass, "chi": puck.chi, "chi_round": round_chi,
                "gyration": gyration, "mu": puck.pair.friction, "restitution": e,
                "contact_duration": puck.contact_duration, "change": float(change.max()),
                "greatest_overlap": puck.pair.greatest_overlap(puck.mass, puck.speed),
            }  # fmt: skip
        progress(1.0)
        data = {
            "pucks": pucks, "thickness": Puck.thickness, "speed": Puck().speed,
            "incidence": SURFACES["steel"].friction / Puck().pair.kappa * replace(Puck(), psi_1=3.0).psi_1,
        }  # fmt: skip
        return Outcome([], data)

    def table(self, data: Data) -> Table:
        """A row a puck."""
        table = Table(
            ["puck", "radius [mm]", "mass [kg]", "mu", "e", "contact at 1 m/s [us]", "overlap [um]", "chi, disk",
             "chi, slice of a ball", "which changes psi_2 by at most"]
        )  # fmt: skip
        for name, puck in data["pucks"].items():
            table.rows.append(
                [name, f"{1e3 * puck['radius']:.1f}", f"{puck['mass']:.3f}", f"{puck['mu']:g}",
                 f"{puck['restitution']:g}", f"{1e6 * puck['contact_duration']:.0f}",
                 f"{1e6 * puck['greatest_overlap']:.0f}", f"{puck['chi']:.4f}", f"{puck['chi_round']:.4f}",
                 f"{puck['change']:.3f}"]
            )  # fmt: skip
        return table

    def draw(self, data: Data) -> Figure:
        """From above and from the side."""
        figure, (above, side) = panels(2, width=5.2, height=4.6)
        radius = data["pucks"]["4 in steel"]["radius"]
        _draw_above(above, radius, data["incidence"])
        _draw_side(side, radius, data["thickness"])
        for axes in (above, side):
            axes.set(aspect="equal", xticks=[], yticks=[])
            axes.grid(visible=False)
            for spine in axes.spines.values():
                spine.set_visible(False)
        return figure


def _gyration(radius: float, half: float) -> float:
    """K^2 of a slice of a ball, cut at +-half from its middle: I/(M R^2), below the 1/2 of a disk."""
    s = (half / radius) ** 2
    return 0.5 * (1.0 - 2.0 * s / 3.0 + s**2 / 5.0) / (1.0 - s / 3.0)


def _name(axes: Axes, text: str, at: tuple[float, float], label: tuple[float, float]) -> None:
    """A label with a thin line to what it names."""
    axes.annotate(text, at, xytext=label, fontsize=8, va="center", arrowprops={"arrowstyle": "-", "linewidth": 0.6},
                  ha="center", bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0})  # fmt: skip


def _draw_above(axes: Axes, radius: float, slope: float) -> None:
    """Millimetres; the face of the block is at y = 0, the puck comes from below."""
    from matplotlib.patches import Circle, FancyArrowPatch, Polygon, Rectangle

    mm = 1e3
    r, depth, half = mm * radius, mm * SHOWN_BLOCK[0], mm * SHOWN_BLOCK[1]
    axes.add_patch(Rectangle((-230, -400), 460, 520, facecolor="#f7f7f7", edgecolor="black"))
    jets = np.mgrid[-212.5:213:25, -387.5:0:25].reshape(2, -1)
    axes.plot(*jets, ".", color="#bbbbbb", markersize=2)
    axes.add_patch(Rectangle((-half, 0), 2 * half, depth, facecolor="#cccccc", edgecolor="black"))
    for x in (-half - 18, half):
        axes.add_patch(Rectangle((x, 12), 18, depth - 24, facecolor="#888888", edgecolor="black"))
    start = np.array([-slope * (230 - r), -230.0])
    axes.add_patch(Circle((0, -r), r, facecolor="none", edgecolor="black", linestyle=(0, (4, 2))))
    axes.add_patch(Circle(tuple(start), r, facecolor="white", edgecolor="black"))
    axes.plot([start[0] - 36, start[0] + 36], [start[1]] * 2, color="black", linewidth=3.0)
    axes.plot([start[0]] * 2, [start[1] + r - 16, start[1] + r - 1], "-", color="#c44e00", linewidth=5.0)
    axes.add_patch(FancyArrowPatch(tuple(start), (0, -r), arrowstyle="-|>", mutation_scale=11, linewidth=1.2))
    # The launcher stands behind the puck, turned to the direction of the throw.
    along = np.array([slope, 1.0]) / np.hypot(slope, 1.0)
    across = np.array([along[1], -along[0]])
    for back, half_width, length, shade in ((r + 4, 22, 20, "#888888"), (r + 84, 60, 16, "#cccccc")):
        corners = [start - (back + u * length) * along + v * half_width * across
                   for u, v in ((0, -1), (0, 1), (1, 1), (1, -1))]  # fmt: skip
        axes.add_patch(Polygon(corners, facecolor=shade, edgecolor="black"))
    axes.plot(*np.transpose([start - (r + 24) * along, start - (r + 84) * along]), color="black", linewidth=2.5)
    head = start - (r + 14) * along
    axes.plot([0, 0], [0, -170], color="black", linewidth=0.6, linestyle=(0, (8, 3, 2, 3)))
    _name(axes, "clamped block", (20, 30), (150, 95))
    _name(axes, "clamp", (half + 10, 30), (160, 20))
    _name(axes, "puck: slice of a ball", (start[0] + 45, start[1] + 10), (125, -215))
    _name(axes, "reflective tape\nand rim marker", (start[0] + 25, start[1]), (130, -265))
    _name(axes, "pendulum head,\nset to any angle", (head[0] + 20, head[1] - 8), (115, -325))
    _name(axes, "air table with jets", (-187.5, -112.5), (-140, -60))
    _name(axes, "common\nnormal", (0, -150), (90, -140))
    axes.set(xlim=(-240, 240), ylim=(-410, 130), title="from above")


def _draw_side(axes: Axes, radius: float, thickness: float) -> None:
    """Millimetres; x away from the face of the block, z above the table."""
    from matplotlib.patches import Polygon, Rectangle

    mm = 1e3
    r, half, depth = mm * radius, 0.5 * mm * thickness, mm * SHOWN_BLOCK[0]
    axes.add_patch(Rectangle((-400, -40), 520, 36, facecolor="#f7f7f7", edgecolor="black"))
    for x in np.arange(-387.5, 0, mm * JETS):
        axes.plot([x, x], [-40, -4], color="#bbbbbb", linewidth=0.8)
    axes.add_patch(Rectangle((0, -4), depth, 2 * half + 16, facecolor="#cccccc", edgecolor="black"))
    middle = half + 1.0
    z = np.linspace(-half, half, 31)
    bulge = np.sqrt(r**2 - z**2)
    centre = -200.0
    outline = np.concatenate([np.column_stack([centre + bulge, middle + z]),
                              np.column_stack([centre - bulge, middle + z])[::-1]])  # fmt: skip
    axes.add_patch(Polygon(outline, facecolor="white", edgecolor="black"))
    axes.plot([centre - sqrt(r**2 - half**2), centre + sqrt(r**2 - half**2)], [middle + half + 1] * 2, color="#c44e00",
              linewidth=2.5)  # fmt: skip
    angle = np.linspace(0, 2 * np.pi, 100)
    axes.plot(
        centre + r * np.cos(angle), middle + r * np.sin(angle), color="#8a8a8a", linewidth=0.8, linestyle=(0, (4, 3))
    )
    pivot = (-375.0, 18.0 + mm * PENDULUM)
    axes.plot([pivot[0], -330], [pivot[1], 26], color="black", linewidth=2.0)
    axes.plot(*pivot, "o", color="black")
    axes.plot([pivot[0] - 20, pivot[0] + 20], [pivot[1] + 6] * 2, color="black", linewidth=3.0)
    axes.add_patch(Rectangle((-342, 4), 44, 24, facecolor="#888888", edgecolor="black"))
    camera, lamp = (-180.0, 300.0), (-60.0, 290.0)
    axes.add_patch(Rectangle((camera[0] - 25, camera[1]), 50, 34, facecolor="#888888", edgecolor="black"))
    axes.add_patch(Rectangle((camera[0] - 10, camera[1] - 14), 20, 14, facecolor="#cccccc", edgecolor="black"))
    axes.add_patch(Polygon([(lamp[0] - 14, lamp[1] + 26), (lamp[0] + 14, lamp[1] + 26), (lamp[0] + 30, lamp[1]),
                            (lamp[0] - 30, lamp[1])], facecolor="#fff3b0", edgecolor="black"))  # fmt: skip
    for x in (-330.0, 0.0):
        axes.plot(
            [camera[0], x],
            [camera[1] - 14, 0 if x < 0 else 2 * half + 12],
            color="#8a8a8a",
            linewidth=0.7,
            linestyle=":",
        )
    _name(axes, "camera", (camera[0] - 25, camera[1] + 15), (-265, 335))
    _name(axes, "stroboscope", (lamp[0] + 25, lamp[1] + 12), (50, 335))
    _name(axes, "pendulum", (-352, 110), (-290, 150))
    _name(axes, "ball that the puck\nis cut from", (centre + 0.7 * r, middle + 0.72 * r), (-80, 100))
    _name(axes, "clamped block", (depth * 0.6, 24), (60, 65))
    _name(axes, "air film, fed by jets", (-230, -1), (-230, -75))
    axes.set(xlim=(-410, 130), ylim=(-95, 355), title="from the side")
