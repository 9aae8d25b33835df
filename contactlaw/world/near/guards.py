"""Guards: bounds on how far two bodies have moved relative to each other since near pairs were last listed.

Bodies may move fast and yet hardly relative to each other, as those of an arm do. Two whole shapes whose gap is costly
to measure have a guard; a sphere with a sphere, segment or plane has none. It adds up the motion of one body, A, in the
frame of the other, B. Between two updates no point of A moves by more than

    |p - p0| + 2 sin(theta/2) L          2 sin^2(theta/2) = (3 - tr M0^T M)/2

with the centre of mass at p0 and p, the rotations M0 and M, the angle theta between them, and A's reach L. From the
last update to a later time no point moves further than a bound on its mean speed allows. A pair whose gap is wider
than the sum is not measured, at the cost of one comparison a step.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.pair import DEEPEST
from contactlaw.world.bodies.bounds import closing_along, relative_speed, spin_bound
from contactlaw.world.bodies.motion import change_bound, greatest_closing
from contactlaw.world.data.access import axis_at, body_at, guard_at, joint_at, link_at, shape_at, tree_at
from contactlaw.world.data.call import ask_separation
from contactlaw.world.data.kinds import BOX, CYLINDER, PLANE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.tree import HINGE
from contactlaw.world.data.vec import ZERO, load, norm, scale, store, sub, to_body, to_world

EXCEEDED = -NEVER  # limit of a guard of which the listed parts no longer do
ROUNDING = 1e-15  # of the trace of M0^T M
PRISM_EXCESS = 0.003  # of a cylinder's radius; it is wider than the prism of `gjk.STAVE` by (1 - cos(pi/32))/2 = 0.0024
SLACK = 0.2  # of a body's smallest radius: part of its margin, and of that of parts, that does not depend on speed
KEPT = 0.05  # the same: what of SLACK is left for a step in which contacts move a body as no bound on its speed tells
PARTS_STEPS = 4.0  # steps at the guard's present speed bound, for the margin up to which parts are listed
LOOKS = 3  # evaluations of a bound on a mean speed to find until when two cores stay apart
NEAREST = 1.0 / 16.0  # of the time left: times of impact that are nearer are found for each pair of parts


def has_shapes(b):
    """Return whether a body has any shapes: else it does not matter where it goes."""
    return b.size > 0.0 or b.reach > 0.0


def surface_speed(b, time):
    """Return a bound on the speed [m/s] of any point of a body's shapes within a time [s]."""
    gained = time * (norm(load(b.acceleration)) + change_bound(b, b.reach, time))
    return norm(load(b.velocity)) + spin_bound(b, time) * b.reach + gained


def new_guard(w, i, j):
    """Add a guard between whole shapes i and j, with a bound on speeds within a step; return its number.

    Returns -1 if there is no room. The guard's body A has a finite mass; if both have, it is the one of smaller reach.
    """
    if w.guard_count == w.guard_room:
        w.left_out = 1 + i
        return -1
    k = w.guard_count
    w.guard_count += 1
    g = guard_at(w.guards, k)
    g.a, g.b, g.body_a, g.body_b = i, j, shape_at(w.shapes, i).body, shape_at(w.shapes, j).body
    a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
    if a.inverse_mass == 0.0 or (b.inverse_mass != 0.0 and b.reach < a.reach):
        g.body_a, g.body_b = g.body_b, g.body_a
    g.limit, g.unlisted, g.separated, g.separation, g.found = NEVER, 0, 0, 0.0, -1.0
    store(g.normal, ZERO)
    update_guard(w, g, w.step)
    g.moved = g.lag
    return k


def update_moved(w, g):
    """Add A's motion in B's frame since the last update to what it has moved since near pairs were listed."""
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


def update_guard(w, g, left):
    """Update a guard's motion, and its bounds on A's speed in B's frame: now, and in the mean over a time [s] to come.

    The bounds grow with time, so that the mean over any part of it from now on is no greater.
    """
    a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
    update_moved(w, g)
    g.time = time_of(a, b)
    delay = abs(a.time - b.time) if a.still == 0 and b.still == 0 else 0.0
    g.lag = delay * surface_speed(a if a.time < b.time else b, delay) if delay > 0.0 else 0.0
    g.last_speed_now = g.speed_now
    g.speed_now, g.speed = relative_speed(a, b, left)


