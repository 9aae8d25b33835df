"""The state of a world between steps, besides the motion of its bodies, as a row of numbers of fixed size.

It consists of closed contacts, sleeping bodies and ledgers. An engine keeps the row in its own state, so that a saved,
copied or restored state continues as the original: to the bit, if the bodies' motion is the same to the bit. All else
follows from the bodies at the start of a step: near pairs are listed anew.

The row holds the number of contacts that are closed, or open with an initial overlap, and of their numbers; of each, in
the order of the near list, its two shapes, its touches, the numbers of its record, and what matters of its law's
history, after its size; of each body whether it sleeps, and the acceleration it fell asleep with, or its pause of
implicit steps; of each pair its ledger. Users of the engine can write to rows: its adapter knows by a checksum whether
a row is as `write` has left it, for a world of these sizes, and reads no other.
"""

from math import isfinite

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_module
from contactlaw.memory import doubles_at, set_whole
from contactlaw.world.bodies.motion import is_static
from contactlaw.world.contacts.touch import add_to_ledger, has_contacts, has_parted, nears_in_use, new_slot
from contactlaw.world.data.access import axis_at, body_at, contact_at, link_at, near_at, pair_at, shape_at, tree_at
from contactlaw.world.data.materials import friction_of, law_of, memory_of
from contactlaw.world.data.records import CLOSED, FREE, LEDGER, PARTED, PAUSE_LIMIT
from contactlaw.world.data.saved import FIELDS, KNOWN_NUMBERS, contact_fields, history_kept
from contactlaw.world.data.vec import store
from contactlaw.world.near.pairing import can_touch, pair_of
from contactlaw.world.trees.mobility import clear, copy

HEAD, SHAPES, SLEEP = 2, 4, 4  # numbers before all contacts, before the fields of each contact, of each body
FIRST = FIELDS["interval"][1] // 8
KEPT = FIELDS["touches"][1] // 8 - FIRST  # numbers from there on that a row keeps, all float64
PER_CONTACT = SHAPES + KNOWN_NUMBERS + KEPT  # numbers of a contact, besides the history of its law


def size(contact_room: int, memory_size: int, body_count: int, pair_count: int) -> int:
    """Return the number of float64 of a state with room for so many contacts; the world itself is one of the bodies."""
    contact = PER_CONTACT + memory_size
    return HEAD + contact_room * contact + SLEEP * body_count + LEDGER * pair_count


def unused_span(w, row):
    """Return where zeros begin in a row behind its contacts, and where they end: where the numbers of bodies begin."""
    return HEAD + int(row[1]), HEAD + contacts_room(w, row) * (PER_CONTACT + w.memory_size)


def contacts_room(w, numbers):
    """Return how many contacts a row has room for."""
    left = numbers.size - HEAD - SLEEP * w.body_count - LEDGER * w.pair_count
    return left // (PER_CONTACT + w.memory_size)


def write(w, out):
    """Write the state of a world, between two steps, into a row as long as `size` says.

    Returns the number of contacts for which there was no room. On entry the row holds zeros, or an earlier state.
    """
    room = contacts_room(w, out)
    if room < 0:
        return w.nears
    bodies = HEAD + room * (PER_CONTACT + w.memory_size)
    before = HEAD + int(out[1]) if 0.0 <= out[1] <= bodies - HEAD else bodies
    count, lost, at = 0, 0, HEAD
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        if p.closed == 0 and p.initial_overlap == 0.0:
            continue
        if count == room:
            lost += 1
            continue
        count += 1
        kept = history_kept(w, p.slot) if p.closed != 0 else 0
        out[at], out[at + 1], out[at + 2], out[at + 3] = p.a, p.b, contact_at(w.contacts, p.slot).touches, kept
        copy(contact_fields(w, p.slot, 0, KNOWN_NUMBERS), out[at + SHAPES :])
        copy(contact_fields(w, p.slot, FIRST, KEPT), out[at + SHAPES + KNOWN_NUMBERS :])
        copy(memory_of(w, p.slot)[:kept], out[at + PER_CONTACT :])
        at += PER_CONTACT + kept
    clear(out[at : max(before, at)])
    out[0], out[1] = count, at - HEAD
    at = bodies
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        sleeps = b.asleep != 0 and isfinite(b.held[0] + b.held[1] + b.held[2])
        out[at] = 1.0 if sleeps else -float(b.pause + PAUSE_LIMIT * b.last_pause)
        for j in range(3):
            out[at + 1 + j] = b.held[j] if sleeps else 0.0
        at += SLEEP
    for i in range(w.pair_count):
        copy(pair_at(w.pairs, i).ledger, out[at + LEDGER * i :])
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        if has_parted(p):
            add_to_ledger(contact_at(w.contacts, p.slot), out[at + LEDGER * p.pair :])
    for slot in range(w.slots if has_contacts(w) else 0):
        c = contact_at(w.contacts, slot)
        if c.phase == PARTED and c.initial_overlap == 0.0 and c.near < 0:
            add_to_ledger(c, out[at + LEDGER * c.pair :])
    return lost


