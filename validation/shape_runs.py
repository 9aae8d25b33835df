"""Random drops run in a world and in both engines, and judged: energy, depth, rest."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import product
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.shape_draws import GRAVITY, WALL, WALLS, Array, Drop, Thing, matrix

Met = tuple[float, float, tuple[int, ...]]

LONGEST = 10.0  # [s] that a drop may take to come to rest
PATIENCE = 20.0  # [s] of CPU
GAIN = 1e-2  # of the energy at the start
LIGHT = 1e-4  # of the same, energy in contacts that is none
STILL = 1e-6  # of the same, energy of motion of centres that is none: what spins on a small patch does so for minutes
DEEPER = 1.3  # times the overlap that holds all the energy in one contact
FLOOR = (0.4, 0.4, 0.05)  # half lengths of one that is a box [m]


@dataclass
class Look:
    """What there is after a step.

    Attributes:
        energy: Of motion and height, of each thing [J], shape (n,).
        linear: Of the motion of centres [J].
        held: By contacts [J].
        overlap: The greatest [m].
        touched: Which things touch or touched within the step, shape (n,).
    """

    energy: Array
    linear: float
    held: float
    overlap: float
    touched: NDArray[np.bool_]


class Run(ABC):
    """A drop in an engine."""

    def __init__(self, drop: Drop) -> None:
        self.drop = drop

    @abstractmethod
    def step(self) -> None:
        """One of the drop's steps."""

    @abstractmethod
    def states(self) -> tuple[Array, Array, Array, Array]:
        """Places, unit quaternions (scalar first), velocities and spins in the world, true at one time."""

    @abstractmethod
    def contacts(self) -> list[Met]:
        """Overlap [m] and normal force [N] of what touches or touched within the step, and the numbers of both bodies,
        those of things from 0 on."""

    def close(self) -> None:  # noqa: B027
        """Let go of the engine."""

    def look(self) -> Look:
        """Where energy is now."""
        places, turns, velocities, spins = self.states()
        linear, energy = 0.0, np.zeros(len(places))
        for k, (thing, place, turn) in enumerate(zip(self.drop.things, places, turns, strict=True)):
            own = matrix(turn).T @ spins[k]
            kinetic = 0.5 * float(thing.mass * velocities[k] @ velocities[k])
            linear += kinetic
            energy[k] = kinetic + 0.5 * float(thing.moments @ own**2) + thing.mass * GRAVITY * place[2]
        met = self.contacts()
        held = sum(0.4 * max(overlap, 0.0) * force for overlap, force, _ in met)
        touched = np.isin(np.arange(len(places)), [body for one in met for body in one[2]])
        return Look(energy, linear, held, max([0.0, *(one[0] for one in met)]), touched)

    def sunk(self) -> float:
        """How far the lowest thing reaches below the floor [m], but for a twentieth of the radius of its edges."""
        places, turns, _, _ = self.states()
        return max(
            thing.reach(-matrix(turn)[2]) - float(place[2]) - 0.05 * thing.least
            for thing, place, turn in zip(self.drop.things, places, turns, strict=True)
        )


