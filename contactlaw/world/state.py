"""The state of a world between steps, besides the motion of its bodies, as a row of numbers of fixed size.

It consists of closed contacts, sleeping bodies and ledgers. An engine keeps the row in its own state, so that a saved,
copied or restored state continues as the original: to the bit, if the bodies' motion is the same to the bit. All else
follows from the bodies at the start of a step: near pairs are listed anew.

The row holds the number of contacts that are closed, or open with an initial overlap; of each, in the order of the near
list, its two shapes, its touches, the numbers of its record, and the history of its law; of each body whether it
sleeps, and the acceleration it fell asleep with, or its pause of implicit steps; of each pair its ledger. Users of the
engine can write to rows, and a row may be that of another model: each contact that is not plausible is left out.
"""

from math import sqrt

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.laws.record import LASTING, OPEN, PRESSED, SPUN, UNSHEARED
from contactlaw.memory import doubles_at, set_whole, whole_at
from contactlaw.world.contacts.pace import share_of
from contactlaw.world.contacts.touch import add_to_ledger, has_parted
from contactlaw.world.data.access import axis_at, body_at, contact_at, link_at, near_at, pair_at, shape_at, tree_at
from contactlaw.world.data.materials import friction_of, law_of, memory_of
from contactlaw.world.data.records import CLOSED, CONTACT, FREE, LEDGER, PARTED, PAUSE_LIMIT
from contactlaw.world.data.saved import FIELDS, KNOWN_NUMBERS
from contactlaw.world.data.vec import dot, load, norm, store
from contactlaw.world.near.listing import count_slots
from contactlaw.world.near.pairing import can_touch, pair_of
from contactlaw.world.trees.mobility import clear, copy

HEAD, SHAPES, SLEEP = 1, 3, 4  # numbers before all contacts, before the fields of each contact, of each body
RECORD = CONTACT.itemsize
FIRST, LAST = int(FIELDS["interval"][1]), int(FIELDS["duration"][1])  # offsets; only float64 fields between them
KEPT = (LAST - FIRST) // 8 + 1
PER_CONTACT = SHAPES + KNOWN_NUMBERS + KEPT  # numbers of a contact, besides the history of its law
MAX_NUMBER = 1e30  # magnitude of any number that is accepted, SI units: products of a few stay finite
MAX_OVERLAP = 10.0  # greatest overlap that is accepted, over the radius
MAX_FORCE = 1e3  # greatest force that is accepted, over E* R^2
UNIT = 1e-9  # tolerance of the squared length of a unit vector, of orthogonality and of limits of forces


def size(contact_room: int, memory_size: int, body_count: int, pair_count: int) -> int:
    """Return the number of float64 of a state with room for so many contacts; the world itself is one of the bodies."""
    contact = PER_CONTACT + memory_size
    return HEAD + contact_room * contact + SLEEP * body_count + LEDGER * pair_count


@jit_inside
def unused_span(w, row):
    """Return where zeros begin in a row behind its contacts, and where they end: where the numbers of bodies begin."""
    length = PER_CONTACT + w.memory_size
    return HEAD + int(row[0]) * length, HEAD + contacts_room(w, row) * length


@jit_inside
def contact_fields(w, slot, offset, count):
    """Return a view of `count` numbers of a contact's record from an offset."""
    return carray(doubles_at(w.contacts + RECORD * slot + offset), count)


@jit_inside
def contacts_room(w, numbers):
    """Return how many contacts a row has room for."""
    left = numbers.size - HEAD - SLEEP * w.body_count - LEDGER * w.pair_count
    return left // (PER_CONTACT + w.memory_size)


@jit_inside
def write(w, out):
    """Write the state of a world, between two steps, into a row as long as `size` says.

    Returns the number of contacts for which there was no room. On entry the row holds zeros, or an earlier state.
    """
    room = contacts_room(w, out)
    if room < 0:
        return w.nears
    length = PER_CONTACT + w.memory_size
    before = int(out[0]) if 0.0 <= out[0] <= room else room
    count, lost, at = 0, 0, HEAD
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.closed == 0 and p.initial_overlap == 0.0:
            continue
        if count == room:
            lost += 1
            continue
        count += 1
        out[at], out[at + 1], out[at + 2] = p.a, p.b, contact_at(w.contacts, p.slot).touches
        copy(contact_fields(w, p.slot, 0, KNOWN_NUMBERS), out[at + SHAPES :])
        copy(contact_fields(w, p.slot, FIRST, KEPT), out[at + SHAPES + KNOWN_NUMBERS :])
        copy(memory_of(w, p.slot), out[at + PER_CONTACT :])
        at += length
    clear(out[at : max(HEAD + before * length, at)])
    out[0] = count
    at = HEAD + room * length
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        sleeps = b.asleep != 0 and is_small(b.held)
        out[at] = 1.0 if sleeps else -float(b.pause + PAUSE_LIMIT * b.last_pause)
        for j in range(3):
            out[at + 1 + j] = b.held[j] if sleeps else 0.0
        at += SLEEP
    for i in range(w.pair_count):
        copy(pair_at(w.pairs, i).ledger, out[at + LEDGER * i :])
    for k in range(w.nears):
        p = near_at(w.near, k)
        if has_parted(p):
            add_to_ledger(contact_at(w.contacts, p.slot), out[at + LEDGER * p.pair :])
    count_slots(w)
    for slot in range(w.slots if w.spares < w.contact_room else 0):
        c = contact_at(w.contacts, slot)
        if c.phase == PARTED and c.initial_overlap == 0.0 and c.near < 0:
            add_to_ledger(c, out[at + LEDGER * c.pair :])
    return lost


