"""Records of a contact and of a pair, and calls of a law's functions by address.

Calls by address let kernels that were compiled earlier run any law.
"""

from typing import Any

import numba
import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit, jit_inline
from contactlaw.memory import caller, doubles_at, element

VECTOR, MATRIX = ("f8", (3,)), ("f8", (9,))  # of a field; row by row


def record(*names: str, **fields: Any) -> np.dtype:
    """Return a record type, aligned: float64 fields of these names, then fields of a type, or a type and a shape."""
    kinds = {**dict.fromkeys(names, "f8"), **fields}
    columns = [(name, *kind) if isinstance(kind, tuple) else (name, kind) for name, kind in kinds.items()]
    return np.dtype(columns, align=True)


def record_of(**values: Any) -> np.ndarray:
    """Return a structured array of shape (1,) whose float64 fields have these values, numbers or arrays."""
    out = np.zeros(1, record(**{name: ("f8", np.shape(value)) for name, value in values.items()}))
    for name, value in values.items():
        out[name] = value
    return out


CONTACT = np.dtype((np.record, record(
    # OPEN: not touched yet. SLIDING: as a whole, since the touch or, by `microslip`, since all nodes slip. SPRUNG:
    # followed by the springs of the law. SPUN: followed by `laws.sectors` in place of the law. UNSHEARED (`microslip`
    # only): no tangential displacement yet
    "state",
    # of the damped normal motion: PRESSED at first; EXPANDING once the bodies separate; LASTING, a persistent contact,
    # once they approach again without having parted
    "course",
    "overlap", "before",  # now and at the start of the step [m]; negative: apart
    "closing",  # mean closing speed over the step [m/s]
    "force", "elastic",  # normal force P [N], with and without the damper
    "ratio",  # tangential force over that of the springs alone, see `slip.carried`
    "f", "g",  # tangential force along both tangents [N]; that of the previous step until the law updates it
    "reach",  # greatest overlap foreseen at the touch [m]
    "scale",  # for the law's own use; span of the nodes [m] in `microslip`
    "slid_limit",  # `microslip`: mu E* [Pa] at the last step of a slide, as mu may change
    "share",  # part of the stiffness and mass between its shapes that it has, see `meeting.share_of`
    "mass", "tangential_mass",  # effective masses at the touch [kg]; infinite if the motion is prescribed
    "stiffness",  # k of P = k delta^1.5 [N/m^1.5], or of a linear spring [N/m]
    "e_star", "g_star", "radius",  # effective moduli [Pa] and effective radius [m]
    "friction", "mu", "zeta",  # part of mu that spin leaves; friction coefficient and damping ratio of the touch
    # anisotropy s of an elliptic contact of a law that allows sectors, whose longer axis is the first tangent, see
    # `laws.ellipse`; 0: circular
    "skew",
)))  # fmt: skip
"""State of one contact."""

PAIR = record(
    "e_star", "g_star", "radius", "friction", "zeta",  # as in `CONTACT`
    "duration",  # of an impact, times speed over the greatest overlap of the undamped one
    "g_t", "rolling",  # modulus G_t of torsion [Pa]; coefficient of rolling resistance
    "speeds",  # offset of the table of `losses`, in numbers; 0: friction and zeta do not depend on speed
    "linear", "vectors",  # 1 if the normal spring is linear; number of vectors that the law remembers
    "sectors",  # 1 if `laws.sectors` may replace the law
    "force_at", "stiffness_at", "energy_at",  # addresses of the law's functions, integers below 2^53
)  # fmt: skip
"""Numbers of a pair and its law. The law's own record follows, then the table of `losses`."""

OPEN, SLIDING, SPRUNG, SPUN, UNSHEARED = 0.0, 1.0, 2.0, 3.0, 4.0
PRESSED, EXPANDING, LASTING = 0.0, 1.0, 2.0

PAIR_SIZE = len(PAIR.names or ())

CONTACT_TYPE = numba.from_dtype(CONTACT)
MEMORY_TYPE = types.Array(types.float64, 2, "C")

law_at: Any = element(PAIR)


def signatures(law: Any) -> tuple[Any, Any, Any]:
    """Return the signatures of a law's force, stiffness and energy; law: type of its numbers."""
    number: Any = types.float64
    force = types.UniTuple(number, 2)(CONTACT_TYPE, law, MEMORY_TYPE, number, number, number)
    return force, number(CONTACT_TYPE, law), number(CONTACT_TYPE, law, MEMORY_TYPE)


_call_force, _call_stiffness, _call_energy = map(caller, signatures(types.uint64))


@jit_inline
def pair_of(values):
    """View of the pair at the start of an array of numbers."""
    return law_at(types.uintp(values.ctypes.data), 0)


@jit_inline
def _vectors(pair, memory):
    return carray(doubles_at(types.uintp(memory.ctypes.data)), (2, int(pair.vectors)))


@jit_inline
def ask_force(pair, contact, law, memory, du, dv, dt):
    """Return the tangential force along both tangents [N] by the law of a pair.

    law: numbers of the law, flat. memory: its vectors, flat: all components along the first tangent, then those along
    the second. du, dv: displacement over the step [m]. dt: step [s].
    """
    numbers, vectors = types.uintp(law.ctypes.data), _vectors(pair, memory)
    return _call_force(types.uintp(pair.force_at), contact, numbers, vectors, float(du), float(dv), float(dt))


@jit
def ask_stiffness(pair, contact, law):
    """Return the tangential stiffness of a contact that sticks everywhere [N/m]."""
    return _call_stiffness(types.uintp(pair.stiffness_at), contact, types.uintp(law.ctypes.data))


@jit
def ask_energy(pair, contact, law, memory):
    """Return the elastic energy of the tangential springs [J]."""
    numbers, vectors = types.uintp(law.ctypes.data), _vectors(pair, memory)
    return _call_energy(types.uintp(pair.energy_at), contact, numbers, vectors)
