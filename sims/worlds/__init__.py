"""Worlds that a scene is built in, the same calls for both engines: `new_world(settings)`."""

from sims.worlds.world import World, new_world

__all__ = ["World", "new_world"]
