"""The records of a kinematic tree, and of its links, joints, axes and limits."""

from typing import Any

from contactlaw.laws.record import MATRIX, VECTOR, record

FREE_JOINT, BALL, SLIDE, HINGE = 0, 1, 2, 3  # kinds of joints, numbered as in MuJoCo
DENIED, ASKED, PASSES = 0, 1, 2  # values of `TREE.passes`
PLACED = 2  # value of `TREE.stale`
SPARE_LIMITS = 4  # twice as many may act in a step as a tree has degrees of freedom, and so many more

TREE = record(
    # addresses of the functions that move it, see `trees.mobility` and `trees.motion`
    fly="u8", drift="u8", settle="u8", kick="u8", mobility="u8", spread_delta_v="u8", add_accelerations="u8", stop="u8",
    # and in an implicit step
    move_from_start="u8", write_masses="u8", add_damping="u8", balance="u8", take_middle="u8", add_force="u8",
    move="u8",  # q <- q moved by x; poses of its bodies, links and axes there
    accelerate="u8",  # M(q) and its factor; a at q and v
    # its bodies are consecutive rows: address and number of the first, and how many
    bodies="u8", first="i8", count="i8",
    q_size="i8", v_size="i8", joint_count="i8",
    base=VECTOR, base_turn=("f8", (4,)),  # position [m] and quaternion of what carries it, at rest within a step
    hangs_on="i8",  # number of that body
    gravity=VECTOR,  # [m/s^2]
    q="u8", v="u8", a="u8",  # addresses of its numbers: generalised coordinates, velocities, accelerations
    f="u8", d="u8", v_f="u8",  # generalised force f - D (v - v_f) - K u, all constant over a step; D (v_size, v_size)
    springs="u8", sprung="i8",  # stiffness K of springs, as D; 1: there are some. u: displacement since `start`
    e="u8",  # inertia by which soft constraints resist acceleration, constant over a step; as D
    coupled="i8",  # 1: D or E has entries off the diagonal
    rigid="i8",  # 1: one body that moves freely, with its own inertia alone
    followed="i8",  # 1: velocities have followed a change of forces in this step, for two stages or substeps
    x="u8",  # (v_size,), argument and result of these functions
    pending="u8", kicked="i8",  # (v_size,), generalised impulses not yet applied to v; 1: there are some
    kick_v="u8",  # (v_size,), change of v by impulses since its last drift
    factor="u8", path="u8",  # (v_size, v_size), see `trees.dynamics`; the axes that each row has entries of, as whole
    # soft limits and dry friction that act in this step; their rows J, (.., v_size); L^-T J^T, see `limits.answer`
    limits="u8", limited="i8", rows="u8", answers="u8",
    room="u8",  # q_size + 3 v_size, scratch
    start="u8",  # q_size + v_size, coordinates and velocities at the start of the step
    links="u8", joints="u8", axes="u8",  # records
    numbers="i8",  # where all these begin in `Arrays.joints`
    # in an implicit step: index of its first unknown; address and row length of a matrix; a stage [s]
    unknown="i8", weights="u8", stride="i8", stage="f8",
    origin=VECTOR,  # within a step: point of the world [m] to which spatial velocities and moments refer
    hold="i8",  # substeps for which its mass matrix and accelerations are still held
    held="f8",  # [s] length of these substeps
    stale="i8",  # 1: nothing belongs to q and v; PLACED: poses and axes belong to q, all else does not
    rate="f8",  # [rad/s] at which its bodies turn, at most: see `LINK`
    coupling="f8",  # greatest diagonal entry of the mass matrix over its pivot
    change_rate="f8",  # [rad/s] at which its motion changes: the greatest `rate` plus spin relative to the parent
    max_acceleration="f8", effort="f8",  # [m/s^2] of its bodies, greatest; greatest ratio to the root of their mobility
    decay="f8", swing="f8",  # [1/s] at which damping may slow a velocity, at most; over the lag that groups may have
    stiffness="f8",  # [1/s^2] of springs over masses, at most
    lag="f8", ease="f8",  # s and e [s] of M + s D + e^2 K, see `trees.dynamics`
    span="f8",  # [s] length of the step
    midway="i8",  # 1: damping acts on the velocities at the start of a group of substeps, which are in `room`
    unmoved="i8",  # 1: velocities of its bodies are set to zero, so that accelerations are without centripetal terms
    passes="i8",  # whether it may stay where the engine's step has put it, see `near.passing`: DENIED, ASKED, PASSES
    disturbed="i8",  # 1: it sleeps, but its coordinates, velocities or forces are not those that it fell asleep with
)  # fmt: skip
"""A kinematic tree: bodies joined by joints, in generalised coordinates."""

