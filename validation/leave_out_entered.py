"""Which functions of the kernels a scene enters, and what its contacts remember: seen with the compiler off.

    NUMBA_DISABLE_JIT=1 python -m validation.leave_out_entered SCENE ...

prints one JSON object. Scenes by the names of `leave_out_scenes.subjects`, as shipped, in PyBullet; "far": a ball that
is nowhere near the floor.
"""

from __future__ import annotations

import inspect
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any
from unittest.mock import patch

from contactlaw.kernels import contact
from contactlaw.laws import LAWS
from sims.scene import Settings
from sims.superball import MASS, RADIUS, pair_of
from sims.worlds import World, new_world
from validation.leave_out_scenes import subjects

KERNELS = str(Path(contact.__file__).parent)
FAR = "far"
Entered = dict[str, Any]
"""calls: how often each function of the kernels was entered, by `module.name`; damper: how often the damper was
evaluated; steps: those of contacts, by law; histories: numbers that a contact has room for beside the header, by law
the most (contacts that share a callback have the room of the widest).
"""


def seen(names: list[str]) -> dict[str, Entered]:
    """What scenes enter, in a process of its own with the compiler off."""
    finished = subprocess.run(
        [sys.executable, "-m", "validation.leave_out_entered", *names], env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parent.parent, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(finished.stdout.splitlines()[-1])


def entered(run: Callable[[], object]) -> Entered:
    """What is entered while the worlds step that are made in a run.

    Raises:
        RuntimeError: The kernels are compiled.
    """
    if not inspect.isfunction(contact.step):
        raise RuntimeError("NUMBA_DISABLE_JIT must be 1: nothing is seen of compiled kernels")
    calls, steps = Counter[str](), Counter[str]()
    lines, first = inspect.getsourcelines(contact.normal_force)
    damped = {first + number for number, line in enumerate(lines) if "damping *" in line}
    damper, names = [0], {law.code: name for name, law in LAWS.items()}
    histories: dict[str, int] = {}

    def line_of(frame: FrameType, event: str, _: Any) -> Any:
        damper[0] += event == "line" and frame.f_lineno in damped
        return line_of

    def call_of(frame: FrameType, _: str, __: Any) -> Any:
        code = frame.f_code
        if not code.co_filename.startswith(KERNELS) or code.co_name == "<module>":
            return None
        calls[f"{Path(code.co_filename).stem}.{code.co_name}"] += 1
        if code is contact.step.__code__:
            law = names[int(frame.f_locals["p"][contact.LAW])]
            steps[law] += 1
            histories[law] = max(histories.get(law, 0), frame.f_locals["h_io"].size - contact.HEADER)
        return line_of if code is contact.normal_force.__code__ else None

    step = World._step

    def traced(world: World, count: int) -> None:
        sys.settrace(call_of)
        try:
            step(world, count)
        finally:
            sys.settrace(None)

    with patch.object(World, "_step", traced):
        run()
    return {"calls": dict(calls), "damper": damper[0], "steps": dict(steps), "histories": histories}


def far() -> None:
    """A superball a metre over the floor for a tenth of a second, in which it falls 5 cm."""
    world = new_world(Settings("pybullet"))
    world.ball("ball", RADIUS, MASS, [0.0, 0.0, 1.0])
    world.plane("floor")
    world.contact("ball", "floor", pair_of(Settings()))
    world.record(0.1)


def main(names: list[str]) -> None:
    """All that are asked for."""
    known = subjects()

    def run(name: str) -> None:
        known[name].scene.run(Settings("pybullet", options=known[name].options))

    print(json.dumps({name: entered(far if name == FAR else partial(run, name)) for name in names}))


if __name__ == "__main__":
    main(sys.argv[1:])
