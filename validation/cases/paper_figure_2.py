"""Fig. 2 of Maw, Barber & Fawcett (1981): traction across the contact at ten equal times.

The abscissa counts annuli: twentieths of the contact radius at the greatest compression. The ordinate is f/(G mu C):
in the appendix the traction of gross slip is f = 2 G mu sqrt(b^2 - r^2)/(pi R (1 - nu)), largest in the centre at the
greatest contact radius b_max. By Hertz M V^2/2 = (8/15) E* sqrt(R) delta_max^(5/2), and for a ball and a half-space of
one material E* = G/(1 - nu), so that

    delta_max/R = [15 M V^2 (1 - nu)/(16 G R^3)]^(2/5) = C^2        b_max = sqrt(R delta_max) = C R

C is thus the greatest contact radius over R, and mu p_max = 2 G mu C/(pi (1 - nu)): the traction over mu p_max, which
the annulus solution gives, times 2/(pi (1 - nu)) is f/(G mu C), whatever mass, size and speed are.
"""

from typing import Any

import numpy as np

from sims.puck import Puck
from validation.case import Axes, Case, Data, Limit, Outcome
from validation.reference.annulus import impact

PSI_1 = 1.2
ANNULI = 20
TIMES = np.arange(1, 10) / 10.0  # at the tenth, the end, there is no contact left
STEPS = 4000
FINER = 9  # times as many annuli
HALF_TENTH = 0.05  # the paper says "about" of times that it shows by tenths
CHAIN_DASH = (0, (9, 2, 1.5, 2))


class PaperFigure2(Case):
    """The annulus solution with the paper's 20 annuli gives the paper's account of an impact at psi_1 = 1.2: gross
    slip; stick everywhere at once between tau = 0.2 and 0.3; a force that falls from about tau = 0.4; slip in the
    opposite direction that grows from the edge inwards; and no sticking part left from about tau = 0.9.
    """

    place = 3
    title = "Paper, figure 2: traction across the contact"
    sheet = {"width": 6.8, "height": 5.2}
    caption = (
        "Traction over radius at equal intervals of time; the numbers are tau (at the last, tau = 1, it is zero). "
        "Steel puck, chi = 1.256, psi_1 = 1.2. Solid: stuck; chain-dashed: slipping. Left scale as in the paper, with "
        "C the greatest contact radius over the ball's radius; right scale: over mu times the greatest pressure."
    )

    def run(self, quick: bool) -> Outcome:
        puck = Puck(material="steel", psi_1=PSI_1, restitution=1.0)
        paper = impact(PSI_1, puck.chi, ANNULI, steps=STEPS)
        converged = impact(PSI_1, puck.chi, (3 if quick else FINER) * ANNULI, steps=STEPS)
        stuck = np.flatnonzero(converged.stuck.any(axis=1))
        first, last = (float(converged.time[k]) for k in stuck[[0, -1]])
        at_once = float(converged.stuck[stuck[0]].sum() / (converged.pressure[stuck[0]] > 0.0).sum())
        falling = float(converged.time[converged.tangential_force.argmax()])
        slipping = (converged.pressure > 0.0) & ~converged.stuck
        # Of squares: near the edge both are roots of small differences, which rounding leaves to 1e-8.
        off_limit = float(np.abs(converged.traction**2 - converged.pressure**2)[slipping].max())
        data = {
            "psi_1": PSI_1, "scale": 2.0 / (np.pi * (1.0 - puck.pair.a.poissons_ratio)), "tau": TIMES,
            "radii": paper.radii, "edge": np.sqrt([np.interp(TIMES, paper.time, paper.overlap)])[0],
            "traction": np.array([np.interp(TIMES, paper.time, column) for column in paper.traction.T]).T,
            "stuck": paper.stuck[[np.abs(paper.time - tau).argmin() for tau in TIMES]],
        }  # fmt: skip
        limits = [
            Limit("stick begins, not before tau", 0.2, first, at_least=True),
            Limit("stick begins, not after tau", 0.3, first),
            Limit("stick begins, off the closed form by", 2e-3, abs(first - _closing_time(puck.chi))),
            Limit("share of annuli stuck at the first instant of stick", 1.0, at_once, at_least=True),
            Limit("force falls from tau = 0.4, off by", HALF_TENTH, abs(falling - 0.4)),
            Limit("nothing is stuck from tau = 0.9, off by", HALF_TENTH, abs(last - 0.9)),
            Limit(
                "slipping annuli: difference of the squares of traction and mu p, over (mu p_max)^2", 1e-12, off_limit
            ),
        ]
        return Outcome(limits, data)

    def draw(self, data: Data, axes: Axes) -> None:
        scale = data["scale"]
        for number, (tau, traction) in enumerate(zip(data["tau"], data["traction"], strict=True)):
            _draw_traction(axes, data, number)
            axes.annotate(f"{tau:.1f}", (-0.3 - 1.1 * (number % 2), scale * traction[0]), fontsize=8, ha="right")
        axes.plot([], [], color="black", label="stuck")
        axes.plot([], [], color="black", linestyle=CHAIN_DASH, label="slipping")
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set(
            xlabel="radius [twentieths of the greatest contact radius]", ylabel=r"$f\,/\,(G\,\mu\,C)$ [-]",
            xlim=(-2.8, 20.3), xticks=range(0, 21, 2), title=rf"steel, $\chi$ = 1.256, $\psi_1$ = {data['psi_1']}",
        )  # fmt: skip
        right = axes.secondary_yaxis("right", functions=(lambda f: f / scale, lambda f: f * scale))
        right.set_ylabel(r"$f\,/\,\mu p_{max}$ [-]")
        axes.legend(loc="upper right")


def _closing_time(chi: float) -> float:
    """When gross slip ends, in durations: the time in which a Hertz impact slows to the closing speed.

    With the overlap x over its greatest v^2 = 1 - x^(5/2), and dt is proportional to dx/v.
    """
    from scipy.special import betainc

    from validation.reference.closed_forms.regimes import closing_velocity_at_first_stick

    # Of integral dx/sqrt(1 - x^(5/2)) the part up to x is an incomplete beta function of x^(5/2).
    return 0.5 * float(betainc(0.4, 0.5, 1.0 - closing_velocity_at_first_stick(PSI_1, chi) ** 2))


def _draw_traction(axes: Axes, data: Any, number: int) -> None:
    """One curve, its stuck part solid and its slipping part chain-dashed; it ends at the contact edge."""
    edge, radii = data["edge"][number], np.array(data["radii"])
    within = radii < edge
    x = ANNULI * np.append(radii[within], edge)
    y = data["scale"] * np.append(np.array(data["traction"][number])[within], 0.0)
    stuck = np.array(data["stuck"][number])[within]
    core = int(np.flatnonzero(stuck)[-1]) + 1 if stuck.any() else 0
    for part, dashes in ((slice(core), "-"), (slice(max(core - 1, 0), None), CHAIN_DASH)):
        axes.plot(x[part], y[part], color="black", linestyle=dashes, zorder=2)
