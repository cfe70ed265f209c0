"""Integrals of 1/r over lattice cells, against quadrature and against the polygons' own integrals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad

from mjtactile.half_space import HalfSpaceIntegrals
from mjtactile.lattice import FAR, inverse_distance_by_offset
from mjtactile.partition import Lattice


@pytest.mark.parametrize(("width", "height"), [(1.0, 1.0), (1.0, 0.125), (0.3, 0.7)])
def test_equals_quadrature_over_the_difference_of_two_points(width: float, height: float) -> None:
    table = inverse_distance_by_offset(6, 4, width, height)
    for column, row in ((1, 0), (0, 1), (2, 3), (5, 1)):
        x, y = column * width, row * height

        def density(v: float, u: float, x: float = x, y: float = y) -> float:
            return (width - abs(u)) * (height - abs(v)) / np.hypot(x + u, y + v)

        parts = [(-width, 0.0), (0.0, width)], [(-height, 0.0), (0.0, height)]
        expected = sum(
            dblquad(density, *along, *across, epsabs=1e-9, epsrel=1e-7)[0] for along in parts[0] for across in parts[1]
        )
        assert table[row, column] == pytest.approx(expected, rel=1e-6)


def test_of_a_square_with_itself() -> None:
    # The mean of 1/r over pairs of points of a unit square, as in estimates of a square plate's capacitance.
    expected = 4 * np.arcsinh(1.0) - 4 / 3 * (np.sqrt(2.0) - 1.0)
    assert inverse_distance_by_offset(1, 1, 1.0, 1.0)[0, 0] == pytest.approx(expected, rel=1e-14)


def test_far_series_meets_the_closed_form() -> None:
    columns = int(FAR) + 4
    table = inverse_distance_by_offset(columns, 2, 1.0, 0.25)
    distance = np.hypot(np.arange(columns), 0.25)
    scaled = table[1] * distance / 0.25**2
    assert np.abs(np.diff(scaled[int(FAR) - 2 :])).max() < 2e-4
    assert (np.diff(scaled[int(FAR) - 2 :]) < 0.0).all()  # towards 1 from above, without a step


@pytest.mark.parametrize("stretch", [1.0, 4.0])
def test_lattice_cells_have_these_integrals(stretch: float) -> None:
    cells = Lattice((1e-3, 2e-3), 0.4, 2e-4, 7, 5, stretch).cells
    polygons = HalfSpaceIntegrals(cells.edges, cells.owner).inverse_distance
    assert cells.half_space.inverse_distance == pytest.approx(polygons, rel=1e-2)
    assert cells.half_space.inverse_distance[0, -1] == pytest.approx(polygons[0, -1], rel=1e-4)
