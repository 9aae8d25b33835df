"""What a step must be looked over for before its forces act: shapes, bodies that have gone, depth, losses."""

from __future__ import annotations

import warnings
from math import inf

import numpy as np

from contactlaw.kernels.touch import SIDE
from contactlaw.pair import ContactWarning
from contactlaw.pybullet_callback.contact import Couple
from contactlaw.pybullet_callback.layout import Layout
from contactlaw.pybullet_callback.losses import Losses
from contactlaw.pybullet_callback.marks import Marks
from contactlaw.pybullet_callback.tables import (
    CLAMPED,
    DEEP,
    FLAGS,
    GAVE_UP,
    NEW,
    READ,
    TOLD,
    TOLD_DEEPEST,
    TOLD_PAIR,
    TOLD_SLOT,
    TOO_DEEP,
    UNCLEAR,
    VELOCITY,
)


def look_over(layout: Layout, marks: Marks, losses: Losses) -> set[int]:
    """Check the contacts that a step flags.

    Returns:
        Rows of the bodies whose contacts are new.

    Raises:
        ValueError: A body has gone or a place without a radius of its own.
    """
    tables = layout.tables
    told = [row for row in tables.tellings[: int(tables.memory[TOLD])].tolist() if row[FLAGS]]
    new: set[int] = set()
    for row in told:
        flags, (_, _, couple) = int(row[FLAGS]), layout.couples[int(row[TOLD_PAIR])]
        if flags & NEW:
            for side in couple.sides:
                marks.check(side.body)
                new.add(layout.bodies.row[side.key])
        if flags & UNCLEAR:
            _refuse_place(couple, int(row[TOLD_SLOT]))
    for row in told:
        flags, pair = int(row[FLAGS]), int(row[TOLD_PAIR])
        _, _, couple = layout.couples[pair]
        if flags & CLAMPED:
            for side in couple.sides:
                losses.warn_of_clamp(side.key, np.abs(tables.bodies[layout.bodies.row[side.key], VELOCITY:READ]))
        if flags & TOO_DEEP:
            couple.deep = tables.pairs[pair, DEEP] = inf
            _warn(
                f"{couple}: overlap over radius is {row[TOLD_DEEPEST] / couple.radius:.2g}; beyond 0.1 Hertz contact "
                "is no longer right"
            )
        if flags & GAVE_UP and not couple.gave_up:
            couple.gave_up = True
            _warn(
                f"{couple}: the substeps of a step ran out; for its rest they stood, without bounce; shorten the step"
            )
    return new


def _refuse_place(couple: Couple, slot: int) -> None:
    one, two = couple.sides
    edge = two.shape == "box" and slot != SIDE
    bad, other = (two, one) if edge or one.shape != "capsule" else (one, two)
    where, smooth = ("edge", "faces") if edge else ("side", "ends")
    raise ValueError(
        f"radius = None: {bad} touches with the {where} of its {bad.shape}, with {other}; only the {smooth} have a "
        "radius of their own, elsewhere give the pair an effective radius [m]"
    )


def _warn(message: str) -> None:
    warnings.warn(message, ContactWarning, stacklevel=4)
