"""Implicit steps of crowds: heaps of stiff balls that vibrate take them, and gain no energy."""

from types import SimpleNamespace

from sims import heap
from sims.scene import NONE, Settings


def test_heaps_of_glass_take_implicit_steps_while_they_vibrate() -> None:
    """Some none, some sixty: when the last ball has landed is a matter of rounding."""
    made, taken = {"material": "glass", "radius": 1e-3, "restitution": 0.9}, 0
    for seed in range(8, 16):
        o = SimpleNamespace(**(vars(heap.DEFAULT) | made))
        world = heap.poured(Settings(NONE, timestep=2e-3), 64, o=o, seed=seed)
        world.start()
        first = last = world.world.energy.total
        for _ in range(150):
            world.step(1)
            assert world.world.energy.total < last + 1e-6 * first
            last = world.world.energy.total
        taken += int(world.world.arrays.world["implicit"][0])
    assert taken > 20
