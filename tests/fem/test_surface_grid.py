"""Integrals over the surface grid: exact for any polygon, wherever its edges run."""

from __future__ import annotations

import nodal_integrals as reference
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Polygon, affinity, box

from mjtactile.fem.line import Line
from mjtactile.fem.surface_grid import SurfaceGrid, oriented_edges
from mjtactile.geometry.planar import areal

GRID = SurfaceGrid(
    Line(np.array([-4.0, -2.5, 0.0, 2.5, 4.0]) * 1e-3), Line(np.array([-3.0, -1.0, 1.0, 3.0]) * 1e-3), 5e-3
)
#: Rounding, as a fraction of the sheet's area (and of its moments).
ROUNDING = 1e-14 * 48e-6


def star_polygon(radii: list[float], centre: tuple[float, float], turn: float = 0.0) -> Polygon:
    """A polygon whose corners stand at equal angles at the given distances [m]; never self-crossing."""
    angles = turn + 2 * np.pi * np.arange(len(radii)) / len(radii)
    return Polygon(np.array(centre) + np.array(radii)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


WITH_A_HOLE = Polygon(
    star_polygon([2e-3] * 7, (0.3e-3, 0.2e-3)).exterior, [star_polygon([0.9e-3] * 5, (0.4e-3, 0)).exterior]
)
REGIONS = {
    "inside one cell": star_polygon([0.4e-3, 0.6e-3, 0.5e-3], (1.2e-3, 0.1e-3)),
    "a hole": WITH_A_HOLE,
    "two parts": MultiPolygon([box(-3e-3, -2e-3, -1e-3, 0.5e-3), star_polygon([1e-3] * 6, (2e-3, 1e-3))]),
    "an island in a hole": areal(WITH_A_HOLE.union(star_polygon([0.3e-3] * 4, (0.4e-3, 0)))),
    "edges on grid lines": box(-2.5e-3, -1e-3, 2.5e-3, 1e-3),
    "corner on a node": Polygon([(0, 0), (2.5e-3, 1e-3), (0, 1e-3), (-1e-3, 2e-3)]),
    "clockwise": Polygon(list(star_polygon([1e-3] * 5, (0, 0)).exterior.coords)[::-1]),
    "the whole sheet": GRID.sheet,
    "over every edge": star_polygon([7e-3, 3e-3, 5e-3, 6e-3, 4e-3], (0.5e-3, 0.2e-3)),
    "past one corner": box(3e-3, 2e-3, 9e-3, 8e-3),
    "a sliver": Polygon([(-3.9e-3, -2.9e-3), (3.9e-3, 2.9e-3), (3.9e-3, 2.9e-3 + 1e-9)]),
}


@pytest.mark.parametrize("name", REGIONS)
def test_integrals_are_those_of_a_triangulation(name):
    region = REGIONS[name]
    integrals = GRID.nodal_integrals(region)
    expected = reference.nodal_integrals(GRID, region)
    np.testing.assert_allclose(integrals[0], expected[0], atol=ROUNDING)
    np.testing.assert_allclose(integrals[1:], expected[1:], atol=ROUNDING * 4e-3)


@pytest.mark.parametrize("name", REGIONS)
def test_sums_over_nodes_are_area_and_first_moments(name):
    covered = areal(REGIONS[name].intersection(GRID.sheet))
    area, first_x, first_y = GRID.nodal_integrals(REGIONS[name]).sum(axis=(1, 2))
    assert area == pytest.approx(covered.area, rel=1e-12, abs=ROUNDING)
    assert first_x == pytest.approx(covered.area * covered.centroid.x, rel=1e-12, abs=ROUNDING * 4e-3)
    assert first_y == pytest.approx(covered.area * covered.centroid.y, rel=1e-12, abs=ROUNDING * 4e-3)


def test_forces_of_a_unit_traction_have_its_moment_about_every_point():
    """Nodes at their places reproduce linear functions, so nodal forces have the traction's own moment."""
    integrals = GRID.nodal_integrals(WITH_A_HOLE)
    assert integrals[0].sum(axis=0) @ GRID.x.nodes == pytest.approx(integrals[1].sum(), rel=1e-12)
    assert integrals[0].sum(axis=1) @ GRID.y.nodes == pytest.approx(integrals[2].sum(), rel=1e-12)


def test_region_off_the_sheet_has_no_integrals():
    for place in ((9e-3, 0), (-9e-3, 0), (0, 9e-3), (0, -9e-3)):
        region = star_polygon([1e-3] * 5, place)
        np.testing.assert_allclose(GRID.nodal_integrals(region), 0, atol=ROUNDING)


def test_empty_region_has_no_integrals():
    assert not GRID.nodal_integrals(Polygon()).any()
    assert oriented_edges(Polygon()).shape == (0, 2, 2)


radii = st.lists(st.floats(0.1e-3, 6e-3), min_size=3, max_size=9)
centres = st.tuples(st.floats(-4e-3, 4e-3), st.floats(-3e-3, 3e-3))


@settings(max_examples=60, deadline=None)
@given(radii=radii, centre=centres, turn=st.floats(0, 7))
def test_random_polygons_have_their_own_area_and_moments(radii, centre, turn):
    region = star_polygon(radii, centre, turn)
    assume(region.is_valid)
    covered = region.intersection(GRID.sheet)
    integrals = GRID.nodal_integrals(region).sum(axis=(1, 2))
    centroid = covered.centroid.coords[0] if covered.area else (0.0, 0.0)
    # Moments in units of the half width, so that one tolerance does: rounding of a region that may reach as far off
    # the sheet as the sheet is wide.
    in_half_widths = integrals / (1.0, 4e-3, 4e-3)
    expected = covered.area * np.array([1.0, centroid[0] / 4e-3, centroid[1] / 4e-3])
    np.testing.assert_allclose(in_half_widths, expected, rtol=0, atol=1e-12 * 48e-6)


@settings(max_examples=60, deadline=None)
@given(radii=radii, centre=centres, turn=st.floats(0, 7), cut=st.floats(0, 7), through=centres)
def test_a_polygon_cut_in_two_has_the_integrals_of_its_parts(radii, centre, turn, cut, through):
    region = star_polygon(radii, centre, turn)
    assume(region.is_valid)
    half_plane = affinity.translate(affinity.rotate(box(-1, 0, 1, 1), cut, origin=(0, 0), use_radians=True), *through)
    parts = [areal(region.intersection(half_plane)), areal(region.difference(half_plane))]
    total = sum(GRID.nodal_integrals(part) for part in parts)
    whole = GRID.nodal_integrals(region)
    # Rounding, and that of shapely's cut.
    np.testing.assert_allclose(total, whole, atol=1e-11 * np.abs(whole).max() + ROUNDING)


def test_mirrored_region_has_mirrored_integrals():
    integrals = GRID.nodal_integrals(WITH_A_HOLE)
    mirrored = GRID.nodal_integrals(shapely.transform(WITH_A_HOLE, lambda points: points * (-1, 1)))
    expected = np.flip(integrals, axis=2) * np.array([1, -1, 1])[:, None, None]
    np.testing.assert_allclose(mirrored, expected, atol=ROUNDING)
    assert np.abs(mirrored - integrals).max() > 1e-3 * integrals.max()
