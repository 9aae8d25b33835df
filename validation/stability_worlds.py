"""A trial inside an engine, with the law, with its own contact, or with the law evaluated but once a step."""

from hashlib import sha256
from itertools import combinations
from math import cos, inf, sin, sqrt
from pathlib import Path

import numpy as np

from contactlaw import LAWS
from contactlaw.jit import jit_for
from contactlaw.laws.record import CONTACT_SIZE, OPEN, PAIR_SIZE, contact_of, pair_of
from contactlaw.laws.step import ask, know, press
from sims.panel import ENGINE_NAMES
from sims.scene import Settings
from sims.worlds import State, new_world
from validation.ball import linear_spring
from validation.case import Array
from validation.stability_trials import RADIUS, Trial

ENGINES = ("mujoco", "pybullet")
TITLES = {name: ENGINE_NAMES[name] for name in ENGINES}
SUB_CYCLED = tuple(LAWS)[::-1]
ONCE, NATIVE, STIFF = "microslip, once a step", "native", "native, as stiff"
WAYS = (*SUB_CYCLED, ONCE, NATIVE, STIFF)
"""The laws, sub-cycled; microslip as a discrete-element code would have it; the engine's own contact, as a user has it
who sets friction (and in PyBullet restitution), and with a spring and damper of the contact's duration and
restitution."""

jit = jit_for(sha256(Path(__file__).read_bytes()).hexdigest())


class TrialWorld:
    """A trial begun in one of `ENGINES`, by one of `WAYS`."""

    def __init__(self, engine: str, trial: Trial, way: str) -> None:
        self.world = world = new_world(Settings(engine, timestep=trial.step), trial.gravity)
        planes = [f"plane{number}" for number in range(len(trial.planes))]
        for name, (point, normal) in zip(planes, trial.planes, strict=True):
            world.plane(name, point, normal)
        balls = [f"ball{number}" for number in range(len(trial.masses))]
        states = trial.places, trial.velocities, trial.spins
        for name, mass, inertia, *state in zip(balls, trial.masses, trial.inertias, *states, strict=True):
            world.ball(name, RADIUS, float(mass), *state, inertia=inertia)
        self.once = OnceAStep(trial) if way == ONCE else None
        e = trial.made["restitution"]
        if way in LAWS:
            world.contact(balls, [*balls, *planes], trial.pair(way))
        elif self.once is None:
            world.native(trial.made["friction"], e, linear_spring(trial.contact, e) if way == STIFF else None)
        world.start()

    def step(self, count: int) -> None:
        """Go on."""
        if self.once is None:
            self.world.step(count)
            return
        for _ in range(count):
            state = self.world.read()
            behind = state.velocity - 0.5 * self.world.timestep * self.world.gravity  # as semi-implicit engines keep it
            self.world.push(self.once.push(state.position, behind, state.spin))
            self.world.step()

    def read(self) -> State:
        """The balls now."""
        return self.world.read()

    def broken(self) -> bool:
        """Whether the engine itself says that something went wrong; PyBullet never does."""
        data = getattr(self.world, "data", None)
        return data is not None and bool(data.warning.number.any())


class OnceAStep:
    """The law as discrete-element codes have theirs: evaluated once in a step, at the positions of its start.

    This is what sub-cycling is measured against. It is a leapfrog: a stuck contact of frequency omega grows without
    bound where omega dt > 2, whatever the law, and loses or gains a part of the energy long before.
    """

    def __init__(self, trial: Trial, law: str = "microslip") -> None:
        pair = trial.pair(law)
        count, planes = len(trial.masses), len(trial.planes)
        couples = [(ball, -1 - plane) for plane in range(planes) for ball in range(count)]
        couples = np.array(couples + [*combinations(range(count), 2)])
        points, normals = (np.array(one, dtype=float) for one in zip(*trial.planes, strict=True))
        inverse = np.column_stack([1.0 / trial.masses, 1.0 / trial.inertias])
        self.scene = couples, points, normals, inverse, trial.gravity, trial.step
        self.contacts = np.zeros((len(couples), CONTACT_SIZE)), np.zeros((len(couples), pair.memory_size))
        self.frames = np.zeros((len(couples), 6)), np.full(len(couples), -inf)
        self.parameters = pair.parameters()

    def push(self, places: Array, velocities: Array, spins: Array) -> Array:
        """Force [N] and torque [N m] on every ball, shape (n, 6), for the coming step, of places at its start [m] and
        velocities and spins of half a step before, as a semi-implicit engine keeps them, shape (n, 3)."""
        out = np.zeros((len(places), 6))
        _push(self.scene, self.parameters, self.contacts, self.frames, places, velocities, spins, out)
        return out


@jit
def _push(scene, p, contacts, frames, places, velocities, spins, out):
    couples, points, normals, inverse, gravity, dt = scene
    for number in range(couples.shape[0]):
        a, b = couples[number]
        arm = RADIUS
        if b < 0:
            normal = normals[-1 - b].copy()
            overlap = RADIUS - np.sum((places[a] - points[-1 - b]) * normal)
            velocity, spin = velocities[a].copy(), spins[a].copy()
            free = -np.sum(gravity * normal)
            mobility, turning = inverse[a, 0], RADIUS**2 * inverse[a, 1]
        else:
            between = places[a] - places[b]
            distance = sqrt(np.sum(between * between))
            normal = between / distance
            overlap, arm, free = 2.0 * RADIUS - distance, 0.5 * distance, 0.0
            velocity, spin = velocities[a] - velocities[b], spins[a] + spins[b]
            mobility = inverse[a, 0] + inverse[b, 0]
            turning = arm**2 * (inverse[a, 1] + inverse[b, 1])
        velocity -= arm * np.cross(spin, normal)
        frame, before = frames[0][number], frames[1][number]
        frames[1][number] = overlap
        first = _tangent(frame, normal, 0.5 * dt * np.sum(spin * normal))
        second = np.cross(normal, first)
        frame[:3], frame[3:] = first, normal
        header, memory = contacts[0][number], contacts[1][number]
        if overlap <= 0.0:
            header[:], memory[:] = 0.0, 0.0
            continue
        contact, pair = contact_of(header), pair_of(p)
        if contact.state == OPEN:
            know(contact, pair, pair.radius)
            contact.mass, contact.tangential_mass = 1.0 / mobility, 1.0 / (mobility + turning)
        contact.overlap, contact.before = overlap, overlap if before == -np.inf else before
        contact.closing = -np.sum(velocity * normal)
        slide, aside = dt * np.sum(velocity * first), dt * np.sum(velocity * second)
        press(contact, pair, free, dt)
        ask(contact, pair, p[PAIR_SIZE:], memory, slide, aside, dt)
        total = contact.force * normal - contact.f * first - contact.g * second
        torque = -arm * np.cross(normal, total)
        out[a, :3] += total
        out[a, 3:] += torque
        if b >= 0:
            out[b, :3] -= total
            out[b, 3:] += torque


@jit
def _tangent(frame, normal, twist):
    """The first tangent brought into the new tangent plane by the shortest rotation, and turned by twist [rad]."""
    old, n = frame[:3], frame[3:]
    lean = max(1.0 + np.sum(normal * n), 1e-300)
    t = old - np.sum(old * normal) / lean * (normal + n)
    if lean < 1.0 or np.sum(t * t) < 0.5:  # no contact yet, or a normal that has jumped: any tangent will do
        t = np.cross(np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.6 else np.array([0.0, 1.0, 0.0]), normal)
    t = cos(twist) * t + sin(twist) * np.cross(normal, t)
    return t / sqrt(np.sum(t * t))
