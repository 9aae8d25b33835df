"""How the bodies of a model move, read from mjData by compiled code: Jacobians, rates, and what answers a force."""

from __future__ import annotations

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_for
from contactlaw.kernels.scene import (
    ANGULAR,
    ANGULAR_RATE,
    COM,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LINEAR,
    MEAN,
    MEAN_SPIN,
    RATE,
    TREE,
)
from contactlaw.kernels.workspace import numbers, zeros
from contactlaw.memory import doubles_at, load_double, load_int, load_pointer
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import BODY_ID, EASE, LAST_DOF, LIGHTNESS, ROOT, TREE_DOF, TREE_ID, TREE_SIZE

jit = jit_for(layout.KEY)

XIPOS_AT, XIMAT_AT, COM_AT = layout.DATA["xipos"], layout.DATA["ximat"], layout.DATA["subtree_com"]
CDOF_AT, CDOF_DOT_AT, CVEL_AT, QVEL_AT = (layout.DATA[field] for field in ("cdof", "cdof_dot", "cvel", "qvel"))
PASSIVE_AT, APPLIED_AT, ACTUATOR_AT = (layout.DATA[f"qfrc_{kind}"] for kind in ("passive", "applied", "actuator"))
XFRC_AT = layout.DATA["xfrc_applied"]
PARENT_AT, DAMPING_AT, NBODY_AT, TIMESTEP_AT = layout.DOF_PARENTS, layout.DOF_DAMPING, layout.NBODY, layout.TIMESTEP

M_AT, (M_ROWS_AT, M_COUNTS_AT), DISABLED_AT = layout.DATA["M"], layout.M_ROWS, layout.DISABLED
INTEGRATOR_AT, RUNGE_KUTTA, EULER = layout.INTEGRATOR, layout.RUNGE_KUTTA, layout.EULER
NO_DAMPER, NO_EULER_DAMPING = layout.NO_DAMPER, layout.NO_EULER_DAMPING

solve_inertia = types.ExternalFunction(
    "mj_solveM", types.void(types.uintp, types.uintp, types.uintp, types.uintp, types.intc)
)
factor_inertia = types.ExternalFunction("mj_factorM", types.void(types.uintp, types.uintp))
bias_force = types.ExternalFunction("mj_rne", types.void(types.uintp, types.uintp, types.intc, types.uintp))
apply_force = types.ExternalFunction(
    "mj_applyFT",
    types.void(types.uintp, types.uintp, types.uintp, types.uintp, types.uintp, types.intc, types.uintp),
)
actuate = types.ExternalFunction("mj_fwdActuation", types.void(types.uintp, types.uintp))


@jit
def field(d, at, start, size):
    """Entries of a field of mjData, as an array."""
    return carray(doubles_at(load_pointer(d + types.uintp(at)) + types.uintp(8 * start)), size)


@jit
def row(d, at, index, size):
    """Row of a field of mjData, as an array."""
    return field(d, at, size * index, size)


@jit
def parent(m, dof):
    """The degree of freedom before this one in its chain, -1 for none."""
    return load_int(load_pointer(m + types.uintp(PARENT_AT)) + types.uintp(4 * dof))


@jit
def project(m, d, facts, point, force, torque, factor, y_out):
    """Add factor times the generalized force of a force at a point and a torque on a body to y_out (nv)."""
    com = row(d, COM_AT, int(facts[ROOT]), 3)
    x, y, z = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    mx = torque[0] + y * force[2] - z * force[1]
    my = torque[1] + z * force[0] - x * force[2]
    mz = torque[2] + x * force[1] - y * force[0]
    dof = int(facts[LAST_DOF])
    while dof >= 0:
        c = row(d, CDOF_AT, dof, 6)
        turn = c[0] * mx + c[1] * my + c[2] * mz
        y_out[dof] += factor * (turn + c[3] * force[0] + c[4] * force[1] + c[5] * force[2])
        dof = parent(m, dof)


