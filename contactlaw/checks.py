"""Input checks: every error names the argument, the value and what is allowed."""

import difflib
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from decimal import Decimal
from fnmatch import fnmatchcase
from functools import partial
from importlib import import_module
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

LARGEST = float(np.finfo(float).max)
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|nan)", re.IGNORECASE)  # a number in XML
NUMBERS = "iufO"  # NumPy kinds that may hold real numbers; objects: Decimal and other types


def number(name: str, value: Any, allowed: str, *, low: float, high: float, open_low: bool = False) -> float:
    """Return value as a float inside [low, high] (or (low, high]); infinities pass only where a bound is infinite."""
    if type(value) is float and low <= value <= high and not (open_low and value == low):
        return value  # what follows takes several times as long
    try:
        if np.asarray(value).dtype.kind not in NUMBERS or np.ndim(value):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {value!r}: must be a number {allowed}") from None
    if not (low <= result <= high) or (open_low and result == low):
        raise ValueError(f"{name} = {value!r}: must be {allowed}")
    return result


def number_in(name: str, text: str, other: str = "") -> float:
    """Return the number that a text is; other: what else may be given, for the message."""
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(f"{name} = {text!r}: must be a number{other}")
    return float(text)


positive = partial(number, allowed="finite and > 0", low=0.0, high=LARGEST, open_low=True)
"""Return value as a float that is finite and above zero."""

not_negative = partial(number, allowed="finite and >= 0", low=0.0, high=LARGEST)
"""Return value as a float that is finite and not below zero."""

LEAST_RESTITUTION = 1e-6  # 0 would need infinite damping; far below, the damped oscillator loses its digits
RESTITUTIONS = "in [1e-6, 1]"
SPEEDS = 1e-30, 1e30  # [m/s], beyond which powers of a speed under- or overflow
LARGEST_COUNT = 2**63 - 1  # that compiled code can take


restitution = partial(number, allowed=RESTITUTIONS, low=LEAST_RESTITUTION, high=1.0)
"""Return value as a restitution coefficient, a float in [1e-6, 1]."""


def speed(name: str, value: Any, *, least: float = SPEEDS[0]) -> float:
    """Return value as a speed [m/s] whose powers neither under- nor overflow."""
    return number(name, value, f"in [{least:g}, {SPEEDS[1]:g}] m/s", low=least, high=SPEEDS[1])


def finite_array(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return value as a finite float64 array. Booleans, text, complex numbers and masked values are refused."""
    if type(value) is np.ndarray and value.dtype == np.float64 and np.isfinite(value).all():
        return value
    if np.ma.is_masked(value):
        raise ValueError(f"{name}: has masked values; leave them out first, by compressed() say")
    try:
        given = np.asarray(value)
        whole = given.dtype.kind != "O" or all(
            isinstance(one, Real | Decimal) and not isinstance(one, bool) for one in given.flat
        )
        if given.dtype.kind not in NUMBERS or not whole:
            raise TypeError
        with np.errstate(over="ignore"):
            array = given.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        kind = f"of kind {value.dtype}" if isinstance(value, np.ndarray) else f"= {value!r}"
        raise ValueError(f"{name} {kind}: must be real numbers") from None
    if not np.isfinite(array).all():
        bad = array[~np.isfinite(array)].flat[0]
        raise ValueError(f"{name}: holds {bad}; every value must be finite")
    return array


def broadcast(given: dict[str, ArrayLike]) -> list[NDArray[np.float64]]:
    """Return finite float64 arrays by name, broadcast to one shape."""
    arrays = [finite_array(name, value) for name, value in given.items()]
    try:
        return arrays if all(array.ndim == 0 for array in arrays) else list(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True))
        raise ValueError(f"{shapes}: must be shapes that broadcast together") from None


def vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return a copy of value as a finite float64 vector of three."""
    array = finite_array(name, value)
    if array.shape != (3,):
        raise ValueError(f"{name}: shape {array.shape}; must be (3,)")
    return array.copy()


def unit_vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return value as a unit vector. A length that differs from 1 by more than 1e-6 is refused, else normalised."""
    array = vector(name, value)
    length = float(np.linalg.norm(array))
    if abs(length - 1.0) > 1e-6:
        raise ValueError(f"{name} = {array.tolist()}: must be a unit vector, its length is {length:.6g}")
    return array / length


def set_fields(one: Any, **checked: Callable[[str, Any], Any]) -> None:
    """Replace fields of a frozen dataclass by what their checks return of (name, value); a None by default stays."""
    for name, check in checked.items():
        value = getattr(one, name)
        if value is not None or getattr(type(one), name, one) is not None:
            object.__setattr__(one, name, check(name, value))


def text_of(value: Any) -> str:
    """Return a number as text; of a dataclass of numbers, as `named` reads it, its name and fields beside defaults."""
    if isinstance(value, Real):
        return repr(value)
    given = ((field, getattr(value, field.name)) for field in fields(value))
    words = (
        f"{field.name}={','.join(map(repr, np.ravel(own).tolist()))}" for field, own in given if own != field.default
    )
    return " ".join([value.name, *words])


def named(argument: str, text: Any, known: Mapping[str, type]) -> Any:
    """Return the dataclass, one of the known ones, that "name field=number field=number,number" describes.

    Integers stay int, lists become tuples.
    """
    name, *words = text.split() if isinstance(text, str) and text.strip() else [text]
    kind, given = known[one_of(argument, name, known)], {}
    for word in words:
        key, _, value = word.partition("=")
        one_of(f"field of {name}", key, [field.name for field in fields(kind)])
        try:
            numbers = tuple(int(one) if one.lstrip("+-").isdigit() else float(one) for one in value.split(","))
        except ValueError:
            raise ValueError(f"{argument} = {text!r}: {value!r} must be a number") from None
        given[key] = numbers if "," in value else numbers[0]
    try:
        return kind(**given)
    except TypeError:
        raise ValueError(f"{argument} = {text!r}: must name every field of {name} that has no default") from None


def one_of(name: str, value: Any, allowed: Iterable[str]) -> str:
    """Return value if it is one of the allowed names; the error suggests the nearest one."""
    names = list(allowed)
    if isinstance(value, str) and value in names:
        return value
    raise ValueError(f"{name} = {value!r}: must be one of {', '.join(names)}{hint(value, names)}")


def hint(value: Any, names: Iterable[str]) -> str:
    """Return " (did you mean ...?)" with the nearest name, ignoring case, or an empty string."""
    known = {name.lower(): name for name in names}
    near = difflib.get_close_matches(str(value).lower(), known, n=1)
    return f" (did you mean {known[near[0]]!r}?)" if near else ""


def truth(name: str, value: Any) -> bool:
    """Return value if it is True or False. Numbers and text are refused, since "no" would count as True."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} = {value!r}: must be True or False")
    return bool(value)


