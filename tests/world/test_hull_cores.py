"""Hulls of points and their cores: closed, as wide as they were made, and found for any points."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.world.shapes.gjk import cell_of
from contactlaw.world.shapes.hulls import by_direction, convex_hull, core_of
from tests.world.test_hulls import CUBE


def test_a_hull_reaches_as_far_as_its_points_and_its_core_a_radius_less() -> None:
    rng = np.random.default_rng(0)
    for number in range(60):
        points = rng.normal(size=(rng.integers(5, 40), 3)) * rng.uniform(0.3, 1.0, 3)
        if number % 3 == 0:
            points = np.round(2.0 * points)
            if np.linalg.matrix_rank(points - points[0]) < 3:
                continue
        vertices, faces = convex_hull(points, fine=1e-9, most=1000)
        directions = rng.normal(size=(500, 3))
        np.testing.assert_allclose((vertices @ directions.T).max(0), (points @ directions.T).max(0), rtol=0, atol=1e-12)
        assert len(faces) == 2 * len(vertices) - 4
    points, edges, radius = core_of(0.02 * CUBE)
    assert len(edges) == 12
    assert radius == pytest.approx(0.002)
    np.testing.assert_allclose(np.sort(points, axis=0), np.sort(0.018 * CUBE, axis=0), rtol=0, atol=1e-15)
    assert len(convex_hull(rng.normal(size=(2000, 3)))[0]) <= 100


@pytest.mark.parametrize("sides", [3, 32, 45, 48, 50])
@pytest.mark.parametrize("width", [0.02, 0.3])
def test_a_wheel_of_up_to_fifty_sides_stays_regular(sides: int, width: float) -> None:
    """One of 48 had become one of 29 unequal sides on one rim, and of 26 on the other."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    rim = 0.3 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    core, _, radius = core_of(np.concatenate([rim + (0.0, 0.0, width), rim - (0.0, 0.0, width)]))
    for end in (1.0, -1.0):
        own = core[np.sign(core[:, 2]) == end]
        turned = np.sort(np.arctan2(own[:, 1], own[:, 0]))
        np.testing.assert_allclose(np.diff(turned), 2.0 * np.pi / sides, rtol=0, atol=1e-9)
        far = 0.3 - radius / np.cos(np.pi / sides)
        np.testing.assert_allclose(np.linalg.norm(own[:, :2], axis=1), far, rtol=1e-9)
        assert len(own) == sides


@pytest.mark.parametrize("bevel", [0.02, 0.04, 0.06])
@pytest.mark.parametrize("rounding", [None, 0.3])
def test_a_cube_with_narrow_bevels_or_fillets_is_as_wide_as_it_was(bevel: float, rounding: float | None) -> None:
    """Vertices that passed each other, as bevels are narrow beside the rounding, came out of the faces by up to 6 %."""
    angles = np.linspace(0.0, 0.5 * np.pi, 4)
    ends = np.array([(np.cos(p) * np.cos(q), np.sin(p) * np.cos(q), np.sin(q)) for p in angles for q in angles])
    for inner in (np.eye(3), np.eye(3)[:2], ends):  # corners cut off, bevels along z, fillets
        corner = 1.0 - bevel + bevel * inner
        corner[:, 2] = 1.0 if len(inner) == 2 else corner[:, 2]
        core, _, radius = core_of((CUBE[:, None] * corner).reshape(-1, 3), rounding)
        np.testing.assert_allclose([-core.min(0), core.max(0)], 1.0 - radius, rtol=0, atol=4e-3)


def test_the_furthest_vertex_is_among_those_of_a_directions_cell() -> None:
    """The same one as of all of them, and the first of those that are as far; also along what is no direction."""
    rng = np.random.default_rng(3)
    for points in (CUBE, *(rng.normal(size=(n, 3)) * (0.02, 0.1, 1.0) for n in (4, 20, 400))):
        vertices = core_of(points)[0]
        table = by_direction(vertices)
        whole = np.stack(np.meshgrid(*3 * [[-2.0, -1.0, 0.0, 1.0, 2.0]]), axis=-1).reshape(-1, 3)
        for direction in (*whole, *rng.normal(size=(1000, 3))):
            first, count, _ = table[cell_of(tuple(direction))].astype(int)
            if direction.any():
                own = table[first : first + count]
                assert np.array_equal(own[(own @ direction).argmax()], vertices[(vertices @ direction).argmax()])
            assert count > 0
        assert np.isfinite(table[cell_of((np.nan, 0.0, 1.0))]).all()


def test_a_hull_is_closed_whose_points_lie_in_planes_and_lines_to_single_precision() -> None:
    """Prisms of many rows of points, turned: with slivers for faces hulls were open, or hollow, and were refused."""
    rng = np.random.default_rng(2)
    for _ in range(150):
        angle = 2.0 * np.pi * np.arange(sides := rng.integers(3, 40)) / sides
        rows = [[r * np.cos(angle), r * np.sin(angle), np.full(sides, z)] for z in range(5) for r in (0.3, 0.6, 1.0)]
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        points = np.concatenate(rows, axis=1).T * rng.uniform(0.02, 1.0, 3) @ turn
        points = rng.permutation(points.astype(np.float32)).astype(float)
        size = np.ptp(points, axis=0).max()
        vertices, faces = convex_hull(points)
        corners = vertices[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        heights = points @ normals.T - (normals * corners[:, 0]).sum(1)
        edges = {(face[i - 1], face[i]) for face in faces.tolist() for i in range(3)}
        assert len(edges) == 3 * len(faces)
        assert edges == {(j, i) for i, j in edges}
        assert heights.max() < 6e-3 * size
        assert (vertices @ normals.T - (normals * corners[:, 0]).sum(1)).max() < 1e-4 * size
        assert core_of(points)[2] > 0.0


def test_a_core_is_closed_whose_corners_lie_close_together() -> None:
    """Where vertices that pass each other leave many corners, faces are small: flat means flat to rounding there."""
    points = np.array([
        [0.1485, -0.4434, -0.2071], [-0.2511, 0.4661, -0.0157], [-0.4567, 0.0742, -0.2414], [0.4734, 0.2059, -0.113],
        [-0.1823, -0.4419, 0.197], [0.5123, -0.1307, 0.0841], [0.4769, 0.016, 0.1862], [-0.2226, -0.3321, -0.2791],
        [-0.4648, 0.2773, -0.0493], [0.5351, 0.0175, -0.0107], [-0.4481, 0.1159, -0.2448], [0.3256, 0.2848, 0.2169],
        [0.3603, 0.283, -0.2499], [-0.2803, -0.1036, 0.3925], [-0.4649, 0.2493, 0.1071],
    ])  # fmt: skip
    core, edges, radius = core_of(points)
    assert len(core) < 50 and max(map(max, edges)) < len(core)
    directions = np.random.default_rng(1).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    far = (core @ directions.T).max(0) + radius - (points @ directions.T).max(0)
    assert far.min() > -0.05 and far.max() < 5e-3
