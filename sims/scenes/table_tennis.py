"""Table tennis: balls of five strokes meet the table.

The ball is a shell, I = 2/3 m R^2. Where it slides to the end (drive, chop, loop) friction gives mu times the normal
impulse, and the rebound is that of the model used in table tennis robots. Where the table grips the ball (topspin, and
a ball that drops with backspin) that model lets it roll away, whereas elastic contact reverses the contact point. With
backspin R omega = v m R^2/I the ball has no angular momentum about the contact point. Then the impact multiplies v and
omega by the same factor, whatever the law; it is negative where the contact point reverses (Garwin's superball, with
3/2 for a shell).

Figures: 40 mm and 2.7 g by the rules; mu = 0.25, e = 0.93 on a table: A. Nakashima, Y. Ogawa, Y. Kobayashi & Y.
Hayakawa, Proc. American Control Conference (2010) 1410. A shell is softer than a solid ball: E* is chosen such that
the contact lasts 0.8 ms, as long as that of a shell of 0.4 mm and 2.2 GPa under a point force, k = 4 E h^2/(R sqrt(3 (1
- nu^2))), E. Reissner, J. Math. Phys. 25 (1946) 279. kappa of a shell is not known; that of solid bodies of nu = 0.38
is taken. Air drag is neglected. Reversal: R. L. Garwin, Am. J. Phys. 37 (1969) 88.
"""

from dataclasses import replace
from math import pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np

from contactlaw import RIGID, ContactPair, Material
from sims.bounces import bounces_of
from sims.loaded_rebound import loaded_rebound, scaled_load
from sims.options import of_ball, speed
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register, signed
from sims.worlds import new_world

GRAVITY = 9.81  # [m/s^2]
BALL = of_ball(0.02, 0.25, 0.93, mass=2.7e-3)
GYRATION = 2.0 / 3.0  # K^2 = I/(m R^2)
SHELL, WALL, NU = 2.2e9, 4e-4, 0.38  # E [Pa], thickness [m]
DOWN = 3.0  # speed at which the shell's contact time is met [m/s]
STROKES = {"drive": (5.0, 0.0), "chop": (4.0, -4.0), "loop": (5.0, 8.0), "topspin": (5.0, 4.5), "drop": (0.6, -0.9)}
"""Speed along the table and R omega, above zero topspin [m/s]."""
NO_MOMENTUM = "drop"
FALL, AFTER = 0.02, 0.1  # times [s] before and after the touch