@jit_inside
def is_small(numbers):
    """Return whether numbers are finite, and small enough for their products to be so."""
    sound = True
    for i in range(numbers.size):
        sound = sound and abs(numbers[i]) <= MAX_NUMBER
    return sound


@jit_inside
def read(w, row):
    """Set a world to the state in a row; the caller sets the motion of its bodies before the step.

    Returns how many contacts and sleeping bodies were left out as not plausible.
    """
    clear_state(w)
    room = contacts_room(w, row)
    if room < 0 or not 0.0 <= row[0] <= room:
        return 1
    count, bad, at = int(row[0]), 0, HEAD
    length = PER_CONTACT + w.memory_size
    a, b = -1, -1
    for _ in range(count):
        if is_readable(w, row[at : at + length], a, b) and w.spares > 0:
            slot = whole_at(w.spare, w.spares - 1)
            a, b = int(row[at]), int(row[at + 1])
            c = contact_at(w.contacts, slot)
            c.touches = int(row[at + 2])
            # between steps laws have received all motion, but the slot may hold pending motion of a parted contact
            c.pending_twist, c.twist_overlap, c.coasted_from = 0.0, 0.0, 0.0
            history = at + PER_CONTACT
            copy(row[at + SHAPES : history - KEPT], contact_fields(w, slot, 0, KNOWN_NUMBERS))
            copy(row[history - KEPT : history], contact_fields(w, slot, FIRST, KEPT))
            copy(row[history : at + length], memory_of(w, slot))
            bad += 0 if restore_contact(w, c, a, b) else 1
        else:
            bad += 1
        at += length
    at = HEAD + room * length
    for i in range(w.body_count):
        bad += 0 if restore_sleep(body_at(w.bodies, i), row[at : at + SLEEP]) else 1
        at += SLEEP
    for i in range(w.pair_count):
        if is_small(row[at : at + LEDGER]):
            copy(row[at : at + LEDGER], pair_at(w.pairs, i).ledger)
        at += LEDGER
    return bad


def read_at(w, address, count):
    """Set a world to the state in the row of `count` numbers at an address; see `read`."""
    return read(w, carray(doubles_at(address), count))


@jit_inside
def clear_state(w):
    """Set the state of a row of zeros: no contacts, no sleeping bodies, near pairs to be listed, empty ledgers."""
    w.nears = 0
    w.stale = 1
    count_slots(w)
    w.spares, w.rested = w.contact_room, 0
    for i in range(w.slots):
        contact_at(w.contacts, i).phase = FREE
        set_whole(w.spare, w.contact_room - 1 - i, i)
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.asleep, b.active, b.pause, b.last_pause = 0, 0, 0, 0
        clear(b.held)
    for i in range(w.pair_count):
        clear(pair_at(w.pairs, i).ledger)


@jit_inside
def forget_motion(w):
    """Zero the bodies' velocities and accelerations, which set margins of near pairs; the caller sets new ones."""
    w.stale = 1
    for i in range(w.body_count):
        forget_motion_of(body_at(w.bodies, i))


@jit_inside
def forget_motion_of(b):
    """Zero a body's velocities and accelerations."""
    for vector in (b.velocity, b.spin, b.acceleration, b.turning):
        store(vector, (0.0, 0.0, 0.0))
    if b.tree != 0:
        t = tree_at(b.tree, 0)
        link = link_at(t.links, b.member)
        t.effort, link.rate = 0.0, 0.0
        for k in range(link.first_axis, link.first_axis + link.axes):
            axis_at(t.axes, k).inverse = 0.0


@jit_inside
def is_readable(w, row, last_a, last_b):
    """Return whether the numbers of a contact are finite, and its shapes come after the last ones and may touch."""
    if not is_small(row) or not (0.0 <= row[0] < w.shape_count and 0.0 <= row[1] < w.shape_count):
        return False
    a, b = int(row[0]), int(row[1])
    later = a > last_a or (a == last_a and b > last_b)
    return row[0] == a and row[1] == b and later and row[2] >= 1.0 and can_touch(w, a, b)


