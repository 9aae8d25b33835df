"""The memory of the compiled callbacks: one block for each mjData, which holds its world.

The first plugin instance of a model leads: its block and its part of plugin_state hold all contacts of the model, since
bodies that touch through several instances move together. The other instances have neither.

The leader's part of plugin_state, in doubles: `STATE`; the generalised force of the contacts, shape (nv,); for free
bodies the acceleration and torque by other forces, shape (nv,), see `free`; `MOVED` of each mocap body; the world
between two steps (`world.state`).
"""

import ctypes
from typing import Any

import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_module
from contactlaw.laws.record import VECTOR, record
from contactlaw.memory import doubles_at, element, load_int, whole_at
from contactlaw.mujoco_plugin.layout import data_at, record_at
from contactlaw.world.data.records import Array, Arrays

STARTS = 4  # states kept, of the last calls of compute: Runge-Kutta calls it four times a step

allocate, free = ctypes.pythonapi.PyMem_RawCalloc, ctypes.pythonapi.PyMem_RawFree
allocate.argtypes, allocate.restype = [ctypes.c_size_t, ctypes.c_size_t], ctypes.c_void_p
free.argtypes, free.restype = [ctypes.c_void_p], None

HEAD = record(
    # what every step needs comes first, in a few lines of the processor's cache
    model="u8", data="u8",  # of the present call
    newest="i8", recent="u8",  # which is the newest of the states of the last calls of compute, and their address
    nq="i8", nv="i8",
    state="i8", token="f8",  # where its part of plugin_state begins; token of the state that the world is in
    calm="i8",  # how the last step went, see `callbacks.move_world`
    sense="u8",  # address of `sense`, 0: no sensors
    world="u8",  # address of its `records.WORLD`
    start="u8",  # address of the state at the start of the step
    known="i8",  # 1: all is as a step has left it, perhaps one of another mjData
    left="u8",  # of the state at the end of the last step: time, coordinates, velocities; then qacc if all slept
    given="u8",  # address of the generalised force (nv,) that compute gave last
    step_size="f8",
    frees="u8", free_count="i8", mocap_count="i8", tree_count="i8",
    ranges="u8", range_count="i8", watched="u8",  # of the numbers that are compared, how many; copies: see `notices`
    mocaps="u8", trees="u8", springs="u8",
    # doubles of the instance in plugin_state; where in them the state of the world begins; with tendons nv before that
    # are the forces of springs and servos, see `change_of_pulls`
    size="i8", row="i8",
    tree_stage="u8", tree_force="u8",  # addresses of `trees.serve` and `trees.press`
    report="u8", address="u8",  # addresses of the function for reports, and of this record
    # sensors: 1: they are evaluated with the present forces, 2: with their means, 0: not; room; for each shape the
    # centre of mass of its body in the frame of its geom
    sensing="i8", loads="u8", body_count="i8", sensors="u8", sensor_count="i8", centres="u8",
    # for each velocity its place in its tree, then the number of that, -1: none; then what `JOINTED` has places of
    places="u8",
    signature="u8", content="u8",  # hashes: of sizes and names of model and world; of all numbers that the law reads
    geoms="u8",  # address of the geom of each shape of the world
    reported="u8",  # address of the codes that have been reported of each instance, for all mjData: see `notices`
    lag="f8",  # [s] by which velocities of the engine are behind its coordinates
    gravity=VECTOR,
)  # fmt: skip
"""Head of a block."""

STATE = record(
    "token",  # checksum of all that follows, for this model
    "left",  # that of coordinates and velocities at the end of the last step, and of what `content` is of
    "content",  # that of the numbers that the law reads of the model
)
"""Checksums at the beginning of the state."""

PUSH = len(STATE.names or ())  # where the force of the contacts begins in the state

FREE = record(
    body="i8", id="i8",  # row in the world; number in the model
    parts="i8",  # how many bodies of the model it is, with those without mass that are fixed to it, which come next
    q="i8", v="i8",  # where its coordinates and velocities begin
    offset=VECTOR, frame=("f8", (4,)),  # centre of mass and principal axes in the body's frame
    pressed="i8",  # a contact was closed at the start of the step
    clearance="f8",  # see `free.set_clearances`
)  # fmt: skip
"""A free body."""

MOCAP = record(body="i8", id="i8")
"""A mocap body: the user moves it, and no force does."""

