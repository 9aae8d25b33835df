"""Shapes: closed forms of boxes, ellipsoids and cylinders; costs of sliding and tumbling; random drops and heaps."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from functools import partial
from math import cos, radians, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from contactlaw import ContactPair, Material
from contactlaw.world import World
from validation.ball import DOWN, FLOOR, RADIUS, STEEL, balls_world
from validation.case import Case, Data, Limit, Outcome, Table
from validation.measure import interleaved, spread
from validation.shape_draws import KINDS, draw, draw_heap

PLASTIC = Material(3e9, 0.35, 1200.0)
SPEED, MASS = 0.2, 0.3  # [m/s], [kg]
HALF_AXES = np.array([0.03, 0.02, 0.012])  # [m]
ANGLES, SECOND = (30.0, 60.0, 90.0), (0.01, 0.03)  # [degrees] between two cylinders; radius of the second [m]
DROPS, HEAPS, STEPS = 300, 60, 10**7  # the seeds from here on have not been tried
ENGINES = {"none": KINDS, "mujoco": KINDS, "pybullet": tuple(kind for kind in KINDS if kind != "ellipsoid")}
HEIGHT, KICKS = 0.05, 200  # of a ball that bounces to rest and is kicked again [m]; in a run
TITLES = {"none": "World", "mujoco": "MuJoCo", "pybullet": "PyBullet"}


def hertz_radius(p: float, q: float) -> float:
    """R [m] of 4/3 E* sqrt(R) delta^1.5 for curvatures p <= q [1/m], by Johnson (1985), section 4.2."""
    from scipy.special import ellipe, ellipk

    if q < p * (1.0 + 1e-9):
        return 1.0 / p
    m = -np.expm1(-2.0 * elongation(p, q))
    return float(np.pi**2 * (ellipk(m) - ellipe(m)) / m / (2.0 * p * ellipk(m) ** 3))


def elongation(p: float, q: float) -> float:
    """ln(a/b) of the ellipse for curvatures p < q [1/m], by a root."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    def mismatch(t: float) -> float:
        m = -np.expm1(-2.0 * t)  # t = ln(a/b), m = k^2
        return float(np.log((np.exp(2.0 * t) * ellipe(m) - ellipk(m)) / (ellipk(m) - ellipe(m))) - np.log(q / p))

    root: Any = brentq(mismatch, 1e-7, 12.0)
    return float(root)


def box_errors() -> tuple[float, float]:
    """Errors of a box on a plane, four springs of its edges' radius: depth at rest, and approach in a flat fall."""
    half, r = np.array([0.03, 0.02, 0.02]), 0.002

    def box(pair: ContactPair, gravity: float, timestep: float, speed: float) -> World:
        world = World(gravity=gravity, timestep=timestep)
        body = world.add_body(1.0, (half @ half - half * half) / 3.0, (0.0, 0.0, 0.02 + 1e-5), (0.0, 0.0, -speed))
        world.add_contact(world.add_box(body, half, rounding=r), world.add_plane(None, *FLOOR), pair)
        return world

    lies = box(ContactPair(PLASTIC, PLASTIC, 0.3, 0.6), 9.81, 2e-3, 0.0)
    lies.step(1000)
    k = 4.0 * 4.0 / 3.0 * ContactPair(PLASTIC, PLASTIC, 0.0).effective_modulus * sqrt(r)
    deepest = struck(box(ContactPair(PLASTIC, PLASTIC, 0.0), 0.0, 1e-4, SPEED))[0]
    return (abs(lies.contacts["overlap"].mean() / (9.81 / k) ** (2.0 / 3.0) - 1.0),
            abs(deepest / (1.25 * SPEED**2 / k) ** 0.4 - 1.0))  # fmt: skip


def struck(world: World) -> tuple[float, float]:
    """Greatest overlap [m] and duration [s] of the first impact."""
    for _ in range(400):
        world.step()
        rows = world.contacts
        if rows.size and not rows["closed"].any():
            return float(rows["deepest"].mean()), float(rows["duration"].mean())
    raise RuntimeError("no impact has come to an end")


def hertz_error(world: World, shapes: Any, p: float, q: float) -> float:
    """Larger error of approach and duration of an elastic head-on impact; p <= q: relative curvatures [1/m]."""
    from validation.reference.closed_forms import hertz

    pair = ContactPair(STEEL, STEEL, 0.0)
    world.add_contact(shapes[0], shapes[1], pair)
    exact = hertz.impact(MASS, hertz_radius(p, q), pair.effective_modulus, SPEED)
    overlap, duration = struck(world)
    return max(abs(overlap / exact.overlap - 1.0), abs(duration / exact.duration - 1.0))


