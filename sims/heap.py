"""Steel balls poured into a box: how it is built, when it rests, what it rests on, and what that costs."""

import gc
from math import ceil, sqrt
from time import process_time
from types import SimpleNamespace
from typing import Any

import numpy as np

from contactlaw import ContactPair
from sims.contact_point import Array, static_overlap
from sims.options import ball_mass, of_ball
from sims.scene import NATIVE, NONE, Settings
from sims.worlds import Tuning, World, new_world

GRAVITY = 9.81  # [m/s^2]
RADIUS = 0.01  # [m]
PITCH = 2.1 * RADIUS  # of the balls at the start
FRICTION, RESTITUTION = 0.3, 0.5
OPTIONS = of_ball(RADIUS, FRICTION, RESTITUTION)
CROWD_SUBSTEPS = Tuning().crowd_substeps
DEFAULT = SimpleNamespace(material="steel", **{name: one.default for name, one in OPTIONS.items()})
WALLS = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "front": (0.0, 1.0), "back": (0.0, -1.0)}  # normals, x and y
SOLVERS = ("CG", "Newton")
BLOCK = 10  # steps that are timed at once
RESTS = 0.98  # share of the balls that sleep in a heap at rest: what rolls on the floor beside it, nothing brakes


def mass_of(o: Any = DEFAULT) -> float:
    """Of a ball [kg]."""
    return o.mass or ball_mass(o.material, o.radius)


def places(count: int, pitch: float = PITCH, radius: float = RADIUS, seed: int = 0) -> tuple[Array, float]:
    """Where the balls start [m], a lattice with jitter, shape (count, 3); and half the width of the box [m].

    pitch: [m]; with the usual one, 2.1 radii, they fill the floor. On a wider one single balls roll, which nothing
    brakes.
    """
    random = np.random.default_rng(seed)
    across = ceil(count ** (1 / 3) - 1e-9)
    number = np.arange(count)
    lattice = np.stack([number % across, number // across % across, number // across**2], 1) + 0.5
    half = 0.5 * across * pitch
    jitter = 0.4 * (pitch - 2.0 * radius) * random.uniform(-1.0, 1.0, (count, 3))
    return pitch * lattice + jitter + [-half, -half, 2.0 * radius], half


def rolling_loss(o: Any = DEFAULT) -> float:
    """Coefficient of rolling resistance of a ball on the floor, by hysteresis: 3/16 alpha a/R, a of its weight.

    The share alpha of the elastic energy that a cycle of load takes is that of an impact, 1 - e^2. Source: Tabor,
    Proc. R. Soc. A 229 (1955) 198.
    """
    pair = ContactPair(o.material, o.material, o.friction, o.restitution)
    return 3.0 / 16.0 * (1.0 - o.restitution**2) * sqrt(static_overlap(pair, mass_of(o) * GRAVITY, o.radius) / o.radius)


def poured(
    settings: Settings, count: int, solver: str = "Newton", pitch: float = PITCH, o: Any = DEFAULT, seed: int = 0,
    rolling: float = 0.0, crowd: int = CROWD_SUBSTEPS,
) -> Any:  # fmt: skip
    """A world with the balls over the floor of the box; solver: MuJoCo's, where the contact is its own.

    rolling: coefficient of rolling resistance by the law. crowd: substeps of an impact.
    """
    world: Any = new_world(settings, (0.0, 0.0, -GRAVITY), Tuning(crowd_substeps=crowd))
    starts, half = places(count, pitch * o.radius / RADIUS, o.radius, seed)
    world.plane("floor")
    for name, normal in WALLS.items():
        world.plane(name, (-half * normal[0], -half * normal[1], 0.0), (*normal, 0.0))
    balls = [f"ball{number}" for number in range(count)]
    for name, place in zip(balls, starts, strict=True):
        world.ball(name, o.radius, mass_of(o), place)
    if settings.law == NATIVE:
        world.native(o.friction, o.restitution)
        if settings.engine == "mujoco":
            import mujoco

            world.spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")  # type: ignore[attr-defined]
    else:
        pair = ContactPair(o.material, o.material, o.friction, o.restitution, rolling_resistance=rolling)
        world.contact(balls, [*balls, "floor", *WALLS], pair)
    return world


def asleep(world: Any) -> Array:
    """Which balls stand still to the last bit, shape (count,)."""
    if world.settings.engine == NONE:
        return world.world.asleep
    state = world.read()
    return ~(state.velocity.any(axis=1) | state.spin.any(axis=1))


def support(world: Any) -> float:
    """Vertical force of floor and walls on the balls [N]."""
    if world.settings.engine == NONE:
        rows = world.world.contacts
        sign = np.where(rows["bodies"][:, 1] < 0, 1.0, 0.0) - np.where(rows["bodies"][:, 0] < 0, 1.0, 0.0)
        return float(sign @ rows["force"][:, 2])
    from contactlaw.mujoco_plugin import contacts_of

    fixed = world.model.geom_bodyid == 0
    return float(sum(
        one.force[2] for name in world.contacts for one in contacts_of(world.model, world.data, name)
        if fixed[one.geom2]
    ))  # fmt: skip


def build_times(count: int) -> dict[str, float]:
    """Processor time to add balls and compile the model, and to make an MjData of it [s]."""
    import mujoco

    gc.collect()  # what others have left is not collected on this time
    times = [process_time()]
    world = poured(Settings("mujoco"), count)
    model = world.spec.compile()
    times.append(process_time())
    mujoco.MjData(model)  # type: ignore[attr-defined]
    times.append(process_time())
    return {"model": times[1] - times[0], "data": times[2] - times[1]}


def costs(
    count: int, seconds: float, step: float = 2e-3, pitch: float = PITCH, o: Any = DEFAULT, solvers: Any = SOLVERS,
    seed: int = 0, engine: str = "mujoco", crowd: int = CROWD_SUBSTEPS,
) -> dict[str, Any]:  # fmt: skip
    """Processor time of a drop in an engine, by the law and natively with each of MuJoCo's solvers; see `timed`."""
    law, native = Settings(engine, timestep=step), Settings(engine, NATIVE, timestep=step)
    made = {"law": poured(law, count, pitch=pitch, o=o, seed=seed, crowd=crowd)}
    made |= {one: poured(native, count, one, pitch, o, seed) for one in solvers}
    return {"balls": count} | timed(made, seconds)


def timed(made: dict[str, World], seconds: float, asleep_for: float = 0.2) -> dict[str, Any]:
    """Processor time of worlds turn by turn, until the first one rests, and from then on.

    Args:
        made: By name, not started.
        seconds: How long to wait for rest, when RESTS of the balls sleep [s].
        asleep_for: How long to go on then [s].

    Returns:
        drop: Of each until rest, or for so long [s]; lying: the same of what comes then, or None; settled: when it
        rested [s], or None.
    """
    first = next(iter(made.values()))
    for world in made.values():
        world.start()
        world.step(1)
    drop, lying = dict.fromkeys(made, 0.0), dict.fromkeys(made, 0.0)
    settled, spent, end = None, drop, seconds
    while first.time < end:
        for name, world in made.items():
            begun = process_time()
            world.step(BLOCK)
            spent[name] += process_time() - begun
        if settled is None and asleep(first).mean() >= RESTS:
            settled, spent, end = first.time, lying, first.time + asleep_for
    for world in made.values():
        world.close()
    return {"drop": drop, "lying": lying if settled else None, "settled": settled}