@jit
def add_motion(m, d, facts, point, rates, factor, linear_io, angular_io):
    """Add factor times the motion of a body's point that generalized velocities (nv) make."""
    com = row(d, COM_AT, int(facts[ROOT]), 3)
    x, y, z = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    dof = int(facts[LAST_DOF])
    while dof >= 0:
        c, q = row(d, CDOF_AT, dof, 6), factor * rates[dof]
        angular_io[0] += q * c[0]
        angular_io[1] += q * c[1]
        angular_io[2] += q * c[2]
        linear_io[0] += q * (c[3] + c[1] * z - c[2] * y)
        linear_io[1] += q * (c[4] + c[2] * x - c[0] * z)
        linear_io[2] += q * (c[5] + c[0] * y - c[1] * x)
        dof = parent(m, dof)


@jit
def add_turning(m, d, facts, body_io):
    """Add what the turning of a chain does to the acceleration of its last body: no part of J qacc.

    The sums of cdof_dot are accelerations of what is at the centre of the tree at the moment, not of a point that
    moves with the body; hence the velocity term.
    """
    com = row(d, COM_AT, int(facts[ROOT]), 3)
    x, y, z = body_io[COM] - com[0], body_io[COM + 1] - com[1], body_io[COM + 2] - com[2]
    dof = int(facts[LAST_DOF])
    while dof >= 0:
        c, q = row(d, CDOF_DOT_AT, dof, 6), load_double(load_pointer(d + types.uintp(QVEL_AT)) + types.uintp(8 * dof))
        for i in range(3):
            body_io[ANGULAR_RATE + i] += q * c[i]
        body_io[RATE] += q * (c[3] + c[1] * z - c[2] * y)
        body_io[RATE + 1] += q * (c[4] + c[2] * x - c[0] * z)
        body_io[RATE + 2] += q * (c[5] + c[0] * y - c[1] * x)
        dof = parent(m, dof)
    w, v = body_io[MEAN_SPIN : MEAN_SPIN + 3], body_io[MEAN : MEAN + 3]
    body_io[RATE] += w[1] * v[2] - w[2] * v[1]
    body_io[RATE + 1] += w[2] * v[0] - w[0] * v[2]
    body_io[RATE + 2] += w[0] * v[1] - w[1] * v[0]


@jit
def read_body(d, facts, body_out):
    """A body as the engine has it; its true motion is taken to be the same for now."""
    body_out[TREE] = facts[TREE_ID]
    body_out[INVERSE_MASS:] = 0.0
    if facts[LAST_DOF] < 0.0:
        return
    number = int(facts[BODY_ID])
    place, com, c = row(d, XIPOS_AT, number, 3), row(d, COM_AT, int(facts[ROOT]), 3), row(d, CVEL_AT, number, 6)
    x, y, z = place[0] - com[0], place[1] - com[1], place[2] - com[2]
    for i in range(3):
        body_out[COM + i], body_out[MEAN_SPIN + i] = place[i], c[i]
    body_out[MEAN] = c[3] + c[1] * z - c[2] * y
    body_out[MEAN + 1] = c[4] + c[2] * x - c[0] * z
    body_out[MEAN + 2] = c[5] + c[0] * y - c[1] * x
    for i in range(3):
        body_out[LINEAR + i], body_out[ANGULAR + i] = body_out[MEAN + i], body_out[MEAN_SPIN + i]
    if facts[LIGHTNESS] > 0.0:
        body_out[INVERSE_MASS] = facts[LIGHTNESS]
        turn = row(d, XIMAT_AT, number, 9)
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    body_out[INVERSE_INERTIA + 3 * i + j] += turn[3 * i + k] * facts[EASE + k] * turn[3 * j + k]


