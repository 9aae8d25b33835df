"""Single impacts in a world without an engine, against the theory; order of convergence in the substeps."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import Body, ContactPair, Material, collide
from contactlaw.laws.microslip import Microslip
from contactlaw.world import World
from tests.world.world_scenes import FLOOR, FRICTION, RADIUS, balls, mass_of, rack, steel_pair

MASS = mass_of(RADIUS)
PSI = np.array([0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0, 7.0])


def bounce(psi: float, restitution: float, steps: float, phase: float, nodes: int = 16, **world: float):
    """A ball that has hit a floor at 1 m/s, in steps of so many contact times, and the pair."""
    pair = steel_pair(restitution=restitution, radius=RADIUS, law=Microslip(nodes))
    dt = steps * pair.contact_duration(MASS, 1.0)
    velocity = [psi * FRICTION / pair.kappa, 0.0, -1.0]
    made = balls(pair, [[0.0, 0.0, RADIUS + (1.5 + phase) * dt]], velocity, planes=[FLOOR], timestep=dt, **world)
    made.step(int(6 + 8 / steps))
    return made, pair


def impact(psi: float, restitution: float, steps: float, phase: float, nodes: int = 16, **world: float):
    """psi_2 and restitution of it."""
    made, pair = bounce(psi, restitution, steps, phase, nodes, **world)
    v, w = made.velocity[0], made.spin[0]
    return pair.kappa / FRICTION * (v[0] - RADIUS * w[1]), v[2]


def errors(restitution: float, steps: float, phase: float, **more) -> tuple[float, float]:
    """Largest of psi_2 and of restitution."""
    found = np.array([impact(psi, restitution, steps, phase, **more) for psi in PSI])
    return truth(restitution, found[:, 0]), float(np.abs(found[:, 1] - restitution).max())


def truth(restitution: float, psi_2: np.ndarray) -> float:
    """How far it is from rings with Coulomb friction each."""
    pair = steel_pair()
    chi = pair.chi(1.0, 1.0 / 3.5)
    return float(np.abs(psi_2 - CACHE.setdefault(restitution, reference(chi, restitution))).max())


def reference(chi: float, restitution: float) -> np.ndarray:
    """psi_2 of all."""
    from validation.impacts import judge

    return np.asarray(judge([(psi, round(chi, 12), restitution) for psi in PSI], annuli=20).psi_2)


CACHE: dict[float, np.ndarray] = {}


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5])
@pytest.mark.parametrize(
    ("steps", "phase"), [(24.0, 0.1), (24.0, 0.8), (2.5, 0.3), (1.1, 0.6), (0.3, 0.2), (0.02, 0.5)]
)
def test_psi_2_at_any_step_and_phase(restitution: float, steps: float, phase: float) -> None:
    across, along = errors(restitution, steps, phase)
    assert across < 5e-4
    assert along < (4e-6 if restitution == 1.0 else 5e-5)


@pytest.mark.parametrize("restitution", [0.9, 0.5, 0.2])
@pytest.mark.parametrize(("steps", "phase"), [(24.0, 0.1), (2.5, 0.3), (1.1, 0.6), (0.3, 0.2), (0.02, 0.9)])
def test_a_damped_bounce_that_does_not_slide_needs_fewer_substeps(
    restitution: float, steps: float, phase: float
) -> None:
    """Down to 0.4 of them: what is left is of nearly third order."""
    found = impact(0.0, restitution, steps, phase)[1]
    assert abs(found - restitution) < 1e-4
    if steps > 1.0:
        assert kicks(0.0, restitution, steps, phase) < 0.5 * kicks(2.0, restitution, steps, phase)


def kicks(psi: float, restitution: float, steps: float, phase: float) -> float:
    """Evaluations of the law in the impact of a ball."""
    return bounce(psi, restitution, steps, phase)[0].arrays.world["kicks"][0]


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_psi_2_of_fine_nodes(restitution: float) -> None:
    assert errors(restitution, 24.0, 0.4, nodes=64, substeps=200.0)[0] < 1e-4


def test_a_whole_impact_converges_with_the_substeps() -> None:
    """Restitution of a damped impact: its loss and the ends are exact to third order nearly."""
    for count in (50.0, 100.0, 200.0, 400.0):
        assert impact(0.5, 0.7, 24.0, 0.4, substeps=count)[1] == pytest.approx(0.7, abs=5e-5 * (50.0 / count) ** 2.5)


@pytest.mark.parametrize("law", ["coulomb", "linear_spring", "mindlin", "mindlin_rescaled", "microslip"])
def test_every_law_runs_without_compiling_the_world_anew(law: str) -> None:
    from contactlaw.world.step import step

    pair = steel_pair(restitution=0.9, law=law)
    made = balls(pair, [[0.0, 0.0, RADIUS + 1e-3]], [0.1, 0.0, -1.0], planes=[FLOOR], timestep=1e-3)
    made.step(5)
    assert made.velocity[0, 2] == pytest.approx(0.9, abs=2e-4)
    assert made.velocity[0, 0] < 0.1
    assert len(step.signatures) == 1


@pytest.mark.parametrize("phase", [0.04, 0.5, 0.96, 0.999])
@pytest.mark.parametrize("steps", [16, 78, 157])
def test_a_damped_bounce_is_the_same_wherever_in_a_short_step_it_begins(steps: int, phase: float) -> None:
    """The damper sets in with the fourth root of time: what it does in a substep that is cut short must count."""
    _, speed = impact(0.5, 0.5, 1.0 / steps, phase)
    assert speed == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize("early", [0.0, 1e-9, 1e-6, 0.5])
def test_a_ball_on_the_floor_meets_a_wall_at_the_very_end_of_a_substep(early: float) -> None:
    """The substeps are those of the floor's contact: one ends where rounding has the wall begin. early: [steps]."""
    radius, speed, timestep = 0.026, 1.7, 1e-3
    resin = Material(5.84e9, 0.34)
    world = World(timestep=timestep)
    start = -radius - speed * timestep * (10.0 - early)
    ball = world.add_body(0.14, 0.4 * 0.14 * radius**2, (start, 0.0, radius), (speed, 0.0, 0.0))
    shape = world.add_sphere(ball, radius)
    world.add_contact(shape, world.add_plane(None, *FLOOR), ContactPair(resin, resin, 0.0, 0.5))
    wall = world.add_plane(None, (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
    world.add_contact(shape, wall, ContactPair(resin, resin, 0.0, 0.98))
    world.step(14)
    assert -world.velocity[ball, 0] / speed == pytest.approx(0.98, abs=3e-5)


def test_a_damped_crowd_is_as_right_as_the_docstring_says():
    """Fifteen balls that a cue ball breaks at 8 m/s, against 400 substeps; no contact coasts in an impact,
    so that more substeps come closer."""

    def broken(substeps: float) -> np.ndarray:
        made = rack(steel_pair(restitution=0.93), 2e-3, 8.0)
        made.arrays.world["crowd_substeps"] = substeps
        made.step(2)
        return made.velocity

    exact = broken(400.0)
    errors = [np.abs(broken(substeps) - exact).max() / 8.0 for substeps in (10.0, 20.0, 100.0)]
    assert (np.array(errors) < [1e-3, 2e-4, 5e-5]).all()
    assert World(gravity=0.0).arrays.world["crowd_substeps"][0] == 10.0


@pytest.mark.parametrize("inertia", [0.1, 0.03])
def test_a_body_that_lands_on_two_feet_rebounds_alike_at_any_step(inertia: float) -> None:
    """Each foot slows the other down less than itself: that is no load on it, and the impact no persistent contact."""
    mass, half, radius = 0.1, 0.1, 0.01
    soft = Material(youngs_modulus=1e8, poissons_ratio=0.3)

    def rebound(step: float, gap: float) -> float:
        world = World(timestep=step, gravity=0.0)
        body = world.add_body(mass, inertia * mass * half**2, (0, 0, radius + gap), (0, 0, -1))
        feet = [world.add_sphere(body, radius, (x, 0, 0)) for x in (-half, half)]
        floor = world.add_plane(None, point=(0, 0, 0), normal=(0, 0, 1))
        world.add_contact(feet, floor, ContactPair(soft, soft, friction=0.0, restitution=0.7))
        world.step(round(4e-3 / step))
        return float(world.velocity[body, 2])

    wanted = rebound(1e-5, 1e-4)
    for step in (5e-4, 7e-4, 1.2e-3):
        for share in np.linspace(0.05, 0.95, 7):
            assert rebound(step, share * step) == pytest.approx(wanted, abs=1e-3)


@pytest.mark.parametrize("law", ["microslip", "mindlin"])
@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_a_slow_impact_on_a_wall_is_as_exact_as_a_fast_one(law: str, restitution: float) -> None:
    """Gravity along the wall does not bring the ball back, as on a floor, where such a bounce is over within the step.

    It had a tenth of its substeps: by `microslip` psi_2 was off by 6e-3, by `mindlin` by 5e-2.
    """
    pair, speed, step = ContactPair("steel", "steel", FRICTION, restitution, law=law), 0.06, 0.2
    slide = 1.5 * FRICTION * speed
    world = World(gravity=(1.0, 0.0, 0.0), timestep=step)
    wall, start = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), 0.3 * step
    place = 0.0, 0.0, RADIUS + speed * start  # when it touches, gravity has just stopped its motion along x
    ball = world.add_body(MASS, 0.4 * MASS * RADIUS**2, place, (-start, slide, -speed))
    world.add_contact(world.add_sphere(ball, RADIUS), wall, pair)
    world.step()
    after = collide(pair, Body(MASS, RADIUS, velocity=(0.0, slide, -speed)), normal=(0.0, 0.0, 1.0))
    unit = pair.kappa / (FRICTION * speed)
    psi_2 = unit * (world.velocity[ball, 1] + RADIUS * world.spin[ball, 0])
    assert psi_2 == pytest.approx(unit * (after.velocity_a[1] + RADIUS * after.spin_a[0]), abs=1e-3)
    assert world.velocity[ball, 2] == pytest.approx(restitution * speed, rel=1e-3)


@pytest.mark.parametrize("step", [1e-5, 5e-3])
def test_a_rod_that_friction_jams_is_thrown_alike_at_any_step(step: float) -> None:
    """Painleve's: laid on the floor with friction 2 it slides, is pressed on, and leaves; by substeps of 0.1 us.

    It was taken for a bounce that gravity ends within a long step: with a tenth of the substeps it left 5 % slower.
    """
    half, radius, mass, tilt = 0.15, 0.005, 0.1, -0.6  # friction presses on from 1.4 on at this tilt
    inertia = mass * half**2 / 3.0
    world = World(timestep=step)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    rod = world.add_body(mass, (inertia, inertia, 0.01 * inertia),
                         (half * np.sin(tilt), 0.0, radius + half * np.cos(tilt)), (2.0, 0.0, 0.0),
                         (np.cos(0.5 * tilt), 0.0, np.sin(0.5 * tilt), 0.0))  # fmt: skip
    world.add_contact(world.add_capsule(rod, radius, half), floor, ContactPair("steel", "steel", 2.0, 0.1))
    world.step(round(0.02 / step))
    assert world.velocity[rod, ::2] == pytest.approx([0.8720, 0.7196], abs=5e-3)
    assert world.spin[rod, 1] == pytest.approx(9.035, abs=0.05)
