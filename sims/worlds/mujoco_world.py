"""A world in MuJoCo."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from math import log, pi, sqrt
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from contactlaw import ContactPair, mujoco_plugin
from contactlaw.world.bodies.bounds import IDLE
from sims.scene import NATIVE_DAMPED, Settings
from sims.worlds.parts import Array, Body, State, Tuning, matrix_to_quaternion, onto
from sims.worlds.world import World

FAR_OFF = 8.0  # distance of the camera, over how far the bodies reach
GEOMS = {
    "plane": mujoco.mjtGeom.mjGEOM_PLANE,
    "ball": mujoco.mjtGeom.mjGEOM_SPHERE,
    "disc": mujoco.mjtGeom.mjGEOM_SPHERE,  # round where it touches
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "hull": mujoco.mjtGeom.mjGEOM_MESH,
}
HEAVY = 1e9  # armature of a driven body [kg]: nothing that hits it changes its motion
STEPS_A_NATIVE_CONTACT = 10  # a stiffer contact than MuJoCo's solver resolves gains energy


class EngineWorld(World):
    """World in MuJoCo."""

    def __init__(self, settings: Settings, gravity: ArrayLike, tuning: Tuning) -> None:
        super().__init__(settings, gravity, tuning)
        self.spec = mujoco.MjSpec()
        self.spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{tuning.integrator.upper()}")
        self._collide = int(tuning.collide)
        self.contacts: list[str] = []
        """Names of the contacts by the law."""
        self.model: Any = None
        self.spec.option.timestep = self.timestep
        self.spec.option.gravity = self.gravity
        self._masses: dict[str, float] = {}
        self._window: Any = None

    def _make_body(self, body: Body) -> None:
        made = self.spec.worldbody.add_body(
            name=body.name, pos=body.position, quat=matrix_to_quaternion(body.rotation), explicitinertial=True
        )
        made.mass, made.inertia = (body.mass, body.inertia) if body.path is None else (1.0, [1.0] * 3)
        made.ipos, made.iquat = [0.0] * 3, [1.0, 0.0, 0.0, 0.0]
        if body.path is None:
            made.add_freejoint()
        else:
            for axis in np.eye(3):
                joint = made.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=body.rotation.T @ axis)
                joint.armature = HEAVY
        self._masses[body.name] = body.mass
        self._geom(made, body.name, body.shape, body.size[:1] if body.shape == "disc" else body.size)

    def _geom(self, owner: Any, name: str, shape: str, size: ArrayLike, **where: Any) -> None:
        three = [*np.asarray(size).tolist(), 0.0, 0.0][:3]
        if shape == "hull":
            where["meshname"] = self.spec.add_mesh(name=name, uservert=np.ravel(size).tolist()).name
        owner.add_geom(
            name=name, type=GEOMS[shape], size=three, contype=self._collide, conaffinity=self._collide, **where
        )

    def _make_plane(self, name: str, point: Array, normal: Array) -> None:
        where = {"pos": point, "quat": matrix_to_quaternion(onto(normal))}
        self._geom(self.spec.worldbody, name, "plane", [5.0, 5.0, 0.1], **where)

    def _make_fixed(self, name: str, shape: str, size: Array, position: Array, rotation: Array) -> None:
        self._geom(self.spec.worldbody, name, shape, size, pos=position, quat=matrix_to_quaternion(rotation))

    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair) -> None:
        tuning = self.tuning
        self.contacts.append(
            mujoco_plugin.add_contact(
                self.spec, ones, twos, pair, others=tuning.collide, substeps=tuning.substeps,
                crowd_substeps=tuning.crowd_substeps,
            )
        )  # fmt: skip

    def _make_native(self, friction: float, restitution: float, spring: tuple[float, float] | None) -> None:
        for geom in self.spec.geoms:
            geom.contype = geom.conaffinity = 1
            geom.friction, geom.condim = [friction, 0.0, 0.0], 3
            if spring is not None:
                geom.solref = [-value for value in spring]

    def _touch_natively(self, ones: list[str], twos: list[str], pair: ContactPair, speed: float) -> None:
        """MuJoCo's own contact: as stiff as the law's where the step allows, damped to the restitution.

        Damping by the formula for a linear spring; without such a setting nothing bounces. With an elliptic cone and
        critical tangential damping friction would be right, and restitution wrong.
        """
        rate = -log(pair.restitution)
        mu = pair.friction
        for one, two in {tuple(sorted((a, b))) for a in ones for b in twos if a != b}:
            inverse = sum(1.0 / self._masses.get(name, np.inf) for name in (one, two))
            radii = [body.size[0] for body in self.bodies if body.name in (one, two)]
            sized = ContactPair(
                pair.a, pair.b, mu, radius=pair.radius or 1.0 / sum(1.0 / radius for radius in radii),
                stiffness_ratio=pair.stiffness_ratio,
            )  # fmt: skip
            duration = max(sized.contact_duration(1.0 / inverse, speed), STEPS_A_NATIVE_CONTACT * self.timestep)
            stiffness = (pi / duration) ** 2
            damping = 2.0 * sqrt(stiffness) * rate / sqrt(rate**2 + pi**2)
            made = self.spec.add_pair(
                geomname1=one, geomname2=two, condim=3, friction=[mu, mu, 0.005, 1e-4, 1e-4],
                solref=[-stiffness, -damping], solimp=[0.9999, 0.9999, 1e-3, 0.5, 2.0],
            )  # fmt: skip
            if self.settings.law == NATIVE_DAMPED:
                self.spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
                made.solreffriction = [-stiffness, -2.0 * sqrt(stiffness)]

    def _start(self, states: list[tuple[Array, Array, Array, Array]]) -> None:
        if self.model is None:
            if self.settings.watch:
                self._dress()
            self.model = self.spec.compile()
            if not self.tuning.collide:
                mujoco_plugin.skip_constraints(self.model)
            self.data = mujoco.MjData(self.model)
            self._ids = np.array([self.model.body(body.name).id for body in self.bodies], dtype=int)
            joints = self.model.body_jntadr[self._ids]
            self._places, self._dofs = (
                self.model.jnt_qposadr[joints].tolist(),
                self.model.body_dofadr[self._ids].tolist(),
            )
        else:
            mujoco.mj_resetData(self.model, self.data)
        data = self.data
        for body, at, dof, (position, velocity, spin, turn) in zip(
            self.bodies, self._places, self._dofs, states, strict=True
        ):
            if body.path is None:
                data.qpos[at : at + 3], data.qpos[at + 3 : at + 7] = position, matrix_to_quaternion(turn)
                data.qvel[dof : dof + 3], data.qvel[dof + 3 : dof + 6] = velocity, turn.T @ spin
        mujoco.mj_kinematics(self.model, data)
        data.qvel[:] -= true_velocity(self.model, data) - data.qvel

    def _drive(self, body: Body, position: Array, velocity: Array) -> None:
        number = self.bodies.index(body)
        dof, place = self._dofs[number], self._places[number]
        self.data.qpos[place : place + 3] = position - body.position
        self.data.qvel[dof : dof + 3] = velocity

    def _advance(self, count: int) -> None:
        mujoco.mj_step(self.model, self.data, count)

    def push(self, loads: Array) -> None:
        """As `World.push`; it lasts until the next one."""
        self.data.xfrc_applied[self._ids] = loads

    def place(self, number: int = 0) -> Array:
        """As `World.place`, of a free body."""
        at = self._places[number]
        return self.data.qpos[at : at + 3].copy()

    def _read(self) -> State:
        model, data = self.model, self.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        speeds = true_velocity(model, data)
        turns = data.xmat[self._ids].reshape(-1, 3, 3)
        linear = np.array([speeds[dof : dof + 3] for dof in self._dofs]).reshape(-1, 3)
        spins = [
            turn @ speeds[dof + 3 : dof + 6] if body.path is None else np.zeros(3)
            for body, turn, dof in zip(self.bodies, turns, self._dofs, strict=True)
        ]
        return State(data.xpos[self._ids].copy(), turns.copy(), linear, np.array(spins).reshape(-1, 3))

    def _show(self, middle: Array, reach: float) -> None:
        if self._window is None:
            import mujoco.viewer

            self._window = mujoco.viewer.launch_passive(self.model, self.data, show_left_ui=False, show_right_ui=False)
            camera = self._window.cam
            camera.distance, camera.azimuth, camera.elevation = FAR_OFF * reach, 90.0, -15.0
        self._window.cam.lookat[:] = middle
        self._window.sync()

    def _dress(self) -> None:
        """Add light, and chequers on floors and round bodies, to make motion visible."""
        self.spec.worldbody.add_light(
            pos=[0.0, -1.0, 3.0], dir=[0.2, 0.4, -1.0], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        )
        kinds = mujoco.mjtTexture
        for name, kind, dark, light in (("round", kinds.mjTEXTURE_CUBE, [0.1, 0.25, 0.5], [0.95, 0.95, 0.9]),
                                        ("floor", kinds.mjTEXTURE_2D, [0.6, 0.6, 0.6], [0.7, 0.7, 0.7])):  # fmt: skip
            self.spec.add_texture(
                name=f"chequers of {name}", type=kind, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER, rgb1=dark,
                rgb2=light, width=64, height=64,
            )  # fmt: skip
            material = self.spec.add_material(name=name, texuniform=True, texrepeat=[5.0, 5.0])
            material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = f"chequers of {name}"
        shapes = mujoco.mjtGeom
        for geom in self.spec.geoms:
            if geom.type in (shapes.mjGEOM_SPHERE, shapes.mjGEOM_CAPSULE, shapes.mjGEOM_PLANE):
                geom.material = "floor" if geom.type == shapes.mjGEOM_PLANE else "round"

    def _close(self) -> None:
        if self._window is not None:
            self._window.close()


def true_velocity(model: Any, data: Any) -> Array:
    """Generalised velocities at the time of the coordinates, shape (nv,).

    The engine's velocities are half a step behind, except under Runge-Kutta and for bodies in contact by the law. The
    correction assumes that only gravity acts.
    """
    out = data.qvel.copy()
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 or not model.opt.gravity.any():
        return out
    if data.time == 0.0:  # nothing has been stepped yet
        found = mujoco_plugin.overlaps_of(model, data)
        pairs = [ends for *ends, depth in found if depth > IDLE * model.geom_rbound[ends].max()]
    else:
        contacts = mujoco_plugin.contacts_of(model, data)
        pairs = [(contact.geom1, contact.geom2) for contact in contacts if contact.touching]
    touching = {int(model.geom_bodyid[geom]) for pair in pairs for geom in pair}
    for joint, body in zip(model.jnt_dofadr, model.jnt_bodyid, strict=True):
        if model.body_dofnum[body] == 6 and body not in touching:
            out[joint : joint + 3] += 0.5 * model.opt.timestep * model.opt.gravity
    return out
