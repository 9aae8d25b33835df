"""Cost of a step with the law, beside the same step with the engine's own contact and without contact."""

import os
import sys
from dataclasses import dataclass, replace
from functools import partial
from subprocess import PIPE, run
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from contactlaw import LAWS
from sims.worlds import World
from validation import ball, empty_plugin
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.measure import interleaved, spread
from validation.picture import bars

RESOLVED = 1e-6  # [s]; a contact lasts some 100
LONG, BULLET = 2e-3, 1.0 / 240.0  # [s], the engines' own
OVERLAP = 1e-5  # [m] at the start in contact
DROP = 0.05  # [m]
ELASTIC_NATIVE = (2.5e4, 0.0)  # a contact of some 20 ms without damping: so the native ball bounces, too


@dataclass(frozen=True)
class Scene:
    """A ball over a floor, timed.

    Attributes:
        contact: "law", "among": where native contacts may be, "alone": bodies that nothing can push are not read,
            "native", "elastic": native without damping, "none", "empty": none, and a plugin that does nothing.
        over, asked: Name of the scene that it is compared with, and at most so many times that; None: no limit.
        dt, law, e: Step [s]; of the contact.
        height: Over touching [m]; None: at the static overlap.
        speed, spin: Along the floor [m/s], and of rolling, over it.
        before, steps: Run before the clock, and timed.
    """

    contact: str
    over: str
    asked: float | None = None
    dt: float = RESOLVED
    law: str = "microslip"
    e: float = ball.RESTITUTION
    height: float | None = -OVERLAP
    speed: float = 0.05
    spin: float = 0.0
    before: int = 1
    steps: int = 60
    engine: str = "mujoco"

    def made(self) -> World:
        """Its world."""
        law = self.contact in ("law", "among", "alone")
        collide = self.contact == "among" or (self.engine == "pybullet" and law)
        tuning = {"fixed_bodies_move": self.contact != "alone", "collide": collide}
        gravity = ball.NO if self.dt == RESOLVED else ball.DOWN
        pair = ball.steel_pair(self.law, self.e) if law else None
        world = ball.ball_world(self.engine, self.dt, pair, gravity, **tuning)
        if self.contact == "empty":
            empty_plugin.attach(world.spec)  # type: ignore[attr-defined]
        if self.contact in ("native", "elastic"):
            world.native(ball.FRICTION, 0.0, ELASTIC_NATIVE if self.contact == "elastic" else None)
        return world

    def begin(self, world: World) -> None:
        """Place the ball."""
        height = -ball.static_overlap() if self.height is None else self.height
        world.start(ball.at(height, [self.speed, 0.0, 0.0], [0.0, self.spin * self.speed / ball.RADIUS, 0.0]))


def scenes() -> dict[str, Scene]:
    """All of one ball, by name."""
    nothing, native = "free, no contact at all", "free, native contact"
    fly: dict[str, Any] = {"height": 0.1, "steps": 300}
    found = {
        nothing: Scene("none", nothing, **fly),
        "free, a plugin that does nothing": Scene("empty", nothing, **fly),
        native: Scene("native", nothing, **fly),
        "free, law alone": Scene("law", nothing, 1.03, **fly),
        "free, law among native contacts": Scene("among", native, 1.03, **fly),
        "touching, native contact": Scene("native", "touching, native contact"),
    } | {f"touching, {law}": Scene("among", "touching, native contact", 1.0, law=law) for law in LAWS}
    for name, one in list(found.items()):
        if one.contact not in ("among", "empty") or name.startswith("touching"):
            over = f"PyBullet, {one.over}"
            found[f"PyBullet, {name}"] = replace(one, engine="pybullet", asked=None, steps=50, over=over)

    def kinds(what: str, asked: float, engine: Any = "mujoco", **how: Any) -> None:
        base = f"{what}, native"
        how |= {"engine": engine, "dt": LONG if engine == "mujoco" else BULLET}
        found[base] = Scene("native", base, **how)
        if what == "bouncing":
            found["bouncing, native undamped"] = Scene("elastic", base, **how)
            found["bouncing to rest, e = 0.9"] = Scene("law", base, asked, **{**how, "e": 0.9})
        bounces = how.get("height") is not None
        found[f"{what}, e = 1" if bounces else what] = Scene("law", base, asked, **how)
        if engine == "pybullet":
            found[f"{what}, fixed bodies not read"] = Scene("alone", base, asked, **how)

    rest: dict[str, Any] = {"e": 0.9, "height": None, "speed": 0.0}
    bounce: dict[str, Any] = {"e": 1.0, "height": DROP, "speed": 0.0, "before": 0}
    kinds("bouncing", 0.7, **bounce, steps=1000)
    kinds("first rest", 3.0, **rest | {"before": 0, "steps": 10})
    kinds("at rest", 0.6, **rest | {"before": 500, "steps": 400})
    kinds("rolling", 3.0, **rest | {"speed": 1.0, "spin": 1.0, "before": 100, "steps": 400})
    kinds("sliding", 3.0, **rest | {"speed": 3.0, "before": 20, "steps": 200})
    kinds("PyBullet, bouncing", 3.5, "pybullet", **bounce, steps=240)
    kinds("PyBullet, at rest", 4.0, "pybullet", **(rest | {"before": 60, "steps": 240}))
    return found


