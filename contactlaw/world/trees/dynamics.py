"""Mass matrix and accelerations of a tree of bodies.

    (M(q) + E + s D + e^2 K) a + c(q, v) = f - D (v - v_f) - K (u + e v)

M is found from composite rigid bodies, and c, gravity included, from the forces that all bodies need at a = 0
(Featherstone 2008, chapters 5 and 6). Damping of an axis may have bounds, see `loosen`. Springs act by the displacement
u since the start of the step. The time s (`lag`) makes damping implicit, e (`ease`) springs; they are zero unless
`trees.motion` sets them. In M = L^T D L, D here the pivots, L has entries only where one degree of freedom carries the
other. So an impulse on a body needs a pass over the axes that carry it, and its response one pass over all others.

A soft constraint between two branches, or between two trees that it makes one system, couples axes of which none
carries the other. Then the axes that a row has entries of are those above it in the elimination tree
(`TreeRecords._order_factor`), which include those that carry it.

Row k of the factor holds these entries, the root's first, and its own last, so that the row of each of these axes is
laid out as the first part of row k. The damping D and the inertia E, by which soft constraints resist acceleration, are
whole symmetric matrices, of which these entries count: other coupling of joints in two branches, as by a damped tendon,
is not in them.
"""

from math import sqrt

from contactlaw.jit import jit_module, jit_of_sums
from contactlaw.memory import place_at, whole_at
from contactlaw.world.data.access import axis_at, body_at, limit_at, link_at
from contactlaw.world.data.vec import ZERO, add, cross, dot, load, scale, store, sub, to_world
from contactlaw.world.trees.kinematics import add_multiple, displace, response_of, vector

# Rate of damping times a group of substeps up to which velocities that the midpoint rule reverses, at the ratio
# (1 - x/2)/(1 + x/2), are at most half as large
LARGEST_LAG = 6.0


def accelerate(t):
    """Find the mass matrix and its factor, and the accelerations at q and v."""
    for i in range(t.count):
        start_link(t, i)
    a, d, m = vector(t.a, t.v_size), vector(t.d, (t.v_size, t.v_size)), vector(t.factor, (t.v_size, t.v_size))
    held, springs = vector(t.e, (t.v_size, t.v_size)), vector(t.springs, (t.v_size, t.v_size))
    square = t.ease * t.ease
    set_forces(t, d, a)
    for i in range(t.count - 1, -1, -1):
        link = link_at(t.links, i)
        force, moment = load(link.force), load(link.moment)
        offset, tensor = load(link.composite_moment), link.composite_inertia
        for k in range(link.first_axis, link.first_axis + link.axes):
            axis = axis_at(t.axes, k)
            e, s = load(axis.spin), load(axis.velocity)
            a[k] -= dot(e, moment) + dot(s, force)
            linear = add(scale(link.composite_mass, s), cross(e, offset))
            angular = add(to_world(tensor, e), cross(offset, s))
            axis.inertia = axis.armature + held[k, k] + dot(e, angular) + dot(s, linear)
            axis.inertia = axis.inertia + t.lag * (d[k, k] - axis.loose) + square * springs[k, k]
            m[k, axis.depth] = axis.inertia
            carrier, path = axis.carrier, path_of(t, k)
            for p in range(axis.depth - 1, -1, -1):
                j = whole_at(path, p)
                one = axis_at(t.axes, j)
                m[k, p] = 0.0 if t.coupled == 0 else t.lag * d[k, j] + square * springs[k, j] + held[k, j]
                if j == carrier:
                    m[k, p] = m[k, p] + dot(load(one.spin), angular) + dot(load(one.velocity), linear)
                    carrier = one.carrier
        if link.parent >= 0:
            parent = link_at(t.links, link.parent)
            store(parent.force, add(load(parent.force), force))
            store(parent.moment, add(load(parent.moment), moment))
            parent.composite_mass += link.composite_mass
            store(parent.composite_moment, add(load(parent.composite_moment), offset))
            for k in range(9):
                parent.composite_inertia[k] += tensor[k]
    factorise(t)
    solve(t, a)
    spread_acceleration(t)


def set_forces(t, d, a):
    """a <- f - D (v - v_f) and the forces of limits; of springs too, but for substeps, which kick by them."""
    f, v_f = vector(t.f, t.v_size), vector(t.v_f, t.v_size)
    v = vector(t.room + 8 * (t.q_size + 2 * t.v_size) if t.midway != 0 else t.v, t.v_size)
    for k in range(t.v_size):
        axis = axis_at(t.axes, k)
        j, own = axis.parent, v[k] - v_f[k]
        a[k] = f[k] - d[k, k] * own + loosen(axis, own)
        while j >= 0 and t.coupled != 0:
            a[k] -= d[k, j] * (v[j] - v_f[j])
            a[j] -= d[k, j] * own
            j = axis_at(t.axes, j).parent
    for i in range(t.limited):
        limit, row = limit_at(t.limits, i), row_of(t, t.rows, i)
        for k in range(limit.first, limit.end if limit.force != 0.0 else limit.first):
            a[k] += row[k] * limit.force
    if t.held == 0.0:
        pull(t, 1.0, a, vector(t.x, t.v_size))


