"""Recovered point values: exact where they can be, and never across a jump."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from mjtactile.fem.line import Line
from mjtactile.fem.stress_recovery import gauss_weights, point_rows

LINE = Line(np.array([-2.0, -1.4, -0.6, 0.0, 0.6, 1.4, 2.0]))
POSITIONS = np.array([-2.0, -1.93, -1.4, -0.71, 0.0, 0.05, 0.8, 1.4, 1.99, 2.0])
QUADRATIC = Polynomial([0.2, -1.0, 0.6])


def test_values_of_quadratics_are_exact():
    rows = point_rows(LINE, POSITIONS)[0]
    np.testing.assert_allclose(rows @ QUADRATIC(LINE.nodes), QUADRATIC(POSITIONS), atol=1e-14)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_slopes_of_polynomials_up_to_cubics_are_exact(degree):
    """Elements are quadratic, yet at Gauss points they hold a cubic's slope."""
    function = Polynomial([0.2, -1.0, 0.6, 0.4][: degree + 1])
    rows = point_rows(LINE, POSITIONS)[1]
    np.testing.assert_allclose(rows @ function(LINE.nodes), function.deriv()(POSITIONS), atol=1e-13)


def test_slopes_of_quartics_are_not_exact():
    """So the test above says something about cubics."""
    function = Polynomial([0, 0, 0, 0, 1.0])
    rows = point_rows(LINE, POSITIONS)[1]
    assert np.abs(rows @ function(LINE.nodes) - function.deriv()(POSITIONS)).max() > 1e-3


def test_interpolation_between_gauss_points_is_cubic():
    cubic = Polynomial([0.3, 1.0, -0.7, 0.5])
    middles = (LINE.vertices[1:] + LINE.vertices[:-1]) / 2
    gauss = (middles[:, None] + LINE.sizes[:, None] / 2 * np.array([-1, 1]) / np.sqrt(3)).ravel()
    weights = gauss_weights(LINE, POSITIONS)
    np.testing.assert_allclose(weights @ cubic(gauss), cubic(POSITIONS), atol=1e-13)


def kinked(positions: np.ndarray) -> np.ndarray:
    """Continuous, with slopes 1 and 5 on either side of 0."""
    return np.where(positions < 0, positions, 5 * positions)


def test_nothing_is_interpolated_across_a_jump():
    inside = np.array([-2.0, -0.6, -0.01, 0.01, 0.6, 2.0])
    expected = np.where(inside < 0, 1.0, 5.0)
    with_jump = point_rows(LINE, inside, (3,))[1] @ kinked(LINE.nodes)
    np.testing.assert_allclose(with_jump, expected, atol=1e-13)
    without = point_rows(LINE, inside)[1] @ kinked(LINE.nodes)
    assert np.abs(without - expected).max() > 0.5


@pytest.mark.parametrize("jumps", [(1, 2), (1, 2, 3, 4, 5)])
def test_thin_parts_between_jumps_use_their_own_points_only(jumps):
    positions = np.array([-1.9, -1.0, -0.3, 1.9])
    rows = point_rows(LINE, positions, jumps)[1]
    ends = [0, *jumps, LINE.element_count]
    for row, element in zip(rows, LINE.locate(positions)[0], strict=True):
        part = np.searchsorted(ends, element, side="right") - 1
        used = np.flatnonzero(row)
        assert used.min() >= 2 * ends[part]
        assert used.max() <= 2 * ends[part + 1]
    np.testing.assert_allclose(rows @ QUADRATIC(LINE.nodes), QUADRATIC.deriv()(positions), atol=1e-13)
