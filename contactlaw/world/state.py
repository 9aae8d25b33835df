"""What a world must remember from step to step besides the motion of its bodies, as a row of numbers of fixed size.

Closed contacts, and which bodies sleep. An engine keeps the row in its own state, so that what is saved, copied or set
back there goes on as it would have: to the bit, if the bodies are the same to the bit. Everything else follows from the
bodies at the start of a step: the list of near pairs is made anew.

The row: how many contacts are closed, or open while overlap of them counts as none; of each, in the order of the near
list, its two shapes, how often they have touched, the numbers of its record, and what its law remembers; of each body
whether it sleeps, and what it fell asleep under, or for how long it waits. Rows are open to whoever uses the engine,
and may be another model's: what is not sound in them is left out, contact by contact.
"""

from __future__ import annotations

from math import sqrt

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.laws.record import LASTING, OPEN, PRESSED, SPUN, UNSHEARED
from contactlaw.memory import doubles_at, set_whole, whole_at
from contactlaw.world.contacts.touch import enter
from contactlaw.world.data.access import (
    KNOWN_NUMBERS,
    axis_at,
    body_at,
    contact_at,
    law_of,
    link_at,
    memory_of,
    near_at,
    pair_at,
    shape_at,
    tree_at,
)
from contactlaw.world.data.records import CLOSED, CONTACT, FREE, LEDGER, PARTED, PAUSE_LIMIT
from contactlaw.world.data.vec import dot, load, norm, store
from contactlaw.world.near.listing import count_slots
from contactlaw.world.near.pairing import can_touch, pair_of

HEAD, SHAPES, SLEEP = 1, 3, 4  # numbers: before all contacts; before each one's record; of each body
RECORD = CONTACT.itemsize
FIELDS = CONTACT.fields or {}
FROM, LAST = int(FIELDS["interval"][1]), int(FIELDS["duration"][1])  # all float64 in between
REST = (LAST - FROM) // 8 + 1
LARGEST = 1e30  # magnitude of any number, SI units: products of some of them are still finite
DEEPEST = 10.0  # overlap over the radius
STRONGEST = 1e3  # force over E* R^2
UNIT = 1e-9  # by which the square of a unit vector may be off


def size(contact_room: int, memory_size: int, body_count: int, pair_count: int) -> int:
    """How many float64 a state takes, with room for so many contacts; the world itself is one of the bodies."""
    contact = SHAPES + KNOWN_NUMBERS + REST + memory_size
    return HEAD + contact_room * contact + SLEEP * body_count + LEDGER * pair_count


@jit_inside
def hole(w, row):
    """Where zeros begin in a row behind its contacts, and where they end: at what it holds of the bodies."""
    length = SHAPES + KNOWN_NUMBERS + REST + w.memory_size
    return HEAD + int(row[0]) * length, HEAD + room_of(w, row) * length


@jit_inside
def part(w, slot, offset, count):
    """Numbers of the record of a contact, a view."""
    return carray(doubles_at(w.contacts + RECORD * slot + offset), count)


@jit_inside
def room_of(w, numbers):
    """How many contacts a row has room for."""
    left = numbers.size - HEAD - SLEEP * w.body_count - LEDGER * w.pair_count
    return left // (SHAPES + KNOWN_NUMBERS + REST + w.memory_size)


@jit_inside
def write(w, out):
    """Write the state of a world, between two steps, into a row as long as `size` says.

    Returns how many contacts there was no room for. The row holds zeros, or what this function last wrote.
    """
    room = room_of(w, out)
    if room < 0:
        return w.nears
    length = SHAPES + KNOWN_NUMBERS + REST + w.memory_size
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
        at = copy(part(w, p.slot, 0, KNOWN_NUMBERS), out, at + SHAPES)
        at = copy(part(w, p.slot, FROM, REST), out, at)
        at = copy(memory_of(w, p.slot), out, at)
    for i in range(at, HEAD + before * length):
        out[i] = 0.0
    out[0] = count
    at = HEAD + room * length
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        sleeps = b.asleep != 0 and small(b.held, 3)
        out[at] = 1.0 if sleeps else -float(b.pause + PAUSE_LIMIT * b.last_pause)
        for j in range(3):
            out[at + 1 + j] = b.held[j] if sleeps else 0.0
        at += SLEEP
    for i in range(w.pair_count):
        copy(pair_at(w.pairs, i).ledger, out, at + LEDGER * i)
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.slot >= 0 and p.closed == 0 and p.initial_overlap == 0.0:
            enter(contact_at(w.contacts, p.slot), out[at + LEDGER * p.pair :])
    return lost


