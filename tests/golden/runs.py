"""The golden runs: the law alone, a few short runs by each law in each engine, and every scene of `sims`.

RUNS holds them by name: "what/law", "what/engine/law", and "scene-what/engine" by the scene's own law. Each gives its
quantities by name, with the scale that a difference is judged by. Runs are short; scenes that amplify rounding all the
same are in SENSITIVE and CHAOTIC.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from contactlaw import LAWS, MATERIALS, Body, ContactPair, collide, force_along_path, rebound
from sims import puck
from sims.recording import Recording
from sims.scene import ENGINES, Settings, find_scenes
from sims.worlds import World, new_world

Values = dict[str, tuple[Any, float]]
"""Quantity -> numbers, and their scale."""

LAW_TOLERANCE, ENGINE_TOLERANCE = 1e-12, 1e-9  # over the scale of a quantity
SETUPS = {
    "mujoco-euler": ("mujoco", "mjINT_EULER"),
    "mujoco-rk4": ("mujoco", "mjINT_RK4"),
    "mujoco-implicitfast": ("mujoco", "mjINT_IMPLICITFAST"),
    "pybullet": ("pybullet", ""),
}
"""Name -> engine, and MuJoCo's integrator."""
BY_EVERY_LAW, DEFAULT_LAW = ("mujoco-euler", "pybullet"), "microslip"  # the other integrators run the default law alone
RADIUS, MASS = 0.0254, 0.5377  # a steel ball [m], [kg]
STEP = 2e-3  # [s]


@dataclass(frozen=True)
class Run:
    """What makes a run, the engine that it needs, "": none, and a tolerance of its own."""

    make: Callable[[], Values]
    engine: str = ""
    sensitive: float | None = None

    @property
    def tolerance(self) -> float:
        """Largest difference over the scale."""
        return self.sensitive or (ENGINE_TOLERANCE if self.engine else LAW_TOLERANCE)


SENSITIVE = {"golf": 1e-4, "incline": 1e-5, "coin": 1e-6}
"""Scene -> tolerance, where rounding grows: 1 + 4e-16 on the moment of a kick moves golf by 2e-5 and incline by
2e-6, and machines have differed by as much; coin moves by 6e-8 with the times at which open pairs are looked at."""
CHAOTIC = ("heap", "galton", "billiard_break", "shapes")  # scenes that end elsewhere after any change of rounding


def steel(law: str, **changes: Any) -> ContactPair:
    """Steel on steel, as in the source paper."""
    one = MATERIALS["steel"]
    return ContactPair(one, one, **{"friction": 0.115, "restitution": 0.93, "law": law} | changes)


# ---- the law alone

PSI_1 = np.array([-2.0, 0.4, 1.2, 2.5, 4.0, 7.0])
CHI = np.array([0.7, 1.256, 4.5])
RESTITUTION = np.array([1.0, 0.9, 0.5])

IMPACTS: dict[str, tuple[dict[str, Any], Body, Body | None, tuple[float, float, float]]] = {
    "ball-on-plane": (
        {}, Body(MASS, RADIUS, velocity=(0.2, 0.05, -1.0), spin=(3.0, -5.0, 20.0)), None, (0.0, 0.0, 1.0),
    ),
    "puck-slides": (
        {"restitution": 1.0}, Body(1.6, 0.0508, 2.06e-3, (1.5, 0.0, -1.0)), None, (0.0, 0.0, 1.0),
    ),
    "two-unlike-balls": (
        {"friction": 0.3, "restitution": 0.6}, Body(MASS, RADIUS, velocity=(-0.8, 0.1, -0.5), spin=(0.0, 9.0, 4.0)),
        Body(0.1, 0.0145, velocity=(0.3, 0.0, 0.2), spin=(6.0, 0.0, -2.0)), (0.6, 0.0, 0.8),
    ),
}  # fmt: skip
"""Name -> changes of the pair, bodies, normal."""

#         load    slide back   unload partly, load again   slide on   open, touch elsewhere, turn back
DEPTH = [0.0, 1.0, 1.0, 0.5, 0.8, 0.8, 0.2, -0.2, 0.6, 0.6]  # over 1e-4 R
ALONG = [0.0, 0.6, -0.5, -0.2, 0.1, 1.5, 1.2, 1.0, 1.2, 0.4]  # over mu/kappa times that: what it takes to slide
ACROSS = [0.0, 0.0, 0.6, 0.8, 0.3, -0.7, -0.9, 0.0, 0.4, -0.5]
POINTS = 8  # from one of these to the next


def rebound_grid(law: str) -> Values:
    """psi_2 by restitution, chi and psi_1."""
    psi_2 = rebound(PSI_1, CHI[:, None], law, RESTITUTION[:, None, None])
    return {"psi_2": (psi_2, float(np.abs(PSI_1).max()))}