class StepCost(Case):
    """A MuJoCo step that resolves a contact should cost no more with the law than with the engine's own contact, and in
    free flight at most 3 % more than the same scene without the law. A plugin that does nothing shows how much of this
    its calls take. Where no native contacts may be, the engine's constraint stage is off (`skip_constraints`), which
    the same scene without the law has to keep on. At 2 ms the law's substeps cost time only while bodies touch: a
    bouncing ball should cost 0.7 of native contact on average, a ball at rest 0.6. PyBullet has no step callback, so
    the law is Python code between two steps that reads and pushes bodies; at 1/240 s a bounce may cost 3.5 native
    steps, and resolved steps have no limit. First use: a process lets a ball fall, with nothing compiled before.
    """

    place = 60
    title = "What a step costs"
    sheet = {"width": 6.4, "height": 5.4}
    caption = "Time of a step over that of the scene named in the table; whiskers: quartiles. Dark: without the law."

    def run(self, quick: bool) -> Outcome:
        known = scenes()
        worlds = {name: scene.made() for name, scene in known.items()}
        times: dict[str, np.ndarray] = {}
        rounds = {(RESOLVED, "mujoco"): 1000, (RESOLVED, "pybullet"): 200,
                  (LONG, "mujoco"): 60, (BULLET, "pybullet"): 25}  # fmt: skip
        for (dt, engine), repeats in rounds.items():
            own = [name for name, scene in known.items() if (scene.dt, scene.engine) == (dt, engine)]
            seconds = interleaved({name: partial(worlds[name].step, known[name].steps) for name in own},
                                  max(repeats // (5 if quick else 1), 6),
                                  {name: partial(_prepare, known[name], worlds[name]) for name in own})  # fmt: skip
            times |= {name: 1e6 * s / known[name].steps for name, s in seconds.items()}
        for world in worlds.values():
            world.close()
        ratios = {name: spread(times[name] / times[scene.over]) for name, scene in known.items()}
        data = {"microseconds": {name: spread(one) for name, one in times.items()}, "ratio": ratios,
                "over": {name: scene.over for name, scene in known.items()}}  # fmt: skip
        limits = [] if quick else first_uses()
        for name, scene in known.items():
            if scene.asked is not None:
                over = "native contact" if scene.dt == RESOLVED else "native"
                what = f"{name}, over {scene.over if name.startswith('free') else over}"
                limits.append(Limit(what, scene.asked, ratios[name]["median"]))
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table("scene | a step [us] | compared with | ratio")
        for name, time in data["microseconds"].items():
            row, over = f"{name} | {time['median']:.2f}", data["over"][name]
            if over != name:
                row += f" | {over.removeprefix('PyBullet, ')} | {{median:.2f}} ({{low:.2f}} to {{high:.2f}})"
            table.add(row, data["ratio"][name])
        return table

    def draw(self, data: Data, axes: Axes) -> None:
        shown = [name for name, over in data["over"].items() if name != over and "PyBullet, touching" not in name]
        bars(axes, shown, [data["ratio"][name] for name in shown])
        axes.set_xlabel("time over that of the scene compared with [-]")
        axes.tick_params(labelsize=7)


def _prepare(scene: Scene, world: World) -> None:
    scene.begin(world)
    world.step(scene.before)


def first_uses() -> list[Limit]:
    """What is asked of the first use of both engines, of PyBullet beyond what MuJoCo has compiled."""
    one, both = first_use("mujoco"), first_use("mujoco", "pybullet")
    return [Limit("MuJoCo: first use", 15.0, one, "s"), Limit("PyBullet: first use after it", 10.0, both - one, "s")]


def first_use(*engines: str) -> float:
    """Processor time [s] of a new process in which a ball falls on a floor in these engines, with nothing compiled."""
    code = "import sys; from validation.cases.step_cost import drop; [drop(one) for one in sys.argv[1:]]"
    begun = sum(os.times()[2:4])
    with TemporaryDirectory() as cache:
        env = os.environ | {"NUMBA_CACHE_DIR": cache}
        run([sys.executable, "-c", code, *engines], check=True, stderr=PIPE, env=env)
    return sum(os.times()[2:4]) - begun


def drop(engine: str) -> None:
    """Let a ball fall on a floor until it rests."""
    _prepare(scene := Scene("law", "", dt=LONG, e=0.5, height=1e-3, before=200, engine=engine), scene.made())
