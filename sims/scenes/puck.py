"""A puck strikes a clamped block on an air table, as in the experiments of Maw, Barber & Fawcett (1981)."""

from typing import Any

from sims.options import Option
from sims.puck import OPTIONS, Puck, Result, as_json, build, changes, result_of
from sims.recording import Recording
from sims.scene import EVERYWHERE, Limit, Mark, Measured, Scene, Settings, register, signed

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
    engines = EVERYWHERE
    options = {
        "psi1": Option(1.2, "angle of incidence, (kappa/mu) V_x/V_z1", -1e3, 1e3),
        "spin": Option(0, "1: thrown straight at the block, with backspin; 0: obliquely, without spin", 0, 1),
    } | OPTIONS

    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Throw it."""
        throw = {"material": o.material, "psi_1": o.psi1, "launch": "spin" if o.spin else "oblique",
                 "timestep": settings.step} | changes(o)  # fmt: skip
        puck = Puck(law=settings.law or Puck.law, **throw)
        start = puck.radius * puck.normal - LEAD * puck.start_motion[0]
        world = build(puck, settings, start, BLOCK)
        recording = world.record(LEAD + AFTER + puck.contact_duration, INTERVAL, throw=throw)
        recording.view = (0, 1)
        return recording

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Labels of the puck at both ends of its path, and of the block."""
        track = recording.track("puck")
        ends = [(*track.positions[i, :2], text) for i, text in ((0, "in"), (-1, "out"))]
        return [(x, y - track.size[0], text) for x, y, text in ends] + [(-BLOCK[0], -0.02, "block")]

    def caption(self, recording: Recording) -> str:
        """Spin, and velocity of the contact point, before and after the impact."""
        track, radius = recording.track("puck"), recording.track("puck").size[0]
        spins = [float(track.spins[i, 2]) for i in (0, -1)]
        slips = [1e3 * (float(track.velocities[i, 1]) - radius * spin) for i, spin in zip((0, -1), spins, strict=True)]
        return (
            f"spin {signed(spins[0], 1)} \N{RIGHTWARDS ARROW} {signed(spins[1], 1)} rad/s, contact point "
            f"{signed(slips[0], 0)} \N{RIGHTWARDS ARROW} {signed(slips[1], 0)} mm/s along the block"
        )

    def measure(self, recording: Recording) -> Measured:
        """The same figures as `sims.puck.run` gives."""
        facts, track = recording.facts, recording.track("puck")
        puck = Puck(law=facts["law"], **facts["throw"])
        after = track.velocities[-1], float(track.spins[-1, 2])
        return as_json(result_of(puck, facts["engine"], facts["steps"], after, facts["wall_time"]))

    def check(self, measured: Measured) -> list[Limit]:
        """As `sims.puck.Result.limits`."""
        return Result(**measured).limits()
