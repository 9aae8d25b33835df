"""What a law sees of a contact, and how a law is asked: by address, so that any law runs in code compiled before it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]
from numba.extending import overload

from contactlaw.memory import caller, doubles_at, element


def record(*names: str) -> np.dtype:
    """A record of float64 by these names."""
    return np.dtype([(name, np.float64) for name in names], align=True)


CONTACT = record(
    "state", "course", "overlap", "before", "closing", "force", "elastic", "ratio", "f", "g", "reach", "scale",
    "mass", "tangential_mass", "stiffness", "e_star", "g_star", "radius", "friction", "mu", "zeta",
    "skew",
)  # fmt: skip
"""One contact.

state: OPEN, SLIDING (as a whole since the touch), SPRUNG, SPUN, where `laws.sectors` stand for the law, or UNSHEARED:
never displaced sideways since the touch, as `microslip` says it. course: of the damped normal motion, PRESSED, then
EXPANDING, then, if the bodies do not part, LASTING. overlap [m]: now; before: at the start of the step, below zero
apart. closing: mean closing speed over the step [m/s]. force: P [N]; elastic: without the damper. ratio: of the
tangential force to that of the springs alone, see `slip.carried`. f, g: tangential force along both tangents [N], as of
the last step until the law gives it anew. reach: the greatest overlap foreseen at the touch [m]. scale: for the law's
own use. mass, tangential_mass: effective, at the touch [kg]; infinite where the motion is prescribed. stiffness: k of P
= k delta^1.5 [N/m^1.5], or of a linear spring [N/m]. e_star, g_star [Pa], radius [m]: of the pair. mu, zeta: friction
coefficient and damping ratio, as of the touch. friction: what spin leaves of mu. skew: how much more an elliptic
contact gives way along the first tangent, its longer axis, see `laws.ellipse`, which stands for the law there; zero: it
is a circle, or taken as one.
"""

PAIR = record(
    "e_star", "g_star", "radius", "friction", "zeta", "duration", "g_t", "rolling", "speeds", "linear", "vectors",
    "sectors", "force_at", "stiffness_at", "energy_at",
)  # fmt: skip
"""Two materials and their law.

duration: of a contact, times speed over the undamped greatest overlap. g_t: G_t of torsion [Pa]. rolling: coefficient
of rolling resistance. speeds: where the numbers of `laws.speeds` stand, counted from here; 0: friction and zeta are the
same at any speed. linear: 1 where the normal spring is linear. vectors: how many the law remembers. sectors: 1 where
`laws.sectors` may stand for the law. force_at,
stiffness_at, energy_at: addresses of the law's functions, whole numbers below 2^53. The law's own numbers follow.
"""

OPEN, SLIDING, SPRUNG, SPUN, UNSHEARED = 0.0, 1.0, 2.0, 3.0, 4.0
PRESSED, EXPANDING, LASTING = 0.0, 1.0, 2.0

CONTACT_SIZE, PAIR_SIZE = len(CONTACT.names or ()), len(PAIR.names or ())

CONTACT_TYPE = numba.from_dtype(CONTACT)
MEMORY_TYPE = types.Array(types.float64, 2, "C")

FUNCTIONS: dict[int, tuple[Callable[..., Any], np.dtype]] = {}
"""Without the compiler: a law's functions and its record by what stands for their address."""


def _record_view(values: np.ndarray, kind: np.dtype) -> Any:
    return values[: kind.itemsize // 8].view(np.dtype((np.record, kind)))[0]


def _vectors(pair: Any, memory: np.ndarray) -> np.ndarray:
    return memory[: 2 * int(pair.vectors)].reshape(2, -1)


def contact_of(values: Any) -> Any:
    """The contact that begins these numbers, a view."""
    return _record_view(values, CONTACT)


def pair_of(values: Any) -> Any:
    """The pair that begins these numbers, a view."""
    return _record_view(values, PAIR)


def ask_force(pair: Any, contact: Any, law: Any, memory: Any, du: float, dv: float, dt: float) -> tuple[float, float]:
    """Tangential force along both tangents [N] by the pair's law.

    law: its own numbers. memory: its vectors, first all components along one tangent, then all along the other; both
    flat. du, dv: displacement over the step [m]. dt: step [s].
    """
    force, kind = FUNCTIONS[int(pair.force_at)]
    return force(contact, _record_view(law, kind), _vectors(pair, memory), du, dv, dt)


def ask_stiffness(pair: Any, contact: Any, law: Any) -> float:
    """Tangential stiffness of the contact where it sticks everywhere [N/m]."""
    stiffness, kind = FUNCTIONS[int(pair.stiffness_at)]
    return stiffness(contact, _record_view(law, kind))


def ask_energy(pair: Any, contact: Any, law: Any, memory: Any) -> float:
    """Elastic energy of the tangential springs [J]."""
    energy, kind = FUNCTIONS[int(pair.energy_at)]
    return energy(contact, _record_view(law, kind), _vectors(pair, memory))


_contact_at, _pair_at = element(CONTACT), element(PAIR)


_NUMBER = types.float64
_call_force: Any = caller(
    types.UniTuple(_NUMBER, 2)(CONTACT_TYPE, types.uint64, MEMORY_TYPE, _NUMBER, _NUMBER, _NUMBER)
)
_call_stiffness: Any = caller(_NUMBER(CONTACT_TYPE, types.uint64))
_call_energy: Any = caller(_NUMBER(CONTACT_TYPE, types.uint64, MEMORY_TYPE))


@overload(contact_of, jit_options={"forceinline": True})
def _contact_of(values):
    return lambda values: _contact_at(types.uintp(values.ctypes.data), 0)


@overload(pair_of, jit_options={"forceinline": True})
def _pair_of(values):
    return lambda values: _pair_at(types.uintp(values.ctypes.data), 0)


@overload(ask_force, jit_options={"forceinline": True})
def _ask_force(pair, contact, law, memory, du, dv, dt):
    def ask(pair, contact, law, memory, du, dv, dt):
        vectors = carray(doubles_at(types.uintp(memory.ctypes.data)), (2, int(pair.vectors)))
        return _call_force(
            types.uintp(pair.force_at), contact, types.uintp(law.ctypes.data), vectors, float(du), float(dv), float(dt)
        )

    return ask


@overload(ask_stiffness)
def _ask_stiffness(pair, contact, law):
    return lambda pair, contact, law: _call_stiffness(
        types.uintp(pair.stiffness_at), contact, types.uintp(law.ctypes.data)
    )


@overload(ask_energy)
def _ask_energy(pair, contact, law, memory):
    def ask(pair, contact, law, memory):
        vectors = carray(doubles_at(types.uintp(memory.ctypes.data)), (2, int(pair.vectors)))
        return _call_energy(types.uintp(pair.energy_at), contact, types.uintp(law.ctypes.data), vectors)

    return ask
