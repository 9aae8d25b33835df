"""The memory that a step works on: one array, so that one argument takes it into compiled code.

A header of numbers, then tables one after the other, as `views` lays them out.
"""

from __future__ import annotations

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels import scene

# Header: time step [s] and gravity [m/s^2] of the coming step; how long the tables are; which of the two tables of
# records is in force and how many records each holds; results of a step: contacts told of, the body or contact that
# is not finite. STILL: what the last step came to if all is at rest, else 0; then the same comes of the next, as long
# as what was read stays the same: exactly, but for places and velocities, which may differ by SLACK [m] in a step.
# What was read then is kept. APART: for how many steps more nothing can touch, if gravity alone acts. WORK: length of
# the scratch memory at the end.
DT, GRAVITY = 0, 1
BODIES, SHAPES, PAIRS, PARAMETERS, ROOM, RECORD, WIDTH = range(4, 11)
IN_FORCE, COUNT, TOLD, BAD, STILL, SLACK, APART, WORK, KEPT, HEADER = 11, 12, 14, 15, 16, 17, 18, 19, 20, 24
WORK_OF_CONTACT, MOST_WORK = 500, 200_000  # numbers of scratch memory: enough for most, at most
# A body has more than the kernels read. As it was read: centre of mass [m], quaternion, velocity [m/s], spin [rad/s].
# What stays of it: its tree (-1: nothing moves it), 1/mass [1/kg] and 1/inertia about its own axes [1/(kg m^2)] where
# it is free and without links, else 0. What it is owed: impulse and angular impulse about its centre [N s, N m s].
POSITION, QUATERNION, VELOCITY, SPIN, READ = (scene.BODY + i for i in (0, 3, 7, 10, 13))
READING = 13
STAYS_TREE, STAYS_MASS, STAYS_INERTIA, OWED, BODY = (READ + i for i in (0, 1, 2, 5, 11))
# A shape too: its pose in the body, centre [m] and rotation (9, row-major).
POSE, SHAPE = scene.SHAPES, scene.SHAPES + 12
# A pair has more than the kernels read: 1 where the radius came from the shapes, and the overlap [m] to warn of.
BY_SHAPE, DEEP, PAIR = scene.PAIR, scene.PAIR + 1, scene.PAIR + 2
# What is told of a contact: pair, slot, flags, then as in `kernels.rows`.
TOLD_PAIR, TOLD_SLOT, FLAGS = 0, 1, 2
TOLD_BEGUN, TOLD_DEEPEST, TOLD_STRONGEST, TOLD_TOUCHING, TOLD_FASTEST, TOLD_WORK, TOLD_DRAG, TELLING = range(3, 11)
UNCLEAR, NEW, TOO_DEEP, GAVE_UP, CLAMPED = 1, 2, 4, 8, 16
# What pushes a body in a step: body, force [N], torque about its centre of mass [N m], that centre [m].
PUSH = 10


@jit
def views(memory):
    """The tables in the memory, each a view.

    Returns: bodies (n, BODY), shapes (n, SHAPE) and pairs (n, PAIR), as `kernels.scene` reads them and more; places of
    the shapes; parameters; records in force and those to come; how many are in force.
    """
    n, s, k = int(memory[BODIES]), int(memory[SHAPES]), int(memory[PAIRS])
    m, room, width = int(memory[PARAMETERS]), int(memory[ROOM]), int(memory[RECORD])
    at = HEADER
    bodies = memory[at : at + n * BODY].reshape((n, BODY))
    at += n * BODY
    shapes = memory[at : at + s * SHAPE].reshape((s, SHAPE))
    at += s * SHAPE
    places = memory[at : at + s * 12].reshape((s, 12))
    at += s * 12
    pairs = memory[at : at + k * PAIR].reshape((k, PAIR))
    at += k * PAIR
    parameters = memory[at : at + m]
    at += m
    which = int(memory[IN_FORCE])
    old, new = at + which * room * width, at + (1 - which) * room * width
    records = memory[old : old + room * width].reshape((room, width))
    fresh = memory[new : new + room * width].reshape((room, width))
    return bodies, shapes, places, pairs, parameters, records, fresh, int(memory[COUNT + which])


@jit
def outputs(memory):
    """Tellings (room, TELLING), pushes and readings kept (bodies, PUSH and READING), at the end of the memory."""
    n, room = int(memory[BODIES]), int(memory[ROOM])
    kept = memory.size - n * READING - int(memory[WORK])
    at = kept - n * PUSH
    tellings = memory[at - room * TELLING : at].reshape((room, TELLING))
    readings = memory[kept : memory.size - int(memory[WORK])].reshape((n, READING))
    return tellings, memory[at:kept].reshape((n, PUSH)), readings


@jit
def workspace(memory):
    """What `kernels.workspace` lends, at the end of the memory."""
    return memory[memory.size - int(memory[WORK]) :]


class Tables:
    """The memory and its tables, named; arguments: how long they are.

    Attributes:
        memory: All of it.
        buffer: The same, for `struct`.
        room: How many contacts it can hold at once.
        pushes_at: Where the pushes start in the buffer.
    """

    def __init__(self, bodies: int, shapes: int, pairs: int, parameters: int, history: int, room: int) -> None:
        record = scene.HISTORY + history
        size = bodies * (BODY + PUSH + READING) + shapes * (SHAPE + 12) + pairs * PAIR + parameters
        work = min(WORK_OF_CONTACT * room + 100 * (bodies + shapes + pairs), MOST_WORK)
        self.memory = np.zeros(HEADER + size + room * (2 * record + TELLING) + work)
        self.memory[WORK] = work
        self.buffer: memoryview = self.memory.data
        self.memory[BODIES : RECORD + 1] = bodies, shapes, pairs, parameters, room, record
        self.memory[WIDTH] = 6
        self.room = room
        self.bodies, self.shapes, self.places, self.pairs, self.parameters, first, second, _ = views(self.memory)
        self._records = first, second
        self.tellings, self.pushes, _ = outputs(self.memory)
        self.pushes_at = 8 * (self.memory.size - work - bodies * (PUSH + READING))
        self.readings, self.staying = self.bodies[:, POSITION:READ], self.bodies[:, READ:OWED]
        self.owed = self.bodies[:, OWED:BODY]

    @property
    def records(self) -> np.ndarray:
        """The records in force, sorted by key, shape (n, RECORD)."""
        which = int(self.memory[IN_FORCE])
        return self._records[which][: int(self.memory[COUNT + which])]

    @property
    def coming(self) -> np.ndarray:
        """Those that the last step has left, not yet in force."""
        which = 1 - int(self.memory[IN_FORCE])
        return self._records[which][: int(self.memory[COUNT + which])]

    def put_records(self, records: np.ndarray) -> None:
        """Put other records in force; they may be narrower or wider, what is left over holds nothing."""
        which = int(self.memory[IN_FORCE])
        width = min(records.shape[1], self._records[which].shape[1])
        self.memory[STILL] = 0.0
        self._records[which][:] = 0.0
        self._records[which][: len(records), :width] = records[:, :width]
        self.memory[COUNT + which] = len(records)

    def commit(self) -> None:
        """Let what the last step has left be in force."""
        self.memory[IN_FORCE] = 1.0 - self.memory[IN_FORCE]
