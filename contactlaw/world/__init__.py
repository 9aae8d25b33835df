"""Bodies move, contacts push: a world of rigid bodies, complete without an engine.

    drift both bodies, look where they are, ask the law, kick both, equal and opposite, at one point

Read in this order: `records` (what there is), `motion` (how a body moves, and what a kick does), `geometry`, `law`,
`touch` (a contact from its touch to its parting), `island`, `window`, `step` (the sequence), `world`.
"""

from contactlaw.world.world import World

__all__ = ["World"]
