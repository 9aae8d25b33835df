"""Superposition of Hertz-shaped tractions along a load history: the compiled core of `superposition`.

Units: E* = R = m_N = 1; tangential quantities scaled so that friction and stiffness ratio drop out: traction q/mu,
force F/mu, displacement s = kappa s_x/mu, velocity psi = ds/dt.

With h_b(r) = (2/pi) sqrt(b^2 - r^2) for r < b, 0 outside, Coulomb's limit on a contact of radius a is h_a. The
traction h_b has the resultant 4/3 b^3 and moves the surface inside b by b^2 - r^2/2: the difference h_c - h_b, b < c,
moves all of r < b alike, by c^2 - b^2. The state is a stack of components with rising radii b_1 < ... < b_n = a,

    q = sum_i t_i (h_{b_i} - h_{b_{i-1}})        F = sum_i t_i 4/3 (b_i^3 - b_{i-1}^3)        b_0 = 0, |t_i| <= 1

t_i being the ratio dF/(mu dP) at which the contact would grow from b_{i-1} to b_i under the oblique loading that leaves
this traction. An increment (a -> a', ds) has one of three answers (Mindlin & Deresiewicz 1953), e = +-1:

    growth, |ds| <= a'^2 - a^2    no slip; a component (a', ds/(a'^2 - a^2)) is added
    growth, |ds| > a'^2 - a^2     slip from the edge down to c, in the sense e of ds
    no growth                     what lay outside a' is lost; it carried the displacement g = sum t (b^2 - b_-^2) over
                                  that rim. Slip from a' down to c, in the sense e of ds + g; none if that is zero

Slip means that the ring between c and a' carries its limit e (h_a' - h_c), in place of what was there. The disc r < c
has then moved by e (a'^2 - c^2) - sum t (b^2 - b_-^2), the sum taken over all the old state outside c. This must be ds.
It depends on c monotonically, because |t| <= 1: there is one c, or gross slip. Components outside c are swallowed.

Along a straight path of overlap and displacement these answers hold for an increment of any length.

Sources: Mindlin & Deresiewicz, J. Appl. Mech. 20 (1953) 327-344; Maw, Barber & Fawcett, J. Lubr. Tech. 103 (1981)
74-80, the first method; Johnson, Contact Mechanics (1985), sections 7.2 to 7.4.
"""

import math

import numba
import numpy as np

NEWTON_STEPS = 60  # bound only; from the outer radius a convex function needs a handful


@numba.njit(cache=True)
def hertz_force(b: float) -> float:
    """Resultant of h_b."""
    return 4.0 / 3.0 * b**3


@numba.njit(cache=True)
def resultant(radii, ratios, count) -> float:
    """F/mu: the sum over all components."""
    total, inner = 0.0, 0.0
    for i in range(count):
        total += ratios[i] * (radii[i] ** 3 - inner**3)
        inner = radii[i]
    return 4.0 / 3.0 * total


@numba.njit(cache=True)
def traction(radii, ratios, count, r) -> float:
    """q/mu at radius r: the sum over the components that reach it."""
    total, inner = 0.0, 0.0
    for i in range(count):
        if radii[i] > r:
            total += ratios[i] * (math.sqrt(radii[i] ** 2 - r * r) - math.sqrt(max(inner * inner - r * r, 0.0)))
        inner = radii[i]
    return 2.0 / math.pi * total


@numba.njit(cache=True)
def stick_radius(outer, weight, compliance) -> float:
    """Radius c at which (outer^2 - c^2) + compliance 4/3 (outer^3 - c^3) = weight, by Newton's method."""
    if compliance == 0.0:
        return math.sqrt(max(outer * outer - weight, 0.0))
    rest = outer * outer + compliance * hertz_force(outer) - weight
    c = outer
    for _ in range(NEWTON_STEPS):
        if c <= 0.0:
            return 0.0
        change = (c * c + compliance * hertz_force(c) - rest) / (2.0 * c + 4.0 * compliance * c * c)
        c -= change
        if abs(change) <= 1e-15 * outer:
            break
    return max(c, 0.0)


@numba.njit(cache=True)
def shrink(radii, ratios, count, edge) -> tuple[int, float, float]:
    """Drop what lies outside a smaller edge > 0: components left, displacement and force that the lost rim carried."""
    displacement, force = 0.0, 0.0
    while True:
        outer, ratio = radii[count - 1], ratios[count - 1]
        inner = radii[count - 2] if count > 1 else 0.0
        kept = max(inner, edge)
        displacement += ratio * (outer * outer - kept * kept)
        force += ratio * (hertz_force(outer) - hertz_force(kept))
        if inner < edge:
            radii[count - 1] = edge
            return count, displacement, force
        count -= 1


