"""Worlds that a scene is built in, the same calls for both engines and without one: `new_world(settings)`."""

from sims.worlds.world import State, Tuning, World, new_world

__all__ = ["State", "Tuning", "World", "new_world"]
