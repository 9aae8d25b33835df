"""The frame of a contact inside a rigid-body engine, and how it turns from step to step."""

from __future__ import annotations

from math import cos, sin, sqrt

from contactlaw.jit import jit
from contactlaw.kernels.contact import DIRECTION, TANGENT
from contactlaw.kernels.rows import FRAME


@jit
def turn_frame(h_io, normal, twist, row_out):
    """Frame of a contact whose unit normal from B to A is this now, to its row and history.

    The tractions turn with it: the frame follows the normal without twist, and then the mean angle [rad] that both
    bodies have turned about it in the last step.
    """
    x, y, z = tangent(h_io, normal, twist)
    nx, ny, nz = normal[0], normal[1], normal[2]
    h_io[TANGENT], h_io[TANGENT + 1], h_io[TANGENT + 2] = x, y, z
    row_out[FRAME + 3], row_out[FRAME + 4], row_out[FRAME + 5] = x, y, z
    row_out[FRAME + 6], row_out[FRAME + 7], row_out[FRAME + 8] = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
    for i in range(3):
        h_io[DIRECTION + i] = normal[i]
        row_out[FRAME + i] = -normal[i]


@jit
def tangent(h, normal, twist):
    """First tangent of the contact frame now: the last one brought into the new tangent plane and turned by twist."""
    nx, ny, nz = normal[0], normal[1], normal[2]
    x, y, z = h[TANGENT], h[TANGENT + 1], h[TANGENT + 2]
    ox, oy, oz = h[DIRECTION], h[DIRECTION + 1], h[DIRECTION + 2]
    lean = max(1.0 + nx * ox + ny * oy + nz * oz, 1e-300)
    along = (x * nx + y * ny + z * nz) / lean  # the shortest rotation from the old normal to the new one
    x, y, z = x - along * (nx + ox), y - along * (ny + oy), z - along * (nz + oz)
    if lean < 1.0 or x * x + y * y + z * z < 0.5:  # no contact yet, or a normal that has jumped: any tangent will do
        if abs(nx) < 0.6:
            x, y, z = 0.0, nz, -ny
        else:
            x, y, z = -nz, 0.0, nx
    elif twist != 0.0:
        c, s = cos(twist), sin(twist)
        cx, cy, cz = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
        x, y, z = c * x + s * cx, c * y + s * cy, c * z + s * cz
    size = sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size
