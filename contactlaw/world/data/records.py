"""What a world holds: bodies, the shapes fixed to them, near pairs of shapes, and contacts that are closed.

All state is in plain arrays of these records: a copy of the arrays is a copy of the world. SI units, world frame
unless said otherwise; the normal of a contact points from B to A, forces are those on A.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlaw.laws.record import CONTACT as TOUCH
from contactlaw.laws.torsion import TORSION
from contactlaw.world.data.demand import TABLE

NEVER = np.inf

# Kinds of shapes, in the order in which two of them are A and B, see `near.meets`
SPHERE, END, CORNER, SEGMENT, EDGE, DISC, SIDE, ELLIPSOID, BOX, CYLINDER, HULL, PLANE, HEIGHT_FIELD, TANGENT = range(14)
FREE_JOINT, BALL, SLIDE, HINGE = 0, 1, 2, 3  # kinds of joints, numbered as in MuJoCo
MET, CLEAR = -3.0, -2.0  # in place of the time when a pair was looked at: known are gap and speed, or a least gap
LATER, NOW, EACH = range(3)  # when contacts are twisted: not in this substep, in it of some, in each
EDITED, RESIZED = 1, 2  # whether a world is another than in its last step
STAYS, ASKED, PASSES = 0, 1, 2  # whether a tree passes by everything
WAITS = 8  # a power of two
FREE, CLOSED, PARTED = 0, 1, 2  # phases of a contact's slot; one that has parted is kept until the next step

VECTOR = ("f8", (3,))
MATRIX = ("f8", (9,))  # row by row


def record(**fields: Any) -> np.dtype:
    """A record with these fields, aligned."""
    columns = [(name, *kind) if isinstance(kind, tuple) else (name, kind) for name, kind in fields.items()]
    return np.dtype(columns, align=True)


BODY = record(
    # motion: of the centre of mass, and of the principal axes of inertia
    position=VECTOR, velocity=VECTOR, spin=VECTOR,
    quaternion=("f8", (4,)),  # scalar first
    axes=MATRIX,  # the quaternion as a matrix: principal axes to world
    momentum=VECTOR,  # angular, about the centre of mass; followed where the body is not isotropic
    # inertia
    inverse_mass="f8", inverse_inertia=VECTOR,  # about the principal axes
    isotropic="i8",  # the three are equal
    oriented="i8",  # its axes matter: not isotropic, or a shape is off its centre
    # what moves it besides contacts, constant over a step
    acceleration=VECTOR, torque=VECTOR,
    # of a tree of joints
    tree="u8",  # address of its `TREE`; zero: it is free
    member="i8",  # its number in the tree
    turning=VECTOR,  # angular acceleration [rad/s^2] in a tree; `acceleration` is that of its motion there
    # within a step
    time="f8",  # [s] since the step began, up to which it has moved
    shift=VECTOR, twist=VECTOR,  # displacement and rotation vector of its last substep
    turn=VECTOR,  # rotation vector that the quaternion does not know yet
    active="i8",  # presses on something
    done="i8",  # has been moved to the end of the step already
    unknown="i8",  # first of its velocities in an implicit step, see `equations`
    waits="i8", waited="i8",  # steps for which no implicit one is tried with it, below WAITS: still, and in all
    still="i8",  # nothing moves it within this step
    asleep="i8", held=VECTOR,  # acceleration when it fell asleep; of a tree's first body see `trees.mobility.held_by`
    changed="i8",  # its velocity is no longer what was foreseen
    touched="i8",  # a contact has kicked it
    placed="i8",  # somebody has put it where it is since the last step
    pressed="i8",  # it touches something, see `step.find_pressed`; for who reads it between two steps
    delta_v="f8",  # [m/s] by which impacts may change the velocity of its surface within a window
    way="f8",  # [m] that its surface has gone in the substeps of a window, at most
    stride="f8",  # [m] that it may go in the next one
    island="i8", head="i8", link="i8",  # parent in the forest of islands; first pair of an island, next body of it
    # broad phase
    mark=VECTOR, turned="f8",  # position, and angle turned since, of the last list of near pairs
    margin="f8",  # [m] by which its surface may travel before the list must be made anew
    reach="f8",  # [m] distance of its furthest centre or core of its shapes from the centre of mass
    size="f8",  # [m] radius of its smallest round shape
)  # fmt: skip
"""A rigid body. The first one is the world itself, which does not move."""

TREE = record(
    # addresses of what moves it, see `trees.mobility` and `trees.motion`
    fly="u8", drift="u8", settle="u8", kick="u8", mobility="u8", spread="u8", press="u8", rest="u8",
    stand="u8", weigh="u8", resist="u8", carry="u8",  # the same, of an implicit step, see `trees.implicit`
    move="u8",  # q <- q moved by x; its bodies, links and axes there
    accelerate="u8",  # M(q) and its factor; a at q and v
    # its bodies: a run of rows
    bodies="u8", first="i8", count="i8",
    q_size="i8", v_size="i8", joint_count="i8",
    # what it hangs on, which stands still in a step
    base=VECTOR, base_turn=("f8", (4,)),  # place [m] and quaternion
    hangs_on="i8",  # which body that is
    gravity=VECTOR,
    # addresses of its numbers
    q="u8", v="u8", a="u8",  # generalised coordinates, velocities, accelerations
    f="u8", d="u8", v_f="u8",  # force on them: f - D (v - v_f), all three constant over a step; D as `factor`
    e="u8",  # inertia by which constraints hold them besides, constant over a step; as `factor`
    x="u8",  # (v_size,), what a function is given, and what it returns
    due="u8", kicked="i8",  # (v_size,), impulses on them since then; whether there are any
    push="u8",  # (v_size,), what these change v by
    factor="u8",  # (v_size, v_size), see `trees.dynamics`
    room="u8",  # q_size + 3 v_size
    start="u8",  # q_size + v_size, coordinates and velocities that an implicit step began with
    links="u8", joints="u8", axes="u8",  # records
    numbers="i8",  # where they begin in `Arrays.joints`
    # in an implicit step: first of its velocities; where its masses go; length [s] of a stage
    unknown="i8", weights="u8", stride="i8", stage="f8",
    # within a step
    origin=VECTOR,  # point of the world [m] that its velocities and moments are reckoned at
    hold="i8",  # substeps for which its mass matrix and accelerations still hold
    held="f8",  # [s] length of these substeps
    stale="i8",  # they do not belong to q and v
    rate="f8",  # [1/s] at which its bodies turn, at most
    fold="f8",  # [1/s] the same and over the bodies before: at which its motion changes
    pull="f8", effort="f8",  # [m/s^2] the greatest acceleration of its bodies; over the root of its mobility
    decay="f8",  # [1/s] at which damping may slow a velocity, at most
    lag="f8", span="f8",  # [s] that damping comes behind its velocity, see `trees.motion`; length of the step
    midway="i8",  # the velocities that this is behind of are those that a group of substeps began with, in `room`
    passes="i8",  # whether an engine has taken it to the end of the step already, past everything, see `passing`
    disturbed="i8",  # it sleeps, and its coordinates, velocities or forces are not those that it fell asleep with
)  # fmt: skip
"""Bodies that joints hold together, a tree with generalised coordinates."""

LINK = record(
    parent="i8",  # member of the tree before it; -1: what the tree hangs on
    first_joint="i8", joints="i8", first_axis="i8", axes="i8",
    position=VECTOR, quaternion=("f8", (4,)),  # of its frame, in its parent's, before its joints
    centre=VECTOR, frame=("f8", (4,)),  # centre of mass and principal axes, in its frame
    mass="f8", inertia=VECTOR,
    place=VECTOR, turn=("f8", (4,)),  # its frame in the world
    velocity=VECTOR,  # of its material at the tree's origin
    rate="f8",  # [1/s] at which it or one of those that carry it turns, at most
    gain=VECTOR, turning=VECTOR,  # acceleration of that, and of its spin, where a = 0
    answer=VECTOR, answer_turning=VECTOR,  # the same by a
    force=VECTOR, moment=VECTOR,  # about the origin: it and all behind it need them where a = 0
    total="f8", offset=VECTOR, tensor=("f8", (6,)),  # it and all behind it: mass, mass times place, inertia xx to yz
)  # fmt: skip
"""How a body of a tree hangs on the one before it; a body of the world as row, its `BODY`, is the rest of it."""

JOINT = record(
    kind="i8", first_q="i8", first_axis="i8",
    at=VECTOR, axis=VECTOR,  # in the link's frame
    reference="f8",  # coordinate of a hinge or slide at which it does nothing
)  # fmt: skip
"""A joint of a link; several of one link act in sequence, the first is next to the parent."""

AXIS = record(
    before="i8", depth="i8",  # the axis that carries it, -1: none; how many do
    begins="i8",  # not of one joint that turns with the axis before it
    armature="f8",  # [kg] or [kg m^2], inertia of the joint itself
    inverse="f8",  # of the pivot in the factor
    spin=VECTOR, velocity=VECTOR,  # by a unit velocity: spin, and velocity at the tree's origin, of all that it carries
    # a soft limit of it that is reached, see `trees.dynamics.limit_force`
    side="f8",  # 1: a least coordinate, -1: a greatest one, 0: none is reached
    coordinate="i8", edge="f8",  # which coordinate, and where; both along `side`
    hold="f8", stiffness="f8", resistance="f8",  # force at the edge at rest; how it falls with place and velocity
    weight="f8",  # [kg] or [kg m^2]; and with acceleration, by other forces
)  # fmt: skip
"""A degree of freedom of a tree."""

SHAPE = record(
    kind="i8", body="i8",
    group="i8",  # row and column in the table that says which pair of materials two shapes make
    radius="f8",  # of a sphere, or around a segment or a disc; of the edges of a box, cylinder or hull; of a tangent
    # plane how far from the centre of mass it may come
    at=VECTOR,  # centre, or point of a plane, along the body's principal axes
    normal=VECTOR,  # of a plane, outward, along the same; of a disc its axis
    half=VECTOR,  # of a segment: from its middle to an end, along the same; of a box, cylinder or ellipsoid: half its
    # lengths; of a disc: from its middle to a point of its border; of a hull: as long as it reaches
    axes=MATRIX,  # of a box, cylinder or ellipsoid: its own axes to the principal ones, the third along a cylinder
    partner="i8",  # of a tangent plane: the only shape that it meets
    next="i8",  # part of a box, cylinder or hull, or of the one that it is itself a part of; 0: there is none
    deepest="u8",  # address of what finds the deepest point of a disc
    first="i8",  # of a hull: what `Arrays.points` says of its core, along the principal axes from `at`
    points="u8",  # address of that
    # addresses of what finds where a hull or an ellipsoid meets others, and the radius there, of a cylinder too; and
    # where a hull is nearest to a point
    meet="u8", curve="u8", nearest="u8",
    parting="u8",  # address of what parts a box, cylinder or hull from a plane or another one, see `convex`
    long="u8",  # address of the table of `long`, of all but spheres and planes
)  # fmt: skip
"""A shape fixed to a body.