@numba.njit(cache=True)
def advance(radii, ratios, count, edge, free, compliance) -> tuple[int, float]:
    """One increment: the contact radius becomes edge, the displacement changes by free - compliance F.

    The first `count` radii b_i, rising, and ratios t_i are changed in place, with room for one component more. edge:
    new contact radius, 0 out of contact; free: increment of displacement without any force at its end; compliance: its
    fall per unit of F/mu there, 0 for a prescribed one. Returns the new number of components, and the new F/mu.
    """
    if edge <= 0.0:
        return 0, 0.0
    old_edge = radii[count - 1] if count > 0 else 0.0
    force = resultant(radii, ratios, count)
    moved = 0.0
    if edge > old_edge:
        area = edge * edge - old_edge * old_edge
        volume = hertz_force(edge) - hertz_force(old_edge)
        ratio = (free - compliance * force) / (area + compliance * volume)
        if abs(ratio) <= 1.0:
            radii[count], ratios[count] = edge, ratio
            return count + 1, force + ratio * volume
        sense = math.copysign(1.0, ratio)
        moved = sense * area
        force += sense * volume
    else:
        if edge < old_edge:
            count, lost_displacement, lost_force = shrink(radii, ratios, count, edge)
            moved -= lost_displacement
            force -= lost_force
        if free - moved - compliance * force == 0.0:
            return count, force
        sense = math.copysign(1.0, free - moved - compliance * force)

    # Slip from the edge inwards: component after component is swallowed, until the disc inside has moved far enough.
    short = sense * (free - moved - compliance * force)
    while count > 0:
        outer = radii[count - 1]
        inner = radii[count - 2] if count > 1 else 0.0
        reversal = 1.0 - sense * ratios[count - 1]  # 0 where it slips this way already, 2 where it slipped the other
        volume = reversal * (hertz_force(outer) - hertz_force(inner))
        gain = reversal * (outer * outer - inner * inner) + compliance * volume
        if gain > short:
            c = min(max(stick_radius(outer, short / reversal, compliance), inner), outer)
            force += sense * reversal * (hertz_force(outer) - hertz_force(c))
            if c > inner:
                radii[count - 1] = c
            else:
                count -= 1
            break
        short -= gain
        force += sense * volume
        count -= 1
    if count == 0:
        force = sense * hertz_force(edge)
    if count > 0 and (radii[count - 1] == edge or ratios[count - 1] == sense):
        count -= 1  # no ring left outside c, or one ring of slip with what lies within: the component is replaced
        if radii[count] == edge:
            return count + 1, force
    radii[count], ratios[count] = edge, sense
    return count + 1, force


@numba.njit(cache=True)
def march_impact(time, overlap, speed, psi_1, chi, psi_out, force_out, components_out):
    """Free tangential motion over a normal motion d'' = -P without damper.

    The share F/(mu P) runs on a straight line from end to end of a step, so that gross slip is exact; where there is no
    contact (first and last instant) the value of the other end holds for the whole step. The normal force enters by its
    exact moments over the step: its impulse v_0 - v_1, and v_0 dt - (d_1 - d_0) = integral of (t_1 - t) P.

    Shape (n,) each: instants from touch to release, overlap d, zero at the ends only, and dd/dt; found: tangential
    velocity, F/mu and the number of components. psi_1: velocity at first; chi: (kappa/2) m_N/m_T.
    """
    last = time.size - 1
    radii, ratios = np.empty(last + 2), np.empty(last + 2)
    count = 0
    psi, share = psi_1, 0.0
    psi_out[0], force_out[0], components_out[0] = psi, 0.0, 0
    for k in range(1, last + 1):
        step = time[k] - time[k - 1]
        impulse = speed[k - 1] - speed[k]
        moment = speed[k - 1] * step - (overlap[k] - overlap[k - 1])
        if k == last:
            psi -= 2.0 * chi * impulse * share
            count, force = 0, 0.0
        else:
            # Shares of the ends in impulse (1/2, 1/2) and moment (2/3, 1/3).
            in_impulse, in_moment = (1.0, 1.0) if k == 1 else (0.5, 1.0 / 3.0)
            edge = math.sqrt(overlap[k])
            limit = hertz_force(edge)
            free = step * psi - 2.0 * chi * moment * (1.0 - in_moment) * share
            count, force = advance(radii, ratios, count, edge, free, 2.0 * chi * moment * in_moment / limit)
            new_share = force / limit
            psi -= 2.0 * chi * impulse * ((1.0 - in_impulse) * share + in_impulse * new_share)
            share = new_share
        psi_out[k], force_out[k], components_out[k] = psi, force, count


@numba.njit(cache=True)
def march_path(overlap, displacement, points, force_out, traction_out, components_out):
    """Prescribed path of overlap and scaled displacement, straight from instant to instant; it begins without traction.

    overlap: zero or less out of contact, zero where contact begins or ends, shape (n,). Found: F/mu, shape (n,), q/mu
    at the points, shape (n, m), and the number of components, shape (n,).
    """
    radii, ratios = np.empty(overlap.size + 1), np.empty(overlap.size + 1)
    count, force = 0, 0.0
    if overlap[0] > 0.0:
        radii[0], ratios[0], count = math.sqrt(overlap[0]), 0.0, 1
    for k in range(overlap.size):
        if k > 0:
            edge = math.sqrt(max(overlap[k], 0.0))
            count, force = advance(radii, ratios, count, edge, displacement[k] - displacement[k - 1], 0.0)
        force_out[k], components_out[k] = force, count
        for j in range(points.size):
            traction_out[k, j] = traction(radii, ratios, count, points[j])