class InWorld(Run):
    """Without an engine."""

    def __init__(self, drop: Drop) -> None:
        from contactlaw.world import World

        super().__init__(drop)
        self.world = world = World(gravity=GRAVITY, timestep=drop.step)
        floor = (world.add_plane(None, (0, 0, 0), (0, 0, 1)) if drop.flat
                 else world.add_box(None, FLOOR, (0.0, 0.0, -FLOOR[2])))  # fmt: skip
        pit = [floor, *(world.add_plane(None, point, inward) for point, inward in WALLS)]
        made = [self._shape(thing) for thing in drop.things]
        for one, thing in zip(made, drop.things, strict=True):
            world.add_contact(one, pit, drop.pair(thing.material, thing.material))
        for i, j in drop.couples:
            world.add_contact(made[i], made[j], drop.pair(drop.things[i].material, drop.things[j].material))

    def _shape(self, thing: Thing) -> Any:
        world, s = self.world, thing.size
        body = world.add_body(thing.mass, thing.moments, thing.place, thing.velocity, thing.turn, thing.spin)
        if thing.kind == "sphere":
            return world.add_sphere(body, s[0])
        if thing.kind == "capsule":
            return list(world.add_capsule(body, s[0], s[1]))
        if thing.kind == "box":
            return world.add_box(body, s)
        if thing.kind == "cylinder":
            return world.add_cylinder(body, s[0], s[1])
        if thing.kind == "feet":
            corners = (s - thing.least) * np.array(list(product((-1.0, 1.0), repeat=3)))
            return [world.add_sphere(body, thing.least, corner) for corner in corners]
        return world.add_ellipsoid(body, s) if thing.kind == "ellipsoid" else world.add_hull(body, thing.points)

    def step(self) -> None:
        """As `Run.step`."""
        self.world.step()

    def states(self) -> tuple[Array, Array, Array, Array]:
        """As `Run.states`."""
        w = self.world
        return w.position, w.quaternion, w.velocity, w.spin

    def contacts(self) -> list[Met]:
        """As `Run.contacts`."""
        rows = self.world.contacts
        forces = np.abs((rows["force"] * rows["normal"]).sum(1))
        return [(float(x), float(p), tuple(both.tolist()))
                for x, p, both in zip(rows["overlap"], forces, rows["bodies"], strict=True)]  # fmt: skip


def mjcf(drop: Drop) -> str:
    """The drop as a model of MuJoCo."""
    floor = ('<geom name="floor" type="plane" size="1 1 1"/>' if drop.flat else
             f'<geom name="floor" type="box" size="{_text(FLOOR)}" pos="0 0 {-FLOOR[2]}"/>')  # fmt: skip
    walls = "".join(f'<geom name="wall{k}" type="plane" size="1 1 1" pos="{_text(point)}" zaxis="{_text(inward)}"/>'
                    for k, (point, inward) in enumerate(WALLS))  # fmt: skip
    assets, bodies = "", ""
    for k, thing in enumerate(drop.things):
        shape = f'type="{thing.kind}" size="{_text(thing.size)}"'
        if thing.kind == "hull":
            assets += f'<mesh name="mesh{k}" vertex="{_text(thing.points.ravel())}"/>'
            shape = f'type="mesh" mesh="mesh{k}"'
        heavy = f'<inertial pos="0 0 0" mass="{float(thing.mass)!r}" diaginertia="{_text(thing.moments)}"/>'
        bodies += (f'<body pos="{_text(thing.place)}" quat="{_text(thing.turn)}"><freejoint/>{heavy}'
                   f'<geom name="thing{k}" {shape}/></body>')  # fmt: skip
    return (f'<mujoco><compiler inertiafromgeom="false" boundmass="0" boundinertia="0"/><option timestep="{drop.step}" '
            f'integrator="{drop.integrator}"/><asset>{assets}</asset><worldbody>{floor}{walls}{bodies}</worldbody>'
            "</mujoco>")  # fmt: skip


def _text(numbers: Any) -> str:
    return " ".join(repr(float(x)) for x in numbers)