def loosen(axis, change):
    """Return the force that damping at its bounds lacks, of a change of velocity since v_f."""
    full = axis.slope * change
    lack = full - min(max(full, -axis.most), -axis.least)
    axis.loose = axis.slope if lack != 0.0 else 0.0
    return lack


def pull(t, time, out, u):
    """Add the impulses -K (u + e v) of springs in a time [s] to `out`; u is overwritten."""
    if t.sprung == 0:
        return
    springs, v = vector(t.springs, (t.v_size, t.v_size)), vector(t.v, t.v_size)
    displace(t, u)
    ahead = t.ease if t.unmoved == 0 else 0.0
    for k in range(t.v_size):
        first, end = (0, t.v_size) if t.coupled != 0 else (k, k + 1)
        for i in range(first, end):
            out[k] -= time * springs[k, i] * (u[i] + ahead * v[i])


def row_of(t, address, i):
    """Return row i of a matrix of limits: of their Jacobian, or of the answers to them."""
    return vector(address + 8 * t.v_size * i, t.v_size)


def start_link(t, i):
    """Begin a link: its bias acceleration, the force and moment for that, and its inertia about the tree's origin.

    An axis that turns with spin w and velocity u changes at a rate (w x e, u x e + w x s); all axes of one ball joint
    turn with what carries the joint.
    """
    link, b, v = link_at(t.links, i), body_at(t.bodies, i), vector(t.v, t.v_size)
    w, u, turning, gain = ZERO, ZERO, ZERO, ZERO
    if link.parent >= 0:
        parent = link_at(t.links, link.parent)
        w, u = load(body_at(t.bodies, link.parent).spin), load(parent.velocity)
        turning, gain = load(parent.bias_turning), load(parent.bias)
    spin, velocity = w, u
    for k in range(link.first_axis, link.first_axis + link.axes):
        axis = axis_at(t.axes, k)
        if axis.begins != 0:
            w, u = spin, velocity
        rate = v[k] if t.unmoved == 0 else 0.0
        e, s = scale(rate, load(axis.spin)), scale(rate, load(axis.velocity))
        turning = add(turning, cross(w, e))
        gain = add(gain, add(cross(u, e), cross(w, s)))
        spin = add(spin, e)
        velocity = add(velocity, s)
    store(link.bias_turning, turning)
    store(link.bias, gain)
    c = sub(load(b.position), load(t.origin))
    acceleration = add(gain, add(cross(turning, c), cross(spin, load(b.velocity))))
    tensor = inertia(b.axes, load(link.inertia))
    force = scale(link.mass, sub(acceleration, load(t.gravity)))
    moment = add(to_world(tensor, turning), cross(spin, to_world(tensor, spin)))
    store(link.force, force)
    store(link.moment, add(moment, cross(c, force)))
    link.composite_mass = link.mass
    offset = scale(link.mass, c)
    store(link.composite_moment, offset)
    x, y, z = offset[0] * c[0], offset[1] * c[1], offset[2] * c[2]
    out = link.composite_inertia
    out[0], out[4], out[8] = tensor[0] + y + z, tensor[4] + x + z, tensor[8] + x + y
    out[1], out[2] = tensor[1] - offset[0] * c[1], tensor[2] - offset[0] * c[2]
    out[3], out[6] = out[1], out[2]
    out[5] = out[7] = tensor[5] - offset[1] * c[2]


def inertia(m, i):
    """Return the inertia about the centre of mass along the world's axes, a matrix (9,), row by row.

    m, i: matrix (9,) of the principal axes, and moments about these.
    """
    x = (i[0] * m[0], i[1] * m[1], i[2] * m[2])
    y = (i[0] * m[3], i[1] * m[4], i[2] * m[5])
    own_y, own_z = (m[3], m[4], m[5]), (m[6], m[7], m[8])
    xy, xz, yz = dot(x, own_y), dot(x, own_z), dot(y, own_z)
    zz = i[0] * m[6] * m[6] + i[1] * m[7] * m[7] + i[2] * m[8] * m[8]
    return dot(x, (m[0], m[1], m[2])), xy, xz, xy, dot(y, own_y), yz, xz, yz, zz


def factorise(t):
    """Replace M by L below its diagonal, and set the inverse pivots."""
    m = vector(t.factor, (t.v_size, t.v_size))
    for k in range(t.v_size - 1, -1, -1):
        axis, path = axis_at(t.axes, k), path_of(t, k)
        axis.inverse = 1.0 / m[k, axis.depth]
        axis.root = sqrt(axis.inverse)
        for p in range(axis.depth - 1, -1, -1):
            part = m[k, p] * axis.inverse
            add_multiple(m[place_at(path, p)], -part, m[k], 0, p + 1)
            m[k, p] = part
    for i in range(t.limited):
        limit_at(t.limits, i).mobility = 0.0


def path_of(t, k):
    """Return the address of the axes that row k of the factor has entries of, the root's first."""
    return t.path + 8 * t.v_size * k


