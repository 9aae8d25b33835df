"""A system of equations in the velocities of an island, H x = r: small, and dense within its envelope.

The envelope is what lies between the diagonal and the first entry of a row, or of the column of the same number, that
is not zero; the factors L U = H have no entry outside of it (George & Liu, Computer Solution of Large Sparse Positive
Definite Systems, 1981, chapter 4), so that a chain of bodies costs as much as it is long.
"""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.trees.kinematics import vector

LARGEST = 128  # unknowns at most: beyond them substeps are cheaper
RIGHT, VELOCITY, BEGUN, BEFORE, FREE, ACCELERATION, NORMAL, SIDE_U, SIDE_V, TURN, FIRST = range(11)  # see `part`


def room_for(unknowns):
    """Shape of the room for the equations of so many unknowns: the matrix, and the vectors as rows below it."""
    size = min(unknowns, LARGEST)
    return 2 * size + 11, size


@jit_inside
def matrix(w):
    """H, and then its factors; shape (unknown_room, unknown_room)."""
    return vector(w.equations, (w.unknown_room, w.unknown_room))


@jit_inside
def masses(w):
    """M of the bodies, which lies within the envelope that they begin."""
    return vector(w.equations + 8 * w.unknown_room * (w.unknown_room + 11), (w.unknown_room, w.unknown_room))


@jit_inside
def part(w, number):
    """A vector of so many unknowns, by its number.

    RIGHT: r, and then x. VELOCITY: at the end of a stage; BEGUN: of the step's start; FREE: of a stage without
    contacts. BEFORE: displacements before a stage. ACCELERATION. NORMAL, SIDE_U, SIDE_V, TURN: rows of a Jacobian.
    FIRST: where the envelope of a row begins.
    """
    return vector(w.equations + 8 * w.unknown_room * (w.unknown_room + number), w.unknown_room)


@jit_inside
def factorise(w):
    """H becomes L and U, without a choice of pivots: masses make them."""
    h, first = matrix(w), part(w, FIRST)
    for i in range(w.unknowns):
        start = int(first[i])
        for j in range(start, i):
            lower, upper = h[i, j], h[j, i]
            for k in range(max(start, int(first[j])), j):
                lower -= h[i, k] * h[k, j]
                upper -= h[j, k] * h[k, i]
            h[i, j] = lower / h[j, j]
            h[j, i] = upper
        for k in range(start, i):
            h[i, i] -= h[i, k] * h[k, i]


@jit_inside
def substitute(w):
    """The right side becomes the solution."""
    h, first, x = matrix(w), part(w, FIRST), part(w, RIGHT)
    for i in range(w.unknowns):
        for k in range(int(first[i]), i):
            x[i] -= h[i, k] * x[k]
    for i in range(w.unknowns - 1, -1, -1):
        x[i] /= h[i, i]
        for k in range(int(first[i]), i):
            x[k] -= h[k, i] * x[i]
