"""One impact: in scaled variables (`rebound`), in SI units (`collide`), and the force along a prescribed path."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, copysign, inf, isfinite, isinf, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks
from contactlaw.kernels import contact, oscillator, paths
from contactlaw.kernels import rebound as kernel
from contactlaw.laws import Law, Microslip, law_of
from contactlaw.pair import ContactPair, half_line_nodes, warn_of_depth

Array = NDArray[np.float64]

LINE = (0.0, 0.0, 1.0)  # motion along a line asks for some plane; which one does not matter here

# Nodes and steps by chi: the tangential oscillation has sqrt(2 chi) times the normal frequency, and the faster it is
# the finer its traces across the contact.
CHI_BOUNDS = [1.3, 2.2, 5.0, 10.0, 20.0, 40.0]
RESOLUTION = [(16, 128), (16, 160), (32, 256), (64, 360), (64, 512), (128, 720), (128, 1024)]


def rebound(
    psi_1: ArrayLike,
    chi: ArrayLike,
    law: str | Law = "microslip",
    restitution: ArrayLike = 1.0,
    *,
    steps: int | None = None,
) -> float | Array:
    """Scaled tangential velocity of the contact point after an impact.

    Args:
        psi_1: (kappa/mu) V_x/V_z1 before, any sign. The arrays broadcast.
        chi: (kappa/2) m_N/m_T, > 0.
        law: Name in `LAWS`, or a law.
        restitution: e, in (0, 1].
        steps: Steps per impact; None: from chi, 128 to 1024. `coulomb` takes none.

    Returns:
        psi_2 = (kappa/mu) V_x2/V_z1, scaled by the approach speed; a float where all arguments are scalars.
        Largest error of `microslip` at default settings: below 1e-3 for chi from 0.5 to 2, below 5e-3 up to 4.5.

    Raises:
        ValueError: A value outside its range; the message names it.
    """
    rule = law_of(law)
    if steps is not None and not (isinstance(steps, int | np.integer) and not isinstance(steps, bool) and steps >= 4):
        raise ValueError(f"steps = {steps!r}: must be None or an integer >= 4")
    given = {"psi_1": psi_1, "chi": chi, "restitution": restitution}
    if all(isinstance(value, float) for value in given.values()):  # one impact: no time for arrays
        one = float(psi_1), float(chi), float(restitution)  # type: ignore[arg-type]
        return _single(*one, rule, steps)
    arrays = [checks.finite_array(name, value) for name, value in given.items()]
    try:
        psi, c, e = arrays if all(array.ndim == 0 for array in arrays) else np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True))
        raise ValueError(f"{shapes}: must be shapes that broadcast together") from None
    if (c <= 0.0).any():
        raise ValueError(f"chi = {c[c <= 0.0].flat[0]}: must be > 0")
    if ((e <= 0.0) | (e > 1.0)).any():
        raise ValueError(f"restitution = {e[(e <= 0.0) | (e > 1.0)].flat[0]}: must be in (0, 1]")
    if rule.code == contact.COULOMB:
        out = np.sign(psi) * np.maximum(np.abs(psi) - 2.0 * c * (1.0 + e), 0.0)
    else:
        out = _grouped(psi.ravel(), c.ravel(), e.ravel(), rule, steps).reshape(psi.shape)
    return out if psi.ndim else float(out)


def _single(psi_1: float, chi: float, restitution: float, law: Law, steps: int | None) -> float:
    """One impact."""
    if not isfinite(psi_1):
        raise ValueError(f"psi_1: holds {psi_1}; every value must be finite")
    if not 0.0 < chi < inf:
        raise ValueError(f"chi = {chi}: must be finite and > 0")
    if not 0.0 < restitution <= 1.0:
        raise ValueError(f"restitution = {restitution}: must be in (0, 1]")
    if law.code == contact.COULOMB:
        return copysign(max(abs(psi_1) - 2.0 * chi * (1.0 + restitution), 0.0), psi_1)
    chi_class = bisect_left(CHI_BOUNDS, chi)
    return float(_group(np.array([psi_1]), np.array([chi]), restitution, chi_class, law, steps)[0])


def _grouped(psi: Array, chi: Array, e: Array, law: Law, steps: int | None) -> Array:
    """Divide the impacts into groups that share their tables."""
    out = np.empty(psi.size)
    classes = np.searchsorted(CHI_BOUNDS, chi)
    for number in np.flatnonzero(np.bincount(classes)):
        in_class = np.flatnonzero(classes == number)
        for restitution in np.unique(e[in_class]):
            chosen = in_class[e[in_class] == restitution]
            out[chosen] = _group(psi[chosen], chi[chosen], float(restitution), int(number), law, steps)
    return out


def _group(psi: Array, chi: Array, restitution: float, chi_class: int, law: Law, steps: int | None) -> Array:
    """psi_2 of impacts with one restitution and one resolution."""
    nodes, default_steps = RESOLUTION[chi_class]
    count = steps or default_steps
    _check_steps(count, float(chi.max()))
    zeta, out = _damping_ratio(restitution), np.empty(psi.size)
    if isinstance(law, Microslip):
        rebound_microslip: Any = kernel.rebound_microslip
        rebound_microslip(psi, chi, zeta, *_microslip_tables(zeta, count, law.node_count or nodes), out)
    else:
        linear, rescaled = law.code == contact.LINEAR_SPRING, law.code == contact.MINDLIN_RESCALED
        theta, delta, _, _, v_mid, dt = _normal_table(zeta, count, linear)
        kernel.rebound_single_spring(psi, chi, zeta, linear, rescaled, theta, delta, v_mid, dt, out)
    return out


def _check_steps(steps: int, chi: float) -> None:
    needed = ceil(contact.STABLE_STEPS * sqrt(chi))
    if steps < needed:
        raise ValueError(f"chi = {chi:g}: needs steps >= {needed} to be stable, and several times that to be exact")


_damping_ratio = lru_cache(maxsize=256)(oscillator.damping_ratio)


@lru_cache(maxsize=64)
def _normal_table(zeta: float, steps: int, linear: bool) -> tuple[Array, ...]:
    return kernel.normal_table(zeta, steps, linear)


@lru_cache(maxsize=64)
def _microslip_tables(zeta: float, steps: int, nodes: int) -> tuple[Array, ...]:
    """Arguments of the kernel between zeta and the output."""
    theta, delta, _, _, v_mid, dt = _normal_table(zeta, steps, False)
    x, w = half_line_nodes(nodes)
    span = sqrt(float(delta.max()))
    x, w = x * span, 1.5 * w * span
    return x, w, theta, delta, v_mid, dt, *kernel.node_table(delta, x, w)


@dataclass(frozen=True, eq=False)
class Body:
    """A body in an impact: its centre of mass lies on the contact normal (a ball, or a puck cut from one).

    Attributes:
        mass: [kg]; inf: held fast.
        radius: Distance from the centre of mass to the contact [m]; inf: a plane.
        inertia: Moment of inertia about the axes across the normal [kg m^2]; None: a solid ball, 2/5 M R^2.
        velocity: Of the centre of mass [m/s], shape (3,).
        spin: Angular velocity [rad/s], shape (3,).
    """

    mass: float = inf
    radius: float = inf
    inertia: float | None = None
    velocity: ArrayLike = (0.0, 0.0, 0.0)
    spin: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("mass", "radius"):
            value = checks.number(name, getattr(self, name), "> 0 (inf: a fixed body, a plane)", low=0.0, high=inf,
                                  open_low=True)  # fmt: skip
            object.__setattr__(self, name, value)
        if isinf(self.radius) and not isinf(self.mass):
            raise ValueError(f"radius = {self.radius!r}: a body of mass {self.mass!r} needs a finite radius")
        if self.inertia is not None:
            object.__setattr__(self, "inertia", checks.positive("inertia", self.inertia))
        for name in ("velocity", "spin"):
            object.__setattr__(self, name, checks.vector(name, getattr(self, name)).copy())

    @property
    def inverse_mass(self) -> float:
        """1/M [1/kg]."""
        return 1.0 / self.mass

    @property
    def inverse_inertia(self) -> float:
        """1/I [1/(kg m^2)]."""
        if isinf(self.mass):
            return 0.0
        return 1.0 / (0.4 * self.mass * self.radius**2 if self.inertia is None else self.inertia)


@dataclass(frozen=True, eq=False)
class Impact:
    """What an impact did. Times run from the touch; the last row is the end of contact.

    Attributes:
        velocity_a, spin_a, velocity_b, spin_b: After the impact, shape (3,), [m/s], [rad/s].
        chi, psi_1, psi_2: Scaled parameters; psi_1 >= 0 by choice of direction, psi_2 along it. NaN without friction.
        time: [s], shape (n,).
        overlap: [m], shape (n,).
        normal_force: [N], shape (n,).
        tangential_force: On A, in the world frame [N], shape (n, 3).
        kinetic: Kinetic energy of the relative motion at the contact [J], shape (n,).
        elastic_normal, elastic_tangential: Stored energy [J], shape (n,).
        friction_loss, damping_loss: Dissipated so far [J], shape (n,); the five sum to the first kinetic energy up to
            the error of the steps.
    """

    velocity_a: Array
    spin_a: Array
    velocity_b: Array
    spin_b: Array
    chi: float
    psi_1: float
    psi_2: float
    time: Array
    overlap: Array
    normal_force: Array
    tangential_force: Array
    kinetic: Array
    elastic_normal: Array
    elastic_tangential: Array
    friction_loss: Array
    damping_loss: Array


def collide(
    pair: ContactPair, a: Body, b: Body | None = None, *, normal: ArrayLike = (0.0, 0.0, 1.0), steps: int = 400
) -> Impact:
    """One impact of two bodies in SI units.

    Args:
        pair: The contact; its radius, where None, comes from the radii of the bodies.
        a, b: The bodies; b None: a plane held fast.
        normal: Unit vector from B to A.
        steps: Steps per contact.

    Returns:
        Velocities after, force history and energy ledger. The restitution is exact; the error in psi_2 of `microslip`
        falls with the square of 1/steps, to 2e-4 at 400 steps and 16 nodes (chi about 1.4).

    Raises:
        ValueError: The bodies do not approach, or a value is outside its range.
    """
    b = Body() if b is None else b
    n = checks.unit_vector("normal", normal)
    if not (isinstance(steps, int | np.integer) and steps >= 4):
        raise ValueError(f"steps = {steps!r}: must be an integer >= 4")
    arms = [0.0 if isinf(body.radius) else body.radius for body in (a, b)]
    v_a, w_a, v_b, w_b = (np.asarray(x, dtype=np.float64) for x in (a.velocity, a.spin, b.velocity, b.spin))
    relative: Array = v_a - v_b - np.cross(arms[0] * w_a + arms[1] * w_b, n)
    approach = -float(relative @ n)
    if approach <= 0.0:
        raise ValueError(f"velocity: the bodies part at {-approach!r} m/s along the normal; they must approach")
    inverse_normal = a.inverse_mass + b.inverse_mass
    if inverse_normal == 0.0:
        raise ValueError("mass: both bodies are held fast; at least one must be finite")
    mass = 1.0 / inverse_normal
    tangential_mass = 1.0 / (inverse_normal + arms[0] ** 2 * a.inverse_inertia + arms[1] ** 2 * b.inverse_inertia)
    radius = pair.radius if pair.radius is not None else 1.0 / (1.0 / a.radius + 1.0 / b.radius)

    sliding = relative + approach * n
    speed = float(np.linalg.norm(sliding))
    along: Array = sliding / speed if speed > 0.0 else _any_tangent(n)
    chi = pair.chi(mass, tangential_mass)
    _check_steps(int(steps), chi)
    nodes = RESOLUTION[bisect_left(CHI_BOUNDS, chi)][0]
    p, history = pair.parameters(radius, LINE, nodes), pair.history(planar=True, nodes=nodes)
    motion = _normal_motion(pair, p, mass, approach, steps)
    history[contact.SCALE] = motion.scale
    warn_of_depth(float(motion.overlap.max()), float(p[contact.RADIUS]))
    pull, elastic, slide = np.zeros(steps + 1), np.zeros(steps + 1), np.empty(steps)
    after = paths.collide(
        p, tangential_mass, speed, motion.overlap, motion.force, motion.ratio, motion.impulse, motion.dt, history,
        pull, slide, elastic,
    )  # fmt: skip

    impulse = mass * approach * (1.0 + pair.restitution) * n + tangential_mass * (after - speed) * along
    turn = np.asarray(np.cross(n, impulse), dtype=np.float64)
    scale = pair.kappa / (pair.friction * approach) if pair.friction > 0.0 else np.nan
    work = np.concatenate([[0.0], np.cumsum(0.5 * (pull[1:] + pull[:-1]) * slide)])
    kinetic = 0.5 * mass * motion.speed**2
    return Impact(
        velocity_a=v_a + impulse * a.inverse_mass,
        spin_a=w_a - arms[0] * a.inverse_inertia * turn,
        velocity_b=v_b - impulse * b.inverse_mass,
        spin_b=w_b - arms[1] * b.inverse_inertia * turn,
        chi=chi,
        psi_1=scale * speed,
        psi_2=scale * after,
        time=np.concatenate([[0.0], np.cumsum(motion.dt)]),
        overlap=motion.overlap,
        normal_force=motion.force,
        tangential_force=-pull[:, None] * along,
        kinetic=kinetic + 0.5 * tangential_mass * _at_instants(slide / motion.dt, speed, after) ** 2,
        elastic_normal=motion.elastic,
        elastic_tangential=elastic,
        friction_loss=work - elastic,
        damping_loss=kinetic[0] - kinetic - motion.elastic,
    )


def _at_instants(mid_step: Array, first: float, last: float) -> Array:
    """Velocities at the ends of steps from those in their middles."""
    return np.concatenate([[first], 0.5 * (mid_step[1:] + mid_step[:-1]), [last]])


@dataclass(frozen=True)
class _NormalMotion:
    """Normal motion of an impact in SI units at equal phases, shape (steps + 1,); dt between, shape (steps,)."""

    overlap: Array
    force: Array
    ratio: Array
    impulse: Array
    speed: Array
    elastic: Array
    dt: Array
    scale: float


def _normal_motion(pair: ContactPair, p: Array, mass: float, approach: float, steps: int) -> _NormalMotion:
    zeta, linear = float(p[contact.ZETA]), law_of(pair.law).code == contact.LINEAR_SPRING
    theta, delta, force, ratio, v_mid, dt = _normal_table(zeta, steps, linear)
    k = contact.hertz_stiffness(p)
    speed = np.array([oscillator.phase_point(phase, zeta)[1] for phase in theta])
    deepest = contact.greatest_overlap(k, mass, 0.0, approach)
    if linear:
        stiffness = contact.LINEAR_STIFFNESS * k * sqrt(deepest)
        length, scale = approach * sqrt(mass / stiffness), stiffness
        elastic = 0.5 * stiffness * (length * delta) ** 2
    else:
        length = deepest / 1.25**0.4
        scale = sqrt(p[contact.RADIUS] * length * float(delta.max()))
        elastic = 0.4 * k * (length * delta) ** 2.5
    if zeta > 0.0:  # the last overlap is still elastic energy, but no force is left to return it to the motion
        elastic = np.where(theta == theta[-1], 0.0, elastic)
    return _NormalMotion(
        overlap=length * delta,
        force=mass * approach**2 / length * force,
        ratio=ratio,
        impulse=-mass * approach * np.diff(np.concatenate([[1.0], v_mid, [speed[-1]]])),
        speed=approach * speed,
        elastic=elastic,
        dt=length / approach * dt,
        scale=scale,
    )


def force_along_path(pair: ContactPair, approach: ArrayLike, displacement: ArrayLike) -> tuple[Array, Array]:
    """Forces of a contact moved slowly along a prescribed path.

    The path starts where the bodies touch, goes straight from point to point, and may leave and touch again.

    Args:
        pair: The contact, with a radius and restitution 1.
        approach: Overlap at each point [m], shape (n,); below zero: apart.
        displacement: Tangential displacement of A relative to B [m], shape (n,) along a line or (n, 2) in the plane;
            counted from its first point.

    Returns:
        Normal force [N], shape (n,), and tangential force [N], shaped as the displacement, positive along a first
        positive displacement (it is the force that moves A; friction on A is its negative). Segments are divided
        into at most 4096 parts, 256 to the greatest overlap. `linear_spring` takes its stiffness from that overlap.

    Raises:
        ValueError: Shapes that do not match, values not finite, no radius, or restitution below 1 (a slow path has no
            rate for the damper to act on).
    """
    if pair.restitution < 1.0:
        raise ValueError(f"restitution = {pair.restitution!r}: must be 1 here, a prescribed slow path has no rate")
    overlap, motion = checks.finite_array("approach", approach), checks.finite_array("displacement", displacement)
    if overlap.ndim != 1 or overlap.size == 0:
        raise ValueError(f"approach: shape {overlap.shape}; must be (n,) with n >= 1")
    if motion.shape not in (overlap.shape, (overlap.size, 2)):
        raise ValueError(
            f"displacement: shape {motion.shape}; must be ({overlap.size},) or ({overlap.size}, 2) to match approach"
        )
    p = pair.parameters(plane=LINE if motion.ndim == 1 else None)
    warn_of_depth(float(overlap.max()), float(p[contact.RADIUS]))
    line = motion.ndim == 1
    plane = np.column_stack([motion, np.zeros(motion.size)]) if line else np.ascontiguousarray(motion)
    normal, tangential = np.empty(overlap.size), np.empty((overlap.size, 2))
    paths.force_along_path(p, overlap, plane, pair.history(planar=line), normal, tangential)
    return normal, tangential[:, 0].copy() if line else tangential


def _any_tangent(n: Array) -> Array:
    tangent: Array = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))]).astype(np.float64)
    return tangent / float(np.linalg.norm(tangent))
