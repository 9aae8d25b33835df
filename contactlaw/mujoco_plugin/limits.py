"""Joint limits that the engine has found reached: soft ones, which act in the world as they do in the engine.

The force of such a constraint is f = D (a_ref - a), never less than zero, with a_ref = -B dr/dt - K I r, where r < 0 is
how far the joint is beyond its limit and a the acceleration of r (MuJoCo documentation, Computation, "Constraint
model"). As a = a_0 + A f, A = (M^-1)_kk, it changes by -D/(1 + D A) (K I dr + B d(dr/dt) + da_0). Held instead, it
would go on against what a contact has turned back within the step, and give way to what strikes a joint at its stop. A
limit that is reached behind a contact acts from the engine's next step on, as it does there.
"""

from __future__ import annotations

from numba import types

from contactlaw.memory import load_int
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.free import jit
from contactlaw.mujoco_plugin.memory import entry, field, floats, place
from contactlaw.world.access import axis_at, body_at, tree_at, world_at
from contactlaw.world.call import call_with_body
from contactlaw.world.records import SLIDE
from contactlaw.world.tree_dynamics import ascend, descend, mobility_along
from contactlaw.world.tree_kinematics import vector
from contactlaw.world.trees import copy

KIND, JOINT, BEYOND, MARGIN, REFERENCE, WEIGHT, FORCE = (
    layout.DATA[name] for name in ("efc_type", "efc_id", "efc_pos", "efc_margin", "efc_KBIP", "efc_D", "efc_force")
)
TYPE, DOF, COORDINATE, RANGE = (layout.MODEL[name] for name in ("jnt_type", "jnt_dofadr", "jnt_qposadr", "jnt_range"))
EQUALITIES, FRICTIONS, LIMITS, JOINT_LIMIT = layout.EQUALITIES, layout.FRICTIONS, layout.LIMITS, layout.JOINT_LIMIT


@jit
def hand_over_limits(m, d, head, j, t):
    """Let the limits of a tree go with its coordinates and velocities, for a step whose other forces are known."""
    first = load_int(d + types.uintp(EQUALITIES)) + load_int(d + types.uintp(FRICTIONS))
    some, n = False, t.v_size
    answer, factor = vector(t.room, n), vector(t.factor, (n, n))
    copy(floats(head.given, j.v, n), answer)
    descend(t, factor, answer, n - 1, True)
    ascend(t, factor, answer)
    for row in range(first, first + load_int(d + types.uintp(LIMITS))):
        if entry(d, KIND, row) == JOINT_LIMIT and entry(m, TYPE, entry(d, JOINT, row)) >= SLIDE:
            some = hand_over(m, d, head, j, row) or some
    if some:
        t.stale = 1
        call_with_body(t.settle, body_at(t.bodies, 0))


@jit
def hand_over(m, d, head, j, row):
    """The same for one limit; returns whether it is one of a hinge or slide of the tree."""
    t = tree_at(world_at(head.world, 0).trees, j.tree)
    answer = vector(t.room, t.v_size)
    joint = entry(d, JOINT, row)
    k = entry(m, DOF, joint) - j.v
    force = field(d, FORCE, row, 1)[0]
    if k < 0 or k >= t.v_size or force <= 0.0:
        return False
    axis = axis_at(t.axes, k)
    asked = place(head.starts, (1 + head.nq + head.nv) * head.turn + 1)
    q, v = floats(asked, entry(m, COORDINATE, joint), 1)[0], floats(asked, head.nq + j.v + k, 1)[0]
    beyond, ends = field(d, BEYOND, row, 1)[0], field(m, RANGE, 2 * joint, 2)
    r = beyond - field(d, MARGIN, row, 1)[0]
    side = 1.0 if abs(q - ends[0] - beyond) < abs(ends[1] - q - beyond) else -1.0
    reference, weight = field(d, REFERENCE, 4 * row, 3), field(d, WEIGHT, row, 1)[0]
    weight /= 1.0 + weight * mobility_along(t, k)
    axis.side, axis.coordinate, axis.weight = side, entry(m, COORDINATE, joint) - j.q, weight
    axis.edge = side * q - r
    axis.stiffness, axis.resistance = weight * reference[0] * reference[2], weight * reference[1]
    axis.hold = force + axis.stiffness * r + axis.resistance * side * v + weight * side * answer[k]
    vector(t.f, t.v_size)[k] -= side * force
    return True
