"""While nothing is closed no substep goes so far that what parts slowly has fallen back into what it left."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.jit import jit
from contactlaw.memory import set_whole
from contactlaw.world import World
from contactlaw.world.bodies.motion import fly
from contactlaw.world.data.access import body_at, near_at
from contactlaw.world.island import substep_length
from contactlaw.world.near.listing import list_near
from contactlaw.world.near.time_of_impact import predict
from contactlaw.world.shapes.geometry import meet_near
from contactlaw.world.step import begin
from tests.world.world_scenes import steel_pair

STEP, RADIUS, HALF, GAP = 0.01, 0.025, 0.044, 5e-10


@jit
def fly_a_substep(world, gaps):
    """Fly by the first substep that all near pairs would have together; their gaps at its end."""
    w = world[0]
    w.step = STEP
    begin(w)
    list_near(w)
    for k in range(w.nears):
        p = near_at(w.near, k)
        set_whole(w.island_pairs, k, k)
        predict(w, p, 0.0)
        p.path_limit = 0.0
    until = substep_length(w, w.nears, 0, 0.0)
    for i in range(w.body_count):
        fly(body_at(w.bodies, i), until)
    for k in range(w.nears):
        p = near_at(w.near, k)
        overlap, _, _, _ = meet_near(w, p, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))
        gaps[k] = -overlap
    return w.nears


@pytest.mark.parametrize("opening", [1e-5, 3e-4, 5e-3])
@pytest.mark.parametrize("spin", [0.0, 3.5, 30.0])
def test_what_parts_slowly_does_not_fall_back_within_a_substep(opening: float, spin: float) -> None:
    """A lying capsule's ends have just parted from a box; a substep in which they touch is as short as an impact's."""
    world = World(gravity=0.0, timestep=STEP)
    place, velocity = (0.0, 0.0, RADIUS + GAP), (-0.2, -0.1, opening)
    body = world.add_body(1.86, (5.5e-4, 2.6e-3, 2.6e-3), place, velocity, spin=(1.0, 0.0, spin))
    ends = [world.add_sphere(body, RADIUS, (x, 0.0, 0.0)) for x in (-HALF, HALF)]
    world.add_contact(ends, [world.add_box(None, (1.0, 1.0, 0.1), (0.0, 0.0, -0.1))], steel_pair())
    world.arrays.bodies["acceleration"][1:, 2] = -9.81
    gaps = np.full(64, np.nan)
    count = fly_a_substep(world.arrays.bound().world, gaps)
    assert count == len(ends)
    assert gaps[:count].min() > -1e-9
