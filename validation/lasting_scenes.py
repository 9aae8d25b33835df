"""What lasts, in MuJoCo by the law and natively: five balls in a tube, a box, an ant, a ball held."""

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from time import process_time
from types import SimpleNamespace
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair
from sims.heap import FRICTION, RADIUS, RESTITUTION, mass_of, timed
from sims.scene import NATIVE, Settings
from sims.worlds import new_world
from sims.worlds.parts import onto
from validation.measure import interleaved

TUBE, BALLS = 1.2 * RADIUS, 5  # half its width [m]
HALF, BOX = 0.05, 1.0  # [m], [kg]
STEEL = MATERIALS["steel"]
POSE = [0, 1, 0, -1, 0, -1, 0, 1]  # joint angles of an ant that stands [rad]
DOWN = (0.0, 0.0, -9.81)


def tube(law: bool) -> Any:
    """Balls fall into a square tube a little wider than they are, side by side, and wedge."""
    world: Any = new_world(Settings("mujoco", None if law else NATIVE), DOWN)
    world.plane("floor")
    walls = {"left": (1.0, 0.0, 0.0), "right": (-1.0, 0.0, 0.0), "front": (0.0, 1.0, 0.0), "back": (0.0, -1.0, 0.0)}
    for name, normal in walls.items():
        world.plane(name, -TUBE * np.array(normal), normal)
    balls = [f"ball{number}" for number in range(BALLS)]
    for number, name in enumerate(balls):
        place = RADIUS * np.array([(-1) ** number * 0.15, 0.02 * number, 1.0 + 2.04 * number])
        world.ball(name, RADIUS, mass_of(), place)
    _touch(world, law, balls, [*balls, "floor", *walls], FRICTION)
    return world


def box(law: bool) -> Any:
    """One on a slope of 20 degrees; by the law it stands on ball feet in its corners."""
    angle = np.radians(20.0)
    normal = np.array([-np.sin(angle), 0.0, np.cos(angle)])
    world: Any = new_world(Settings("mujoco", None if law else NATIVE), DOWN)
    world.plane("slope", normal=normal)
    world.box("box", (HALF,) * 3, BOX, HALF * normal, rotation=onto(normal))
    _touch(world, law, ["box"], ["slope"], 0.5)
    return world


def _touch(world: Any, law: bool, ones: list[str], twos: list[str], friction: float) -> None:
    if law:
        world.contact(ones, twos, ContactPair(STEEL, STEEL, friction, RESTITUTION))
    else:
        world.native(friction, 0.0)


def over_native(make: Callable[[bool], Any], begin: float, steps: int = 30, blocks: int = 10) -> dict[str, float]:
    """Median processor time of a step [s], by the law and natively, turn by turn."""
    worlds = {"law": make(True), "native": make(False)}
    for world in worlds.values():
        world.start()
        world.step(round(begin / world.timestep))
    return a_step({name: partial(world.step, steps) for name, world in worlds.items()}, steps, blocks)


def a_step(runs: dict[str, Callable[[], None]], steps: int, blocks: int) -> dict[str, float]:
    """Median processor time of a step [s]; each run makes so many steps."""
    times = interleaved(runs, blocks, clock=process_time)
    return {name: float(np.median(found)) / steps for name, found in times.items()}


def ant() -> Path | None:
    """Gymnasium's model of an ant, where it is installed."""
    spec = find_spec("gymnasium")
    return Path(str(spec.origin)).parent / "envs" / "mujoco" / "assets" / "ant.xml" if spec else None


def standing_ant(path: Path, seconds: float = 1.0, blocks: int = 10) -> dict[str, float]:
    """The ant on its four legs, of rubber on steel: median processor time of a step [s]."""
    import mujoco

    from contactlaw.mujoco_plugin import load_model

    engine: Any = mujoco
    pair = ContactPair(MATERIALS["rubber"], STEEL, 1.0, 0.3)
    runs, steps = {}, 30
    for name in ("law", "native"):
        model = load_model(path, [("*", "floor", pair)]) if name == "law" else engine.MjModel.from_xml_path(str(path))
        data = engine.MjData(model)
        data.qpos[7:] = POSE
        engine.mj_step(model, data, round(seconds / model.opt.timestep))
        runs[name] = lambda model=model, data=data: engine.mj_step(model, data, steps)
    return a_step(runs, steps, blocks)


def grasp(material: str, mass: float, seconds: float) -> dict[str, Any]:
    """A ball [kg] held and shaken for so long [s], see `sims.scenes.grasp`.

    Returns "slip", by the law, of the ball in its fingers from the first whole second of shaking to the last [m]; and
    mean processor times of a step [s] by the law and natively, turn by turn, while the native contact holds it.
    """
    import mujoco

    from sims.scenes import grasp as scene

    engine, step, worlds, held = mujoco, mujoco.mj_step, {}, []  # type: ignore[attr-defined]
    times, steps = {"law": 0.0, "native": 0.0}, 0
    for name in times:
        settings = Settings("mujoco", None if name == "law" else NATIVE, material, options={"mass": mass})
        o = SimpleNamespace(**scene.Grasp().demand(settings))
        model = scene.build(settings, o)
        force = o.grip * scene.needed(mass, scene.pair_of(o).friction)
        worlds[name] = model, engine.MjData(model), force
    model, data, _ = worlds["law"]
    while data.time < seconds:
        native = worlds["native"][1]
        falls = abs(native.body("ball").xpos[2] - native.body("hand").xpos[2]) > 0.5 * scene.HOLD
        for name in ("law",) if falls else times:
            one, state, force = worlds[name]
            shaken = state.time >= scene.SWINGS and not falls
            for _ in range(10):
                scene.drive(one, state, force)
                begun = process_time()
                step(one, state)
                times[name] += shaken * (process_time() - begun)
        steps += 10 * shaken
        held.append(data.body("ball").xpos[2] - data.body("hand").xpos[2])
    second = round(1.0 / (10.0 * model.opt.timestep))
    first, last = round(scene.SWINGS) * second, len(held)
    slip = float(np.mean(held[first : first + second]) - np.mean(held[last - second : last]))
    return {name: time / max(steps, 1) for name, time in times.items()} | {"slip": slip, "held": steps}


def drop(make: Callable[[bool], Any], seconds: float = 3.0) -> dict[str, Any]:
    """`sims.heap.timed` of one by the law and one natively."""
    return timed({"law": make(True), "native": make(False)}, seconds)
