"""Fig. 6 of Maw, Barber & Fawcett (1981): the stroboscopic picture of an impact, with a marker on the rim."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from math import atan2, degrees, floor, pi
from typing import Any

import numpy as np

from contactlaw import rebound
from sims.puck import Puck, build, reference
from sims.scene import Settings
from validation.case import Axes, Case, Data, Limit, Outcome, Table
from validation.stroboscope import Motion, fit_motion, read_impact

SPEED = 1.0  # approach along the normal [m/s]
FLASHES = 100.0  # a second
FIELD = 0.16  # of the picture, away from the block [m]
STEP = 1e-3  # of the engine [s]; a contact lasts a fourteenth of it
RIM_EACH = 5  # flashes between two rims that are drawn
ENOUGH = 1e-6  # drafting error [m] that the fit of exact points is told; it does not change the fit
SEEN = 8.0  # reflexion angle that the paper read off [degrees]


class PaperFigure6(Case):
    """A steel puck is thrown in MuJoCo at the incidence of the largest reversal. Its contact point, made visible by a
    marker on the rim, leaves towards the side it came from, at an angle from the normal somewhat larger than the 8
    degrees or so that the paper read off its photograph (it does not give the incidence). The marker's path approaches
    that angle as the puck turns. Velocities read from flashes a hundredth of a second apart, as in the paper, give the
    same psi_2 as the reference.
    """

    place = 7
    title = "Paper, figure 6: stroboscopic picture of an impact"
    sheet = {"width": 6.0, "height": 6.4}
    caption = (
        "A 4 in steel puck under 100 flashes a second, from above, simulated in MuJoCo: before the impact (dotted "
        "rims, every fifth flash) and after it (solid rims). Crosses: the centre, which goes on to the right. "
        "Diamonds: the marker on the rim at the contact point, which turns back to the left."
    )

    def run(self, quick: bool) -> Outcome:
        steel, psi = Puck(material="steel"), np.arange(0.0, 6.0, 0.01)
        psi_1 = float(psi[np.argmin(rebound(psi, steel.chi, restitution=steel.pair.restitution))].round(2))
        puck = Puck(material="steel", psi_1=psi_1, speed=SPEED, heading=-0.5 * pi, timestep=STEP, phase=FIELD / STEP)
        times, centres, angles, final = _flashed(puck)
        touch = FIELD / SPEED
        marker = centres + puck.radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        before = times < touch - STEP
        after = times > touch + 2.0 * STEP
        flights = (fit_motion(times[part], centres[part], marker[None, part], [puck.radius], ENOUGH)
                   for part in (before, after))  # fmt: skip
        normal, e = puck.normal[:2], puck.pair.restitution
        factor = 1.0 + puck.mass * puck.radius**2 / puck.inertia
        reading = read_impact(*flights, normal=normal, radius=puck.radius, inertia_factor=factor)
        found = puck.psi(np.append(final.velocity, 0.0), final.spin)
        expected = reference(round(psi_1, 12), puck.chi, e)
        read = float(reading.psi(puck.pair.kappa, puck.pair.friction)[0][1])
        slope = puck.pair.friction / puck.pair.kappa
        tangents = np.array([found, expected]) * slope / e
        data = {
            "psi_1": psi_1, "radius": puck.radius, "times": times, "touch": touch, "centres": centres, "marker": marker,
            "psi_2": found, "psi_2_reference": expected, "psi_2_read": read,
            "incidence_angle": degrees(atan2(psi_1 * slope, 1.0)),
            "reflexion_angle": degrees(atan2(tangents[0], 1.0)),
            "reflexion_angle_reference": degrees(atan2(tangents[1], 1.0)),
        }  # fmt: skip
        limits = [
            Limit("psi_2 at the end of the simulation, off the reference by", 4e-3, abs(found - expected)),
            Limit("psi_2 read from the flashes, off the reference by", 4e-3, abs(read - expected)),
            Limit("restitution read from the flashes, off e by", 1e-3, abs(reading.restitution - e)),
        ]
        problems = [] if np.isfinite(centres).all() else ["the puck's path is not finite"]
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        table = Table("figure | value")
        for row in (
            "psi_1 of the largest reversal | {psi_1:.2f}",
            "psi_2: simulation, flashes, reference | {psi_2:.5f}, {psi_2_read:.5f}, {psi_2_reference:.5f}",
            "angle of incidence of the contact point [deg] | {incidence_angle:.1f}",
            "angle of reflection of the contact point [deg] | {reflexion_angle:.2f}",
            "the same by the reference, atan(psi_2 mu/(kappa e)) [deg] | {reflexion_angle_reference:.2f}",
            f"seen by the paper [deg] | about {-SEEN:.0f}",
        ):
            table.add(row, data)
        return table

    def draw(self, data: Data, axes: Axes) -> None:
        from matplotlib.patches import Circle

        centres, marker, times = (1e3 * np.array(data[key]) if key != "times" else np.array(data[key])
                                  for key in ("centres", "marker", "times"))  # fmt: skip
        radius = 1e3 * data["radius"]
        low, high = float(centres[:, 0].min() - radius), float(centres[:, 0].max() + radius)
        axes.fill_between((low, high), 0.0, 14.0, facecolor="#d0d0d0", edgecolor="black", hatch="///", linewidth=0.8)
        axes.annotate("block", (0.5 * (low + high), 7.0), ha="center", va="center",
                      bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5})  # fmt: skip
        for late, dashes in ((False, (0, (1, 2))), (True, "-")):
            rim: Any = {"fill": False, "linestyle": dashes, "color": "#8a8a8a", "linewidth": 0.9}
            chosen = (times > data["touch"]) == late
            for centre in (centres[chosen] if late else centres[chosen][::-1])[::RIM_EACH]:
                axes.add_patch(Circle(tuple(centre), radius, **rim))
            axes.plot(*marker[chosen].T, "D", markersize=5, markerfacecolor="#c44e00" if late else "white",
                      markeredgecolor="black", label="marker after" if late else "marker before")  # fmt: skip
            axes.plot(*centres[chosen].T, "+" if late else "x", color="black", markersize=6,
                      label="centre after" if late else "centre before")  # fmt: skip
        axes.set(xlabel="along the block [mm]", ylabel="normal to the block [mm]", aspect="equal",
                 title="stroboscopic picture")  # fmt: skip
        axes.grid(visible=False)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2)


def _flashed(puck: Puck) -> tuple[np.ndarray, np.ndarray, np.ndarray, Motion]:
    """The puck, thrown in MuJoCo under the stroboscope: times of the flashes [s], shape (n,), centres [m], shape
    (n, 2), angle of the marker [rad], shape (n,), and the motion at the end."""
    between = round(1.0 / (FLASHES * puck.step))
    # The first flash comes so that the touch falls in the middle between two.
    steps = FIELD / (puck.speed * puck.step)
    first = round((steps - 0.5 * between) % between)
    flights = floor(steps / between) + floor(steps * puck.pair.restitution / between)
    recording = build(puck, Settings("mujoco")).record((first + between * (flights - 1)) * puck.step)
    track, seen = recording.track("puck"), slice(first, None, between)
    # The marker is at the contact point while the puck does not spin.
    angles = np.unwrap(np.arctan2(*track.rotations[seen, :2, 0].T[::-1])) + puck.heading + pi
    final = Motion(track.velocities[-1, :2], float(track.spins[-1, 2]), np.zeros((3, 3)), 0.0)
    return recording.times[seen], track.positions[seen, :2], angles, final
