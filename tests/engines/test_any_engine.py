"""What balls do in every engine, under every integrator of MuJoCo, and without an engine."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
import pytest

from contactlaw import LAWS, ContactPair, rebound
from sims.contact_point import contact_velocity, static_overlap
from sims.scene import Settings
from sims.worlds import State, Tuning, World, new_world

RADIUS, MASS, GRAVITY = 0.0254, 0.5, 9.81
UP = np.array([0.0, 0.0, 1.0])
SETUPS = ("none", "pybullet", "Euler", "RK4", "implicit", "implicitfast")  # the latter four: MuJoCo's integrators
LONG, SHORT = 2e-3, 2e-6  # [s], beside contacts of 0.1 ms
# friction, restitution, approach speed [m/s]: such that the overlap stays below a hundredth of the radius
CASES = {"steel": (0.115, 0.93, 1.0), "rubber": (2.4, 0.86, 0.05)}

Make = Callable[..., World]


@pytest.fixture(params=SETUPS)
def make(request: pytest.FixtureRequest) -> Iterator[Make]:
    """Makes worlds of this set-up: of a step [s], with gravity [m/s^2]."""
    setup, made = request.param, list[World]()
    if setup != "none":
        pytest.importorskip("pybullet" if setup == "pybullet" else "mujoco")

    def new(dt: float, gravity=(0.0, 0.0, 0.0), **tuning) -> World:
        engine = setup if setup in ("none", "pybullet") else "mujoco"
        tuning = tuning if engine != "mujoco" else tuning | {"integrator": setup}
        made.append(new_world(Settings(engine, timestep=dt), gravity, Tuning(**tuning)))
        return made[-1]

    yield new
    for world in made:
        world.close()


def pair_of(material: str = "steel", **changes) -> ContactPair:
    mu, e, _ = CASES[material]
    settings = {"friction": mu, "restitution": e} | changes
    return ContactPair(material, material, **settings)


def over_floor(world: World, pair: ContactPair, height: float = 0.0, *, ground: str = "plane", gyration2=0.4) -> World:
    """A ball, or with another K^2 a puck cut from one, that touches the floor by the law."""
    world.ball("ball", RADIUS, MASS, [0.0, 0.0, RADIUS + height], inertia=gyration2 * MASS * RADIUS**2)
    if ground == "plane":
        world.plane("floor")
    else:
        world.block("floor", [1.0, 1.0, 0.1], [0.0, 0.0, -0.1])
    world.contact("ball", "floor", pair)
    world.start()
    return world


def miss(
    world: World, pair: ContactPair, psi_1: float, *, speed=1.0, phase=0.3, heading=0.4, spinning=False, gyration2=0.4
) -> np.ndarray:
    """Errors of psi_2 and restitution against `rebound`, and sideways velocity; phase: of the touch in a step."""
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    slide = psi_1 * pair.friction / pair.kappa * speed
    velocity, spin = -speed * UP, slide / RADIUS * np.cross(along, UP)
    if not spinning:
        velocity, spin = velocity + slide * along, 0.0 * spin
    dt, (ball,) = world.timestep, world.bodies
    world.start(([0.0, 0.0, RADIUS + phase * dt * speed], velocity, spin))
    world.step(int(2.0 * pair.contact_duration(MASS, speed) / dt) + 4)
    state = world.read()
    after = contact_velocity(state.velocity[0], state.spin[0], UP, RADIUS)
    psi_2 = rebound(psi_1, pair.chi(ball.mass, ball.mass / (1.0 + 1.0 / gyration2)), pair.law, pair.restitution)
    bounce = state.velocity[0, 2] / speed - pair.restitution
    return np.abs([pair.psi(float(after @ along), speed) - psi_2, bounce, after @ np.cross(UP, along)])


@pytest.mark.parametrize("dt", [1 / 60, LONG, 1e-4, SHORT])
@pytest.mark.parametrize("restitution", [1.0, 0.93, 0.5])
def test_an_impact_is_that_of_rebound_at_any_step_and_phase(make: Make, dt: float, restitution: float) -> None:
    pair = pair_of(restitution=restitution, radius=RADIUS)
    world = over_floor(make(dt), pair)
    allowed = (5e-4, 1e-4, 1e-12) if restitution == 0.93 else (1e-3, 3e-4, 1e-12)
    for number, psi_1 in enumerate((0.3, 1.2, 2.5, 4.5) if dt > SHORT else (0.5, 2.0)):
        for phase in (0.02, 0.35, 0.8, 0.97) if dt > SHORT else (0.35,):
            assert (miss(world, pair, psi_1, phase=phase, heading=5.0 * phase + 0.7 * number) < allowed).all()


@pytest.mark.parametrize("material", CASES)
@pytest.mark.parametrize("spinning", [False, True])
@pytest.mark.parametrize("ground", ["plane", "block"])
@pytest.mark.parametrize("gyration2", [0.3, 0.4, 0.5])
def test_every_launch_is_that_of_rebound(
    make: Make, material: str, spinning: bool, ground: str, gyration2: float
) -> None:
    pair, speed = pair_of(material, radius=RADIUS), CASES[material][2]
    world = over_floor(make(0.7 * pair.contact_duration(MASS, speed)), pair, ground=ground, gyration2=gyration2)
    for psi_1 in (0.5, 2.0):
        off = miss(world, pair, psi_1, speed=speed, spinning=spinning, gyration2=gyration2)
        assert (off < (1.5e-3 if material == "steel" else 3e-3, 5e-4, 1e-12)).all()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("dt", [LONG, SHORT])
def test_every_law_is_that_of_its_own_rebound(make: Make, law: str, dt: float) -> None:
    pair = pair_of(law=law, radius=RADIUS)
    assert miss(over_floor(make(dt), pair), pair, 1.2)[0] < 3e-3


@pytest.mark.parametrize("dt", [LONG, SHORT])
@pytest.mark.parametrize("fast", [1.0, 5.0])
def test_two_balls_keep_both_momenta_and_meet_the_law(make: Make, dt: float, fast: float) -> None:
    """Spinning and off centre, momenta in every step of the impact; psi_2 where they hardly turn in it."""
    world, start = make(dt), 1.1e-3 if dt == LONG else SHORT
    masses, radii = np.array([0.5, 0.2]), np.array([RADIUS, 0.018])
    normal = np.array([0.3, 0.1, np.sqrt(1.0 - 0.09 - 0.01)])
    speeds, spins = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]]), fast * np.array([[10.0, -4, 2], [-3, 8, -7]])
    for number, place in enumerate((0.0 * normal, radii.sum() * normal)):
        place = place - start * speeds[number]
        world.ball(f"ball{number}", radii[number], masses[number], place, speeds[number], spins[number])
    pair = pair_of(restitution=1.0)
    world.contact("ball0", "ball1", pair)
    world.start()

    def totals() -> np.ndarray:
        state = world.read()
        turning = np.cross(state.position, state.velocity) + 0.4 * radii[:, None] ** 2 * state.spin
        return np.concatenate([masses @ state.velocity, masses @ turning])

    def sliding() -> np.ndarray:
        state = world.read()
        return state.velocity[1] - state.velocity[0] - np.cross(radii @ state.spin, normal)

    before, first = totals(), sliding()
    for _ in range(int((start + 3e-4) / dt) + 3):
        world.step()
        np.testing.assert_allclose(totals(), before, atol=1e-14)
    approach = -first @ normal
    along = first + approach * normal
    size = np.linalg.norm(along)
    mass = 1.0 / (1.0 / masses).sum()
    expected = rebound(pair.psi(size, approach), pair.chi(mass, mass / 3.5))
    found = pair.psi(float(sliding() @ along) / size, approach)
    assert found == pytest.approx(expected, abs=2e-2) or fast > 1.0


def test_a_pivoting_ball_slows_and_stops(make: Make) -> None:
    """3 pi/16 mu P a is the moment of a Hertz contact that spins about its normal (Lubkin 1951)."""
    pair = pair_of(friction=0.3, restitution=0.5)
    overlap = static_overlap(pair, MASS * GRAVITY, RADIUS)
    rate = 3.0 * np.pi / 16.0 * 0.3 * GRAVITY * np.sqrt(RADIUS * overlap) / (0.4 * RADIUS**2)
    world = over_floor(make(LONG, -GRAVITY * UP), pair)
    world.start(([0.0, 0.0, RADIUS - overlap], [0.0, 0.0, 0.0], [0.0, 0.0, 0.4 * rate]))
    world.step(100)
    assert world.read().spin[0, 2] == pytest.approx(0.2 * rate, rel=0.01)
    world.step(400)
    state = world.read()
    assert np.abs(state.velocity).max() < 1e-3 * rate * RADIUS and np.abs(state.spin).max() < 1e-3 * rate


@pytest.mark.parametrize("slope", [10.0, 18.0, 30.0, 50.0])
@pytest.mark.parametrize("mu", [0.115, 0.3])
@pytest.mark.parametrize("ground", ["plane", "block"])
def test_a_ball_rolls_or_slides_down_a_slope(make: Make, slope: float, mu: float, ground: str) -> None:
    """g sin(a)/1.4 where friction holds, else g (sin(a) - mu cos(a)), from its static overlap on; height unchanged."""
    a, pair, time = np.deg2rad(slope), pair_of(friction=mu, restitution=0.5), 60 * LONG
    overlap = static_overlap(pair, MASS * GRAVITY * np.cos(a), RADIUS)
    world = over_floor(make(LONG, GRAVITY * np.array([np.sin(a), 0.0, -np.cos(a)])), pair, -overlap, ground=ground)
    world.step(20)
    before = world.read()
    world.step(60)
    after = world.read()
    rolls = np.tan(a) < 3.5 * mu
    gain = GRAVITY * (np.sin(a) / 1.4 if rolls else np.sin(a) - mu * np.cos(a))
    turn = gain if rolls else 2.5 * mu * GRAVITY * np.cos(a)
    assert (after.velocity - before.velocity)[0, 0] / time == pytest.approx(gain, rel=1e-3)
    assert (after.spin - before.spin)[0, 1] * RADIUS / time == pytest.approx(turn, rel=1e-3)
    assert after.position[0, 2] == pytest.approx(RADIUS - overlap, abs=1e-13)


@pytest.mark.parametrize("restitution", [0.5, 0.9])
@pytest.mark.parametrize("law", ["microslip", "linear_spring", "coulomb"])
def test_a_ball_comes_to_rest_at_its_static_overlap_and_stays(make: Make, restitution: float, law: str) -> None:
    pair = pair_of(restitution=restitution, law=law)
    world = over_floor(make(LONG, -GRAVITY * UP), pair, 0.01)
    world.step(2000)
    place = world.read().position
    if law != "linear_spring":
        assert RADIUS - place[0, 2] == pytest.approx(static_overlap(pair, MASS * GRAVITY, RADIUS), rel=1e-8)
    for _ in range(20):
        world.step(50)
        state = world.read()
        np.testing.assert_array_equal(state.position, place)
        assert not state.velocity.any() and not state.spin.any()


@pytest.mark.parametrize("height", [0.0, 3e-4])
def test_a_ball_that_lands_and_falls_asleep_within_a_step_lies_on_the_floor(make: Make, height: float) -> None:
    pair = pair_of(restitution=0.1)
    world = over_floor(make(2e-2, -GRAVITY * UP), pair, height)
    world.step(6)
    depth = RADIUS - world.read().position[0, 2]
    assert depth == pytest.approx(static_overlap(pair, MASS * GRAVITY, RADIUS), rel=1e-6)


# Finely integrated chains of Hertz contacts, the first ball at 1 m/s (scipy, rtol 1e-11).
CHAINS = {
    3: [-0.07095, 0.07640, 0.99455],
    4: [-0.07109, -0.02963, 0.10974, 0.99097],
    5: [-0.07109, -0.03027, -0.01446, 0.12704, 0.98878],
}


@pytest.mark.parametrize("count", CHAINS)
@pytest.mark.parametrize("gap", [0.0, 1e-4])
@pytest.mark.parametrize("dt", [LONG, 1e-4])
def test_a_row_of_balls_in_touch_or_nearly(make: Make, dt: float, count: int, gap: float) -> None:
    world, names = make(dt), [f"ball{i}" for i in range(count)]
    for i, name in enumerate(names):
        place = (2.0 * RADIUS + gap) * i - 3e-3 * (i == 0)
        world.ball(name, RADIUS, MASS, [place, 0.0, 0.0], [float(i == 0), 0.0, 0.0])
    world.contact(names, names, pair_of(friction=0.0, restitution=1.0))
    world.start()
    world.step(int(12e-3 / dt))
    speeds = world.read().velocity[:, 0]
    np.testing.assert_allclose(speeds, [*np.zeros(count - 1), 1.0] if gap else CHAINS[count], atol=5e-4)
    assert speeds @ speeds == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, LONG, 1e-4])
def test_elastic_bounces_keep_their_energy(make: Make, dt: float) -> None:
    """Without friction, to 2e-4 where the ball flies."""
    world = over_floor(make(dt, -GRAVITY * UP), pair_of(friction=0.0, restitution=1.0), 0.2)
    world.start(([0.0, 0.0, RADIUS + 0.2], [0.2, 0.0, 0.0], [5.0, 20.0, 3.0]))

    def energy(state: State) -> float:
        velocity, spin = state.velocity[0], state.spin[0]
        height = state.position[0, 2] - RADIUS
        return float(0.5 * velocity @ velocity + 0.2 * RADIUS**2 * spin @ spin + GRAVITY * height)

    first = energy(world.read())
    for _ in range(100):
        world.step(round(0.1 / dt))
        while (state := world.read()).position[0, 2] < RADIUS:
            world.step()
        assert energy(state) == pytest.approx(first, rel=2e-4)


@pytest.mark.parametrize("dt", [5e-4, LONG, 4e-3, 1e-2])
@pytest.mark.parametrize(("material", "speeds"), [("steel", (0.1, 0.5, 3.0)), ("rubber", (0.05, 0.4))])
def test_a_ball_that_rattles_between_two_walls_keeps_its_speed(make: Make, material: str, speeds, dt: float) -> None:
    """Several impacts a step, and nothing is warned of; speeds such that the overlap stays small."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for gap in (2e-4, 1e-3, 5e-3, 2e-2):
            world = make(dt)
            world.ball("ball", RADIUS, MASS, [0.0, 0.0, RADIUS + 0.3 * gap])
            world.plane("floor")
            world.block("ceiling", [1.0, 1.0, 0.1], [0.0, 0.0, 2.0 * RADIUS + gap + 0.1])
            world.contact("ball", ["floor", "ceiling"], pair_of(material, friction=0.0, restitution=1.0))
            for speed in speeds:
                world.start(([0.0, 0.0, RADIUS + 0.3 * gap], [0.0, 0.0, speed], [0.0, 0.0, 0.0]))
                for _ in range(100):
                    world.step()
                    state = world.read()
                    if RADIUS < state.position[0, 2] < RADIUS + gap:
                        assert abs(state.velocity[0, 2]) == pytest.approx(speed, rel=0.01), (gap, speed)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("dt", [2e-4, 1e-3, 5e-3])