@jit_inside
def copy(numbers, out, at):
    """Write numbers into a row from a place on; returns the place behind them."""
    for i in range(numbers.size):
        out[at + i] = numbers[i]
    return at + numbers.size


@jit_inside
def take(row, at, out):
    """Read numbers from a place of a row on; returns the place behind them."""
    for i in range(out.size):
        out[i] = row[at + i]
    return at + out.size


@jit_inside
def small(numbers, count):
    """Whether so many numbers are finite, and of a magnitude that leaves their products so."""
    sound = True
    for i in range(count):
        sound = sound and abs(numbers[i]) <= LARGEST
    return sound


@jit_inside
def read(w, row):
    """Give a world the state that a row holds; its bodies are given their motion by whoever does so, before the step.

    Returns how many contacts and sleeping bodies were left out because they are not sound.
    """
    forget(w)
    room = room_of(w, row)
    if room < 0 or not 0.0 <= row[0] <= room:
        return 1
    count, bad, at = int(row[0]), 0, HEAD
    length = SHAPES + KNOWN_NUMBERS + REST + w.memory_size
    a, b = -1, -1
    for _ in range(count):
        if readable(w, row[at : at + length], a, b) and w.spares > 0:
            slot = whole_at(w.spare, w.spares - 1)
            a, b = int(row[at]), int(row[at + 1])
            c = contact_at(w.contacts, slot)
            c.touches = int(row[at + 2])
            # laws know all motion between steps; but the slot may hold what a contact that parted did not tell
            c.pending_twist, c.twist_overlap, c.coasted_from = 0.0, 0.0, 0.0
            here = take(row, at + SHAPES, part(w, slot, 0, KNOWN_NUMBERS))
            here = take(row, here, part(w, slot, FROM, REST))
            take(row, here, memory_of(w, slot))
            bad += 0 if admit(w, c, a, b) else 1
        else:
            bad += 1
        at += length
    at = HEAD + room * length
    for i in range(w.body_count):
        bad += 0 if lay(body_at(w.bodies, i), row[at : at + SLEEP]) else 1
        at += SLEEP
    for i in range(w.pair_count):
        if small(row[at : at + LEDGER], LEDGER):
            take(row, at, pair_at(w.pairs, i).ledger)
        at += LEDGER
    return bad


def read_at(w, address, count):
    """The same of a row at an address."""
    return read(w, carray(doubles_at(address), count))


@jit_inside
def forget(w):
    """Leave no contact, nobody asleep, no list of near pairs, and nothing in the ledgers: the state of zeros."""
    w.nears = 0
    w.stale = 1
    count_slots(w)
    w.spares, w.rested = w.contact_room, 0
    for i in range(w.slots):
        contact_at(w.contacts, i).phase = FREE
        set_whole(w.spare, w.contact_room - 1 - i, i)
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.asleep = 0
        b.active = 0
        b.pause, b.last_pause = 0, 0
        store(b.held, (0.0, 0.0, 0.0))
    for i in range(w.pair_count):
        own = pair_at(w.pairs, i).ledger
        for j in range(LEDGER):
            own[j] = 0.0


@jit_inside
def stand(w):
    """Forget how bodies moved, which the margins of the list of near pairs go by; they are given their motion anew."""
    w.stale = 1
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        for vector in (b.velocity, b.spin, b.acceleration, b.turning):
            store(vector, (0.0, 0.0, 0.0))
        if b.tree != 0:
            t = tree_at(b.tree, 0)
            t.effort = 0.0
            link = link_at(t.links, b.member)
            link.rate = 0.0
            for k in range(link.first_axis, link.first_axis + link.axes):
                axis_at(t.axes, k).inverse = 0.0


@jit_inside
def readable(w, row, last_a, last_b):
    """Whether numbers of one contact are numbers, and its shapes, which come after the last ones, may touch."""
    if not small(row, row.size) or not (0.0 <= row[0] < w.shape_count and 0.0 <= row[1] < w.shape_count):
        return False
    a, b = int(row[0]), int(row[1])
    later = a > last_a or (a == last_a and b > last_b)
    return row[0] == a and row[1] == b and later and row[2] >= 1.0 and can_touch(w, a, b)


