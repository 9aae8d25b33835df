"""What a MuJoCo step costs with the law, beside the same step with native contact and without any."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import LAWS
from validation.ball import FRICTION, RADIUS, elastic_energy, energy_of, mujoco_ball, steel_pair
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.measure import interleaved, spread, step_table
from validation.picture import bars, limit_line, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TIMESTEP = 1e-6  # [s]; a contact lasts some 100
OVERLAP = 1e-5  # [m] at the start in contact
SLIDING = 0.05  # [m/s]
FREE_STEPS, TOUCH_STEPS = 300, 60
NOTHING, FREE_NATIVE = "free, no contact at all", "free, native contact"
ALONE, AMONG_OTHERS = "free, law alone", "free, law among native contacts"
FREE = {NOTHING: "none", FREE_NATIVE: "native", ALONE: "law alone", AMONG_OTHERS: "law"}
TOUCHING_NATIVE = "touching, native contact"


@register
class MujocoCost(Case):
    """Nanoseconds a step of a ball over a floor."""

    name = "mujoco_cost"
    place = 60
    title = "What a MuJoCo step costs"
    claim = (
        "A MuJoCo step with the law in contact is asked to cost no more than the same step with the engine's own "
        "contact, and in free flight no more than 5 % over the same scene without the law: without any contact where "
        "the geoms touch nothing else (`others=False`), with native detection where they may."
    )
    caption = (
        "Time of one mj_step of a ball over a floor, and the same over its native counterpart; whiskers: quartiles."
    )
    needs = ("mujoco",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """All scenes interleaved; a round is some 10 ms."""
        import mujoco

        scenes: dict[str, tuple[Any, Any, str, float, int]] = {}
        for name, contact in FREE.items():
            scenes[name] = (*mujoco_ball(TIMESTEP, contact), 0.1, FREE_STEPS)
        scenes[TOUCHING_NATIVE] = (*mujoco_ball(TIMESTEP, "native"), -OVERLAP, TOUCH_STEPS)
        for law in LAWS:
            scenes[f"touching, {law}"] = (*mujoco_ball(TIMESTEP, "law", steel_pair(law)), -OVERLAP, TOUCH_STEPS)
        problems = [problem for name, scene in scenes.items() for problem in _check(name, *scene)]

        def place(model: Any, data: Any, height: float) -> None:
            mujoco.mj_resetData(model, data)
            data.qpos[2] = RADIUS + height
            data.qvel[0] = SLIDING
            mujoco.mj_step(model, data)

        prepare: dict[str, Callable[[], object]] = {k: partial(place, m, d, z) for k, (m, d, _, z, _) in scenes.items()}
        runs = {k: partial(mujoco.mj_step, m, d, n) for k, (m, d, _, _, n) in scenes.items()}
        seconds = interleaved(runs, 250 if quick else 1000, prepare, progress)
        steps = {name: scene[4] for name, scene in scenes.items()}
        per_step = {name: s / steps[name] for name, s in seconds.items()}
        base = {name: NOTHING if name in FREE else TOUCHING_NATIVE for name in scenes} | {AMONG_OTHERS: FREE_NATIVE}
        ratios = {name: spread(per_step[name] / per_step[base[name]]) for name in scenes}
        data = {"nanoseconds": {k: spread(1e9 * s) for k, s in per_step.items()}, "ratio": ratios, "over": base}
        limits = [Limit(f"{name}, over {base[name]}", 1.05, ratios[name]["median"]) for name in (ALONE, AMONG_OTHERS)]
        limits += [
            Limit(f"{name}, over native contact", 1.0, ratios[name]["median"])
            for name in scenes
            if name not in (*FREE, TOUCHING_NATIVE)
        ]
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        """A row a scene."""
        return step_table(data["nanoseconds"], data["ratio"], data["over"], "ns", (0, 3))

    def draw(self, data: Data) -> Figure:
        """Times and ratios."""
        figure, (left, right) = panels(2, width=4.8)
        bars(left, list(data["nanoseconds"]), list(data["nanoseconds"].values()))
        left.set_xlabel("time of a step [ns]")
        shown = [name for name, over in data["over"].items() if name != over]
        bars(right, shown, [data["ratio"][name] for name in shown])
        limit_line(right, 1.0, "", vertical=True)
        right.set_xlabel("over the same without the law [-]")
        return figure


def _check(name: str, model: Any, data: Any, contact: str, height: float, steps: int) -> list[str]:
    """Run a scene once and look at every step: finite, inside the friction cone, energy not grown, contact as meant."""
    import mujoco

    mujoco.mj_resetData(model, data)
    data.qpos[2] = RADIUS + height
    data.qvel[0] = SLIDING
    history = None
    if contact:
        from contactlaw import mujoco_plugin

        history = mujoco_plugin.contact_history(model, data, contact)[0]
    first = energy_of(data.qvel[:3], data.qvel[3:]) + elastic_energy(-height)
    for _ in range(steps + 1):
        mujoco.mj_step(model, data)
        overlap = RADIUS - data.qpos[2]
        if not np.isfinite(data.qvel).all():
            return [f"{name}: not finite"]
        if height < 0.0 and overlap <= 0.0:
            return [f"{name}: left the contact"]
        if history is None:
            continue
        from contactlaw.kernels.contact import NORMAL, TANGENTIAL

        pull = float(np.hypot(*history[TANGENTIAL : TANGENTIAL + 2]))
        if pull > FRICTION * history[NORMAL] * (1.0 + 1e-12):
            return [f"{name}: outside the friction cone"]
        if energy_of(data.qvel[:3], data.qvel[3:]) + elastic_energy(overlap) > first * 1.01:
            return [f"{name}: energy grown"]
    return []
