"""Two spinning balls that meet off-centre in space: momentum, and the rebound of the contact point."""

from itertools import product
from math import sqrt

import numpy as np

from contactlaw import ContactPair
from validation import ball
from validation.case import Array, Case, Data, Limit, Outcome, Table, worst
from validation.impacts import judge

State = tuple[Array, Array, Array]
"""Places, velocities, spins of both balls, shape (2, 3) each."""

STEPS = {"mujoco": [1.0 / 240.0, 2e-3, 1e-3, 1e-4, 1e-5], "pybullet": [1.0 / 240.0, 1e-3, 1e-4, 1e-5]}  # [s]
KEPT, REBOUND = 1e-10, 1e-2
SPEEDS = [1.0, 3.0]  # [m/s]
PAIR = ContactPair(ball.STEEL, ball.STEEL, ball.FRICTION, ball.RESTITUTION)
CHI = PAIR.chi(0.5 * ball.MASS, 0.5 * ball.TANGENTIAL_MASS)  # of two equal solid balls
INERTIA = 0.4 * ball.MASS * ball.RADIUS**2  # [kg m^2]
AHEAD = 2.3  # engine steps before the touch


class Momentum(Case):
    """Two spinning balls that meet off-centre conserve linear and angular momentum to rounding, in every step of any
    length. At about 1 m/s the contact point rebounds as the theory predicts for the inertia of both balls.
    """

    place = 46
    title = "Two balls in flight"

    def run(self, quick: bool) -> Outcome:
        count = 4 if quick else 16
        kinds = [("mujoco", dt, "Euler") for dt in STEPS["mujoco"]]
        kinds += [("mujoco", 2e-3, name) for name in ball.INTEGRATORS[1:]]
        kinds += [("pybullet", dt, "") for dt in STEPS["pybullet"]]
        runs: list[Data] = []
        problems: list[str] = []
        for engine, dt, integrator in kinds:
            for speed in SPEEDS:
                run: Data = {"engine": engine, "step": dt, "integrator": integrator, "speed": speed}
                met = [one for seed in range(count) if (one := _impact(engine, dt, integrator, speed, seed))]
                if len(met) < count:
                    problems.append(f"{ball.where(run)}: balls did not meet and part")
                runs.append(run | {key: worst(met, key) for key in (met[0] if met else ())})
        limits = []
        for engine in STEPS:
            own = [run for run in runs if run["engine"] == engine]
            limits += [
                Limit(f"change of linear momentum, {engine}", KEPT, worst(own, "linear")),
                Limit(f"change of angular momentum, {engine}", KEPT, worst(own, "angular")),
                Limit(f"error of the rebound at {SPEEDS[0]:g} m/s, {engine}", REBOUND,
                      worst(own, "tangential", "normal", speed=SPEEDS[0])),
            ]  # fmt: skip
        return Outcome(limits, {"runs": runs, "chi": CHI, "impacts": count}, problems)

    def table(self, data: Data) -> Table:
        table = Table("engine | speed [m/s] | error in psi_2 | error in e | rotation of the line of centres [degrees]")
        for engine, speed in product(STEPS, SPEEDS):
            told = [worst(data["runs"], key, engine=engine, speed=speed) for key in ("tangential", "normal", "turning")]
            table.add("{engine} | {speed:g} | {told[0]:.1e} | {told[1]:.1e} | {told[2]:.2f}",
                      engine=engine, speed=speed, told=told)  # fmt: skip
        return table


