"""MuJoCo's worlds for scenes with an ingredient left out."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from contactlaw import ContactPair, mujoco_plugin
from sims.scene import Scene, Settings
from sims.worlds.mujoco_world import EngineWorld
from validation.leave_out_scenes import Trims


class TrimmedWorld(Trims, EngineWorld):
    """MuJoCo's world, with what the build says."""

    def _touch_by_law(self, ones: list[str], twos: list[str], pair: ContactPair) -> None:
        build = self.build
        mujoco_plugin.add_contact(
            self.spec, ones, twos, pair, others=build.others, substeps=build.substeps, ledger=build.ledger
        )


def said_by(scene: Scene) -> dict[str, Any]:
    """What the world as shipped tells `add_contact`, by the names of `Build`; what it does not say is the default."""
    out: dict[str, Any] = {"others": True, "ledger": False, "substeps": 100}
    with patch.object(mujoco_plugin, "add_contact", wraps=mujoco_plugin.add_contact) as add:
        scene.run(Settings("mujoco"))
    return {name: add.call_args.kwargs.get(name, value) for name, value in out.items()}
