"""Implicit steps of crowds: heaps of stiff balls that vibrate take them, and gain no energy."""

from types import SimpleNamespace

from sims import heap
from sims.scene import NONE, Settings


def test_a_heap_of_glass_takes_implicit_steps_while_it_vibrates() -> None:
    made = {"material": "glass", "radius": 1e-3, "restitution": 0.9}
    world = heap.poured(Settings(NONE, timestep=2e-3), 64, o=SimpleNamespace(**(vars(heap.DEFAULT) | made)))
    world.start()
    first = last = world.world.energy.total
    for _ in range(150):
        world.step(1)
        assert world.world.energy.total < last + 1e-6 * first
        last = world.world.energy.total
    assert int(world.world.arrays.world["implicit"][0]) > 10
