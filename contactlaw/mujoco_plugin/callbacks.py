"""The compiled callbacks: what MuJoCo calls in every step. No Python runs here."""

from __future__ import annotations

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import c_callback, jit_for
from contactlaw.kernels.contact import AXIS, OPEN, PHASE, PLANAR, PLANE_SLACK, RADIUS, SHARE, longest_step
from contactlaw.kernels.engine import contact_force, tangent
from contactlaw.kernels.geometry import ball_on_ball, ball_on_box, ball_on_plane, nearest_on_segments, place_point
from contactlaw.kernels.memory import call_report, doubles_at, load_double, load_int, load_pointer
from contactlaw.mujoco_plugin import layout
from contactlaw.pair import DEEPEST

# One block of float64 for each plugin instance of each mjData: what `instance` found in the model, then the
# parameters of the pair, room for the new histories, and room to work in. A is the rounder of the two geoms.
(
    REPORT, REPORTED, KIND, SLOTS, HISTORY, PARAMETER_COUNT, NV, TOUCHED, RADIUS_GIVEN, STATE,
    GEOM_A, GEOM_B, BODY_A, BODY_B, ROOT_A, ROOT_B, DOF_A, DOF_B, BALL_A, BALL_B, HALF_A, HALF_B, BOUND, BOX,
) = range(24)  # fmt: skip
PARAMETERS_AT = BOX + 3
WORK = 30  # normal, point, velocity, force, tangents and a direction to project, and the ends of a distance

BALL_ON_BALL, BALL_ON_PLANE, BALL_ON_BOX, ROUND_BARS, ANY_SHAPES = range(5)

TINY = 1e-300
BOTH_ENDS = 2  # slots of a capsule on a plane or box; on a box its side has a third

# What is reported to Python, once for each instance and mjData.
LONG_STEP, DEEP, UNCLEAR_RADIUS, NOT_IN_PLANE = 1, 2, 4, 8

STATE_AT, BLOCKS_AT, XPOS_AT, XMAT_AT, COM_AT, CDOF_AT, CVEL_AT, FORCE_AT = layout.DATA.values()
PARENT_AT = layout.DOF_PARENTS
TIMESTEP_AT = layout.TIMESTEP

jit = jit_for(layout.KEY)

solve_inertia = types.ExternalFunction(
    "mj_solveM", types.void(types.uintp, types.uintp, types.uintp, types.uintp, types.intc)
)
geom_distance = types.ExternalFunction(
    "mj_geomDistance", types.float64(types.uintp, types.uintp, types.intc, types.intc, types.float64, types.uintp)
)
free_memory = types.ExternalFunction("mju_free", types.void(types.uintp))


@jit
def address_of_block(d, instance):
    """Address of the block of an instance."""
    return load_pointer(load_pointer(d + types.uintp(BLOCKS_AT)) + types.uintp(8 * instance))


@jit
def row(d, field, index, size):
    """Row of a field of mjData, as an array."""
    return carray(doubles_at(load_pointer(d + types.uintp(field)) + types.uintp(8 * size * index)), size)


@jit
def part(block, start, size):
    """Some of a block, as an array: block is its address."""
    return carray(doubles_at(block + types.uintp(8 * start)), size)


@jit
def number(block, index):
    """One entry of a block. Free flight reads a few of these and nothing else: arrays would cost more than the test."""
    return load_double(block + types.uintp(8 * index))


@jit
def is_idle(d, block):
    """Whether no contact of an instance is open and the bounds of its geoms are apart."""
    if number(block, TOUCHED) != 0.0:
        return False
    state = load_pointer(d + types.uintp(STATE_AT)) + types.uintp(8 * int(number(block, STATE)))
    size = 8 * int(number(block, HISTORY))
    for slot in range(int(number(block, SLOTS))):
        if load_double(state + types.uintp(8 * PHASE + slot * size)) != OPEN:
            return False
    places = load_pointer(d + types.uintp(XPOS_AT))
    a = places + types.uintp(24 * int(number(block, GEOM_A)))
    geom_b = int(number(block, GEOM_B))
    b = places + types.uintp(24 * geom_b)
    x = load_double(a) - load_double(b)
    y = load_double(a + types.uintp(8)) - load_double(b + types.uintp(8))
    z = load_double(a + types.uintp(16)) - load_double(b + types.uintp(16))
    bound = number(block, BOUND)
    if number(block, KIND) == BALL_ON_PLANE:
        frame = load_pointer(d + types.uintp(XMAT_AT)) + types.uintp(72 * geom_b)
        x *= load_double(frame + types.uintp(16))
        y *= load_double(frame + types.uintp(40))
        z *= load_double(frame + types.uintp(64))
        return x + y + z > bound
    return x * x + y * y + z * z > bound * bound