@jit_inside
def restore_contact(w, c, a, b):
    """Close the contact of shapes a and b whose numbers are in the next free slot, if these are plausible."""
    sa, sb = shape_at(w.shapes, a), shape_at(w.shapes, b)
    pair = pair_of(w, a, b)
    t, law, own = c.touch, law_of(w, pair_at(w.pairs, pair)), pair_at(w.pairs, pair).radius
    if law.speeds == 0.0:
        mu = friction_of(pair_at(w.pairs, pair), sa, sb)
        if t.mu != mu:  # the user has changed it since
            t.friction = mu
        t.mu, t.zeta = mu, law.zeta
    t.friction = max(min(t.friction, t.mu), 0.0)  # less than mu where the contact spins
    t.radius = own if own > 0.0 else t.radius
    t.e_star, t.g_star = share_of(t, sa, sb) * law.e_star, share_of(t, sa, sb) * law.g_star
    both = sa.radius + sb.radius
    arms = is_possible_arm(body_at(w.bodies, sa.body), load(c.arm_a), both)
    arms = arms and is_possible_arm(body_at(w.bodies, sb.body), load(c.arm_b), both)
    spins = t.state != SPUN or law.sectors > 0.0
    closed = t.overlap > 0.0 or (t.overlap == 0.0 < c.initial_overlap and t.force == 0.0)
    sound = is_possible_touch(t) and is_possible_frame(c, law.rolling)
    if not (arms and spins and closed and c.initial_overlap >= 0.0 and sound):
        return False
    w.spares -= 1
    c.phase = CLOSED if t.overlap > 0.0 else PARTED
    c.near = -1
    c.shape_a, c.shape_b, c.body_a, c.body_b, c.pair = a, b, sa.body, sb.body, pair
    body_at(w.bodies, sa.body).active = 1
    body_at(w.bodies, sb.body).active = 1
    return True


@jit_inside
def is_possible_touch(t):
    """Return whether the state of a contact's law is possible."""
    strongest = MAX_FORCE * t.e_star * t.radius * t.radius
    phases = OPEN <= t.state <= UNSHEARED and PRESSED <= t.course <= LASTING
    overlaps = 0.0 <= t.overlap <= MAX_OVERLAP * t.radius and abs(t.before) <= MAX_OVERLAP * t.radius and t.reach >= 0.0
    forces = 0.0 <= t.force <= strongest and t.f * t.f + t.g * t.g <= strongest * strongest
    least = min(min(t.mass, t.tangential_mass), min(t.stiffness, t.radius))
    positive = least > 1.0 / MAX_NUMBER and min(t.ratio, t.scale) >= 0.0
    whole = t.state == int(t.state) and t.course == int(t.course)
    positive = positive and min(t.mu, t.zeta) >= 0.0
    return phases and overlaps and forces and positive and whole and abs(t.skew) < 1.0


@jit_inside
def is_possible_frame(c, resistance):
    """Return whether a contact's frame is orthonormal, and its force and moments are within its law's limits."""
    n, e, force = load(c.normal), load(c.tangent), load(c.force)
    square = abs(dot(n, n) - 1.0) <= UNIT and abs(dot(e, e) - 1.0) <= UNIT and abs(dot(n, e)) <= UNIT
    t = c.touch
    own = t.force**2 + t.f**2 + t.g**2
    most = t.mu * t.force * sqrt(t.radius * t.overlap)  # the limit is 3 pi/16 of this, see `laws.torsion`
    square = square and c.torsion.span >= 0.0 and abs(c.torsion.moment) <= most
    most = (resistance * t.radius * t.force) ** 2 * (1.0 + UNIT)
    for m in (c.bend, c.bending):
        square = square and m[0] * m[0] + m[1] * m[1] <= most
    return square and c.interval >= 0.0 and dot(force, force) <= own * (1.0 + UNIT) + 1e-300


@jit_inside
def is_possible_arm(b, arm, radii):
    """Return whether a point of contact can be this far from a body's centre of mass; always of kinematic bodies."""
    return (b.inverse_mass == 0.0 and b.tree == 0) or norm(arm) <= 2.0 * (b.reach + radii)


@jit_inside
def restore_sleep(b, row):
    """Put a body to sleep, or set its pause, as a row says; returns whether that is possible."""
    if -PAUSE_LIMIT * PAUSE_LIMIT < row[0] <= 0.0:
        pauses = int(-row[0])
        b.pause, b.last_pause = pauses % PAUSE_LIMIT, pauses // PAUSE_LIMIT
    if row[0] <= 0.0:
        return row[0] > -PAUSE_LIMIT * PAUSE_LIMIT
    if row[0] != 1.0 or not is_small(row) or (b.active == 0 and b.tree == 0) or b.inverse_mass == 0.0:
        return False
    b.asleep = 1
    copy(row[1:], b.held)
    return True
