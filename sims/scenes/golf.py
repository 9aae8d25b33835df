"""Golf balls struck by club heads of different loft: launch angle and backspin.

A face of loft L and speed V meets the ball with V cos(L) along its normal and V sin(L) across it, so that psi_1 =
(kappa/mu) tan(L). By the law, launch angle and spin over speed depend on psi_1 and chi alone. A rigid ball slides up
the face to the end, or comes to roll on it. An elastic ball may leave with more spin than a rolling one, its contact
point moving down the face; and it slides to the end at some lofts where a rigid ball would roll.

Shots are at 8 m/s (a chip). At the 40 m/s of a full swing the overlap is a quarter of the radius, far beyond a small
contact. The heads follow a prescribed path; a free head of 270 g, six times the ball's mass, would give some 5 % less
spin. Figures: ball by the rules of golf; contact of 0.45 ms at 40 m/s (0.4 to 0.5 ms: D. Tutelman,
What happens at impact) and restitution 0.8 (0.83: Proceedings 49 (2020) 47); nu of the cover 0.45 and friction 0.4 are
assumed. Tangential compliance in golf impacts: The role of friction and tangential compliance on the resultant launch
angle of a golf ball, Proceedings 49 (2020) 27.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import cos, degrees, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import RIGID, ContactPair, Material
from sims.contact_point import contact_velocity, rebound_of
from sims.options import of_ball, speed
from sims.recording import Recording
from sims.scene import NATIVE, NATIVES, Limit, Mark, Measured, Scene, Settings, register
from sims.worlds import new_world

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEAD = (0.028, 0.038, 0.008)  # half lengths of a head [m], the last across the face
LOFTS = (10, 15, 20, 25, 30, 34, 40, 45, 50, 55, 60, 65)  # [degrees]; 34: a 7 iron
COVER = Material(1.28e8, 0.45, name="golf ball")  # E such that the contact lasts 0.45 ms at 40 m/s
LEAD, AFTER = 0.0051, 0.065  # times [s] before the impact and after


@register
class Golf(Scene):
    """A ball and a club head for each loft, side by side; gravity is left out of these few hundredths of a second."""

    name = "golf"
    title = "golf balls struck at lofts of 10 to 65 degrees: launch angle and backspin"
    exposure, slow = 0.0325, 20.0
    native_step = 1e-4
    material = None
    options = {"speed": speed(8.0, "speed of the heads")} | of_ball(0.02135, 0.4, 0.8, mass=0.0459)

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Play all shots at once, each in its lane."""
        pair = pair_of(o)
        world = new_world(settings, gravity=(0.0, 0.0, 0.0))
        for lane, loft in enumerate(LOFTS):
            tee = np.array([0.0, 0.2 * lane, 0.0])
            face, up = axes(loft)
            world.ball(f"ball{loft}", o.radius, o.mass, tee)
            world.paddle(
                f"head{loft}", HEAD, partial(head_at, tee - (o.radius + HEAD[2]) * face, o.speed),
                rotation=np.column_stack([-up, [0.0, 1.0, 0.0], face]),
            )  # fmt: skip
            world.contact(f"ball{loft}", f"head{loft}", pair, speed=o.speed * cos(radians(loft)))
        return world.record(LEAD + AFTER)

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """The loft beside every third ball, once they are apart."""
        out = []
        for loft in LOFTS[::3]:
            ball = recording.track(f"ball{loft}")
            way, radius = ball.positions[entry] - ball.positions[0], ball.size[0]
            if np.linalg.norm(way) > 12.0 * radius:
                across = way * (0.4, 1.0, 1.0)  # about square to the row of balls
                beyond = ball.positions[entry] + 2.8 * radius / np.linalg.norm(across) * across
                out.append((float(beyond[0]), float(beyond[2]) + 0.5 * radius, f"{loft}\N{DEGREE SIGN}"))
        return out

    def caption(self, recording: Recording) -> str:
        """What to see."""
        return "numbers: loft of the head"

    def figure(self, settings: Settings, recording: Recording) -> Figure | None:
        """Launch angle and backspin over loft, with the limits of rigid bodies."""
        from matplotlib.figure import Figure

        from sims.panel import TONES, title_of

        if settings.law in NATIVES:
            return None
        native = self.run(replace(settings, law=NATIVE, timestep=self.native_step))
        figure = Figure(figsize=(8.6, 3.8), layout="constrained")
        units = {"launch_angle": "degrees", "backspin": "rad/s"}
        for axes, (what, unit) in zip(figure.subplots(1, 2), units.items(), strict=True):
            for one, marker, kind in ((recording, "o", "law"), (native, "^", "native")):
                values, colour = [shot[what] for shot in self.measure(one)["shots"]], TONES[kind]["dark"]
                axes.plot(LOFTS, values, marker, color=colour, markerfacecolor="none", label=title_of(self, one))
            for how, dash in (("sliding", "--"), ("rolling", "-")):
                values = [limits_of_rigid_bodies(loft, recording.o)[f"{what}_{how}"] for loft in LOFTS]
                axes.plot(LOFTS, values, dash, color="0.4", linewidth=1.0, label=f"rigid ball, {how} at the end")
            top = 1.05 * max(shot[what] for one in (recording, native) for shot in self.measure(one)["shots"])
            axes.set(xlabel="loft [degrees]", ylabel=f"{what.replace('_', ' ')} [{unit}]", ylim=(0.0, top))
            axes.grid(alpha=0.3)
        figure.axes[0].legend(fontsize=8)
        return figure

    def measure(self, recording: Recording) -> Measured:
        """A row for each loft."""
        o, pair = recording.o, pair_of(recording.o)
        chi = pair.chi(1.0, 1.0 / 3.5)
        moving = np.array([o.speed, 0.0, 0.0])
        shots = []
        for loft in LOFTS:
            face, up = axes(loft)
            ball = recording.track(f"ball{loft}")
            before, after = contact_velocity(ball.velocities[[0, -1]], ball.spins[[0, -1]], face, o.radius) - moving
            launch = ball.velocities[-1]
            shots.append(
                {"loft": loft, "launch_angle": degrees(np.arctan2(launch[2], launch[0])),
                 "ball_speed": float(np.linalg.norm(launch)), "backspin": float(-ball.spins[-1, 1]),
                 "impulse_ratio": float(abs(launch @ up) / abs(launch @ face)) if launch.any() else 0.0}
                | rebound_of(pair, chi, before, after, face) | limits_of_rigid_bodies(loft, o)
            )  # fmt: skip
        out: Measured = recording.told()
        depth = pair.greatest_overlap(o.mass, o.speed * cos(radians(min(LOFTS)))) / o.radius
        contact = {"friction": o.friction, "restitution": o.restitution, "chi": chi, "overlap_over_radius": depth}
        return out | contact | {"shots": shots}

    def check(self, measured: Measured) -> list[Limit]:
        """Every loft against the annulus solver; Coulomb's limit; the closed form where the ball slides to the end."""
        from validation.reference.closed_forms.regimes import slides_throughout_from

        if measured["law"] != "microslip":
            return []
        shots = measured["shots"]
        least = slides_throughout_from(measured["chi"], measured["restitution"])
        sliding = [shot for shot in shots if shot["psi1"] >= least]
        out = [
            Limit("greatest error of psi_2", 4e-3, max(abs(shot["psi2"] - shot["psi2_reference"]) for shot in shots)),
            Limit("greatest ratio of impulses, over friction",
                  1.001, max(shot["impulse_ratio"] for shot in shots) / measured["friction"]),
        ]  # fmt: skip
        for shot in sliding:
            for what in ("backspin", "launch_angle"):
                error = abs(shot[what] / shot[f"{what}_sliding"] - 1.0)
                out.append(Limit(f"error of the {what.replace('_', ' ')}, sliding at loft {shot['loft']}", 1e-3, error))
        return out


