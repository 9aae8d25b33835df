"""Base class of all laws of the tangential force, in this folder or in a user's own file."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache
from math import hypot, inf, isfinite
from numbers import Real
from pathlib import Path
from typing import Any, ClassVar, Self

import numba
import numpy as np
from numpy.typing import NDArray

from contactlaw import checks
from contactlaw.jit import INTERPRETED, address_of
from contactlaw.laws import record
from contactlaw.laws.slip import stuck_stiffness
from contactlaw.memory import address_of_python

Array = NDArray[np.float64]
Impacts = Callable[[Array, Array, Array], object]

MOST_VECTORS = 512  # that a law remembers
FORMS = "contact, law, memory, du, dv, dt", "contact, law", "contact, law, memory"  # of force, stiffness and energy
PACKAGE = Path(__file__).parents[1]  # folder of the sources that key the cache


@dataclass(frozen=True)
class Law:
    """Law of the tangential force of a contact, as a function of its motion.

    To write a law, in this folder or in a file of your own, subclass `Law` as a frozen dataclass whose fields are
    numbers with defaults; they can be set wherever a law is named, as in "my_law field=value". Its static method
    `force(contact, law, memory, du, dv, dt)`, Python that numba can compile, returns the force along both tangents [N],
    at most mu P, by `return carried(contact, f, g)`. contact is `record.CONTACT`; law has the fields by name;
    memory[0, i] and memory[1, i] are the components of vector i along the two tangents, zero at the touch; du, dv are
    the displacement of A relative to B over the step [m]; dt is the step [s], or 0 on a quasi-static path and in an
    implicit step. Where the defaults, those of Mindlin's spring, do not fit: `stiffness(contact, law)`, stuck [N/m]
    (infinite: rigid; 0: by rates alone), and `energy(contact, law, memory)` [J].

    Attributes:
        name: Name by which users select the law, once its file has been imported.
        source: Publication or derivation of the law.
        rung: Position in the ladder `LAWS`, over which all property tests run; infinite: not in `LAWS`.
        memory: Number of vectors in the tangent plane that the law remembers of a contact.
        linear: Whether the normal spring is linear as well.
        sectors: Whether `laws.sectors` may replace the law in contacts that spin, as both describe micro-slip.
        on_line: Module that treats motion along a line exactly (`microslip_line`), or None.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    rung: ClassVar[float] = inf
    memory: ClassVar[Any] = 1
    linear: ClassVar[bool] = False
    sectors: ClassVar[Any] = False
    force: ClassVar[Callable[..., tuple[float, float]]]
    on_line: ClassVar[Any] = None

    def __init_subclass__(cls) -> None:
        if hasattr(cls, "name"):  # a base class of several laws has no name
            holder = KNOWN.get(cls.name, cls).__module__
            ours = holder.startswith("contactlaw.") and holder != cls.__module__  # text would mean that law
            if ours or str(cls.name).split() != [cls.name]:
                what = "must be one word, and not the name of a law of contactlaw"
                raise ValueError(f"{cls.__name__}.name = {cls.name!r}: {what}")
            KNOWN[cls.name] = cls

    def __post_init__(self) -> None:
        if not callable(getattr(self, "force", None)):
            raise TypeError(f"{type(self).__name__}: has no force({FORMS[0]})")
        checks.count(f"{type(self).__name__}.memory", self.memory, 0, MOST_VECTORS)
        for field in fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, Real) and isfinite(value)):
                raise ValueError(f"{field.name} = {value!r}: must be a finite number")

    @staticmethod
    def stiffness(contact: Any, law: Any) -> float:
        """Tangential stiffness [N/m] of a contact that sticks everywhere."""
        return stuck_stiffness(contact)

    @staticmethod
    def energy(contact: Any, law: Any, memory: Any) -> float:
        """Elastic energy F^2/(4 G* a) [J], with F the force of the springs, without friction's share of the damper."""
        if contact.ratio <= 0.0 or contact.overlap <= 0.0:
            return 0.0
        f, g = contact.f / contact.ratio, contact.g / contact.ratio
        return (f * f + g * g) / (2.0 * stuck_stiffness(contact))

    def finite(self, value: Any) -> Any:
        """Return a result of this law; raise ValueError if it is not finite."""
        if not np.isfinite(value).all():
            raise ValueError(f"{type(self).__name__}: its force is not finite somewhere on the way")
        return value

    def with_nodes(self, suggested: int | None) -> Self:
        """Return the law with a definite number of vectors: the suggested number if the law leaves it open."""
        return self

    def numbers(self) -> NDArray[Any]:
        """Return the record that `force` reads, a structured array of shape (1,)."""
        own = {field.name: getattr(self, field.name) for field in fields(self)}
        return record.record_of(vectors=self.memory, **own)

    def with_pair(self, *known: float, speeds: Array | None = None) -> Array:
        """Return the numbers that the kernels read: `record.PAIR`, then the law's own, then those of `losses`.

        Args:
            known: The first eight fields of `record.PAIR`.
            speeds: Table of `losses`; None: restitution and friction do not depend on speed.
        """
        numbers = self.numbers()
        own, addresses = numbers.view(np.float64), _addresses(self.functions(), numbers.dtype, int(self.memory))
        at = 0 if speeds is None else record.PAIR_SIZE + own.size
        pair = np.array((*known, at, self.linear, self.memory, self.sectors, *addresses), record.PAIR)
        return np.concatenate([pair.reshape(1).view(np.float64), own, *([] if speeds is None else [speeds])])

    def new_contact(self) -> tuple[NDArray[Any], Array]:
        """Return an array of one contact (`record.CONTACT`) and the vectors of the law, both zero."""
        return np.zeros(1, record.CONTACT), np.zeros(2 * self.memory)

    def functions(self) -> tuple[Callable[..., Any], ...]:
        """Return the functions force, stiffness and energy."""
        return self.force, self.stiffness, self.energy

    def impacts(self, zeta: float, steps: int) -> Impacts | None:
        """Return a function (psi_1, chi, psi_2_out) for whole impacts, arrays (n,), or None: integrate in steps.

        zeta: damping ratio. steps: steps per impact.
        """
        return None