@jit
def end_of(d, geom, half, side, out):
    """Middle of a ball or of one end of a capsule: half its length along its axis, to the side (+-1)."""
    centre, frame = row(d, XPOS_AT, geom, 3), row(d, XMAT_AT, geom, 9)
    for i in range(3):
        out[i] = centre[i] + side * half * frame[3 * i + 2]


@jit
def locate(m, d, b, slot, n_out, surface_out, work):
    """Overlap [m] of a slot's contact, and whether its radius of curvature is clear there."""
    kind, geom_a, geom_b = int(b[KIND]), int(b[GEOM_A]), int(b[GEOM_B])
    if kind == ANY_SHAPES:
        return locate_any(m, d, b, n_out, surface_out, work), True
    if kind == BALL_ON_BALL:
        a, c = row(d, XPOS_AT, geom_a, 3), row(d, XPOS_AT, geom_b, 3)
        return ball_on_ball(a, b[BALL_A], c, b[BALL_B], n_out, surface_out), True
    if kind == ROUND_BARS:
        return locate_bars(d, b, n_out, surface_out, work)
    if slot == BOTH_ENDS:
        return locate_side(m, d, b, n_out, surface_out, work), False
    return locate_end(d, b, slot, n_out, surface_out, work)


@jit
def locate_end(d, b, slot, n_out, surface_out, work):
    """Ball, or one end of a capsule, on a plane or box."""
    geom_a, geom_b = int(b[GEOM_A]), int(b[GEOM_B])
    a = row(d, XPOS_AT, geom_a, 3)
    if b[HALF_A] != 0.0:
        end_of(d, geom_a, b[HALF_A], 1.0 - 2.0 * slot, work)
        a = work[0:3]
    other, frame = row(d, XPOS_AT, geom_b, 3), row(d, XMAT_AT, geom_b, 9)
    if b[KIND] == BALL_ON_PLANE:
        return ball_on_plane(a, b[BALL_A], other, frame, n_out, surface_out), True
    return ball_on_box(a, b[BALL_A], other, frame, b[BOX : BOX + 3], n_out, surface_out)


@jit
def locate_bars(d, b, n_out, surface_out, work):
    """Capsule on ball or capsule, where their middle lines come nearest; clear where that is at ends alone."""
    geom_a, geom_b = int(b[GEOM_A]), int(b[GEOM_B])
    u, v, a, c = work[0:3], work[3:6], work[6:9], work[9:12]
    frame_a, frame_b = row(d, XMAT_AT, geom_a, 9), row(d, XMAT_AT, geom_b, 9)
    for i in range(3):
        u[i], v[i] = frame_a[3 * i + 2], frame_b[3 * i + 2]
    s, t = nearest_on_segments(row(d, XPOS_AT, geom_a, 3), u, b[HALF_A], row(d, XPOS_AT, geom_b, 3), v, b[HALF_B])
    end_of(d, geom_a, s, 1.0, a)
    end_of(d, geom_b, t, 1.0, c)
    overlap = ball_on_ball(a, b[BALL_A], c, b[BALL_B], n_out, surface_out)
    return overlap, abs(s) == b[HALF_A] and abs(t) == b[HALF_B]


@jit
def locate_side(m, d, b, n_out, surface_out, work):
    """Overlap of the side of a capsule with a box, where neither end touches it."""
    for slot in range(BOTH_ENDS):
        overlap, _ = locate_end(d, b, slot, n_out, surface_out, work)
        if overlap > 0.0:
            return 0.0
    return locate_any(m, d, b, n_out, surface_out, work)


@jit
def locate_any(m, d, b, n_out, surface_out, work):
    """Overlap of any two shapes by the engine's own distance."""
    near = 1.0  # comes back where the shapes are further apart than that; any length will do
    ends = work[12:18]
    apart = geom_distance(m, d, int(b[GEOM_A]), int(b[GEOM_B]), near, types.uintp(ends.ctypes.data))
    if apart >= near or apart == 0.0:
        return 0.0
    for i in range(3):
        n_out[i] = (ends[i] - ends[i + 3]) / apart
        surface_out[i] = ends[i]
    return -apart


