"""A model at rest: while nothing that the contacts depend on changes, their last force stands and nothing is computed.

What is kept here is no state. A force may stand only where an evaluation would give the same to the last bit, so that
results do not depend on what was computed before.
"""

from __future__ import annotations

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_for
from contactlaw.memory import doubles_at, load_int, load_pointer
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import layout

jit = jit_for(layout.KEY)

QPOS, QVEL, PASSIVE, APPLIED, XFRC, MOCAP_POS, MOCAP_QUAT, STATE = (
    layout.DATA[field]
    for field in (
        "qpos", "qvel", "qfrc_passive", "qfrc_applied", "xfrc_applied", "mocap_pos", "mocap_quat", "plugin_state",
    )
)  # fmt: skip
NQ, NV, NBODY, NMOCAP, NSTATE = layout.NQ, layout.NV, layout.NBODY, layout.NMOCAP, layout.NPLUGINSTATE
OPTIONS = 4  # time step and gravity
TIMESTEP, GRAVITY = layout.TIMESTEP, layout.GRAVITY


def inputs_of(view: layout.ModelView) -> int:
    """How many numbers the forces of a model depend on."""
    nq, nv = view.size("nq"), view.size("nv")
    return OPTIONS + nq + 3 * nv + 6 * view.size("nbody") + 7 * view.size("nmocap") + view.size("npluginstate")


@jit
def size_of(m, at):
    """A size of the model."""
    return load_int(m + types.uintp(at))


@jit
def differs(d, at, size, kept, start, slack):
    """Whether a field of mjData is no longer within a slack of what was kept."""
    now = carray(doubles_at(load_pointer(d + types.uintp(at))), size)
    same = True
    for i in range(size):
        same = same and abs(now[i] - kept[start + i]) <= slack
    return not same


@jit
def keep(d, at, size, kept, start):
    """Keep a field of mjData."""
    now = carray(doubles_at(load_pointer(d + types.uintp(at))), size)
    for i in range(size):
        kept[start + i] = now[i]
    return start + size


@jit
def options(m, kept_out):
    """Time step and gravity."""
    kept_out[0] = carray(doubles_at(m + types.uintp(TIMESTEP)), 1)[0]
    gravity = carray(doubles_at(m + types.uintp(GRAVITY)), 3)
    for i in range(3):
        kept_out[1 + i] = gravity[i]


@jit
def stands(m, d, head, kept):
    """Whether the force of the last evaluation is that of now: places and velocities the same but for rounding."""
    if head[b.STILL] == 0.0:
        return False
    slack, at = head[b.SLACK], OPTIONS
    gravity = carray(doubles_at(m + types.uintp(GRAVITY)), 3)
    dt = carray(doubles_at(m + types.uintp(TIMESTEP)), 1)[0]
    if dt != kept[0] or gravity[0] != kept[1] or gravity[1] != kept[2] or gravity[2] != kept[3]:
        return False
    nq, nv, nbody, nmocap = size_of(m, NQ), size_of(m, NV), size_of(m, NBODY), size_of(m, NMOCAP)
    if differs(d, QPOS, nq, kept, at, slack) or differs(d, QVEL, nv, kept, at + nq, slack / dt):
        return False
    at += nq + nv
    if differs(d, PASSIVE, nv, kept, at, 0.0) or differs(d, APPLIED, nv, kept, at + nv, 0.0):
        return False
    at += 2 * nv
    if differs(d, XFRC, 6 * nbody, kept, at, 0.0):
        return False
    at += 6 * nbody
    if differs(d, MOCAP_POS, 3 * nmocap, kept, at, 0.0) or differs(
        d, MOCAP_QUAT, 4 * nmocap, kept, at + 3 * nmocap, 0.0
    ):
        return False
    return not differs(d, STATE, size_of(m, NSTATE), kept, at + 7 * nmocap, 0.0)


@jit
def remember(m, d, kept):
    """Keep all inputs."""
    options(m, kept)
    nq, nv, nbody, nmocap = size_of(m, NQ), size_of(m, NV), size_of(m, NBODY), size_of(m, NMOCAP)
    at = keep(d, QPOS, nq, kept, OPTIONS)
    at = keep(d, QVEL, nv, kept, at)
    at = keep(d, PASSIVE, nv, kept, at)
    at = keep(d, APPLIED, nv, kept, at)
    at = keep(d, XFRC, 6 * nbody, kept, at)
    at = keep(d, MOCAP_POS, 3 * nmocap, kept, at)
    at = keep(d, MOCAP_QUAT, 4 * nmocap, kept, at)
    keep(d, STATE, size_of(m, NSTATE), kept, at)
