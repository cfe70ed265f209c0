"""The linear pressure that never pulls: where it acts, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Point, Polygon, affinity, box

from mjtactile.footprint import Footprint
from mjtactile.line import Line
from mjtactile.pressure import LinearPressure, linear_pressure
from mjtactile.surface import SurfaceGrid

GRID = SurfaceGrid(Line(np.linspace(-10e-3, 10e-3, 5)), Line(np.linspace(-10e-3, 10e-3, 5)))
SIDE = 6e-3
SQUARE = Footprint(box(-SIDE / 2, -SIDE / 2, SIDE / 2, SIDE / 2), GRID)


def pressed(footprint: Footprint, through: tuple[float, float], force: float = 1.0) -> LinearPressure:
    return linear_pressure(footprint, force, (force * through[0], force * through[1]))


def test_force_at_the_middle_keeps_the_whole_footprint():
    assert pressed(SQUARE, (0.0, 0.0)).contact is SQUARE.outline


@pytest.mark.parametrize("share", [0.02, 0.1, 1 / 6 - 1e-9])
def test_force_within_the_core_keeps_the_whole_footprint(share):
    """The core of a rectangle reaches a sixth of its side from its middle."""
    assert pressed(SQUARE, (share * SIDE, 0.0)).contact is SQUARE.outline


@pytest.mark.parametrize("share", [0.17, 0.2, 0.3, 0.4, 0.49])
@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_force_outside_the_core_stands_on_a_strip_three_times_its_distance_from_the_edge(share, turn):
    """A triangular pressure has its centre a third along, so the contact's length is 3 (1/2 - share) of the side."""
    x, y = affinity.rotate(Point(share * SIDE, 0), turn, origin=(0, 0)).coords[0]
    contact = pressed(SQUARE, (x, y)).contact
    length = 3 * (0.5 - share) * SIDE
    expected = affinity.rotate(box(SIDE / 2 - length, -SIDE / 2, SIDE / 2, SIDE / 2), turn, origin=(0, 0))
    # The contact's edge is found to 1e-9 of the side: Newton's iteration stops at forces right to 1e-10.
    assert contact.symmetric_difference(expected).area < 1e-9 * SIDE**2


def test_force_on_the_diagonal_stands_on_a_corner():
    """Three quarters of the way to the corner: a tetrahedron of pressure over a triangle, centre a quarter along."""
    share = 0.45
    contact = pressed(SQUARE, (share * SIDE, share * SIDE)).contact
    # The centre of max(0, l - a - b) over the corner's quadrant stands at l / 4 on each side.
    leg = 4 * (0.5 - share) * SIDE
    corner = SIDE / 2
    expected = Polygon([(corner, corner), (corner - leg, corner), (corner, corner - leg)])
    assert contact.symmetric_difference(expected).area < 1e-9 * SIDE**2


def test_contact_does_not_depend_on_the_force_or_the_place():
    contact = pressed(SQUARE, (0.35 * SIDE, 0.1 * SIDE)).contact
    tiny = pressed(SQUARE, (0.35 * SIDE, 0.1 * SIDE), 1e-12).contact
    assert tiny.symmetric_difference(contact).area < 1e-9 * SIDE**2
    moved = Footprint(affinity.translate(SQUARE.outline, 2e-3, -1e-3), GRID)
    there = pressed(moved, (0.35 * SIDE + 2e-3, 0.1 * SIDE - 1e-3)).contact
    assert affinity.translate(there, -2e-3, 1e-3).symmetric_difference(contact).area < 1e-9 * SIDE**2


def test_two_feet_share_a_force_between_them():
    """A force between two feet loads both, by the lever."""
    feet = Footprint(MultiPolygon([box(-5e-3, -1e-3, -4e-3, 1e-3), box(4e-3, -1e-3, 5e-3, 1e-3)]), GRID)
    assert pressed(feet, (2e-3, 0.0)).contact is feet.outline
    only_right = pressed(feet, (4.7e-3, 0.0)).contact
    assert only_right.bounds[0] > 0


def test_force_in_a_hole_is_carried_by_the_ring():
    ring = Polygon(Point(0, 0).buffer(5e-3).exterior, [Point(0, 0).buffer(4e-3).exterior])
    footprint = Footprint(ring, GRID)
    assert pressed(footprint, (0.0, 0.0)).contact is ring
    tilted = pressed(footprint, (3.5e-3, 0.0))
    assert 0 < tilted.contact.area < ring.area
    np.testing.assert_array_equal(tilted.first_moments, [1.0, 3.5e-3, 0.0])


@pytest.mark.parametrize("through", [(0.7 * SIDE, 0.0), (0.0, -4 * SIDE), (SIDE, SIDE)])
def test_force_outside_the_hull_moves_to_the_nearest_place_inside(through):
    moments = pressed(SQUARE, through).first_moments
    edge = (0.5 - 1e-3) * SIDE
    np.testing.assert_allclose(moments, [1.0, *np.clip(through, -edge, edge)], rtol=1e-9)


inside = st.floats(-0.49, 0.49)


@settings(max_examples=60, deadline=None)
@given(x=inside, y=inside, turn=st.floats(0, 360))
def test_clipped_pressure_has_the_forces_it_was_asked_for(x, y, turn):
    """Integrate max(0, c0 + c1 x + c2 y) over the contact, c from its own zero line: force and moments come out."""
    footprint = Footprint(affinity.rotate(SQUARE.outline, turn, origin=(0, 0)), GRID)
    point = affinity.rotate(Point(x * SIDE, y * SIDE), turn, origin=(0, 0))
    through = point.x, point.y
    contact = pressed(footprint, through).contact
    coefficients, positions, weights = fitted_pressure(contact, through)
    pressure = coefficients[0] + positions @ coefficients[1:]
    # Rounding, and 1e-10 of where Newton's iteration stops, on a contact that may be a sliver.
    assert pressure.min() > -1e-6 * pressure.max()
    outside = footprint.outline.difference(contact).buffer(-1e-6 * SIDE)
    if not outside.is_empty:
        corner = np.array(outside.representative_point().coords[0])
        assert coefficients[0] + corner @ coefficients[1:] <= 1e-6 * pressure.max()
    assert weights @ pressure == pytest.approx(1.0, rel=1e-9)


def fitted_pressure(contact, through) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients of the linear pressure with force 1 through a point over the contact, its corners, their weights.

    A triangle's linear functions integrate exactly at its edge middles; their products too, being quadratic.
    """
    from mjtactile.planar import polygons_of, triangulate

    middles, weights = [], []
    corners_of_all = []
    for polygon in polygons_of(contact):
        corners, triangles = triangulate(polygon)
        for a, b, c in corners[triangles]:
            area = abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]) / 2
            middles += [(a + b) / 2, (b + c) / 2, (c + a) / 2]
            weights += [area / 3] * 3
            corners_of_all += [a, b, c]
    points, w = np.array(middles), np.array(weights)
    basis = np.column_stack([np.ones(len(points)), points])
    coefficients = np.linalg.solve(basis.T @ (w[:, None] * basis), [1.0, *through])
    # Corners have the extreme pressures; each triangle's corners share its area as well.
    return coefficients, np.array(corners_of_all), w
