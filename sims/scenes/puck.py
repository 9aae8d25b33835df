"""The puck of `sims.puck` as a scene: the same throw, watched on its way to the block and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from contactlaw import checks
from sims.puck import SURFACES, Puck, Result, as_json, reference
from sims.recording import Recording, Track
from sims.scene import NATIVES, Limit, Measured, Scene, Settings, register
from sims.worlds import new_world

BLOCK = (0.03, 0.3, 0.0254)  # half lengths [m]
LEAD, AFTER = 0.15, 0.25  # times in flight before the impact and after [s]
INTERVAL = 2e-3  # between two entries of a recording [s]


@register
class OnBlock(Scene):
    """Seen from above. The air table makes the motion planar and frictionless: neither it nor gravity is simulated."""

    name = "puck"
    title = "a puck strikes a clamped block on an air table (Maw, Barber & Fawcett 1981)"
    exposure, slow = 0.045, 10.0
    beside_damped = True
    options = {
        "psi1": (1.2, "(kappa/mu) V_x/V_z1 before the impact"),
        "spin": (0, "1: thrown straight at the block, with backspin; 0: obliquely, without spin"),
    }

    def run(self, settings: Settings) -> Recording:
        """Throw it."""
        self.demand(settings)
        throw = {
            "material": checks.one_of("material", settings.material or "steel", SURFACES),
            "psi_1": self.option(settings, "psi1"),
            "launch": "spin" if self.option(settings, "spin") else "oblique",
            "timestep": settings.step,
        }
        puck = Puck(law=settings.law or Puck.law, **throw)
        velocity, spin = puck.start_motion
        world = new_world(settings, gravity=(0.0, 0.0, 0.0))
        start = puck.radius * puck.normal - LEAD * velocity
        moments = puck.inertia * np.array([0.6, 0.6, 1.0])
        world.ball("puck", puck.radius, puck.mass, start, velocity, [0.0, 0.0, spin], inertia=moments,
                   disc=0.5 * puck.thickness)  # fmt: skip
        world.block("block", BLOCK, [-BLOCK[0], 0.0, 0.0])
        world.contact("puck", "block", puck.pair, speed=puck.speed)
        recording = world.record(LEAD + AFTER + puck.contact_duration, INTERVAL, throw=throw)
        recording.view = (0, 1)
        return recording

    def marks(self, recording: Recording) -> list[tuple[float, float, str]]:
        """Where it comes in, and where it is at the end."""
        track = recording.track("puck")
        ends = ((0, "in"), (-1, "out"))
        return [
            (float(track.positions[i, 0]), float(track.positions[i, 1]) - puck_radius(track), text) for i, text in ends
        ]

    def caption(self, recording: Recording) -> str:
        """Spin and slip before the impact and after it."""
        track, radius = recording.track("puck"), puck_radius(recording.track("puck"))
        spins = [float(track.spins[i, 2]) for i in (0, -1)]
        slips = [1e3 * (float(track.velocities[i, 1]) - radius * spin) for i, spin in zip((0, -1), spins, strict=True)]
        return (
            f"spin {_signed(spins[0], 1)} \N{RIGHTWARDS ARROW} {_signed(spins[1], 1)} rad/s, contact point "
            f"{_signed(slips[0], 0)} \N{RIGHTWARDS ARROW} {_signed(slips[1], 0)} mm/s"
        )

    def measure(self, recording: Recording) -> Measured:
        """The same figures as `sims.puck.run` gives."""
        facts: dict[str, Any] = recording.facts
        puck = Puck(law=facts["law"], **facts["throw"])
        track = recording.track("puck")
        psi, energy = ([of(track.velocities[i], float(track.spins[i, 2])) for i in (0, -1)]
                       for of in (puck.psi, puck.energy))  # fmt: skip
        e = puck.pair.restitution
        return as_json(
            Result(
                engine=facts["engine"], law=puck.law, material=puck.material, mu=puck.pair.friction, chi=puck.chi,
                restitution=e, timestep=facts["timestep"], contact_duration=puck.contact_duration,
                steps=facts["steps"], psi1=psi[0], psi2=psi[1],
                psi2_reference=reference(round(psi[0], 12), puck.chi, e), energy_ratio=energy[1] / energy[0],
                wall_time=facts["wall_time"],
            )
        )  # fmt: skip

    def check(self, measured: Measured) -> list[Limit]:
        """As `sims.puck.Result.check`."""
        out = [Limit("psi2, anything finite", 1e3, abs(measured["psi2"]))]
        if measured["law"] not in ("mindlin", *NATIVES):
            out.append(Limit("energy after over before", 1.001, measured["energy_ratio"]))
        if measured["law"] == "microslip":
            error = abs(measured["psi2"] - measured["psi2_reference"])
            out.append(Limit("psi2 off the reference", 4e-3, error))
        return out


def puck_radius(track: Track) -> float:
    """[m]."""
    return float(track.size[0])


def _signed(value: float, digits: int) -> str:
    """A number with its sign."""
    return f"{value:+.{digits}f}".replace("-", "\N{MINUS SIGN}")
