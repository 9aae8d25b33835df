"""A world in PyBullet, in a client of its own."""

from math import sqrt
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import ArrayLike

from contactlaw import ContactPair
from contactlaw.pybullet_callback import ContactCallback
from contactlaw.world.bodies.bounds import IDLE
from sims.scene import Settings
from sims.worlds.parts import Array, Body, State, Tuning, matrix_to_quaternion, onto
from sims.worlds.world import World

FAR_OFF = 4.0  # distance of the camera, over how far the bodies reach
ROUND = {"capsule": p.GEOM_CAPSULE, "cylinder": p.GEOM_CYLINDER}


class EngineWorld(World):
    """World in PyBullet."""

    def __init__(self, settings: Settings, gravity: ArrayLike, tuning: Tuning) -> None:
        super().__init__(settings, gravity, tuning)
        self.client = p.connect(p.GUI if settings.watch else p.DIRECT)
        p.setPhysicsEngineParameter(fixedTimeStep=self.timestep, physicsClientId=self.client)
        p.setGravity(*self.gravity.tolist(), physicsClientId=self.client)
        self.ids: dict[str, int] = {}
        self.callback: ContactCallback | None = None
        self._untouched: Any = None
        self._dressed = False
        """Of the contacts by the law."""
        self._pairs: list[tuple[list[str], list[str]]] = []

    def _make_body(self, body: Body) -> None:
        mass = body.mass if body.path is None else 0.0
        made = self._put(body.name, mass, self._shape(body.shape, body.size), body.position, body.rotation)
        if body.path is None:
            p.changeDynamics(
                made, -1, localInertiaDiagonal=list(body.inertia), linearDamping=0.0, angularDamping=0.0,
                maxJointVelocity=1e12, physicsClientId=self.client,
            )  # fmt: skip

    def _shape(self, shape: str, size: ArrayLike) -> int:
        sizes = np.asarray(size, dtype=float).tolist()
        if shape == "box":
            return p.createCollisionShape(p.GEOM_BOX, halfExtents=sizes, physicsClientId=self.client)
        if shape == "hull":
            points = np.reshape(sizes, (-1, 3)).tolist()
            return p.createCollisionShape(p.GEOM_MESH, vertices=points, physicsClientId=self.client)
        if shape in ROUND:
            radius, half = sizes
            return p.createCollisionShape(ROUND[shape], radius=radius, height=2.0 * half, physicsClientId=self.client)
        return p.createCollisionShape(p.GEOM_SPHERE, radius=sizes[0], physicsClientId=self.client)

    def _make_plane(self, name: str, point: Array, normal: Array) -> None:
        self._put(name, 0.0, p.createCollisionShape(p.GEOM_PLANE, physicsClientId=self.client), point, onto(normal))

    def _make_fixed(self, name: str, shape: str, size: Array, position: Array, rotation: Array) -> None:
        self._put(name, 0.0, self._shape(shape, size), position, rotation)

    def _put(self, name: str, mass: float, shape: int, position: Array, rotation: Array) -> int:
        w, x, y, z = matrix_to_quaternion(rotation).tolist()
        made = p.createMultiBody(mass, shape, -1, position.tolist(), [x, y, z, w], physicsClientId=self.client)
        if not self.tuning.collide:
            p.setCollisionFilterGroupMask(made, -1, 0, 0, physicsClientId=self.client)
        self.ids[name] = made
        return made

    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair) -> None:
        driven = any(body.path is not None for body in self.bodies)
        moved = driven if self.tuning.fixed_bodies_move is None else self.tuning.fixed_bodies_move
        self.callback = self.callback or ContactCallback(
            self.client, fixed_bodies_move=moved, crowd_substeps=self.tuning.crowd_substeps
        )
        first, second = ([self.ids[name] for name in names] for names in (ones, twos))
        self._pairs.append((ones, twos))
        self.callback.add_contact(first, second, pair, substeps=self.tuning.substeps, others=self.tuning.collide)

    def _touch_natively(self, ones: list[str], twos: list[str], pair: ContactPair, speed: float) -> None:
        """Bullet's own contact, set to bounce; it multiplies the friction and restitution of two bodies."""
        p.setPhysicsEngineParameter(
            contactERP=0.0, contactSlop=0.0, restitutionVelocityThreshold=0.0, physicsClientId=self.client
        )
        shared = set(ones) & set(twos)
        for name in {*ones, *twos}:
            e, mu = pair.restitution, pair.friction
            if name in shared:
                e, mu = sqrt(e), sqrt(mu)
            elif name in twos:
                e, mu = 1.0, 1.0
            p.changeDynamics(
                self.ids[name], -1, restitution=e, lateralFriction=mu, rollingFriction=0.0, spinningFriction=0.0,
                contactProcessingThreshold=0.0, physicsClientId=self.client,
            )  # fmt: skip
        for one in ones:
            for two in twos:
                if one != two:
                    p.setCollisionFilterPair(self.ids[one], self.ids[two], -1, -1, 1, self.client)

    def _make_native(self, friction: float, restitution: float, spring: tuple[float, float] | None) -> None:
        for name, number in self.ids.items():
            mass = next((body.mass for body in self.bodies if body.name == name), 0.0)
            group, mask = (1, -1) if mass else (2, -1 ^ 2)  # Bullet's own, of bodies that move and of others
            p.setCollisionFilterGroupMask(number, -1, group, mask, physicsClientId=self.client)
            made = {"lateralFriction": sqrt(friction), "restitution": sqrt(restitution)}
            if spring is not None:
                stiffness, damping = (min(body.mass for body in self.bodies) * value for value in spring)
                made = {"lateralFriction": sqrt(friction), "contactStiffness": stiffness, "contactDamping": damping}
            p.changeDynamics(number, -1, **made, physicsClientId=self.client)

    def _start(self, states: list[tuple[Array, Array, Array, Array]]) -> None:
        if self.callback is not None:
            self._untouched = self._untouched or self.callback.save()
            self.callback.restore(self._untouched)
        for body, (position, _, _, turn) in zip(self.bodies, states, strict=True):
            if body.path is None:
                number, (w, x, y, z) = self.ids[body.name], matrix_to_quaternion(turn).tolist()
                p.resetBasePositionAndOrientation(number, position.tolist(), [x, y, z, w], self.client)
        for body, (_, velocity, spin, _) in zip(self.bodies, states, strict=True):
            if body.path is None:
                # The engine's velocity is that of half a step before the position, but where the law has it pressed.
                before = velocity - (0.0 if self._lies(body.name) else 0.5 * self.timestep) * self.gravity
                p.resetBaseVelocity(self.ids[body.name], before.tolist(), spin.tolist(), self.client)

    def _lies(self, name: str) -> bool:
        """Return whether a body is placed in contact with another that it touches by the law."""
        others = {two for ones, twos in self._pairs for two in twos if name in ones}
        others |= {one for ones, twos in self._pairs for one in ones if name in twos}
        number, size = self.ids[name], max(next(body.size for body in self.bodies if body.name == name))
        return any(
            point[8] < -IDLE * size
            for other in others - {name}
            for point in p.getClosestPoints(number, self.ids[other], 0.0, physicsClientId=self.client)
        )

    def _drive(self, body: Body, position: Array, velocity: Array) -> None:
        number = self.ids[body.name]
        x, y, z = position.tolist()
        turn = p.getBasePositionAndOrientation(number, self.client)[1]
        p.resetBasePositionAndOrientation(number, [x, y, z], turn, self.client)
        p.resetBaseVelocity(number, velocity.tolist(), [0.0, 0.0, 0.0], self.client)

    def _advance(self, count: int) -> None:
        if self.callback is None:
            for _ in range(count):
                p.stepSimulation(self.client)
            return
        for _ in range(count):
            self.callback.step()

    def push(self, loads: Array) -> None:
        """As `World.push`."""
        for number, load in enumerate(loads.tolist()):
            body, at = self.ids[self.bodies[number].name], self.place(number).tolist()
            p.applyExternalForce(body, -1, load[:3], at, p.WORLD_FRAME, self.client)
            p.applyExternalTorque(body, -1, load[3:], p.WORLD_FRAME, self.client)

    def place(self, number: int = 0) -> Array:
        """As `World.place`."""
        return np.array(p.getBasePositionAndOrientation(self.ids[self.bodies[number].name], self.client)[0])

    def _read(self) -> State:
        places, turns, speeds, spins = [], [], [], []
        states = self.callback.states() if self.callback else []
        pressed = {side[0] for state in states if state.overlap > 0.0 for side in (state.a, state.b)}
        if self.time == 0.0:
            pressed = {self.ids[body.name] for body in self.bodies if self._lies(body.name)}
        for body in self.bodies:
            number = self.ids[body.name]
            place, turn = p.getBasePositionAndOrientation(number, self.client)
            if body.path is not None:
                h = 0.5 * self.timestep
                place = np.asarray(body.path(self.time))
                speed = (np.asarray(body.path(self.time + h)) - np.asarray(body.path(self.time - h))) / (2.0 * h)
                spin = np.zeros(3)
            else:
                speed, spin = (np.array(one) for one in p.getBaseVelocity(number, self.client))
                if number not in pressed:  # the engine's velocity is that of half a step before the position
                    speed = speed + 0.5 * self.timestep * self.gravity
            places.append(place)
            turns.append(np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3))
            speeds.append(speed)
            spins.append(spin)
        return State(np.array(places), np.array(turns), np.array(speeds), np.array(spins))

    def _show(self, middle: Array, reach: float) -> None:
        if not self._dressed:
            self._dress()
        p.resetDebugVisualizerCamera(FAR_OFF * reach, 0.0, -15.0, middle.tolist(), physicsClientId=self.client)

    def _dress(self) -> None:
        """Hide the panels, and put chequers on round bodies, to make rotation visible."""
        import pybullet_data

        self._dressed = True
        p.configureDebugVisualizer(p.COV_ENABLE_GUI, 0, physicsClientId=self.client)
        file = f"{pybullet_data.getDataPath()}/checker_blue.png"
        chequers = p.loadTexture(file, physicsClientId=self.client)
        for body in self.bodies:
            if body.shape != "box":
                p.changeVisualShape(self.ids[body.name], -1, rgbaColor=[1, 1, 1, 1], textureUniqueId=chequers,
                                    physicsClientId=self.client)  # fmt: skip

    def _close(self) -> None:
        p.disconnect(self.client)
