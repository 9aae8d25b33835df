"""Golf balls struck by club heads of different loft: launch angle and backspin.

A face of loft L that comes at speed V meets the ball with V cos(L) along its normal and V sin(L) across, so that psi_1
= (kappa/mu) tan(L). By the law launch angle and spin over speed depend on psi_1 and chi alone, at any speed. A rigid
ball slides up the face to the end or comes to roll on it. An elastic one may get more spin than one that rolls: its
contact point leaves moving down the face; and it slides to the end at lofts where a rigid one would roll already.

Shots are at 8 m/s (a chip): at the 40 m/s of a full swing the ball is pressed in by a quarter of its radius, far beyond
a small contact. The heads follow their path whatever they hit; a free one of 270 g, six times the ball's mass, would
give some 5 % less spin. Figures: ball by the rules of golf; contact of 0.45 ms at 40 m/s (0.4 to 0.5 ms: D. Tutelman,
What happens at impact) and restitution 0.8 (0.83: Proceedings 49 (2020) 47); nu of the cover 0.45 and friction 0.4 are
assumed. Tangential compliance in golf impacts: The role of friction and tangential compliance on the resultant launch
angle of a golf ball, Proceedings 49 (2020) 27.
"""

from __future__ import annotations

from functools import partial
from math import cos, degrees, radians, sin

import numpy as np

from contactlaw import RIGID, ContactPair, Material, checks
from sims.contact_point import contact_velocity, rebound_of
from sims.recording import Recording
from sims.scene import Limit, Measured, Scene, Settings, register
from sims.worlds import new_world

RADIUS, MASS = 0.02135, 0.0459  # [m], [kg]
HEAD = (0.028, 0.038, 0.008)  # half lengths of a head [m], the last across the face
LOFTS = (10, 15, 20, 25, 30, 34, 40, 45, 50, 55, 60, 65)  # [degrees]; 34: a 7 iron
COVER = Material(1.28e8, 0.45, name="golf ball")  # E such that the contact lasts 0.45 ms at 40 m/s
RESTITUTION = 0.8
LEAD, AFTER = 0.0051, 0.065  # times [s] before the impact and after


