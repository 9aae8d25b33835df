"""Random drops run in a world and in both engines, and judged: energy, depth, rest."""

import warnings
from abc import ABC, abstractmethod
from contextlib import closing
from itertools import combinations, product
from time import process_time
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlaw.world.data.frames import matrix_of
from contactlaw.world.data.records import CLOSED, FREE
from sims.scene import Settings
from sims.worlds import State, Tuning, new_world
from validation.case import Array
from validation.shape_draws import GRAVITY, WALL, WALLS, Drop, Thing

Met = tuple[float, float, tuple[int, ...]]

LONGEST = 10.0  # [s] that a drop may take to come to rest
PATIENCE = 20.0  # [s] of CPU that steps take: looks at a run cost more than these
GAIN = 1e-2  # of the energy at the start
LIGHT = 1e-4  # of the same, energy in contacts that is none
STILL = 1e-6  # of the same, energy of motion of centres that is none: what spins on a small patch does so for minutes
FLIGHT = 0.1  # of the same: where an engine's own flight changes it by more, what contacts do is not told
DEEPER = 1.3  # times the overlap that holds all the energy in one contact
FRICTIONLESS = 0.05  # friction below which nothing stops what slides or spins
FLOOR = (0.4, 0.4, 0.05)  # half lengths of one that is a box [m]


class Look(NamedTuple):
    """What there is after a step: energy of motion and height of each thing [J], shape (n,), of the motion of centres
    but around axes that stand, and held by contacts [J]; the greatest overlap [m]; which things touch or touched within
    the step, and which touch at its end, shape (n,)."""

    energy: Array
    linear: float
    held: float
    overlap: float
    touched: NDArray[np.bool_]
    pressed: NDArray[np.bool_]


class Run(ABC):
    """A drop in an engine."""

    engine: ClassVar[str]

    def __init__(self, drop: Drop) -> None:
        self.drop, self._axes = drop, np.full((len(drop.things), 3), np.nan)
        settings, tuning = Settings(self.engine, timestep=drop.step), Tuning(drop.integrator)
        self.world: Any = new_world(settings, (0.0, 0.0, -GRAVITY), tuning)
        if drop.flat:
            self.world.plane("floor")
        else:
            self.world.block("floor", FLOOR, (0.0, 0.0, -FLOOR[2]))
        pit = ["floor", *(f"wall{number}" for number in range(len(WALLS)))]
        for name, (point, inward) in zip(pit[1:], WALLS, strict=True):
            self.world.plane(name, point, inward)
        parts = [self.add(f"thing{number}", thing) for number, thing in enumerate(drop.things)]
        for part, thing in zip(parts, drop.things, strict=True):
            self.world.contact(part, pit, drop.pair(thing.material, thing.material))
        for (one, first), (two, second) in combinations(zip(parts, drop.things, strict=True), 2):
            self.world.contact(one, two, drop.pair(first.material, second.material))
        self.world.start()

    def add(self, name: str, thing: Thing) -> str:
        """A thing, by what name it touches."""
        shape, size = ("ball" if thing.kind == "sphere" else thing.kind), thing.size
        self.world.solid(name, shape, thing.points if shape == "hull" else size, thing.mass, thing.moments, thing.place,
                         thing.velocity, thing.spin, matrix_of(thing.turn))  # fmt: skip
        return name

    def states(self) -> State:
        """All things now."""
        return self.world.read()

    @abstractmethod
    def contacts(self) -> list[Met]:
        """Overlap [m] and normal force [N] of what touches or touched within the step, and the numbers of both bodies,
        those of things from 0 on."""

    def look(self) -> Look:
        """Where energy is now.

        What spins on a patch beside its centre, tilted as its resistance to rolling lets it, takes its centre around
        a vertical axis: of the motion of both that of the slower one counts.
        """
        states = self.states()
        energy = np.array([t.energy(*state) for t, *state in zip(self.drop.things, *states, strict=True)])
        places, _, velocities, spins = states
        with np.errstate(divide="ignore", invalid="ignore"):
            axes = places + np.cross((0.0, 0.0, 1.0), velocities) / spins[:, 2:]
            speeds = np.linalg.norm(axes - self._axes, axis=1) / self.drop.step
        self._axes = axes
        turning = 0.5 * np.array([thing.mass for thing in self.drop.things]) * speeds**2
        met, bodies = self.contacts(), np.arange(len(energy))
        held = sum(0.4 * max(overlap, 0.0) * force for overlap, force, _ in met)
        touched, pressed = (np.isin(bodies, [body for one in met for body in one[2] if one[0] > least])
                            for least in (-np.inf, 0.0))  # fmt: skip
        deepest = max([0.0, *(one[0] for one in met)])
        return Look(energy.sum(1), float(np.fmin(energy[:, 0], turning).sum()), held, deepest, touched, pressed)

    def sunk(self) -> float:
        """How far the lowest thing reaches below the floor [m], but for a twentieth of the radius of its edges."""
        places, turns, _, _ = self.states()
        return max(
            thing.reach(-turn[2]) - float(place[2]) - 0.05 * thing.least
            for thing, place, turn in zip(self.drop.things, places, turns, strict=True)
        )


