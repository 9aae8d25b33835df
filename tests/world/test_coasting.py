"""Contacts that coast: from when on they may."""

from contactlaw.jit import jit
from contactlaw.world.contacts.coasting import has_model
from contactlaw.world.data.access import near_at
from sims.heap import poured
from sims.scene import NONE, Settings


@jit
def able_to_coast(world):
    """How many closed contacts may coast."""
    w, count = world[0], 0
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.closed != 0 and has_model(w, p):
            count += 1
    return count


def test_a_contact_coasts_only_from_what_its_law_knows() -> None:
    """What it moved while it coasted before is first given to its law: a start in between would lose that."""
    heap = poured(Settings(NONE, timestep=2e-3), 64)
    heap.start()
    heap.step(100)
    arrays = heap.world.arrays
    world = arrays.bound().world
    assert able_to_coast(world) > 50
    arrays.contacts["coasted_from"] = 1e-9
    assert able_to_coast(world) == 0
