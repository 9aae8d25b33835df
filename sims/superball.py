"""The superball of the scenes: properties, limits on its bounces, and its flight by a rule for the bounce.

A homogeneous ball, 1/K^2 = 2.5. Thrown with backspin R omega = 2.5 v it has no angular momentum about the contact
point. No contact force changes that, so that a bounce multiplies both v and omega by -e_t, where e_t is the share of
the contact point's velocity that the contact reverses: the ball reverses at every bounce.

Sources: size and mass: R. Cross, Am. J. Phys. 70 (2002) 1093, and about his restitution, 0.91 at 1.6 m/s; e_t = 1: R.
L. Garwin, Am. J. Phys. 37 (1969) 88. Friction is representative of dry rubber. kappa is the value that measured
superballs suggest in place of the 2/3 of a small contact of incompressible rubber
(`validation/cases/superball_and_golf.py`). Cross gives no modulus: that of the material is used, with which the contact
lasts some 3 ms.
"""

from collections.abc import Callable
from itertools import pairwise
from math import pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np

from contactlaw import MATERIALS, RIGID, ContactPair
from sims.bounces import Bounce
from sims.loaded_rebound import loaded_rebound, scaled_load
from sims.options import of_ball
from sims.recording import Array, Recording, Track
from sims.scene import NATIVES, Limit, Measured

RADIUS = 0.023  # [m]
MASS = 0.0464  # [kg]
FRICTION, RESTITUTION, KAPPA = 1.0, 0.9, 0.60
OPTIONS = of_ball(RADIUS, FRICTION, RESTITUTION, MASS)
BACKSPIN = 2.5  # R omega/v of a homogeneous ball without angular momentum about its contact point
GRAVITY = 9.81  # [m/s^2]
MOST_SPINS = 5  # in words
INTERVAL = 2e-3  # between two entries of a recording [s]
MOST_BOUNCES = 20  # the reference wants a ball that leaves

Rule = Callable[[Array, Array, Array, float], tuple[Array, Array]]
"""Velocity and spin after a bounce from velocity, spin and normal before it and the radius [m]."""
DEFAULT = SimpleNamespace(material="rubber", **{name: one.default for name, one in OPTIONS.items()})


def pair_of(o: Any = DEFAULT) -> ContactPair:
    """Pair of the ball and a hard surface."""
    rubber = MATERIALS[o.material]
    return ContactPair(rubber, RIGID, o.friction, o.restitution, radius=o.radius, stiffness_ratio=KAPPA)


def by_reference(pair: ContactPair, mass: float) -> Rule:
    """Rule of the bounce by the annulus solver, with the ball's weight acting during the contact."""

    def rule(velocity: Array, spin: Array, normal: Array, radius: float) -> tuple[Array, Array]:
        approach = -float(velocity @ normal)
        load = scaled_load(pair, mass, approach, GRAVITY * float(normal[2]))
        point = velocity - radius * np.cross(spin, normal)
        sliding = point + approach * normal
        speed = float(np.linalg.norm(sliding))
        along = sliding / speed if speed else np.zeros(3)
        psi_1 = pair.psi(speed, approach)
        after = loaded_rebound(psi_1, pair.chi(1.0, 1.0 / 3.5), pair.restitution, load)
        change = (after.psi_2 / psi_1 - 1.0) * speed if psi_1 else 0.0
        return _pushed(velocity, spin, -radius * normal, after.restitution, change * along)

    return rule


def garwin(velocity: Array, spin: Array, normal: Array, radius: float) -> tuple[Array, Array]:
    """Rule of the bounce of Garwin's perfectly rough and elastic ball: the contact point's velocity is reversed."""
    point = velocity - radius * np.cross(spin, normal)
    return _pushed(velocity, spin, -radius * normal, 1.0, -2.0 * (point - float(point @ normal) * normal))


def _pushed(velocity: Array, spin: Array, arm: Array, restitution: float, change: Array) -> tuple[Array, Array]:
    """Velocity and spin after a contact force at the end of an arm has changed the tangential velocity there."""
    square = float(arm @ arm)
    bounced = velocity - (1.0 + restitution) * float(velocity @ arm) / square * arm
    return bounced + change / 3.5, spin + np.cross(arm, change / 3.5) / (0.4 * square)


def energy_of(o: Any, velocity: Array, spin: Array, height: float) -> float:
    """Kinetic and potential energy [J]."""
    turning = 0.4 * o.radius**2 * spin @ spin
    return float(o.mass * (0.5 * (velocity @ velocity + turning) + GRAVITY * height))


