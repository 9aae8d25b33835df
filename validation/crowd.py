"""What a step of many balls costs with the law, beside MuJoCo with the solver that is cheapest there."""

# pyright: reportAttributeAccessIssue=false
from time import process_time
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair

RADIUS, DENSITY = 0.01, 7800.0  # [m], [kg/m^3]
GAP = 5.0  # radii from centre to centre
STEP = 2e-3  # [s]
ELASTIC = (-2.5e4, -5.0)  # native stiffness and damping: so balls bounce
SOLVERS = ("CG", "Newton")
ARENA = 40  # bytes of MuJoCo's arena for each two balls, of which its broad phase wants many


def crowd(count: int, kind: str) -> Any:
    """Balls in a cube with gaps over a floor: model and data of MuJoCo, by the law, the "law alone" (nothing may touch
    natively), or a native solver's name."""
    import mujoco

    from contactlaw.mujoco_plugin import add_contact

    spec: Any = mujoco.MjSpec()
    spec.option.timestep, spec.memory = STEP, 50_000_000 + ARENA * count * count
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1], solref=ELASTIC)
    across, random = int(np.ceil(count ** (1 / 3) - 1e-9)), np.random.default_rng(0)
    for i in range(count):
        place = GAP * np.array([i % across, i // across % across, i // across**2 + 0.5]) + random.uniform(-0.1, 0.1, 3)
        body = spec.worldbody.add_body(pos=RADIUS * place)
        body.add_freejoint()
        body.add_geom(name=f"ball{i}", size=[RADIUS, 0, 0], density=DENSITY, solref=ELASTIC)
    balls = [f"ball{i}" for i in range(count)]
    if kind in SOLVERS:
        spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{kind.upper()}")
    else:
        pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.2, restitution=0.9)
        add_contact(spec, balls, [*balls, "floor"], pair, others=kind == "law")
    model = spec.compile()
    return model, mujoco.MjData(model)


def step_costs(count: int, steps: int = 100, block: int = 10) -> dict[str, float]:
    """Mean processor time of a step [s] of balls that fall and bounce from the start on, turn by turn.

    Returns that with the law, among native contacts and alone, and "native": of the solver that took less.
    """
    import mujoco

    kinds = {kind: crowd(count, kind) for kind in ("law", "law alone", *SOLVERS)}
    times = dict.fromkeys(kinds, 0.0)
    for _ in range(steps // block):
        for kind, (model, data) in kinds.items():
            begun = process_time()
            mujoco.mj_step(model, data, block)  # type: ignore[attr-defined]
            times[kind] += process_time() - begun
    mean = {kind: time / (steps // block * block) for kind, time in times.items()}
    return {"law": mean["law"], "law alone": mean["law alone"], "native": min(mean[solver] for solver in SOLVERS)}