def test_a_gas_of_elastic_balls_keeps_its_energy_and_gets_no_spin(make: Make, seed: int, dt: float) -> None:
    rng, half, world = np.random.default_rng(seed), 0.12, make(dt)
    names, walls = [f"ball{i}" for i in range(8)], [f"wall{i}" for i in range(6)]
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half / 2.0
    for name, corner, velocity in zip(names, corners, 2.0 * rng.normal(size=(8, 3)), strict=True):
        world.ball(name, RADIUS, MASS, corner, velocity)
    for name, normal in zip(walls, [*np.eye(3), *-np.eye(3)], strict=True):
        world.plane(name, -half * normal, normal)
    world.contact(names, [*names, *walls], pair_of(friction=0.0, restitution=1.0))
    world.start()
    first = np.sum(world.read().velocity ** 2)
    world.step(round(0.6 / dt))
    found = []
    for _ in range(60):  # the most, as what touches holds energy
        world.step()
        found.append(np.sum(world.read().velocity ** 2))
    assert max(found) == pytest.approx(first, rel=1e-3)
    state = world.read()
    assert np.abs(state.spin).max() * RADIUS < 1e-12
    assert np.abs(state.position).max() < half - 0.9 * RADIUS


def test_in_a_crowd_its_own_substeps_count(make: Make) -> None:
    """A ball strikes six that touch: the error against 640 substeps, with 10 and with 40."""
    places = [(row * RADIUS * 3.0**0.5, (2 * i - row) * RADIUS, 0.0) for row in range(3) for i in range(row + 1)]
    after = {}
    for crowd_substeps in (10, 40, 640):
        world = make(LONG, crowd_substeps=crowd_substeps)
        names = [f"ball{number}" for number in range(7)]
        for name, place in zip(names, [(-2.1 * RADIUS, 0.1 * RADIUS, 0.0), *places], strict=True):
            world.ball(name, RADIUS, MASS, place, (3.0 if name == "ball0" else 0.0, 0.0, 0.0))
        world.contact(names, names, pair_of())
        world.start()
        world.step(10)
        after[crowd_substeps] = world.read().velocity
    coarse, fine = (np.abs(after[n] - after[640]).max() for n in (10, 40))
    assert fine < 0.25 * coarse < 0.25 * 0.02


