"""Tasks of other packages with the law for all contacts: a cube pushed, gripped and lifted, and a block in a hand.

    python -m validation.handling [pushed held hand lift]

The results go to validation/data/handling.json, which `validation.cases.models` reports. Run it as `validation.census`,
where gymnasium_robotics and robosuite are installed: the models are theirs, set up as in their environments. Each scene
also runs with the engine's own contact; its cost is the processor time over that.
"""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

import json
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from contactlaw.world.data.records import Array
from validation.census import with_law

FOUND = Path(__file__).parent / "data" / "handling.json"
HALF = 0.025  # [m] of the cube
TABLE = 0.4  # [m] height of the table
SPEED = 0.1  # [m/s] of the gripper
HELD = 60.0  # [s]
LIFTED = """<mujoco><option timestep=".002"/><worldbody><geom name="table" type="plane" size="1 1 .1"/>
    <body name="mocap" mocap="true" pos="0 0 .25" quat="0 1 0 0"/>
    <body name="hand" pos="0 0 .25" quat="0 1 0 0"><freejoint/><geom size=".01" mass=".5" contype="0" conaffinity="0"/>
    </body><body name="cube" pos="0 0 .021"><freejoint name="cube"/>
    <geom name="cube" type="box" size=".021 .021 .021" density="1000"/></body></worldbody>
    <equality><weld body1="mocap" body2="hand"/></equality></mujoco>"""
Read = Callable[[Any], Any]


def by_law(source: Any) -> Any:
    """A model with the law for all its contacts, steel on steel: what is hard keeps its shape at edges that are small.

    Grippers of thousands of N/m press fingers whose edges have 1 mm into rubber by several of these.
    """
    return with_law(source, "steel")


def natively(source: Any) -> Any:
    """The model as it is."""
    import mujoco

    text = source.lstrip().startswith("<")
    return mujoco.MjModel.from_xml_string(source) if text else mujoco.MjModel.from_xml_path(source)


def file_of(package: str, path: str) -> Path:
    """A file of an installed package."""
    return Path((find_spec(package).submodule_search_locations or [""])[0]) / path  # type: ignore[union-attr]


class Led:
    """A model whose hand goes where a mocap body leads it."""

    def __init__(self, model: Any, hand: str, cube: str) -> None:
        """hand: body that is led; cube: what it handles."""
        import mujoco

        self.mujoco, self.model, self.data, self.spent = mujoco, model, mujoco.MjData(model), 0.0
        self._hand, self._cube = hand, cube

    @property
    def grip(self) -> Array:
        """Where the hand is [m]."""
        return self.data.body(self._hand).xpos.copy()

    @property
    def cube(self) -> Array:
        """Where the cube's middle is [m]."""
        return self.data.body(self._cube).xpos.copy()

    def lead(self, to: Array, speed: float = SPEED) -> None:
        """Move the hand on a straight line until it is asked to be there."""
        begin = self.data.mocap_pos[0].copy()
        end = begin + to - self.grip
        steps = int(np.linalg.norm(end - begin) / speed / self.model.opt.timestep) + 1
        for i in range(1, steps + 1):
            self.data.mocap_pos[0] = begin + (end - begin) * i / steps
            self.step(1)

    def wait(self, seconds: float) -> None:
        """Let it be."""
        self.step(round(seconds / self.model.opt.timestep))

    def step(self, count: int) -> None:
        """Take so many steps, and count their processor time [s]."""
        begin = time.thread_time()
        self.mujoco.mj_step(self.model, self.data, count)
        self.spent += time.thread_time() - begin

    @property
    def overlap(self) -> float:
        """The greatest overlap [m] of what touches by the law now."""
        from contactlaw.mujoco_plugin import contacts_of, instances_of

        every = [c for number in instances_of(self.model) for c in contacts_of(self.model, self.data, number)]
        return float(max((c.overlap for c in every), default=0.0))

    @property
    def us(self) -> float:
        """Processor time of a step so far, in the mean [us]."""
        return 1e6 * self.spent / max(self.data.time / self.model.opt.timestep, 1.0)


class Fetch(Led):
    """The robot of gymnasium-robotics, and the cube at a place (x, y) on the table [m]."""

    def __init__(self, read: Read, task: str, place: tuple[float, float]) -> None:
        path = file_of("gymnasium_robotics", f"envs/assets/fetch/{task}")
        super().__init__(read(str(path)), "robot0:gripper_link", "object0")
        self.data.joint("robot0:slide0").qpos[:] = 0.405
        self.data.joint("robot0:slide1").qpos[:] = 0.48
        self.data.joint("object0:joint").qpos[:] = (*place, TABLE + HALF, 1.0, 0.0, 0.0, 0.0)
        self.model.eq_data[:, 3:10] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
        self.mujoco.mj_forward(self.model, self.data)
        self.data.mocap_pos[0] = self.data.body("robot0:gripper_link").xpos
        self.data.mocap_quat[0] = [1.0, 0.0, 1.0, 0.0]

    @property
    def grip(self) -> Array:
        """Where the fingers are [m]."""
        return self.data.site("robot0:grip").xpos.copy()