class InMujoco(Run):
    """By the plugin."""

    def __init__(self, drop: Drop) -> None:
        import mujoco

        from contactlaw.mujoco_plugin import instances_of, load_model

        super().__init__(drop)
        walls = ["floor", *(f"wall{k}" for k in range(len(WALLS)))]
        contacts: list[Any] = [([f"thing{k}"], walls, drop.pair(thing.material, thing.material))
                               for k, thing in enumerate(drop.things)]  # fmt: skip
        contacts += [([f"thing{i}"], [f"thing{j}"], drop.pair(drop.things[i].material, drop.things[j].material))
                     for i, j in drop.couples]  # fmt: skip
        self.model = load_model(mjcf(drop), contacts)
        self.data = mujoco.MjData(self.model)
        self.advance, self.names = mujoco.mj_step, instances_of(self.model)
        for k, thing in enumerate(drop.things):
            self.data.qvel[6 * k : 6 * k + 6] = *thing.velocity, *(matrix(thing.turn).T @ thing.spin)
        mujoco.mj_forward(self.model, self.data)

    def step(self) -> None:
        """As `Run.step`."""
        self.advance(self.model, self.data)

    def states(self) -> tuple[Array, Array, Array, Array]:
        """As `Run.states`."""
        from sims.worlds.mujoco_world import true_velocity

        q, v = self.data.qpos.reshape(-1, 7), true_velocity(self.model, self.data).reshape(-1, 6)
        spins = np.array([matrix(turn) @ spin for turn, spin in zip(q[:, 3:], v[:, 3:], strict=True)])
        return q[:, :3].copy(), q[:, 3:].copy(), v[:, :3], spins

    def contacts(self) -> list[Met]:
        """As `Run.contacts`."""
        from contactlaw.mujoco_plugin import contacts_of

        met = [one for name in self.names for one in contacts_of(self.model, self.data, name)]
        owner = self.model.geom_bodyid
        return [(one.overlap, one.normal_force, (owner[one.geom1] - 1, owner[one.geom2] - 1)) for one in met]


class InPybullet(Run):
    """By the callback."""

    def __init__(self, drop: Drop) -> None:
        import pybullet as p

        from contactlaw.pybullet_callback import ContactCallback
        from sims.worlds.parts import onto

        super().__init__(drop)
        self.p, self.client = p, p.connect(p.DIRECT)
        own: dict[str, Any] = {"physicsClientId": self.client}
        p.setPhysicsEngineParameter(fixedTimeStep=drop.step, **own)
        p.setGravity(0.0, 0.0, -GRAVITY, **own)
        plane = p.createCollisionShape(p.GEOM_PLANE, **own)
        pit = [p.createMultiBody(0.0, plane, -1, point.tolist(), _quaternion(onto(inward)), **own)
               for point, inward in WALLS]  # fmt: skip
        if drop.flat:
            pit.append(p.createMultiBody(0.0, plane, **own))
        else:
            box = p.createCollisionShape(p.GEOM_BOX, halfExtents=FLOOR, **own)
            pit.append(p.createMultiBody(0.0, box, -1, (0.0, 0.0, -FLOOR[2]), **own))
        self.bodies = [self._body(thing, own) for thing in drop.things]
        self.callback = ContactCallback(self.client, fixed_bodies_move=False)
        self.handles = [self.callback.add_contact(body, pit, drop.pair(thing.material, thing.material))
                        for body, thing in zip(self.bodies, drop.things, strict=True)]  # fmt: skip
        self.handles += [
            self.callback.add_contact(self.bodies[i], self.bodies[j],
                                      drop.pair(drop.things[i].material, drop.things[j].material))
            for i, j in drop.couples
        ]  # fmt: skip

    def _body(self, thing: Thing, own: dict[str, Any]) -> int:
        p, s = self.p, thing.size.tolist()
        if thing.kind == "sphere":
            shape = p.createCollisionShape(p.GEOM_SPHERE, radius=s[0], **own)
        elif thing.kind in ("capsule", "cylinder"):
            kind = p.GEOM_CAPSULE if thing.kind == "capsule" else p.GEOM_CYLINDER
            shape = p.createCollisionShape(kind, radius=s[0], height=2.0 * s[1], **own)
        elif thing.kind == "box":
            shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=s, **own)
        else:
            shape = p.createCollisionShape(p.GEOM_MESH, vertices=thing.points.tolist(), **own)
        body = p.createMultiBody(thing.mass, shape, -1, thing.place.tolist(), np.roll(thing.turn, -1).tolist(), **own)
        p.changeDynamics(body, -1, localInertiaDiagonal=thing.moments.tolist(), linearDamping=0.0, angularDamping=0.0,
                         maxJointVelocity=1e12, **own)  # fmt: skip
        before = thing.velocity + [0.0, 0.0, 0.5 * self.drop.step * GRAVITY]
        p.resetBaseVelocity(body, before.tolist(), thing.spin.tolist(), self.client)
        return body

    def step(self) -> None:
        """As `Run.step`."""
        self.callback.step()

    def states(self) -> tuple[Array, Array, Array, Array]:
        """As `Run.states`."""
        p, out = self.p, []
        pressed = {side[0] for handle in self.handles for one in self.callback.states(handle) if one.overlap > 0.0
                   for side in (one.a, one.b)} if self.callback is not None else set()  # fmt: skip
        for body in self.bodies:
            place, turn = p.getBasePositionAndOrientation(body, self.client)
            velocity, spin = p.getBaseVelocity(body, self.client)
            behind = 0.0 if body in pressed else 0.5 * self.drop.step * GRAVITY
            out.append((place, np.roll(turn, 1), (*velocity[:2], velocity[2] - behind), spin))
        one, two, three, four = (np.array(part) for part in zip(*out, strict=True))
        return one, two, three, four

    def contacts(self) -> list[Met]:
        """As `Run.contacts`."""
        met = [one for handle in self.handles for one in self.callback.states(handle)]
        number = {body: k for k, body in enumerate(self.bodies)}
        return [(one.overlap, one.normal_force, (number.get(one.a[0], -1), number.get(one.b[0], -1))) for one in met]

    def close(self) -> None:
        """As `Run.close`."""
        self.p.disconnect(self.client)


