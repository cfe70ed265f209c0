"""Regions below a level: where their boundary runs, whatever the function."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity, box

from mjtactile.geometry.contour import region_below
from mjtactile.geometry.indenter import indenter_outline

BOUNDS = (-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)


@pytest.mark.parametrize(
    ("radius", "centre"),
    # The last is narrower than a grid cell of the whole, and found because the grid has a point in its middle.
    [(3e-3, (0.0, 0.0)), (3e-3, (1.234e-3, -4.1e-3)), (0.2e-3, (1.234e-3, -4.1e-3)), (20e-6, (0.0, 0.0))],
)
def test_level_of_a_sphere_is_a_disc(radius, centre):
    region = region_below(lambda x, y: (x - centre[0]) ** 2 + (y - centre[1]) ** 2, radius**2, BOUNDS)
    assert region.area == pytest.approx(math.pi * radius**2, rel=2e-3)
    assert (region.centroid.x, region.centroid.y) == pytest.approx(centre, abs=1e-3 * radius)


def test_disc_over_the_bounds_is_cut_there():
    region = region_below(lambda x, y: np.hypot(x - 7.5e-3, y), 2e-3, BOUNDS)
    assert region.area == pytest.approx(math.pi * 4e-6 / 2, rel=2e-3)
    assert region.bounds[2] == 7.5e-3


def test_everything_below_is_the_rectangle():
    region = region_below(lambda x, y: np.zeros_like(x), 0.0, BOUNDS)
    assert region.symmetric_difference(box(*BOUNDS)).area <= 1e-12 * box(*BOUNDS).area


def test_nothing_below_is_empty():
    assert region_below(lambda x, y: np.full_like(x, np.inf), 1.0, BOUNDS).is_empty


@pytest.mark.parametrize("turn", [0.0, 17.0])
@pytest.mark.parametrize("name", ["square", "star", "doughnut", "circle"])
def test_steps_lie_where_they_are(name, turn):
    """A punch's face as a function that is 0 inside and infinite outside."""
    outline = indenter_outline(name, shift=(0.8e-3, 0.3e-3), rotate_deg=turn)
    shapely.prepare(outline)
    region = region_below(lambda x, y: np.where(shapely.intersects_xy(outline, x, y), 0.0, np.inf), 1e-6, BOUNDS)
    # Between grid lines the boundary is straight: corners are cut by less than a grid cell.
    assert region.symmetric_difference(outline).area <= 0.01 * outline.area
    assert region.hausdorff_distance(outline) <= 0.2e-3
    assert sum(len(p.interiors) for p in getattr(region, "geoms", [region])) == (1 if name == "doughnut" else 0)


def test_axis_parallel_edges_are_exact():
    face = box(-3.3e-3, -1.7e-3, 2.1e-3, 0.9e-3)
    low_x, low_y, high_x, high_y = face.bounds

    def step(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where((x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y), 0.0, np.inf)

    region = region_below(step, 0.0, BOUNDS)
    np.testing.assert_allclose(region.bounds, face.bounds, atol=1e-10)


def test_a_needle_is_found_in_its_length():
    needle = affinity.rotate(box(-4e-3, -0.15e-3, 4e-3, 0.15e-3), 30, origin=(0, 0))
    along, across = np.array([math.cos(math.pi / 6), 0.5]), np.array([-0.5, math.cos(math.pi / 6)])

    def step(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        inside = (np.abs(along[0] * x + along[1] * y) <= 4e-3) & (np.abs(across[0] * x + across[1] * y) <= 0.15e-3)
        return np.where(inside, 0.0, np.inf)

    region = region_below(step, 0.0, BOUNDS)
    assert region.symmetric_difference(needle).area <= 0.1 * needle.area


def test_two_regions_are_both_found():
    def two(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.minimum(np.hypot(x - 4e-3, y), np.hypot(x + 4e-3, y - 1e-3))

    region = region_below(two, 1.5e-3, BOUNDS)
    assert len(getattr(region, "geoms", [])) == 2
    assert region.area == pytest.approx(2 * math.pi * 1.5e-3**2, rel=5e-3)
    assert not isinstance(region, Polygon)