def instance(name: str, value: Any, *kinds: type) -> Any:
    """Return value if it is an instance of one of the classes."""
    if not isinstance(value, kinds):
        what = " or ".join(f"{kind.__module__.partition('.')[0]}.{kind.__name__}" for kind in kinds)
        raise ValueError(f"{name} = {value!r}: must be a {what.replace('builtins.', '')}")
    return value


def count(name: str, value: Any, least: int, most: int = LARGEST_COUNT) -> int:
    """Return value as an int >= least, and at most `most`."""
    result = whole(value)
    if result is None or not least <= result <= most:
        allowed = f"from {least} to {most}" if most < LARGEST_COUNT or (result or 0) > most else f">= {least}"
        raise ValueError(f"{name} = {value!r}: must be an integer {allowed}")
    return result


def whole(value: Any) -> int | None:
    """Return value as an int if it is one, and no truth value; else None."""
    try:
        return None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        return None


def need(module: str, what: str, extra: str) -> None:
    """Import a module of an optional extra; the error names the extra that installs it."""
    try:
        import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != module:
            raise
        raise ModuleNotFoundError(f"{what} needs {module}: pip install 'contactlaw[{extra}]'", name=module) from error


WILD = "*?["
"""Characters that make a text a shell pattern."""


def is_wild(text: str) -> bool:
    """Return whether a text is a shell pattern."""
    return any(mark in text for mark in WILD)


def fitting(text: str, names: Iterable[str]) -> list[str]:
    """Return those of the names that a text means: itself, or all that fit it if it is a shell pattern."""
    known = list(names)
    return [text] if text in known else [name for name in known if is_wild(text) and fnmatchcase(name, text)]


def flat(items: Iterable[Any], one: Any = str) -> list[Any]:
    """Return a list of the items, with iterables among them replaced by their items.

    one: type of items that stay as they are though they are iterable, besides str.
    """
    out: list[Any] = []
    for item in items:
        out.extend([item] if isinstance(item, str | one) or not np.iterable(item) else item)
    return out


def nearest(text: str, names: Iterable[str], rest: str) -> str:
    """Return "did you mean ...?" with up to three of the nearest names, or `rest` if none is near."""
    text, known = text.strip(WILD + "]"), sorted(set(names))
    near = difflib.get_close_matches(text, known, n=3)
    near += [
        name
        for name in known
        if text and name not in near and difflib.get_close_matches(text, re.split("[_/.-]", name))
    ]
    return f"did you mean {' or '.join(repr(name) for name in near[:3])}?" if near else rest