def time_of(a, b):
    """Return the time [s] of the step up to which two bodies have moved; one that stands still needs no moving."""
    if a.still != 0:
        return b.time
    return a.time if b.still != 0 else min(a.time, b.time)


def path_bound(g, time):
    """Return a bound on how far [m] a point of A has moved against B, from the list to a time of the step [s]."""
    return g.moved + g.lag + max(time - g.time, 0.0) * g.speed


def sweep_radius(s):
    """Return a radius [m] such that a core swept by it contains the shape.

    Spheres and corners meet a box or a cylinder without its rounding. Its sharp corner is sqrt(3) radii from the core,
    its sharp rim sqrt(2). A cylinder counts as a prism, which lacks PRISM_EXCESS of its radius.
    """
    if s.kind == CYLINDER:
        return sqrt(2.0) * s.radius + PRISM_EXCESS * s.half[0]
    return sqrt(3.0) * s.radius if s.kind == BOX else s.radius


def separate(w, i, j, n, far=NEVER):
    """Return normal, low and high of `gjk.separate` for two whole shapes, a core and another, swept by their radii.

    n: a normal to use, or zero to find one. The separation is low - high [m]; above `far` any one will do.
    """
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    radius_a, radius_b = sweep_radius(sa), sweep_radius(sb) if sb.kind < PLANE else 0.0
    far, a, b = far + radius_a + radius_b, body_at(w.bodies, sa.body), body_at(w.bodies, sb.body)
    n, low, high, _ = ask_separation(sa.separation, sa, a, sb, b, n, far)
    return n, low - radius_a, high + radius_b


def hinge_separates(w, i, j):
    """Return whether two shapes can never meet, as a plane across the only hinge between their bodies separates them.

    Hinge and plane are fixed to both bodies, so that the height of each point over the plane is constant. So is the
    overlap of two flanges that lie on each other: no motion has made it, and it presses on nothing.
    """
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    least, a, b = -DEEPEST * min(sa.radius, sb.radius), sa.body, sb.body
    for one, other in ((a, b), (b, a)):
        own = body_at(w.bodies, one)
        if own.tree == 0:
            continue
        t = tree_at(own.tree, 0)
        link = link_at(t.links, own.member)
        before = t.first + link.parent if link.parent >= 0 else t.hangs_on
        if before == other and link.joints == 1 and joint_at(t.joints, link.first_joint).kind == HINGE:
            n = load(axis_at(t.axes, link.first_axis).spin)
            _, bottom, top = separate(w, i, j, scale(-1.0, n))
            _, low, high = separate(w, i, j, n)
            return max(low - high, bottom - top) > least and sb.kind < PLANE
    return False


def cores_stay_apart(w, p, a, b, left):
    """Return whether the cores of a near pair are too far apart to meet soon, within a share of the time left [s].

    If so, sets the pair's gap, closing speed and time of impact to bounds from the plane between them. One evaluation
    serves all pairs of parts of the same two shapes.
    """
    if p.guard < 0:
        return False
    g, time = guard_at(w.guards, p.guard), b.time if a.still != 0 else a.time
    # not where a or b is a scratch copy at another time than its body, as the plane is placed by the bodies
    here = body_at(w.bodies, p.body_a).time == a.time and body_at(w.bodies, p.body_b).time == b.time
    flat = shape_at(w.shapes, g.a).kind >= BOX and shape_at(w.shapes, g.b).kind < PLANE
    if not (flat and here) or (b.still == 0 and b.time != time):
        return False
    if g.found != time:
        wait = time_apart(w, g, left)
        g.found, g.apart = time, time if wait == 0.0 else (NEVER if wait == left else time + wait)
    return takes_known_time(w, p, time)


def takes_known_time(w, p, now):
    """Return whether the cores of a near pair are known to stay apart from a time of the step [s] on.

    If so, sets what `time_of_impact.predict` sets to bounds from the plane between them.
    """
    if p.guard < 0:
        return False
    g = guard_at(w.guards, p.guard)
    if g.found != now or g.apart <= now:
        return False
    p.checked, p.toi = now, g.apart
    p.gap, p.closing, p.acceleration = g.gap, g.closing, g.growth
    return True


