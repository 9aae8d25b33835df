"""What one contact brings to an engine step and takes from it: a row of float64, laid out here.

A contact frame has three axes: -n, t and n x t, with n from B to A. In it the relative motion of A reads (closing
speed, two sliding speeds), and the force on A is minus (P, F, G): all three grow by being pressed or dragged together,
and J M^-1 J^T stays symmetric. The motion is that at the start of the step, as it would go on without contact: a
contact that touches later in the step has the frame and the lever arms of its touch.
"""

OVERLAP_NOW = 0  # [m], below zero apart
MOTION = 1  # closing and sliding speeds [m/s]
PUSH = 4  # closing and sliding acceleration by all but the contacts [m/s^2]
FRAME = 7  # -n, t, n x t, world frame
LAW_AT, LAW_SIZE = 16, 17  # where the parameters of the contact stand among all of them
PIECES = 18  # substeps a contact at least
LEDGER = 19  # 1: keep the ledger below
STRAYED = 20  # how much further than foreseen it slid in the last step, along both tangents [m]
# Results: integrals over the step, [N s], of (P, F, G) and of (P, F, G) times the share of the step that is left.
IMPULSE = 22
EARLY = 25
SLID = 28  # displacement along both tangents over the step, as foreseen [m]
# Told of the step: impacts begun, greatest overlap [m], 1 where substeps ran out.
BEGUN, DEEPEST, SPENT = 30, 31, 32
# The ledger, where kept: greatest force [N], time in contact [s], shortest time scale [s], work done on the contact
# along the normal and across [J].
STRONGEST, TOUCHING, FASTEST, WORK, DRAG = 33, 34, 35, 36, 37
CLOSED = 38  # how long it has been closed at the end of the step, at most the step [s]
FROM, UNTIL = 39, 40  # when in the step its force began and ended [s]
# 1 where the step was cut (`kernels.intervals`): then the angular impulses on A and on B are these [N m s].
CUT, TURN_A, TURN_B = 41, 42, 45
ROW = 48