def flight(like: Recording, rule: Rule, bounces: int, duration: float = np.inf) -> Recording:
    """The flight over the floor from the same throw by a rule for the bounce, in closed form between bounces.

    A bounce takes no time here. The motion is in the plane of x and z.

    Args:
        like: The recording whose ball, first entry and surroundings to take.
        rule: For the bounce.
        bounces: After so many it ends in flight.
        duration: Longest [s].
    """
    ball = like.track("ball")
    radius = ball.size[0]
    pull = np.array(like.facts["gravity"])
    time, place, velocity, spin = 0.0, ball.positions[0], ball.velocities[0], ball.spins[0]
    legs = []
    for number in range(bounces + 1):
        fall = sqrt(velocity[2] ** 2 + 2.0 * GRAVITY * (place[2] - radius))
        wait = min((velocity[2] + fall) / GRAVITY, duration - time)
        legs.append((time, time + wait, place, velocity, spin))
        if number == bounces or time + wait >= duration:
            break
        place = place + wait * (velocity + 0.5 * wait * pull)
        velocity, spin = rule(velocity + wait * pull, spin, np.array([0.0, 0.0, 1.0]), radius)
        time += wait
    times = np.append(np.arange(0.0, legs[-1][1], INTERVAL), legs[-1][1])
    which = np.searchsorted([leg[0] for leg in legs], times, side="right") - 1
    waits = times - np.array([legs[i][0] for i in which])
    velocities = np.array([legs[i][3] + wait * pull for i, wait in zip(which, waits, strict=True)])
    places = np.array([legs[i][2] + w * (legs[i][3] + 0.5 * w * pull) for i, w in zip(which, waits, strict=True)])
    spins = np.array([legs[i][4] for i in which])
    turned = np.concatenate([[0.0], np.cumsum([(leg[1] - leg[0]) * leg[4][1] for leg in legs])])[which]
    angles = turned + waits * spins[:, 1]
    c, s, o = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    turns = np.moveaxis(np.array([[c, o, s], [o, o + 1.0, o], [-s, o, c]]), -1, 0)
    track = Track(ball.name, ball.shape, ball.size, places, turns, velocities, spins, ball.mass, ball.inertia)
    return Recording(times, [track], like.scenery, like.view, {"gravity": pull.tolist()})


def describe(bounce: Bounce, o: Any) -> Measured:
    """A bounce as --json prints it, with the reference's result for the same impact."""
    pair = pair_of(o)
    before, after = bounce.sliding(o.radius)
    velocity, spin = by_reference(pair, o.mass)(bounce.velocity_before, bounce.spin_before, bounce.normal, o.radius)
    expected = velocity - o.radius * np.cross(spin, bounce.normal)
    height = float(bounce.place[2])
    return {
        "time": bounce.time,
        "x": float(bounce.place[0]),
        "psi1": pair.psi(before, bounce.approach),
        "psi2": pair.psi(after, bounce.approach),
        "psi2_reference": pair.psi(float(expected[0]), bounce.approach),
        "spin_before": float(bounce.spin_before[1]),
        "spin_after": float(bounce.spin_after[1]),
        "energy": energy_of(o, bounce.velocity_after, bounce.spin_after, height),
        "surface": "floor" if bounce.normal[2] > 0.0 else "table",
        "duration": bounce.duration,
        "velocity_before": bounce.velocity_before[[0, 2]].tolist(),
        "velocity_after": bounce.velocity_after[[0, 2]].tolist(),
        "velocity_after_reference": velocity[[0, 2]].tolist(),
        "spin_after_reference": float(spin[1]),
        "energy_before": energy_of(o, bounce.velocity_before, bounce.spin_before, height),
    }


def check_bounces(bounces: list[Measured], law: str, wanted: int) -> list[Limit]:
    """Limits on the bounces of any superball; against the reference for `microslip` only."""
    checks = [Limit("bounces", wanted, len(bounces), at_least=True)]
    if not bounces:
        return checks
    first = bounces[0]["energy_before"]
    if law not in ("mindlin", *NATIVES):  # these may gain energy
        gained = max(one["energy"] - one["energy_before"] for one in bounces)
        checks.append(Limit("energy gained in a bounce, over the first", 0.0, gained / first))
    drift = max((abs(two["energy_before"] - one["energy"]) for one, two in pairwise(bounces)), default=0.0)
    checks.append(Limit("energy change in flight, over the first", 1e-6, drift / first))
    if law != "microslip":
        return checks
    worst = max(abs(one["psi2"] - one["psi2_reference"]) for one in bounces)
    return checks + [
        Limit("error of psi2 at a bounce", 1e-2, worst),
        Limit("error of the velocity after a bounce", 0.03, max(_velocity_error(one) for one in bounces)),
        Limit("error of the spin after a bounce", 0.03, max(_spin_error(one) for one in bounces)),
    ]


def _velocity_error(one: Measured) -> float:
    got, asked = np.array(one["velocity_after"]), np.array(one["velocity_after_reference"])
    return float(np.linalg.norm(got - asked) / np.linalg.norm(asked))


def _spin_error(one: Measured) -> float:
    asked = one["spin_after_reference"]
    return abs(one["spin_after"] - asked) / max(abs(asked), 1e-12)


def settled(recording: Recording, bounces: list[Bounce], **more: Any) -> Measured:
    """Results that the superball scenes share."""
    facts, pair = recording.told(), pair_of(recording.o)
    contact = {"material": pair.a.name, "mu": pair.friction, "kappa": pair.kappa, "restitution": pair.restitution}
    shared = {"chi": pair.chi(1.0, 1.0 / 3.5)}
    if bounces:
        shared["turns_a_second"] = abs(bounces[0].spin_before[1]) / (2.0 * pi)
    return facts | contact | shared | {"bounces": [describe(b, recording.o) for b in bounces]} | more


def spins_in_words(recording: Recording, bounces: list[Bounce], until: float) -> str:
    """The spins of one flight after another, up to a time [s], for a picture."""
    shown = [one.spin_after for one in bounces if one.time < until]
    spins = [round(float(spin[1])) for spin in (recording.track("ball").spins[0], *shown)]
    spins, more = spins[:MOST_SPINS], len(spins) > MOST_SPINS
    words = [f"{spin:+d}".replace("-", "\N{MINUS SIGN}") if spin else "0" for spin in spins]
    return "spin " + " \N{RIGHTWARDS ARROW} ".join(words) + (" ..." if more else "") + " rad/s"
