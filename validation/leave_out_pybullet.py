"""PyBullet's worlds for scenes with an ingredient left out."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from contactlaw import ContactPair
from contactlaw.pybullet_callback import ContactCallback
from sims.scene import Scene, Settings
from sims.worlds import pybullet_world
from validation.leave_out_scenes import Trims


class TrimmedWorld(Trims, pybullet_world.EngineWorld):
    """PyBullet's world, with what the build says."""

    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair, plane: Any) -> None:
        build = self.build
        if self._law is None:
            self._law = ContactCallback(
                self.client, fixed_bodies_move=build.fixed_bodies_move, left_alone=build.left_alone
            )
        first, second = ([self.ids[name] for name in names] for names in (ones, twos))
        self._law.add_contact(first, second, pair, plane=plane, substeps=build.substeps, ledger=build.ledger)
        self._by_law |= {*ones, *twos}


def said_by(scene: Scene) -> dict[str, Any]:
    """What the world as shipped tells the callback, by the names of `Build`; what it does not say is the default."""
    seen: dict[str, Any] = {"fixed_bodies_move": True, "left_alone": False, "ledger": False, "substeps": 100}
    names = set(seen)

    class Listening(ContactCallback):
        """The callback, which also writes down what it is told."""

        def __init__(self, client: int = 0, **told: Any) -> None:
            super().__init__(client, **told)
            seen.update({name: value for name, value in told.items() if name in names})

        def add_contact(self, *args: Any, **told: Any) -> int:
            """As the callback's."""
            seen.update({name: value for name, value in told.items() if name in names})
            return super().add_contact(*args, **told)

    with patch.object(pybullet_world, "ContactCallback", Listening):
        scene.run(Settings("pybullet"))
    return seen
