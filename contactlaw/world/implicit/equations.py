"""Linear equations H x = r in the velocities of an island, solved within the envelope of H.

The envelope of a row reaches from its first entry that is not zero, or that of the column of the same number, to the
diagonal. The factors L U = H have no entries outside of it (George & Liu, Computer Solution of Large Sparse Positive
Definite Systems, 1981, chapter 4), so that the cost of a chain of bodies is proportional to its length.
"""

from typing import NamedTuple

from contactlaw.jit import jit_inline, jit_module
from contactlaw.world.data.records import Array
from contactlaw.world.trees.kinematics import add_multiple, entries, vector

LARGEST = 384  # unknowns; memory grows with the square


class Equations(NamedTuple):
    """The working memory of an implicit step, at `World.equations`; of each row and vector the first entries count."""

    h: Array  # H, later its factors, shape (unknown_room, unknown_room)
    right: Array  # r, later the solution x, shape (unknown_room,)
    velocity: Array  # V at the end of a stage
    begun: Array  # v at the start of the step
    moved: Array  # displacement of the bodies before a stage
    free: Array  # velocity at the end of a stage without contacts; angular momentum of anisotropic free bodies
    acceleration: Array  # of the bodies without contacts
    along_n: Array  # rows of Jacobians of one contact: along its normal,
    along_u: Array  # along both tangents,
    along_v: Array
    about: Array  # about an axis
    first: Array  # the first column of each row's envelope
    last: Array  # the last column of each row of U
    diagonal: Array  # of M + b D of trees


VECTORS = len(Equations._fields) - 1


def room_for(unknowns: int) -> tuple[int, int]:
    """Return the shape of the working memory for so many unknowns: H, and the vectors as rows below it."""
    size = min(unknowns, LARGEST)
    return size + VECTORS, size


@jit_inline
def equations_of(w):
    """Return the `Equations` of a world."""
    n = w.unknown_room
    h, v = vector(w.equations, (n, n)), vector(w.equations + 8 * n * n, (VECTORS, n))
    return Equations(h, v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11], v[12])


def factorise(w):
    """Replace H by its factors L and U, of U the inverse diagonal. No pivots are chosen: masses keep them from zero.

    Row by row, so that what is added lies side by side in memory: `last` is the last column of each row of U.
    """
    eq, end = equations_of(w), w.unknowns
    h, first, last = eq.h, eq.first, eq.last
    for i in range(end):
        last[i] = i
        for k in entries(first[i], i):
            last[k] = i
    for i in range(end):
        row = h[i]
        for k in range(int(first[i]), i):
            row[k] *= h[k, k]
            add_multiple(row, -row[k], h[k], k + 1, int(last[k]) + 1)
        row[i] = 1.0 / row[i]


def substitute(w):
    """Replace the right side by the solution."""
    eq = equations_of(w)
    h, first, last, x = eq.h, eq.first, eq.last, eq.right
    for i in range(w.unknowns):
        for k in entries(first[i], i):
            x[i] -= h[i, k] * x[k]
    for i in range(w.unknowns - 1, -1, -1):
        for k in entries(i + 1, last[i] + 1.0):
            x[i] -= h[i, k] * x[k]
        x[i] *= h[i, i]


jit_module(__name__)
