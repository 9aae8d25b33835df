"""The records that hold the state of a world: bodies, shapes, near pairs, contacts; those of trees are in `tree`.

All state is in plain arrays of these records, so that a copy of the arrays is a copy of the world. SI units, world
frame unless said otherwise. The normal of a contact points from B to A; forces and impulses are those on A.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlaw.laws.record import CONTACT as TOUCH
from contactlaw.laws.record import MATRIX, VECTOR, record
from contactlaw.laws.torsion import TORSION
from contactlaw.world.data.demand import TABLE
from contactlaw.world.data.kinds import PARTS
from contactlaw.world.data.tree import TREE, numbers_of

NEVER = np.inf

MEASURED, BOUNDED = -3.0, -2.0  # values of `NEAR.checked` besides times: gap and speed known; a lower bound of the gap
# Values of `WORLD.twists`: in this substep torsion is put off, made up for, or advanced as in every one
TWIST_LATER, TWIST_NOW, TWIST_ALWAYS = range(3)
EDITED, RESIZED, AGED, FRESH, PUT = 1, 2, 1, 2, 2  # values of `WORLD.edited`; of `WORLD.age`; of `BODY.placed`
LATE, UNLISTED, CERTAIN, WIDE = 2, 3, 4, 2  # values of `WORLD.denied`; of `WORLD.brief`
STRIKES = 2  # value of `NEAR.active`
PAUSE_LIMIT = 8  # steps; a power of two
FREE, CLOSED, PARTED = 0, 1, 2  # phases of a contact's slot; that of a parted contact is kept until the next step


BODY = record(
    # what each substep reads and writes comes first, and of that what contacts that coast do
    position=VECTOR, velocity=VECTOR, spin=VECTOR,  # of the centre of mass [m], [m/s], angular velocity [rad/s]
    pending_turn=VECTOR,  # rotation vector [rad] not yet applied to the quaternion
    inverse_mass="f8", inverse_inertia=VECTOR,  # [1/kg], about the principal axes [1/(kg m^2)]; zero: kinematic
    push=VECTOR, twisting=VECTOR,  # accelerations by loads and springs [m/s^2], [rad/s^2], see `contacts.leapfrog`
    pressing="i8", square_rate="f8",  # how many contacts are closed; see `pace.add_square_rate` [1/s^2]
    # 1: the three moments of inertia are equal; 1: its axes matter, as they are not or a shape is off its centre
    isotropic="i8", oriented="i8",
    tree="u8", member="i8",  # address of its `TREE`, zero: a free body; its number in that
    shift=VECTOR, twist=VECTOR,  # displacement [m] and rotation vector [rad] of its last substep
    # loads besides contacts, constant over a step
    acceleration=VECTOR, torque=VECTOR,  # [m/s^2], [N m]
    time="f8",  # [s] since the step began, up to which it has been moved
    still="i8",  # 1: nothing moves it within this step
    touched="i8", placed="i8",  # 1: its step ends as the world has it; the user has moved it (PUT: elsewhere at once)
    path="f8", next_path="f8",  # [m] that its surface has moved in a window's substeps, at most, and may in the next
    way="f8",  # [m] that its surface may move in the step, see `listing.way_ahead`
    reach="f8",  # [m] from its centre of mass to the furthest centre, middle line or core of its shapes
    round=VECTOR,  # unit vector of an axis through that, along its own, about which its shapes are round; zero: none
    # its turn
    quaternion=("f8", (4,)),  # scalar first
    axes=MATRIX,  # the quaternion as a matrix: principal axes of inertia to world
    momentum=VECTOR,  # angular momentum about the centre of mass [N m s]; kept only if not isotropic
    storing=VECTOR, storing_turn=VECTOR,  # what springs add to `push`, `twisting`, times overlaps [m]; no balls
    turning=VECTOR,  # angular acceleration [rad/s^2] in a tree; `acceleration` is that of its centre there
    # within a step
    active="i8",  # 1: it is near something (window), or a closed contact presses on it (sleep, implicit step)
    done="i8",  # 1: its step is over; FOLLOWS: and it is where the engine has it, see `near.passing`
    unknown="i8",  # index of its first velocity among the unknowns of an implicit step; -1: none
    pause="i8", last_pause="i8",  # steps for which no implicit step is tried with it, < PAUSE_LIMIT: left, and in all
    asleep="i8", held=VECTOR,  # acceleration as it fell asleep, see `sleep.load_on`; in a tree see `mobility.stop`
    changed="i8",  # 1: its velocity has changed, so that times of impact predicted with it no longer hold
    pressed="i8",  # 1: it is in contact, as found between two steps for engines' adapters, see `near.passing`
    delta_v="f8",  # [m/s] by which impacts may change the velocity of its surface within a window, at most
    island="i8", head="i8", link="i8",  # parent in the union-find of islands; an island's first pair; its next body
    # broad phase
    listed_position=VECTOR, turned="f8",  # position when near pairs were last listed, and angle [rad] turned since
    margin="f8",  # [m] by which its surface may travel before near pairs must be listed anew
    size="f8",  # [m] radius of its smallest round shape
)  # fmt: skip
"""A rigid body. The first one is the world itself, which does not move."""

SHAPE = record(
    kind="i8", body="i8",
    group="i8",  # row and column in `Arrays.groups`, the table of the pair of materials that two shapes make
    radius="f8",  # [m] of a sphere, a segment or a disc, or of rounded edges; of a tangent plane: its reach
    at=VECTOR,  # [m] centre, or point of a plane, along the body's principal axes
    normal=VECTOR,  # outward normal of a plane, or axis of a disc, along the same axes
    half=VECTOR,  # [m] of a segment: from its middle to an end, of a disc: to a point of its rim, along the same axes;
    # of a box, cylinder or ellipsoid: its half lengths; of a hull: its reach from `at` first
    axes=MATRIX,  # of a box, cylinder or ellipsoid: its own axes to the principal ones; a cylinder's third is its axis
    partner="i8",  # the only shape that a tangent plane meets
    place="i8",  # number of a height field among those of its surface
    next="i8",  # next part of a box, cylinder or hull, or of the shape that it is a part of; 0: none
    first="i8",  # of a hull: row in `Arrays.points` of the table of its core, along the principal axes from `at`
    points="u8",  # address of that table
    # addresses of functions, see `shapes.functions`
    meet="u8", curve="u8", separation="u8", nearest="u8", deepest="u8", beside="u8", predict="u8",
    # coefficient for pairs that have none; 1: none, unless the other shape has; which of two shapes gives it
    friction="f8", frictionless="i8", priority="i8",
)  # fmt: skip
"""A shape fixed to a body, of one of the `kinds`."""

FIELD = record(
    columns="i8", rows="i8",
    away="f8",  # 1/sqrt(1 + L^2) for the greatest slope L: the least distance of a point over its height
    valley="f8", ridge="f8",  # see `field_surface.sharpest`
    spare="f8",  # the heights, which follow, begin with a row of three
)  # fmt: skip
"""Head of the table of a height field in `Arrays.points`."""

LEDGER = 6

PAIR = record(
    radius="f8",  # effective radius [m] of its contacts; zero: that of the shapes
    numbers="i8",  # where its `laws.record.PAIR` begins in `Arrays.numbers`; the law's own numbers follow
    relaxed="i8",  # 1: deep initial overlaps of its contacts count as none, see `touch.begin_contact`
    friction="f8",  # coefficient of its contacts; NaN: that of the shapes, see `materials.friction_of`
    # sums over its contacts that have parted: touches, greatest overlap [m], greatest normal force [N], time in contact
    # [s], work of the normal force and of friction on the bodies [J]
    ledger=("f8", (LEDGER,)),
)  # fmt: skip
"""Two materials in contact."""

NEAR = record(
    # first what is read of each pair in each window, as most are far apart: it fits a line of the processor's cache
    closed="i8", active="i8",  # 1: in contact; 1, STRIKES: taken into an island in this window
    body_a="i8", body_b="i8",
    toi="f8",  # time of impact, a lower bound [s]
    path_limit="f8",  # [m] sum of both bodies' `path` at which it can close, in a run of substeps
    guard="i8",  # the guard between its bodies, if its gap is costly to measure; else -1
    listed_gap="f8",  # [m] lower bound of the gap when the pair was listed, raised by later measurements
    checked="f8",  # time [s] at which its gap was last found; -1: not in this step; or MEASURED, BOUNDED
    gap="f8", closing="f8", acceleration="f8",  # [m], [m/s], [m/s^2]: gap then, closing speed, and acceleration at most
    closing_bound="f8",  # [m/s] greatest closing speed of any points of both at the start of a step, see `near.passing`
    slot="i8",  # of its contact, if that is closed or has been in this step; else -1
    link="i8",  # next of the island
    initial_overlap="f8",  # [m] overlap that counts as none, that of its contact
    a="i8", b="i8", pair="i8",
    first="i8", places="i8",  # of the pairs of A with fields of one surface: the first one's number, and how many
    place=VECTOR, vertices="i8", feature=("f8", (3, 3)),  # where both were nearest last, see `geometry.note`
)  # fmt: skip
"""Two shapes near each other; A is round."""

GUARD = record(
    a="i8", b="i8", body_a="i8", body_b="i8",  # whole shapes; their bodies, possibly interchanged
    place=VECTOR, turn=MATRIX,  # pose of A in B's frame, principal axes as columns, at the last update
    unlisted="i8", limit="f8",  # 1: no parts are listed; [m] that A may move there before near pairs are listed anew
    moved="f8", speed="f8",  # [m] that it has moved since the list, and [m/s] its mean speed in the step, at most
    # its speed there now, and before the last update; [m] that it moved between the last two updates, at most
    speed_now="f8", last_speed_now="f8", last_move="f8",
    normal=VECTOR, separation="f8",  # of a separating plane, in B's frame; [m] by which it separates them
    # [m/s], [rad/s] motion of A there at the start of a step; 1: that plane has separated them throughout it
    slide=VECTOR, twist=VECTOR, separated="i8",
    # times of the step [s] until which two cores stay apart, and at which that was found; gap [m] and closing speed
    apart="f8", found="f8", gap="f8", closing="f8", growth="f8",  # [m/s] then, and its growth [m/s^2], at most
    time="f8", lag="f8",  # [s] of the step at the last update; [m] by which one body may have lagged behind the other
)  # fmt: skip
"""Bounds on how two shapes move relative to each other, see `near.guards`."""

CONTACT = record(
    touch=TOUCH,  # state that its law reads and writes
    torsion=TORSION,  # its moment is that on B about the normal
    # of rolling resistance: its spring's M/R about both axes of the ellipse [N]; moments on B with its dashpot [N m]
    bend=("f8", (2,)), bending=("f8", (2,)),
    phase="i8", near="i8", link="i8",
    shape_a="i8", shape_b="i8", body_a="i8", body_b="i8", pair="i8",
    moved=VECTOR,  # displacement of A over B along both tangents [m], and rotation about the normal [rad], last substep
    rolled=VECTOR,  # rotation of A over B about `axis` and across [rad], last substep; share of its moment kept
    # way of the surfaces through it along both tangents [m], last substep, and ln(a/b) of its half axes along and
    # across that; zero unless it may creep
    passed=VECTOR,
    spring="f8",  # force [N] of its spring where its bodies are
    later="f8",  # [s] of its last kick that work at the speed since then, see `substep.kick_pair`
    # rotation about the normal [rad] not yet given to the torsion; overlap [m] when it began, zero: none is pending
    pending_twist="f8", twist_overlap="f8",
    # displacement, as `moved`, while it coasted, not yet given to its law; overlap [m], zero: none, and friction [N] as
    coasted=VECTOR, coasted_from="f8", coasted_f="f8", coasted_g="f8",  # that began
    interval="f8",  # [s] length of the last substep
    first_substep="f8",  # [s] of a damped impact of two bodies alone, see `pace.longest_substep`; 0: not known
    initial_overlap="f8",  # [m] overlap that counts as none, as found at first contact, see `touch.begin_contact`
    neighbours="f8",  # closing acceleration [m/s^2] by loads and springs of other contacts, see `contacts.leapfrog`
    closing_acceleration="f8",  # mean closing acceleration over it [m/s^2]
    end_weight="f8",  # additional weight of the force at the ends of an impact, in substeps, see `contacts.leapfrog`
    normal=VECTOR, tangent=VECTOR, arm_a=VECTOR, arm_b=VECTOR,
    axis=VECTOR, radii=("f8", (2,)),  # for rolling resistance and creep, see `meeting.update_ellipse`
    force=VECTOR,  # force on A [N]
    credit="f8",  # [J] its share of what implicit steps of its island have lost by their error, see `implicit.step`
    # ledger, since the touch
    impulse=VECTOR, earlier=VECTOR,  # impulse on A [N s]; its value at the start of the step
    normal_work="f8", friction_work="f8",  # work on the bodies [J]; losses are negative
    deepest="f8", strongest="f8", duration="f8",  # greatest overlap [m] and normal force [N], time in contact [s]
    touches="i8",
    noted="i8", appeared="i8",  # bits of `readout.doubts_of` found so far; 1: its initial overlap came by itself
)  # fmt: skip
"""A contact. The state of its law comes first."""

ROW = record(
    near="i8", slot="i8",  # of its pair; of its contact, -1: open so far
    fresh="i8",  # 1: it became a contact in this step
    slide=VECTOR,  # slip velocity of A over B at the end of a stage, see `force.advance_contact`
    closing="f8", overlap="f8",  # speed [m/s] and overlap [m] at the bodies' places
    beyond=VECTOR,  # overlap, and displacement along both tangents [m], beyond those of its forces: `newton.keep_near`
    push=VECTOR, impulse=VECTOR,  # [N s] on A by the stages solved: along their normals, and in all
)  # fmt: skip
"""A contact in an implicit step, see `implicit.step`."""

COASTING = record(
    # what each substep reads and writes comes first
    body_a="u8", body_b="u8", force="f8",  # addresses of its bodies; P [N]
    normal=VECTOR, tangent=VECTOR, side=VECTOR,  # its frame at the start; side: n x e
    radius_a="f8", radius_b="f8",  # lengths of the arms [m]
    start=VECTOR, moved=VECTOR,  # see `coasting.places_of`: at the start; tangential displacement and turn since
    tilting="f8",  # change of the normal of two free balls with what their centres move across it [1/m]
    reach="f8", first="f8", overlap="f8",  # overlap plus distance along the normal; overlap at the start and now [m]
    stiffness="f8",  # k of Hertz
    # P = share P_e + 3 late dx + carried, P_e of Hertz, dx gain of overlap. By the last P, P_e and dx, with n contacts
    # side by side and x = d h/(2 m): carried = n x/(1 + n x) P - late dx - (n - 1) x/(1 + n x) P_e
    share="f8", late="f8", carried="f8", lag="f8", beside="f8",
    spring="f8", drag="f8", friction="f8",  # tangential [N/m]; dashpot, of the motion in a substep [N/m]; coefficient
    torsion="f8", torsion_drag="f8", torsion_limit="f8",  # the same [N m/rad]; moment over P at the limit [m]
    pull=VECTOR, held=VECTOR,  # friction on B [N] and moment [N m], along the frame; that of the springs at the start
    normal_work="f8", friction_work="f8", impulse=VECTOR,  # twice the work [J]; on A, along the frame [N s]
    time="f8", longest="f8", furthest="f8",  # [s] since the start; [s] and square of [m] for which it may coast
    near="i8", pace="f8", start_a="f8",  # its pair; `pace.longest_substep` [s]; turn of A at the start, see `start`
)  # fmt: skip
"""The model of a contact that coasts, see `contacts.coasting`."""

Array = NDArray[Any]
SCRATCH = 4  # two scratch bodies, and what they are copies of


class Arrays(NamedTuple):
    """The arrays of a world: records where nothing else is said."""

    bodies: Array
    shapes: Array
    pairs: Array
    near: Array  # with room to spare, like `contacts` and `guards`; `world` says how many are used
    contacts: Array
    memory: Array  # history that the laws keep of each contact, shape (contacts, size)
    numbers: Array  # parameters of the laws of all pairs (`ContactPair.parameters`)
    points: Array  # cores of hulls: their vertices [m] by direction, see `hulls.by_direction`, shape (n, 3)
    groups: Array  # index of the pair that shapes of two groups make, or -1
    spare: Array  # stack of free contact slots, the next one last
    guards: Array
    near_bodies: Array  # numbers of the bodies that are near something or belong to a tree, in order
    roots: Array  # first bodies of the islands of a window
    island_bodies: Array  # members of one island
    island_pairs: Array  # with room for another list of them
    sweep: Array  # working memory of the broad phase, see `listing.list_within`
    saved_bodies: Array  # `SCRATCH` bodies, see `saved.scratch_body`, then room for a copy of each, see `save_body`
    trees: Array
    joints: Array  # of all trees: coordinates, velocities, and all that is derived from them, as float64
    rows: Array  # contacts of an island that takes an implicit step
    coasting: Array  # models of contacts that coast, by slot
    saved_contacts: Array  # contacts and their laws' history at the start of an implicit step
    saved_memory: Array
    equations: Array  # working memory of an implicit step
    world: Array  # one record

    def bound(self) -> Arrays:
        """Write the addresses and sizes of the arrays into the records; returns itself."""
        one = self.world
        for name, array in zip(self._fields[:-1], self[:-1], strict=True):
            one[name] = array.ctypes.data
        one["body_count"], one["shape_count"], one["pair_count"] = self.bodies.size, self.shapes.size, self.pairs.size
        one["whole_count"] = 1 + np.flatnonzero(~np.isin(self.shapes["kind"], PARTS)).max(initial=-1)
        one["near_room"], one["guard_room"], one["contact_room"] = self.near.size, self.guards.size, self.contacts.size
        one["memory_size"], one["group_count"] = self.memory.shape[1], self.groups.shape[0]
        one["unknown_room"] = self.equations.shape[1]
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


RECORDS = {
    "bodies": BODY, "shapes": SHAPE, "pairs": PAIR, "near": NEAR, "contacts": CONTACT, "guards": GUARD, "trees": TREE,
    "rows": ROW, "coasting": COASTING, "saved_bodies": BODY, "saved_contacts": CONTACT,
}  # fmt: skip
"""The kinds of records of arrays, by name."""

WORLD = record(
    **dict.fromkeys(Arrays._fields[:-1], "u8"),  # addresses of the arrays, and their lengths
    body_count="i8", shape_count="i8", pair_count="i8", near_room="i8", contact_room="i8", memory_size="i8",
    group_count="i8", guard_room="i8", whole_count="i8",  # and 1 + the last shape that is no part of another one
    step="f8",  # length of the step [s]
    together="i8",  # how many time steps of a `World` that is, see `step.steps_together`; 1 in engines
    time="f8",  # [s] that a `World` has been moved by
    substeps="f8",  # of an impact between few bodies
    crowd_substeps="f8", crowd="i8",  # of an impact in an island of more closed contacts than `crowd`
    stillness="f8",  # share of a sleeping contact's load and energy that may be unbalanced and kinetic; 0: none sleeps
    nears="i8", guard_count="i8", spares="i8", islands="i8", near_body_count="i8",  # how many of each there are
    slots="i8",  # how many slots of contacts have ever been in use: the first ones
    loose="i8",  # first body of the island that may end a window early, see `window.join_loose`; -1: none
    rested="i8", stale="i8",  # 1: no body moved in the last step; 1: near pairs must be listed anew
    brief="i8",  # 1: a list serves for the present step alone; WIDE: too, but such a list was too short
    # 0: no matter; AGED: near pairs may have been listed in an earlier step, which must not show; FRESH: in this one
    age="i8",
    edited="i8",  # 0, EDITED: the user has changed bodies since the last step, RESIZED: shapes too, which may overlap
    unknowns="i8", unknown_room="i8",  # of the island that takes an implicit step; how many there is room for
    implicit="i8", solved="i8",  # counts since the start: implicit steps of islands, and factorisations for them
    kicks="i8", lists="i8",  # counts since the start: contact substeps, and lists of near pairs
    # 1: a tree that was asked does not pass, see `near.passing`, or only beside what moves; UNLISTED: it may have met
    # what is not listed; CERTAIN: what it would meet does not depend on the list; LATE: found within the step
    denied="i8",
    deepest="f8",  # greatest overlap over the contact's radius since the start
    late="i8", latest="f8",  # contacts that were found overlapping when they closed, and the greatest such overlap [m]
    twists="i8", lost="i8",  # TWIST_LATER, TWIST_NOW or TWIST_ALWAYS; contacts for which there was no room
    left_out="i8",  # 1 + a shape of a near pair for which there was no room; 0: none
    lost_body="i8",  # the first lost in this step, 0: none, see `island.integrate`
    demand="u8",  # address of `demand.TABLE`
)  # fmt: skip
"""A world as a whole, the argument of compiled code."""