def impact(name: str, law: str) -> Values:
    """One of IMPACTS: motion after, impulse, and where the energy is a third through the contact and after."""
    changes, a, b, normal = IMPACTS[name]
    out = collide(steel(law, **changes), a, b, normal=normal)
    speed = float(np.linalg.norm(a.velocity))
    forces = np.column_stack([out.normal_force, out.tangential_force])
    energy = [out.kinetic, out.elastic_normal, out.elastic_tangential, out.friction_loss, out.damping_loss]
    return {
        "velocity": ([out.velocity_a, out.velocity_b], speed),
        "spin": ([out.spin_a, out.spin_b], speed / a.radius),
        "impulse": (np.trapezoid(forces, out.time, axis=0), a.mass * speed),
        "energy": (np.array(energy)[:, [out.time.size // 3, -1]], float(out.kinetic[0])),
    }


def path(columns: list[list[float]], law: str) -> Values:
    """Forces on the path above, at every fourth of its points."""
    pair = steel(law, restitution=1.0, radius=RADIUS)
    depth = 1e-4 * RADIUS
    ends = np.arange(len(DEPTH))
    at = np.linspace(0.0, ends[-1], POINTS * int(ends[-1]) + 1)
    way = [pair.friction / pair.kappa * depth * np.interp(at, ends, column) for column in columns]
    normal, tangential = force_along_path(
        pair, depth * np.interp(at, ends, DEPTH), way[0] if len(way) == 1 else np.column_stack(way)
    )
    push = float(normal.max())
    return {"normal force": (normal[4::8], push), "tangential force": (tangential[4::4], pair.friction * push)}


# ---- the engines


def bounce(world: World, law: str) -> Recording:
    """A ball meets a plane, oblique and spinning, half a step after the start; no gravity."""
    speed = 1.0
    height = RADIUS + 0.5 * speed * world.timestep
    world.ball("ball", RADIUS, MASS, [0.0, 0.0, height], [0.2, 0.05, -speed], [3.0, -5.0, 20.0])
    world.plane("floor")
    world.contact("ball", "floor", steel(law))
    duration = steel(law, radius=RADIUS).contact_duration(MASS, speed)
    return world.record(max(1.2 * duration, 4.0 * world.timestep))


def meeting(world: World, law: str) -> Recording:
    """Two unlike balls meet off centre, both spinning; no gravity."""
    world.ball("large", RADIUS, MASS, [0.0, 0.0, 0.0], [0.8, 0.0, 0.1], [0.0, 30.0, -8.0])
    world.ball("small", 0.0145, 0.1, [0.042, 0.01, 0.005], [-0.3, 0.0, 0.0], [10.0, 0.0, 25.0])
    world.contact("large", "small", steel(law))
    return world.record(10 * STEP)


def rest(world: World, law: str) -> Recording:
    """A ball falls by 2 mm, bounces, and comes to rest: it has no angular momentum about a horizontal axis there."""
    world.ball("ball", RADIUS, MASS, [0.0, 0.0, RADIUS + 2e-3], [-0.4 * RADIUS * 2.0, 0.0, 0.0], [0.0, 2.0, 3.0])
    world.plane("floor")
    world.contact("ball", "floor", steel(law, restitution=0.4))
    return world.record(60 * STEP)


def roll(world: World, law: str) -> Recording:
    """A ball falls by 1 mm on a plane, slides, and comes to roll after some 45 ms."""
    world.ball("ball", RADIUS, MASS, [0.0, 0.0, RADIUS + 1e-3], [0.3, 0.0, 0.0])
    world.plane("floor")
    world.contact("ball", "floor", steel(law, friction=0.2, restitution=0.4))
    return world.record(50 * STEP)


def cradle(world: World, law: str) -> Recording:
    """A spinning ball strikes the first of two that touch; no gravity."""
    names = ["one", "two", "three"]
    for number, name in enumerate(names):
        comes = number == 0
        place = 2.0 * RADIUS * number - (3e-3 if comes else 0.0)
        world.ball(name, RADIUS, MASS, [place, 0.0, 0.0], [float(comes), 0.0, 0.0], [0.0, 0.0, 20.0 * comes])
    world.contact(names, names, steel(law, restitution=1.0))
    return world.record(6 * STEP)


DURATION = steel("microslip", radius=RADIUS).contact_duration(MASS, 1.0)
WEIGHT, NONE = (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)
ENGINE_RUNS: dict[str, tuple[Callable[[World, str], Recording], float, tuple[float, float, float], list[int]]] = {
    "bounce-resolved": (bounce, DURATION / 60.0, NONE, [30, -1]),  # in the middle of the contact, and after
    "bounce-2ms": (bounce, STEP, NONE, [-1]),
    "two-balls": (meeting, STEP, NONE, [-1]),
    "rest": (rest, STEP, WEIGHT, [15, -1]),  # while it bounces, and at rest
    "roll": (roll, STEP, WEIGHT, [15, -1]),  # while it slides, and as it rolls
    "cradle-of-three": (cradle, STEP, NONE, [-1]),
}
"""Name -> scene, step [s], gravity [m/s^2], steps after which the motion is kept."""


def in_engine(name: str, setup: str, law: str) -> Values:
    """One of ENGINE_RUNS."""
    engine, integrator = SETUPS[setup]
    scene, timestep, gravity, rows = ENGINE_RUNS[name]
    world = new_world(Settings(engine, timestep=timestep), gravity)
    if integrator:
        import mujoco

        world.spec.option.integrator = getattr(mujoco.mjtIntegrator, integrator)
    recording = scene(world, law)
    return motion(recording, rows)


def of_scene(name: str, engine: str) -> Values:
    """A scene of `sims` as its command runs it: where it ends."""
    return motion(find_scenes()[name].run(Settings(engine)), [-1])


def motion(recording: Recording, rows: list[int]) -> Values:
    """Places and true velocities of the free bodies at some entries; their scales are those of the whole run."""
    free = [track for track in recording.tracks if np.isfinite(track.mass)]
    places, speeds, spins = (np.array([getattr(track, kind) for track in free])
                             for kind in ("positions", "velocities", "spins"))  # fmt: skip
    size, fastest = min(track.size[0] for track in free), float(np.abs(speeds).max())
    return {
        "position": (places[:, rows], max(size, float(np.abs(places).max()))),
        "velocity": (speeds[:, rows], fastest),
        "spin": (spins[:, rows], max(fastest / size, float(np.abs(spins).max()))),
    }


def resolved_puck(engine: str, law: str) -> Values:
    """The puck of `python -m sims puck`, with a step that resolves the contact."""
    out = puck.run(puck.Puck("steel", 1.2, law), engine)
    return {"psi_2": (out.psi2, 1.2), "energy after over before": (out.energy_ratio, 1.0)}


def readout(engine: str, law: str) -> Values:
    """What an engine's contact tells of an oblique bounce under gravity at 2 ms: impulse and ledger."""
    place, velocity, pair = [0.0, 0.0, RADIUS + 1e-3], [0.2, 0.05, -1.0], steel(law)
    impulse = np.zeros(3)
    if engine == "mujoco":
        import mujoco

        from contactlaw import mujoco_plugin

        model = mujoco_plugin.load_model(BALL, [("ball", "floor", pair)])
        data = mujoco.MjData(model)
        data.qpos[:3], data.qvel[:3] = place, velocity
        (name,) = mujoco_plugin.instances_of(model)
        for _ in range(5):
            mujoco.mj_step(model, data)
            impulse += sum((one.impulse for one in mujoco_plugin.contacts_of(model, data, name)), np.zeros(3))
        told = mujoco_plugin.ledger_of(model, data, name)
        work = [told.normal_work, told.tangential_work]
    else:
        import pybullet

        from contactlaw.pybullet_callback import ContactCallback
        from tests.engines import pybullet_scenes as scenes

        client = pybullet.connect(pybullet.DIRECT)
        pybullet.setGravity(*WEIGHT, client)
        pybullet.setTimeStep(STEP, client)
        ball, contact = scenes.ball(client, place, velocity, radius=RADIUS, mass=MASS), ContactCallback(client)
        handle = contact.add_contact(ball, scenes.plane(client), pair)
        for _ in range(5):
            contact()
            pybullet.stepSimulation(client)
            impulse += contact.state(handle).impulse
        told = contact.ledger(handle)
        work = [told.normal_work, told.tangential_work]
        pybullet.disconnect(client)
    return {
        "impulse": (impulse, MASS),
        "work": (work, 0.5 * MASS),
        "impacts": (told.impacts, 1.0),
        "greatest overlap": (told.greatest_overlap, told.greatest_overlap),
        "greatest force": (told.greatest_force, told.greatest_force),
        "time in contact": (told.time_in_contact, told.time_in_contact),
    }


BALL = f"""<mujoco><option timestep="{STEP}"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
  <body pos="0 0 1"><freejoint/><geom name="ball" size="{RADIUS}" mass="{MASS}"/></body></worldbody></mujoco>"""


def table() -> dict[str, Run]:
    """Every run by its name."""
    runs: dict[str, Run] = {}
    for law in LAWS:
        runs[f"rebound/{law}"] = Run(partial(rebound_grid, law))
        runs |= {f"collide-{name}/{law}": Run(partial(impact, name, law)) for name in IMPACTS}
        runs[f"path-on-a-line/{law}"] = Run(partial(path, [ALONG], law))
        runs[f"path-in-the-plane/{law}"] = Run(partial(path, [ALONG, ACROSS], law))
        for name, (setup, (engine, _)) in product(ENGINE_RUNS, SETUPS.items()):
            if law == DEFAULT_LAW or setup in BY_EVERY_LAW:
                runs[f"{name}/{setup}/{law}"] = Run(partial(in_engine, name, setup, law), engine)
        for engine in ENGINES:
            runs[f"readout/{engine}/{law}"] = Run(partial(readout, engine, law), engine)
            runs[f"puck-resolved/{engine}/{law}"] = Run(partial(resolved_puck, engine, law), engine)
    for name, scene in find_scenes().items():
        runs |= {
            f"scene-{name}/{engine}": Run(partial(of_scene, name, engine), engine, SENSITIVE.get(name))
            for engine in ENGINES
            if engine in scene.engines and name not in CHAOTIC
        }
    return runs


RUNS = table()
