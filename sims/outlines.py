"""Outlines of bodies in the plane of a picture: polygons in two tones, to show rotation."""

import numpy as np

from sims.recording import Array, Outline, Track

FAR = 100.0  # half length of a plane [m]
CORNERS = 48  # of a circle
LIGHT, DARK, EDGE = "light", "dark", "edge"
Polygon = tuple[Array, str]
"""Corners [m], shape (n, 2), and the tone: `LIGHT` and `DARK` are filled, `EDGE` is a line around."""


def reach_of(track: Track) -> Array:
    """Extent of a body from its centre along each axis of the world [m], shape (n, 3)."""
    size, turns = np.array(track.size), np.abs(track.rotations)
    if track.shape in ("ball", "disc"):
        return np.full(track.positions.shape, size[0])
    if track.shape == "box":
        return turns @ size
    axis = turns[:, :, 2]
    across = np.sqrt(np.clip(1.0 - axis**2, 0.0, None)) if track.shape == "cylinder" else np.ones_like(axis)
    return size[0] * across + size[1] * axis


def polygons_of(track: Track, entry: int, view: tuple[int, int]) -> list[Polygon]:
    """Polygons of a body at one entry of its track.

    Dark are: of a round body the half that its own x axis points to, of a cylinder half of each end, of a box or
    a capsule one end.

    Args:
        track: The body.
        entry: Which.
        view: World axes to the right and up.

    Returns:
        Polygons in the order in which to draw them.
    """
    frame = _frame(view)
    place, turn = frame @ track.positions[entry], frame @ track.rotations[entry]
    centre = place[:2]
    if track.shape in ("ball", "disc"):
        radius = track.size[0]
        ring = centre + radius * _circle(np.array([1.0, 0.0]), np.array([0.0, 1.0]), 2.0 * np.pi)
        return [(ring, LIGHT), (centre + radius * _half(turn[:, 0]), DARK), (ring, EDGE)]
    if track.shape == "box":
        half = np.array(track.size)
        whole = _hull(centre + (_signs() * half @ turn.T)[:, :2])
        end = _hull(centre + ((np.array([0.75, 0.0, 0.0]) + _signs() * [0.25, 1.0, 1.0]) * half @ turn.T)[:, :2])
        return [(whole, LIGHT), (end, DARK), (whole, EDGE)]
    radius, half_length = track.size
    if track.shape == "cylinder":
        discs = [
            centre + (radius * _circle(turn[:, 0], turn[:, 1], 2.0 * np.pi) + side * half_length * turn[:, 2])[:, :2]
            for side in (-1.0, 1.0)
        ]
        end = discs[int(turn[2, 2] > 0.0)]  # the one that is seen
        whole, near = _hull(np.concatenate(discs)), np.concatenate([end[: CORNERS // 2], end[:1]])
        return [(whole, LIGHT), (near, DARK), (whole, EDGE), (end, EDGE)]
    ends = [centre + side * half_length * turn[:2, 2] for side in (1.0, -1.0)]
    rings = [end + radius * _circle(np.array([1.0, 0.0]), np.array([0.0, 1.0]), 2.0 * np.pi) for end in ends]
    whole = _hull(np.concatenate(rings))
    return [(whole, LIGHT), (rings[0], DARK), (whole, EDGE)]


def scenery_of(outline: Outline, view: tuple[int, int]) -> Array:
    """Corners of the line or hull of something fixed, shape (n, 2); none for a plane not seen edge on."""
    if outline.normal:
        right, up, towards = _frame(view) @ np.array(outline.normal)
        point = outline.points[:1] @ _frame(view)[:2].T
        return point + FAR * np.array([[-up, right], [up, -right]]) if abs(towards) < 1e-6 else point[:0]
    flat = outline.points @ _frame(view)[:2].T
    return _hull(flat) if outline.solid else flat


def _frame(view: tuple[int, int]) -> Array:
    """Rows: unit vectors right, up, and towards the viewer."""
    right, up = np.eye(3)[view[0]], np.eye(3)[view[1]]
    return np.array([right, up, np.cross(right, up)])


def _signs() -> Array:
    return np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T


def _circle(first: Array, second: Array, angle: float) -> Array:
    """Circle from the first of two perpendicular radii through the second, in the plane or in space."""
    angles = np.linspace(0.0, angle, CORNERS)[:, None]
    return np.cos(angles) * first + np.sin(angles) * second


def _half(axis: Array) -> Array:
    """Visible part of the half of the unit ball to which an axis points, in the frame of the picture."""
    length = float(np.hypot(axis[0], axis[1]))
    ahead = axis[:2] / length if length > 1e-9 else np.array([1.0, 0.0])
    across = np.array([-ahead[1], ahead[0]])
    limb = _circle(across, ahead, np.pi)  # over the side where the axis points to
    border = _circle(-across, -float(axis[2]) * ahead, np.pi)  # and back along the great circle around the axis
    return np.concatenate([limb, border])


def _hull(points: Array) -> Array:
    """Corners of the convex hull of points, shape (n, 2), in order (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    chains = []
    for run in (ordered, ordered[::-1]):
        chain: list[Array] = []
        for point in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
                chain.pop()
            chain.append(point)
        chains += chain[:-1]
    return np.array(chains)


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
