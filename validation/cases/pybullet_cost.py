"""What a PyBullet step costs with the callback, beside the same step alone and with native contact."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from contactlaw import LAWS
from validation.ball import FRICTION, BulletBall, elastic_energy, energy_of, steel_pair
from validation.case import Case, Data, Outcome, Progress, Table, register
from validation.measure import interleaved, spread, step_table
from validation.picture import bars, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TIMESTEP = 1e-6  # [s]; a contact lasts some 100
OVERLAP = 1e-5  # [m] at the start in contact
SLIDING = 0.05  # [m/s]
FREE_STEPS, TOUCH_STEPS = 200, 50
ALONE = "free, stepSimulation alone"
NATIVE = "touching, native contact"


@register
class PybulletCost(Case):
    """Microseconds a step of a ball over a floor."""

    name = "pybullet_cost"
    place = 70
    title = "What a PyBullet step costs"
    claim = (
        "PyBullet has no step callback of its own, so the law is Python code between two steps: it reads where both "
        "bodies are and how they move in every step, and in contact applies a force to each. Those calls are most of "
        "its time. No limit is set here."
    )
    caption = "Time of one step (callback and stepSimulation) of a ball over a floor; whiskers: quartiles."
    needs = ("pybullet",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """All scenes interleaved."""
        kinds = {
            ALONE: ("none", "microslip"),
            "free, native contact": ("native", "microslip"),
            "free, law": ("law", "microslip"),
        }
        kinds |= {NATIVE: ("native", "microslip")} | {f"touching, {law}": ("law", law) for law in LAWS}
        scenes = {name: BulletBall(TIMESTEP, contact, steel_pair(law)) for name, (contact, law) in kinds.items()}
        steps = {name: FREE_STEPS if name.startswith("free") else TOUCH_STEPS for name in scenes}
        heights = {name: 0.1 if name.startswith("free") else -OVERLAP for name in scenes}
        try:
            problems = [p for name, scene in scenes.items() for p in _check(name, scene, heights[name], steps[name])]
            prepare = {name: partial(_place, scene, heights[name]) for name, scene in scenes.items()}
            runs = {name: partial(scene.step, steps[name]) for name, scene in scenes.items()}
            seconds = interleaved(runs, 40 if quick else 200, prepare, progress)
        finally:
            for scene in scenes.values():
                scene.close()
        per_step = {name: s / steps[name] for name, s in seconds.items()}
        over = {name: ALONE if name.startswith("free") else NATIVE for name in scenes}
        data = {
            "microseconds": {name: spread(1e6 * s) for name, s in per_step.items()},
            "ratio": {name: spread(per_step[name] / per_step[over[name]]) for name in scenes},
            "over": over,
        }
        return Outcome([], data, problems)

    def table(self, data: Data) -> Table:
        """A row a scene."""
        return step_table(data["microseconds"], data["ratio"], data["over"], "us", (2, 2))

    def draw(self, data: Data) -> Figure:
        """Times."""
        figure, (axes,) = panels(1, width=6.0)
        bars(axes, list(data["microseconds"]), list(data["microseconds"].values()))
        axes.set_xlabel("time of a step [us]")
        return figure


def _place(scene: BulletBall, height: float) -> None:
    scene.start(height, [SLIDING, 0.0, 0.0])
    scene.step(1)


def _check(name: str, scene: BulletBall, height: float, steps: int) -> list[str]:
    """Run a scene once and look at every step: finite, inside the friction cone, energy not grown, contact as meant."""
    scene.start(height, [SLIDING, 0.0, 0.0])
    first = energy_of(*scene.motion) + elastic_energy(-height)
    for _ in range(steps + 1):
        scene.step(1)
        velocity, spin = scene.motion
        if not np.isfinite(energy_of(velocity, spin)):
            return [f"{name}: not finite"]
        if scene.callback is None:
            continue
        state = scene.callback.state(scene.handle)
        if state.touching != (height < 0.0):
            return [f"{name}: {'apart' if height < 0.0 else 'touching'}"]
        if np.linalg.norm(state.tangential_force) > FRICTION * state.normal_force * (1.0 + 1e-9):
            return [f"{name}: outside the friction cone"]
        if energy_of(velocity, spin) + elastic_energy(-scene.height) > first * 1.01:
            return [f"{name}: energy grown"]
    return []