@register
class TableTennis(Scene):
    """The five strokes side by side."""

    name = "table_tennis"
    title = "table tennis balls meet the table with topspin, backspin and no spin"
    engines = EVERYWHERE
    exposure, slow = 0.015, 20.0
    material = None
    options = {"down": speed(DOWN, "speed onto the table")} | BALL

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Let each ball bounce once."""
        world = new_world(settings, gravity=(0.0, 0.0, -GRAVITY))
        world.plane("table")
        for lane, (name, (along, turning)) in enumerate(STROKES.items()):
            start = [-FALL * along, 5.0 * o.radius * lane, o.radius + FALL * (o.down - 0.5 * GRAVITY * FALL)]
            velocity, inertia = [along, 0.0, -o.down + GRAVITY * FALL], GYRATION * o.mass * o.radius**2
            world.ball(name, o.radius, o.mass, start, velocity, [0.0, turning / o.radius, 0.0], inertia=inertia)
        world.contact(list(STROKES), "table", pair_of(o), speed=o.down)
        return world.record(FALL + AFTER)

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Name of each stroke at its ball's last position, with spin before and after."""
        out = []
        for name in STROKES:
            track = recording.track(name)
            (x, _, z), spins = track.positions[-1], (float(track.spins[i, 1]) for i in (0, -1))
            told = " \N{RIGHTWARDS ARROW} ".join(signed(spin, 0) for spin in spins)
            out.append((float(x), float(z) + 3.5 * track.size[0], f"{name}\n{told}"))
        return out

    def caption(self, recording: Recording) -> str:
        """What the numbers are, and what to see."""
        return "spin before and after, rad/s; topspin is positive"

    def measure(self, recording: Recording) -> Measured:
        """Each bounce, that of the annulus solver, and that of a ball that slides to the end."""
        o, pair = recording.o, pair_of(recording.o)
        chi = pair.chi(1.0, 1.0 / (1.0 + 1.0 / GYRATION))
        out: Measured = recording.told()
        out |= {"chi": chi, "restitution": o.restitution, "contact_duration": pair.contact_duration(o.mass, DOWN),
                "strokes": {}}  # fmt: skip
        for name in STROKES:
            bounce = next(iter(bounces_of(recording, name)), None)
            if bounce is None:
                continue
            before, after = bounce.sliding(o.radius)
            psi1 = pair.psi(before, bounce.approach)
            load = scaled_load(pair, o.mass, bounce.approach, GRAVITY)
            expected = loaded_rebound(abs(psi1), chi, o.restitution, load)
            slid = o.friction * (1.0 + o.restitution) * bounce.approach * np.sign(before)
            (came, left), (spun, spins) = (
                [float(one[axis]) for one in pair_] for axis, pair_ in (
                    (0, (bounce.velocity_before, bounce.velocity_after)), (1, (bounce.spin_before, bounce.spin_after)))
            )  # fmt: skip
            out["strokes"][name] = {
                "psi1": psi1, "psi2": pair.psi(after, bounce.approach),
                "psi2_reference": float(np.sign(psi1)) * expected.psi_2,
                "restitution": bounce.departure / bounce.approach, "restitution_reference": expected.restitution,
                "velocity_before": came, "velocity_after": left, "velocity_sliding": came - slid,
                "spin_before": spun, "spin_after": spins, "spin_sliding": spun + slid / (GYRATION * o.radius),
                "moment_lost": abs(left - came + GYRATION * o.radius * (spins - spun)) / abs(left - came),
            }  # fmt: skip
        return out

    def check(self, measured: Measured) -> list[Limit]:
        """Each bounce against the annulus solver, sliding ones against the closed form, and Garwin's ratio."""
        from validation.reference.closed_forms.regimes import slides_throughout_from

        strokes = measured["strokes"]
        out = [Limit("strokes that bounced", len(STROKES), len(strokes), at_least=True)]
        if measured["law"] != "microslip":
            return out
        for name, one in strokes.items():
            out += [
                Limit(f"error of psi_2, {name}", 4e-3, abs(one["psi2"] - one["psi2_reference"])),
                Limit(
                    f"error of the restitution, {name}", 1e-3, abs(one["restitution"] - one["restitution_reference"])
                ),
                Limit(f"angular momentum about the contact point lost, {name}", 1e-6, one["moment_lost"]),
            ]
            if abs(one["psi1"]) > slides_throughout_from(measured["chi"], measured["restitution"]):
                # The closed form has no weight in the contact: g T/v is 0.3 % of the normal impulse.
                error = abs((one["velocity_after"] - one["velocity_before"])
                            / (one["velocity_sliding"] - one["velocity_before"]) - 1.0)  # fmt: skip
                out.append(Limit(f"error of the change of velocity of a ball that slides, {name}", 5e-3, error))
        drop = strokes.get(NO_MOMENTUM)
        if drop:
            factors = [drop[f"{what}_after"] / drop[f"{what}_before"] for what in ("velocity", "spin")]
            out.append(Limit("difference of the factors of v and omega, drop", 1e-6, abs(factors[0] - factors[1])))
            out.append(Limit("factor of v and omega (negative: both reverse), drop", -0.1, max(factors)))
        return out


DEFAULT = SimpleNamespace(**{name: one.default for name, one in BALL.items()})


def pair_of(o: Any = DEFAULT) -> ContactPair:
    """Ball and table, as soft as the shell."""
    stiffness = 4.0 * SHELL * WALL**2 / (o.radius * sqrt(3.0 * (1.0 - NU**2)))
    duration = pi * sqrt(o.mass / stiffness)
    kappa = 2.0 * (1.0 - NU) / (2.0 - NU)
    one = ContactPair(Material(1e6, 0.5), RIGID, o.friction, o.restitution, radius=o.radius, stiffness_ratio=kappa)
    modulus = 1e6 * (one.contact_duration(o.mass, DOWN) / duration) ** 2.5  # Hertz: the duration goes with E^(-2/5)
    return replace(one, a=Material(modulus, 0.5, name="table tennis ball"))
