"""Two fingers hold a ball and are shaken: with the law the ball does not slip if mu suffices; soft constraints creep.

Each finger is a pad on a slide joint, driven by a position actuator (spring kp, damper kv, with MuJoCo's implicitfast
integrator). It presses with `grip` times the force P that the ball needs at the turning points of the shaking, 2 mu P =
m (g + A (2 pi f)^2), measured at the actuator before gravity is switched on. Both fingers are mounted on a hand that
moves up and down by A sin(2 pi f t). The slip is the distance by which the ball sinks relative to the hand from the
first whole second of shaking to the last; on elastic pads it also oscillates.
"""

from math import pi
from time import perf_counter
from typing import Any

import numpy as np

from contactlaw import ContactPair
from contactlaw.laws import law_of
from sims.options import Option, of_ball
from sims.recording import Recording, Track
from sims.scene import NATIVE, Limit, Measured, Scene, Settings, register
from sims.scenes.slope import BEST, set_best

FINGER, HAND = 0.05, 2.0  # [kg]
PAD, PALM = (0.005, 0.03, 0.03), (0.05, 0.05, 0.02)  # half lengths [m]
HOLD = 0.08  # [m] of the hand's middle over the ball
GRAVITY, AMPLITUDE, FREQUENCY = 9.81, 6e-3, 3.0  # [m/s^2], [m], [Hz]
LOADED, SHAKEN, SWINGS = (1.0, 1.2), (1.2, 1.5), 2.0  # [s]: weight and shaking set in; from when it is measured
CLOSING = 0.01  # [s], in which fingers go on by what they lack in force, until the weight sets in
KP, KV = 1e4, 50.0  # [N/m], [N s/m]
FRICTIONS = {"steel": 0.3, "rubber": 0.8}
EVERY = 0.01  # [s] between two entries


def needed(mass: float, friction: float) -> float:
    """Least force of a finger that holds the ball while it is shaken [N]."""
    return mass * (GRAVITY + AMPLITUDE * (2.0 * pi * FREQUENCY) ** 2) / (2.0 * friction)


def pair_of(o: Any) -> ContactPair:
    """Ball of steel, and pads."""
    return ContactPair("steel", o.material, o.friction or FRICTIONS.get(o.material, 0.5), o.restitution or 0.5)


