"""A table tennis ball with topspin meets a paddle that hangs on a hinge: a body with a joint.

The joint decides the effective mass of the paddle in the contact: with L the height of the contact point over the hinge
and I the moment of inertia about it, 1/m_N = 1/m + L^2/I; along its face the paddle cannot move, m_T = m/(1 + m
R^2/I_ball). With these masses the reference holds as for a free ball. Only the hinge holds the paddle, so the angular
momentum of ball and paddle about its axis is conserved. The rubber grips, so the spin reverses.

Ball as in `table_tennis`; blade of 90 g; friction 0.8 and restitution 0.8 of ball and rubber are assumed (the contact
is a soft layer under a shell, not Hertz's: measure yours for quantitative use).
"""

from dataclasses import replace
from typing import Any

import numpy as np

from contactlaw import ContactPair
from contactlaw.laws import law_of
from sims.contact_point import contact_velocity, rebound_of
from sims.hinged_paddle import ENGINES, Setup
from sims.options import Option, of_ball, speed
from sims.recording import Recording, Track, line
from sims.scene import NATIVE, Limit, Mark, Measured, Scene, Settings, register, signed
from sims.scenes import table_tennis

GYRATION = table_tennis.GYRATION
HALF, HEIGHT, BLADE, ARMATURE = (0.004, 0.076, 0.076), 0.15, 0.09, 1e-4  # [m], [m], [kg], [kg m^2]
NORMAL = np.array([1.0, 0.0, 0.0])  # of the face
LEAD, AFTER = 0.0203, 0.06  # times before the touch and after [s]