def thrown(height: float) -> tuple[World, int]:
    """A world without gravity and a body that falls along z."""
    world = World(gravity=0.0, timestep=1e-4)
    return world, world.add_body(MASS, 1e-4, (0.0, 0.0, height + 1e-5), (0.0, 0.0, -SPEED))


def ellipsoid_error(axis: int) -> float:
    """Error of an ellipsoid that strikes a plane along an axis."""
    half = np.roll(HALF_AXES, axis)
    world, body = thrown(half[2])
    shapes = world.add_ellipsoid(body, half), world.add_plane(None, *FLOOR)
    return hertz_error(world, shapes, *sorted(half[2] / half[:2] ** 2))


def crossed_error(angle: float, second: float) -> float:
    """Error of two cylinders whose sides cross; relative curvatures by Johnson (1985), equation 4.6."""
    world, body = thrown(0.01 + second)
    turn, one, two = radians(angle), 1.0 / 0.01, 1.0 / second
    shapes = (world.add_cylinder(body, 0.01, 0.05, axis=(1.0, 0.0, 0.0)),
              world.add_cylinder(None, second, 0.05, axis=(cos(turn), sin(turn), 0.0)))  # fmt: skip
    differ = sqrt(one**2 + two**2 + 2.0 * one * two * cos(2.0 * turn))
    return hertz_error(world, shapes, 0.5 * (one + two - differ), 0.5 * (one + two + differ))


def ball_error(second: float) -> float:
    """Error of a ball on the side of a cylinder."""
    world, body = thrown(0.01 + second)
    shapes = world.add_sphere(body, 0.01), world.add_cylinder(None, second, 0.05, axis=(1.0, 0.0, 0.0))
    return hertz_error(world, shapes, 1.0 / 0.01, 1.0 / 0.01 + 1.0 / second)


def drops(engine: str, seeds: range, make: Any) -> Data:
    """Sums over random drops, and descriptions of those that fail."""
    from validation.shape_runs import FLIGHT, judge

    judge(engine, make(0))  # compiles
    words, found = [], []
    for drop in map(make, seeds):
        try:
            found.append(judge(engine, drop))
            words += [f"{drop}: {', '.join(found[-1].wrong)}"] if found[-1].wrong else []
        except Exception as error:
            words.append(f"{drop}: {type(error).__name__}: {error}")
    moving = sum(any("moves" in one for one in verdict.wrong) for verdict in found)
    most = {key: max([0.0, *(getattr(verdict, key) for verdict in found)]) for key in ("gain", "depth")}
    return {"engine": engine, "runs": len(seeds), "failed": len(words) - moving, "moving": moving,
            "flown": sum(verdict.flight > FLIGHT for verdict in found), **most,
            "rest": float(np.median([verdict.rest for verdict in found])), "words": words}  # fmt: skip