def _start(speed: float, seed: int, dt: float) -> State:
    """Balls on their way to an off-centre impact with about this normal speed, somewhere within a step."""
    random = np.random.default_rng(seed)
    normal = random.normal(size=3)
    normal /= np.linalg.norm(normal)
    across = np.cross(normal, random.normal(size=3))
    across /= np.linalg.norm(across)
    sliding = random.uniform(0.2, 4.0) * ball.FRICTION / PAIR.kappa * speed
    share = random.uniform(0.0, 1.0)  # of the sliding that is off-centre flight; the rest is spin
    relative = -speed * normal + share * sliding * across
    drift = random.normal(size=3) * 0.5 * speed
    velocities = np.array([drift + 0.5 * relative, drift - 0.5 * relative])
    spins = np.tile(np.cross(normal, across) * (1.0 - share) * sliding / (-2.0 * ball.RADIUS), (2, 1))
    spins += random.normal(size=3) * np.array([[1.0], [-1.0]]) * 3.0 * speed  # rolls on the other: adds no sliding
    time = (AHEAD + random.uniform(0.0, 1.0)) * dt
    places = np.array([ball.RADIUS * normal, -ball.RADIUS * normal]) - time * velocities
    return places, velocities, spins


def _impact(engine: str, dt: float, integrator: str, speed: float, seed: int) -> Data | None:
    start = _start(speed, seed, dt)
    world = ball.balls_world(engine, dt, PAIR, *start, integrator=integrator or "Euler")
    world.start()
    first = _momenta(start)
    size = np.linalg.norm(ball.MASS * start[1], axis=1).sum()
    linear = angular = 0.0
    for _ in range(int(AHEAD) + 3 + round(3e-4 / speed**0.2 / dt)):
        world.step()
        found = world.read()
        state = found.position, found.velocity, found.spin
        changes = (np.abs(now - then).max() for now, then in zip(_momenta(state), first, strict=True))
        linear, angular = (float(max(one, two)) for one, two in zip((linear, angular), changes, strict=True))
    linear, angular = linear / size, angular / (size * 2.0 * ball.RADIUS)
    world.close()
    lines = [_line_of_centres(start, first=True), _line_of_centres(state, first=False)]
    if lines[0] is None or lines[1] is None or np.linalg.norm(state[1] - start[1]) < 0.1 * speed:
        return None
    middle = (lines[0] + lines[1]) / np.linalg.norm(lines[0] + lines[1])
    before, after = _at_contact(start, middle), _at_contact(state, middle)
    closing = -before @ middle
    scale = PAIR.kappa / ball.FRICTION / closing
    sliding = before + closing * middle
    truth = judge([(round(float(scale * np.linalg.norm(sliding)), 6), CHI, ball.RESTITUTION)], annuli=20).psi_2[0]
    leaving = after - (after @ middle) * middle
    return {"linear": linear, "angular": angular,
            "tangential": float(np.abs(scale * leaving - truth * sliding / np.linalg.norm(sliding)).max()),
            "normal": float(abs(after @ middle / closing - ball.RESTITUTION)),
            "turning": float(np.degrees(np.arccos(np.clip(lines[0] @ lines[1], -1.0, 1.0))))}  # fmt: skip


def _momenta(state: State) -> tuple[Array, Array]:
    places, velocities, spins = state
    return ball.MASS * velocities.sum(axis=0), (ball.MASS * np.cross(places, velocities) + INERTIA * spins).sum(axis=0)


def _line_of_centres(state: State, *, first: bool) -> Array | None:
    """Vector from ball 2 to ball 1 at the instant of free flight at which they just touch."""
    apart, speed = state[0][0] - state[0][1], state[1][0] - state[1][1]
    a, b, c = speed @ speed, apart @ speed, apart @ apart - 4.0 * ball.RADIUS**2
    if b * b < a * c:
        return None
    time = (-b - sqrt(b * b - a * c)) / a if first else (-b + sqrt(b * b - a * c)) / a
    line = apart + time * speed
    return line / np.linalg.norm(line)


def _at_contact(state: State, normal: Array) -> Array:
    """Velocity of ball 1's contact point less that of ball 2's; normal from 2 to 1."""
    _, velocities, spins = state
    return velocities[0] - velocities[1] - ball.RADIUS * np.cross(spins[0] + spins[1], normal)
