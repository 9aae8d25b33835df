"""A trial inside an engine, with the law, with its own contact, or with the law evaluated but once a step."""

from hashlib import sha256
from itertools import combinations, product
from pathlib import Path

import numpy as np

from contactlaw import LAWS
from contactlaw.jit import jit_for
from contactlaw.laws.hertz import BY_ITSELF
from contactlaw.laws.record import OPEN, PAIR_SIZE, pair_of
from contactlaw.laws.step import ask, press, reset
from contactlaw.world.contacts.substep import force_of, turn_frame
from contactlaw.world.data.records import CONTACT
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, scale, store, sub, tangent
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
        couples = np.array([*product(range(count), range(-planes, 0)), *combinations(range(count), 2)])
        points, normals = (np.array(one, dtype=float) for one in zip(*trial.planes, strict=True))
        inverse = np.column_stack([1.0 / trial.masses, 1.0 / trial.inertias])
        self.scene = couples, points, normals, inverse, trial.gravity, trial.step
        self.contacts = np.zeros(len(couples), CONTACT)
        self.contacts["touch"]["overlap"] = np.nan  # not known before the first step
        self.memory, self.parameters = np.zeros((len(couples), pair.memory_size)), pair.parameters()

    def push(self, places: Array, velocities: Array, spins: Array) -> Array:
        """Force [N] and torque [N m] on every ball, shape (n, 6), for the coming step, of places at its start [m] and
        velocities and spins of half a step before, as a semi-implicit engine keeps them, shape (n, 3)."""
        out = np.zeros((len(places), 6))
        _push(self.scene, self.parameters, self.contacts, self.memory, places, velocities, spins, out)
        return out


@jit
def _push(scene, p, contacts, memories, places, velocities, spins, out):
    couples, points, normals, inverse, gravity, dt = scene
    pair = pair_of(p)
    for number in range(couples.shape[0]):
        a, b = couples[number]
        c, memory, arm, free = contacts[number], memories[number], RADIUS, 0.0
        velocity, spin, (mobility, turning) = load(velocities[a]), load(spins[a]), (inverse[a, 0], inverse[a, 1])
        if b < 0:
            n = load(normals[b])
            overlap, free = RADIUS - dot(sub(load(places[a]), load(points[b])), n), -dot(load(gravity), n)
        else:
            between = sub(load(places[a]), load(places[b]))
            arm = 0.5 * norm(between)
            n, overlap = scale(0.5 / arm, between), 2.0 * (RADIUS - arm)
            velocity, spin = sub(velocity, load(velocities[b])), add(spin, load(spins[b]))
            mobility, turning = mobility + inverse[b, 0], turning + inverse[b, 1]
        t, before = c.touch, c.touch.overlap
        t.overlap, t.before = overlap, overlap if before != before else before
        if overlap <= 0.0:
            t.state, memory[:] = OPEN, 0.0
            continue
        if t.state == OPEN:
            reset(t, pair, pair.radius)
            t.mass, t.tangential_mass = 1.0 / mobility, 1.0 / (mobility + arm**2 * turning)
            store(c.normal, n)
            store(c.tangent, tangent(n))
        turn_frame(c, n, 0.5 * dt * dot(spin, n))
        velocity, first = axpy(-arm, cross(spin, n), velocity), load(c.tangent)
        t.closing = -dot(velocity, n)
        press(t, pair, dt, (free, *BY_ITSELF[1:]))
        ask(t, pair, p[PAIR_SIZE:], memory, dt * dot(velocity, first), dt * dot(velocity, cross(n, first)), dt)
        force = force_of(c)
        for ball, side in ((a, 1.0), (b, -1.0)):
            if ball >= 0:
                store(out[ball], add(load(out[ball]), scale(side, force)))
                store(out[ball, 3:], axpy(-arm, cross(n, force), load(out[ball, 3:])))
