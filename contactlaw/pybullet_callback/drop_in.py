"""The law in an existing URDF, with names of links in place of numbers: docs/pybullet.md has an example."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw import checks
from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback import shapes
from contactlaw.pybullet_callback.callback import ContactCallback

Names = str | Sequence[str]
Other = int | Names | Sequence[int] | Sequence[shapes.Key]
Contacts = Sequence[tuple[Names, Other, ContactPair] | tuple[Names, Other, ContactPair, Mapping[str, Any]]]

UNDAMPED = {"linearDamping": 0.0, "angularDamping": 0.0, "maxJointVelocity": 1e6}


class Loaded(NamedTuple):
    """A loaded body by PyBullet's id, and the handles of its contacts, in the order given."""

    body: int
    handles: tuple[int, ...]


def load_urdf(
    callback: ContactCallback, path: str | os.PathLike[str], contacts: Contacts, *, undamped: bool = True,
    **options: Any,
) -> Loaded:  # fmt: skip
    """Load a URDF and let links of it touch by the law; Bullet finds the files that it refers to beside it.

    Args:
        callback: The callback that integrates the contacts.
        path: The file; Bullet also searches the folders of setAdditionalSearchPath.
        contacts: Each (links, other, pair); links as for `links_of`; other: a loaded body, or bodies, or (body, link),
            as for `ContactCallback.add_contact`; or names of other links of this URDF. A fourth entry, a dict, holds
            settings of `add_contact`: substeps, rounding.
        undamped: Whether to set Bullet's default damping, which dissipates energy in flight, to zero, and to raise its
            limit of velocities. Damping of joints stays as the URDF has it.
        options: Those of `pybullet.loadURDF`: basePosition, useFixedBase, globalScaling, ...

    Raises:
        ValueError: The file cannot be loaded, or the law cannot serve a contact; the body is removed then.
    """
    checks.instance("callback", callback, ContactCallback)
    checks.instance("path", path, str, os.PathLike)
    if isinstance(contacts, str | bytes) or not isinstance(contacts, Sequence) or not contacts:
        raise ValueError(f"contacts = {contacts!r}: must be a sequence of (links, other, pair), not empty")
    checks.truth("undamped", undamped)
    client = callback._client
    told = {name: OPTIONS[checks.one_of("option", name, OPTIONS)](name, value) for name, value in options.items()}
    try:
        body = p.loadURDF(os.fspath(path), physicsClientId=client, **told)
    except p.error as error:
        raise ValueError(
            f"path = {os.fspath(path)!r}: {error} (there must be such a file, here or in a folder of "
            "setAdditionalSearchPath, and it must be a URDF)"
        ) from None
    handles: list[int] = []
    try:
        for number, entry in enumerate(contacts):
            if not isinstance(entry, Sequence) or len(entry) not in (3, 4):
                raise ValueError(f"contacts[{number}] = {entry!r}: must be (links, other, pair), and maybe settings")
            ones = links_of(body, entry[0], client=client, argument=f"contacts[{number}], links")
            twos: Any = entry[1]
            if any(isinstance(one, str) for one in checks.flat([twos])):
                twos = links_of(body, twos, client=client, argument=f"contacts[{number}], other")
            own = checks.instance(f"contacts[{number}], settings", entry[3], Mapping) if len(entry) == 4 else {}
            try:
                handles.append(callback.add_contact(ones, twos, entry[2], **own))
            except ValueError as error:
                raise ValueError(f"contacts[{number}]: {error}") from None
    except BaseException:
        for handle in handles:
            callback.remove_contact(handle)
        p.removeBody(body, client)
        raise
    if undamped:
        p.changeDynamics(body, shapes.BASE, physicsClientId=client, **UNDAMPED)
    return Loaded(body, tuple(handles))


def _quaternion(name: str, value: Any) -> list[float]:
    if checks.finite_array(name, value).shape != (4,) or not np.any(value):
        raise ValueError(f"{name} = {value!r}: must be a quaternion, scalar last")
    return np.asarray(value, float).tolist()


def _switch(name: str, value: Any) -> int:
    on = int(value) if isinstance(value, bool | np.bool_) else checks.count(name, value, 0, 1)
    if on and name == "useMaximalCoordinates":
        raise ValueError(f"{name} = {value!r}: must be False, as PyBullet does not tell the shapes of such a body")
    return on


OPTIONS: dict[str, Callable[[str, Any], Any]] = {
    "basePosition": checks.vector, "baseOrientation": _quaternion, "globalScaling": checks.positive,
    "useFixedBase": _switch, "useMaximalCoordinates": _switch, "flags": partial(checks.count, least=0),
}  # fmt: skip
"""Checks of the options of pybullet.loadURDF; its physicsClientId is that of the callback."""


def links_of(body: int | Iterable[int], *names: Names, client: int = 0, argument: str = "names") -> list[shapes.Key]:
    """Return links of a body by their names, for `ContactCallback.add_contact`.

    Args:
        body: PyBullet's id; or several, as loadMJCF and loadSDF return them.
        names: Each the name of a link (the base has one too), a shell pattern ("*_wheel"), or a sequence of such; none:
            "*". Patterns leave out links without a collision shape.
        client: Physics client id.
        argument: Name of the argument in messages.

    Returns:
        (body, link) of each, link -1 for the base, in the order of the names, each once.

    Raises:
        ValueError: No such body, no such link (the message offers the nearest names), or one without a collision shape,
            or with one that PyBullet does not tell (docs/limits.md).
    """
    client = shapes.client_of(client)
    given: Any = body if shapes.holds(body) else [body]
    bodies = [shapes.identity("body", one, shapes.bodies_of(client), "the bodies of this client") for one in given]
    if not bodies:
        raise ValueError(f"body = {body!r}: holds no bodies; must hold one or more")
    links = list[tuple[shapes.Key, str]]()
    for one in bodies:
        names_of = [p.getBodyInfo(one, client)[0].decode(), *(joint.link for joint in shapes.joints_of(one, client))]
        links += [((one, link), name) for link, name in enumerate(names_of, shapes.BASE)]
    solid = {key for key, _ in links if shapes.collision_shapes(client, *key)}
    found: dict[shapes.Key, None] = {}
    for text in checks.flat(names) or ["*"]:
        if not isinstance(text, str):
            raise ValueError(f"{argument} = {text!r}: must be the name of a link, or a pattern such as '*_wheel'")
        meant = set(checks.fitting(text, (name for _, name in links)))
        fitting = [key for key, name in links if name in meant]
        chosen = [key for key in fitting if key in solid]
        if not chosen:
            why = "has no collision shape to touch with" if fitting else "no link has such a name"
            known = sorted({name for key, name in links if key in solid})
            rest = f"links with a collision shape are {', '.join(known) or 'none'}"
            raise ValueError(f"{argument} = {text!r}: {why}; {checks.nearest(text, known, rest)}")
        found.update(dict.fromkeys(chosen))
    return list(found)
