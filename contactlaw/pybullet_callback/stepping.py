"""`pybullet.stepSimulation` replaced for a while, for those who do not let their steps be taken by others."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import BuiltinFunctionType
from typing import Any

import pybullet as p

STEP_BULLET = p.stepSimulation
_STEPPED: dict[int, Any] = {}


class _Step:
    """What stands in its place: takes the steps of the clients in `_STEPPED`, and leaves others to PyBullet.

    BulletClient of pybullet_utils gives its id to what it takes for a built-in function, and to nothing else.
    """

    __class__ = property(lambda self: BuiltinFunctionType)  # type: ignore[assignment]  # what `isinstance` asks for

    def __call__(self, physicsClientId: int = 0) -> None:
        callback = stepped_by(physicsClientId)
        (callback.step if callback else lambda: STEP_BULLET(physicsClientId))()


_STEP: Any = _Step()


def stepped_by(client: int) -> Any:
    """The callback that has the steps of a client; None: none has."""
    return _STEPPED.get(client)


@contextmanager
def stepping(callback: Any, client: int) -> Iterator[None]:
    """Let a callback take the steps of a client, whoever asks for them.

    Raises:
        ValueError: Another one has them.
    """
    if client in _STEPPED:
        raise ValueError(f"client {client}: its steps are taken inside another `stepping` already")
    _STEPPED[client] = callback
    _replace(STEP_BULLET, _STEP)
    try:
        yield
    finally:
        del _STEPPED[client]
        if not _STEPPED:
            _replace(_STEP, STEP_BULLET)


def _replace(old: Callable[..., Any], new: Callable[..., Any]) -> None:
    """In PyBullet, and where it was imported by name."""
    for module in list(sys.modules.values()):
        names = getattr(module, "__dict__", {})
        if names.get("stepSimulation") is old:
            names["stepSimulation"] = new