@register
class Golf(Scene):
    """A ball on its tee and a head for each loft, side by side; no gravity in these few hundredths of a second."""

    name = "golf"
    title = "golf balls struck at lofts of 10 to 65 degrees: launch angle and backspin"
    exposure, slow = 0.0325, 20.0
    options = {
        "speed": (8.0, "of the heads, in m/s"),
        "friction": (0.4, "of ball and face"),
    }

    def run(self, settings: Settings) -> Recording:
        """All shots at once, each in its lane."""
        self.demand(settings)
        speed = checks.positive("speed", self.option(settings, "speed"))
        friction = checks.positive("friction", self.option(settings, "friction"))
        pair = pair_of(friction)
        world = new_world(settings, gravity=(0.0, 0.0, 0.0))
        for lane, loft in enumerate(LOFTS):
            tee = np.array([0.0, 0.2 * lane, 0.0])
            face, up = axes(loft)
            world.ball(f"ball{loft}", RADIUS, MASS, tee)
            world.paddle(
                f"head{loft}", HEAD, partial(head_at, tee - (RADIUS + HEAD[2]) * face, speed),
                rotation=np.column_stack([-up, [0.0, 1.0, 0.0], face]),
            )  # fmt: skip
            world.contact(f"ball{loft}", f"head{loft}", pair, speed=speed * cos(radians(loft)))
        return world.record(LEAD + AFTER, speed=speed, friction=friction)

    def marks(self, recording: Recording) -> list[tuple[float, float, str]]:
        """Loft, launch angle and backspin of every other ball, beyond its end."""
        out = []
        for loft in LOFTS[::2]:
            ball = recording.track(f"ball{loft}")
            (x, _, z), (ahead, _, up) = ball.positions[-1], ball.velocities[-1]
            way = np.array([ahead, up]) / max(float(np.hypot(ahead, up)), 1e-12)
            launch, spin = degrees(np.arctan2(up, ahead)), -ball.spins[-1, 1]
            text = f"{loft}°: {launch:.0f}°, {spin:.0f}"
            out.append((float(x + 3.2 * RADIUS * way[0]), float(z + 2.0 * RADIUS * way[1] + 0.6 * RADIUS), text))
        return out

    def caption(self, recording: Recording) -> str:
        """What the labels say."""
        return "loft: launch angle, backspin in rad/s"

    def measure(self, recording: Recording) -> Measured:
        """A row for each loft."""
        facts = recording.facts
        speed, pair = facts["speed"], pair_of(facts["friction"])
        chi = pair.chi(MASS, MASS / 3.5)
        moving = np.array([speed, 0.0, 0.0])
        shots = []
        for loft in LOFTS:
            face, up = axes(loft)
            ball = recording.track(f"ball{loft}")
            before, after = contact_velocity(ball.velocities[[0, -1]], ball.spins[[0, -1]], face, RADIUS) - moving
            launch = ball.velocities[-1]
            shots.append(
                {"loft": loft, "launch_angle": degrees(np.arctan2(launch[2], launch[0])),
                 "ball_speed": float(np.linalg.norm(launch)), "backspin": float(-ball.spins[-1, 1]),
                 "impulse_ratio": float(abs(launch @ up) / abs(launch @ face)) if launch.any() else 0.0}
                | rebound_of(pair, chi, before, after, face) | limits_of_rigid_bodies(loft, speed, facts["friction"])
            )  # fmt: skip
        out: Measured = recording.told()
        depth = pair.greatest_overlap(MASS, speed * cos(radians(min(LOFTS)))) / RADIUS
        return out | {"friction": facts["friction"], "chi": chi, "overlap_over_radius": depth, "shots": shots}

    def check(self, measured: Measured) -> list[Limit]:
        """Every loft against the annulus solver; friction's bound; where it slides to the end, the closed form."""
        from validation.reference.closed_forms.regimes import slides_throughout_from

        if measured["law"] != "microslip":
            return []
        shots = measured["shots"]
        sliding = [shot for shot in shots
                   if shot["psi1"] >= slides_throughout_from(measured["chi"], RESTITUTION)]  # fmt: skip
        out = [
            Limit("greatest error of psi_2", 4e-3, max(abs(shot["psi2"] - shot["psi2_reference"]) for shot in shots)),
            Limit("greatest ratio of impulses over friction",
                  1.001, max(shot["impulse_ratio"] for shot in shots) / measured["friction"]),
        ]  # fmt: skip
        for shot in sliding:
            for what in ("backspin", "launch_angle"):
                error = abs(shot[what] / shot[f"{what}_sliding"] - 1.0)
                out.append(Limit(f"error of the {what.replace('_', ' ')}, sliding at loft {shot['loft']}", 1e-3, error))
        return out


def axes(loft: float) -> tuple[np.ndarray, np.ndarray]:
    """Normal of a face, and the direction up along it; loft in degrees."""
    angle = radians(loft)
    return np.array([cos(angle), 0.0, sin(angle)]), np.array([-sin(angle), 0.0, cos(angle)])


def pair_of(friction: float) -> ContactPair:
    """Ball and face; kappa of the cover on a rigid body."""
    return ContactPair(COVER, RIGID, friction, RESTITUTION, radius=RADIUS)


def head_at(touching: np.ndarray, speed: float, time: float) -> np.ndarray:
    """Where a head's centre is [m] at a time [s], from where it touches the ball."""
    return touching + [speed * (time - LEAD), 0.0, 0.0]


def launch_with(loft: float, speed: float, rub: float) -> dict[str, float]:
    """Launch angle [degrees] and backspin [rad/s] where friction changes the ball's velocity by rub [m/s]."""
    face, up = axes(loft)
    velocity = (1.0 + RESTITUTION) * speed * face[0] * face - rub * up
    return {"backspin": rub / (0.4 * RADIUS), "launch_angle": degrees(np.arctan2(velocity[2], velocity[0]))}


def limits_of_rigid_bodies(loft: float, speed: float, friction: float) -> dict[str, float]:
    """What the ball would get if it slid to the end, and if it came to roll on the face."""
    face, up = axes(loft)
    limits = {"sliding": friction * (1.0 + RESTITUTION) * speed * face[0], "rolling": -up[0] * speed / 3.5}
    return {
        f"{what}_{how}": value for how, rub in limits.items() for what, value in launch_with(loft, speed, rub).items()
    }
