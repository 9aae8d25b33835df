"""Replacement of `pybullet.stepSimulation` within a context, for environments that step PyBullet themselves."""

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
    """Stands in for stepSimulation: takes the steps of clients in `_STEPPED`, and passes others on to PyBullet.

    BulletClient of pybullet_utils adds its client id only to calls of built-in functions, so this claims to be one.
    """

    __class__ = property(lambda self: BuiltinFunctionType)  # type: ignore[assignment]  # for `isinstance`

    def __call__(self, physicsClientId: int = 0) -> None:
        callback = stepped_by(physicsClientId)
        (callback.step if callback else lambda: STEP_BULLET(physicsClientId))()


_STEP: Any = _Step()


def stepped_by(client: int) -> Any:
    """Return the callback that takes the steps of a client, None if none does."""
    return _STEPPED.get(client)


@contextmanager
def stepping(callback: Any, client: int) -> Iterator[None]:
    """Let a callback take the steps of a client, whichever code calls stepSimulation.

    Raises:
        ValueError: Another callback takes them already.
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
    """Replace a function in PyBullet and in all modules that imported it by name."""
    for module in list(sys.modules.values()):
        names = getattr(module, "__dict__", {})
        if names.get("stepSimulation") is old:
            names["stepSimulation"] = new