@jit
def project(m, d, dof, root, point, vector, sign, y_out):
    """Add sign J^T vector to y_out (nv): J the Jacobian of a point of the body whose last degree of freedom is dof."""
    com = row(d, COM_AT, root, 3)
    x, y, z = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    mx = y * vector[2] - z * vector[1]
    my = z * vector[0] - x * vector[2]
    mz = x * vector[1] - y * vector[0]
    parents = load_pointer(m + types.uintp(PARENT_AT))
    while dof >= 0:
        c = row(d, CDOF_AT, dof, 6)
        turn = c[0] * mx + c[1] * my + c[2] * mz
        y_out[dof] += sign * (turn + c[3] * vector[0] + c[4] * vector[1] + c[5] * vector[2])
        dof = load_int(parents + types.uintp(4 * dof))


@jit
def mobility(m, d, b, point, direction, push_a, push_b, answer):
    """How easily A, B and their contact give way along a direction at a point [1/kg]: J M^-1 J^T of each and both."""
    push_a[:] = 0.0
    push_b[:] = 0.0
    project(m, d, int(b[DOF_A]), int(b[ROOT_A]), point, direction, 1.0, push_a)
    project(m, d, int(b[DOF_B]), int(b[ROOT_B]), point, direction, 1.0, push_b)
    solve_inertia(m, d, types.uintp(answer.ctypes.data), types.uintp(push_a.ctypes.data), 1)
    of_a, of_b, shared = 0.0, 0.0, 0.0
    for i in range(answer.size):
        of_a += answer[i] * push_a[i]
        shared += answer[i] * push_b[i]
    if b[DOF_B] >= 0.0:
        solve_inertia(m, d, types.uintp(answer.ctypes.data), types.uintp(push_b.ctypes.data), 1)
        for i in range(answer.size):
            of_b += answer[i] * push_b[i]
    return of_a, of_b, of_a + of_b - 2.0 * shared


@jit
def effective_masses(m, d, b, p, h, point, n, direction, push_a, push_b, answer):
    """Normal and mean tangential effective mass [kg], and B's share in how easily the contact gives way."""
    sum_a, sum_b, normal = mobility(m, d, b, point, n, push_a, push_b, answer)
    tx, ty, tz = tangent(p, h, n, 0.0)
    direction[0], direction[1], direction[2] = tx, ty, tz
    of_a, of_b, across = mobility(m, d, b, point, direction, push_a, push_b, answer)
    sum_a, sum_b = sum_a + of_a, sum_b + of_b
    if p[PLANAR] == 0.0:
        direction[0], direction[1], direction[2] = n[1] * tz - n[2] * ty, n[2] * tx - n[0] * tz, n[0] * ty - n[1] * tx
        of_a, of_b, other = mobility(m, d, b, point, direction, push_a, push_b, answer)
        sum_a, sum_b, across = sum_a + of_a, sum_b + of_b, 0.5 * (across + other)
    # What cannot move at all along a direction has no finite mass there; no force comes of it either.
    return 1.0 / max(normal, TINY), 1.0 / max(across, TINY), sum_b / max(sum_a + sum_b, TINY)


@jit
def relative_velocity(d, b, point, n, velocity_out):
    """Velocity of A relative to B at a point [m/s] to velocity_out; returns their mean spin about n [rad/s]."""
    velocity_out[:] = 0.0
    spin = 0.0
    for side in range(2):
        if b[DOF_A + side] < 0:
            continue
        sign = 1.0 - 2.0 * side
        com, c = row(d, COM_AT, int(b[ROOT_A + side]), 3), row(d, CVEL_AT, int(b[BODY_A + side]), 6)
        x, y, z = point[0] - com[0], point[1] - com[1], point[2] - com[2]
        velocity_out[0] += sign * (c[3] + c[1] * z - c[2] * y)
        velocity_out[1] += sign * (c[4] + c[2] * x - c[0] * z)
        velocity_out[2] += sign * (c[5] + c[0] * y - c[1] * x)
        spin += 0.5 * (c[0] * n[0] + c[1] * n[1] + c[2] * n[2])
    return spin


@jit
def report(b, instance, code, value):
    """Tell Python, the first time."""
    if int(b[REPORTED]) & code == 0:
        b[REPORTED] += code
        call_report(types.uintp(b[REPORT]), instance, code, value)


