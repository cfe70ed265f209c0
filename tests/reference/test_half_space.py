"""Half-space integrals over pairs of cells, against brute force."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from core_cells import face_cells
from half_space import HalfSpaceIntegrals
from scipy.integrate import quad
from shapely import Polygon, affinity, box

from mjtactile.contact.cells.half_space import half_space
from mjtactile.fem.surface_grid import oriented_edges

TRIANGLE = Polygon([(0.0, 0.0), (1.0, 0.1), (0.3, 0.8)])
HOOK = Polygon([(0, 0), (1, 0), (1, 0.4), (0.4, 0.4), (0.4, 1), (0, 1)])
SQUARE = box(0.0, 0.0, 1.0, 1.0)


def integrals_of(*shapes: Polygon) -> HalfSpaceIntegrals:
    edges = [oriented_edges(shape) for shape in shapes]
    owner = np.repeat(np.arange(len(shapes)), [len(one) for one in edges])
    return HalfSpaceIntegrals(np.concatenate(edges), np.column_stack([owner, np.full(len(owner), -1)]))


def quadrature(shape: Polygon, order: int = 6, pieces: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and weights of a fan of triangles from the first corner, each cut into smaller ones."""
    corners = np.array(shape.exterior.coords)[:-1]
    nodes, weights = np.polynomial.legendre.leggauss(order)
    cuts = np.arange(pieces)[:, None]
    nodes = ((cuts + (nodes + 1) / 2) / pieces).ravel()
    weights = np.tile(weights / 2 / pieces, pieces)
    u, v = (one.ravel() for one in np.meshgrid(nodes, nodes))
    points, areas = [], []
    for second, third in itertools.pairwise(corners[1:]):
        one, two = second - corners[0], third - second
        points.append(corners[0] + u[:, None] * (one + v[:, None] * two))
        areas.append(np.outer(weights, weights).ravel() * u * float(one[0] * two[1] - one[1] * two[0]))
    return np.concatenate(points), np.concatenate(areas)


def brute_force(first: Polygon, second: Polygon) -> dict[str, float]:
    (here, weights), (there, others) = quadrature(first), quadrature(second)
    x, y = (here[:, None] - there).transpose(2, 0, 1)
    distance = np.hypot(x, y)
    kernels = {
        "xx": y**2 / distance**3,
        "xy": -x * y / distance**3,
        "yy": x**2 / distance**3,
        "along": x / distance**2,
        "across": y / distance**2,
    }
    return {name: float(weights @ kernel @ others) for name, kernel in kernels.items()}


@pytest.mark.parametrize(
    ("first", "second", "error"),
    [
        (TRIANGLE, affinity.translate(HOOK, 2.5, -1.0), 1e-3),
        (TRIANGLE, affinity.translate(HOOK, 30.0, 12.0), 3e-5),
        (SQUARE, affinity.translate(affinity.rotate(SQUARE, 30), 1.6, 0.2), 1e-3),
        (affinity.scale(SQUARE, 0.05, 1.0), affinity.translate(SQUARE, 0.9, 0.1), 1e-3),
        (SQUARE, affinity.translate(affinity.scale(SQUARE, 0.01, 0.01), 1.2, 0.0), 1e-3),
    ],
    ids=["near", "far", "turned", "slender", "small"],
)
def test_integrals_over_two_cells_are_brute_forces(first, second, error):
    integrals, expected = integrals_of(first, second), brute_force(first, second)
    size, abs_coupling = expected["xx"] + expected["yy"], abs(expected["along"]) + abs(expected["across"])
    along, across = integrals.coupling
    got = {"xx": integrals.xx, "xy": integrals.xy, "yy": integrals.yy, "along": along, "across": across}
    for name, matrix in got.items():
        allowed = error * (size if name in ("xx", "xy", "yy") else abs_coupling)
        assert matrix[0, 1] == pytest.approx(expected[name], abs=allowed), name


