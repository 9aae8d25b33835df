"""Scenes that can be built with one ingredient left out, and what came out of them as plain numbers."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import ContactPair
from sims.bounces import bounces_of
from sims.puck import Puck
from sims.recording import Recording
from sims.scene import OWN_STEP, Scene, Settings, find_scenes
from sims.worlds import Tuning, World, new_world
from validation.ball import DOWN, NO, SUBSTEPS

ALMOST = 1.0 - 1e-6
"""Restitution with which a contact that is meant to be elastic has its damper in."""
BOUNCES = 3  # of the superball that count: the error of one is the throw of the next


@dataclass(frozen=True)
class Build:
    """What a scene is built with: the default has every ingredient in; None, or no law: as the scene is shipped.

    elastic: without a damper, restitution 1. substeps, collide, fixed_bodies_move: as `Tuning` has them. others:
    of a row of bodies, those couples too that never meet.
    """

    law: str = "microslip"
    elastic: bool | None = False
    gravity: bool | None = True
    substeps: int = SUBSTEPS
    collide: bool = True
    fixed_bodies_move: bool | None = True
    others: bool = True


FULL, SHIPPED = Build(), Build("", None, None, collide=False, fixed_bodies_move=None, others=False)
INGREDIENTS: dict[str, dict[str, Any]] = {
    "tangential history": {"law": "coulomb"},
    "microslip nodes": {"law": "mindlin"},
    "damping": {"elastic": True},
    "gravity": {"gravity": False},
    "half the substeps": {"substeps": 50},
    "native contact": {"collide": False},
    "pushes from outside": {"fixed_bodies_move": False},
    "other couples": {"others": False},
}
"""What can be left out, by its name in the table, and the fields of `Build` without it."""


@dataclass(frozen=True)
class Subject:
    """A scene to be judged.

    Attributes:
        scene: Which.
        results: From a recording what the scene is about: psi_2, or velocities and accelerations over a typical one.
        pull, weightless: Gravity [m/s^2], shape (3,), that it could have though the scene as shipped has none; why it
            cannot have any ("": it can).
        row: Whether its bodies are in a row: the couples that never meet can be told of, too.
        options: Of the scene, where its own make it longer than need be.
    """

    scene: Scene
    results: Callable[[Recording], list[float]]
    pull: ArrayLike = NO
    weightless: str = ""
    row: bool = False
    options: Mapping[str, float] = field(default_factory=dict)


def subjects() -> dict[str, Subject]:
    """All of them, by the names of the table."""
    from sims import superball
    from sims.scenes import table_tennis, under_table

    scenes, rubber = find_scenes(), superball.pair_of()
    under = _bounces(rubber, ["ball"], under_table.BOUNCES, ceiling="clearance")
    tennis = _bounces(table_tennis.pair_of(), [*table_tennis.STROKES], 1)
    no_table = "would fall along the block's face: has gravity only with the air table"
    no_tee = "would fall before it is struck: stands on a tee, which is not there"
    return {
        "puck": Subject(scenes["puck"], _puck, weightless=no_table),
        "rubber experiment": Subject(scenes["rubber_experiment"], _ends, weightless=no_table),
        "superball": Subject(scenes["superball"], _bounces(rubber, ["ball"], BOUNCES)),
        "under a table": Subject(scenes["under_table"], under),
        "table tennis": Subject(scenes["table_tennis"], tennis),
        "golf": Subject(scenes["golf"], _ends, weightless=no_tee),
        "billiards": Subject(scenes["billiards"], _billiards),
        "cradle": Subject(scenes["cradle"], _cradle, pull=DOWN, row=True),
        "rolling, incline": Subject(scenes["incline"], _incline, options={"speed": 0.25}),
    }


def _puck(recording: Recording) -> list[float]:
    puck = Puck(**recording.facts["throw"])
    track = recording.track("puck")
    psi_2 = puck.psi(track.velocities[-1], float(track.spins[-1, 2]))
    return [psi_2, float(track.velocities[-1] @ puck.normal) / puck.speed]


def _ends(recording: Recording) -> list[float]:
    """Velocities and spins at the end, over the greatest speed of all."""
    fastest = max(float(np.linalg.norm(track.velocities, axis=1).max()) for track in recording.tracks)
    return [float(value) / fastest for track in recording.tracks
            for value in (*track.velocities[-1], *(track.size[0] * track.spins[-1]))]  # fmt: skip


def _bounces(pair: ContactPair, names: Sequence[str], count: int, **where: str) -> Callable[[Recording], list[float]]:
    """psi_2, and the speed of departure over that of approach, of the first bounces of some balls."""

    def results(recording: Recording) -> list[float]:
        told = {key: recording.facts[fact] for key, fact in where.items()}
        found = [one for name in names for one in bounces_of(recording, name, **told)[:count]]
        radius = recording.track(names[0]).size[0]
        both = ((pair.psi(one.sliding(radius)[1], one.approach), one.departure / one.approach) for one in found)
        return list(chain(*both)) if len(found) == count * len(names) else []

    return results


def _billiards(recording: Recording) -> list[float]:
    balls = find_scenes()["billiards"].measure(recording)["balls"].values()
    return [one[key] for one in balls for key in ("psi2", "restitution", "slip_on_the_table")]


def _cradle(recording: Recording) -> list[float]:
    return [float(track.velocities[-1, 0]) / recording.facts["speed"] for track in recording.tracks]


def _incline(recording: Recording) -> list[float]:
    found = find_scenes()["incline"].measure(recording)["balls"].values()
    return [one[key] / one[f"{key}_closed_form"] for one in found for key in ("acceleration", "rim", "speed_back")]


def run(subject: Subject, engine: str, build: Build) -> Recording:
    """Run the scene to its end, its world made with a build."""
    settings = Settings(engine, build.law or None, options=subject.options)
    module = sys.modules[type(subject.scene).__module__]
    builder = module if hasattr(module, "new_world") else sys.modules[Puck.__module__]
    with patch.object(builder, "new_world", partial(_trimmed, subject, build)):
        return subject.scene.run(settings)


def _trimmed(subject: Subject, build: Build, settings: Settings, gravity: ArrayLike = (0.0, 0.0, -9.81)) -> World:
    """A world that leaves out what its build says, with no more entries than the engine has steps of its own."""
    pull = np.asarray(gravity, dtype=float)
    if build.gravity is not None:
        pull = (pull if pull.any() else np.asarray(subject.pull)) if build.gravity else np.zeros(3)
    world = new_world(settings, pull, Tuning("Euler", build.substeps, build.collide, build.fixed_bodies_move))
    contact, record, told = world.contact, world.record, []

    def touch(ones: Any, twos: Any, pair: ContactPair, *, speed: float = 1.0) -> None:
        if build.elastic is not None:
            pair = replace(pair, restitution=1.0 if build.elastic else min(pair.restitution, ALMOST))
        if not (subject.row and build.others):
            contact(ones, twos, pair, speed=speed)
        elif not told:
            told.extend(body.name for body in world.bodies)
            contact(told, told, pair, speed=speed)

    def entries(duration: float, every: float | None = None, **facts: Any) -> Recording:
        return record(duration, max(every or 0.0, OWN_STEP[settings.engine]), **facts)

    vars(world).update(contact=touch, record=entries)
    return world


def difference(one: list[float], two: list[float]) -> float | None:
    """Greatest change of a result; None where the motion is another one altogether."""
    if len(one) != len(two) or not one or not np.isfinite([*one, *two]).all():
        return None
    return float(np.abs(np.subtract(one, two)).max())
