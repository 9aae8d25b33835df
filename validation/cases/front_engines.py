"""Error against run time inside the engines: cost of each method per impact and per step."""

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from itertools import cycle, product
from math import ceil
from typing import NamedTuple

import numpy as np

from contactlaw import LAWS
from contactlaw.laws import Law
from contactlaw.laws.microslip import NODES as OF_THE_LAW
from contactlaw.laws.microslip import Microslip
from sims.panel import ENGINE_NAMES
from sims.worlds import World
from validation import ball, front
from validation.ball import INCIDENCES
from validation.case import Array, Axes, Case, Data, Limit, Outcome, Table
from validation.front import Rung
from validation.front_ways import ANNULI, CLOSER, DEFAULT, FASTER, SINGLE
from validation.impacts import judge
from validation.measure import interleaved
from validation.picture import legend_below
from validation.reference import annulus

FINE_BELOW = 2e-5  # [s]: of such steps the phase of the touch hardly matters
PHASES = {"fine": 3, "coarse": 40}
RESOLVED = [1000, 300, 100, 30, 10, 1]  # steps a contact, beside the engine's own
NODES = [4, 8, 12, 16, 24, 32, 64]
COUNTS = [12, 25, 50, 100, 200, 400]  # substeps a contact
GROWN = 3e-3  # of the energy: beyond, a way is not sane
PATIENCE = 0.06  # [s]: a ball that has not left by then is judged as it is
OWN_STEPS = {"mujoco": 2e-3, "pybullet": 1.0 / 240.0}  # [s]
NATIVE_STEPS = [1e-3, 1e-4]  # [s], besides
SOFT = 0.02  # [s], a native contact that some steps of 2 ms resolve
NATIVE_RESOLVED = {"mujoco": [1000, 300, 100, 30], "pybullet": [1000, 100]}  # steps a contact

CHI = ball.steel_pair().chi(ball.MASS, ball.TANGENTIAL_MASS)
DURATION = ball.steel_pair().contact_duration(ball.MASS, ball.SPEED)
KAPPA = ball.steel_pair().kappa


class Way(NamedTuple):
    """One way to simulate the bounce: law, or "native"; engine step [s]; its world; how long contact may last [s]."""

    family: str
    dt: float
    make: Callable[[], World]
    patience: float = 3.0 * DURATION

    @property
    def phases(self) -> Array:
        """Parts of a step left between start and touch."""
        count = PHASES["fine" if self.dt < FINE_BELOW else "coarse"]
        return (np.arange(count) + 0.5) / count


class FrontEngines(Case):
    """At the engines' own steps, 2 ms in MuJoCo and 1/240 s in PyBullet, and with default settings, the law should be
    on the front of error against run time, 30 times closer than the single-spring laws at equal run time, and 100 times
    faster than the annulus reference at equal error. Shorter engine steps only cost more, because the law takes its own
    substeps. In PyBullet reading and pushing the bodies takes part of the time, whatever the law.
    """

    place = 43
    title = "Error and time in the engines"
    sheet = {"columns": 2, "width": 5.4, "height": 4.4}
    caption = (
        f"Largest error in psi_2 of a steel ball's bounce (e = {ball.RESTITUTION:g}) over the processor time of all "
        "steps from before the contact until the ball has left, in MuJoCo and PyBullet. Line: the front. Numbers: "
        "nodes/substeps of microslip at the engine's own step. Native: the engine's own contact; in MuJoCo soft, and "
        "as stiff as the law's."
    )

    def run(self, quick: bool) -> Outcome:
        data: Data = {}
        problems: list[str] = []
        for engine in OWN_STEPS:
            data[engine], wrong = measured(ways(engine, quick), 12 if quick else 50, quick)
            problems += [f"{engine}: {one}" for one in wrong]
        limits = [limit for engine, one in data.items() for limit in _limits(one, ENGINE_NAMES[engine])]
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        found = Table(f"engine | {front.HEADS}")
        for engine, one in data.items():
            found.rows.extend([ENGINE_NAMES[engine], *row] for row in front.rows(one, DEFAULT))
        return found

    def draw(self, data: Data, *both: Axes) -> None:
        for axes, (engine, one) in zip(both, data.items(), strict=True):
            front.plot(axes, one, DEFAULT)
            axes.set(xlabel="time of an impact [us]", ylabel=r"largest error in $\psi_2$ [-]",
                     title=ENGINE_NAMES[engine])  # fmt: skip
        legend_below(both[0], 9)


