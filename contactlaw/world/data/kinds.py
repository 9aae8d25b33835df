"""Kinds of shapes. Of two shapes that touch, A is the one of the lower kind; `MEETS` says which do.

SPHERE: meets all shapes but the ends of capsules. END: a sphere too, one end of a capsule; it meets boxes and planes
only. SEGMENT: the side of a capsule, which meets round shapes, and the edges of boxes and hulls. BOX, CYLINDER, HULL (a
polyhedron swept by a ball) and PLANE (a half space) meet round shapes. ELLIPSOID: meets all but parts.

Flat shapes meet each other by round parts, see `shapes.description.parts_of`: CORNER, a small sphere; EDGE, a segment;
DISC, the rim of a cylinder; SIDE, a disc extended along the axis, which meets cylinders and height fields only.
HEIGHT_FIELD: meets what a plane meets, and sides and edges on ridges; one surface is several shapes, see
`shapes.height_field`; whole shapes are separated from it by the plane at its top. TANGENT: a plane that is placed anew
before each step where an engine has found two shapes nearest; its pair is always near.
"""

SPHERE, END, CORNER, SEGMENT, EDGE, DISC, SIDE, ELLIPSOID, BOX, CYLINDER, HULL, PLANE, HEIGHT_FIELD, TANGENT = range(14)

PARTS = CORNER, EDGE, DISC, SIDE  # kinds that are only parts of flat shapes

_MET = {
    SPHERE: {SPHERE, SEGMENT, *range(ELLIPSOID, TANGENT + 1)}, **dict.fromkeys((END, CORNER), range(BOX, TANGENT + 1)),
    SEGMENT: {SEGMENT, ELLIPSOID, BOX, CYLINDER, HULL, HEIGHT_FIELD}, EDGE: {BOX, CYLINDER, HULL, HEIGHT_FIELD},
    DISC: {BOX, CYLINDER, HULL, PLANE, HEIGHT_FIELD}, SIDE: {CYLINDER, HEIGHT_FIELD},
    ELLIPSOID: {ELLIPSOID, BOX, CYLINDER, HULL, PLANE, HEIGHT_FIELD}, BOX: {HULL}, HULL: {HULL},
}  # fmt: skip
MEETS = tuple(sum(1 << other for other in _MET.get(kind, ())) for kind in range(TANGENT + 1))
"""Which kinds each kind meets, of its own number or a higher one: bits, the least one of kind 0."""

# Contacts at once that there is room for, for each round shape by its kind; of a hull with its parts. (Balls of any
# sizes that do not overlap have at most 7.5 contacts a ball, Kuperberg & Schramm 1994.)
NEIGHBOURS = {SPHERE: 8, END: 8, SEGMENT: 8, CORNER: 3, EDGE: 2, DISC: 4, SIDE: 4, ELLIPSOID: 8, HULL: 32}
