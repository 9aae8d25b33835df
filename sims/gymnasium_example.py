"""The law in an environment of gymnasium: Pusher-v5, whose puck strikes the gripper of the arm.

`python -m sims.gymnasium_example` prints how the puck leaves, by the engine's own contact and by the law. Needs
`pip install gymnasium imageio`.
"""

# The wheel of mujoco describes little of what it exports, gymnasium nothing of what is in an environment.
# pyright: reportAttributeAccessIssue=false

import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair, rebound

ENVIRONMENT = "Pusher-v5"
PUCK, GRIPPER = "body:object", "body:r_wrist_roll_link"  # their geoms have no names in this model
PUCK_RADIUS, BAR_RADIUS = 0.05, 0.02  # [m]
RADIUS = sqrt(
    PUCK_RADIUS * BAR_RADIUS
)  # of cylinders at right angles: the puck stands, the bar of the gripper is level
PAIR = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.15, restitution=0.8, radius=RADIUS)

POSE = {"r_shoulder_lift_joint": 0.4, "r_elbow_flex_joint": -0.05, "r_wrist_flex_joint": -0.05}
"""Of the arm [rad]: the bar of the gripper is at the height of the puck, above the table, and no joint at its limit."""

GAP = 0.025  # between puck and bar [m]
VELOCITY = (1.0, 0.2)  # of the puck, across the bar and along it [m/s]
STEPS = 8  # of the engine, 10 ms each: the puck arrives in the third and has left by the eighth


@dataclass(frozen=True)
class Hit:
    """Velocity of the puck over the bar where they touch, before and after [m/s].

    Attributes:
        across: Along the normal; positive: they approach.
        along: Along the bar.
        expected: What `along` is after, by the closed law of one impact, for these masses at the contact.
    """

    across: tuple[float, float]
    along: tuple[float, float]
    expected: float

    @property
    def restitution(self) -> float:
        """The share of the approach that comes back."""
        return -self.across[1] / self.across[0]


def save(folder: Path) -> Path:
    """Write the model of the environment with the law in it."""
    import gymnasium

    from contactlaw.mujoco_plugin import save_model

    with gymnasium.make(ENVIRONMENT) as env:
        source = env.unwrapped.fullpath
    return save_model(source, folder / "pusher.xml", [(PUCK, GRIPPER, PAIR)])


def strike(file: Path | None = None) -> Hit:
    """Throw the puck at the gripper; file: of the model, None: the environment's own."""
    import gymnasium
    import mujoco

    options: dict[str, Any] = {} if file is None else {"xml_file": str(file)}
    made = gymnasium.make(ENVIRONMENT, **options)
    env: Any = made.unwrapped
    env.reset(seed=0)
    model, data = env.model, env.data
    puck, arm = model.body("object").id, model.body("r_wrist_roll_link").id
    model.dof_damping[:] = 0.0  # what is measured is the contact, not the table
    _place(env, puck, arm)
    before, expected = _over(model, data, puck, arm) @ data.qvel, _expected(model, data, puck, arm)
    mujoco.mj_step(model, data, STEPS)
    after = _over(model, data, puck, arm) @ data.qvel
    made.close()
    return Hit((float(before[0]), float(after[0])), (float(before[1]), float(after[1])), expected)


def _place(env: Any, puck: int, arm: int) -> None:
    """Lower the arm, lay the puck before its bar and throw it."""
    model, data = env.model, env.data
    qpos, qvel = np.zeros(model.nq), np.zeros(model.nv)
    for joint, angle in POSE.items():
        qpos[model.joint(joint).qposadr] = angle
    env.set_state(qpos, qvel)
    bar = data.geom_xpos[model.body_geomadr[arm]]
    for joint, axis, place in (("obj_slidex", 0, bar[0] - PUCK_RADIUS - BAR_RADIUS - GAP), ("obj_slidey", 1, bar[1])):
        number = model.joint(joint).id
        qpos[model.jnt_qposadr[number]] = place - data.xpos[puck, axis]
        qvel[model.jnt_dofadr[number]] = VELOCITY[axis]
    env.set_state(qpos, qvel)


def _over(model: Any, data: Any, puck: int, arm: int) -> np.ndarray:
    """What makes of qvel the velocity of the puck over the point of the arm that it faces, shape (3, nv)."""
    import mujoco

    jacobians = np.zeros((2, 3, model.nv))
    for body, jacobian in zip((puck, arm), jacobians, strict=True):
        mujoco.mj_jac(model, data, jacobian, None, data.xpos[puck] + [PUCK_RADIUS, 0.0, 0.0], body)
    return jacobians[0] - jacobians[1]


def _expected(model: Any, data: Any, puck: int, arm: int) -> float:
    import mujoco

    jacobian = _over(model, data, puck, arm)
    lightness = np.zeros_like(jacobian)
    mujoco.mj_solveM(model, data, lightness, jacobian)
    across, along = (1.0 / (jacobian @ lightness.T)[i, i] for i in range(2))
    psi = rebound(PAIR.psi(VELOCITY[1], VELOCITY[0]), PAIR.chi(across, along), PAIR.law, PAIR.restitution)
    return float(psi) * VELOCITY[1] / PAIR.psi(VELOCITY[1], VELOCITY[0])


def check() -> dict[str, Hit]:
    """Both hits; raises AssertionError if the law's is not what the law says, or the engine's own is too."""
    with tempfile.TemporaryDirectory() as folder:
        hits = {"engine": strike(), "law": strike(save(Path(folder)))}
    engine, law = hits["engine"], hits["law"]
    # A hundredth: the arm yields by its joints, which couples the directions that one impact by itself keeps apart.
    assert abs(law.restitution - PAIR.restitution) < 0.01, law
    assert abs(law.along[1] - law.expected) < 0.01 * VELOCITY[0], law
    assert law.along[1] < 0.0 < engine.along[1], hits  # the point of contact moves backwards
    # The engine makes its contact soft by the mass of the puck, 8 mg, and leaves out that its slides are heavier.
    assert engine.restitution < 0.0, engine  # the puck is still on its way through the bar
    return hits


if __name__ == "__main__":
    if find_spec("gymnasium") is None:
        raise SystemExit("this example needs gymnasium: pip install gymnasium")
    print(f"{'':8}{'restitution':>12}{'along the bar: before':>24}{'after':>10}{'by the law [m/s]':>18}")
    for name, hit in check().items():
        print(f"{name:8}{hit.restitution:12.3f}{hit.along[0]:24.3f}{hit.along[1]:10.3f}{hit.expected:18.3f}")