def read(w, address, count):
    """Set a world to the state in the row of `count` numbers at an address.

    The caller sets the motion of its bodies before the step. Returns how many contacts were left out, as their shapes
    cannot touch: the user has changed them since. Bodies that would sleep without a contact stay awake.
    """
    row = carray(doubles_at(address), count)
    clear_state(w)
    lost, at = 0, HEAD
    for _ in range(int(row[0])):
        a, b, history, kept = int(row[at]), int(row[at + 1]), at + PER_CONTACT, int(row[at + 3])
        if max(a, b) < w.shape_count and can_touch(w, a, b):
            slot = new_slot(w)
            c = contact_at(w.contacts, slot)
            c.touches = int(row[at + 2])
            copy(row[at + SHAPES : history - KEPT], contact_fields(w, slot, 0, KNOWN_NUMBERS))
            copy(row[history - KEPT : history], contact_fields(w, slot, FIRST, KEPT))
            copy(row[history : history + kept], memory_of(w, slot))
            restore_contact(w, c, a, b)
        else:
            lost += 1
        at = history + kept
    at = unused_span(w, row)[1]
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        if row[at] <= 0.0:
            b.pause, b.last_pause = int(-row[at]) % PAUSE_LIMIT, int(-row[at]) // PAUSE_LIMIT
        elif b.active != 0 or b.tree != 0:
            b.asleep, b.still = 1, 1
            copy(row[at + 1 : at + SLEEP], b.held)
        at += SLEEP
    for i in range(w.pair_count):
        copy(row[at : at + LEDGER], pair_at(w.pairs, i).ledger)
        at += LEDGER
    return lost


def clear_state(w):
    """Set the state of a row of zeros: no contacts, no sleeping bodies, near pairs to be listed, empty ledgers."""
    w.nears = 0
    w.stale = 1
    w.spares, w.rested = w.contact_room, 0
    for i in range(w.slots):
        contact_at(w.contacts, i).phase = FREE
        set_whole(w.spare, w.contact_room - 1 - i, i)
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.asleep, b.active, b.pause, b.last_pause = 0, 0, 0, 0
        b.still = 1 if is_static(b) else 0  # of one that slept it would count as if it could not leave its place
        clear(b.held)
    for i in range(w.pair_count):
        clear(pair_at(w.pairs, i).ledger)


def forget_motion(w):
    """Zero the bodies' velocities and accelerations, which set margins of near pairs; the caller sets new ones."""
    w.stale = 1
    for i in range(w.body_count):
        forget_motion_of(body_at(w.bodies, i))


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


def restore_contact(w, c, a, b):
    """Close a contact that has been read, of shapes a and b, by their present pair of materials."""
    sa, sb, pair = shape_at(w.shapes, a), shape_at(w.shapes, b), pair_of(w, a, b)
    t, law, own = c.touch, law_of(w, pair_at(w.pairs, pair)), pair_at(w.pairs, pair).radius
    if law.speeds == 0.0:
        mu = friction_of(pair_at(w.pairs, pair), sa, sb)
        if t.mu != mu:  # the user has changed it since
            t.friction = mu
        t.mu, t.zeta = mu, law.zeta
    t.friction = min(t.friction, t.mu)  # less than mu where the contact spins
    t.radius = own if own > 0.0 else t.radius
    t.e_star, t.g_star = t.share * law.e_star, t.share * law.g_star
    c.phase = CLOSED if t.overlap > 0.0 else PARTED
    c.near = -1
    c.shape_a, c.shape_b, c.body_a, c.body_b, c.pair = a, b, sa.body, sb.body, pair
    body_at(w.bodies, sa.body).active = 1
    body_at(w.bodies, sb.body).active = 1


jit_module(__name__)
