"""How much nearer two bodies can have come to each other since the list of near pairs was made.

Bodies may move fast and yet hardly against each other, as those of an arm do. A guard stands between two bodies that
have shapes which cost more to look at than balls: it adds up how A moves in B's frame, from look to look no point by
more than

    |p - p0| + 2 sin(theta/2) L          2 sin^2(theta/2) = (3 - tr M0^T M)/2

of the centre of mass at p, the angle theta between the turns M and M0, and A's reach L; and until a time to come by
no more than the greatest speed lets it. A pair whose gap is wider is not looked at: that is one comparison a step.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.bodies.bounds import spin_bound, turning_bound
from contactlaw.world.bodies.motion import acceleration_of, change_bound, greatest_closing
from contactlaw.world.data.access import body_at, guard_at, shape_at
from contactlaw.world.data.call import ask_separation
from contactlaw.world.data.records import BOX, CYLINDER, EDGE, NEVER, PLANE
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub, to_body, to_world
from contactlaw.world.shapes.geometry import centre, half_axis

ROUNDING = 1e-15  # of the trace
PRISM = 0.003  # of its radius, by which a cylinder may be wider than the prism of `gjk.STAVE`
SLACK = 0.2  # of both bodies' smallest radii: how near shapes are whose parts are listed, besides
LASTS = 4.0  # steps at the speed there is
MORE = 1.5  # of that way, a gap which stays open: who looks at it later may count what pushes once more


@jit_inside
def surface_speed(b, time):
    """Speed [m/s] of a body's shapes within a time [s], at most."""
    gained = time * (norm(load(b.acceleration)) + change_bound(b, b.reach, time))
    return norm(load(b.velocity)) + spin_bound(b, time) * b.reach + gained


@jit_inside
def new_guard(w, i, j, time):
    """Number of a new guard between two shapes, -1: there is no room for it; it knows speeds within a time [s]."""
    if w.guard_count == w.guard_room:
        w.lost += 1
        return -1
    k = w.guard_count
    w.guard_count += 1
    g = guard_at(w.guards, k)
    g.a, g.b, g.body_a, g.body_b = i, j, shape_at(w.shapes, i).body, shape_at(w.shapes, j).body
    a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
    if a.inverse_mass == 0.0 or (b.inverse_mass != 0.0 and b.reach < a.reach):
        g.body_a, g.body_b = g.body_b, g.body_a
    g.limit, g.unlisted, g.parted, g.separation, g.plane_time, g.speed_time = NEVER, 0, 0, 0.0, -1.0, -1.0
    store(g.normal, ZERO)
    follow(w, g, time)
    g.moved = g.lag
    return k


@jit_inside
def move(w, g):
    """See how A has moved against B."""
    a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
    r = sub(load(a.position), load(b.position))
    place, trace = to_body(b.axes, r), 0.0
    for m in range(3):
        column = to_body(b.axes, (a.axes[m], a.axes[3 + m], a.axes[6 + m]))
        for n in range(3):
            trace += g.turn[3 * m + n] * column[n]
            g.turn[3 * m + n] = column[n]
    g.last_move = norm(sub(place, load(g.place))) + sqrt(max(3.0 - trace, 0.0) + ROUNDING) * a.reach
    g.moved += g.last_move
    store(g.place, place)


@jit_inside
def follow(w, g, left):
    """The same, and how fast it can within a time [s]."""
    a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
    r = sub(load(a.position), load(b.position))
    move(w, g)
    g.time = min(a.time, b.time)
    apart = abs(a.time - b.time)
    g.lag = apart * surface_speed(a if a.time < b.time else b, apart) if apart > 0.0 else 0.0
    g.speed, g.speed_now = 0.0, 0.0
    if a.still == 0 or b.still == 0:
        u, spin_a, spin_b = sub(load(a.velocity), load(b.velocity)), load(a.spin), load(b.spin)
        push = norm(acceleration_of(a)) + norm(acceleration_of(b))
        slides, turns = norm(sub(u, cross(spin_b, r))), norm(sub(spin_a, spin_b))
        g.speed_now = slides + turns * a.reach
        fast, spin = norm(u) + left * push, spin_bound(b, left)
        far, twist = norm(r) + left * fast, turning_bound(b, left)
        slides = min(slides + left * (push + far * twist + spin * fast), fast + spin * far)
        turns = min(turns + left * (turning_bound(a, left) + twist), spin_bound(a, left) + spin)
        g.speed = (
            slides + turns * a.reach + left * (change_bound(a, a.reach, left) + change_bound(b, far + a.reach, left))
        )


