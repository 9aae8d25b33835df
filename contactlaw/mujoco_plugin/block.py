"""The memory that the compiled callbacks work with: one block for each mjData, which holds its world.

The first plugin instance of a model leads: all contacts of the model are in its block and in its part of plugin_state,
for bodies that touch through several of them move together. The blocks of the others say no more than that.

Of plugin_state the leader uses, in doubles: a token, a check sum of the rest for this model; one of the coordinates and
velocities that the step left, and of what the law reads of the model; the generalised force with which the contacts
press, shape (nv,); of free bodies the acceleration and the moment by what else pushed them, shape (nv,); where bodies
that the user places have been put, and how they went there, shape (placed, 13); the world between two steps
(`world.state`).
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.memory import doubles_at, element, load_int
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.world.data.records import VECTOR, Array, Arrays, record

TOKEN, LEFT, PUSH = range(3)  # of the state: where its parts begin
LED = 13  # numbers of a body that is led: place, quaternion, velocity, spin
STARTS = 4  # states kept of the last calls of compute: Runge-Kutta asks four times a step

allocate, free = ctypes.pythonapi.PyMem_RawCalloc, ctypes.pythonapi.PyMem_RawFree
allocate.argtypes, allocate.restype = [ctypes.c_size_t, ctypes.c_size_t], ctypes.c_void_p
free.argtypes, free.restype = [ctypes.c_void_p], None

HEAD = record(
    leads="i8", own_size="i8",  # the latter: numbers of the instance in plugin_state
    world="u8", serve="u8", press="u8",  # addresses of its `records.WORLD`, of `jointed.serve` and `jointed.press`
    report="u8", own="u8",  # addresses: what tells Python; this
    state="i8", row="i8",  # where its part of plugin_state begins, and in it the world's own
    nq="i8", nv="i8",
    starts="u8", turn="i8",  # address of the states of the last calls of compute, and which is the newest
    left="u8",  # of the state that the last step left: each is time, coordinates, velocities; then qacc, if all lay
    given="u8",  # address of the generalised force (nv,) that compute gave last
    # what the world was made of, see `notices`; coefficients of friction that its pairs have been given, NaN: none
    watch="u8", watch_count="i8", seen="u8", frictions="u8",
    # sensors, see there: address of `sense`, 0: none; whether it is at work; on means; room; and of each shape where
    # the centre of mass of its body is, in the frame of its geom
    sense="u8", sensing="i8", averages="i8", loads="u8", body_count="i8", sensors="u8", sensor_count="i8", centres="u8",
    frees="u8", free_count="i8", placed="u8", placed_count="i8", trees="u8", tree_count="i8",
    token="f8",  # of the state that the world is in
    idle="i8",  # that is one without contacts
    calm="i8",  # whether in the last step none could touch, CALM, or all slept on, LYING, see `callbacks`
    signature="u8", made="u8",  # of the model: of its sizes and names; of all that the law reads of it
    geoms="u8",  # address of the geom that each shape of the world is
    said="u8",  # address of what has been reported of each instance
    told="i8", told_a="i8", told_b="i8",  # instance and geoms that something is reported of; -1: of none
    instances="u8",  # address of the instance that each pair of the world belongs to
    # within a step
    model="u8", data="u8",
    start="u8",  # address of the state that it began with
    lag="f8",  # [s] by which velocities of the engine are behind its coordinates
    step_size="f8", gravity=VECTOR,
)  # fmt: skip
"""What a block begins with."""

FREE = record(
    body="i8", id="i8",  # row in the world; number in the model
    q="i8", v="i8",  # where its coordinates and velocities begin
    offset=VECTOR, frame=("f8", (4,)),  # centre of mass and principal axes in the body's frame
    pressed="i8",  # a contact was closed when the step began
)  # fmt: skip
"""A body that nothing but its contacts holds."""

PLACED = record(body="i8", id="i8")
"""A body that nothing pushes and the user may place: mocap."""

JOINTED = record(
    tree="i8",  # in the world
    q="i8", v="i8",  # where its coordinates and velocities begin
    base="i8",  # number in the model of the body that it hangs on
    there="i8",  # its bodies are where these have them: since it PASSES, or as it SLEEPS
)  # fmt: skip
"""Bodies that joints hold: a kinematic tree."""

SENSOR = record(
    own="i8",  # of the law; else one of touch
    body="i8", geom="i8", site="i8",  # what it is on, in the model; -1: no geom, no site
    instance="i8",  # whose contacts it tells of; -1: of all
    at="i8", cutoff="f8",  # place in sensordata; greatest value, 0: none
    weight="f8",  # sum of forces, while it is read
)  # fmt: skip
"""A sensor of contacts."""

head_at: Any = element(HEAD)
free_at: Any = element(FREE)
placed_at: Any = element(PLACED)
jointed_at: Any = element(JOINTED)
sensor_at: Any = element(SENSOR)


@jit_inside
def place(address, count):
    """The address of a number in an array of them; sums of addresses stay whole numbers."""
    return types.uintp(address) + types.uintp(8 * count)


@jit_inside
def floats(address, first, size):
    """Numbers of an array at an address, a view."""
    return carray(doubles_at(place(address, first)), size)


@jit_inside
def number(address, i):
    """A number of an array at an address."""
    return doubles_at(place(address, i))[0]


@jit_inside
def entry(address, i):
    """A whole number of an array of C int at an address."""
    return int(load_int(types.uintp(address) + types.uintp(4 * i)))


def build(world: Arrays, fields: dict[str, Any]) -> int:
    """Make a block; returns its address.

    fields: what its head says, by name; of an array the head keeps the address.
    """
    at = HEAD.itemsize
    tables = [value for value in fields.values() if isinstance(value, np.ndarray)]
    address = allocate(1, at + sum(_padded(array) for array in (*world, *tables)))

    def moved(array: Array) -> Array:
        nonlocal at
        here = record_at(address + at, array.dtype, array.size).reshape(array.shape)
        if any(array.strides):  # else it is room, and zero as the block is
            here[...] = array
        at += _padded(array)
        return here

    head = record_at(address, HEAD, 1)[0]
    head["world"], head["own"] = Arrays(*map(moved, world)).bound().world.ctypes.data, address
    for name, value in fields.items():
        head[name] = moved(value).ctypes.data if isinstance(value, np.ndarray) else value
    return address


def _padded(array: Array) -> int:
    return -(-array.nbytes // 64) * 64
