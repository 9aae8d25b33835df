"""Which functions of the kernels and the laws a scene enters: seen with the compiler off.

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

from contactlaw.laws import hertz
from contactlaw.laws.base import KNOWN
from sims.scene import Settings
from sims.superball import MASS, RADIUS, pair_of
from sims.worlds import World, new_world
from validation.leave_out_scenes import subjects

PACKAGE = Path(hertz.__file__).parents[1]
FOLDERS = {str(PACKAGE / name) for name in ("kernels", "laws")}
FAR = "far"
Entered = dict[str, Any]
"""calls: how often each function was entered, by `module.name`; laws: how often the force of each law was, by its name;
damper: how often the damper was evaluated.
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
    if not inspect.isfunction(hertz.normal_force):
        raise RuntimeError("NUMBA_DISABLE_JIT must be 1: nothing is seen of compiled kernels")
    calls, damper = Counter[str](), [0]

    def leave(frame: FrameType, event: str, _: Any) -> Any:
        damper[0] += event == "return" and "damping" in frame.f_locals
        return leave

    def enter(frame: FrameType, _: str, __: Any) -> Any:
        path = Path(frame.f_code.co_filename)
        if str(path.parent) not in FOLDERS:
            return None
        calls[f"{path.stem}.{frame.f_code.co_name}"] += 1
        return leave if frame.f_code is hertz.normal_force.__code__ else None

    step = World._step

    def traced(world: World, count: int) -> None:
        sys.settrace(enter)
        try:
            step(world, count)
        finally:
            sys.settrace(None)

    with patch.object(World, "_step", traced):
        run()
    files = {name: Path(inspect.getfile(law)).stem for name, law in KNOWN.items()}
    laws = {name: calls[f"{file}.force"] for name, file in files.items() if calls[f"{file}.force"]}
    return {"calls": dict(calls), "laws": laws, "damper": damper[0]}


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
