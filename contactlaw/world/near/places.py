"""Pairs of a shape and a height field that may touch in several places: how many they are, and what they share.

An open pair seeks the nearest place that no closed one has, see `geometry.meet_place`: so all open ones know the same.
"""

from contactlaw.jit import jit
from contactlaw.world.data.access import field_at, near_at
from contactlaw.world.data.kinds import DISC, ELLIPSOID, HEIGHT_FIELD, SEGMENT
from contactlaw.world.data.vec import dot, load
from contactlaw.world.shapes.core import CROWN
from contactlaw.world.shapes.geometry import PLACES


@jit
def places_of(sa, sb):
    """Return in how many places shape A may touch B, more than one of a height field.

    A ball has one where no valley is narrower than itself. A line has none where no ridge is as sharp as that its
    middle can be lower over it than both ends are, by what it is set back.
    """
    if sb.kind != HEIGHT_FIELD or sa.kind == DISC or sa.kind == ELLIPSOID:
        return 1
    field = field_at(sb.points, 0)
    if sa.kind < SEGMENT:
        return PLACES if field.valley * sa.radius > 1.0 else 1
    return PLACES if 0.5 * field.ridge * dot(load(sa.half), load(sa.half)) > CROWN * sa.radius else 0


@jit
def takes_known_gap(w, p, now):
    """Return whether an earlier open pair of the same shape and field seeks the same place.

    If so, sets what that pair knows. now: time of the step [s] at which its gap must have been found; -1: at any.
    """
    for i in range(p.first, p.first + p.places):
        q = near_at(w.near, i)
        if q.closed == 0:
            if q.b == p.b or (now >= 0.0 and q.checked != now):
                return False
            p.toi, p.gap, p.closing, p.acceleration = q.toi, q.gap, q.closing, q.acceleration
            p.checked, p.path_limit, p.listed_gap = q.checked, q.path_limit, q.listed_gap
            return True
    return False
