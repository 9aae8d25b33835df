"""Newton's cradle: balls in touch are struck at one end.

All contacts act at once, and what each ball leaves with depends on how the forces share: it is not one out for one in,
as it is when the balls stand a little apart. The truth is a chain of Hertz springs, integrated here to 1e-10. The balls
are free in space instead of hung: an impact takes a ten-thousandth of a swing. They meet in line, no ball slides on
another, so that rigid friction will do; and none can reach any but its neighbours. Source: Herrmann & Schmalzle, Simple
explanation of a well-known collision experiment, Am. J. Phys. 49 (1981) 761; Hertz contact: Johnson, Contact Mechanics
(1985), section 4.2.
"""

from __future__ import annotations

from math import pi

import numpy as np

from contactlaw import MATERIALS, ContactPair, checks
from sims.contact_point import Array
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Measured, Scene, Settings, register
from sims.worlds import new_world

RADIUS = 0.0254  # [m]
FRICTION = 0.115
LEAD, AFTER = 0.0205, 0.06  # times [s] in flight before the blow and after


@register
class Cradle(Scene):
    """A row of balls, some of which come with a speed."""

    name = "cradle"
    title = "Newton's cradle: a row of steel balls in touch, struck at one end, against a chain of Hertz springs"
    engines = EVERYWHERE
    slow = 20.0
    options = {
        "balls": (5, "how many there are"),
        "strikers": (1, "how many of them come with the speed"),
        "speed": (1.0, "theirs, in m/s"),
        "gap": (0.0, "between the others, in m"),
    }

    def run(self, settings: Settings) -> Recording:
        """Along x, without gravity."""
        self.demand(settings)
        count, strikers = (checks.count(name, int(self.option(settings, name)), least)
                           for name, least in (("balls", 2), ("strikers", 1)))  # fmt: skip
        if strikers >= count:
            raise ValueError(f"strikers = {strikers}: must be below balls = {count}")
        speed = checks.positive("speed", self.option(settings, "speed"))
        gap = checks.not_negative("gap", self.option(settings, "gap"))
        material = settings.material or "steel"
        pair = ContactPair(MATERIALS[material], MATERIALS[material], FRICTION, law="coulomb")
        mass = 4.0 / 3.0 * pi * RADIUS**3 * (MATERIALS[material].density or 1000.0)

        world = new_world(settings, gravity=(0.0, 0.0, 0.0))
        names = [f"ball{number + 1}" for number in range(count)]
        for number, name in enumerate(names):
            strikes = number < strikers
            place = 2.0 * RADIUS * number + (-speed * LEAD if strikes else gap * (number - strikers))
            world.ball(name, RADIUS, mass, [place, 0.0, 0.0], [speed if strikes else 0.0, 0.0, 0.0])
        for number in range(1, count, 2):  # every other ball with its neighbours
            world.contact(names[number], names[number - 1 : number + 2 : 2], pair, speed=speed)
        return world.record(LEAD + AFTER, material=material, strikers=strikers, speed=speed, gap=gap)

    def marks(self, recording: Recording) -> list[tuple[float, float, str]]:
        """Each ball's speed before the blow and after it [m/s]."""
        arrow = " \N{RIGHTWARDS ARROW} "
        return [
            (float(track.positions[-1, 0]), -RADIUS, arrow.join(_speed(track.velocities[i, 0]) for i in (0, -1)))
            for track in recording.tracks
        ]

    def caption(self, recording: Recording) -> str:
        """What the numbers are."""
        return "speeds before and after the blow, m/s"

    def measure(self, recording: Recording) -> Measured:
        """Velocities after the blow, and the chain's."""
        facts = recording.facts
        pair = ContactPair(MATERIALS[facts["material"]], MATERIALS[facts["material"]], FRICTION, radius=0.5 * RADIUS)
        after = np.array([track.velocities[-1] for track in recording.tracks])
        mass, speed = recording.tracks[0].mass, facts["speed"]
        energy = np.sum([track.energy() for track in recording.tracks], axis=0)
        out: Measured = recording.told("material")
        return out | {
            "velocities": after[:, 0].tolist(),
            "velocities_chain": hertz_chain(pair, mass, len(after), facts["strikers"], speed, facts["gap"]).tolist(),
            "aside": float(np.abs(after[:, 1:]).max()),
            "momentum_ratio": float(after[:, 0].sum() / (facts["strikers"] * speed)),
            "energy_ratio": float(energy[-1] / energy[0]),
        }  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """Momentum by any law, velocities by those whose normal force is Hertz's."""
        speed = max(np.abs(measured["velocities_chain"]))
        out = [Limit("change of momentum over that before", 1e-9, abs(measured["momentum_ratio"] - 1.0))]
        if measured["law"] not in ("native", "linear_spring"):
            error = np.abs(np.subtract(measured["velocities"], measured["velocities_chain"])).max() / speed
            out += [
                Limit("greatest error of a velocity over the greatest", 5e-3, float(error)),
                Limit("change of energy over that before", 1e-3, abs(measured["energy_ratio"] - 1.0)),
                Limit("velocity aside over the greatest", 1e-9, measured["aside"] / float(speed)),
            ]
        return out


def _speed(value: float) -> str:
    return f"{abs(value) if abs(value) < 5e-3 else value:.2f}".replace("-", "\N{MINUS SIGN}")


def hertz_chain(pair: ContactPair, mass: float, count: int, strikers: int, speed: float, gap: float) -> Array:
    """Velocities [m/s] of a row of equal balls after the first ones came with a speed.

    Args:
        pair: Of two balls, with its radius.
        mass: Of each [kg].
        count, strikers: Balls, and how many come.
        speed: [m/s].
        gap: Between those that are struck [m].
    """
    from scipy.integrate import solve_ivp

    depth = pair.greatest_overlap(0.5 * mass, speed)  # scales: a length, and the time depth/speed
    stiffness = 4.0 / 3.0 * pair.effective_modulus * pair.radius**0.5 if pair.radius else float("nan")
    factor = stiffness * depth**2.5 / (mass * speed**2)

    def rates(_: float, state: Array) -> Array:
        force = factor * np.maximum(state[: count - 1] - state[1:count], 0.0) ** 1.5
        return np.concatenate([state[count:], np.append(0.0, force) - np.append(force, 0.0)])

    start = np.zeros(2 * count)
    start[strikers:count] = np.arange(count - strikers) * gap / depth
    start[count : count + strikers] = 1.0
    end = AFTER * speed / depth
    path = solve_ivp(rates, (0.0, end), start, method="DOP853", rtol=1e-10, atol=1e-12, max_step=1.0)
    return speed * path.y[count:, -1]