def _quaternion(turn: Array) -> list[float]:
    from sims.worlds.parts import matrix_to_quaternion

    return np.roll(matrix_to_quaternion(turn), -1).tolist()


ENGINES: dict[str, type[Run]] = {"none": InWorld, "mujoco": InMujoco, "pybullet": InPybullet}


@dataclass
class Verdict:
    """Of a run: what is wrong in words, if anything; greatest gain and overlap, over what is allowed; time to rest."""

    wrong: list[str]
    gain: float
    depth: float
    rest: float
    cpu: float


def judge(engine: str, drop: Drop) -> Verdict:
    """Run a drop until it rests.

    Energy is asked at moments when contacts hold hardly any; what that of a thing changes by while nothing touches it
    is the engine's own flight, and counts for nothing. Without friction nothing need come to rest.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = ENGINES[engine](drop)
        try:
            return _judge(run, drop)
        finally:
            run.close()


def _judge(run: Run, drop: Drop) -> Verdict:
    scale, deepest, wrong = drop.energy, drop.deepest(), []
    start, begun = run.look(), process_time()
    best, before = start.energy.sum(), start.energy
    gain = depth = 0.0
    quiet, rest, touched = 0, np.inf, start.touched
    for number in range(round(LONGEST / drop.step)):
        run.step()
        now = run.look()
        energy = float(now.energy.sum())
        if not np.isfinite(energy):
            wrong.append("not finite")
            break
        best += float((now.energy - before)[~now.touched & ~touched].sum())
        before, touched = now.energy, now.touched
        gain = max(gain, energy - best)
        if now.held < LIGHT * scale:
            best = min(best, energy + now.held)
        depth = max(depth, now.overlap, run.sunk())
        still = now.touched.all() and now.linear < STILL * scale
        quiet = quiet + 1 if still else 0
        if quiet * drop.step > 0.1:
            rest = number * drop.step
            break
        if process_time() - begun > PATIENCE:
            wrong.append(f"takes more than {PATIENCE:g} s")
            break
        if gain > scale:
            break
    places, _, velocities, _ = run.states()
    if gain > GAIN * scale:
        wrong.append(f"gains {gain / scale:.1e}")
    if depth > DEEPER * deepest:
        wrong.append(f"overlaps by {depth / deepest:.2g} of what holds its energy")
    if np.abs(places[:, :2]).max() > WALL or places[:, 2].min() < 0.0:
        wrong.append("went through")
    if rest == np.inf and drop.slows and not wrong:
        wrong.append(f"moves after {LONGEST:g} s, fastest {np.abs(velocities).max():.2g} m/s")
    return Verdict(wrong, gain / scale, depth / deepest, rest, process_time() - begun)
