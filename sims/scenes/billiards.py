"""A billiard ball rolls into a cushion, with running, no or reverse side spin.

The ball touches table and cushion at once. The cushion here is a vertical elastic wall: the contact point moves along
it by the ball's travel and side spin, and down it by its roll. Friction opposes both together, so that the impact is
that of the annulus solver along one oblique direction, and it lifts the ball off the table. The wall is hard, so that
gravity during the impact can be neglected. On the table the ball rolls; slip within that contact does not matter, so
a single spring suffices. (Real cushions meet the ball above its centre, at 7/5 of its radius, and press it onto the
table. That impact involves two contacts and has no closed form.)

Figures: snooker ball, cushion restitution 0.98 and friction 0.14, table friction 0.212: S. Mathavan, M. R. Jackson & R.
M. Parkin, Proc. IMechE C 224 (2010) 1863. Elastic constants of ball, table and, unless told otherwise, wall: phenolic
resin, E 5.84 GPa, nu 0.34 (assumed; handbooks differ).
"""

from dataclasses import replace
from math import cos, radians, sin, sqrt
from typing import Any

import numpy as np

from contactlaw import ContactPair, Material
from sims.contact_point import contact_velocity, rebound_of, static_overlap
from sims.options import Option, of_ball, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register
from sims.worlds import new_world

GRAVITY = 9.81  # [m/s^2]
BALL = of_ball(0.02625, 0.14, 0.98, mass=0.1406)
PHENOLIC = Material(5.84e9, 0.34, name="phenolic resin")
TABLE = ContactPair(PHENOLIC, PHENOLIC, friction=0.212, restitution=0.5, law="mindlin")
NORMAL = np.array([-1.0, 0.0, 0.0])  # of the cushion
LANES = ("running", "plain", "reverse")
# What spin about the normal adds to psi_2, over sigma^2, sigma = (kappa/mu) omega a_max/V_z1, at the default speed and
# angle: by a grid with Coulomb's law in each cell and Cerruti's kernel (32 cells, 256 steps, chi 1.39, nu 0.34)
OF_SPIN = {"running": 0.083, "plain": 0.040, "reverse": 0.0143}
WAY, AFTER = 0.1, 0.25  # to the cushion [m], time after the impact [s]
LEAD = 1.0  # longest that a ball rolls before it [s]