@jit_inside
def way_by(g, time):
    """How far [m] a point of A has moved against B by a time of the step [s], at most."""
    return g.moved + g.lag + max(time - g.time, 0.0) * g.speed


@jit_inside
def enough(w, g):
    """How near each other [m] two shapes are whose parts are to be listed."""
    return SLACK * (body_at(w.bodies, g.body_a).size + body_at(w.bodies, g.body_b).size) + LASTS * w.step * g.speed


@jit_inside
def around(s):
    """What a core is swept by [m], and of a cylinder what the prism that it counts as lacks.

    Corners and balls meet a box or a cylinder without its rounding: as far as its sharp corner or rim.
    """
    if s.kind == CYLINDER:
        return sqrt(2.0) * s.radius + PRISM * s.half[0]
    return sqrt(3.0) * s.radius if s.kind == BOX else s.radius


@jit_inside
def parted(w, g, n):
    """What parts the two shapes of a guard, with what sweeps them, see `convex.separate`."""
    sa, sb = shape_at(w.shapes, g.a), shape_at(w.shapes, g.b)
    n, low, high, _ = ask_separation(sa.separation, sa, body_at(w.bodies, sa.body), sb, body_at(w.bodies, sb.body), n)
    return n, low - around(sa), high + (around(sb) if sb.kind < PLANE else 0.0)


@jit_inside
def over_plane(w, p, a, b):
    """What `geometry.meet` finds of a near pair if B is all that lies behind the plane which parts both whole shapes.

    The gap is no wider then, at a product for a part. Of what has no such plane the overlap is endless.
    """
    if not has_plane(w, p, a, b):
        return NEVER, ZERO, ZERO, ZERO
    g, sa = guard_at(w.guards, p.guard), shape_at(w.shapes, p.a)
    whole_a, whole_b = shape_at(w.shapes, g.a), shape_at(w.shapes, g.b)
    n, between = to_world(body_at(w.bodies, whole_b.body).axes, load(g.normal)), sub(load(a.position), load(b.position))
    top = g.high
    if p.body_a != whole_a.body:
        n = scale(-1.0, n)
        top = dot(n, between) - g.low
    from_a, half = centre(sa, a), half_axis(sa, a)
    over = dot(n, add(between, from_a)) - top
    gap = over - sa.radius - (abs(dot(n, half)) if sa.kind <= EDGE else norm(half))
    arm_a = axpy(-over, n, from_a)
    return -(gap if sa.kind < BOX else g.low - g.high), n, arm_a, add(arm_a, between)


@jit_inside
def has_plane(w, p, a, b):
    """Whether the guard of a near pair has a plane between both whole shapes, which is placed where the bodies are."""
    if p.guard < 0:
        return False
    g = guard_at(w.guards, p.guard)
    time = b.time if a.still != 0 else a.time
    here = body_at(w.bodies, p.body_a).time == a.time and body_at(w.bodies, p.body_b).time == b.time  # and not aside
    flat = shape_at(w.shapes, g.a).kind >= BOX and shape_at(w.shapes, g.b).kind < PLANE
    if not (flat and here) or (b.still == 0 and b.time != time):
        return False
    if g.plane_time != time:
        place_plane(w, g, time)
    return True


@jit_inside
def keeps_apart(w, p, a, b, left):
    """Whether both whole shapes of a near pair are so far apart that no parts of them meet within a time to come [s].

    What is known then is entered: one look does for all that meet by parts of the same two shapes.
    """
    if not has_plane(w, p, a, b):
        return False
    g = guard_at(w.guards, p.guard)
    if g.plane_time != g.speed_time:
        follow(w, g, left)
        g.speed_time = g.plane_time
    p.gap, p.closing, p.acceleration, p.toi = g.low - g.high, g.speed, 0.0, NEVER
    return p.gap > MORE * left * g.speed