def axes(loft: float) -> tuple[np.ndarray, np.ndarray]:
    """Normal of a face, and the direction up the face; loft in degrees."""
    angle = radians(loft)
    return np.array([cos(angle), 0.0, sin(angle)]), np.array([-sin(angle), 0.0, cos(angle)])


def pair_of(o: Any) -> ContactPair:
    """Ball and face; kappa of the cover on a rigid body."""
    return ContactPair(COVER, RIGID, o.friction, o.restitution, radius=o.radius)


def head_at(touching: np.ndarray, speed: float, time: float) -> np.ndarray:
    """Centre of a head [m] at a time [s] after it touches the ball."""
    return touching + [speed * (time - LEAD), 0.0, 0.0]


def limits_of_rigid_bodies(loft: float, o: Any) -> dict[str, float]:
    """Launch angle [degrees] and backspin [rad/s] if the ball slid to the end, and if it came to roll on the face."""
    face, up = axes(loft)
    pushed = (1.0 + o.restitution) * o.speed * face[0]
    out = {}
    for how, rub in (("sliding", o.friction * pushed), ("rolling", -up[0] * o.speed / 3.5)):
        velocity = pushed * face - rub * up
        out[f"backspin_{how}"] = rub / (0.4 * o.radius)
        out[f"launch_angle_{how}"] = degrees(np.arctan2(velocity[2], velocity[0]))
    return out