def solve_lt(t, x, k, every):
    """x <- L^-T x. every: for all axes from k down, else only for k and those that carry it."""
    m = vector(t.factor, (t.v_size, t.v_size))
    while k >= 0:
        axis, path, own = axis_at(t.axes, k), path_of(t, k), x[k]
        for p in range(axis.depth if own != 0.0 else 0):
            x[place_at(path, p)] -= m[k, p] * own
        k = k - 1 if every else axis.parent


def solve_ld(t, x):
    """x <- L^-1 D^-1 x."""
    m = vector(t.factor, (t.v_size, t.v_size))
    for k in range(t.v_size):
        axis = axis_at(t.axes, k)
        x[k] = x[k] * axis.inverse - sum_along(path_of(t, k), axis.depth, m[k], x)


@jit_of_sums
def sum_along(path, count, row, x):
    """Return the sum of products of the first entries of a row of L with the x of their axes, see `path_of`."""
    out = 0.0
    for p in range(count):
        out += row[p] * x[place_at(path, p)]
    return out


def solve(t, x):
    """x <- M^-1 x."""
    solve_lt(t, x, t.v_size - 1, True)
    solve_ld(t, x)


def bound_decay(t):
    """Bound the rate [1/s] at which damping slows velocities: the greatest eigenvalue of M^-1 D.

    With R^2 = diag D it is that of B^T B, B = R L^-1 P^-1/2, P the pivots, and at most the greatest sum of a row of
    |B|^T |B| (Perron and Frobenius). Damping of a sum over n velocities, b g g^T, is bounded by n diag(b g^2)
    (Cauchy-Schwarz). That of M^-1 K bounds the stiffness of springs, which count as the damping h/2 K, h the step.
    """
    n, most = t.v_size, 1.0
    d, springs = vector(t.d, (n, n)), vector(t.springs, (n, n))
    x, sums, stiff = vector(t.x, n), vector(t.room, n), vector(t.room + 8 * n, n)
    for k in range(n):
        sums[k], stiff[k] = 0.0, 0.0
    for k in range(n):
        path, count, coupled, own = path_of(t, k), axis_at(t.axes, k).depth + 1, 1.0, d[k, k]
        if own + springs[k, k] > 0.0:
            for i in range(k if t.coupled != 0 else 0):
                coupled += 1.0 if d[k, i] != 0.0 or springs[k, i] != 0.0 else 0.0
            for p in range(count):
                x[whole_at(path, p)] = 0.0
            most, x[k], total = max(most, coupled), 1.0, 0.0
            solve_lt(t, x, k, False)
            for p in range(count):
                i = whole_at(path, p)
                x[i] = abs(x[i]) * axis_at(t.axes, i).root
                total += x[i]
            for p in range(count):
                i = whole_at(path, p)
                sums[i] += own * total * x[i]
                stiff[i] += springs[k, k] * total * x[i]
    t.decay, t.stiffness = 0.0, 0.0
    for k in range(n):
        t.decay = max(t.decay, most * sums[k])
        t.stiffness = max(t.stiffness, most * stiff[k])
    t.swing = t.decay / LARGEST_LAG + 0.5 * t.span * t.stiffness
    t.decay += 0.5 * t.span * t.stiffness


def spread_acceleration(t):
    """Set the accelerations of all bodies from a."""
    a, origin = vector(t.a, t.v_size), load(t.origin)
    for i in range(t.count):
        link, b = link_at(t.links, i), body_at(t.bodies, i)
        turning, gain = response_of(t, i, a)
        turning = add(turning, load(link.bias_turning))
        gain = add(gain, load(link.bias))
        c = sub(load(b.position), origin)
        store(b.turning, turning)
        store(b.acceleration, add(gain, add(cross(turning, c), cross(load(b.spin), load(b.velocity)))))


def add_impulse(t, b, impulse, moment, x, left):
    """x <- left x + J^T (p, m), of an impulse [N s] on a body's centre of mass and an angular impulse [N m s].

    Only entries of the axes in one row of the factor are set, that of the last axis of the body, which is returned.
    """
    link = link_at(t.links, b.member)
    last = link.first_axis + link.axes - 1
    moment = add(cross(sub(load(b.position), load(t.origin)), impulse), moment)
    k, carrier = last, last
    while k >= 0:
        axis = axis_at(t.axes, k)
        x[k] = left * x[k]
        if k == carrier:
            x[k] = x[k] + dot(load(axis.spin), moment) + dot(load(axis.velocity), impulse)
            carrier = axis.carrier
        k = axis.parent
    return last


def project(t, b, impulse, moment, x):
    """x <- L^-T J^T (p, m), see `add_impulse`; returns the last axis that carries the body."""
    last = add_impulse(t, b, impulse, moment, x, 0.0)
    solve_lt(t, x, last, False)
    return last


def add_square(t, address, share):
    """Add a share of x^T x, of the row x, to a matrix at an address."""
    n, x, out = t.v_size, vector(t.x, t.v_size), vector(address, (t.v_size, t.v_size))
    some = 0
    for k in range(n):
        if x[k] != 0.0:
            some += 1
            for i in range(n):
                out[k, i] += share * x[k] * x[i]
    t.coupled = 1 if some > 1 else t.coupled


jit_module(__name__)
