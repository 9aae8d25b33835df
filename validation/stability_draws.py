"""Trials with properties at random: bounces, a start in overlap, rest, chatter; and properties taken to their ends."""

from collections.abc import Mapping, Sequence
from math import log10, pi, radians, sqrt, tan
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from contactlaw.pair import DEEPEST
from validation.stability_trials import FLOOR, LIVELY, MASS, RADIUS, SOLID, Trial, pair_of

RESTITUTIONS = (1.0, 0.5, 0.05)
SHALLOW = 0.8  # overlap in the first impact, at most, over the deepest of a Hertz contact
SLOWEST, FASTEST = -4.0, 2.0  # log10 of speed [m/s], unless an extreme asks for others
SOFTEST, STIFFEST = 3.0, 12.0  # log10 of E/Pa
STEPS = (-3.0, 2.5)  # log10 of contact duration over engine step


def drawn(random: Generator, restitution: float | None = None, **given: float) -> dict[str, float]:
    """What things are made of, at random but for what is given."""
    made = {
        "modulus": 10.0 ** random.uniform(SOFTEST, STIFFEST),
        "poisson": random.uniform(0.01, 0.4999),
        "friction": 0.0 if random.uniform() < 0.1 else 10.0 ** random.uniform(-3.0, 1.0),
        "restitution": RESTITUTIONS[int(random.integers(len(RESTITUTIONS)))] if restitution is None else restitution,
    }
    return {name: float(value) for name, value in (made | given).items()}


def softest(made: Mapping[str, float], mass: float, speed: float) -> float:
    """E [Pa] from which on a ball of this mass [kg] keeps its contacts shallow at a speed [m/s]."""
    deepest = pair_of(made).greatest_overlap(mass, speed)  # goes with E to the power -2/5
    return made["modulus"] * (deepest / (SHALLOW * DEEPEST * RADIUS)) ** 2.5


def fastest(made: Mapping[str, float], mass: float) -> float:
    """Speed [m/s] up to which a ball of this mass [kg] keeps its contacts shallow."""
    return (made["modulus"] / softest(made, mass, 1.0)) ** 0.5


def bounces(
    seed: Sequence[int], steps: tuple[float, float] = STEPS, *, ratio: float = 0.0, speed: float | None = None,
    psi_1: float | None = None, across: float | None = None, gyration: float = SOLID, flights: int = 8,
    restitution: float | None = None, modulus: tuple[float, float] | None = None, **given: float,
) -> Trial | None:  # fmt: skip
    """A ball that bounces on a floor, or with one on top of it; None where no speed keeps the contact shallow.

    Gravity is such that a flight takes two to six steps or contacts, whichever is longer. What is None is at random.

    Args:
        seed, given: Of everything at random; of what `drawn` draws.
        steps: Bounds of log10 of contact duration over engine step.
        modulus: Bounds of log10 of E/Pa; None: all that keep the contact shallow.
        ratio: Mass of the lower ball over the upper one's; 0: there is no upper one. The lighter has `MASS`.
        speed: Downwards [m/s].
        psi_1, across: Slide of the contact point, scaled as psi_1 is or over the speed downwards; None: motion
            across and spin at random.
        gyration, flights: I/(M R^2); how many flights, about.
    """
    random = np.random.default_rng(list(seed))
    ratios = [ratio, 1.0] if ratio else [1.0]
    masses = MASS * np.array(ratios) / min(ratios)
    made, lively = drawn(random, restitution, **given), LIVELY if ratio else 1.0
    if modulus is None:  # such that the slowest contact is shallow
        least = log10(softest(made, float(masses.max()), lively * (speed or 10.0**SLOWEST)))
        if least > STIFFEST:
            return None
        modulus = max(least, SOFTEST), STIFFEST
    made["modulus"] = 10.0 ** random.uniform(*modulus)
    fast = log10(fastest(made, float(masses.max())) / lively)
    if speed is None and fast < SLOWEST:
        return None
    down = speed or 10.0 ** random.uniform(SLOWEST, min(FASTEST, fast))
    contact = pair_of(made).contact_duration(float(masses.min()), down)
    step = contact / 10.0 ** random.uniform(*steps)
    flight = random.uniform(2.0, 6.0) * max(contact, step)
    lean = np.array([*random.uniform(-0.5, 0.5, 2), 1.0])
    gap = random.uniform(0.1, 1.0) * down * step
    top = lean / np.linalg.norm(lean) * (2.0 * RADIUS + gap)
    places = np.array([0.0, 0.0, RADIUS + gap]) + np.arange(len(masses))[:, None] * top
    velocities = down * random.uniform(-1.0, 1.0, places.shape)
    spins = down / RADIUS * random.uniform(-1.0, 1.0, places.shape)
    if psi_1 is not None:
        across = psi_1 * made["friction"] / pair_of(made).kappa
    if across is not None:  # half of it by moving, half by spinning
        turn = random.uniform(0.0, 2.0 * pi)
        along = np.array([np.cos(turn), np.sin(turn), 0.0])
        velocities[0] = 0.5 * across * down * along
        spins[0] = 0.5 * across * down / RADIUS * np.array([along[1], -along[0], 0.0])
    velocities[:, 2] = -down
    wanted = flights * flight
    duration = min(wanted, max(200.0 * step, 0.3 * wanted))
    return Trial(
        made, step, duration, contact, places, velocities, spins, masses, gyration,
        np.array([0.0, 0.0, -2.0 * down / flight]), places * [1.0, 1.0, 0.0] + [0.0, 0.0, RADIUS],
        seed=tuple(seed),
    )  # fmt: skip


