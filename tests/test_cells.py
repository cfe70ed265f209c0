"""Contact cells: they fill any outline exactly, and what they carry reaches the nodes exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Point, Polygon, affinity, box

from mjtactile.cells import Area, Cells
from mjtactile.indenter import INDENTER_NAMES, indenter_outline
from mjtactile.influence import InfluenceMatrices
from mjtactile.pad import Pad
from mjtactile.partition import Lattice, outline_cells, stretched_cells
from mjtactile.planar import areal, triangulate
from mjtactile.preset import Fidelity
from mjtactile.surface import SurfaceGrid

SURFACE: SurfaceGrid = InfluenceMatrices(Pad(), Fidelity(mesh="draft"), {}).surface
STAR = indenter_outline("star")
DOUGHNUT = Point(0, 0).buffer(4e-3).difference(Point(1e-3, 0).buffer(2e-3))
TWO = MultiPolygon([box(-5e-3, -1e-3, -2e-3, 1e-3), Point(3e-3, 0).buffer(1.5e-3)])
NEEDLE = box(-5e-3, -20e-6, 5e-3, 20e-6)
NOTCHED = box(-3e-3, -3e-3, 3e-3, 3e-3).difference(box(-50e-6, -1e-3, 50e-6, 4e-3))
SHAPES = {"star": STAR, "doughnut": DOUGHNUT, "two bodies": TWO, "needle": NEEDLE, "notched": NOTCHED}
#: Outlines lie on a grid of this fraction of their size.
EXACT = 1e-9


def polygons(cells: Cells) -> list[Polygon]:
    """Each cell as a polygon, drawn from its outline."""
    drawn = [cells.outline(np.arange(cells.count) == k) for k in range(cells.count)]
    return [one for one in drawn if isinstance(one, Polygon)]


def assert_fills(cells: Cells, outline: Polygon | MultiPolygon) -> None:
    size = math.sqrt(outline.area)
    assert cells.areas.min() > 0.0
    assert cells.areas.sum() == pytest.approx(outline.area, rel=EXACT)
    centroid = cells.areas @ cells.centroids / cells.areas.sum()
    np.testing.assert_allclose(centroid, [outline.centroid.x, outline.centroid.y], atol=EXACT * size)
    whole = cells.outline(np.ones(cells.count, dtype=bool))
    # As much area as all cells together: none overlaps another. Drawing rounds to a ten-millionth of a cell.
    assert whole.symmetric_difference(outline).area <= 1e-5 * outline.area


@pytest.mark.parametrize("count", [1, 2, 7, 60, 200, 900])
@pytest.mark.parametrize("name", SHAPES)
def test_cells_fill_the_outline(name, count):
    outline = affinity.rotate(affinity.translate(SHAPES[name], 0.7e-3, -1.1e-3), 23)
    cells = outline_cells(outline, count)
    assert_fills(cells, outline)
    if name in ("star", "doughnut") and count >= 60:
        assert 0.6 * count <= cells.count <= 1.6 * count


@settings(max_examples=40, deadline=None)
@given(
    corners=st.lists(st.tuples(st.floats(0.3, 1.0), st.floats(0.05, 1.0)), min_size=3, max_size=14),
    hole=st.floats(0.0, 0.25),
    count=st.integers(1, 300),
    scale=st.floats(-6, 0),
)
@example(corners=[(0.875, 0.96875), (0.4765625, 0.390625), (0.875, 0.875)], hole=0.0, count=272, scale=-1.0)
def test_cells_fill_any_outline(corners, hole, count, scale):
    """Star-shaped polygons with a hole, micrometres to metres across."""
    steps = np.cumsum([step for _, step in corners])
    angles = 2 * math.pi * steps / steps[-1]
    radii = np.array([radius for radius, _ in corners])
    outline: Area = areal(Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])).buffer(0.0))
    outline = areal(outline.difference(Point(0.02, 0.03).buffer(hole))) if hole > 0.01 else outline
    outline = areal(affinity.scale(outline, 10.0**scale, 10.0**scale, origin=(0, 0)))
    if outline.area > 1e-3 * 10.0 ** (2 * scale):
        assert_fills(outline_cells(outline, count), outline)


def test_slivers_join_their_neighbours():
    for name in INDENTER_NAMES:
        cells = outline_cells(affinity.rotate(indenter_outline(name), 11), 200)
        # Pieces of the ring are a tenth of a square: what is far smaller than these is a sliver.
        assert cells.areas.min() >= 0.02 * cells.areas.max(), name


def test_cells_are_narrow_along_the_outline():
    cells = outline_cells(Point(0, 0).buffer(3e-3), 200)
    distance = 3e-3 - np.linalg.norm(cells.centroids, axis=1)
    rim = distance < 0.05e-3
    assert rim.sum() >= 30
    assert cells.areas[rim].mean() < 0.3 * cells.areas[~rim].mean()


@pytest.mark.parametrize("turn", [0.0, 90.0, 33.3, -171.0])
def test_a_moved_punch_shares_its_cells(turn):
    here = outline_cells(STAR, 150)
    moved = affinity.translate(affinity.rotate(STAR, turn, origin=(0, 0)), 1.7e-3, -2.3e-3)
    there = outline_cells(moved, 150)
    assert there.shape is here.shape
    turned = np.array(affinity.rotate(shapely.MultiPoint(here.centroids), turn, origin=(0, 0)).geoms)
    places = shapely.get_coordinates(turned) + np.array([1.7e-3, -2.3e-3])
    np.testing.assert_allclose(there.centroids, places, atol=1e-12)
    np.testing.assert_allclose(there.half_space.inverse_distance, here.half_space.inverse_distance, rtol=1e-9)
    assert_fills(there, moved)


def test_other_counts_and_other_shapes_share_nothing():
    assert outline_cells(STAR, 100).shape is not outline_cells(STAR, 101).shape
    assert outline_cells(affinity.scale(STAR, 1.001, 1.0), 100).shape is not outline_cells(STAR, 100).shape


def test_quadrature_integrates_quadratic_functions():
    cells = outline_cells(affinity.rotate(STAR, 5), 60)
    x, y = np.moveaxis(cells.quadrature - cells.centroids[:, None], -1, 0)
    drawn = polygons(cells)
    assert len(drawn) == cells.count
    for k, cell in enumerate(drawn):
        corners, triangles = triangulate(cell)
        moments = np.zeros(3)
        for one in corners[triangles] - cells.centroids[k]:
            middles = (one + np.roll(one, 1, axis=0)) / 2  # exact to second degree
            products = [middles[:, 0] ** 2, middles[:, 0] * middles[:, 1], middles[:, 1] ** 2]
            moments += Polygon(one).area * np.array([product.mean() for product in products])
        got = np.array([(x[k] ** 2).mean(), (x[k] * y[k]).mean(), (y[k] ** 2).mean()])
        np.testing.assert_allclose(got, moments / cell.area, atol=1e-4 * (moments[0] + moments[2]) / cell.area)
    np.testing.assert_allclose(x.mean(axis=1), 0.0, atol=1e-12)


@pytest.mark.parametrize(("angle", "stretch"), [(0.0, 4.0), (0.7, 8.0), (-1.2, 2.0)])
def test_stretched_cells_fill_the_outline_and_are_long(angle, stretch):
    strip = affinity.rotate(box(-4e-3, -0.6e-3, 4e-3, 0.6e-3), angle, origin=(0, 0), use_radians=True)
    cells = stretched_cells(strip, 120, angle, stretch)
    assert_fills(cells, strip)
    largest = cells.areas.argmax()
    along = np.array([math.cos(angle), math.sin(angle)])
    offset = cells.quadrature[largest] - cells.centroids[largest]
    assert np.ptp(offset @ along) > 0.6 * stretch * np.ptp(offset @ [-along[1], along[0]])


def test_lattice_is_rows_and_columns():
    cells = Lattice((1e-3, 2e-3), 0.3, 0.4e-3, 6, 5, 2.0).cells
    rectangle = affinity.rotate(box(-1.2e-3, -0.5e-3, 1.2e-3, 0.5e-3), 0.3, origin=(0, 0), use_radians=True)
    assert cells.count == 30
    np.testing.assert_allclose(cells.areas, 0.4e-3 * 0.2e-3, rtol=1e-12)
    assert_fills(cells, affinity.translate(rectangle, 1e-3, 2e-3))


@pytest.mark.parametrize("name", SHAPES)
def test_nodal_forces_of_a_constant_traction_are_the_outlines(name):
    outline = affinity.translate(SHAPES[name], 0.3e-3, 0.4e-3)
    cells = outline_cells(outline, 120)
    traction = np.array([300.0, -200.0, -1000.0])
    nodal = cells.nodal_forces(SURFACE, cells.areas[:, None] * traction)
    expected = SURFACE.nodal_integrals(outline)[0][..., None] * traction
    np.testing.assert_allclose(nodal, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("shift", [(0.0, 0.0), (5.5e-3, 0.0), (6e-3, -6.2e-3)], ids=str)
@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_resultants_reach_the_nodes_to_rounding(name, shift):
    """Random forces on cells, over the sheet's edge too: force and moment are those of the nodes."""
    outline = indenter_outline(name, shift=shift, rotate_deg=77).intersection(SURFACE.sheet)
    cells = outline_cells(areal(outline), 150)
    forces = np.random.default_rng(1).uniform(0.1, 1.0, (cells.count, 3))
    nodal = cells.nodal_forces(SURFACE, forces)
    np.testing.assert_allclose(nodal.sum(axis=(0, 1)), forces.sum(axis=0), rtol=1e-10)
    x, y = np.meshgrid(SURFACE.x.nodes, SURFACE.y.nodes)
    for component in range(3):
        got = [(x * nodal[..., component]).sum(), (y * nodal[..., component]).sum()]
        size = 7.5e-3 * forces[:, component].sum()
        np.testing.assert_allclose(got, forces[:, component] @ cells.centroids, atol=1e-10 * size)


def test_outline_of_no_cells_is_empty():
    assert outline_cells(STAR, 50).outline(np.zeros(outline_cells(STAR, 50).count, dtype=bool)).is_empty
