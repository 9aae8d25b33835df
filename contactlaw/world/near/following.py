"""Free bodies that no contact has touched in a step: they end it where the engine's own step has put them, if they can.

A free body that no contact has touched has flown exactly. Engines turn a body once a step, and leave one that turns by
0.6 rad some 1e-3 of its size beside that. If it is inside another body there, the next step would give it the energy of
an overlap that no motion has made. Such a body ends the step where its exact flight takes it.
"""

from contactlaw.jit import jit_module
from contactlaw.world.bodies.motion import set_axes
from contactlaw.world.data.access import body_at, near_at
from contactlaw.world.data.quaternion import store4
from contactlaw.world.data.saved import restore_body, save_body
from contactlaw.world.data.vec import store
from contactlaw.world.shapes.geometry import meet_near

FOLLOWS = 2  # value of `BODY.done`: where the engine has the body


def may_follow(b):
    """Return whether a body is free and awake, and nothing has touched it in this step."""
    return b.tree == 0 and b.inverse_mass != 0.0 and b.touched == 0 and b.asleep == 0 and b.done == 0


def follow(w, i, position, turn):
    """Put body i where the engine's step has taken it: position [m] of its centre of mass, quaternion of its axes."""
    save_body(w, i)
    b = body_at(w.bodies, i)
    store(b.position, position)
    store4(b.quaternion, turn)
    set_axes(b)
    b.done = FOLLOWS


def part(w):
    """Put bodies that `follow` has put into others back to where they fly in the world, and mark them as touched."""
    found = True
    while found:
        found = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if (a.done == FOLLOWS or b.done == FOLLOWS) and meet_near(w, p, a, b)[0] > 0.0:
                found = True
                put_back(w, p.body_a)
                put_back(w, p.body_b)


def put_back(w, i):
    """Put body i back if it follows the engine."""
    if body_at(w.bodies, i).done == FOLLOWS:
        restore_body(w, i)
        body_at(w.bodies, i).touched = 1


def overlaps(w, first, count):
    """Return whether any of `count` bodies from a number on overlaps what it is near."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        own = first <= p.body_a < first + count or first <= p.body_b < first + count
        if own and meet_near(w, p, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))[0] > 0.0:
            return True
    return False


jit_module(__name__)
