"""The bounce of a steel ball inside an engine: what each way costs an impact and a step, beside its error."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle
from math import ceil
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from contactlaw import LAWS
from contactlaw.laws import Law
from contactlaw.laws.microslip import Microslip
from validation import front
from validation.ball import FRICTION, MASS, RADIUS, RESTITUTION, SUBSTEPS, TANGENTIAL_MASS, energy_of, steel_pair
from validation.case import Data, Limit, Table
from validation.front import Rung
from validation.impacts import judge
from validation.measure import interleaved
from validation.picture import panels
from validation.reference import annulus

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

SPEED = 1.0  # [m/s]
INCIDENCES = [0.2, 0.6, 1.0, 1.4, 2.0, 2.7, 3.5, 4.2, 5.0, 6.0]
FINE_BELOW = 2e-5  # [s]: of such steps the phase of the touch hardly matters
PHASES = {"fine": 3, "coarse": 40}
RESOLVED = [1000, 300, 100, 30, 10, 1]  # steps a contact, beside the engine's own
NODES = [4, 8, 12, 16, 24, 32, 64]
COUNTS = [12, 25, 50, 100, 200, 400]  # substeps a contact
ANNULI = [5, 10, 20, 40]
SINGLE = ("linear_spring", "mindlin", "mindlin_rescaled")
GROWN = 3e-3  # of the energy: beyond, a way is not sane
PATIENCE = 0.06  # [s]: a ball that has not left by then is judged as it is
DEFAULT = "microslip, default"
CLOSER, FASTER = 30.0, 100.0

CHI = steel_pair().chi(MASS, TANGENTIAL_MASS)
DURATION = steel_pair().contact_duration(MASS, SPEED)
KAPPA = steel_pair().kappa


class Ball(Protocol):
    """A ball over a floor in some engine; `validation.ball.BulletBall` is one."""

    def start(self, height: float, velocity: Any, spin: Any) -> None:
        """Put it at a height [m] over touching with a velocity [m/s] and spin [rad/s]."""
        ...

    def step(self, count: int) -> None:
        """Step the engine."""
        ...

    @property
    def height(self) -> float:
        """Over touching [m]."""
        ...

    @property
    def true_motion(self) -> tuple[Array, Array]:
        """Velocity [m/s] and spin [rad/s] at the time of the position."""
        ...


@dataclass(frozen=True)
class Way:
    """One way to simulate the bounce.

    Attributes:
        family: Law, or "native".
        dt: Engine step [s].
        make: Gives the ball.
        patience: How long it may stay in contact [s].
    """

    family: str
    dt: float
    make: Callable[[], Any]
    patience: float = 3.0 * DURATION

    @property
    def phases(self) -> Array:
        """Parts of a step left between start and touch."""
        count = PHASES["fine" if self.dt < FINE_BELOW else "coarse"]
        return (np.arange(count) + 0.5) / count


@dataclass(frozen=True)
class Setting:
    """What the law is told: a law, the step [s] and substeps a contact."""

    law: str | Law
    dt: float
    substeps: int = SUBSTEPS


def settings(own_step: float, quick: bool) -> dict[str, Setting]:
    """Every law at every step; at the engine's own step also in few substeps, and `microslip` in many ways."""
    resolved = RESOLVED[::3] if quick else RESOLVED
    steps = {f"T/{n}" if n > 1 else "T": DURATION / n for n in resolved} | {in_words(own_step): own_step}
    found = {
        DEFAULT if name == "microslip" and dt == own_step else f"{name}, {words}": Setting(name, dt)
        for name in LAWS
        for words, dt in steps.items()
    }
    counts, nodes = (COUNTS[1::2], NODES[1::2]) if quick else (COUNTS, NODES)
    found |= {
        f"microslip, {n} nodes, {count} substeps": Setting(Microslip(node_count=n), own_step, count)
        for n in nodes
        for count in counts
        if (n, count) != (16, SUBSTEPS)
    }
    found |= {
        f"{name}, {counts[0]} substeps": Setting(name, own_step, counts[0]) for name in LAWS if name != "microslip"
    }
    fine = f"T/{resolved[0]}"
    return found | {f"microslip, 64 nodes, {fine}": Setting(Microslip(node_count=64), steps[fine])}


def in_words(dt: float) -> str:
    """A step as it is written."""
    return f"1/{round(1.0 / dt)} s" if dt > 3e-3 else f"{1e3 * dt:g} ms"


def measured(
    ways: Mapping[str, Way], repeats: int, quick: bool, progress: Callable[[float], None]
) -> tuple[Data, list[str]]:
    """Errors and times of every way, and of annuli of their own, side by side.

    Each round is one impact, the same incidence for all; only the engine's steps are timed, from the step of the
    touch's approach to the step after which the ball has left.

    Returns:
        Data as from `front.weighed`, with what else the table needs, and what makes the default not sane.
    """
    psi_1 = INCIDENCES[::3] if quick else INCIDENCES
    truth = judge([(psi, CHI, RESTITUTION) for psi in psi_1], 20 if quick else 40)
    bounces = {name: _Bounces(way, psi_1, truth.psi_2) for name, way in ways.items()}
    for number, one in enumerate(bounces.values()):
        one.throw_all()
        progress(0.5 * (number + 1) / len(bounces))
    runs: dict[str, Callable[[], object]] = {name: one.timed for name, one in bounces.items()}
    prepare: dict[str, Callable[[], object]] = {name: one.next for name, one in bounces.items()}
    rings, errors = {}, {}
    for n in ANNULI:
        name = f"annuli, N = {n}"
        rings[name] = _Rings(n, psi_1)
        runs[name], prepare[name] = rings[name].timed, rings[name].next
        found = [annulus.rebound(psi, CHI, n, restitution=RESTITUTION) for psi in psi_1]
        errors[name] = np.array(found) - truth.psi_2
    seconds = interleaved(runs, repeats, prepare, lambda part: progress(0.5 + 0.5 * part))
    rungs = {
        name: Rung(ways[name].family, one.errors, seconds[name], one.problem, one.counts_of(repeats))
        for name, one in bounces.items()
    }  # fmt: skip
    rungs |= {name: Rung("annuli", error, seconds[name]) for name, error in errors.items()}
    data = front.weighed(rungs)
    data |= {"psi_1": psi_1, "chi": CHI, "duration": DURATION, "uncertainty": float(truth.uncertainty.max())}
    data |= {"closer": front.closer(data, DEFAULT, SINGLE), "faster": front.faster(data, DEFAULT, ["annuli"])}
    problem = rungs[DEFAULT].problem
    return data, [f"{DEFAULT}: {problem}"] if problem else []


