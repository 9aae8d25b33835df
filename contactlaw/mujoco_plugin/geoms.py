"""Geoms: which pairs the law serves, which touch natively; and their selection by name, pattern, body or id."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw import checks
from contactlaw.mujoco_plugin.layout import ModelView
from contactlaw.world.near.sets import Sets

Bits = tuple[int, int]
Selector = str | int | mujoco.MjsGeom
UNSERVED = ("sdf",)  # types to which MuJoCo computes no reliable distance
FLAT = "plane", "hfield"  # types that only round shapes, or round parts of others, can touch
BOUND: dict[str, Callable[[NDArray[np.float64]], Any]] = {
    "sphere": lambda size: size[0], "capsule": lambda size: size[0] + size[1], "ellipsoid": np.max,
    "cylinder": lambda size: np.hypot(size[0], size[1]), "box": np.linalg.norm,
}  # fmt: skip
"""Radius [m] of MuJoCo's bounding sphere by the sizes of a geom; planes, height fields and meshes have none."""
BODY = "body:"
MAX_NAMES = 20  # in a message


def type_of(number: int) -> str:
    """Return the type of a geom by MuJoCo's number, as MJCF names it."""
    return mujoco.mjtGeom(number).name.removeprefix("mjGEOM_").lower()


@dataclass(frozen=True)
class Shape:
    """Type and sizes of a geom, as MJCF has them; type and quoted name, or what tells of it if it has none."""

    type: str
    size: NDArray[np.float64]
    label: str


def shape_of(geom: mujoco.MjsGeom) -> Shape:
    """Return the shape of a geom of a specification."""
    kind, name = type_of(geom.type), repr(geom.name) if geom.name else f"without a name of body {geom.parent.name!r}"
    return Shape(kind, np.array(geom.size), f"{kind} {name}")


def shape_in(view: ModelView, geom: int) -> Shape:
    """Return the shape of a geom of a compiled model."""
    kind = type_of(int(view.geom_type[geom]))
    return Shape(kind, view.geom_size[geom].copy(), f"{kind} {view.label('geom', geom)}")


def why_not_served(one: Shape, two: Shape) -> str | None:
    """Return why the law cannot serve the contact of two shapes, or None if it can."""
    for shape in (one, two):
        if shape.type in UNSERVED:
            return (
                f"{shape.label}: MuJoCo computes no reliable distance to it, and bodies would fall through; a plane, "
                "height field, sphere, capsule, ellipsoid, cylinder, box or convex mesh will do"
            )
    if one.type in FLAT and two.type in FLAT:
        return f"{one.label} on {two.label}: planes and height fields do not touch each other; a box will do for one"
    return None


def check_served(sets: Sets, shapes: Mapping[Any, Shape]) -> None:
    """Check that the law can serve all pairs of two sets of geoms; the error names them."""
    for one, two in sets.by_kinds(lambda geom: shapes[geom].type):
        why = why_not_served(shapes[one], shapes[two])
        if why:
            raise ValueError(why)


def native_margin(one: Shape, two: Shape) -> tuple[float, float]:
    """Return margin and gap [m] of an explicit `<pair>` for which the engine never makes a contact.

    The engine compares squared distances of bounding spheres with the sum of radii and margin: only a sum of exactly
    zero rejects all. Planes are compared by signed distance. Convex shapes that pass this test are reported as touching
    whatever the margin is. A mesh has its bounding sphere only once compiled, so it passes; the gap then excludes its
    contacts from the constraints.
    """
    if one.type in BOUND and two.type in BOUND:
        return -sum(float(BOUND[shape.type](shape.size)) for shape in (one, two)), 0.0
    return -1e6, 0.0 if "plane" in (one.type, two.type) else 1e6


def touch(one: Any, two: Any) -> Any:
    """Return whether geoms with these (contype, conaffinity), numbers or arrays, touch natively."""
    return ((one[0] & two[1]) | (two[0] & one[1])) != 0


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
            raise ValueError(f"no body of the model has such a name; {offer(wanted, bodies)}")
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
            raise ValueError(f"{what} the name of no geom of the model; {offer(text, named)}{rest}")
    solid = [geom for geom in geoms if geom.contype or geom.conaffinity]
    if not solid:
        raise ValueError(
            f"means {first_of([shape_of(geom).label for geom in geoms], MAX_NAMES)}, and the engine "
            "lets none of them touch anything (contype = conaffinity = 0); if one is wanted, give its own name or id"
        )
    return solid


def _by_id(ids: dict[Any, int], value: Any) -> Any:
    """Return the geom of this id, or itself; ids: of all geoms."""
    if isinstance(value, mujoco.MjsGeom):
        if value not in ids:
            raise ValueError("must be a geom of this model")
        return value
    number = checks.whole(value)
    for geom, own in ids.items():
        if own == number and own >= 0:  # geoms of a model that is not compiled have -1
            return geom
    raise ValueError(
        "must be a geom's name, a pattern for names, 'body:NAME', or the id of a geom "
        f"(0 to {max(ids.values(), default=-1)}) of the compiled model"
    )


def offer(text: str, names: Iterable[str]) -> str:
    """Return the nearest names, or the first few of all."""
    known = sorted(names)
    return checks.nearest(text, known, f"there are {first_of(known, MAX_NAMES) or 'none'}")
