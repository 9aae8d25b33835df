"""Newton's cradle: a row of touching balls is struck at one end.

All contacts act at once, and the velocity of each ball depends on how they share the force. The result is not "one in,
one out", as it is for balls a little apart. The reference is a chain of Hertz springs, integrated to 1e-10. The balls
are free in space instead of hanging, since the impact takes a ten-thousandth of a swing. They meet in line and do not
slide on each other, so rigid friction suffices; each ball reaches only its neighbours. Source: Herrmann & Schmalzle,
Simple explanation of a well-known collision experiment, Am. J. Phys. 49 (1981) 761; Hertz contact: Johnson, Contact
Mechanics (1985), section 4.2.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array
from sims.options import Option, ball_mass, of_ball, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register, signed
from sims.worlds import new_world

LEAD, AFTER = 0.0205, 0.06  # times [s] in flight before the blow and after


@register
class Cradle(Scene):
    """The balls at one end arrive with a speed; the others touch and rest."""

    name = "cradle"
    title = "Newton's cradle: touching steel balls struck at one end, compared with a chain of Hertz springs"
    engines = EVERYWHERE
    slow = 20.0
    apart, exposure = True, 0.079
    options = {
        "balls": Option(5, "number of balls", 2, 50),
        "strikers": Option(1, "number of balls that arrive with the speed", 1, 49),
        "speed": speed(1.0, "speed of the strikers"),
        "gap": Option(0.0, "gap between the resting balls, in m", 0.0, 1.0),
    } | of_ball(0.0254, 0.115, 1.0)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Move along x, without gravity."""
        if o.strikers >= o.balls:
            raise ValueError(f"strikers = {o.strikers}: must be below balls = {o.balls}")
        pair = pair_of(o)
        mass = o.mass or ball_mass(o.material, o.radius)
        world = new_world(settings, gravity=(0.0, 0.0, 0.0))
        names = [f"ball{number + 1}" for number in range(o.balls)]
        for number, name in enumerate(names):
            strikes = number < o.strikers
            place = 2.0 * o.radius * number + (-o.speed * LEAD if strikes else o.gap * (number - o.strikers))
            world.ball(name, o.radius, mass, [place, 0.0, 0.0], [o.speed if strikes else 0.0, 0.0, 0.0])
        for number in range(1, o.balls, 2):  # every other ball with its neighbours
            world.contact(names[number], names[number - 1 : number + 2 : 2], pair, speed=o.speed)
        return world.record(LEAD + AFTER)

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Each ball's speed [m/s]."""
        return [
            (float(track.positions[entry, 0]), -track.size[0], signed(track.velocities[entry, 0], 2))
            for track in recording.tracks
        ]

    def caption(self, recording: Recording) -> str:
        """What the numbers are."""
        return "velocities before and after the impact, m/s"

    def measure(self, recording: Recording) -> Measured:
        """Velocities after the impact, and those of the chain."""
        o = recording.o
        pair = replace(pair_of(o), radius=0.5 * o.radius)
        after = np.array([track.velocities[-1] for track in recording.tracks])
        mass = recording.tracks[0].mass
        energy = np.sum([track.energy() for track in recording.tracks], axis=0)
        out: Measured = recording.told("material")
        return out | {
            "velocities": after[:, 0].tolist(),
            "velocities_chain": hertz_chain(pair, mass, len(after), o.strikers, o.speed, o.gap).tolist(),
            "aside": float(np.abs(after[:, 1:]).max()),
            "momentum_ratio": float(after[:, 0].sum() / (o.strikers * o.speed)),
            "energy_ratio": float(energy[-1] / energy[0]), "restitution": o.restitution,
        }  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """Momentum for any law; velocities for laws with an elastic Hertz normal force."""
        speed = max(np.abs(measured["velocities_chain"]))
        out = [Limit("relative change of momentum", 1e-9, abs(measured["momentum_ratio"] - 1.0))]
        if measured["law"] not in ("native", "linear_spring") and measured["restitution"] == 1.0:
            error = np.abs(np.subtract(measured["velocities"], measured["velocities_chain"])).max() / speed
            out += [
                Limit("greatest error of a velocity, over the greatest velocity", 5e-3, float(error)),
                Limit("relative change of energy", 1e-3, abs(measured["energy_ratio"] - 1.0)),
                Limit("sideways velocity over the greatest velocity", 1e-9, measured["aside"] / float(speed)),
            ]
        return out


def pair_of(o: Any) -> ContactPair:
    """Of two balls."""
    return ContactPair(o.material, o.material, o.friction, o.restitution, law="coulomb")


def hertz_chain(pair: ContactPair, mass: float, count: int, strikers: int, speed: float, gap: float) -> Array:
    """Velocities [m/s] of a row of equal balls after the first ones have arrived with a speed.

    Args:
        pair: Pair of two balls, with its radius.
        mass: Mass of a ball [kg].
        count, strikers: Number of balls, and of those that arrive.
        speed: Speed of the strikers [m/s].
        gap: Gap between the resting balls [m].
    """
    from scipy.integrate import solve_ivp

    depth = pair.greatest_overlap(0.5 * mass, speed)  # scales: a length, and the time depth/speed
    stiffness = 4.0 / 3.0 * pair.effective_modulus * pair.radius**0.5 if pair.radius else float("nan")
    factor = stiffness * depth**2.5 / (mass * speed**2)

    def rates(_: float, state: Array) -> Array:
        force = factor * np.maximum(state[: count - 1] - state[1:count], 0.0) ** 1.5
        return np.concatenate([state[count:], np.append(0.0, force) - np.append(force, 0.0)])

    def together(_: float, state: Array) -> float:
        """Below zero once no two balls touch or come nearer."""
        near = (state[: count - 1] > state[1:count]) | (state[count:-1] > state[count + 1 :])
        return 1.0 if near.any() else -1.0

    together.terminal = True  # type: ignore[attr-defined]
    start = np.zeros(2 * count)
    start[strikers:count] = np.arange(count - strikers) * gap / depth
    start[count : count + strikers] = 1.0
    end = AFTER * speed / depth
    path = solve_ivp(rates, (0.0, end), start, method="DOP853", rtol=1e-10, atol=1e-12, max_step=1.0, events=together)
    return speed * path.y[count:, -1]
