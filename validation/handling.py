"""Tasks of gymnasium-robotics' Fetch with the law for all contacts: a cube is pushed, and lifted and held for a minute.

    python -m validation.handling

It leaves what it found in validation/data/handling.json, which `validation.cases.models` tells. Run it as
`validation.census`, where gymnasium_robotics is installed: the models are its own, set up as its environments do it.
"""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from contactlaw.world.records import Array
from validation.census import with_law

FOUND = Path(__file__).parent / "data" / "handling.json"
HALF = 0.025  # [m] of the cube
TABLE = 0.4  # [m] height of the table
SPEED = 0.1  # [m/s] of the gripper
HELD = 60.0  # [s]


class Fetch:
    """The robot, its gripper led by the mocap body, and the cube."""

    def __init__(self, task: str, place: tuple[float, float]) -> None:
        """task: the model's file; place: of the cube on the table [m]."""
        import mujoco

        self.mujoco = mujoco
        root = Path((find_spec("gymnasium_robotics").submodule_search_locations or [""])[0])  # type: ignore[union-attr]
        self.model = with_law(str(root / "envs/assets/fetch" / task))
        self.data = mujoco.MjData(self.model)
        self.data.joint("robot0:slide0").qpos[:] = 0.405
        self.data.joint("robot0:slide1").qpos[:] = 0.48
        self.data.joint("object0:joint").qpos[:] = (*place, TABLE + HALF, 1.0, 0.0, 0.0, 0.0)
        self.model.eq_data[:, 3:10] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
        mujoco.mj_forward(self.model, self.data)
        self.data.mocap_pos[0] = self.data.body("robot0:gripper_link").xpos
        self.data.mocap_quat[0] = [1.0, 0.0, 1.0, 0.0]

    @property
    def grip(self) -> Array:
        """Where the fingers are [m]."""
        return self.data.site("robot0:grip").xpos.copy()

    @property
    def cube(self) -> Array:
        """Where the cube's middle is [m]."""
        return self.data.body("object0").xpos.copy()

    def lead(self, to: Array, speed: float = SPEED) -> None:
        """Move the gripper on a straight line until it is asked to be there."""
        begin = self.data.mocap_pos[0].copy()
        end = begin + to - self.grip
        steps = int(np.linalg.norm(end - begin) / speed / self.model.opt.timestep) + 1
        for i in range(1, steps + 1):
            self.data.mocap_pos[0] = begin + (end - begin) * i / steps
            self.mujoco.mj_step(self.model, self.data)

    def wait(self, seconds: float) -> None:
        """Let it be."""
        self.mujoco.mj_step(self.model, self.data, int(seconds / self.model.opt.timestep))


def pushed() -> dict[str, float]:
    """A cube at rest, pushed by 0.1 m and left: how deep it stands, and how far it creeps in 10 s [m]."""
    fetch = Fetch("push.xml", (1.35, 0.75))
    start = fetch.cube
    fetch.lead(np.array([1.22, 0.75, 0.6]), 0.5)
    fetch.wait(1.0)
    rest = fetch.cube
    fetch.lead(np.array([1.22, 0.75, 0.43]), 0.3)
    fetch.lead(np.array([1.37, 0.75, 0.43]))
    fetch.lead(np.array([1.25, 0.75, 0.43]), 0.3)
    fetch.wait(1.0)
    left = fetch.cube
    fetch.wait(10.0)
    return {
        "sunk": float(TABLE + HALF - rest[2]), "crept before": float(np.hypot(*(rest - start)[:2])),
        "pushed": float(left[0] - rest[0]), "crept": float(np.linalg.norm(fetch.cube - left)),
    }  # fmt: skip


def held() -> dict[str, float]:
    """A cube gripped, lifted by 0.2 m and held: how far it creeps in the fingers [m]."""
    fetch = Fetch("pick_and_place.xml", (1.35, 0.75))
    fetch.data.ctrl[:] = 0.05
    fetch.lead(np.array([1.35, 0.75, 0.55]), 0.5)
    fetch.wait(0.5)
    fetch.lead(np.array([1.35, 0.75, 0.425]), 0.2)
    fetch.data.ctrl[:] = 0.0
    fetch.wait(0.5)
    fetch.lead(np.array([1.35, 0.75, 0.625]))
    fetch.wait(0.5)
    lifted, begin = fetch.cube[2] - TABLE - HALF, fetch.cube - fetch.grip
    fetch.wait(HELD)
    return {"lifted": float(lifted), "crept": float(np.linalg.norm(fetch.cube - fetch.grip - begin))}


def main() -> None:
    """Run both."""
    found: dict[str, Any] = {}
    for name, scene in (("pushed", pushed), ("held", held)):
        found[name] = scene()
        print(name, found[name], flush=True)
        FOUND.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
