"""What is doubtful about a contact, of which adapters of engines warn."""

from contactlaw.jit import jit_inside
from contactlaw.pair import DEEPEST, FOUND_IN, PASSING, TOO_DEEP
from contactlaw.world.data.access import pair_at
from contactlaw.world.shapes.curvature import UNCLEAR, radius_is_clear
from contactlaw.world.shapes.geometry import IGNORED

DEEP, PUT_IN, UNCLEAR_RADIUS, PASSES_THROUGH = DOUBTS = 1, 2, 4, 8
TEXTS = {DEEP: TOO_DEEP, PUT_IN: FOUND_IN, UNCLEAR_RADIUS: UNCLEAR, PASSES_THROUGH: PASSING}
"""Warnings; {} stands for `doubt_value`."""


@jit_inside
def doubts_of(w, c):
    """Return the bits of what is doubtful about a contact: an overlap too deep for Hertz, one taken off, its radius."""
    bits = DEEP if c.deepest > DEEPEST * c.touch.radius else 0
    if c.initial_overlap > 0.0:
        bits |= PUT_IN if c.initial_overlap < IGNORED else PASSES_THROUGH
    given = pair_at(w.pairs, c.pair).radius > 0.0
    return bits if given or radius_is_clear(w, c) else bits | UNCLEAR_RADIUS


@jit_inside
def doubt_value(c, bit):
    """Return the number that the warning of a doubt gives."""
    radius = c["touch"]["radius"]
    return radius if bit == UNCLEAR_RADIUS else (c["deepest"] if bit == DEEP else c["initial_overlap"]) / radius