@register
class Billiards(Scene):
    """Three balls side by side, seen from above."""

    name = "billiards"
    title = "billiard balls roll into a cushion, with running, no and reverse side spin"
    engines = EVERYWHERE
    exposure, slow = 0.04, 5.0
    material = ""
    options = {
        "speed": speed(2.0, "speed of the balls"),
        "angle": Option(30.0, "angle between the path and the cushion's normal, in degrees", 0.0, 80.0),
        "side": Option(0.5, "radius times side spin, over the speed", 0.0, 100.0),
    } | BALL

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Start all three rolling, with their static overlap."""
        pair, angle, way = cushion(o), radians(o.angle), min(WAY, LEAD * o.speed)
        velocity = o.speed * np.array([cos(angle), sin(angle), 0.0])
        roll = np.array([-velocity[1], velocity[0], 0.0]) / o.radius
        sunk = static_overlap(TABLE, o.mass * GRAVITY, o.radius)

        world = new_world(settings, gravity=(0.0, 0.0, -GRAVITY))
        world.plane("table")
        world.block("cushion", (0.03, 1.0, 0.1), [0.03, 0.3, 0.0])
        for lane, name in enumerate(LANES):
            start = [-o.radius - way * cos(angle), 0.25 * lane - way * sin(angle), o.radius - sunk]
            turn = (lane - 1) * o.side * o.speed / o.radius  # running side: the rim at the cushion rolls along it
            world.ball(name, o.radius, o.mass, start, velocity, roll + [0.0, 0.0, turn])
        world.contact(list(LANES), "table", replace(TABLE, radius=o.radius))
        world.contact(list(LANES), "cushion", pair, speed=o.speed * cos(angle))
        recording = world.record(way / o.speed + AFTER)
        recording.view, recording.scenery = (0, 1), [one for one in recording.scenery if one.name == "cushion"]
        return recording

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """The side spin of each ball."""
        starts = {name: recording.track(name).positions[0] for name in LANES}
        return [(place[0], place[1] - recording.o.radius, f"{name} side") for name, place in starts.items()]

    def caption(self, recording: Recording) -> str:
        """What to see: side spin changes the direction of the rebound."""
        balls = self.measure(recording)["balls"]
        angles = ", ".join(f"{name} {ball['angle_after_degrees']:.0f}\N{DEGREE SIGN}" for name, ball in balls.items())
        return f"in {recording.o.angle:.0f}\N{DEGREE SIGN}, out {angles}"

    def measure(self, recording: Recording) -> Measured:
        """Motion of each ball just before the cushion and just after it."""
        o, pair, pull = recording.o, cushion(recording.o), np.array(recording.facts["gravity"])
        approach = o.speed * cos(radians(o.angle))
        begin, duration = min(WAY / o.speed, LEAD), pair.contact_duration(o.mass, approach)
        before, end = (int(np.searchsorted(recording.times, time)) for time in (begin, begin + 1.5 * duration))
        out: Measured = recording.told()
        out |= {"chi": pair.chi(1.0, 1.0 / 3.5), "balls": {}}
        for name in LANES:
            track = recording.track(name)
            points = contact_velocity(track.velocities, track.spins, NORMAL, o.radius)
            rolling = contact_velocity(track.velocities, track.spins, [0.0, 0.0, 1.0], o.radius)
            free = np.flatnonzero((track.positions[end:, 0] < -o.radius) & (track.velocities[end:, 0] < 0.0))
            came, left = before - 1, end + int(free[0]) if free.size else -1
            # Gravity acts from the first instant on, as friction lifts the ball: it is taken off again.
            points[left] -= pull * (recording.times[left] - begin)
            out["balls"][name] = {
                "slip_on_the_table": float(np.abs(rolling[:before]).max()) / o.speed,
                "angle_after_degrees": float(
                    np.degrees(np.arctan2(track.velocities[left, 1], -track.velocities[left, 0]))
                ),
                "speed_after": float(np.hypot(*track.velocities[left, :2])),
                "lift": float(track.velocities[left, 2]),
                "side_after": float(track.spins[left, 2]),
            } | rebound_of(pair, out["chi"], points[came], points[left], NORMAL)
            # What the contact holds by its springs, psi of 1 (up to which all sticks), turns with half the ball's spin
            # about the normal, in the mean by half of that; the annuli know of no such spin.
            spin = abs(float(track.spins[came] @ NORMAL))
            out["balls"][name]["turned"] = 0.25 * duration * spin
            radius = sqrt(o.radius * pair.greatest_overlap(o.mass, approach))
            sigma = pair.kappa / o.friction * spin * radius / approach
            out["balls"][name]["psi2_by_spin"] = OF_SPIN[name] * sigma**2
        return out

    def check(self, measured: Measured) -> list[Limit]:
        """Rebound against the annulus solver, and the grid for spin about the normal; rolling before the impact."""
        if "microslip" not in measured["law"]:
            return []
        out = []
        for name, ball in measured["balls"].items():
            out += [
                Limit(
                    f"error of psi_2, {name} side",
                    4e-3,
                    abs(ball["psi2"] - ball["psi2_reference"] - ball["psi2_by_spin"]),
                ),
                Limit(
                    f"psi across the direction of slip after the impact, {name} side",
                    4e-3 + ball["turned"],
                    ball["aside"],
                ),
                Limit(
                    f"slip on the table before the impact, over the speed, {name} side", 1e-3, ball["slip_on_the_table"]
                ),
            ]
        return out


def cushion(o: Any) -> ContactPair:
    """Ball and cushion."""
    return ContactPair(PHENOLIC, o.material or PHENOLIC, o.friction, o.restitution, radius=o.radius)
