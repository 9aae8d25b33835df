"""The memory that the compiled callbacks of a model share: one block of float64 for each mjData.

The first plugin instance of a model leads: its block holds the contacts of all instances, for bodies that touch
through several of them move together. The blocks of the others hold FOLLOWS and OWN_SIZE alone.
"""

from __future__ import annotations

# Head of the block: numbers, then where each table starts. OWN_SIZE: floats of an instance's state.
(
    LEADS, OWN_SIZE, REPORT, INSTANCES, SHAPES, BODIES, PAIRS, PARAMETERS, NV, STRIDE, CAPACITY, WIDTH, ACTUATED,
    LEDGERS, PENDING, STAGE_TIME, STILL, SLACK, INPUTS, GEOMS_AT, SHAPES_AT, BODIES_AT, PAIRS_AT, PARAMETERS_AT,
    INSTANCES_AT, PLACES_AT, MOTION_AT, NEW_AT, LEDGER_AT, FORCE_AT, INPUTS_AT, FRAMES_AT, WORK_AT, WORK, HEAD,
) = range(35)  # fmt: skip
FOLLOWS = 0.0
# STILL: 1 where the last evaluation found all at rest; its force then stands as long as the inputs, kept from INPUTS_AT
# on, stay the same: exactly, but for places and velocities, which may differ by SLACK [m] in a step.

# An instance: where its state is in plugin_state, floats of one record, room for records, its first and last pair (the
# one after), 1: keeps a ledger, 1: its pair has a radius, what has been reported of it, its number in the model.
STATE, RECORD_SIZE, ROOM, FIRST_PAIR, LAST_PAIR, HAS_LEDGER, RADIUS_GIVEN, REPORTED, NUMBER, INSTANCE = range(10)

# What the model says of a body: its id, its root, its last degree of freedom (-1: none moves it), its tree and the
# first degree of freedom of that, for a free one inverse mass [1/kg] and inertia [1/(kg m^2)] about its main axes.
BODY_ID, ROOT, LAST_DOF, TREE_ID, TREE_DOF, TREE_SIZE, LIGHTNESS, EASE, BODY_FACTS = 0, 1, 2, 3, 4, 5, 6, 7, 10

# State of an instance in plugin_state: how many records there are; the ledger; the records.
COUNT, LEDGER_STATE, LEDGER_SIZE = 0, 1, 7
# The ledger: impacts, greatest overlap [m], greatest force [N], time in contact [s], shortest contact time [s], work
# taken along the normal and across [J].
IMPACTS, OVERLAP, FORCE, TIME, SHORTEST, NORMAL_WORK, TANGENTIAL_WORK = range(7)

# What is reported to Python, once for each instance and mjData.
DEEP, UNCLEAR_RADIUS, SPENT_SUBSTEPS, FULL, RUNGE_KUTTA_JOINTS, DAMAGED = 1, 2, 4, 8, 16, 32


def records_at(has_ledger: float) -> int:
    """Where the records of an instance start in its state."""
    return LEDGER_STATE + (LEDGER_SIZE if has_ledger else 0)
