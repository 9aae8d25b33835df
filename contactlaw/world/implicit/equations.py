"""Linear equations H x = r in the velocities of an island, solved within the envelope of H.

The envelope of a row reaches from its first entry that is not zero, or that of the column of the same number, to the
diagonal. The factors L U = H have no entries outside of it (George & Liu, Computer Solution of Large Sparse Positive
Definite Systems, 1981, chapter 4), so that the cost of a chain of bodies is proportional to its length.
"""

from contactlaw.jit import jit_module
from contactlaw.world.trees.kinematics import vector

LARGEST = 128  # unknowns; for larger islands substeps are cheaper
# Numbers of vectors, see `vector_of`
RIGHT_SIDE, VELOCITY, START_VELOCITY, DISPLACEMENT, FREE_VELOCITY, ACCELERATION = range(6)
JACOBIAN_N, JACOBIAN_U, JACOBIAN_V, JACOBIAN_SPIN, ENVELOPE = range(6, 11)
VECTORS = ENVELOPE + 1


def room_for(unknowns: int) -> tuple[int, int]:
    """Return the shape of the working memory for so many unknowns: H, the vectors as rows below it, then M."""
    size = min(unknowns, LARGEST)
    return 2 * size + VECTORS, size


def matrix(w):
    """Return H, later its factors, shape (unknown_room, unknown_room)."""
    return vector(w.equations, (w.unknown_room, w.unknown_room))


def mass_matrix(w):
    """Return M, the mass matrix of the bodies, shape (unknown_room, unknown_room); it lies within the envelope."""
    return vector(mass_address(w, 0), (w.unknown_room, w.unknown_room))


def mass_address(w, i):
    """Return the address of the diagonal entry of M of unknown i."""
    return w.equations + 8 * (i + w.unknown_room * (w.unknown_room + VECTORS + i))


def vector_of(w, number):
    """Return one of the vectors, by its number; shape (unknown_room,).

    RIGHT_SIDE: r, later the solution x. VELOCITY: V at the end of a stage. START_VELOCITY: v at the start of the step.
    DISPLACEMENT: of the bodies before a stage. FREE_VELOCITY: at the end of a stage without contacts. ACCELERATION: of
    the bodies without contacts. JACOBIAN_N, _U, _V, _SPIN: rows of Jacobians of one contact: along its normal, along
    both tangents, about the normal. ENVELOPE: the first column of each row's envelope.
    """
    return vector(w.equations + 8 * w.unknown_room * (w.unknown_room + number), w.unknown_room)


def factorise(w):
    """Replace H by its factors L and U, of U the inverse diagonal. No pivots are chosen: masses keep them from zero."""
    h, first = matrix(w), vector_of(w, ENVELOPE)
    for i in range(w.unknowns):
        start, pivot = int(first[i]), h[i, i]
        for j in range(start, i):
            lower, upper = h[i, j], h[j, i]
            for k in range(max(start, int(first[j])), j):
                lower -= h[i, k] * h[k, j]
                upper -= h[j, k] * h[k, i]
            h[i, j], h[j, i] = lower * h[j, j], upper
            pivot -= h[i, j] * upper
        h[i, i] = 1.0 / pivot


def substitute(w):
    """Replace the right side by the solution."""
    h, first, x = matrix(w), vector_of(w, ENVELOPE), vector_of(w, RIGHT_SIDE)
    for i in range(w.unknowns):
        for k in range(int(first[i]), i):
            x[i] -= h[i, k] * x[k]
    for i in range(w.unknowns - 1, -1, -1):
        x[i] *= h[i, i]
        for k in range(int(first[i]), i):
            x[k] -= h[k, i] * x[i]


jit_module(__name__)
