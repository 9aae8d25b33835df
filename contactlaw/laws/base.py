"""What makes a law of the tangential force, here or in a file of the user's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache
from math import inf, isfinite, sqrt
from pathlib import Path
from typing import Any, ClassVar

import numba
import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import INTERPRETED, address_of
from contactlaw.laws import record

Array = NDArray[np.float64]
Impacts = Callable[[Array, Array, Array], object]

PACKAGE = Path(__file__).parents[1]  # whose sources key the cache


def stuck_stiffness(contact: Any, law: Any) -> float:
    """2 G* a [N/m]: Mindlin (1949)."""
    return 2.0 * contact.g_star * sqrt(contact.radius * contact.overlap)


def energy_of_force(contact: Any, law: Any, memory: Any) -> float:
    """F^2/(4 G* a) [J], of the force that the springs hold."""
    if contact.ratio <= 0.0 or contact.overlap <= 0.0:
        return 0.0
    f, g = contact.f / contact.ratio, contact.g / contact.ratio
    return (f * f + g * g) / (4.0 * contact.g_star * sqrt(contact.radius * contact.overlap))


@dataclass(frozen=True)
class Law:
    """How the tangential force of a contact follows from its motion.

    To write a law, here or in a file of your own:
      1. subclass `Law` as a frozen dataclass with `name` and `source`; its fields are numbers with defaults; they
         are settings wherever a law is named, "my_law field=value", in Python, XML and on the command line;
      2. say in `memory` how many vectors in the tangent plane it remembers;
      3. write `force(contact, law, memory, du, dv, dt)` in the Python that numba compiles: contact is `record.CONTACT`,
         law has the fields by name, memory[0, i], memory[1, i] are both components of vector i, zero at the touch; du,
         dv: displacement of A relative to B over the step [m], dt the step [s], 0 where time does not matter. Return
         the force along both tangents [N]. End with `return carried(contact, f, g)`: |F| <= mu P is the law's duty;
      4. where the defaults, those of Mindlin's spring, are not its own: `stiffness(contact, law)`, stuck [N/m]
         (infinite: rigid), and `energy(contact, law, memory)` [J];
      5. `ContactPair(..., law=MyLaw())` then works everywhere. `law_of`, XML and the command line find it by its name
         once its file is imported. Files in this folder always are; those with a `rung` are in `LAWS`, over which all
         property tests run.

    Attributes:
        name: As users write it.
        source: Where the law comes from.
        rung: Its place in the ladder, by which `LAWS` is ordered; infinite: it is not in `LAWS`.
        memory: How many vectors it remembers.
        linear: Whether the normal spring is linear as well.
        sectors: Whether it is Microslip's theory, so that `laws.sectors` may stand for it in contacts that spin.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    rung: ClassVar[float] = inf
    memory: ClassVar[Any] = 1
    linear: ClassVar[bool] = False
    sectors: ClassVar[Any] = False
    force: ClassVar[Callable[..., tuple[float, float]]]
    stiffness: ClassVar[Callable[..., float]] = staticmethod(stuck_stiffness)
    energy: ClassVar[Callable[..., float]] = staticmethod(energy_of_force)

    def __init_subclass__(cls) -> None:
        if hasattr(cls, "name"):  # or it is what some laws share
            KNOWN[cls.name] = cls

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, str | bytes | tuple) or not isfinite(value):
                raise ValueError(f"{field.name} = {value!r}: must be a finite number")

    def with_nodes(self, suggested: int | None) -> Law:
        """The law with the number of its vectors settled: as many as suggested where it leaves that open."""
        return self

    def numbers(self) -> NDArray[Any]:
        """Its record, as `force` reads it: a structured array of one."""
        kind = np.dtype([("vectors", "f8"), *((field.name, "f8") for field in fields(self))], align=True)
        values = np.zeros(1, kind)
        values["vectors"] = self.memory
        for field in fields(self):
            values[field.name] = getattr(self, field.name)
        return values

    def with_pair(self, *known: float, speeds: Array | None = None) -> Array:
        """The numbers that the kernels read: `record.PAIR`, of which the first eight are given, then the law's own.

        speeds: the numbers of `laws.speeds`, which come last; None: there are none.
        """
        own = self.numbers().view(np.float64)
        at = 0 if speeds is None else record.PAIR_SIZE + own.size
        pair = np.array((*known, at, self.linear, self.memory, self.sectors, *self.addresses()), record.PAIR)
        return np.concatenate([pair.reshape(1).view(np.float64), own, *([] if speeds is None else [speeds])])

    def new_contact(self) -> tuple[Array, Array]:
        """Room for a contact (`record.CONTACT`) and for what the law remembers of it, both empty."""
        return np.zeros(record.CONTACT_SIZE), np.zeros(2 * self.memory)

    def addresses(self) -> tuple[float, float, float]:
        """Where its compiled force, stiffness and energy stand."""
        return _addresses(self.functions(), self.numbers().dtype)

    def functions(self) -> tuple[Callable[..., Any], ...]:
        """Its force, stiffness and energy."""
        return self.force, self.stiffness, self.energy

    def impacts(self, zeta: float, steps: int) -> Impacts | None:
        """What turns psi_1 and chi of whole impacts into psi_2, arrays (n,), faster than steps; None: nothing does."""
        return None

    @property
    def on_line(self) -> Any:
        """What follows motion along a line exactly (`microslip_line`); None: nothing does."""
        return None


KNOWN: dict[str, type[Law]] = {}
"""Every law whose file has been imported; a later one of a name wins."""


@lru_cache(maxsize=256)
def _addresses(given: tuple[Callable[..., Any], ...], numbers: np.dtype) -> tuple[float, float, float]:
    """Compile a law's functions for its record."""
    functions = [getattr(function, "py_func", function) for function in given]
    if INTERPRETED:
        record.FUNCTIONS |= {len(record.FUNCTIONS) + i: (function, numbers) for i, function in enumerate(functions)}
        first = float(len(record.FUNCTIONS) - len(functions))
        return first, first + 1.0, first + 2.0
    contact, law, number = record.CONTACT_TYPE, numba.from_dtype(numbers), numba.types.float64
    signatures = (
        numba.types.UniTuple(number, 2)(contact, law, record.MEMORY_TYPE, number, number, number),
        number(contact, law),
        number(contact, law, record.MEMORY_TYPE),
    )
    first, second, third = (
        float(address_of(function, signature, ours=Path(function.__code__.co_filename).is_relative_to(PACKAGE)))
        for function, signature in zip(functions, signatures, strict=True)
    )
    return first, second, third