@jit_inside
def place_plane(w, g, time):
    """Find the plane that parts two cores, where they are: the one that did so last, while it does so half as well.

    Cores that are in each other none parts; above that one, or one across their centres, is nothing of B all the same.
    """
    a, b = body_at(w.bodies, shape_at(w.shapes, g.a).body), body_at(w.bodies, shape_at(w.shapes, g.b).body)
    last, n, low, high = g.high - g.low, ZERO, -NEVER, 0.0
    if g.plane_time >= 0.0:
        n, low, high = parted(w, g, to_world(b.axes, load(g.normal)))
    if low - high <= max(-0.5 * last, 0.0):
        new, bottom, top = parted(w, g, ZERO)
        if dot(new, new) == 0.0 and g.plane_time < 0.0:
            across = sub(load(a.position), load(b.position))
            new, bottom, top = parted(w, g, scale(1.0 / max(norm(across), 1e-300), across))
        if dot(new, new) > 0.0 and bottom - top > low - high:
            n, low, high = new, bottom, top
    store(g.normal, to_body(b.axes, n))
    g.plane_time, g.low, g.high = time, low, high


@jit_inside
def outgrown(w, until, least):
    """Whether two bodies can meet by parts that are not listed, until a time of the step or within one at least [s].

    Bodies that have not changed course are where they are thought to be. Where none of the parts is listed one look at
    both whole shapes may do for longer.
    """
    out = False
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
        if least > 0.0 or a.changed != 0 or b.changed != 0:
            left = max(until - min(a.time, b.time), least)
            follow(w, g, left)
            out = is_outgrown(w, g, left) or out
    return out


@jit_inside
def is_outgrown(w, g, left):
    """The same of one guard, for a time to come [s]."""
    if way_by(g, g.time + left) <= g.limit:
        return False
    if g.unlisted != 0:
        _, low, high = parted(w, g, ZERO)
        if low - high > enough(w, g):
            g.limit = low - high + g.moved - g.lag
    return way_by(g, g.time + left) > g.limit


@jit_inside
def part_at_start(w, g):
    """Find by how much a plane parts two shapes whose parts are listed: the one that did so last, while it does."""
    g.separation = 0.0
    if g.unlisted != 0 or shape_at(w.shapes, g.a).kind < BOX:
        return
    b = body_at(w.bodies, shape_at(w.shapes, g.b).body)
    n, low, high = parted(w, g, to_world(b.axes, load(g.normal)))
    if low <= high:
        n, low, high = parted(w, g, ZERO)
    store(g.normal, to_body(b.axes, n))
    g.separation = low - high


@jit_inside
def parts_through(w, g, before):
    """Whether that plane, fixed to B, has parted them throughout a step.

    Of each point of A the height over it is, between both ends of the step, by h/8 times the change of its speed at
    most below the line between them. before: speed [m/s] at the step's start.
    """
    if g.separation <= 0.0:
        return False
    b = body_at(w.bodies, shape_at(w.shapes, g.b).body)
    _, low, high = parted(w, g, to_world(b.axes, load(g.normal)))
    return min(g.separation, low - high) > 0.125 * w.step * (before + g.speed_now)


@jit_inside
def is_guarded(w, p, time, more):
    """Whether a near pair is kept apart by its guard until a time of the step, even if it closes by `more` [m]."""
    return p.guard >= 0 and p.listed_gap > way_by(guard_at(w.guards, p.guard), time) + more


@jit_inside
def keep_gap(w, p, time):
    """Remember the gap of a pair that has been looked at, where both bodies are at a time of the step.

    Since they were seen last they may have gone apart, as far as they could have come nearer.
    """
    if p.guard >= 0:
        g = guard_at(w.guards, p.guard)
        p.listed_gap = max(p.listed_gap, p.gap + 2.0 * g.moved - way_by(g, time))


@jit_inside
def known_gap(w, p, a, b):
    """A gap [m] that a pair of bodies that are stepped has at least, and by how much it may be less than before."""
    if p.guard < 0:
        return -NEVER, NEVER
    g, time = guard_at(w.guards, p.guard), b.time if a.still != 0 else a.time
    if g.time != time or g.lag > 0.0:
        move(w, g)
        g.time, g.lag = time, 0.0
    return p.listed_gap - g.moved, g.last_move


@jit_inside
def fastest(w, p, a, b):
    """Speed [m/s] at which two shapes come nearer, at most."""
    return guard_at(w.guards, p.guard).speed if p.guard >= 0 else greatest_closing(a, b)
