"""What the law costs at the engines' own steps, beside native contact in the same scenes."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import ContactPair
from validation.ball import (
    FRICTION,
    GRAVITY,
    RADIUS,
    STEEL,
    BulletBall,
    half_step,
    mujoco_ball,
    static_overlap,
    steel_pair,
)
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.measure import interleaved, order_of, spread
from validation.picture import STYLES, bars, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP, BULLET_STEP = 2e-3, 1.0 / 240.0  # [s]
DROP = 0.05  # [m]
DOWN = np.array([0.0, 0.0, -GRAVITY])
ELASTIC_NATIVE = (-2.5e4, 0.0)  # solref of a contact of some 20 ms without damping: so the native ball bounces, too
ROOM = 0.055  # [m], of a ball in the box at the start
MASSES = [8, 16, 32, 64]  # balls
POURING, LYING = 0.15, 1.2  # [s]: when the balls are timed
BOUNCING, REST, BULLET = 1.0, 3.0, 4.0

# name: contact, restitution, height [m], speed [m/s], spin over rolling, steps before, steps timed, over
SCENES: dict[str, tuple[str, float, float, float, float, int, int, str]] = {
    "bouncing, native": ("native", 1.0, DROP, 0.0, 0.0, 0, 1000, "bouncing, native"),
    "bouncing, native undamped": ("elastic", 1.0, DROP, 0.0, 0.0, 0, 1000, "bouncing, native"),
    "bouncing, e = 1": ("law", 1.0, DROP, 0.0, 0.0, 0, 1000, "bouncing, native"),
    "bouncing to rest, e = 0.9": ("law", 0.9, DROP, 0.0, 0.0, 0, 1000, "bouncing, native"),
    "first rest, native": ("native", 0.9, 0.0, 0.0, 0.0, 0, 10, "first rest, native"),
    "first rest": ("law", 0.9, 0.0, 0.0, 0.0, 0, 10, "first rest, native"),
    "at rest, native": ("native", 0.9, 0.0, 0.0, 0.0, 500, 400, "at rest, native"),
    "at rest": ("law", 0.9, 0.0, 0.0, 0.0, 500, 400, "at rest, native"),
    "rolling, native": ("native", 0.9, 0.0, 1.0, 1.0, 100, 400, "rolling, native"),
    "rolling": ("law", 0.9, 0.0, 1.0, 1.0, 100, 400, "rolling, native"),
    "sliding, native": ("native", 0.9, 0.0, 3.0, 0.0, 20, 200, "sliding, native"),
    "sliding": ("law", 0.9, 0.0, 3.0, 0.0, 20, 200, "sliding, native"),
}
BULLET_SCENES = {
    "PyBullet, bouncing, native": ("native", DROP, "PyBullet, bouncing, native"),
    "PyBullet, bouncing, e = 1": ("law", DROP, "PyBullet, bouncing, native"),
    "PyBullet, bouncing, left alone": ("alone", DROP, "PyBullet, bouncing, native"),
    "PyBullet, at rest, native": ("native", 0.0, "PyBullet, at rest, native"),
    "PyBullet, at rest": ("law", 0.0, "PyBullet, at rest, native"),
    "PyBullet, at rest, left alone": ("alone", 0.0, "PyBullet, at rest, native"),
}


@register
class AnyStepCost(Case):
    """Microseconds a step at 2 ms and 1/240 s."""

    name = "any_step_cost"
    place = 61
    title = "What a long step costs"
    claim = (
        "At the engine's own step the law's substeps are paid for only while something happens: a bouncing ball costs "
        "MuJoCo no more on average than its own contact would, one at rest at most three times as much. In PyBullet, "
        "where reading one ball costs twice a native step, a step with the callback costs at most four times the "
        "native one if the bodies are left alone between the calls, and more if the callback must look at them each "
        "time. In a heap, where balls always knock, it costs what it takes; the figures say how much."
    )
    caption = (
        "Left: time of a step over that of the native contact in the same scene (MuJoCo at 2 ms, PyBullet at 1/240 s); "
        "whiskers: quartiles. Right: time of a step with balls poured into a box, MuJoCo; open marks: native."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """One ball, then many, then PyBullet."""
        times, ratios = _one_ball(10 if quick else 60, lambda part: progress(0.2 * part))
        bullet, bullet_ratios = _pybullet(6 if quick else 25)
        times, ratios = times | bullet, ratios | bullet_ratios
        heap: list[Data] = []
        problems: list[str] = []
        masses = MASSES[:2] if quick else MASSES
        for number, count in enumerate(masses):
            found, wrong = _heap(count, 2 if quick else 3)
            heap += found
            problems += wrong
            progress(0.3 + 0.7 * (number + 1) / len(masses))
        over = {name: scene[-1] for name, scene in (SCENES | BULLET_SCENES).items()}
        data = {"microseconds": times, "ratio": ratios, "over": over, "heap": heap, "growth": _growth(heap)}
        asked = {
            "bouncing, e = 1": BOUNCING, "bouncing to rest, e = 0.9": BOUNCING, "first rest": REST, "at rest": REST,
            "rolling": REST, "sliding": REST, "PyBullet, bouncing, e = 1": BULLET,
            "PyBullet, bouncing, left alone": BULLET, "PyBullet, at rest": BULLET,
            "PyBullet, at rest, left alone": BULLET,
        }  # fmt: skip
        limits = [Limit(f"{name}, over native", limit, ratios[name]["median"]) for name, limit in asked.items()]
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        """One ball, then the heap."""
        table = Table(["scene", "a step [us]", "over native", "contacts", "a contact [us]"])
        for name, time in data["microseconds"].items():
            ratio = data["ratio"][name]
            words = "" if data["over"][name] == name else (
                f"{ratio['median']:.2f} ({ratio['low']:.2f} to {ratio['high']:.2f})"
            )  # fmt: skip
            table.rows.append([name, f"{time['median']:.2f}", words, "", ""])
        for one in data["heap"]:
            for kind in ("native", "law"):
                own = one[kind]
                table.rows.append(
                    [f"{one['balls']} balls {one['when']}, {kind}", f"{own['time']:.0f}",
                     f"{own['time'] / one['native']['time']:.1f}" if kind == "law" else "", f"{own['contacts']:.0f}",
                     f"{own['time'] / max(own['contacts'], 1):.2f}"]
                )  # fmt: skip
        for name, power in data["growth"].items():
            table.rows.append([f"{name}: time grows as balls to the power", f"{power:.2f}", "", "", ""])
        return table

    def draw(self, data: Data) -> Figure:
        """Ratios, and the heap."""
        figure, (left, right) = panels(2, width=5.0, height=4.0)
        shown = [name for name, over in data["over"].items() if name != over]
        bars(left, shown, [data["ratio"][name] for name in shown])
        left.set_xlabel("time over that of native contact [-]")
        for style, when in zip(STYLES, ("pouring", "lying"), strict=False):
            own = [one for one in data["heap"] if one["when"] == when]
            for kind, look in (("law", {}), ("native", {"fillstyle": "none"})):
                right.loglog([one["balls"] for one in own], [one[kind]["time"] for one in own], **(style | look),
                             label=f"{when}, {kind}")  # fmt: skip
        right.set(xlabel="balls [-]", ylabel="time of a step [us]")
        right.set_xticks([one["balls"] for one in own], [str(one["balls"]) for one in own])
        right.set_xticks([], minor=True)
        right.legend(fontsize=8)
        return figure


def _one_ball(repeats: int, progress: Progress) -> tuple[dict[str, Any], dict[str, Any]]:
    import mujoco

    runs: dict[str, Callable[[], object]] = {}
    prepare: dict[str, Callable[[], object]] = {}

    def place(model: Any, data: Any, height: float, speed: float, spin: float, before: int) -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[2] = RADIUS + height - (0.0 if height else static_overlap())
        data.qvel[:] = [speed, 0.0, 0.0, 0.0, spin * speed / RADIUS, 0.0]
        data.qvel[:3] -= half_step(model)
        mujoco.mj_step(model, data, before)

    for name, (contact, e, height, speed, spin, before, steps, _) in SCENES.items():
        law = contact == "law"
        model, data, _ = mujoco_ball(
            STEP, "law alone" if law else "native", steel_pair(restitution=e), gravity=DOWN,
            solref=ELASTIC_NATIVE if contact == "elastic" else None,
        )  # fmt: skip
        if not law:
            model.geom_friction[:, 0] = FRICTION
        prepare[name] = partial(place, model, data, height, speed, spin, before)
        runs[name] = partial(mujoco.mj_step, model, data, steps)
    seconds = interleaved(runs, repeats, prepare, progress)
    per_step = {name: 1e6 * s / SCENES[name][6] for name, s in seconds.items()}
    return (
        {name: spread(s) for name, s in per_step.items()},
        {name: spread(s / per_step[SCENES[name][7]]) for name, s in per_step.items()},
    )


def _pybullet(repeats: int) -> tuple[dict[str, Any], dict[str, Any]]:
    steps = 240
    balls = {
        name: BulletBall(
            BULLET_STEP, "law" if contact == "alone" else contact, steel_pair(restitution=1.0 if height else 0.9),
            gravity=DOWN, left_alone=contact == "alone",
        )
        for name, (contact, height, _) in BULLET_SCENES.items()
    }  # fmt: skip

    def place(ball: BulletBall, height: float) -> None:
        ball.start(height or -static_overlap(), -0.5 * BULLET_STEP * DOWN)
        ball.step(0 if height else 60)

    try:
        seconds = interleaved(
            {name: partial(ball.step, steps) for name, ball in balls.items()},
            repeats,
            {name: partial(place, ball, BULLET_SCENES[name][1]) for name, ball in balls.items()},
        )
    finally:
        for ball in balls.values():
            ball.close()
    per_step = {name: 1e6 * s / steps for name, s in seconds.items()}
    return (
        {name: spread(s) for name, s in per_step.items()},
        {name: spread(s / per_step[BULLET_SCENES[name][2]]) for name, s in per_step.items()},
    )


def box(count: int, law: bool) -> tuple[Any, Any, str]:
    """Balls over an open box, in layers as wide as high: model, data, name of the contact."""
    import mujoco

    from contactlaw.mujoco_plugin import add_contact

    spec = mujoco.MjSpec()
    spec.option.timestep = STEP
    walls, names = [], []
    across = ceil(count ** (1.0 / 3.0) - 1e-9)
    places = {"floor": ([0, 0, 0], [0, 0, 1])}
    for number, side in enumerate(np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])):
        places[f"wall{number}"] = (0.5 * ROOM * (across + 0.1) * side, -side)
    for name, (place, normal) in places.items():
        turn = np.zeros(4)
        mujoco.mju_quatZ2Vec(turn, np.array(normal, dtype=float))
        wall = spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1], pos=place)
        wall.quat, wall.friction = turn, [FRICTION, 0.0, 0.0]
        walls.append(name)
    random = np.random.default_rng(0)
    for number in range(count):
        column = np.array([number % across, number // across % across])
        place = ROOM * (column - 0.5 * (across - 1)) + random.uniform(-1e-3, 1e-3, 2)
        body = spec.worldbody.add_body(pos=[*place, 0.04 + 0.06 * (number // across**2)])
        body.add_freejoint()
        names.append(f"ball{number}")
        body.add_geom(name=names[-1], size=[RADIUS, 0.0, 0.0], density=STEEL.density, friction=[FRICTION, 0.0, 0.0])
    spec.compile()  # bodies are numbered
    name = (
        add_contact(spec, names, names + walls, ContactPair(STEEL, STEEL, FRICTION, 0.5), others=False) if law else ""
    )
    model = spec.compile()
    return model, mujoco.MjData(model), name


def _heap(count: int, repeats: int) -> tuple[list[Data], list[str]]:
    """Times and contacts while the balls come down, and once they lie."""
    import mujoco

    from contactlaw.mujoco_plugin import contacts_of

    steps = 20
    scenes = {"native": box(count, law=False), "law": box(count, law=True)}
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    out, problems = [], []
    for when, time in (("pouring", POURING), ("lying", LYING)):
        saved = {}
        for name, (model, data, _) in scenes.items():
            while data.time < time - 0.5 * STEP:
                mujoco.mj_step(model, data)
            saved[name] = np.empty(mujoco.mj_stateSize(model, kind))
            mujoco.mj_getState(model, data, saved[name], kind)
        seconds = interleaved(
            {name: partial(mujoco.mj_step, model, data, steps) for name, (model, data, _) in scenes.items()},
            repeats,
            {name: partial(mujoco.mj_setState, model, data, saved[name], kind)
             for name, (model, data, _) in scenes.items()},
        )  # fmt: skip
        one: Data = {"balls": count, "when": when}
        for name, (model, data, contact) in scenes.items():
            touching = len(contacts_of(model, data, contact)) if contact else int(data.ncon)
            one[name] = {"time": float(1e6 * np.median(seconds[name]) / steps), "contacts": touching}
            heights = data.qpos.reshape(-1, 7)[:, 2]
            if not np.isfinite(data.qvel).all() or heights.min() < 0.5 * RADIUS or heights.max() > 1.0:
                problems.append(f"{count} balls {when}, {name}: a ball has gone")
        out.append(one)
    return out, problems


def _growth(heap: list[Data]) -> dict[str, float]:
    """Power of the number of balls that the time grows with."""
    out = {}
    for when in ("pouring", "lying"):
        for kind in ("law", "native"):
            own = [one for one in heap if one["when"] == when]
            counts = np.array([one["balls"] for one in own], dtype=float)
            out[f"{when}, {kind}"] = -order_of(counts, np.array([one[kind]["time"] for one in own]))
    return out