@jit
def act(m, d, b, instance, p, h, overlap, clear, n, point, work, push_a, push_b, answer, dt, h_out):
    """One contact: its force to qfrc_passive, its history to h_out. point: the deepest of A's surface."""
    velocity, force = work[0:3], work[3:6]
    touches = h[PHASE] == OPEN and overlap > 0.0
    mass, tangential_mass, share = 1.0, 1.0, h[SHARE]
    if touches:
        mass, tangential_mass, share = effective_masses(m, d, b, p, h, point, n, work[6:9], push_a, push_b, answer)
    place_point(n, overlap, share, point)
    spin = relative_velocity(d, b, point, n, velocity)
    if touches:
        if not clear and b[RADIUS_GIVEN] == 0.0:
            report(b, instance, UNCLEAR_RADIUS, p[RADIUS])
        closing = -(velocity[0] * n[0] + velocity[1] * n[1] + velocity[2] * n[2])
        longest = longest_step(p, mass, tangential_mass, max(overlap - closing * dt, 0.0), closing)
        if dt > longest:
            report(b, instance, LONG_STEP, longest)
        lean = n[0] * p[AXIS] + n[1] * p[AXIS + 1] + n[2] * p[AXIS + 2]
        if abs(lean) > PLANE_SLACK:
            report(b, instance, NOT_IN_PLANE, lean)
            return
    contact_force(p, h, n, velocity, spin, overlap, dt, mass, tangential_mass, h_out, force)
    if overlap > DEEPEST * p[RADIUS]:
        report(b, instance, DEEP, overlap / p[RADIUS])
    if overlap > 0.0:
        h_out[SHARE] = share
        total = carray(doubles_at(load_pointer(d + types.uintp(FORCE_AT))), int(b[NV]))
        project(m, d, int(b[DOF_A]), int(b[ROOT_A]), point, force, 1.0, total)
        project(m, d, int(b[DOF_B]), int(b[ROOT_B]), point, force, -1.0, total)


@c_callback(types.void(types.uintp, types.uintp, types.int32, types.int32), layout.KEY)
def compute(m, d, instance, capability):
    """Force of all contacts of an instance at the present state; committed state is only read."""
    block = address_of_block(d, instance)
    if is_idle(d, block):
        return
    b = part(block, 0, PARAMETERS_AT)
    slots, size, count, nv = int(b[SLOTS]), int(b[HISTORY]), int(b[PARAMETER_COUNT]), int(b[NV])
    p = part(block, PARAMETERS_AT, count)
    new = PARAMETERS_AT + count
    work = part(block, new + slots * size, WORK)
    n, point = work[0:3], work[3:6]
    state = load_pointer(d + types.uintp(STATE_AT)) + types.uintp(8 * int(b[STATE]))
    dt = load_double(m + types.uintp(TIMESTEP_AT))
    b[TOUCHED] = 0.0
    for slot in range(slots):
        h = part(state, slot * size, size)
        overlap, clear = locate(m, d, b, slot, n, point, work[6:WORK])
        if overlap <= 0.0 and h[PHASE] == OPEN:
            continue
        if b[TOUCHED] == 0.0:
            b[TOUCHED] = 1.0
            all_new, all_old = part(block, new, slots * size), part(state, 0, slots * size)
            for i in range(slots * size):
                all_new[i] = all_old[i]
        vectors = new + slots * size + WORK
        act(
            m, d, b, instance, p, h, overlap, clear, n, point, work[6:WORK],
            part(block, vectors, nv), part(block, vectors + nv, nv), part(block, vectors + 2 * nv, nv),
            dt, part(block, new + slot * size, size),
        )  # fmt: skip


@c_callback(types.void(types.uintp, types.uintp, types.int32), layout.KEY)
def advance(m, d, instance):
    """The step is taken: what compute left becomes the history."""
    block = address_of_block(d, instance)
    if number(block, TOUCHED) == 0.0:
        return
    b = part(block, 0, PARAMETERS_AT)
    total = int(b[SLOTS]) * int(b[HISTORY])
    new = part(block, PARAMETERS_AT + int(b[PARAMETER_COUNT]), total)
    state = part(load_pointer(d + types.uintp(STATE_AT)), int(b[STATE]), total)
    for i in range(total):
        state[i] = new[i]


@c_callback(types.void(types.uintp, types.uintp, types.uintp, types.int32), layout.KEY)
def reset(m, state, block, instance):
    """No contact."""
    b = part(block, 0, PARAMETERS_AT)
    b[TOUCHED] = 0.0
    history = part(state, 0, int(b[SLOTS]) * int(b[HISTORY]))
    for i in range(history.size):
        history[i] = 0.0


@c_callback(types.void(types.uintp, types.int32), layout.KEY)
def destroy(d, instance):
    """Free the block of an instance."""
    free_memory(address_of_block(d, instance))