def pushed(read: Read) -> dict[str, float]:
    """A cube at rest, pushed by 0.1 m and left: how deep it stands, and how far it creeps in 10 s [m]."""
    fetch = Fetch(read, "push.xml", (1.35, 0.75))
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
        "pushed": float(left[0] - rest[0]), "crept": float(np.linalg.norm(fetch.cube - left)), "us": fetch.us,
    }  # fmt: skip


def held(read: Read) -> dict[str, float]:
    """A cube gripped, lifted by 0.2 m and held: how far it creeps in the fingers [m]."""
    fetch = Fetch(read, "pick_and_place.xml", (1.35, 0.75))
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
    crept = float(np.linalg.norm(fetch.cube - fetch.grip - begin))
    return {"lifted": float(lifted), "crept": crept, "overlap": fetch.overlap, "us": fetch.us}


def hand(read: Read) -> dict[str, float]:
    """A block dropped into the Shadow hand, its joints in the middle of their ranges, as after a reset: 10 s.

    gain: of the block's energy over that at the start, at most, over its weight times 1 m.
    """
    scene = Led(read(str(file_of("gymnasium_robotics", "envs/assets/hand/manipulate_block.xml"))), "object", "object")
    model, data = scene.model, scene.data
    data.ctrl[:] = model.actuator_ctrlrange.mean(1)
    scene.mujoco.mj_forward(model, data)
    body = model.body("object").id
    weight, first = 9.81 * model.body_mass[body], model.joint("object:joint").dofadr[0]

    def energy() -> float:
        v = data.qvel[first : first + 6]
        motion = model.body_mass[body] * v[:3] @ v[:3] + model.body_inertia[body] @ v[3:] ** 2
        return float(0.5 * motion + weight * scene.cube[2])

    start, most, over = energy(), -np.inf, 0.0
    places = []
    for _ in range(1000):
        scene.wait(0.01)
        most = max(most, energy())
        over = max(over, scene.overlap)
        places.append(scene.cube)
    crept = float(np.linalg.norm(places[-1] - places[-501]))
    gain = float((most - start) / weight)
    return {"height": float(places[-1][2]), "gain": gain, "overlap": over, "crept": crept, "us": scene.us}


def lift(read: Read) -> dict[str, float]:
    """The Panda gripper of robosuite, led from above, grips the cube of its Lift, lifts it by 0.1 m, holds it 10 s."""
    import mujoco

    spec = mujoco.MjSpec.from_string(LIFTED)
    gripper = mujoco.MjSpec.from_file(str(file_of("robosuite", "models/assets/grippers/panda_gripper.xml")))
    folder = file_of("robosuite", "models/assets/grippers")
    for mesh in gripper.meshes:
        mesh.file = str(folder / mesh.file)
    spec.attach(gripper, prefix="gripper_", frame=spec.body("hand").add_frame())
    spec.compile()
    scene = Led(read(spec.to_xml()), "hand", "cube")
    opened, closed = [0.04, -0.04], [0.0, 0.0]
    scene.data.ctrl[:] = opened
    scene.mujoco.mj_forward(scene.model, scene.data)
    scene.wait(0.5)
    scene.lead(np.array([0.0, 0.0, 0.115]))
    scene.wait(0.5)
    scene.data.ctrl[:] = closed
    scene.wait(1.0)
    scene.lead(np.array([0.0, 0.0, 0.215]))
    scene.wait(0.5)
    lifted, begin, over, slips = scene.cube[2] - 0.021, scene.cube - scene.grip, 0.0, []
    for _ in range(100):
        scene.wait(0.1)
        over = max(over, scene.overlap)
        slips.append(float(np.linalg.norm(scene.cube - scene.grip - begin)))
    return {"lifted": float(lifted), "crept": max(slips), "overlap": over, "us": scene.us}


def main() -> None:
    """Run all, or those that are named."""
    scenes = {"pushed": pushed, "held": held, "hand": hand, "lift": lift}
    found: dict[str, Any] = json.loads(FOUND.read_text()) if FOUND.exists() else {}
    for name in sys.argv[1:] or scenes:
        scenes[name](by_law)  # compiles what it needs
        found[name] = {read.__name__: scenes[name](read) for read in (by_law, natively)}
        print(name, found[name], flush=True)
        FOUND.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
