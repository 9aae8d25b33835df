"""Replacement of `pybullet.stepSimulation`, so that a callback can take the steps of loops that it does not own."""

import sys
from types import BuiltinFunctionType
from typing import Any

import pybullet as p

STEP_BULLET = p.stepSimulation
STEPPED: dict[int, Any] = {}  # of a client, the callback that takes all its steps
NEXT: dict[int, Any] = {}  # of a client, the callback that takes its next step


class _Step:
    """Stands in for stepSimulation: takes the steps of clients in `NEXT` or `STEPPED`, and passes on all others.

    BulletClient of pybullet_utils adds its client id only to calls of built-in functions, so this claims to be one.
    """

    __class__ = property(lambda self: BuiltinFunctionType)  # type: ignore[assignment]  # for `isinstance`

    def __call__(self, physicsClientId: int = 0) -> None:
        callback = NEXT.pop(physicsClientId, None) or STEPPED.get(physicsClientId)
        (callback.step if callback else lambda: STEP_BULLET(physicsClientId))()


_STEP: Any = _Step()


def take(steps: dict[int, Any], client: int, callback: Any) -> None:
    """Let a callback take steps of a client, whichever code calls stepSimulation; steps: `NEXT` or `STEPPED`.

    The function is replaced in PyBullet and in all modules that have imported it by name, once and for good.
    """
    if client in STEPPED:
        raise ValueError(f"client {client}: its steps are taken inside a `stepping` already")
    if client in NEXT:
        raise ValueError(
            f"client {client}: called again before stepSimulation; call it once for each step, or `step` instead (a "
            "stepSimulation kept in a variable before the first call is PyBullet's own, and does not count)"
        )
    if p.stepSimulation is not _STEP:
        for module in list(sys.modules.values()):
            names = getattr(module, "__dict__", {})
            if names.get("stepSimulation") is STEP_BULLET:
                names["stepSimulation"] = _STEP
    steps[client] = callback
