"""The law in an environment of dm_control: ball_in_cup, whose ball strikes the bottom of the cup.

`python -m sims.dm_control_example` prints how the ball leaves, by the engine's own contact and by the law. Needs
`pip install dm_control`.
"""

# The wheel of mujoco describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

# Not among the project's own extras: it brings much and asks for certain versions of MuJoCo.
# pyright: reportMissingImports=false

from dataclasses import dataclass
from importlib.util import find_spec
from math import sqrt
from typing import Any

from contactlaw import MATERIALS, ContactPair, rebound

BALL, ROD = 0.025, 0.008  # radii of the ball and of what the cup is made of [m]
RADIUS = 1.0 / sqrt((1.0 / BALL) * (1.0 / BALL + 1.0 / ROD))  # of the ball on the side of a rod [m]
PAIR = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.1, restitution=0.8, radius=RADIUS)
HEIGHT = 0.03  # of the ball over the bottom of the cup [m]
VELOCITY = (0.1, -1.0)  # of the ball, sideways and upwards [m/s]
STEPS = 25  # of the engine, 2 ms each: the ball arrives in the 15th


@dataclass(frozen=True)
class Strike:
    """Velocity of ball over cup before and after [m/s]; neither can turn, so that it is that of the point of contact.

    Attributes:
        upward: Positive: they part.
        sideways: Across that, in the plane of all motion.
    """

    upward: tuple[float, float]
    sideways: tuple[float, float]

    @property
    def restitution(self) -> float:
        """The share of the approach that comes back."""
        return -self.upward[1] / self.upward[0]


def load(law: bool) -> Any:
    """The environment, with its own model or with the law in it."""
    _forget_dropped_fields()
    from dm_control import suite
    from dm_control.suite import ball_in_cup

    from contactlaw.mujoco_plugin import model_xml

    env = suite.load("ball_in_cup", "catch", task_kwargs={"random": 1})
    if law:
        xml, assets = ball_in_cup.get_model_and_assets()
        env.physics.reload_from_xml_string(model_xml(xml, [("ball", "cup_part_*", PAIR)], assets=assets), assets)
    return env


def start(env: Any) -> None:
    """Reset the environment to a place where the ball is clear of the cup.

    The environment draws places until the engine has no contact: it does not see those of the law.
    """
    from contactlaw.mujoco_plugin import overlaps_of

    env.reset()
    while overlaps_of(env.physics.model.ptr, env.physics.data.ptr):
        env.reset()


def strike(law: bool) -> Strike:
    """Throw the ball at the bottom of the cup."""
    env = load(law)
    start(env)
    physics = env.physics
    model = physics.model
    model.opt.gravity[:] = 0.0
    model.dof_damping[:] = model.jnt_stiffness[:] = 0.0  # what is measured is the contact, not what holds the cup
    with physics.reset_context():
        qpos, qvel = physics.named.data.qpos, physics.named.data.qvel
        qpos[:] = qvel[:] = 0.0
        # The bottom of the cup is 0.1 m below its frame, at 0.6 m; the ball is at 0.2 m where its joints are at zero.
        qpos["ball_z"] = 0.6 - 0.1 - 0.2 + ROD + BALL + HEIGHT
        qvel["ball_x"], qvel["ball_z"] = VELOCITY
        # So that the ball meets the middle of the bottom, where the cup has nothing but that under it.
        qpos["ball_x"] = VELOCITY[0] * HEIGHT / VELOCITY[1]
    physics.step(STEPS)
    velocity = physics.named.data.qvel
    after = [float(velocity[f"ball_{axis}"][0] - velocity[f"cup_{axis}"][0]) for axis in "xz"]
    return Strike((VELOCITY[1], after[1]), (VELOCITY[0], after[0]))


def expected() -> float:
    """The sideways velocity after, by the closed law of one impact [m/s]; the masses are the same in all directions."""
    psi = PAIR.psi(VELOCITY[0], -VELOCITY[1])
    return VELOCITY[0] * float(rebound(psi, PAIR.chi(1.0, 1.0), PAIR.law, PAIR.restitution)) / psi


def check() -> dict[str, Strike]:
    """Both strikes; raises AssertionError if the law's is not what the law says, or the engine's own is too."""
    strikes = {"engine": strike(law=False), "law": strike(law=True)}
    law = strikes["law"]
    assert abs(law.restitution - PAIR.restitution) < 0.01, law
    assert abs(law.sideways[1] - expected()) < 0.01 * VELOCITY[0], (law, expected())
    assert strikes["engine"].restitution < 0.5 * PAIR.restitution, strikes["engine"]
    return strikes


def _forget_dropped_fields() -> None:
    """Let dm_control run on a MuJoCo that has dropped fields which dm_control still lists (1.0.50 on 4.0)."""
    import mujoco
    from dm_control.mujoco.wrapper.mjbindings import sizes

    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    for name, struct in (("mjmodel", model), ("mjdata", mujoco.MjData(model))):
        fields = sizes.array_sizes[name]
        for field in [field for field in fields if not hasattr(struct, field)]:
            del fields[field]


if __name__ == "__main__":
    if find_spec("dm_control") is None:
        raise SystemExit("this example needs dm_control: pip install dm_control")
    print(f"{'':8}{'restitution':>12}{'sideways: before':>20}{'after [m/s]':>13}")
    for name, one in check().items():
        print(f"{name:8}{one.restitution:12.3f}{one.sideways[0]:20.3f}{one.sideways[1]:13.4f}")
    print(f"by the law of one impact: {expected():.4f} m/s sideways")
