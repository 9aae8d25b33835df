"""One property at a time taken to its limits: Poisson's ratio, friction, inertia, incidence, masses, speed, rest."""

from functools import partial
from itertools import product

import numpy as np

from validation.case import Axes, Data, Outcome
from validation.stability import StabilityCase, crosses, gains, scale_of_gains, tally
from validation.stability_draws import EXTREMES, extreme
from validation.stability_worlds import ENGINES, TITLES, WAYS

TRIALS, FEW_TRIALS = 12, 4  # of a level; half of them elastic, their steps spread from contact to contact


class StabilityExtremes(StabilityCase):
    """One property at a time is taken to its limits: Poisson's ratio, friction, inertia from compact cores to rings,
    psi_1 from 1e-6 to 1000, masses a million times apart, speeds from 1 um/s to 100 m/s, grazing incidence, an initial
    overlap, rest on a floor or wedged into a groove, and hundreds of impacts in a step. With the default law no run
    gains 0.1 % of energy, and all that should come to rest do.
    """

    place = 48
    title = "Stability in extreme cases"
    caption = (
        "Largest gain of energy for each method (rows) at each level of a property (columns). Cross: a run gains more "
        "than 0.1 %, is not finite, passes through the other body by more than a radius, or does not come to rest "
        "where it should, within 20 periods of the law's contact and 200 steps. Engine steps from a 300th of a "
        "contact to a thousand contacts, everything else at random. A ball that starts inside the floor begins with "
        "the elastic energy of the law's contact."
    )
    sheet = {"width": 13.2, "height": 4.6}
    cells = "levels"
    heads = "elastic balls keep"

    def run(self, quick: bool) -> Outcome:
        count = FEW_TRIALS if quick else TRIALS
        levels = [(name, level) for name, one in EXTREMES.items() for level in range(len(one.levels))
                  if not quick or level in (0, len(one.levels) - 1)]  # fmt: skip
        data: Data = {"levels": levels, "engines": self.measured(partial(level_of, count), [levels])}
        return Outcome(self.limits(data), data)

    def kept(self, values: list[float]) -> str:
        """Median over the levels of the median energy that elastic balls keep; friction may take some."""
        return f"{np.median(values):.3g}"

    def draw(self, data: Data, axes: Axes) -> None:
        ways = list(product(ENGINES, WAYS))[::-1]
        cells = [data["engines"][engine][way] for engine, way in ways]
        x, y = np.arange(len(data["levels"]) + 1), np.arange(len(ways) + 1)
        mesh = gains(axes, x, y, [one["gain"][0] for one in cells])
        crosses(axes, [(c + 0.5, r + 0.5) for r, c in np.argwhere([one["fails"][0] for one in cells])], 4.0)
        scale_of_gains(mesh, axes)
        axes.set_yticks(y[:-1] + 0.5, [f"{way}, {TITLES[engine]}" for engine, way in ways], fontsize=8)
        axes.set_xticks(x[:-1] + 0.5, [EXTREMES[name].words[level] for name, level in data["levels"]], rotation=90,
                        fontsize=8)  # fmt: skip
        axes.tick_params(length=0)
        axes.axhline(len(WAYS), color="black", linewidth=1.2)
        names = [name for name, _ in data["levels"]]
        for name in dict.fromkeys(names):
            axes.axvline(names.index(name), color="black", linewidth=1.2)
            axes.annotate(EXTREMES[name].name, (names.index(name) + 0.5 * names.count(name), 1.0), ha="center",
                          xycoords=("data", "axes fraction"), xytext=(0, 4), textcoords="offset points",
                          fontsize=8)  # fmt: skip


def level_of(count: int, task: tuple[str, str, str, int]) -> Data:
    """Trials of one level by one method."""
    engine, way, name, level = task
    return tally(engine, way, [extreme(name, level, number, count) for number in range(count)])
