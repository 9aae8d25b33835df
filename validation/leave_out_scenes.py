"""Scenes that can be built with one ingredient left out, and what came out of them as plain numbers."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from itertools import combinations
from unittest.mock import patch

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import LAWS, ContactPair
from contactlaw.laws import law_of
from sims.bounces import Bounce, bounces_of
from sims.contact_point import contact_velocity
from sims.puck import Puck
from sims.recording import Recording
from sims.scene import OWN_STEP, Check, Measured, Scene, Settings, find_scenes
from sims.worlds import new_world
from sims.worlds.world import World
from validation import ball

Array = NDArray[np.float64]

UP, NO_PULL = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
ALMOST = 1.0 - 1e-6
"""Restitution with which a contact that is meant to be elastic has its damper in."""
RESOLVED = 200
"""Engine steps in a contact where the engine's step, instead of the law's own, has to resolve it."""
RESTING = 0.4  # how long a ball rests [s]
BOUNCES = 3  # of the superball that count: the error of one is the throw of the next


@dataclass(frozen=True)
class Build:
    """What a scene is built with. The default has every ingredient in.

    Attributes:
        law: Name in `contactlaw.LAWS`, or the names of the pairs' own where these are several, as `World.law` has them.
        elastic: Whether there is no damper: restitution 1.
        gravity: Whether there is any.
        ledger: Whether account is kept.
        substeps: Least number of the law's steps in a contact.
        others: Whether the bodies may touch any other natively, so that the engine detects the native contact of the
            same bodies, too, only to leave it out.
        fixed_bodies_move, left_alone: PyBullet: as `ContactCallback` has them.
        couples: Which couples of a row of bodies are told of: "all", "all, a call each", or "neighbours", which are
            those that the scene tells of.
    """

    law: str = "microslip"
    elastic: bool = False
    gravity: bool = True
    ledger: bool = True
    substeps: int = 100
    others: bool = True
    fixed_bodies_move: bool = True
    left_alone: bool = False
    couples: str = "all"


FULL = Build()


@dataclass(frozen=True)
class Subject:
    """A scene to be judged.

    Attributes:
        scene: Which.
        results: From a recording what the scene is about: psi_2, or velocities and accelerations over a typical one.
        pull: Gravity [m/s^2], shape (3,), that it could have though the scene as shipped has none.
        weightless: Why it cannot have gravity; "": it can.
        row: Whether its bodies are in a row: the couples that never meet can be told of, too.
        options: Of the scene, where its own make it longer than need be.
    """

    scene: Scene
    results: Callable[[Recording], list[float]]
    pull: tuple[float, float, float] = NO_PULL
    weightless: str = ""
    row: bool = False
    options: Mapping[str, float] = field(default_factory=dict)


class Held(Exception):
    """Not an error: a world that is built and started, handed out of the scene that built it."""

    def __init__(self, world: Trims) -> None:
        super().__init__("built")
        self.world = world


class Trims(World):
    """A world of either engine that leaves out what its build says.

    Args:
        settings: As any world's.
        gravity: What the scene asks for [m/s^2], shape (3,).
        subject: Whose scene is built.
        build: With what.
        hold: Whether `record` is to hand out the started world instead of running it.
    """

    def __init__(self, settings: Settings, gravity: ArrayLike, subject: Subject, build: Build, hold: bool) -> None:
        asked = np.asarray(gravity, dtype=float)
        full = asked if asked.any() else np.array(subject.pull)
        super().__init__(settings, full if build.gravity else np.zeros(3))
        self.subject, self.build, self.hold = subject, build, hold
        self.steps = 0
        self.contact_time = np.inf
        self.asked = Build("", gravity=bool(asked.any()), elastic=True)
        """What the scene itself asks for; the rest is for the world to say."""
        self._couples: set[frozenset[str]] = set()
        self._all_told = False

    def contact(self, ones: str | list[str], twos: str | list[str], pair: ContactPair, *, speed: float = 1.0) -> None:
        """As `World.contact`, with the restitution and the couples of the build."""
        self._listen(ones, twos, pair)
        self.contact_time = min(self.contact_time, self._contact_time(ones, twos, pair, speed))
        told = replace(pair, restitution=1.0 if self.build.elastic else min(pair.restitution, ALMOST))
        if not self.subject.row or self.build.couples == "neighbours":
            super().contact(ones, twos, told, speed=speed)
        elif not self._all_told:
            self._all_told = True
            row = [body.name for body in self.bodies]
            couples = combinations(row, 2) if self.build.couples == "all, a call each" else [(row, row)]
            for one, two in couples:
                super().contact(one, two, told, speed=speed)

    def _listen(self, ones: str | list[str], twos: str | list[str], pair: ContactPair) -> None:
        """Add to what the scene asks for."""
        asked, (first, second) = self.asked, ([one] if isinstance(one, str) else one for one in (ones, twos))
        self._couples |= {frozenset((one, two)) for one in first for two in second if one != two}
        count = len(self.bodies)
        self.asked = replace(
            asked, law=" and ".join(dict.fromkeys([*filter(None, asked.law.split(" and ")), law_of(pair.law).name])),
            elastic=asked.elastic and pair.restitution == 1.0,
            couples="neighbours" if self.subject.row and len(self._couples) < count * (count - 1) / 2 else "all",
        )  # fmt: skip

    def _contact_time(self, ones: str | list[str], twos: str | list[str], pair: ContactPair, speed: float) -> float:
        """Duration of the impact of the first two at a speed [s]."""
        first = ones if isinstance(ones, str) else ones[0]
        second = twos if isinstance(twos, str) else next(name for name in twos if name != first)
        bodies = [body for body in self.bodies if body.name in (first, second)]
        radius = pair.radius or 1.0 / sum(1.0 / body.size[0] for body in bodies)
        mass = 1.0 / sum(1.0 / body.mass for body in bodies)
        return replace(pair, radius=radius).contact_duration(mass, speed)

    def record(self, duration: float, every: float | None = None, **facts: object) -> Recording:
        """As `World.record`, with no more entries than the engine has steps of its own.

        Raises:
            Held: The world is to be handed out.
        """
        if self.hold:
            self.steps = max(1, round(duration / self.timestep))
            self._start()
            raise Held(self)
        return super().record(duration, max(every or 0.0, OWN_STEP[self.settings.engine]), **facts)

    def go(self) -> None:
        """All steps of the scene."""
        self._step(self.steps)

    def close(self) -> None:
        """Let go of the engine."""
        self._close()


class Resting(Scene):
    """The ball of the engine cases, which lies on the floor with its static overlap."""

    name = "resting"
    title = "a ball at rest"

    def run(self, settings: Settings) -> Recording:
        """Nothing happens."""
        world = new_world(settings, gravity=(0.0, 0.0, -ball.GRAVITY))
        world.ball("ball", ball.RADIUS, ball.MASS, [0.0, 0.0, ball.RADIUS - ball.static_overlap()])
        world.plane("floor")
        world.contact("ball", "floor", ball.steel_pair())
        return world.record(RESTING)

    def measure(self, recording: Recording) -> Measured:
        """Change of the overlap over it, and the greatest velocity [m/s]."""
        track = recording.track("ball")
        moved = np.abs(track.positions - track.positions[0]).max() / ball.static_overlap()
        return {"moved": float(moved), "velocity": float(np.abs(track.velocities).max())}

    def check(self, measured: Measured) -> list[Check]:
        """It lies still."""
        return [Check("way over the static overlap", measured["moved"], 1e-6)]


def subjects() -> dict[str, Subject]:
    """All of them, by the names of the table."""
    scenes = find_scenes()
    no_table = "would fall along the block's face: has gravity only with the air table"
    no_tee = "would fall before it is struck: stands on a tee, which is not there"
    return {
        "puck": Subject(scenes["puck"], _puck, weightless=no_table),
        "rubber experiment": Subject(scenes["rubber_experiment"], _rubber, weightless=no_table),
        "superball": Subject(scenes["superball"], _superball),
        "under a table": Subject(scenes["under_table"], _under_table),
        "table tennis": Subject(scenes["table_tennis"], _table_tennis),
        "golf": Subject(scenes["golf"], _golf, weightless=no_tee),
        "billiards": Subject(scenes["billiards"], _billiards),
        "cradle": Subject(scenes["cradle"], _cradle, pull=(0.0, 0.0, -ball.GRAVITY), row=True),
        "rolling, incline": Subject(scenes["incline"], _incline, options={"speed": 0.25}),
        "resting ball": Subject(Resting(), lambda recording: list(Resting().measure(recording).values())),
    }


def _puck(recording: Recording) -> list[float]:
    puck = Puck(**recording.facts["throw"])
    track = recording.track("puck")
    psi_2 = puck.psi(track.velocities[-1], float(track.spins[-1, 2]))
    return [psi_2, float(track.velocities[-1] @ puck.normal) / puck.speed]


def _rubber(recording: Recording) -> list[float]:
    from sims.scenes.rubber_experiment import FIRST

    track, pair = recording.track("puck"), Puck(recording.facts["material"]).pair
    between = int(np.searchsorted(recording.times, recording.facts["apart"]))
    out = []
    for face, ends in ((FIRST, [0, between]), (recording.facts["second"], [between, -1])):
        normal = np.asarray(face)
        velocities = contact_velocity(track.velocities[ends], track.spins[ends], normal, track.size[0])
        side = np.cross(normal, UP)
        approach = -float(velocities[0] @ normal)
        if approach > 0.0:
            out += [pair.psi(float(velocities[1] @ side), approach), float(velocities[1] @ normal) / approach]
    return out


def _superball(recording: Recording) -> list[float]:
    from sims.superball import RADIUS, pair_of

    pair = pair_of(Settings())
    found = bounces_of(recording, "ball")[:BOUNCES]
    return [value for one in found for value in _after(one, pair, RADIUS)] if len(found) == BOUNCES else []


def _after(bounce: Bounce, pair: ContactPair, radius: float) -> tuple[float, float]:
    """psi_2, and the speed of departure over that of approach."""
    return pair.psi(bounce.sliding(radius)[1], bounce.approach), bounce.departure / bounce.approach


def _table_tennis(recording: Recording) -> list[float]:
    from sims.scenes.table_tennis import RADIUS, STROKES, pair_of

    found = [bounce for name in STROKES for bounce in bounces_of(recording, name)[:1]]
    return [value for one in found for value in _after(one, pair_of(), RADIUS)]


def _under_table(recording: Recording) -> list[float]:
    from sims.scenes.under_table import BOUNCES
    from sims.superball import RADIUS, pair_of

    pair = pair_of(Settings())
    found = bounces_of(recording, "ball", ceiling=recording.facts["clearance"])[:BOUNCES]
    return [value for one in found for value in _after(one, pair, RADIUS)] if len(found) == BOUNCES else []


def _golf(recording: Recording) -> list[float]:
    from sims.scenes.golf import LOFTS, RADIUS, axes, pair_of

    pair, speed, out = pair_of(recording.facts["friction"]), recording.facts["speed"], []
    for loft in LOFTS:
        (face, up), track = axes(loft), recording.track(f"ball{loft}")
        after = contact_velocity(track.velocities[-1], track.spins[-1], face, RADIUS) - [speed, 0.0, 0.0]
        approach = speed * float(face[0])
        out += [pair.psi(float(after @ up), approach), float(after @ face) / approach]
    return out


def _billiards(recording: Recording) -> list[float]:
    balls = find_scenes()["billiards"].measure(recording)["balls"].values()
    return [one[key] for one in balls for key in ("psi2", "restitution", "slip_on_the_table")]


def _cradle(recording: Recording) -> list[float]:
    return [float(track.velocities[-1, 0]) / recording.facts["speed"] for track in recording.tracks]


def _incline(recording: Recording) -> list[float]:
    scene = find_scenes()["incline"]
    found = scene.measure(recording)["balls"].values()
    return [one[key] / one[f"{key}_closed_form"] for one in found for key in ("acceleration", "rim", "speed_back")]


def difference(one: list[float], two: list[float]) -> float | None:
    """Greatest change of a result; None where the motion is another one altogether."""
    if len(one) != len(two) or not one or not np.isfinite([*one, *two]).all():
        return None
    return float(np.abs(np.subtract(one, two)).max())


def run(subject: Subject, engine: str, build: Build, timestep: float | None = None) -> Recording:
    """Run the scene to its end."""
    with _trimmed(subject, build, hold=False):
        return subject.scene.run(_settings(subject, engine, build, timestep))


def _settings(subject: Subject, engine: str, build: Build, timestep: float | None = None) -> Settings:
    law = build.law if build.law in LAWS else None  # of several each pair has its own
    return Settings(engine, law, timestep=timestep, options=subject.options)


def held(subject: Subject, engine: str, build: Build) -> Trims:
    """The scene built and started, not stepped; close it."""
    with _trimmed(subject, build, hold=True):
        try:
            subject.scene.run(_settings(subject, engine, build))
        except Held as built:
            return built.world
    raise ValueError(f"scene = {subject.scene.name!r}: must record its world")


def shipped(subject: Subject, engine: str) -> Build:
    """What the scene as it is shipped is built with: what it asks for itself, and what its world does."""
    world = held(subject, engine, FULL)
    world.close()
    said = importlib.import_module(f"validation.leave_out_{engine}").said_by(subject.scene)
    return replace(world.asked, **said)


def _trimmed(subject: Subject, build: Build, *, hold: bool) -> AbstractContextManager[object]:
    """Within this, the scene's `new_world` makes a world with this build."""

    def make(settings: Settings, gravity: ArrayLike = (0.0, 0.0, -9.81)) -> World:
        module = importlib.import_module(f"validation.leave_out_{settings.engine}")
        return module.TrimmedWorld(settings, gravity, subject, build, hold)

    return patch.object(sys.modules[type(subject.scene).__module__], "new_world", make)
