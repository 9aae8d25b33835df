"""One contact advanced by one step: its normal force, then its law."""

from __future__ import annotations

from contactlaw.jit import jit_inline as jit
from contactlaw.laws.hertz import greatest_overlap, hertz_stiffness, normal_force, stiffness_foreseen
from contactlaw.laws.oscillator import restitution
from contactlaw.laws.record import EXPANDING, LASTING, OPEN, PRESSED, SLIDING, SPRUNG, SPUN, ask_force

# Of the greatest overlap foreseen: the steps' own error must not outgrow it. The square of 1.02, of a contact radius.
MARGIN = 1.0404


@jit
def know(contact, pair, radius):
    """Tell a contact of its pair and its effective radius [m]; nothing else is known of it yet."""
    contact.e_star, contact.g_star = pair.e_star, pair.g_star
    contact.radius, contact.friction = radius, pair.friction
    contact.mu, contact.zeta = pair.friction, pair.zeta
    contact.state, contact.course, contact.ratio = OPEN, PRESSED, 1.0
    contact.force, contact.elastic, contact.f, contact.g = 0.0, 0.0, 0.0, 0.0
    contact.scale, contact.reach, contact.stiffness = 0.0, 0.0, hertz_stiffness(contact)
    contact.skew = 0.0


@jit
def touch(contact, linear):
    """What the rest of the contact needs from its first instant; overlap, closing speed and masses are in place."""
    deepest = greatest_overlap(contact.stiffness, contact.mass, max(contact.before, 0.0), contact.closing)
    # A damped impact reaches sqrt(e) of it in the oscillator's measure, delta^1.25.
    damped = deepest * restitution(contact.zeta) ** 0.4
    # The overlap is more in a step that is too long, or of a contact that did not come by its speed.
    contact.stiffness = stiffness_foreseen(contact, linear, max(deepest, contact.overlap))
    contact.reach = MARGIN * max(damped, contact.overlap)


@jit
def prescribe(contact, pair, deepest):
    """Begin a contact whose normal motion is given, up to an overlap [m]: nothing that touches it changes that."""
    know(contact, pair, pair.radius)
    contact.mass, contact.tangential_mass, contact.closing = 1e300, 1e300, 1.0
    contact.stiffness, contact.reach = stiffness_foreseen(contact, pair.linear != 0.0, deepest), deepest


@jit
def ask(contact, pair, law, memory, du, dv, dt):
    """The law's tangential force, for the normal forces that the contact has; see `record.ask_force`."""
    if contact.state == SPUN or contact.skew != 0.0:
        return
    if contact.friction == 0.0:
        contact.state = SLIDING
        return
    contact.f, contact.g = ask_force(pair, contact, law, memory, du, dv, dt)
    if contact.state == OPEN:
        contact.state = SPRUNG


@jit
def press(contact, pair, free, dt):
    """Advance the normal force of a contact to the overlap > 0 that it has now.

    contact: `record.CONTACT` that knows its pair; overlap, before and closing are of this step, mass and
    tangential_mass of the touch. free, dt: as for `hertz.normal_force`.
    """
    if contact.state == OPEN:
        touch(contact, pair.linear != 0.0)
    contact.force, contact.ratio = normal_force(contact, pair, free, dt)
    if contact.course == PRESSED and contact.ratio < 1.0:
        contact.course = EXPANDING
    elif contact.course == EXPANDING and contact.ratio >= 1.0:
        contact.course = LASTING