def overlapping(seed: Sequence[int], depth: float, steps: tuple[float, float], restitution: float) -> Trial:
    """A ball that begins inside the floor, at rest or sliding; depth: over the radius."""
    random = np.random.default_rng(list(seed))
    made = drawn(random, restitution)
    deep = depth * RADIUS
    # the speed whose impact would go as deep
    speed = float(sqrt(16.0 / 15.0 * pair_of(made).effective_modulus * sqrt(RADIUS) * deep**2.5 / MASS))
    contact = pair_of(made).contact_duration(MASS, speed)
    step = contact / 10.0 ** random.uniform(*steps)
    sliding = 0.0 if random.uniform() < 0.5 else 2.0 * speed
    place = np.array([[0.0, 0.0, RADIUS - deep]])
    velocity = sliding * np.array([[*random.uniform(-1.0, 1.0, 2), 0.0]])
    spin = sliding / RADIUS * random.uniform(-1.0, 1.0, (1, 3))
    return Trial(made, step, 20.0 * max(contact, step), contact, place, velocity, spin, seed=tuple(seed))


def resting(seed: Sequence[int], turn: float) -> Trial:
    """A ball let go just above a floor, or above a groove that it wedges into; it is to come to rest.

    turn: omega dt of the contact at rest, omega^2 = k_N/M.
    """
    random = np.random.default_rng(list(seed))
    made = drawn(random, 0.5 if seed[-1] % 2 else 0.2, friction=10.0 ** random.uniform(-1.0, 0.5))
    pull = 10.0 ** random.uniform(0.0, 2.0)
    k = 4.0 / 3.0 * pair_of(made).effective_modulus * sqrt(RADIUS)
    deep = (MASS * pull / k) ** (2.0 / 3.0)
    if deep > SHALLOW * DEEPEST * RADIUS:
        made["modulus"] *= (deep / (SHALLOW * DEEPEST * RADIUS)) ** 1.5
        deep = SHALLOW * DEEPEST * RADIUS
    period = 2.0 * pi * sqrt(deep / (1.5 * pull))
    step = turn * period / (2.0 * pi)
    planes, height = (FLOOR,), RADIUS
    if seed[-1] % 4 >= 2:
        half = sqrt(0.5)
        planes = tuple(((0.0, 0.0, 0.0), (side * half, 0.0, half)) for side in (1.0, -1.0))
        height = RADIUS / half
    datum = np.array([[0.0, 0.0, height]])
    still = np.zeros((1, 3))
    return Trial(made, step, max(20.0 * period, 200.0 * step), 0.5 * period, datum + [0.0, 0.0, deep], still, still,
                 gravity=np.array([0.0, 0.0, -pull]), datum=datum, planes=planes, rests=True, seed=tuple(seed),
    )  # fmt: skip