def time_apart(w, g, left):
    """Return a time [s] to come within which two cores stay apart: that left, or a shorter one, or zero.

    Sets the gap between two planes that separate them, a bound on their closing speed now, and on its growth within
    that time. The last planes of the step are kept while they leave half of the gap that they left. A bound on a mean
    speed grows with the time that it is for. So two cores stay apart for as long as their gap takes to close at that
    bound, and perhaps for longer; the next time tried is between both.
    """
    a, b, n, low, high = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b), ZERO, -NEVER, 0.0
    if g.found >= 0.0:
        n, low, high = separate(w, g.a, g.b, to_world(b.axes, load(g.normal)))
    if low - high <= max(0.5 * g.gap, 0.0):
        n, low, high = separate(w, g.a, g.b, ZERO)
    n, time, apart, g.gap = to_body(b.axes, n), left, 0.0, low - high
    store(g.normal, n)
    if g.body_a != shape_at(w.shapes, g.a).body:
        n = scale(-1.0, n)
    for _ in range(LOOKS if g.gap > 0.0 else 0):
        g.closing, g.growth, mean = closing_along(a, b, n, time)
        if g.gap > time * mean:
            return time
        apart = max(apart, g.gap / mean)
        time = sqrt(time * apart)
    return apart if apart > NEAREST * left else 0.0


def any_guard_exceeded(w, until, least):
    """Return whether parts that are not listed can meet until a time of the step [s].

    least: time [s] from the bodies' present times that is looked ahead at present speeds, between two steps. If it is
    zero, bounds on speeds count, and guards of bodies whose velocities have not changed are left out: theirs still
    hold. The limit of a guard that is exceeded becomes EXCEEDED, until its parts are listed anew; so does that of one
    which is far too wide for a step that begins, as it was made while a tree whirled.
    """
    out = False
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
        if least > 0.0 or a.changed != 0 or b.changed != 0:
            left = max(until - time_of(a, b), least)
            update_guard(w, g, left)
            rest, way = g.limit - g.moved - g.lag, left * (g.speed if least == 0.0 else g.speed_now)
            widest = PARTS_STEPS * (SLACK * (a.size + b.size) + way) if g.unlisted == 0 and left == w.step else NEVER
            if way + KEPT * (a.size + b.size) > rest or widest < rest < NEVER:
                g.limit, out = EXCEEDED, True
    return out


def known_gap(w, p, time):
    """Return a lower bound on the gap [m] of a near pair until a time of the step [s]; -NEVER: it has no guard."""
    return p.listed_gap - path_bound(guard_at(w.guards, p.guard), time) if p.guard >= 0 else -NEVER


def raise_listed_gap(w, p, time):
    """Raise the lower bound on the gap of a pair by its gap as measured at a time of the step [s].

    A guard counts motion from its last update. The motion between that and the measurement is known only as a bound,
    and is subtracted.
    """
    if p.guard >= 0:
        g = guard_at(w.guards, p.guard)
        p.listed_gap = max(p.listed_gap, p.gap + 2.0 * g.moved - path_bound(g, time))


def gap_bound(w, p, a, b):
    """Return a lower bound on the gap [m] of a pair in substeps, and by how much it can have shrunk in the last.

    The latter is the motion [m] between the guard's last two updates. Without a guard: -NEVER and NEVER.
    """
    if p.guard < 0:
        return -NEVER, NEVER
    g, time = guard_at(w.guards, p.guard), b.time if a.still != 0 else a.time
    if g.time != time or g.lag > 0.0:
        update_moved(w, g)
        g.time, g.lag = time, 0.0
    return p.listed_gap - g.moved, g.last_move


def closing_bound(w, p, a, b):
    """Return a bound on the closing speed [m/s] of two shapes by their present motion, as their guard knows it."""
    return guard_at(w.guards, p.guard).speed_now if p.guard >= 0 else greatest_closing(a, b)


jit_module(__name__)
