"""Rolling resistance of contacts: moments across the normal."""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.laws import rolling
from contactlaw.laws.record import LASTING
from contactlaw.world.bodies.motion import spin_change
from contactlaw.world.contacts.force import is_quasi_static, rolling_resistance
from contactlaw.world.data.access import body_at
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, scale


def advance_rolling(w, c, rate):
    """Update the moments of a closed contact after its forces; rate: of both angles, A over B [rad/s]."""
    t, resistance = c.touch, rolling_resistance(w, c)
    left = rolling.roll(c.bend, t, resistance, c.rolled[0], c.rolled[1])
    drag = rolling_dashpot(w, c, resistance)
    u, v = c.bend[0] + drag * rate[0], c.bend[1] + drag * rate[1]
    limit = resistance * t.radius * t.force
    share = min(limit / sqrt(u * u + v * v + 1e-300), 1.0)
    c.bending[0], c.bending[1], c.rolled[2] = share * u, share * v, share * left


def rolling_dashpot(w, c, resistance):
    """Return the rolling dashpot [N m s] of a quasi-static persistent contact with damping; else zero.

    Without it a body that has stopped rolling would swing on the spring for ever.
    """
    t, e = c.touch, load(c.tangent)
    if t.course != LASTING or t.zeta == 0.0 or not is_quasi_static(c, 1.0):
        return 0.0
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    mobility = dot(e, spin_change(a, e)) + dot(e, spin_change(b, e))
    return 2.0 * rolling.CALM * sqrt(rolling.stiffness(t, resistance) / mobility)


def rolling_moment(c):
    """Return the moment of rolling resistance on B [N m]; that on A is opposite."""
    e = load(c.tangent)
    return axpy(c.bending[0], e, scale(c.bending[1], cross(load(c.normal), e)))


def rolling_axes(c):
    """Return the unit vector along the moment of rolling resistance, and that across it and the normal."""
    moment = rolling_moment(c)
    size = norm(moment)
    along = scale(1.0 / size, moment) if size > 0.0 else load(c.tangent)
    return along, cross(load(c.normal), along)


def moment_of(c):
    """Return the moment of a contact on B [N m]: torsion and rolling resistance."""
    about = scale(c.torsion.moment, load(c.normal))
    return add(rolling_moment(c), about) if c.bending[0] != 0.0 or c.bending[1] != 0.0 else about


jit_module(__name__)