class InWorld(Run):
    """Without an engine."""

    engine = "none"

    def add(self, name: str, thing: Thing) -> str:
        """As `Run.add`; a box may have ball feet."""
        if thing.kind != "feet":
            return super().add(name, thing)
        corners = (thing.size - thing.least) * np.array(list(product((-1.0, 1.0), repeat=3)))
        self.world.solid(name, "balls", [[thing.least, *corner] for corner in corners], thing.mass, thing.moments,
                         thing.place, thing.velocity, thing.spin, matrix_of(thing.turn))  # fmt: skip
        return name

    def contacts(self) -> list[Met]:
        """As `Run.contacts`."""
        rows = self.world.world.contacts
        forces = np.abs((rows["force"] * rows["normal"]).sum(1))
        return [(float(x), float(p), tuple(both.tolist()))
                for x, p, both in zip(rows["overlap"], forces, rows["bodies"], strict=True)]  # fmt: skip


class InMujoco(Run):
    """By the plugin."""

    engine = "mujoco"

    def __init__(self, drop: Drop) -> None:
        from contactlaw.mujoco_plugin.readout import view_of

        super().__init__(drop)
        self.model, self.data = self.world.model, self.world.data
        self.view = view_of(self.model, self.data)

    def states(self) -> State:
        """As `Run.states`, from the records."""
        q, v = self.data.qpos.reshape(-1, 7), self.data.qvel.reshape(-1, 6).copy()
        turns = np.array([matrix_of(turn) for turn in q[:, 3:]])
        if self.drop.integrator != "RK4":  # half a step behind, but for what touches
            rows = self._rows()
            pressed = self._bodies(rows[rows["phase"] == CLOSED])
            v[~np.isin(np.arange(len(v)), pressed), 2] -= 0.5 * self.drop.step * GRAVITY
        return State(q[:, :3].copy(), turns, v[:, :3], np.einsum("nij,nj->ni", turns, v[:, 3:]))

    def contacts(self) -> list[Met]:
        """As `Run.contacts`."""
        rows = self._rows()
        touch, bodies = rows["touch"], self._bodies(rows)
        return [(float(x), float(p), tuple(both.tolist()))
                for x, p, both in zip(touch["overlap"], touch["force"], bodies, strict=True)]  # fmt: skip

    def _rows(self) -> NDArray[Any]:
        """The records of what touches or touched within the step: `contacts_of` is slower."""
        rows = self.view.contacts
        return rows[rows["phase"] != FREE]

    def _bodies(self, rows: NDArray[Any]) -> NDArray[np.int64]:
        shapes = np.stack([rows["shape_a"], rows["shape_b"]], 1)
        return self.model.geom_bodyid[self.view.geoms[shapes]] - 1


class InPybullet(Run):
    """By the callback."""

    engine = "pybullet"

    def contacts(self) -> list[Met]:
        """As `Run.contacts`."""
        number = {self.world.ids[body.name]: k for k, body in enumerate(self.world.bodies)}
        states = self.world.callback.states()
        return [(one.overlap, one.normal_force, (number.get(one.a[0], -1), number.get(one.b[0], -1))) for one in states]


ENGINES: dict[str, type[Run]] = {kind.engine: kind for kind in (InWorld, InMujoco, InPybullet)}


class Verdict(NamedTuple):
    """Of a run: what is wrong in words, if anything; greatest gain over the energy, overlap over what holds that, time
    to rest [s], and what the engine's own flight changed of the energy."""

    wrong: list[str]
    gain: float
    depth: float
    rest: float
    flight: float


def judge(engine: str, drop: Drop) -> Verdict:
    """Run a drop until it rests.

    Energy is asked at moments when contacts hold hardly any; what that of a thing changes by while nothing touches it
    is the engine's own flight, and counts for nothing. Without friction nothing need come to rest.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = ENGINES[engine](drop)
        with closing(run.world):
            return _judge(run, drop)


def _judge(run: Run, drop: Drop) -> Verdict:
    scale, deepest, wrong = drop.energy, drop.deepest(), []
    start, spent = run.look(), 0.0
    best, before = start.energy.sum(), start.energy
    gain = depth = flight = 0.0
    quiet, rest, pressed = 0, np.inf, start.pressed
    for number in range(round(LONGEST / drop.step)):
        begun = process_time()
        run.world.step()
        spent += process_time() - begun
        now = run.look()
        energy = float(now.energy.sum())
        if not np.isfinite(energy):
            wrong.append("not finite")
            break
        flown = (now.energy - before)[~now.touched & ~pressed]
        best += float(flown.sum())
        flight += float(np.abs(flown).sum())
        before, pressed = now.energy, now.pressed
        gain = max(gain, energy - best)
        if now.held < LIGHT * scale:
            best = min(best, energy + now.held)
        depth = max(depth, now.overlap, run.sunk())
        still = now.touched.all() and now.linear < STILL * scale
        quiet = quiet + 1 if still else 0
        if quiet * drop.step > 0.1:
            rest = number * drop.step
            break
        if spent > PATIENCE:
            wrong.append(f"takes more than {PATIENCE:g} s")
            break
        if gain > scale or flight > FLIGHT * scale:
            break
    places, _, velocities, _ = run.states()
    if flight > FLIGHT * scale:
        return Verdict([], 0.0, 0.0, rest, flight / scale)
    if gain > GAIN * scale:
        wrong.append(f"gains {gain / scale:.1e}")
    if depth > DEEPER * deepest:
        wrong.append(f"overlaps by {depth / deepest:.2g} of what holds its energy")
    if np.abs(places[:, :2]).max() > WALL or places[:, 2].min() < 0.0:
        wrong.append("went through")
    if rest == np.inf and drop.friction > FRICTIONLESS and not wrong:
        wrong.append(f"moves after {LONGEST:g} s, fastest {np.abs(velocities).max():.2g} m/s")
    return Verdict(wrong, gain / scale, depth / deepest, rest, flight / scale)
