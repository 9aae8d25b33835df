"""Selection of geoms of a specification by name, pattern, body or id."""

import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import count
from typing import Any

import mujoco

from contactlaw import checks
from contactlaw.mujoco_plugin.shapes import type_of

BODY = "body:"
MAX_NAMES = 20  # in a message

Selector = str | int | mujoco.MjsGeom


def geoms_of(spec: mujoco.MjSpec, *what: Selector | Sequence[Selector], argument: str = "geoms") -> list[Any]:
    """Return the geoms of a specification that a selection means, each once, for `add_contact`.

    Args:
        spec: The model; selection by id needs a compiled one.
        what: Each one of, or a sequence of,
            "ball": the name of a geom;
            "ball*": a shell pattern for names of geoms;
            "body:cup", "body:*_foot": the geoms of a body, or of the bodies whose names match ("body:*": of all but the
                world), not of their children;
            7: the id of a geom in the compiled model;
            a geom of the specification.
            Patterns and bodies leave out visual geoms (contype = conaffinity = 0); a name or an id selects them too.
        argument: Name of the argument in messages.

    Raises:
        ValueError: A selector means nothing; the message offers the nearest names.
    """
    checks.instance("spec", spec, mujoco.MjSpec)
    listed = cache(lambda: {geom: geom.id for geom in spec.geoms})  # only if needed: its time grows as the square
    found = dict[Any, None]()
    for item in checks.flat(what, mujoco.MjsGeom):
        name = item if isinstance(item, str) else item.name if isinstance(item, mujoco.MjsGeom) else ""
        named = spec.geom(name) if name else None
        try:
            if named and item in (name, named):
                found[named] = None
            elif isinstance(item, str):
                found.update(dict.fromkeys(_by_text(spec, listed, item)))
            else:
                found[_by_id(listed(), item)] = None
        except ValueError as error:
            shown = f"geom {item.name!r}" if isinstance(item, mujoco.MjsGeom) else repr(item)
            raise ValueError(f"{argument} = {shown}: {error}") from None
    if not found:
        raise ValueError(f"{argument}: holds no geoms; must hold one or more")
    return list(found)


def label(geom: mujoco.MjsGeom) -> str:
    """Return a geom's type and name for messages, or its body's name if it has none."""
    return f"{type_of(geom.type)} {repr(geom.name) if geom.name else f'without a name of body {geom.parent.name!r}'}"


def first_of(texts: Sequence[str], most: int, noun: str = "") -> str:
    """Return the first few texts in one line, and how many more there are."""
    more = f" and {len(texts) - most} more{noun and f' {noun}'}" if len(texts) > most else ""
    return ", ".join(texts[:most]) + more


def give_names(spec: mujoco.MjSpec, geoms: Iterable[Any]) -> None:
    """Name geoms of a specification that have no name after their body, with a number."""
    numbers = dict[str, Iterator[int]]()
    for geom in (geom for geom in geoms if not geom.name):
        stem = f"{geom.parent.name or 'body'}_geom".replace(" ", "_")
        names = (f"{stem}{number}" for number in numbers.setdefault(stem, count()))
        geom.name = next(name for name in names if spec.geom(name) is None)


def _by_text(spec: mujoco.MjSpec, listed: Callable[[], Iterable[Any]], text: str) -> list[Any]:
    """Return the geoms that a text means which is not the name of one; listed: returns all geoms."""
    if text.startswith(BODY):
        wanted, bodies = text.removeprefix(BODY), {body.name: body for body in spec.bodies if body.name}
        fitting = [bodies[name] for name in checks.fitting(wanted, bodies)]
        if checks.is_wild(wanted):
            fitting = [body for body in fitting if body.id != spec.worldbody.id]
        if not fitting:
            raise ValueError(f"no body of the model has such a name; {_offer(wanted, bodies)}")
        geoms = [geom for body in fitting for geom in body.geoms]
        if not geoms:
            raise ValueError("has no geoms of its own; give the body that has them")
    else:
        named = {geom.name: geom for geom in listed() if geom.name}
        geoms = [named[name] for name in checks.fitting(text, named)]
        if not geoms:
            without = len([geom for geom in listed() if not geom.name])
            rest = f"; {without} geoms have no name, say 'body:NAME' or their id" if without else ""
            what = "fits" if checks.is_wild(text) else "is"
            raise ValueError(f"{what} the name of no geom of the model; {_offer(text, named)}{rest}")
    solid = [geom for geom in geoms if geom.contype or geom.conaffinity]
    if not solid:
        raise ValueError(
            f"means {first_of([label(geom) for geom in geoms], MAX_NAMES)}, and the engine "
            "lets none of them touch anything (contype = conaffinity = 0); if one is wanted, give its own name or id"
        )
    return solid


def _by_id(ids: dict[Any, int], value: Any) -> Any:
    """Return the geom of this id, or itself; ids: of all geoms."""
    if isinstance(value, mujoco.MjsGeom):
        if value not in ids:
            raise ValueError("must be a geom of this model")
        return value
    try:
        number = -1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = -1
    geom = next((geom for geom, own in ids.items() if own == number >= 0), None)
    if geom is None:
        raise ValueError(
            "must be a geom's name, a pattern for names, 'body:NAME', or the id of a geom "
            f"(0 to {max(ids.values(), default=-1)}) of the compiled model"
        )
    return geom


def _offer(text: str, names: Iterable[str]) -> str:
    """Return the nearest names, or the first few of all."""
    known = sorted(names)
    return checks.nearest(text, known, f"there are {first_of(known, MAX_NAMES) or 'none'}")