@register
class Paddle(Scene):
    """Seen from the side; without gravity. By the law only: there is no native contact to compare with."""

    name = "paddle"
    title = "a table tennis ball with topspin meets a paddle on a hinge"
    beside_native = False
    exposure, slow = 0.014, 20.0
    in_window = False
    material = None
    options = {
        "speed": speed(3.0, "speed of the ball onto the face"),
        "up": Option(1.0, "speed of the ball up along the face, in m/s", -100.0, 100.0),
        "topspin": Option(4.0, "topspin R omega, in m/s", -100.0, 100.0),
    } | of_ball(0.02, 0.8, 0.8, mass=2.7e-3)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Throw the ball at the middle of the blade."""
        if settings.law == NATIVE:
            raise ValueError(f"law = {NATIVE!r}: must be one of the laws; this scene has no other contact")
        velocity = np.array([-o.speed, 0.0, o.up])
        setup = Setup(
            pair=settings.by_law(pair_of(o)), radius=o.radius, mass=o.mass, inertia=GYRATION * o.mass * o.radius**2,
            position=np.array([o.radius, 0.0, HEIGHT]) - LEAD * velocity, velocity=velocity,
            spin=np.array([0.0, -o.topspin / o.radius, 0.0]), half_sizes=HALF, height=HEIGHT,
            paddle_mass=BLADE, armature=ARMATURE, timestep=settings.step,
        )  # fmt: skip
        count = round((LEAD + AFTER) / settings.step)
        places, turns, speeds, spins, angles, rates = (
            np.array(one) for one in zip(*ENGINES[settings.engine](setup, count), strict=True)
        )
        ball = Track("ball", "ball", (o.radius,), places, turns, speeds, spins, o.mass, (setup.inertia,) * 3)
        c, s, zero, one = np.cos(angles), np.sin(angles), np.zeros_like(angles), np.ones_like(angles)
        leaning = np.moveaxis(np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]]), -1, 0)
        turning = rates[:, None] * np.array([0.0, 1.0, 0.0])
        centres = leaning @ setup.centre
        paddle = Track("paddle", "box", HALF, centres, leaning, np.cross(turning, centres), turning, BLADE,
                       tuple((setup.moments + [0.0, ARMATURE, 0.0]).tolist()))  # fmt: skip
        law = law_of(setup.pair.law).name
        facts = {"engine": settings.engine, "law": law, "timestep": settings.step, "gravity": [0.0] * 3}
        hinge = line([0.0, -HALF[1], 0.0], [0.0, HALF[1], 0.0], name="hinge")
        times = np.linspace(0.0, settings.step * count, count + 1)
        return Recording(times, [ball, paddle], [hinge], facts=facts | {"hinge_inertia": setup.hinge_inertia})

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Labels of the hinge and of the incoming ball."""
        x, _, z = recording.track("ball").positions[0]
        return [(0.0, 0.0, "hinge"), (x, z - recording.o.radius, "in")]

    def caption(self, recording: Recording) -> str:
        """Spin of the ball before and after, and the paddle's rate of rotation after."""
        ball, paddle = ([track.spins[i, 1] for i in (0, -1)] for track in recording.tracks)
        return (f"spin {signed(ball[0], 0)} \N{RIGHTWARDS ARROW} {signed(ball[1], 0)} rad/s; "
                f"the paddle turns at {signed(paddle[1], 2)} rad/s")  # fmt: skip

    def measure(self, recording: Recording) -> Measured:
        """Velocity of the ball's contact point relative to the paddle's, before and after."""
        ball, paddle, inertia = recording.track("ball"), recording.track("paddle"), recording.facts["hinge_inertia"]
        ends, o, pair = [0, -1], recording.o, pair_of(recording.o)
        touch = np.array([0.0, 0.0, HEIGHT])
        points = contact_velocity(ball.velocities[ends], ball.spins[ends], NORMAL, o.radius)
        points = points - np.cross(paddle.spins[ends], touch)
        chi = pair.chi(1.0 / (1.0 / o.mass + HEIGHT**2 / inertia), o.mass / (1.0 + 1.0 / GYRATION))
        about_hinge = o.mass * np.cross(ball.positions[ends], ball.velocities[ends])[:, 1]
        about_hinge += GYRATION * o.mass * o.radius**2 * ball.spins[ends, 1] + inertia * paddle.spins[ends, 1]
        duration = pair.contact_duration(o.mass, -float(ball.velocities[0, 0]))
        energy = ball.energy() + 0.5 * inertia * paddle.spins[:, 1] ** 2
        return {key: recording.facts[key] for key in ("engine", "law", "timestep")} | {
            "chi": chi, "asked_restitution": o.restitution,
            "spin_before": float(ball.spins[0, 1]), "spin_after": float(ball.spins[-1, 1]),
            "paddle_rate": float(paddle.spins[-1, 1]), "energy_ratio": float(energy[-1] / energy[0]),
            "momentum_error": float(abs(about_hinge[1] / about_hinge[0] - 1.0)),
            "lever_change": float(np.abs(ball.velocities[:, 2]).max() * duration / HEIGHT),
        } | rebound_of(pair, chi, points[0], points[1], NORMAL)  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """Rebound against the reference, restitution, angular momentum about the hinge, energy; the paddle turns."""
        # Within a step the lever arms are those of the touch: no better than the way along the face over the height.
        asked = measured["lever_change"]
        out = [Limit("relative change of angular momentum about the hinge", asked, measured["momentum_error"])]
        if measured["law"] != "microslip":
            return out
        return out + [
            Limit("error of psi_2", 4e-3, abs(measured["psi2"] - measured["psi2_reference"])),
            Limit("error of the restitution", 1e-3, abs(measured["restitution"] - measured["asked_restitution"])),
            Limit("energy after over that before", 1.001, measured["energy_ratio"]),
            Limit("rate of the paddle", 0.1, -measured["paddle_rate"], "rad/s", at_least=True),
        ]


def pair_of(o: Any) -> ContactPair:
    """Ball and the paddle's rubber; as soft as a shell."""
    return replace(table_tennis.pair_of(), friction=o.friction, restitution=o.restitution, radius=o.radius)