@pytest.mark.parametrize("width", [0.3, 0.1, 0.01])
def test_coupling_of_strips_side_by_side(width):
    """To the integral over the offsets (x, y) of points of two strips, of which y runs from 0 to twice their width."""

    def over_x(y: float) -> float:
        """Integral of (1 - |x|) y / (x^2 + y^2) over x in (-1, 1)."""
        return 2.0 * math.atan(1.0 / y) - y * math.log1p(1.0 / y**2)

    expected = quad(lambda y: (width - abs(y - width)) * over_x(y), 0.0, 2 * width, points=[width])[0]
    strips = integrals_of(box(0, width, 1, 2 * width), box(0, 0, 1, width))
    assert strips.coupling[1][0, 1] == pytest.approx(expected, rel=0.02)
    assert strips.coupling[0][0, 1] == pytest.approx(0.0, abs=1e-12)


def test_a_square_on_itself_is_loves():
    """Mean of 1/r over pairs of points of a unit square: 4 [asinh 1 - (sqrt 2 - 1) / 3] (Love 1929)."""
    integrals = integrals_of(SQUARE)
    expected = 4 * (math.asinh(1.0) - (math.sqrt(2) - 1) / 3)
    assert integrals.inverse_distance[0, 0] == pytest.approx(expected, rel=2e-3)
    assert integrals.xx[0, 0] == pytest.approx(expected / 2, rel=2e-3)
    assert integrals.xy[0, 0] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(integrals.coupling, 0.0, atol=1e-12)


@pytest.mark.parametrize("stretch", [0.02, 0.3, 5.0])
def test_a_rectangle_on_itself_is_its_parts_on_each_other(stretch):
    """Cutting a cell changes no integral over it."""
    whole = affinity.scale(SQUARE, stretch, 1.0, origin=(0, 0))
    left, right = box(0, 0, 0.3 * stretch, 1.0), box(0.3 * stretch, 0, stretch, 1.0)
    cut, uncut = integrals_of(left, right), integrals_of(whole)
    for name in ("xx", "xy", "yy"):
        assert getattr(cut, name).sum() == pytest.approx(
            getattr(uncut, name)[0, 0], rel=3e-3, abs=3e-3 * uncut.inverse_distance[0, 0]
        )


def test_coupling_of_neighbours_is_additive():
    pieces = [box(0, 0, 0.5, 1), box(0.5, 0, 1, 1)]
    other = box(1, 0.2, 1.4, 0.9)
    cut, uncut = integrals_of(other, *pieces), integrals_of(other, SQUARE)
    for one, whole in zip(cut.coupling, uncut.coupling, strict=True):
        assert one[0, 1:].sum() == pytest.approx(whole[0, 1], rel=5e-3, abs=1e-3)


def test_matrices_have_their_symmetry():
    cells = face_cells(TRIANGLE, 80)
    assert cells is not None
    integrals = HalfSpaceIntegrals(cells.edges, cells.sides)
    for name in ("xx", "xy", "yy"):
        np.testing.assert_array_equal(getattr(integrals, name), getattr(integrals, name).T)
    for one in integrals.coupling:
        np.testing.assert_allclose(one, -one.T, atol=1e-14 * np.abs(one).max())


@pytest.mark.parametrize("count", [10, 100, 500])
@pytest.mark.parametrize(
    "shape", [TRIANGLE, HOOK, affinity.scale(SQUARE, 20.0, 1.0)], ids=["triangle", "hook", "strip"]
)
def test_mean_distances_are_positive_definite(shape, count):
    cells = face_cells(shape, count)
    assert cells is not None
    matrix = cells.inverse_distance / np.outer(cells.areas, cells.areas)
    values = np.linalg.eigvalsh(matrix)
    assert values[0] > 1e-3 * np.diagonal(matrix).min()


@pytest.mark.parametrize("shape", [TRIANGLE, HOOK, affinity.scale(SQUARE, 20.0, 1.0)])
def test_the_core_has_the_same_integrals(shape):
    """To rounding of sums over some hundred edges."""
    cells = face_cells(affinity.affine_transform(shape, [1.0, 0.137, 0.0, 0.871, 0.0, 0.0]), 60)
    assert cells is not None
    expected, found = HalfSpaceIntegrals(cells.edges, cells.sides), half_space(cells.edges, cells.sides, cells.count)
    size = np.abs(expected.inverse_distance).max()
    own = expected.inverse_distance, expected.xx, expected.xy, expected.yy, *expected.coupling
    np.testing.assert_allclose(found, np.stack(own), rtol=0.0, atol=1e-9 * size)
