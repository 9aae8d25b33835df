"""Worlds in which scenes are built, with the same calls for both engines and without one: `new_world(settings)`."""

from sims.worlds.parts import State, Tuning
from sims.worlds.world import World, new_world

__all__ = ["State", "Tuning", "World", "new_world"]