def ways(engine: str, quick: bool) -> dict[str, Way]:
    """The law in every setting, and the engine's own contact."""
    own = OWN_STEPS[engine]
    found = {
        name: Way(name.split(",")[0], dt, partial(ball.ball_world, engine, dt, ball.steel_pair(law), substeps=substeps))
        for name, (law, dt, substeps) in settings(own, quick).items()
    }  # fmt: skip
    kinds = {"its own solref": None, "soft, bouncing": ball.linear_spring(SOFT, ball.RESTITUTION)}
    stiff = ball.linear_spring(DURATION, ball.RESTITUTION)
    if engine == "pybullet":
        kinds, stiff = {"its own": None}, None
    for number in NATIVE_RESOLVED[engine][:: 3 if quick else 1]:
        name, dt = f"native, {'as stiff' if stiff else 'its own'}, T/{number}", DURATION / number
        found[name] = Way("native", dt, partial(_native, engine, dt, stiff))
    for dt, (kind, spring) in product([own] if quick else [own, *NATIVE_STEPS], kinds.items()):
        name = f"native, {kind}, {ball.in_words(dt)}"
        found[name] = Way("native", dt, partial(_native, engine, dt, spring), PATIENCE)
    return found


def _native(engine: str, dt: float, spring: tuple[float, float] | None) -> World:
    world = ball.ball_world(engine, dt, None)
    world.native(ball.FRICTION, ball.RESTITUTION, spring)
    return world


def settings(own_step: float, quick: bool) -> dict[str, tuple[str | Law, float, int]]:
    """Law, step [s] and substeps: every law at every step, at the engine's own also in few substeps."""
    resolved = RESOLVED[::3] if quick else RESOLVED
    steps = {f"T/{n}" if n > 1 else "T": DURATION / n for n in resolved} | {ball.in_words(own_step): own_step}
    found: dict[str, tuple[str | Law, float, int]] = {
        DEFAULT if name == "microslip" and dt == own_step else f"{name}, {words}": (name, dt, ball.SUBSTEPS)
        for name, (words, dt) in product(LAWS, steps.items())
    }
    counts, nodes = (COUNTS[1::2], NODES[1::2]) if quick else (COUNTS, NODES)
    found |= {
        f"microslip, {n} nodes, {count} substeps": (Microslip(node_count=n), own_step, count)
        for n, count in product(nodes, counts) if (n, count) != (OF_THE_LAW, ball.SUBSTEPS)
    }  # fmt: skip
    found |= {f"{name}, {counts[0]} substeps": (name, own_step, counts[0]) for name in LAWS if name != "microslip"}
    fine = f"T/{resolved[0]}"
    return found | {f"microslip, 64 nodes, {fine}": (Microslip(node_count=64), steps[fine], ball.SUBSTEPS)}


def measured(ways: Mapping[str, Way], repeats: int, quick: bool) -> tuple[Data, list[str]]:
    """Errors and times of every way, and of annuli of their own, side by side; and what makes the default not sane.

    Each round is one impact, the same incidence for all; only the engine's steps are timed, from the step of the
    touch's approach to the step after which the ball has left.
    """
    psi_1 = INCIDENCES[::3] if quick else INCIDENCES
    truth = judge([(psi, CHI, ball.RESTITUTION) for psi in psi_1], 20 if quick else 40)
    bounces = {name: _Bounces(way, psi_1, truth.psi_2) for name, way in ways.items()}
    for one in bounces.values():
        one.throw_all()
    runs: Data = {name: one.timed for name, one in bounces.items()}
    prepare: Data = {name: one.next for name, one in bounces.items()}
    errors = {}
    for n in ANNULI:
        name, turns = f"annuli, N = {n}", cycle(psi_1)
        runs[name] = lambda n=n, turns=turns: annulus.impact(next(turns), CHI, n, restitution=ball.RESTITUTION)
        found = [annulus.rebound(psi, CHI, n, restitution=ball.RESTITUTION) for psi in psi_1]
        errors[name] = np.array(found) - truth.psi_2
    seconds = interleaved(runs, repeats, prepare)
    rungs = {name: Rung(ways[name].family, one.errors, seconds[name], one.problem, one.counts_of(repeats))
             for name, one in bounces.items()}  # fmt: skip
    rungs |= {name: Rung("annuli", error, seconds[name]) for name, error in errors.items()}
    data = front.weighed(rungs)
    data |= {"closer": front.closer(data, DEFAULT, SINGLE), "faster": front.faster(data, DEFAULT, ["annuli"])}
    problem = rungs[DEFAULT].problem
    return data, [f"{DEFAULT}: {problem}"] if problem else []


