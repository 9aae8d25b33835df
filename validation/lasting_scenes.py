"""Crowds and what lasts, in MuJoCo by the law and natively: a tube, a box, an ant, a ball held, thousands that fall."""

from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from time import process_time
from types import SimpleNamespace
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair
from sims.heap import FRICTION, RADIUS, RESTITUTION, SOLVERS
from sims.scene import NATIVE, Settings
from validation.ball import DOWN, FLOOR, STEEL, balls_world
from validation.measure import interleaved

TUBE, BALLS = 1.2 * RADIUS, 5  # half its width [m]
POSE = [0, 1, 0, -1, 0, -1, 0, 1]  # joint angles of an ant that stands [rad]
STEPS = 30  # that are timed at once
GAP = 5.0  # radii from centre to centre, in a crowd
ELASTIC = (2.5e4, 5.0)  # native stiffness and damping: so balls bounce
ARENA = 40  # bytes of MuJoCo's arena for each two balls, of which its broad phase wants many


def tube(law: bool) -> Any:
    """Balls fall into a square tube a little wider than they are, side by side, and wedge."""
    number, normals = np.arange(BALLS), [s * axis for axis in np.eye(3)[:2] for s in (1.0, -1.0)]
    places = RADIUS * np.stack([0.15 * (-1.0) ** number, 0.02 * number, 1.0 + 2.04 * number], 1)
    pair = ContactPair(STEEL, STEEL, FRICTION, RESTITUTION) if law else None
    world = balls_world("mujoco", 2e-3, pair, places, radius=RADIUS, gravity=DOWN,
                        planes=[FLOOR, *((-TUBE * normal, normal) for normal in normals)])  # fmt: skip
    if not law:
        world.native(FRICTION, 0.0)
    return world


def lying_box(begin: float = 0.5) -> dict[str, float]:
    """Median processor time of a step [s] of a box on a slope, by the law on ball feet in its corners and natively,
    turn by turn, from a time on [s]."""
    from sims.scenes import slope

    both = {"law": Settings("mujoco"), "native": Settings("mujoco", NATIVE)}
    worlds = {name: slope.built(how, SimpleNamespace(**slope.Slope().demand(how))) for name, how in both.items()}
    for world in worlds.values():
        world.start()
        world.step(round(begin / world.timestep))
    return a_step({name: partial(world.step, STEPS) for name, world in worlds.items()})


def a_step(runs: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Median processor time of a step [s], turn by turn, of what takes `STEPS` of them in a run."""
    times = interleaved(runs, 10, clock=process_time)
    return {name: float(np.median(found)) / STEPS for name, found in times.items()}


def ant() -> Path | None:
    """Gymnasium's model of an ant, where it is installed."""
    spec = find_spec("gymnasium")
    return Path(str(spec.origin)).parent / "envs" / "mujoco" / "assets" / "ant.xml" if spec else None


def standing_ant(path: Path, seconds: float = 1.0) -> dict[str, float]:
    """The same of the ant on its four legs, of rubber on steel."""
    import mujoco

    from contactlaw.mujoco_plugin import load_model

    engine: Any = mujoco
    pair = ContactPair(MATERIALS["rubber"], STEEL, 1.0, 0.3)
    models = {"law": load_model(path, [("*", "floor", pair)]), "native": engine.MjModel.from_xml_path(str(path))}
    runs = {}
    for name, model in models.items():
        data = engine.MjData(model)
        data.qpos[7:] = POSE
        engine.mj_step(model, data, round(seconds / model.opt.timestep))
        runs[name] = partial(engine.mj_step, model, data, STEPS)
    return a_step(runs)


def grasp(material: str, mass: float, seconds: float) -> dict[str, Any]:
    """A ball [kg] held and shaken for so long [s], see `sims.scenes.grasp`.

    Returns "slip", by the law, of the ball in its fingers from the first whole second of shaking to the last [m]; mean
    processor times of a step [s] by the law and natively, turn by turn, while the native contact holds it; and "fell",
    when that lets it fall [s], or None.
    """
    import mujoco

    from sims.scenes import grasp as scene

    engine, step, worlds, held, fell = mujoco, mujoco.mj_step, {}, [], None  # type: ignore[attr-defined]
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
        if fell is None and abs(native.body("ball").xpos[2] - native.body("hand").xpos[2]) > 0.5 * scene.HOLD:
            fell = native.time
        for name in times if fell is None else ("law",):
            one, state, force = worlds[name]
            shaken = state.time >= scene.SWINGS and fell is None
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
    return {name: time / max(steps, 1) for name, time in times.items()} | {"slip": slip, "fell": fell}


def crowd(count: int, kind: str) -> Any:
    """Balls in a cube with gaps over a floor, in MuJoCo, by the "law", or by a native solver's name."""
    import mujoco

    across, number = ceil(count ** (1 / 3) - 1e-9), np.arange(count)
    lattice = np.stack([number % across, number // across % across, number // across**2 + 0.5], 1)
    places = RADIUS * (GAP * lattice + np.random.default_rng(0).uniform(-0.1, 0.1, lattice.shape))
    pair = None if kind in SOLVERS else ContactPair(STEEL, STEEL, friction=0.2, restitution=0.9)
    world: Any = balls_world("mujoco", 2e-3, pair, places, radius=RADIUS, planes=[FLOOR], gravity=DOWN)
    world.spec.memory = 50_000_000 + ARENA * count * count
    if kind in SOLVERS:
        world.native(1.0, 0.0, ELASTIC)
        world.spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{kind.upper()}")  # type: ignore[attr-defined]
    return world