class _Rings:
    """The annuli on the same incidences."""

    def __init__(self, annuli: int, psi_1: list[float]) -> None:
        self.annuli, self.incidences = annuli, cycle(psi_1)

    def next(self) -> None:
        """Go on to the next impact."""
        self.psi_1 = next(self.incidences)

    def timed(self) -> None:
        """The impact."""
        annulus.impact(self.psi_1, CHI, self.annuli, restitution=RESTITUTION)


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
    def ball(self) -> Ball:
        """Made when first thrown."""
        return self.way.make()

    def place(self, number: int) -> Array:
        """Start an impact; returns the direction of sliding."""
        i, j = self.launches[number]
        velocity, spin, along = launch(self.psi_1[i] * FRICTION / KAPPA * SPEED, 2.4 * j, spinning=j % 2 == 1)
        self.ball.start(float(self.way.phases[j]) * self.way.dt * SPEED, velocity, spin)
        return along

    def throw_all(self) -> None:
        """Count the steps until each ball has left, and take the errors; stop at what is not sane."""
        most = ceil(self.way.patience / self.way.dt) + 4
        for number, (i, _) in enumerate(self.launches):
            along = self.place(number)
            first = energy_of(*self.ball.true_motion)
            self.counts[number] = most
            for count in range(1, most + 1):
                self.ball.step(1)
                if self.ball.height > 0.0 and self.ball.true_motion[0][2] > 0.0:
                    self.counts[number] = count
                    break
            velocity, spin = self.ball.true_motion
            point = velocity - RADIUS * np.array([spin[1], -spin[0], 0.0])
            psi = float(point @ along) * KAPPA / (FRICTION * SPEED)
            grown = energy_of(velocity, spin) / first
            self.errors[number] = psi - self.psi_2[i]
            pushed = 2.0 * CHI * (1.0 + velocity[2] / SPEED)  # what friction at its limit all along takes from psi
            if not np.isfinite(psi):
                self.problem = "not finite"
            elif grown > 1.0 + GROWN:
                self.problem = f"energy grown to {grown:.3f}"
            elif abs(psi - self.psi_1[i]) > pushed * (1.0 + 1e-3):
                self.problem = "outside the friction cone"

    def next(self) -> None:
        """Go on to the next impact, untimed."""
        number = next(self.turns)
        self.place(number)
        self.count = int(self.counts[number])

    def timed(self) -> None:
        """The impact."""
        self.ball.step(self.count)

    def counts_of(self, rounds: int) -> Array:
        """Steps of the impact of each round; two rounds went before."""
        return self.counts[(np.arange(rounds) + 2) % self.counts.size].astype(float)


def launch(speed: float, turned: float, *, spinning: bool) -> tuple[Array, Array, Array]:
    """Velocity, spin and direction of sliding of a ball whose contact point slides at a speed [m/s].

    Args:
        speed: Of the contact point [m/s].
        turned: Direction of sliding from the x axis [rad].
        spinning: Whether it slides because it spins, instead of moving obliquely.
    """
    along = np.array([np.cos(turned), np.sin(turned), 0.0])
    velocity, spin = np.array([0.0, 0.0, -SPEED]), np.zeros(3)
    if spinning:
        spin = -speed / RADIUS * np.array([-along[1], along[0], 0.0])
    else:
        velocity += speed * along
    return velocity, spin, along


def limits(data: Data, engine: str) -> list[Limit]:
    """What is asked of the default."""
    return [
        Limit(f"ways that beat the default in both, {engine}", 0.0, float(data["rungs"][DEFAULT]["beaten"])),
        Limit("times closer than a single spring as fast", CLOSER, data["closer"], at_least=True),
        Limit("times faster than annuli as close", FASTER, data["faster"], at_least=True),
    ]


def table(data: Data) -> Table:
    """The front, and the comparisons."""
    found = Table(front.HEADS, list(front.rows(data, DEFAULT)))
    found.rows.append(
        ["default closer than any single spring as fast", *[""] * 5, f"{front.short(data['closer'])} times"]
    )
    found.rows.append(["default faster than annuli as close", *[""] * 5, f"{front.short(data['faster'])} times"])
    return found


def draw(data: Data) -> Figure:
    """Error over the time of an impact and, without the annuli, of a step."""
    figure, (left, right) = panels(2, width=5.4, height=4.4)
    front.plot(left, data, DEFAULT, label=_label)
    front.plot(right, data, DEFAULT, per_step=True)
    left.set(xlabel="time of an impact [us]", ylabel=r"largest error in $\psi_2$ [-]")
    right.set(xlabel="time of one step of these [us]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=9)
    return figure


def _label(name: str) -> str:
    """Nodes/substeps of a rung of microslip."""
    words = name.replace(",", "").split()
    if words[0] != "microslip" or words[-1] != "substeps":
        return ""
    return f"{words[1]}/{words[-2]}"