class _Bounces:
    """All impacts of one way, thrown once for their errors, then one by one for the clock."""

    def __init__(self, way: Way, psi_1: list[float], psi_2: Array) -> None:
        self.way, self.psi_1, self.psi_2 = way, psi_1, psi_2
        self.launches = [(i, j) for j in range(way.phases.size) for i in range(len(psi_1))]
        self.counts = np.zeros(len(self.launches), dtype=int)
        self.errors = np.full(len(self.launches), np.nan)
        self.problem = ""
        self.turns = cycle(range(len(self.launches)))

    @cached_property
    def world(self) -> World:
        """World, made at the first throw."""
        return self.way.make()

    def place(self, number: int) -> Array:
        """Start an impact; return the direction of sliding."""
        i, j = self.launches[number]
        slide = self.psi_1[i] * ball.FRICTION / KAPPA * ball.SPEED
        velocity, spin, along = ball.launch(slide, 2.4 * j, spinning=j % 2 == 1)
        self.world.start(ball.at(float(self.way.phases[j]) * self.way.dt * ball.SPEED, velocity, spin))
        return along

    def throw_all(self) -> None:
        """Count the steps until each ball has left, and take the errors; stop at what is not sane."""
        most = ceil(self.way.patience / self.way.dt) + 4
        for number, (i, _) in enumerate(self.launches):
            along = self.place(number)
            state = self.world.read()
            first = ball.energy_of(state.velocity[0], state.spin[0])
            self.counts[number] = most
            for count in range(1, most + 1):
                self.world.step()
                if self.world.place()[2] > ball.RADIUS and self.world.read().velocity[0, 2] > 0.0:
                    self.counts[number] = count
                    break
            sliding, up, energy = ball.after(self.world.read(), along)
            psi, grown = sliding * KAPPA / (ball.FRICTION * ball.SPEED), energy / first
            self.errors[number] = psi - self.psi_2[i]
            pushed = 2.0 * CHI * (1.0 + up / ball.SPEED)  # what friction at its limit all along takes from psi
            outside = abs(psi - self.psi_1[i]) > pushed * (1.0 + 1e-3)
            self.problem = (
                "not finite" if not np.isfinite(psi) else f"energy grown to {grown:.3f}" if grown > 1.0 + GROWN else
                "outside the friction cone" if outside else self.problem
            )  # fmt: skip

    def next(self) -> None:
        """Prepare the next impact, untimed."""
        number = next(self.turns)
        self.place(number)
        self.count = int(self.counts[number])

    def timed(self) -> None:
        """The impact."""
        self.world.step(self.count)

    def counts_of(self, rounds: int) -> Array:
        """Steps of the impact of each round; two rounds went before."""
        return self.counts[(np.arange(rounds) + 2) % self.counts.size].astype(float)


def _limits(data: Data, engine: str) -> list[Limit]:
    """Limits on the default."""
    return [Limit(f"methods both closer and faster than the default, {engine}", 0.0,
                  float(data["rungs"][DEFAULT]["beaten"])),
            Limit(f"times closer than a single spring at equal time, {engine}", CLOSER, data["closer"], at_least=True),
            Limit(f"times faster than annuli at equal error, {engine}", FASTER, data["faster"],
                  at_least=True)]  # fmt: skip