KNOWN: dict[str, type[Law]] = {}
"""All laws whose files have been imported, by name; of two with the same name, the later one."""


@lru_cache(maxsize=256)
def _addresses(given: tuple[Callable[..., Any], ...], numbers: np.dtype, memory: int) -> tuple[float, ...]:
    """Compile the functions of a law for its record and return their addresses.

    A user's `force` is called once with checked indices, as what it writes beyond its memory would end the process; it
    then slides far, at mu P = 1.

    Raises:
        TypeError: One cannot be compiled.
        IndexError: `force` uses more vectors than the law has.
        ValueError: `force` exceeds mu P.
    """
    functions = [getattr(function, "py_func", function) for function in given]
    if INTERPRETED:
        return tuple(float(address_of_python(function, numbers)) for function in functions)
    addresses, slid = [], (0.0, 0.0)
    for one, signature, form in zip(functions, record.signatures(numba.from_dtype(numbers)), FORMS, strict=True):
        try:
            ours = Path(one.__code__.co_filename).is_relative_to(PACKAGE)
            addresses.append(float(address_of(one, signature, ours=ours)))
            if not ours and not addresses[1:]:
                checked = numba.njit(signature, boundscheck=True, error_model="numpy")(one)
                contact, law = np.ones(1, record.CONTACT)[0], np.ones(1, numbers)[0]
                slid = checked(contact, law, np.zeros((2, memory)), 1e6, 1e6, 1.0)
        except IndexError as error:
            raise IndexError(f"{one.__qualname__}: memory = {memory}, of shape (2, {memory}): {error}") from error
        except Exception as error:  # numba's, of any kind, which may not tell the function
            names = ", ".join((numbers.names or ())[1:]) or "none"
            back = "two numbers" if form == FORMS[0] else "a number"
            hint = f"; must be a static method, take ({form}), and return {back}"
            hint = f", no field of contact, nor of law; those of law: {names}" if isinstance(error, KeyError) else hint
            what = f"numba cannot compile it: {type(error).__name__}: {error}{hint}"
            raise TypeError(f"{one.__qualname__}: {what}") from error
    if 1.0 + 1e-9 < hypot(*slid) < inf:
        raise ValueError(f"{given[0].__qualname__}: returns up to {hypot(*slid):.2g} mu P; must be at most mu P")
    return tuple(addresses)
