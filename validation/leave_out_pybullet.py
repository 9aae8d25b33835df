"""PyBullet's worlds for scenes with an ingredient left out."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from contactlaw import ContactPair
from contactlaw.pybullet_callback import ContactCallback
from sims.scene import Scene, Settings
from sims.worlds import pybullet_world
from sims.worlds.world import Array
from validation.leave_out_scenes import Trims

p = pybullet_world.p
DYNAMIC, STATIC, ALL = 1, 2, -1  # Bullet's own collision groups of bodies that move and of others, and the mask of all


class TrimmedWorld(Trims, pybullet_world.EngineWorld):
    """PyBullet's world, with what the build says."""

    def _put(self, name: str, mass: float, shape: int, position: Array, rotation: Array) -> int:
        made = super()._put(name, mass, shape, position, rotation)
        if self.build.others:
            group, mask = (DYNAMIC, ALL) if mass else (STATIC, ALL ^ STATIC)
            p.setCollisionFilterGroupMask(made, -1, group, mask, physicsClientId=self.client)
        return made

    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair) -> None:
        build = self.build
        if self._law is None:
            self._law = ContactCallback(
                self.client, fixed_bodies_move=build.fixed_bodies_move, left_alone=build.left_alone
            )
        first, second = ([self.ids[name] for name in names] for names in (ones, twos))
        self._law.add_contact(first, second, pair, substeps=build.substeps, ledger=build.ledger)
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

    with (
        patch.object(pybullet_world, "ContactCallback", Listening),
        patch.object(p, "createMultiBody", wraps=p.createMultiBody) as make,
        patch.object(p, "setCollisionFilterGroupMask", wraps=p.setCollisionFilterGroupMask) as touches,
    ):
        scene.run(Settings("pybullet"))
    silent = {call.args[0] for call in touches.call_args_list if call.args[1:4] == (-1, 0, 0)}
    return seen | {"others": len(silent) < make.call_count}