SPHERE: meets all but the ends of capsules. END: a sphere too, one end of a capsule; it meets boxes and planes alone.
SEGMENT: the middle line of a capsule, which meets round shapes, and the edges of boxes and hulls, with its side. BOX,
CYLINDER, HULL, a polyhedron that a ball sweeps, and PLANE, a half space, meet round shapes. ELLIPSOID: meets all but
parts. What is flat meets what is flat by parts of it that are round, see `shapes.parts_of`: CORNER, a
small sphere; EDGE, a segment; DISC, the rim of a cylinder; SIDE, a disc that is long, which meets cylinders alone.
HEIGHT_FIELD: a PLANE at its top to what is told apart by whole shapes; it meets what a plane meets, see `height_field`.
TANGENT: a plane that is placed anew before each step, where an engine has found two shapes nearest; its pair is always
looked at.
"""

LEDGER = 6

PAIR = record(
    radius="f8",  # effective radius of every such contact [m]; zero: that of the shapes
    numbers="i8",  # where its `laws.record.PAIR` begins, and the law's own numbers behind it
    relaxed="i8",  # contacts that are found in each other count as just touching, see `touch.close`
    # of its contacts that have parted: how many touches, greatest overlap [m], strongest normal force [N], time in
    # contact [s], work of the normal force and of friction on the bodies [J]
    ledger=("f8", (LEDGER,)),
)  # fmt: skip
"""Two materials in contact."""

NEAR = record(
    a="i8", b="i8", body_a="i8", body_b="i8", pair="i8",
    slot="i8",  # of the contact, if it is closed or has been in this step; else -1
    closed="i8",
    active="i8",  # taken into an island in this window
    link="i8",  # next pair of the island
    toi="f8",  # time [s] before which it cannot close by the motion that there is
    room="f8",  # [m] that the ways of both bodies come to in all before it can close, in a run of substeps
    seen="f8",  # time [s] when it was last looked at
    gap="f8", closing="f8", acceleration="f8",  # [m], [m/s] and [m/s^2] towards closing, then, at most
    built="f8",  # [m] of overlap that counts as none, that of its contact
    fastest="f8",  # [m/s] at which any points of both come nearer as a step begins, see `passing`
    guard="i8",  # between its bodies, of what is not looked at as fast as balls are; else -1
    listed="f8",  # gap [m] when it was listed, at least, if it has one
)  # fmt: skip
"""Two shapes that may come to touch; A is round."""

GUARD = record(
    a="i8", b="i8", body_a="i8", body_b="i8",  # shapes; bodies, maybe the other way round
    without="i8",  # none of their parts is listed
    place=VECTOR, turn=MATRIX,  # of A in B's frame, centre and principal axes (as columns), at the last look
    limit="f8",  # [m] that A may move there before the list must be made anew
    moved="f8", speed="f8",  # [m] that it has, and [m/s] that it does within the step, at most
    pace="f8",  # [m/s] at which A moves there now, at most
    stride="f8",  # [m] that it did between the last two looks, at most
    normal=VECTOR, apart="f8",  # in the frame of b's body, of a plane between both shapes; [m] that it parts them
    clear="i8",  # they have been so through a step, see `passing`
    planed="f8", low="f8", high="f8",  # [s] of the step when it was placed; of a lowest, of b highest along it [m]
    paced="f8",  # [s] of the step, of that plane, when `speed` was found for what was left of it
    time="f8", lag="f8",  # [s] of the step when it was seen so; [m] that one body may have been behind the other then
)  # fmt: skip
"""Between two shapes, see `guards`."""

CONTACT = record(
    touch=TOUCH,  # what its law knows of it
    torsion=TORSION,  # its moment is that on B along the normal
    bend=("f8", (2,)), bending=("f8", (2,)),  # moments on B about both tangents [N m]: of rolling's spring, and in all
    phase="i8", near="i8", link="i8",
    shape_a="i8", shape_b="i8", body_a="i8", body_b="i8", pair="i8",
    moved=VECTOR,  # of A over B along both tangents [m], and about the normal [rad], in the last substep
    rolled=VECTOR,  # by A over B in it, about both tangents [rad]; what the limit leaves of the spring's moment
    turned="f8", waits="f8",  # [rad] by A over B since it was last twisted; its overlap then [m], zero: nothing waits
    missed=VECTOR, kept="f8",  # `moved` that its law has not been told of; its overlap before [m], zero: it knows all
    interval="f8",  # [s] of the last substep
    built="f8",  # [m] of overlap that counts as none, as its shapes were found in each other, see `touch.close`
    closing_acceleration="f8",  # closing acceleration over it [m/s^2]
    end_weight="f8",  # of a substep, by which its force counts besides: the ends of an impact
    normal=VECTOR, tangent=VECTOR, arm_a=VECTOR, arm_b=VECTOR,
    force=VECTOR,  # force on A [N]
    # ledger, since the touch
    impulse=VECTOR, earlier=VECTOR,  # on A [N s]; what it was when the step began
    normal_work="f8", friction_work="f8",  # done on the bodies [J]: what is lost has a minus
    deepest="f8", strongest="f8", duration="f8",  # [m], [N], [s]
    touches="i8",
)  # fmt: skip
"""A contact; what its law knows of it comes first."""

ROW = record(
    near="i8", slot="i8",  # of its pair; of its contact, -1: open so far
    fresh="i8",  # it has come to be a contact in this step
    slide=VECTOR,  # of A over B at the end of a stage, see `force.advance_contact`
    closing="f8",  # speed [m/s]
    impulse=VECTOR,  # [N s] on A by the stages that are found
    # of one that coasts, where `slide` is what its law misses: see `coasting`
    body_a="u8", body_b="u8",  # addresses of its bodies
    normal=VECTOR, tangent=VECTOR, side=VECTOR, arm_a=VECTOR, arm_b=VECTOR,
    overlap="f8", least="f8", most="f8",  # [m], now, and the range of it
    stiffness="f8", damping="f8", share="f8",  # k of Hertz; of the closing speed [N s/m]; over 1 + damping h/(2 m)
    spring="f8", drag="f8", friction="f8",  # across: [N/m], [N s/m], coefficient
    force="f8", f="f8", g="f8", held_f="f8", held_g="f8", moment="f8",  # [N], of the spring, [N m]
    turned="f8", time="f8",  # by both bodies about the normal in the mean [rad]; since it set out [s]
    normal_work="f8", friction_work="f8",  # [J]
)  # fmt: skip
"""A contact in an implicit step, see `implicit.step`, or one that coasts."""

WORLD = record(
    # addresses of the arrays, see `Arrays`, and how many of each there are
    bodies="u8", shapes="u8", pairs="u8", near="u8", contacts="u8", memory="u8", numbers="u8", groups="u8", spare="u8",
    points="u8", guards="u8",
    near_bodies="u8", roots="u8", island_bodies="u8", island_pairs="u8", grid="u8", aside="u8", trees="u8", joints="u8",
    rows="u8", contacts_aside="u8", memory_aside="u8", equations="u8",
    body_count="i8", shape_count="i8", pair_count="i8", near_room="i8", contact_room="i8", memory_size="i8",
    group_count="i8", guard_room="i8",
    cells="i8",  # of the grid's table, a power of two
    step="f8",  # length of the step [s]
    substeps="f8",  # of an impact between few bodies
    crowd_substeps="f8", crowd="i8",  # of an impact in an island of more closed contacts than this
    stillness="f8",  # of its overlap, that a contact may move in an impact's time and sleep; 0: none sleeps
    nears="i8", guard_count="i8", spares="i8", islands="i8",  # how many of each there are
    near_body_count="i8",  # in `near_bodies`
    slots="i8",  # of contacts that have ever been in use: the first so many
    rested="i8",  # in the last step nobody moved
    stale="i8",  # a body has travelled further than the list of near pairs holds
    edited="i8",  # somebody has changed bodies or shapes since the last step; RESIZED: what these grew by is no motion
    unknowns="i8", unknown_room="i8",  # of the island that takes an implicit step; what there is room for
    implicit="i8", solved="i8",  # implicit steps of islands, and systems of equations solved for them, for good
    kicks="i8", lists="i8",  # counted for good
    late="i8", latest="f8",  # contacts that were found closed already, and the deepest [m]
    twists="i8",  # in this substep, LATER, NOW or EACH
    lost="i8",  # contacts and pairs that there was no room for
    demand="u8",  # address of `demand.TABLE`
)  # fmt: skip
"""A world as a whole: what compiled code is given."""

Array = NDArray[Any]


def numbers_of(tree: Any) -> dict[str, int]:
    """How many numbers a tree keeps, by their names in its record, in their order."""
    q, v = int(tree["q_size"]), int(tree["v_size"])
    rows = {"links": (LINK, tree["count"]), "joints": (JOINT, tree["joint_count"]), "axes": (AXIS, v)}
    one = dict.fromkeys(("v", "a", "f", "v_f", "x", "due", "push"), v)
    own = {name: int(count) * kind.itemsize // 8 for name, (kind, count) in rows.items()}
    sizes = {"d": v * v, "e": v * v, "factor": v * v, "room": q + 3 * v, "start": q + v}
    return {"q": q} | one | sizes | own


class Arrays(NamedTuple):
    """A world, array by array.

    Attributes:
        bodies, shapes, pairs, near, contacts: Records. The list of near pairs and the contacts are room, of which
            `world` says how much is used.
        memory: What the laws remember of each contact, shape (contacts, size).
        numbers: Of all pairs: what a law reads (`ContactPair.parameters`).
        points: Of the cores of hulls: their vertices [m] by direction, see `hulls.by_direction`, shape (n, 3).
        groups: Index of the pair that shapes of two groups make, or -1.
        spare: Contacts that are free, the next one last.
        guards: Records, room as well.
        near_bodies: Numbers of the bodies that are near something, or of a tree, in their order.
        roots: Room for the islands of a window.
        island_bodies, island_pairs: Room for what is in one.
        grid: Room for the broad phase.
        aside: Room for two bodies as they will be; behind them for all as they were when the step began.
        trees: Records.
        joints: Of all trees: coordinates, velocities, and what follows from them.
        rows: Room for the contacts of an island that lasts.
        contacts_aside, memory_aside: Room for contacts, and what their laws remember, as the step began.
        equations: Room for an implicit step.
        world: One record.
    """

    bodies: Array
    shapes: Array
    pairs: Array
    near: Array
    contacts: Array
    memory: Array
    numbers: Array
    points: Array
    groups: Array
    spare: Array
    guards: Array
    near_bodies: Array
    roots: Array
    island_bodies: Array
    island_pairs: Array
    grid: Array
    aside: Array
    trees: Array
    joints: Array
    rows: Array
    contacts_aside: Array
    memory_aside: Array
    equations: Array
    world: Array

    def bound(self) -> Arrays:
        """Write the addresses and sizes of the arrays into the record; returns itself."""
        one = self.world
        for name, array in zip(self._fields[:-1], self[:-1], strict=True):
            one[name] = array.ctypes.data
        one["body_count"], one["shape_count"], one["pair_count"] = self.bodies.size, self.shapes.size, self.pairs.size
        one["guard_room"] = self.guards.size
        one["near_room"], one["contact_room"] = self.near.size, self.contacts.size
        one["memory_size"], one["group_count"] = self.memory.shape[1], self.groups.shape[0]
        one["unknown_room"] = self.equations.shape[1]
        one["cells"] = self.grid.size - 4 * self.shapes.size
        self.shapes["points"] = self.points.ctypes.data + 24 * self.shapes["first"]
        one["demand"] = TABLE.ctypes.data
        for number, tree in enumerate(self.trees):
            first, count = int(tree["first"]), int(tree["count"])
            tree["bodies"] = self.bodies[first:].ctypes.data
            self.bodies["tree"][first : first + count] = self.trees[number:].ctypes.data
            place = self.joints.ctypes.data + 8 * int(tree["numbers"])
            for name, size in numbers_of(tree).items():
                if size > 0:
                    tree[name] = place
                place += 8 * size
        return self
