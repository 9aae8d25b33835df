"""One contact inside a rigid-body engine: from the relative velocity at the contact point to the force on body A."""

from __future__ import annotations

from math import cos, sin, sqrt

from contactlaw.jit import jit
from contactlaw.kernels.contact import AXIS, DIRECTION, PLANAR, TANGENT, step


@jit
def contact_force(p, h, normal, velocity, spin, overlap, dt, mass, tangential_mass, h_out, force_out):
    """Advance a contact by one engine step; h is read, h_out (same size) and force_out (3) are written.

    p, h: as in `kernels.contact`. normal: unit vector from B to A. velocity: of A relative to B at the contact point,
    half a step before now, as a semi-implicit engine has it [m/s]. spin: mean angular velocity of A and B about the
    normal [rad/s]. overlap [m]. dt: engine step [s]. mass, tangential_mass: effective [kg], read at a touch alone.
    force_out: on A [N], world frame. The tractions turn with the contact: their frame follows the normal without
    twist, and the mean spin of the bodies about it.
    """
    tx, ty, tz = tangent(p, h, normal, spin * dt)
    nx, ny, nz = normal[0], normal[1], normal[2]
    bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    closing = -(velocity[0] * nx + velocity[1] * ny + velocity[2] * nz)
    du = dt * (velocity[0] * tx + velocity[1] * ty + velocity[2] * tz)
    dv = 0.0 if p[PLANAR] != 0.0 else dt * (velocity[0] * bx + velocity[1] * by + velocity[2] * bz)
    force, f, g = step(p, h, overlap, closing, du, dv, dt, mass, tangential_mass, h_out)
    if overlap > 0.0:
        h_out[TANGENT], h_out[TANGENT + 1], h_out[TANGENT + 2] = tx, ty, tz
        h_out[DIRECTION], h_out[DIRECTION + 1], h_out[DIRECTION + 2] = nx, ny, nz
    force_out[0] = force * nx - f * tx - g * bx
    force_out[1] = force * ny - f * ty - g * by
    force_out[2] = force * nz - f * tz - g * bz


@jit
def tangent(p, h, normal, twist):
    """First tangent of the contact frame now: the last one brought into the new tangent plane and turned by twist."""
    nx, ny, nz = normal[0], normal[1], normal[2]
    if p[PLANAR] != 0.0:
        ax, ay, az = p[AXIS], p[AXIS + 1], p[AXIS + 2]
        x, y, z = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    else:
        x, y, z = h[TANGENT], h[TANGENT + 1], h[TANGENT + 2]
        ox, oy, oz = h[DIRECTION], h[DIRECTION + 1], h[DIRECTION + 2]
        lean = max(1.0 + nx * ox + ny * oy + nz * oz, 1e-300)
        along = (x * nx + y * ny + z * nz) / lean  # the shortest rotation from the old normal to the new one
        x, y, z = x - along * (nx + ox), y - along * (ny + oy), z - along * (nz + oz)
        if (
            lean < 1.0 or x * x + y * y + z * z < 0.5
        ):  # no contact yet, or a normal that has jumped: any tangent will do
            if abs(nx) < 0.6:
                x, y, z = 0.0, nz, -ny
            else:
                x, y, z = -nz, 0.0, nx
        elif twist != 0.0:
            c, s = cos(twist), sin(twist)
            cx, cy, cz = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
            x, y, z = c * x + s * cx, c * y + s * cy, c * z + s * cz
    size = max(sqrt(x * x + y * y + z * z), 1e-300)  # zero only where a plane of motion does not hold the normal
    return x / size, y / size, z / size
