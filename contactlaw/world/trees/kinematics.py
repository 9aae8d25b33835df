"""Poses and velocities of the bodies of a tree, from its coordinates.

Coordinates and velocities are those of `description.Tree`, as MuJoCo's. A free joint is three slides and a ball joint.

A degree of freedom k moves all that it carries by a spin e_k and a velocity s_k of the material at the tree's origin O;
for a hinge through p, s = (p - O) x e. All velocities are sums of these along the tree (Featherstone, Rigid Body
Dynamics Algorithms, 2008, chapters 2 and 3).
"""

from math import cos, sin

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_module, jit_of_sums
from contactlaw.memory import doubles_at
from contactlaw.world.bodies.motion import set_axes
from contactlaw.world.data.access import axis_at, body_at, joint_at, link_at
from contactlaw.world.data.quaternion import conjugate, load4, product, rotation, rotation_vector, store4, turn_by, unit
from contactlaw.world.data.tree import BALL, SLIDE
from contactlaw.world.data.vec import ZERO, add, axpy, cross, load, store, sub


def vector(address, size):
    """Return the numbers at an address as an array; size: its length or shape."""
    return carray(doubles_at(address), size)


def entries(start, end):
    """Return the range of these indices, unsigned: a loop over entries of arrays then need not look at their sign."""
    return range(types.uint64(start), types.uint64(end))


@jit_of_sums
def add_multiple(row, factor, other, start, end):
    """Add a multiple of a part of another row to a row."""
    for j in entries(start, end):
        row[j] += factor * other[j]


def is_pressed(t):
    """Return whether a contact presses a body of a tree."""
    pressed = False
    for i in range(t.count):
        pressed = pressed or body_at(t.bodies, i).pressed != 0
    return pressed


def add_to_coordinates(t):
    """Move the coordinates by x, in the sense of velocities; poses stay behind."""
    q, x = vector(t.q, t.q_size), vector(t.x, t.v_size)
    for i in range(t.joint_count):
        joint = joint_at(t.joints, i)
        k, m = joint.first_q, joint.first_axis
        if joint.kind >= SLIDE:
            q[k] += x[m]
            continue
        store4(q[k:], unit(product(load4(q[k:]), rotation(load(x[m:])))))


def displace(t, x):
    """Write the displacement of the coordinates since the start of the step into x, in the sense of velocities."""
    q, start = vector(t.q, t.q_size), vector(t.start, t.q_size)
    for i in range(t.joint_count):
        joint = joint_at(t.joints, i)
        k, m = joint.first_q, joint.first_axis
        if joint.kind >= SLIDE:
            x[m] = q[k] - start[k]
            continue
        store(x[m:], rotation_vector(product(conjugate(load4(start[k:])), load4(q[k:]))))


def move(t):
    """Move the coordinates by x, in the sense of velocities; sets poses of bodies and links, and the axes."""
    add_to_coordinates(t)
    q, turned = vector(t.q, t.q_size), False
    for i in range(t.count):
        link = link_at(t.links, i)
        if link.parent >= 0:
            parent = link_at(t.links, link.parent)
            place, turn = load(parent.place), load4(parent.turn)
        else:
            place, turn = load(t.base), load4(t.base_turn)
        place = add(place, turn_by(turn, load(link.position)))
        turn = product(turn, load4(link.quaternion))
        for j in range(link.first_joint, link.first_joint + link.joints):
            joint = joint_at(t.joints, j)
            if not turned:  # slides do not depend on the origin, which moves with them
                store(t.origin, place)
                turned = joint.kind != SLIDE
            place, turn = apply_joint(t, joint, place, turn, q)
        store(link.place, place)
        store4(link.turn, turn)
        b = body_at(t.bodies, i)
        store(b.position, add(place, turn_by(turn, load(link.centre))))
        store4(b.quaternion, product(turn, load4(link.frame)))
        set_axes(b)


def apply_joint(t, joint, place, turn, q):
    """Return position and quaternion of a link's frame after one of its joints, and set the joint's axes."""
    k, m, at = joint.first_q, joint.first_axis, load(joint.at)
    if joint.kind >= SLIDE:  # a slide or a hinge
        angle, axis = q[k] - joint.reference, turn_by(turn, load(joint.axis))
        if joint.kind == SLIDE:
            set_axis(t, m, ZERO, axis)
            return axpy(angle, axis, place), turn
        anchor = add(place, turn_by(turn, at)) if at != ZERO else place
        set_axis(t, m, axis, cross(sub(anchor, load(t.origin)), axis))
        s = sin(0.5 * angle)
        own = joint.axis
        turn = product(turn, (cos(0.5 * angle), s * own[0], s * own[1], s * own[2]))
        return sub(anchor, turn_by(turn, at)) if at != ZERO else place, turn
    anchor = add(place, turn_by(turn, at))
    turn = product(turn, (q[k], q[k + 1], q[k + 2], q[k + 3]))
    arm = sub(anchor, load(t.origin))
    for i in range(3):
        one = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
        axis = turn_by(turn, one)
        set_axis(t, m + i, axis, cross(arm, axis))
    return sub(anchor, turn_by(turn, at)), turn


def is_free(t, link):
    """Return whether the joints of a link of a tree let it move freely."""
    return link.joints == 4 and joint_at(t.joints, link.first_joint + 3).kind == BALL


def set_axis(t, k, spin, velocity):
    """Set the spin and velocity by a unit velocity of a degree of freedom."""
    axis = axis_at(t.axes, k)
    store(axis.spin, spin)
    store(axis.velocity, velocity)


def response_of(t, i, a):
    """Return spin and velocity at the origin of a link by velocities a; keeps them for the links it carries.

    By accelerations a: its accelerations besides those at a = 0.
    """
    link = link_at(t.links, i)
    turning, gain = ZERO, ZERO
    if link.parent >= 0:
        parent = link_at(t.links, link.parent)
        turning, gain = load(parent.response_turning), load(parent.response)
    for k in range(link.first_axis, link.first_axis + link.axes):
        axis = axis_at(t.axes, k)
        turning = axpy(a[k], load(axis.spin), turning)
        gain = axpy(a[k], load(axis.velocity), gain)
    store(link.response_turning, turning)
    store(link.response, gain)
    return turning, gain


def spread_velocity(t):
    """Set the velocities and spins of all bodies from v."""
    v, origin = vector(t.v, t.v_size), load(t.origin)
    for i in range(t.count):
        b = body_at(t.bodies, i)
        spin, velocity = response_of(t, i, v)
        store(link_at(t.links, i).velocity, velocity)
        store(b.spin, spin)
        store(b.velocity, add(velocity, cross(spin, sub(load(b.position), origin))))


jit_module(__name__)