def resident() -> float:
    """Memory [MB] in use by this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20


def endure(steps: int) -> dict[str, Any]:
    """A ball that is kicked now and then, without an engine, for so many steps; memory [MB] before and after."""
    place, rng = [0.0, 0.0, RADIUS + HEIGHT], np.random.default_rng(0)
    pair = ContactPair(STEEL, STEEL, 0.2, 0.7)
    world = balls_world("none", 2e-3, pair, place, planes=[FLOOR], gravity=DOWN).world  # type: ignore[attr-defined]
    world.step(2000)
    before = resident()
    for _ in range(KICKS):
        up = np.sqrt(2.0 * 9.81 * HEIGHT) * rng.uniform(0.1, 0.9)
        world.place(0, velocity=[*(0.05 * rng.normal(size=2)), up])
        world.step(steps // KICKS)
    return {"engine": "none", "steps": steps, "before": before, "after": resident()}


CRATE = '<geom name="thing" type="box" size=".03 .02 .02" mass="1"/>'
COSTS = {  # floor, thing, speed [m/s], height [m]
    "box at rest on a plane": ("plane", CRATE, 0.0, 0.02),
    "box sliding on a plane": ("plane", CRATE, 0.5, 0.02),
    "box at rest on a box": ("box", CRATE, 0.0, 0.02),
    "box sliding on a box": ("box", CRATE, 0.5, 0.02),
    "mesh tumbling on a plane": ("plane", '<geom name="thing" type="mesh" mesh="rock" density="2500"/>', 0.5, 0.06),
}


def costs(rounds: int) -> dict[str, Data]:
    """Time of a step by the law over MuJoCo's own, for the same motion at 2 ms: medians and quartiles."""
    import mujoco

    from contactlaw.mujoco_plugin import load_model

    rock = " ".join(map(str, (0.02 * np.random.default_rng(3).normal(size=(20, 3))).ravel()))
    found, pair = {}, ContactPair(PLASTIC, PLASTIC, 0.3, 0.6)
    for name, (floor, thing, speed, height) in COSTS.items():
        size = '"5 5 1"' if floor == "plane" else '"5 5 .1" pos="0 0 -.1"'
        text = (f'<mujoco><option timestep="2e-3"/><default><geom friction="{pair.friction}"/></default>'
                f'<asset><mesh name="rock" vertex="{rock}"/></asset><worldbody>'
                f'<geom name="floor" type="{floor}" size={size}/><body pos="0 0 {height}"><freejoint/>{thing}</body>'
                "</worldbody></mujoco>")  # fmt: skip
        models = {"law": load_model(text, [("thing", "floor", pair)]), "native": mujoco.MjModel.from_xml_string(text)}
        both = {way: (model, mujoco.MjData(model)) for way, model in models.items()}

        def prepare(model: Any, data: Any, speed=speed, name=name) -> None:
            mujoco.mj_resetData(model, data)
            mujoco.mj_step(model, data, 0 if "tumbling" in name else 300)
            data.qvel[0] = speed

        seconds = interleaved({way: partial(mujoco.mj_step, *one, 75) for way, one in both.items()}, rounds,
                              {way: partial(prepare, *one) for way, one in both.items()})  # fmt: skip
        found[name] = spread(seconds["law"] / seconds["native"])
        found[name] |= {way: 1e6 / 75 * float(np.median(taken)) for way, taken in seconds.items()}
    return found


class Shapes(Case):
    """A box on a plane is four springs of the radius of its edges; an ellipsoid on a plane and the crossed sides of
    cylinders are Hertz's elliptic contacts. In drops of random shapes, sizes, materials and steps no body gains energy
    or sinks in, and all come to rest. Heaps of mixed sizes are stable, and memory does not grow.
    """

    place = 52
    title = "Shapes"

    def run(self, quick: bool) -> Outcome:
        rest, fall = box_errors()
        forms = {
            "box on a plane: depth at rest": rest,
            "box falling flat: approach": fall,
            "ellipsoid on a plane: approach and duration": max(map(ellipsoid_error, range(3))),
            "crossed cylinders: approach and duration": max(crossed_error(a, r) for a in ANGLES for r in SECOND),
            "ball on a cylinder's side: approach and duration": max(map(ball_error, SECOND)),
        }
        ratios = costs(5 if quick else 25)
        seeds = range(10 if quick else DROPS)
        sums = [drops(engine, seeds, partial(draw, kinds=kinds))
                for engine, kinds in ENGINES.items()]  # fmt: skip
        heaps = drops("none", range(2 if quick else HEAPS), draw_heap)
        memory = endure(10**5 if quick else STEPS)
        limits = [Limit(name, 1e-2, error) for name, error in forms.items()]
        for one in sums:
            what = TITLES[one["engine"]]
            limits += [Limit(f"drops that gain, sink or fail, {what}", 0, one["failed"]),
                       Limit(f"drops that still move after 10 s, {what}", 0, one["moving"])]  # fmt: skip
        limits += [Limit("heaps that gain, sink or fail", 0, heaps["failed"]),
                   Limit("memory gained by a ball that bounces", 1.0, memory["after"] - memory["before"],
                         "MB")]  # fmt: skip
        limits += [Limit(f"{name}, over native", 1.5, one["median"]) for name, one in ratios.items()]
        return Outcome(limits, {"forms": forms, "costs": ratios, "drops": sums, "heaps": heaps, "memory": memory})

    def table(self, data: Data) -> Table:
        table = Table("what | figure | |")
        for name, one in data["costs"].items():
            table.add(f"{name}, law over native | {{median:.2f}} ({{low:.2f}} to {{high:.2f}}) | "
                      "law {law:.1f} us | native {native:.1f} us", one)  # fmt: skip
        sums = [(f"drops, {TITLES[one['engine']]}", one) for one in data["drops"]]
        for name, one in [*sums, ("heaps of 6 to 12", data["heaps"])]:
            table.add(f"{{runs}} {name} | {{flown}} not judged, the engine's own flight changing energy by over 10 % | "
                      "greatest gain {gain:.1e} | at rest after {rest:.1f} s, median", one)  # fmt: skip
        return table
