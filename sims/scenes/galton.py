"""A Galton board: balls fall through rows of pegs and spread about as a binomial distribution does.

If each row sent a ball half a pitch to the left or right, independently of the row before, n rows of pegs a pitch p
apart would give a standard deviation of sqrt(n) p/2. A real ball keeps part of its sideways speed from one row to the
next, the more the better it bounces, so the binomial distribution is only a guide. Required are symmetry of left and
right, and that no ball is faster than its height allows. Each ball has a lane of its own along the pegs, so that no two
meet. Source: F. Galton, Natural Inheritance (1889), chapter 5.
"""

from __future__ import annotations

from dataclasses import replace
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array
from sims.options import Option, ball_mass, of_ball
from sims.recording import Recording
from sims.scene import EVERYWHERE, NATIVE, NATIVES, NONE, Limit, Measured, Scene, Settings, register
from sims.worlds import new_world
from sims.worlds.parts import onto

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GRAVITY = 9.81  # [m/s^2]
PITCH, ROW, PEG = 0.014, 0.0125, 0.002  # between pegs, between rows, radius of a peg [m]
LANE = 2.5  # between balls along the pegs, over their radius
SLOWEST = 0.06  # [m/s] of the mean fall through the rows, for how long to watch


@register
class Galton(Scene):
    """Seen along the pegs."""

    name = "galton"
    title = "balls fall through a Galton board: their spread, compared with the binomial distribution"
    engines = EVERYWHERE
    slow = 4.0
    native_step = 2e-4
    options = {
        "balls": Option(60, "number of balls", 2, 2000),
        "rows": Option(8, "rows of pegs", 1, 50),
        "seed": Option(1, "seed of the random positions at the start", 0, 10**6),
    } | of_ball(0.004, 0.2, 0.5)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Release all balls at once, within a quarter of a pitch of the middle."""
        world = new_world(settings, (0.0, 0.0, -GRAVITY))
        along, half = onto(np.array([0.0, 1.0, 0.0])), 0.5 * LANE * o.radius * o.balls
        pegs = [f"peg{row}-{i}" for row in range(o.rows) for i in range(-(o.rows // 2) - 3, o.rows // 2 + 4)]
        for name in pegs:
            row, i = (int(part) for part in name[3:].split("-", 1))
            world.peg(name, PEG, half, ((i + 0.5 * (row % 2)) * PITCH, 0.0, -row * ROW), along)
        balls, random = [f"ball{number}" for number in range(o.balls)], np.random.default_rng(o.seed)
        for number, (name, x) in enumerate(zip(balls, random.uniform(-0.25, 0.25, o.balls) * PITCH, strict=True)):
            lane = LANE * o.radius * (number + 0.5) - half
            world.ball(name, o.radius, o.mass or ball_mass(o.material, o.radius), (x, lane, 2.0 * ROW))
        # Two curvatures meet, that of ball and peg and along the peg the ball's alone: R is the root of both radii.
        radius = o.radius * (PEG / (PEG + o.radius)) ** 0.5
        pair = ContactPair(o.material, o.material, o.friction, o.restitution, radius=radius)
        world.contact(balls, pegs, pair, speed=0.5)
        world.plane("floor", (0.0, 0.0, -(o.rows + 2) * ROW))
        soft = ContactPair(o.material, o.material, 1.0, restitution=0.05, rolling_resistance=0.5)
        world.contact(balls, "floor", soft, speed=1.0)
        return world.record((o.rows + 2) * ROW / SLOWEST, every=4e-3)

    def measure(self, recording: Recording) -> Measured:
        """Mean and spread of the positions below the last row, and energy gained for the height fallen."""
        out, start = came_out(recording), recording.tracks[0].positions[0, 2]
        excess = [
            (track.energy((0.0, 0.0, -GRAVITY)) / (track.mass * GRAVITY) - start).max() / start
            for track in recording.tracks
        ]
        return recording.told("balls", "rows") | {
            "passed": len(out), "mean_over_pitch": float(out.mean()) / PITCH if out.size else 0.0,
            "spread_over_pitch": float(out.std()) / PITCH if out.size else 0.0,
            "spread_binomial_over_pitch": 0.5 * recording.o.rows**0.5, "energy_gained": float(max(excess)),
        }  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """All balls came through, symmetrically, with about the binomial spread, and none gained energy."""
        if measured["law"] in NATIVES:
            return []
        error = 4.0 * measured["spread_over_pitch"] / measured["balls"] ** 0.5
        spread = measured["spread_over_pitch"] / measured["spread_binomial_over_pitch"]
        drawn = 4.0 / (2.0 * measured["balls"]) ** 0.5  # four standard errors of a spread, over it
        return [
            Limit("share of balls that came through", 1.0, measured["passed"] / measured["balls"], at_least=True),
            Limit(
                "mean position over the pitch, at most four standard errors", error, abs(measured["mean_over_pitch"])
            ),
            Limit("spread over the binomial one, with four standard errors, upper limit", 2.0 * (1.0 + drawn), spread),
            Limit("the same, lower limit", 0.5 / (1.0 + drawn), spread, at_least=True),
            Limit("energy gained by any ball, over that of the height fallen", 1e-6, measured["energy_gained"]),
        ]

    def caption(self, recording: Recording) -> str:
        """The spread."""
        measured = self.measure(recording)
        told = measured["spread_over_pitch"], measured["spread_binomial_over_pitch"]
        return "spread {:.2f} pitches, binomial {:.2f}".format(*told)

    def figure(self, settings: Settings, recording: Recording) -> Figure:
        """Paths through the board and the number of balls in each bin, beside the engine's own contact."""
        from matplotlib.figure import Figure
        from matplotlib.ticker import MaxNLocator

        from sims.panel import TONES, Panel, path, surroundings, title_of

        runs = [recording]
        if settings.law not in NATIVES and settings.engine != NONE:
            runs.append(self.run(replace(settings, law=NATIVE, timestep=self.native_step)))
        rows = recording.o.rows
        wide = (0.5 * rows + 1.0) * PITCH
        high = (rows + 5.0) * ROW  # of the board; both are as wide, so that bins stand below the pegs
        side = 3.7 / (2.0 * wide)
        figure = Figure(figsize=(4.1 * len(runs) + 0.6, side * high + 3.6), layout="constrained")
        grid = figure.subplots(2, len(runs), squeeze=False, sharex=True, sharey="row", height_ratios=(side * high, 2.4))
        for (board, bins), one, kind in zip(grid.T, runs, ("law", "native"), strict=False):
            board.set(xlim=(-wide, wide), ylim=(-(rows + 2.0) * ROW, 3.0 * ROW), aspect="equal", anchor="S")
            board.set_title(f"{title_of(self, one)}\n{self.caption(one)}", loc="left", fontsize=9)
            surroundings(board, Panel(one, ""), np.array([-wide, wide, 0.0, 0.0]))
            for drawn in path(board, Panel(one, "", kind=kind), one.times[-1]):
                drawn.set_alpha(0.35)
            places = (np.arange(rows + 1) - 0.5 * rows) * PITCH
            edges = np.append(places - 0.5 * PITCH, places[-1] + 0.5 * PITCH)
            bins.hist(came_out(one), edges, rwidth=0.8, color=TONES[kind]["light"], edgecolor=TONES[kind]["dark"])
            expected = [one.o.balls * comb(rows, k) / 2.0**rows for k in range(rows + 1)]
            bins.plot(places, expected, "k.--", label="binomial")
            bins.set(xlabel="x [m]")
            bins.yaxis.set_major_locator(MaxNLocator(integer=True))
            bins.legend(fontsize=8)
        grid[0, 0].set_ylabel("z [m]")
        grid[1, 0].set_ylabel("balls")
        return figure


def came_out(recording: Recording) -> Array:
    """Positions [m] at which balls pass one row below the last."""
    end, out = -recording.o.rows * ROW, []
    for track in recording.tracks:
        below = track.positions[:, 2] < end
        if below.any():
            out.append(track.positions[int(np.argmax(below)), 0])
    return np.array(out)
