"""One contact over one step: first its normal force, then the law's tangential force."""

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws.hertz import BY_ITSELF, greatest_overlap, hertz_stiffness, normal_force, stiffness_foreseen
from contactlaw.laws.oscillator import restitution
from contactlaw.laws.record import EXPANDING, LASTING, OPEN, PRESSED, SLIDING, SPRUNG, ask_force

MARGIN = 1.0404  # on the greatest overlap foreseen, for errors of the steps: 1.02 squared, 2 % of the contact radius


def reset(contact, pair, radius):
    """Make an open contact of a pair with an effective radius [m]; the caller sets motion and masses."""
    contact.e_star, contact.g_star = pair.e_star, pair.g_star
    contact.radius, contact.friction = radius, pair.friction
    contact.mu, contact.zeta = pair.friction, pair.zeta
    contact.state, contact.course, contact.ratio = OPEN, PRESSED, 1.0
    contact.force, contact.elastic, contact.f, contact.g = 0.0, 0.0, 0.0, 0.0
    contact.scale, contact.reach, contact.stiffness = 0.0, 0.0, hertz_stiffness(contact)
    contact.skew, contact.share, contact.slid_limit = 0.0, 1.0, 0.0


def touch(contact, linear):
    """Set stiffness and reach at the first instant of a contact; its overlap, closing speed and masses must be set."""
    deepest = greatest_overlap(contact.stiffness, contact.mass, max(contact.before, 0.0), contact.closing)
    # A damped impact reaches sqrt(e) of the undamped delta^1.25 (`oscillator`).
    damped = deepest * restitution(contact.zeta) ** 0.4
    # The overlap exceeds `deepest` if the step is too long, or if the contact began with an overlap.
    contact.stiffness = stiffness_foreseen(contact, linear, max(deepest, contact.overlap))
    contact.reach = MARGIN * max(damped, contact.overlap)


def prescribe(contact, pair, deepest):
    """Make a contact whose normal motion is prescribed, up to a greatest overlap [m]; its masses are infinite."""
    reset(contact, pair, pair.radius)
    contact.mass, contact.tangential_mass, contact.closing = 1e300, 1e300, 1.0
    contact.stiffness, contact.reach = stiffness_foreseen(contact, pair.linear != 0.0, deepest), deepest


def ask(contact, pair, law, memory, du, dv, dt):
    """Update the tangential force of a contact by its law, for its present normal forces; see `record.ask_force`."""
    if contact.friction == 0.0:
        contact.state = SLIDING
        return
    contact.f, contact.g = ask_force(pair, contact, law, memory, du, dv, dt)
    if contact.state == OPEN:
        contact.state = SPRUNG


def press(contact, pair, dt, motion=BY_ITSELF):
    """Update the normal force and the course of a contact for its present overlap > 0; return `hertz.normal_force`.

    contact: `record.CONTACT` after `reset`, with overlap, before and closing of this step, and mass and tangential_mass
    of the touch. dt, motion: as for `hertz.normal_force`.
    """
    if contact.state == OPEN:
        touch(contact, pair.linear != 0.0)
    force, ratio = normal_force(contact, pair, dt, motion)
    contact.force, contact.ratio = max(force, 0.0), max(ratio, 0.0)
    if contact.course == PRESSED and contact.ratio < 1.0:
        contact.course = EXPANDING
    elif contact.course == EXPANDING and contact.ratio >= 1.0:
        contact.course = LASTING
    return force


jit_module(__name__, jit_inline)
