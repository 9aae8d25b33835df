"""Copies of bodies and contacts, by address, to which they can be set back."""

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_module
from contactlaw.laws.record import SLIDING, SPRUNG, UNSHEARED
from contactlaw.memory import copy_wholes, doubles_at, same_wholes
from contactlaw.world.data import records
from contactlaw.world.data.access import body_at, contact_at, pair_at
from contactlaw.world.data.materials import law_of

FIELDS = records.CONTACT.fields or {}
KNOWN_NUMBERS = FIELDS["phase"][1] // 8  # the first fields of a contact, the state of its laws
EVALUATED_NUMBERS = FIELDS["force"][1] // 8  # of a contact that an evaluation in an implicit step may change
LEDGER_NUMBER = FIELDS["impulse"][1] // 8  # number of a contact with which its ledger begins
BODY_NUMBERS, CONTACT_NUMBERS = records.BODY.itemsize // 8, records.CONTACT.itemsize // 8


def body_address(bodies, i):
    """Return the address of body i of those at an address."""
    return bodies + 8 * BODY_NUMBERS * i


def scratch_body(w, i, place, time):
    """Copy body i to one of the two scratch places; returns the copy.

    If the place has a copy that has flown to a time [s] from what body i still is, that is left as it is.
    """
    b, source = body_address(w.bodies, i), body_address(w.saved_bodies, place + 2)
    copy = body_at(w.saved_bodies, place)
    if copy.time != time or not same_wholes(b, source, BODY_NUMBERS):
        copy_wholes(b, source, BODY_NUMBERS)
        copy_wholes(b, body_address(w.saved_bodies, place), BODY_NUMBERS)
    return copy


def save_body(w, i):
    """Save a copy of body i, for `saved_body` and `restore_body`."""
    copy_wholes(body_address(w.bodies, i), body_address(w.saved_bodies, i + records.SCRATCH), BODY_NUMBERS)


def saved_body(w, i):
    """Return body i as it was saved."""
    return body_at(w.saved_bodies, i + records.SCRATCH)


def restore_body(w, i):
    """Set body i back to its saved copy."""
    copy_wholes(body_address(w.saved_bodies, i + records.SCRATCH), body_address(w.bodies, i), BODY_NUMBERS)


def copy_row(source, target, slot, size, count):
    """Copy the first `count` numbers of a row of `size` numbers."""
    copy_wholes(source + 8 * size * slot, target + 8 * size * slot, count)


def contact_fields(w, slot, first, count):
    """Return a view of `count` numbers of a contact's record from the one of number `first` on."""
    return carray(doubles_at(w.contacts + 8 * (CONTACT_NUMBERS * slot + first)), count)


def history_kept(w, slot):
    """Return how many numbers of a law's history matter: none in a slide of micro-slip, all only to `laws.sectors`."""
    c = contact_at(w.contacts, slot)
    state, law = c.touch.state, law_of(w, pair_at(w.pairs, c.pair))
    slides = state == SLIDING and law.sectors != 0.0 and c.touch.skew == 0.0
    return 0 if slides else 2 * int(law.vectors) if state in (SPRUNG, UNSHEARED) else w.memory_size


def save_contact(w, slot):
    """Save a copy of the contact in a slot, and of its law's history."""
    copy_row(w.contacts, w.saved_contacts, slot, CONTACT_NUMBERS, CONTACT_NUMBERS)
    copy_row(w.memory, w.saved_memory, slot, w.memory_size, history_kept(w, slot))


def restore_contact(w, slot, count=EVALUATED_NUMBERS):
    """Set a contact, but for its ledger, and its law's history back to the saved copy.

    count: of its first numbers; KNOWN_NUMBERS: the state of its laws alone.
    """
    copy_row(w.saved_contacts, w.contacts, slot, CONTACT_NUMBERS, count)
    copy_row(w.saved_memory, w.memory, slot, w.memory_size, history_kept(w, slot))


jit_module(__name__)
