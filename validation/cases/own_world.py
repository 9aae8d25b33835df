"""The package's own world, without an engine: impacts, energy and momentum at any step."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from contactlaw.laws.microslip import Microslip
from contactlaw.world import World
from validation import ball
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register, told
from validation.impacts import judge
from validation.world_scenes import FLOOR, RADIUS, balls, box_of_planes, column, mass_of, rack, steel_pair, tumbler

MASS = mass_of(RADIUS)
STEPS = [1.0 / 60.0, 2e-3, 1e-4, 1e-5, 1e-6]  # [s]
PSI_1 = [0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0]
RESTITUTIONS = [1.0, 0.93, 0.5]
FINE = Microslip(64), 200  # nodes and substeps


@register
class OwnWorld(Case):
    """Bodies that drift, contacts that look where the bodies are, and equal and opposite kicks at one point: psi_2,
    energy and momentum are right at any step, with no correction for what moves within it.
    """

    place = 48
    title = "Without an engine"

    def run(self, quick: bool, progress: Progress) -> Outcome:
        steps = STEPS[:3] if quick else STEPS
        psi_2: list[Data] = [
            {"step": dt, "restitution": e, "error": psi_2_error(e, dt)}
            | ({"fine": psi_2_error(e, dt, *FINE)} if e == 1.0 else {})
            for dt, e in told(product(steps, RESTITUTIONS), progress, 0.0, 0.6)
        ]
        gases = [gas(dt) for dt in (4e-3, 2e-4)]
        kept: list[tuple[str, float, Any]] = [
            ("energy of elastic bounces, 10 s", 2e-4, lambda: max(map(bounces, steps[:3]))),
            ("momentum of two spinning balls, any step", 1e-14, lambda: max(map(momentum, steps[:4]))),
            ("energy of a gas of 8 elastic balls, 1 s", 2e-3, lambda: max(one[0] for one in gases)),
            ("spin of that gas at the rim, without friction", 1e-9, lambda: max(one[1] for one in gases)),
            ("energy of a column of 20 elastic balls", 1e-3, lambda: max(map(heap, steps[1:4]))),
            ("momentum of a break, 16 balls at 8 m/s", 1e-13, lambda: broken(2e-3)[0]),
            ("spin of that break at the rim, without friction", 1e-9, lambda: broken(2e-3)[1]),
            ("energy gained by tumbling bodies, over the first", 1e-3,
             lambda: max(tumble(*one) for one in product(("capsule", "dumbbell", "box"), range(1 if quick else 4),
                                                         (4e-3, 5e-4)))),
        ]  # fmt: skip
        conserved = [Limit(name, asked, measure()) for name, asked, measure in told(kept, progress, 0.6)]
        limits = [
            Limit("error of psi_2 at any step", 5e-4, max(one["error"] for one in psi_2)),
            Limit("error of psi_2 with 64 nodes and 200 substeps", 1e-4, max(one.get("fine", 0.0) for one in psi_2)),
            *conserved,
        ]
        return Outcome(limits, {"psi_2": psi_2, "kept": {limit.name: limit.reached for limit in conserved}})

    def table(self, data: Data) -> Table:
        table = Table(["what", *(f"e = {e:g}" for e in RESTITUTIONS)])
        for dt in dict.fromkeys(one["step"] for one in data["psi_2"]):
            errors = (f"{one['error']:.1e}" for one in data["psi_2"] if one["step"] == dt)
            table.add(f"error of psi_2, steps of {dt:.3g} s | {' | '.join(errors)}")
        for name, reached in data["kept"].items():
            table.add(f"{name} | {reached:.1e}")
        return table


def psi_2_error(restitution: float, dt: float, law: Microslip | str = "microslip", substeps: int = 100) -> float:
    """Largest over psi_1 and phases of the touch within a step, against the annuli."""
    pair = ball.steel_pair(law, restitution)
    world = ball.ball_world("none", dt, pair, substeps=substeps)
    found = ball.impacts(world, pair, PSI_1, np.array([1.1, 1.6]))[..., 0]
    truth = judge([(psi, pair.chi(ball.MASS, ball.TANGENTIAL_MASS), restitution) for psi in PSI_1])
    return float(np.abs(found - truth.psi_2[:, None]).max())


def bounces(dt: float) -> float:
    """Largest change of energy, every tenth of a second, over the first."""
    made = balls(steel_pair(), [[0.0, 0.0, RADIUS + 0.05]], 0.0, planes=[FLOOR], gravity=9.81, timestep=dt)
    return _change(made, 10.0, MASS * 9.81 * RADIUS)


def gas(dt: float) -> tuple[float, float]:
    """Of elastic balls without friction: largest change of energy over the first; speed of a rim by spin [m/s]."""
    rng = np.random.default_rng(5)
    places = 0.06 * np.array([*product((-1, 1), repeat=3)]) + rng.normal(0, 0.005, (8, 3))
    made = balls(steel_pair(0.0), places, rng.normal(0.0, 1.0, (8, 3)), planes=box_of_planes(0.12), timestep=dt)
    return _change(made, 1.0), _rim(made)


def heap(dt: float) -> float:
    """Of elastic balls above each other that fall on a floor, half a second."""
    return _change(column(20, 1e-4, dt), 0.5)


def broken(dt: float) -> tuple[float, float]:
    """Change of momentum over the cue ball's; speed of the rims by spin [m/s]; without friction."""
    made = rack(steel_pair(0.0), dt, 8.0)
    before = made.momentum[0]
    made.step(round(0.1 / dt))
    return float(np.abs(made.momentum[0] - before).max() / np.linalg.norm(before)), _rim(made)


def tumble(kind: str, seed: int, dt: float) -> float:
    """What an elastic body between two planes gains of its energy in two seconds, at most."""
    made = tumbler(kind, seed, dt, steel_pair(0.3 if seed % 2 else 0.0))
    first = made.energy.total
    return max(0.0, *(energy / first - 1.0 for energy in _watched(made, 2.0)))


def momentum(dt: float) -> float:
    """Largest change of linear and angular momentum of two balls that meet off-centre, over what they have of it."""
    rng, worst = np.random.default_rng(3), 0.0
    for _ in range(4):
        places = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]]) + 0.002 * rng.normal(size=(2, 3))
        velocities = np.array([[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]]) + 0.3 * rng.normal(size=(2, 3))
        made = balls(steel_pair(restitution=0.93), places, velocities, 50.0 * rng.normal(size=(2, 3)), timestep=dt)
        linear, angular = made.momentum
        made.step(max(round(0.01 / dt), 3))
        size = MASS * np.linalg.norm(velocities, axis=1).sum()
        worst = max(worst, np.abs(made.momentum[0] - linear).max() / size,
                    np.abs(made.momentum[1] - angular).max() / (size * 2.0 * RADIUS))  # fmt: skip
    return float(worst)


def _change(made: World, duration: float, offset: float = 0.0) -> float:
    first = made.energy.total
    return float(max(abs(energy - first) for energy in _watched(made, duration)) / (first - offset))


def _watched(made: World, duration: float) -> Iterator[float]:
    """Its energy every tenth of a second [J]."""
    for _ in range(round(10 * duration)):
        made.step(round(0.1 / made.timestep))
        yield made.energy.total


def _rim(made: World) -> float:
    return float(RADIUS * np.abs(made.spin).max())