LINK = record(
    parent="i8",  # number in the tree of the body that carries it; -1: the body that carries the tree
    first_joint="i8", joints="i8", first_axis="i8", axes="i8",
    position=VECTOR, quaternion=("f8", (4,)),  # of its frame in its parent's, before its joints
    centre=VECTOR, frame=("f8", (4,)),  # centre of mass and principal axes in its frame
    mass="f8", inertia=VECTOR,  # [kg], principal moments [kg m^2]
    place=VECTOR, turn=("f8", (4,)),  # pose of its frame in the world
    velocity=VECTOR,  # of its material at the tree's origin [m/s]
    rate="f8",  # [rad/s] spin plus root of angular acceleration: greatest of the link and of those that carry it
    bias=VECTOR, bias_turning=VECTOR,  # bias accelerations, at a = 0: of its material at the origin, and angular
    response=VECTOR, response_turning=VECTOR,  # the same accelerations by a alone
    force=VECTOR, moment=VECTOR,  # [N], [N m] about the origin, that it and all it carries need at a = 0
    # composite body of it and all it carries, about the origin: mass, first moment, inertia
    composite_mass="f8", composite_moment=VECTOR, composite_inertia=MATRIX,
)  # fmt: skip
"""A body of a tree and how its parent carries it; the row of the same body in `Arrays.bodies` holds its motion."""

JOINT = record(
    kind="i8", first_q="i8", first_axis="i8",
    at=VECTOR, axis=VECTOR,  # in the link's frame [m]
    reference="f8",  # coordinate of a hinge or slide at zero displacement
)  # fmt: skip
"""A joint of a link. Several joints of one link act in sequence, the first next to the parent."""

AXIS = record(
    carrier="i8", parent="i8", depth="i8",  # axis that carries it, next in its row of the factor, or -1; how many
    begins="i8",  # 0: second or third axis of a ball joint; all three turn with what carries the joint
    armature="f8",  # [kg] or [kg m^2], inertia of the joint itself
    inertia="f8", inverse="f8",  # its diagonal entry of the mass matrix; inverse pivot of the factor
    root="f8",  # of that
    # slope of its damping by servos that have a range [N s/m], [N m s]; how far their force may fall and rise from that
    # at v_f [N], [N m]; that slope while they are at an end, else zero
    slope="f8", least="f8", most="f8", loose="f8",
    spin=VECTOR, velocity=VECTOR,  # Jacobian: spin of all it carries and its velocity at the origin, by unit speed
)  # fmt: skip
"""A degree of freedom of a tree."""

LIMIT = record(
    first="i8", end="i8",  # velocities that its row has entries of
    gap="f8",  # [m] or [rad] distance at the start of the step, negative beyond the limit
    mass="f8", resistance="f8", stiffness="f8",  # slopes of its force with acceleration, velocity and distance
    force="f8", friction="f8",  # [N] or [N m] in all accelerations; greatest force of dry friction, 0: a limit
    # scratch of `limits.find`: impulse beyond that of `force`; that without changes of the speed; 1: beyond the limit
    given="f8", push="f8", reached="i8", acting="i8",  # 1: it acts
    speed="f8", gained="f8", rest="f8",  # and what is gained of it by contacts or in all, and by accelerations
    pushes="i8",  # 1: it has pushed in the last substep; dry friction: contacts have kicked its tree in this step
    mobility="f8",  # speed by a unit impulse; 0: not known, nor is its row of `TREE.answers`
)  # fmt: skip
"""A soft limit or the dry friction of a joint or tendon, see `trees.limits`."""


def numbers_of(tree: Any) -> dict[str, int]:
    """Return the sizes [float64] of the arrays of a tree, by their names in its record, in their order in memory."""
    q, v = int(tree["q_size"]), int(tree["v_size"])
    most = 2 * v + SPARE_LIMITS
    rows = {"links": (LINK, tree["count"]), "joints": (JOINT, tree["joint_count"]), "axes": (AXIS, v)}
    rows |= {"limits": (LIMIT, most)}
    one = dict.fromkeys(("v", "a", "f", "v_f", "x", "pending", "kick_v"), v)
    own = {name: int(count) * kind.itemsize // 8 for name, (kind, count) in rows.items()}
    sizes = dict.fromkeys(("d", "springs", "e", "factor", "path"), v * v) | dict.fromkeys(("rows", "answers"), most * v)
    return {"q": q} | one | sizes | {"room": q + 3 * v, "start": q + v} | own
