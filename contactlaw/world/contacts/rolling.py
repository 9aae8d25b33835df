"""Rolling resistance in a world: the moments across the normal of contacts whose pair has it."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws import rolling
from contactlaw.laws.record import LASTING
from contactlaw.world.bodies.motion import spin_change
from contactlaw.world.contacts.force import is_quasi_static, rolling_resistance
from contactlaw.world.data.access import body_at
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, scale, sub


@jit_inside
def update_rolled(c, a, b):
    """What A has rolled over B in the last substep: angles about both tangents [rad]."""
    e = load(c.tangent)
    both = sub(load(a.twist), load(b.twist))
    c.rolled[0], c.rolled[1] = dot(both, e), dot(both, cross(load(c.normal), e))


@jit_inside
def advance_rolling(w, c, rate):
    """New moments of a closed contact that has its forces; rate: of both angles [rad/s]."""
    t, resistance = c.touch, rolling_resistance(w, c)
    left = rolling.roll(c.bend, t, resistance, c.rolled[0], c.rolled[1])
    drag = rolling_dashpot(w, c, resistance)
    u, v = c.bend[0] + drag * rate[0], c.bend[1] + drag * rate[1]
    limit = resistance * t.radius * t.force
    share = min(limit / sqrt(u * u + v * v + 1e-300), 1.0)
    c.bending[0], c.bending[1], c.rolled[2] = share * u, share * v, share * left


@jit_inside
def rolling_dashpot(w, c, resistance):
    """Dashpot [N m s] of a contact that lasts and hardly moves: what rolls no more would swing for ever."""
    t, e = c.touch, load(c.tangent)
    if t.course != LASTING or t.zeta == 0.0 or not is_quasi_static(c, 1.0):
        return 0.0
    light = dot(e, spin_change(body_at(w.bodies, c.body_a), e)) + dot(e, spin_change(body_at(w.bodies, c.body_b), e))
    return 2.0 * rolling.CALM * sqrt(rolling.stiffness(t, resistance) / light)


@jit_inside
def rolling_moment(c):
    """Moment on B [N m] of a contact's resistance to rolling; on A it is the opposite."""
    e = load(c.tangent)
    return axpy(c.bending[0], e, scale(c.bending[1], cross(load(c.normal), e)))


@jit_inside
def rolling_axes(c):
    """Unit vectors along the moment, and across it and the normal."""
    moment = rolling_moment(c)
    size = norm(moment)
    along = scale(1.0 / size, moment) if size > 0.0 else load(c.tangent)
    return along, cross(load(c.normal), along)


@jit_inside
def moment_of(c):
    """Moment on B [N m] of a contact: about its normal, and across it."""
    about = scale(c.torsion.moment, load(c.normal))
    return add(rolling_moment(c), about) if c.bending[0] != 0.0 or c.bending[1] != 0.0 else about
