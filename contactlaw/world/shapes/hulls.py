"""Convex hulls of points, and their cores, which a ball sweeps to give hulls with rounded edges.

The core of a convex body of faces n.x <= h is bounded by n.x = h - r. Each vertex moves to the point with that distance
from all the planes that meet there, by least squares where these are more than three. Where faces are narrow beside r,
such as bevels, their vertices would come out of other faces: then all corners of the core are found, without them.
"""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any

import numpy as np

from contactlaw.world.data.records import Array
from contactlaw.world.shapes.gjk import CELLS

FLAT = 1e-6  # of the size: heights up to this count as zero, as meshes are in single precision
FINE = 3.9e-3  # of the size: points less far outside are left out; a wheel of 50 sides, which MOST allows, is whole
MOST = 100  # vertices at most
SHARE = 0.1  # default radius, of the least distance of a face from the middle
SHARP = 0.9  # cosine of the angle between faces: flatter edges are no shapes of their own
BLUNT = 0.1  # relative cutoff of singular values of the normals at a vertex in the least squares that move it
CLEARLY = 1e-9  # of the size: margin by which one vertex is further than another, for rounding


def of_points(find: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of points (m, 3) that keeps its last results: meshes are read anew for each mjData and edit."""
    kept = lru_cache(maxsize=256)(lambda numbers, *more: find(np.frombuffer(numbers).reshape(-1, 3), *more))
    return wraps(find)(lambda points, *more: kept(np.asarray(points, np.float64).tobytes(), *more))


def apart(points: Array) -> list[int] | None:
    """Return numbers of four points (m, 3) far apart, the fourth inside of the first three; None: all in a plane."""
    size = float(np.ptp(points, axis=0).max())
    first = int(points[:, 0].argmin())
    second = int(np.linalg.norm(points - points[first], axis=1).argmax())
    direction = (points[second] - points[first]) / max(size, 1e-300)
    third = int(np.linalg.norm(np.cross(points - points[first], direction), axis=1).argmax())
    heights = (points - points[first]) @ np.cross(direction, points[third] - points[first])
    fourth = int(np.abs(heights).argmax())
    if not abs(heights[fourth]) > FLAT * size**2:
        return None
    return [first, second, third, fourth] if heights[fourth] < 0.0 else [first, third, second, fourth]


def convex_hull(points: Array, fine: float = FINE, most: int = MOST, flat: float = FLAT) -> tuple[Array, Array]:
    """Return the vertices (n, 3) of the hull of points (m, 3), and its triangles (k, 3), right-handed from outside.

    The next vertex is the point furthest outside the present hull (Barber, Dobkin & Huhdanpaa 1996), until none is
    further than `fine` times the size, or there are `most` vertices. It replaces all connected faces that it sees, or
    in whose plane it lies: no face is then a sliver of three nearly collinear vertices without a meaningful normal.
    flat: distance to a face, over the size, up to which a vertex lies in its plane.

    Raises:
        ValueError: All points lie in a plane.
    """
    size = float(np.ptp(points, axis=0).max())
    if (first_four := apart(points)) is None:
        raise ValueError("points: lie in a plane; a hull needs four that do not")
    *base, fourth = first_four
    faces = np.array([base, *([base[i], fourth, base[i - 2]] for i in range(3))])
    faces[1:] = faces[1:, ::-1] if _heights(points[base[2:]], points, faces[1:2])[0, 0] > 0.0 else faces[1:]
    rest, heights = np.arange(len(points)), _heights(points, points, faces)
    for _ in range(most - 4):
        outside = heights.max(1)
        top = int(outside.argmax())
        if outside[top] <= fine * size:
            break
        new, above = int(rest[top]), heights[top]
        seen = _around(faces, above > -flat * size, int(above.argmax()))
        edges = {(f[i], f[i - 2]) for f in faces[seen].tolist() for i in range(3)}
        rim = np.array([[i, j, new] for i, j in sorted(edges) if (j, i) not in edges])
        out = outside > 0.0  # points inside stay inside
        rest, faces = rest[out], np.concatenate([faces[~seen], rim])
        heights = np.concatenate([heights[out][:, ~seen], _heights(points[rest], points, rim)], axis=1)
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3)


def _around(faces: Array, which: Array, first: int) -> Array:
    """Return which faces, of those marked in `which`, are connected to the first by edges."""
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
    """Return the heights [m] of places above the planes of faces, shape (places, faces)."""
    n = _normals(points, faces)
    return places @ n.T - (n * points[faces[:, 0]]).sum(1)


@of_points
def core_of(points: Array, radius: float | None = None) -> tuple[Array, list[tuple[int, int]], float]:
    """Return the core of the hull of points (m, 3): vertices (n, 3), sharp edges by both ends, and the radius [m].

    radius: None: a tenth of the least distance of a face from the mean of the vertices.

    Raises:
        ValueError: The radius is more than half of that distance.
    """
    vertices, faces = convex_hull(points)
    normals, size = _normals(vertices, faces), float(np.ptp(points, axis=0).max())
    heights = (vertices[faces[:, 0]] * normals).sum(1)
    depth = float(((vertices[faces[:, 0]] - vertices.mean(0)) * normals).sum(1).min())
    r = SHARE * depth if radius is None else radius
    if not 0.0 < r <= 0.5 * depth:
        raise ValueError(f"rounding = {radius}: must be > 0 and at most half the hull's least depth, {depth:.6g} m")
    meet = (faces[None] == np.arange(len(vertices))[:, None, None]).any(2)
    planes = [normals[own][np.unique(normals[own].round(6), axis=0, return_index=True)[1]] for own in meet]
    core = vertices + [np.linalg.lstsq(own, np.full(len(own), -r), rcond=BLUNT)[0] for own in planes]
    if (core @ normals.T - heights + r > FINE * size).any():
        core, faces = convex_hull(_corners(normals, heights - r, FLAT * size), 0.1 * FINE, flat=CLEARLY)
        normals = _normals(core, faces)
    sides = {(f[i - 1], f[i]): n for f, n in zip(faces.tolist(), normals, strict=True) for i in range(3)}
    edges = [(i, j) for (i, j), n in sides.items() if i < j and n @ sides[j, i] < SHARP]
    return core, edges, r


def _corners(normals: Array, heights: Array, margin: float) -> Array:
    """Return the corners (n, 3) of n.x <= h, some twice: ends of what other planes leave of the line of each two."""
    one, two = np.triu_indices(len(normals), 1)
    along = np.cross(normals[one], normals[two])
    size = np.linalg.norm(along, axis=1)[:, None]
    one, two, along, size = (own[size[:, 0] > FLAT] for own in (one, two, along, size))  # not parallel
    to = heights[one, None] * np.cross(normals[two], along) + heights[two, None] * np.cross(along, normals[one])
    to, along = to / size**2, along / size
    rates, left = along @ normals.T, heights - to @ normals.T
    across = np.abs(rates) < FLAT  # planes along the line
    ends = left / np.where(across, 1.0, rates)
    low = np.where(across | (rates > 0.0), -np.inf, ends).max(1)
    high = np.where(across | (rates < 0.0), np.inf, ends).min(1)
    own = (low <= high) & (~across | (left > -margin)).all(1)
    return np.concatenate([to[own] + end[own, None] * along[own] for end in (low, high)])


@of_points
def by_direction(vertices: Array) -> Array:
    """Return the vertices (n, 3) that can be furthest along a direction, by cell of directions, see `gjk.cell_of`.

    A vertex is left out of a cell if another one is further along each of the cell's four corners, and so along all
    directions between. One row a cell with the place of its first vertex and their number; then the vertices.
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