@jit
def free_acceleration(m, d, actuated, nv, force_out, rates_out):
    """Generalized acceleration (nv) by all that is known beforehand: not the contacts, limits and constraints."""
    if actuated:
        actuate(m, d)  # at this stage qfrc_actuator still is that of the last step
    bias_force(m, d, 0, types.uintp(force_out.ctypes.data))
    passive, applied = field(d, PASSIVE_AT, 0, nv), field(d, APPLIED_AT, 0, nv)
    for i in range(nv):
        force_out[i] = passive[i] - force_out[i] + applied[i]
    if actuated:
        driven = field(d, ACTUATOR_AT, 0, nv)
        for i in range(nv):
            force_out[i] += driven[i]
    forces, places = load_pointer(d + types.uintp(XFRC_AT)), load_pointer(d + types.uintp(XIPOS_AT))
    for body in range(1, load_int(m + types.uintp(NBODY_AT))):
        for i in range(6):
            at = forces + types.uintp(48 * body)
            if load_double(at + types.uintp(8 * i)) != 0.0:
                apply_force(
                    m, d, at, at + types.uintp(24), places + types.uintp(24 * body), body,
                    types.uintp(force_out.ctypes.data),
                )  # fmt: skip
                break
    solve_inertia(m, d, types.uintp(rates_out.ctypes.data), types.uintp(force_out.ctypes.data), 1)


@jit
def damped(m, nv):
    """Whether the engine's step damps joints implicitly: M + dt D then answers all forces in the place of M."""
    if load_int(m + types.uintp(INTEGRATOR_AT)) == RUNGE_KUTTA:
        return False
    disabled = load_int(m + types.uintp(DISABLED_AT))
    if disabled & NO_DAMPER or (load_int(m + types.uintp(INTEGRATOR_AT)) == EULER and disabled & NO_EULER_DAMPING):
        return False
    damping = carray(doubles_at(load_pointer(m + types.uintp(DAMPING_AT))), nv)
    found = False
    for i in range(nv):
        found = found or damping[i] > 0.0
    return found


@jit
def stiffen(m, d, nv, dt, kept_out):
    """Let `solve_inertia` answer with M + dt D; the diagonal of M is kept, for `relax`."""
    damping, inertia = load_pointer(m + types.uintp(DAMPING_AT)), load_pointer(d + types.uintp(M_AT))
    rows, counts = load_pointer(m + types.uintp(M_ROWS_AT)), load_pointer(m + types.uintp(M_COUNTS_AT))
    for i in range(nv):
        at = types.uintp(4 * i)
        diagonal = carray(doubles_at(inertia + types.uintp(8 * (load_int(rows + at) + load_int(counts + at) - 1))), 1)
        kept_out[i] = diagonal[0]
        diagonal[0] += dt * load_double(damping + types.uintp(8 * i))
    factor_inertia(m, d)


@jit
def relax(m, d, nv, kept):
    """Undo `stiffen`, to the last bit."""
    inertia = load_pointer(d + types.uintp(M_AT))
    rows, counts = load_pointer(m + types.uintp(M_ROWS_AT)), load_pointer(m + types.uintp(M_COUNTS_AT))
    for i in range(nv):
        at = types.uintp(4 * i)
        diagonal = carray(doubles_at(inertia + types.uintp(8 * (load_int(rows + at) + load_int(counts + at) - 1))), 1)
        diagonal[0] = kept[i]
    factor_inertia(m, d)


@jit
def pull_tree(m, d, facts, axis, point, nv, pull_out, answer_out, work_io):
    """Generalized force on a body's tree of a unit force along an axis at a point, and the velocities it causes."""
    force, answer, none = zeros(work_io, nv), numbers(work_io, nv), zeros(work_io, 3)
    project(m, d, facts, point, axis, none, 1.0, force)
    solve_inertia(m, d, types.uintp(answer.ctypes.data), types.uintp(force.ctypes.data), 1)
    first = int(facts[TREE_DOF])
    for i in range(int(facts[TREE_SIZE])):
        pull_out[i], answer_out[i] = force[first + i], answer[first + i]
