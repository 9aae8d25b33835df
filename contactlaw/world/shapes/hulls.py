"""The convex hull of points, and its core: the hull of points that lie a radius deeper, which a ball sweeps.

The core of a convex body of plane faces n x <= h is bounded by n x = h - r. A vertex goes to the point that is so on
all the faces that meet there, by least squares where they are more than three: what a ball sweeps then has these
faces, and edges and vertices of radius r.
"""

from __future__ import annotations

import numpy as np

from contactlaw.world.data.records import Array
from contactlaw.world.shapes.gjk import CELLS

FLAT = 1e-6  # of the size, a height that is none: meshes come in single precision
FINE = 5e-3  # of the size: what lies less far outside is left out
MOST = 100  # vertices
SHARE = 0.1  # of the least distance of a face from the middle: the radius where none is given
SHARP = 0.9  # cosine of the angle by which an edge turns at least that is one
BLUNT = 0.1  # least of the singular values of the normals at a vertex, over the greatest, that moves it
CLEARLY = 1e-9  # of the size: what is so much further along a direction is so in spite of rounding


def convex_hull(points: Array, fine: float = FINE, most: int = MOST) -> tuple[Array, Array]:
    """Vertices (n, 3) of the hull of points (m, 3), and its faces, triangles (k, 3) that are outward right-handed.

    The next vertex is the point that is furthest outside of what there is (Barber, Dobkin & Huhdanpaa 1996), until none
    is further than `fine` of the size, or there are so many: what is left out lies so far outside at most. It takes
    the place of all faces around that it sees or that it lies in the plane of: no face is then a sliver on whose
    three vertices, nearly in a line, a normal means nothing.

    Raises:
        ValueError: All points lie in a plane.
    """
    size = float(np.ptp(points, axis=0).max())
    first = int(points[:, 0].argmin())
    second = int(np.linalg.norm(points - points[first], axis=1).argmax())
    way = (points[second] - points[first]) / max(size, 1e-300)
    third = int(np.linalg.norm(np.cross(points - points[first], way), axis=1).argmax())
    heights = (points - points[first]) @ np.cross(way, points[third] - points[first])
    fourth = int(np.abs(heights).argmax())
    if not abs(heights[fourth]) > FLAT * size**2:
        raise ValueError("points: lie in a plane; a hull needs four that do not")
    base = [first, second, third] if heights[fourth] < 0.0 else [first, third, second]
    faces = np.array([base, *([base[i], fourth, base[i - 2]] for i in range(3))])
    faces[1:] = faces[1:, ::-1] if _heights(points[base[2:]], points, faces[1:2])[0, 0] > 0.0 else faces[1:]
    rest, heights = np.arange(len(points)), _heights(points, points, faces)
    for _ in range(most - 4):
        outside = heights.max(1)
        top = int(outside.argmax())
        if outside[top] <= fine * size:
            break
        new, above = int(rest[top]), heights[top]
        seen = _around(faces, above > -FLAT * size, int(above.argmax()))
        edges = {(f[i], f[i - 2]) for f in faces[seen].tolist() for i in range(3)}
        rim = np.array([[i, j, new] for i, j in sorted(edges) if (j, i) not in edges])
        out = outside > 0.0  # what is inside remains so
        rest, faces = rest[out], np.concatenate([faces[~seen], rim])
        heights = np.concatenate([heights[out][:, ~seen], _heights(points[rest], points, rim)], axis=1)
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3)


def _around(faces: Array, which: Array, first: int) -> Array:
    """Those of some faces that hang together with the first of them by edges."""
    out = np.zeros(len(faces), bool)
    out[first], count = True, 0
    while count < (count := int(out.sum())):
        ends = {(f[i - 2], f[i]) for f in faces[out].tolist() for i in range(3)}
        out |= which & [any((f[i], f[i - 2]) in ends for i in range(3)) for f in faces.tolist()]
    return out


def _normals(points: Array, faces: Array) -> Array:
    n = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    return n / np.linalg.norm(n, axis=1)[:, None]


def _heights(places: Array, points: Array, faces: Array) -> Array:
    """Of all places above all faces of points [m], shape (places, faces)."""
    n = _normals(points, faces)
    return places @ n.T - (n * points[faces[:, 0]]).sum(1)


def core_of(points: Array, radius: float | None = None) -> tuple[Array, list[tuple[int, int]], float]:
    """Vertices (n, 3) of the core of the hull of points (m, 3), its sharp edges by both ends, and the radius [m].

    radius: None: a tenth of the least distance of a face from the middle of the vertices.

    Raises:
        ValueError: The radius is more than half of that distance.
    """
    vertices, faces = convex_hull(points)
    normals = _normals(vertices, faces)
    depth = float(((vertices[faces[:, 0]] - vertices.mean(0)) * normals).sum(1).min())
    r = SHARE * depth if radius is None else radius
    if not 0.0 < r <= 0.5 * depth:
        raise ValueError(f"rounding = {radius}: must be > 0 and at most half the hull's least depth, {depth:.6g} m")
    moved = [
        np.linalg.lstsq(own, np.full(len(own), -r), rcond=BLUNT)[0]
        for own in (normals[(faces == i).any(1)] for i in range(len(vertices)))
    ]
    sides = {(f[i - 1], f[i]): n for f, n in zip(faces.tolist(), normals, strict=True) for i in range(3)}
    edges = [(i, j) for (i, j), n in sides.items() if i < j and n @ sides[j, i] < SHARP]
    return vertices + np.array(moved), edges, r


def by_direction(vertices: Array) -> Array:
    """Which vertices (n, 3) can be the furthest along a direction, for each cell of the directions, see `gjk.cell_of`.

    Of those of a cell one is not that if another is further along each of its four corners: so it is between them. For
    each cell a row with the place of its first vertex, and how many there are; then the vertices themselves, in their
    order.
    """
    margin = CLEARLY * float(np.ptp(vertices, axis=0).max())
    border = np.linspace(-1.0, 1.0, CELLS + 1)
    rows, kept, place = [], [], 6 * CELLS**2
    for face in range(6):
        corners = np.stack(np.broadcast_arrays(1.0, border[:, None], border[None, :]), axis=-1)
        far = np.roll(corners if face % 2 == 0 else -corners, face // 2, axis=-1) @ vertices.T
        for i, j in np.ndindex(CELLS, CELLS):
            at = far[i : i + 2, j : j + 2].reshape(4, -1)
            passed = (at[:, :, None] > at[:, None, :] + margin).all(0).any(0)
            own = vertices[~passed]
            rows.append((place, len(own), 0.0))
            kept.append(own)
            place += len(own)
    return np.concatenate([np.array(rows), *kept])