@jit_inside
def admit(w, c, a, b):
    """Close the contact of shapes a and b, whose numbers stand in the next free slot, if they are sound."""
    sa, sb = shape_at(w.shapes, a), shape_at(w.shapes, b)
    pair = pair_of(w, a, b)
    t, law, own = c.touch, law_of(w, pair_at(w.pairs, pair)), pair_at(w.pairs, pair).radius
    t.e_star, t.g_star = law.e_star, law.g_star
    if law.speeds == 0.0:
        if t.mu != law.friction:  # somebody has edited it
            t.friction = law.friction
        t.mu, t.zeta = law.friction, law.zeta
    t.friction = max(min(t.friction, t.mu), 0.0)  # less, where it spins
    t.radius = own if own > 0.0 else t.radius
    both = sa.radius + sb.radius
    arms = sound_arm(body_at(w.bodies, sa.body), load(c.arm_a), both)
    arms = arms and sound_arm(body_at(w.bodies, sb.body), load(c.arm_b), both)
    kept = t.state != SPUN or law.sectors > 0.0
    closed = t.overlap > 0.0 or (t.overlap == 0.0 < c.initial_overlap and t.force == 0.0)
    if not (arms and kept and closed and c.initial_overlap >= 0.0 and sound_touch(t) and sound_frame(c, law.rolling)):
        return False
    w.spares -= 1
    c.phase = CLOSED if t.overlap > 0.0 else PARTED
    c.near = -1
    c.shape_a, c.shape_b, c.body_a, c.body_b, c.pair = a, b, sa.body, sb.body, pair
    body_at(w.bodies, sa.body).active = 1
    body_at(w.bodies, sb.body).active = 1
    return True


@jit_inside
def sound_touch(t):
    """Whether what the law knows of a contact can be true."""
    strongest = STRONGEST * t.e_star * t.radius * t.radius
    phases = OPEN <= t.state <= UNSHEARED and PRESSED <= t.course <= LASTING
    overlaps = 0.0 <= t.overlap <= DEEPEST * t.radius and abs(t.before) <= DEEPEST * t.radius and t.reach >= 0.0
    forces = 0.0 <= t.force <= strongest and t.f * t.f + t.g * t.g <= strongest * strongest
    least = min(min(t.mass, t.tangential_mass), min(t.stiffness, t.radius))
    positive = least > 1.0 / LARGEST and min(t.ratio, t.scale) >= 0.0
    whole = t.state == int(t.state) and t.course == int(t.course)
    positive = positive and min(t.mu, t.zeta) >= 0.0
    return phases and overlaps and forces and positive and whole and abs(t.skew) < 1.0


@jit_inside
def sound_frame(c, resistance):
    """Whether the frame of a contact is one, its last substep was one, and its force and moment are its law's."""
    n, e, force = load(c.normal), load(c.tangent), load(c.force)
    square = abs(dot(n, n) - 1.0) <= UNIT and abs(dot(e, e) - 1.0) <= UNIT and abs(dot(n, e)) <= UNIT
    t = c.touch
    own = t.force**2 + t.f**2 + t.g**2
    most = t.mu * t.force * sqrt(t.radius * t.overlap)  # 3 pi/16 of it, see `laws.torsion`
    square = square and c.torsion.span >= 0.0 and abs(c.torsion.moment) <= most
    most = (resistance * t.radius * t.force) ** 2 * (1.0 + UNIT)
    for m in (c.bend, c.bending):
        square = square and m[0] * m[0] + m[1] * m[1] <= most
    return square and c.interval >= 0.0 and dot(force, force) <= own * (1.0 + UNIT) + 1e-300


@jit_inside
def sound_arm(b, arm, radii):
    """Whether a point of contact can be this far from a body's centre of mass; of one that nothing moves anything."""
    return (b.inverse_mass == 0.0 and b.tree == 0) or norm(arm) <= 2.0 * (b.reach + radii)


@jit_inside
def lay(b, row):
    """Let a body sleep, or wait, if a row says so; returns whether it is one that may."""
    if -PAUSE_LIMIT * PAUSE_LIMIT < row[0] <= 0.0:
        waits = int(-row[0])
        b.pause, b.last_pause = waits % PAUSE_LIMIT, waits // PAUSE_LIMIT
    if row[0] <= 0.0:
        return row[0] > -PAUSE_LIMIT * PAUSE_LIMIT
    if row[0] != 1.0 or not small(row, SLEEP) or (b.active == 0 and b.tree == 0) or b.inverse_mass == 0.0:
        return False
    b.asleep = 1
    take(row, 1, b.held)
    return True