@register
class Grasp(Scene):
    """Seen from the front. The table gives the slip, by the law and with MuJoCo's own contact."""

    name = "grasp"
    title = "two fingers hold a ball and are shaken: how far the ball slips"
    engines = ("mujoco",)
    unable = {"pybullet": "its motors are constraints, not springs", "none": "it has no actuators"}
    shown = 2.5
    apart, exposure = True, 0.625
    slow = 2.0
    in_window = False
    options = {
        "seconds": Option(6.0, "duration of the shaking, in s", 4.0, 1e5),
        "grip": Option(2.0, "force of a finger over the least force that holds the ball", 1e-3, 1e3),
        "best": BEST,
    } | of_ball(0.02, None, None, mass=0.1)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Close the fingers, switch gravity on, then shake."""
        import mujoco

        engine: Any = mujoco
        model = build(settings, o)
        force = o.grip * needed(o.mass, pair_of(o).friction)
        data = engine.MjData(model)
        names = ("ball", "left", "right", "hand")
        ids, shapes = [model.body(name).id for name in names], ("ball", "box", "box", "box")
        stride = max(1, round(EVERY / settings.step))
        count = round(o.seconds / (stride * settings.step))
        rows: list[Any] = []
        begun = perf_counter()
        for number in range(count + 1):
            for _ in range(stride if number else 0):
                drive(model, data, force)
                engine.mj_step(model, data)
            engine.mj_kinematics(model, data)
            rows.append((data.xipos[ids].copy(), data.xmat[ids].reshape(-1, 3, 3).copy(), data.time))
            settings.progress(number / count)
        places, turns = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        times = np.array([row[2] for row in rows])
        sizes: list[tuple[float, ...]] = [(o.radius,), PAD, PAD, PALM]
        tracks = [
            Track(name, shape, size, places[:, i], turns[:, i], np.gradient(places[:, i], times, axis=0),
                  np.zeros_like(places[:, i]), o.mass if name == "ball" else np.inf)
            for i, (name, shape, size) in enumerate(zip(names, shapes, sizes, strict=True))
        ]  # fmt: skip
        law = NATIVE if settings.law == NATIVE else law_of(settings.by_law(pair_of(o)).law).name
        facts = {
            "engine": "mujoco",
            "law": law,
            "timestep": settings.step,
            "wall_time": perf_counter() - begun,
            "force": force,
        }
        return Recording(times, tracks, facts=facts)

    def measure(self, recording: Recording) -> Measured:
        """Slip from the first whole second to the last, and the amplitude of the ball between its pads."""
        held = (recording.track("ball").positions - recording.track("hand").positions)[:, 2] + HOLD
        times, end = recording.times, recording.times[-1]
        first = held[(times >= SWINGS) & (times < SWINGS + 1.0 - 1e-9)]
        last = held[times > end - 1.0 + 1e-9]
        return recording.told("material", "grip", "force") | {
            "seconds": float(end), "slip_um": float(1e6 * (first.mean() - last.mean())),
            "slip_um_per_s": float(1e6 * (first.mean() - last.mean()) / max(end - 1.0 - SWINGS, 1e-9)),
            "swing_um": float(1e6 * np.ptp(last)), "fell": bool(np.abs(held).max() > recording.o.radius),
        }  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """The ball is held without slip if the force suffices."""
        if measured["law"] == NATIVE or measured["grip"] < 1.2:
            return []
        return [
            Limit("the ball falls", 0.0, float(measured["fell"])),
            Limit("slip", 1e-3, abs(measured["slip_um"]), "um"),
        ]

    def caption(self, recording: Recording) -> str:
        """How far it slipped."""
        measured = self.measure(recording)
        slip = abs(measured["slip_um"])
        return "the ball falls" if measured["fell"] else f"slip {slip:.2g} um" if slip > 1e-3 else "slip below 1 nm"


def drive(model: Any, data: Any, force: float) -> None:
    """Set the controls before a step: close the fingers up to a force [N], switch gravity on, shake the hand."""
    if data.time < LOADED[0]:
        data.ctrl[:2] += model.opt.timestep / CLOSING * (force - data.actuator_force[:2]) / KP
    model.opt.gravity[2] = -GRAVITY * ramp(data.time, *LOADED)
    shake = AMPLITUDE * np.sin(2.0 * pi * FREQUENCY * (data.time - SHAKEN[0]))
    data.ctrl[2] = shake * ramp(data.time, *SHAKEN)


def ramp(time: float, begin: float, end: float) -> float:
    """0 before, 1 after, straight between."""
    return min(1.0, max(0.0, (time - begin) / (end - begin)))


def build(settings: Settings, o: Any) -> Any:
    """Build the model, with fingers that touch the ball and are commanded to stay there."""
    import mujoco

    from contactlaw.mujoco_plugin import add_contact

    engine: Any = mujoco
    spec = engine.MjSpec()
    spec.option.timestep, spec.option.integrator = settings.step, engine.mjtIntegrator.mjINT_IMPLICITFAST
    slide = engine.mjtJoint.mjJNT_SLIDE
    hand = spec.worldbody.add_body(name="hand", explicitinertial=True, ipos=[0.0, 0.0, HOLD])
    hand.mass, hand.inertia = HAND, [1.0] * 3
    hand.add_joint(name="lift", type=slide, axis=[0.0, 0.0, 1.0])
    box = engine.mjtGeom.mjGEOM_BOX
    hand.add_geom(type=box, size=PALM, pos=[0.0, 0.0, HOLD], contype=0, conaffinity=0, mass=0.0)
    pair = settings.by_law(pair_of(o)) if settings.law != NATIVE else pair_of(o)
    for name, side in (("left", -1.0), ("right", 1.0)):
        finger = hand.add_body(name=name)
        finger.add_joint(name=name, type=slide, axis=[-side, 0.0, 0.0])
        finger.add_geom(name=name, type=box, size=PAD, pos=[side * (o.radius + PAD[0]), 0.0, 0.0], mass=FINGER)
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint()
    ball.add_geom(name="ball", size=[o.radius, 0.0, 0.0], mass=o.mass)
    for name, kp, kv in (("left", KP, KV), ("right", KP, KV), ("lift", 1e5, 2e3)):
        made = spec.add_actuator(name=name, target=name, trntype=engine.mjtTrn.mjTRN_JOINT)
        made.biastype = engine.mjtBias.mjBIAS_AFFINE
        made.gainprm[0], made.biasprm[1], made.biasprm[2] = kp, -kp, -kv
    if settings.law == NATIVE:
        for geom in spec.geoms:
            geom.friction = [pair.friction, 0.005, 1e-4]
        if o.best:
            set_best(spec.option)
    else:
        add_contact(spec, "ball", ["left", "right"], pair, others=False)
    return spec.compile()