def test_the_error_falls_with_the_square_of_the_substeps(make: Make) -> None:
    """Against the same impact with fine substeps, over phases: halving them leaves a quarter."""
    pair, off = pair_of(radius=RADIUS), {}
    for substeps in (20, 80, 3000):
        world = over_floor(make(LONG, substeps=substeps), pair)
        off[substeps] = np.array([miss(world, pair, 0.5, phase=phase)[0] for phase in np.arange(8) / 8])
    coarse, medium = (np.sqrt(np.mean((off[n] - off[3000].mean()) ** 2)) for n in (20, 80))
    assert np.log(coarse / medium) / np.log(4.0) > 1.5


def test_what_rolls_by_does_not_keep_awake(make: Make) -> None:
    """It rolls at 20 um from a ball that stands, without any loss."""
    world, low, speed = make(LONG, (0.0, 0.0, -GRAVITY)), RADIUS - 1e-7, 1e-3
    world.plane("floor")
    world.ball("stands", RADIUS, MASS, [0.0, 0.0, low])
    world.ball("rolls", RADIUS, MASS, [-1e-4, 2.0 * RADIUS + 2e-5, low], [speed, 0.0, 0.0], [0.0, speed / RADIUS, 0.0])
    world.contact(["stands", "rolls"], ["stands", "rolls", "floor"], pair_of(restitution=0.5))
    world.start()
    world.step(50)
    before = world.read()
    world.step(50)
    after = world.read()
    assert np.array_equal(before.position[0], after.position[0]) and not after.velocity[0].any()
    assert not after.spin[0].any() and after.velocity[1] == pytest.approx([speed, 0.0, 0.0], rel=1e-6, abs=1e-9)


def test_couples_given_one_by_one_are_a_set(make: Make) -> None:
    def struck(couples: list[tuple]) -> State:
        world = make(LONG)
        for number in range(4):
            world.ball(f"ball{number}", RADIUS, MASS, [2.0 * RADIUS * number - 1e-3 * (number == 0), 0.0, 0.0],
                       [0.5 * (number == 0), 0.0, 0.0])  # fmt: skip
        for one, two in couples:
            world.contact(one, two, pair_of())
        world.start()
        world.step(20)
        return world.read()

    row = [f"ball{number}" for number in range(4)]
    together, apart = struck([(row, row)]), struck(list(combinations(row, 2)))
    assert together.velocity[3, 0] > 0.4
    np.testing.assert_array_equal(together.velocity, apart.velocity)
    np.testing.assert_array_equal(together.spin, apart.spin)