def chattering(seed: Sequence[int], impacts: float, restitution: float) -> Trial:
    """A ball between two walls that are hardly further apart than it is thick; impacts: in an engine step."""
    random = np.random.default_rng(list(seed))
    while (limit := fastest(made := drawn(random, restitution), MASS)) <= 10.0**SLOWEST:
        pass
    speed = 10.0 ** random.uniform(SLOWEST, min(FASTEST, log10(limit)))
    contact = pair_of(made).contact_duration(MASS, speed)
    gap = contact * speed * 10.0 ** random.uniform(-1.0, 1.0)
    between = contact + gap / speed
    step = impacts * between
    place = np.array([[0.0, 0.0, RADIUS + gap * random.uniform(0.1, 0.9)]])
    velocity = speed * np.array([[*random.uniform(-1.0, 1.0, 2), 1.0]])
    planes = (FLOOR, ((0.0, 0.0, 2.0 * RADIUS + gap), (0.0, 0.0, -1.0)))
    count = max(60.0, 20.0 * impacts)
    return Trial(
        made, step, count * between, contact, place, velocity, speed / RADIUS * random.uniform(-1.0, 1.0, (1, 3)),
        planes=planes, seed=tuple(seed),
    )  # fmt: skip


class Extreme(NamedTuple):
    """One thing taken to its ends: in words, with its unit, as a picture shows it; values, and how they are written."""

    name: str
    levels: tuple[float, ...]
    words: tuple[str, ...]


EXTREMES = {
    "poisson": Extreme("Poisson's ratio", (0.0, 0.3, 0.49, 0.4999, 0.5), ("0", "0.3", "0.49", "0.4999", "0.5")),
    "friction": Extreme("friction", (0.0, 1e-6, 1e-3, 1.0, 10.0, 1e3), ("0", "1e-6", "1e-3", "1", "10", "1000")),
    "gyration": Extreme("I/(M R$^2$)", (1.0, 2.0 / 3.0, 0.1, 1e-2, 1e-4), ("1", "2/3", "0.1", "0.01", "1e-4")),
    "psi_1": Extreme(r"$\psi_1$", (1e-6, 1e-3, 1.0, 30.0, 1e3), ("1e-6", "1e-3", "1", "30", "1000")),
    "ratio": Extreme("mass ratio", (1e-6, 1e-3, 1.0, 1e3, 1e6), ("1e-6", "1e-3", "1", "1e3", "1e6")),
    "speed": Extreme("speed [m/s]", (1e-6, 1e-3, 0.1, 10.0, 100.0), ("1e-6", "1e-3", "0.1", "10", "100")),
    "angle": Extreme("from normal [°]", (45.0, 80.0, 89.0, 89.9, 89.99), ("45", "80", "89", "89.9", "89.99")),
    "overlap": Extreme("overlap/R at start", (1e-8, 1e-6, 1e-4, 1e-2, 0.1), ("1e-8", "1e-6", "1e-4", "0.01", "0.1")),
    "rest": Extreme(r"rest, $\omega\,dt$", (0.01, 0.3, 3.0, 30.0, 1e3), ("0.01", "0.3", "3", "30", "1000")),
    "chatter": Extreme("impacts a step", (0.01, 0.1, 1.0, 10.0, 100.0), ("0.01", "0.1", "1", "10", "100")),
}  # fmt: skip


def extreme(name: str, level: int, number: int, count: int) -> Trial | None:
    """A trial of a level of one of `EXTREMES`, the even of them elastic; contacts from a thousandth of a step to
    hundreds of them, in turn."""
    value, seed = EXTREMES[name].levels[level], (list(EXTREMES).index(name), level, number)
    edges = np.linspace(*STEPS, (count + 1) // 2 + 1)
    steps = (float(edges[number // 2]), float(edges[number // 2 + 1]))
    e = 1.0 if number % 2 == 0 else 0.5
    if name == "rest":
        return resting(seed, value)
    if name == "chatter":
        return chattering(seed, value, e)
    if name == "overlap":
        return overlapping(seed, value, steps, e)
    given: dict[str, Any] = {"across": tan(radians(value))} if name == "angle" else {name: value}
    return bounces(seed, steps, flights=4, restitution=e, **given)