MOVED = record(position=VECTOR, quaternion=("f8", (4,)), velocity=VECTOR, spin=VECTOR)
"""Pose and velocity of a mocap body in the last step, in the state; a quaternion of zeros: there was none."""

JOINTED = record(
    tree="i8",  # in the world
    q="i8", v="i8",  # where the places of its coordinates and of its velocities begin in `HEAD.places`
    base="i8",  # number in the model of the parent of its first body, if a mocap body carries it; else 0
    there="i8",  # PASSES or SLEEPS: why its bodies are where its coordinates have them already; else ASKED
    first_spring="i8", spring_count="i8",  # its `SPRING` in `HEAD.springs`
)  # fmt: skip
"""A kinematic tree, or several that equality constraints make one system."""

SPRING = record(
    row="i8",  # of its lever arms: in the moments of actuators, or number of the tendon
    tendon="i8",  # 1: of a tendon
    servo="i8",  # number of the actuator; -1: it is none, it has inertia alone
    armature="f8",  # [kg] or [kg m^2], its inertia
)
"""What acts like a spring, or has inertia, along the length of an actuator's transmission or of a tendon."""

SENSOR = record(
    own="i8",  # a sensor of the law; else a touch sensor
    body="i8", geom="i8", site="i8",  # the object that it is on; -1: no geom, no site
    instance="i8",  # the instance whose contacts it measures; -1: all
    at="i8", cutoff="f8",  # index in sensordata; greatest value, 0: none
    weight="f8",  # sum of forces, while it is evaluated
)  # fmt: skip
"""A sensor of contacts."""

head_at: Any = element(HEAD)
free_at: Any = element(FREE)
mocap_at: Any = element(MOCAP)
moved_at: Any = element(MOVED)
jointed_at: Any = element(JOINTED)
sensor_at: Any = element(SENSOR)
spring_at: Any = element(SPRING)
state_at: Any = element(STATE)


def shifted(address, count):
    """Return the address `count` doubles after another one. (Sums of addresses must stay unsigned integers.)"""
    return types.uintp(address) + types.uintp(8 * count)


def floats(address, first, size):
    """Return a view of doubles at an address."""
    return carray(doubles_at(shifted(address, first)), size)


def entries(address, first):
    """Return the address of element `first` of an array of C int."""
    return types.uintp(address) + types.uintp(4 * first)


def entry(address, i):
    """Return element i of an array of C int."""
    return int(load_int(entries(address, i)))


def checksums(head):
    """Return the checksums of the state in mjData."""
    return state_at(shifted(data_at(head.data, 0).plugin_state, head.state), 0)


def last_state(head, before=0):
    """Return the address of the state of the last call of `compute`, or of that `before` calls before it."""
    return shifted(head.recent, (head.newest - before) % STARTS * (1 + head.nq + head.nv))


def gather(head, source, first, target):
    """Copy numbers of the model, at an address, to those of a tree; their places begin at `first` in `head.places`."""
    for i in range(target.size):
        target[i] = doubles_at(source)[whole_at(head.places, first + i)]


def scatter(head, source, first, target):
    """Copy numbers of a tree to those of the model, at an address; their places begin at `first` in `head.places`."""
    for i in range(source.size):
        doubles_at(target)[whole_at(head.places, first + i)] = source[i]


def places_in(head, state):
    """Return the addresses of coordinates and velocities in a state at an address."""
    return shifted(state, 1), shifted(state, 1 + head.nq)


def build(world: Arrays, fields: dict[str, Any]) -> int:
    """Allocate a block for a world and return its address.

    fields: of the head, by name; an array is copied into the block, and the head keeps its address.
    """
    at = HEAD.itemsize
    tables = [value for value in fields.values() if isinstance(value, np.ndarray)]
    address = allocate(1, at + sum(_padded(array) for array in (*world, *tables)))

    def moved(array: Array) -> Array:
        nonlocal at
        here = record_at(address + at, array.dtype, array.size).reshape(array.shape)
        if any(array.strides):  # else it is empty room: the block is zero already
            here[...] = array
        at += _padded(array)
        return here

    head = record_at(address, HEAD, 1)[0]
    head["world"], head["address"] = Arrays(*map(moved, world)).bound().world.ctypes.data, address
    for name, value in fields.items():
        head[name] = moved(value).ctypes.data if isinstance(value, np.ndarray) else value
    return address


def _padded(array: Array) -> int:
    return -(-array.nbytes // 64) * 64


jit_module(__name__)
