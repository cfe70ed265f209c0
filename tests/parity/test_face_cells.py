"""Contact cells made by the compiled core: they fill the outline, and their integrals are those of the reference."""

import math

import numpy as np
import pytest
import shapely
from core_cells import clip_outline, face_cells, read
from half_space import HalfSpaceIntegrals
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from nodal_integrals import nodal_integrals
from scipy.spatial import KDTree
from shapely import MultiLineString, MultiPolygon, Polygon, affinity

import mjtactile
from mjtactile.contact.cells.face_cells import placed_cells

PAD = mjtactile.Pad()
#: What sums of a few hundred areas cost in rounding.
EXACT = 1e-12
#: Edges that differ in length are integrated alike. Of equally long ones the core takes the mean of both ways, which
#: keeps mirrored cells mirrored, and the reference one of them: on a needle its three Gauss points are off by 3e-3.
SAME_INTEGRALS, ALMOST_SAME_INTEGRALS = 1e-8, 3e-3
SHEET = (-7.5e-3, -7.5e-3, 7.5e-3, 7.5e-3)


def regular(corners, radius, start=0.0):
    angles = start + 2 * math.pi * np.arange(corners) / corners
    return Polygon(radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def millimetres(*corners):
    return Polygon(1e-3 * np.array(corners))


SHAPES = {
    "circle": regular(64, 4e-3),
    "ellipse": affinity.scale(regular(64, 1e-3), 4.0, 0.5),
    "square": shapely.box(-4e-3, -4e-3, 4e-3, 4e-3),
    "star": mjtactile.indenter_outline("star", scale=0.8),
    "triangle": mjtactile.indenter_outline("triangle", scale=0.8),
    "doughnut": regular(64, 4e-3).difference(regular(48, 2e-3)),
    "octagon": regular(8, 3.5e-3),
    "level octagon": regular(8, 3.5e-3, math.pi / 8),
    "four arms": Polygon(regular(8, 1.0).exterior.coords[:-1] * np.tile([[3.0846e-3], [2.3518e-3]], (4, 1))),
    "slot": shapely.box(-0.5e-3, -5e-3, 0.5e-3, 5e-3),
    "angle": millimetres((0, 0), (5, 0), (5, 0.6), (0.6, 0.6), (0.6, 6), (0, 6)),
    "rounded": shapely.box(-3e-3, -3e-3, 3e-3, 3e-3).buffer(0.7e-3, quad_segs=8),
    "chamfered": shapely.box(-3e-3, -2e-3, 3e-3, 2e-3).buffer(0.05e-3, quad_segs=1),
    "small hole": shapely.box(-4e-3, -4e-3, 4e-3, 4e-3).difference(affinity.translate(regular(24, 0.3e-3), 9e-4, 4e-4)),
    "two pieces": MultiPolygon([regular(32, 1.5e-3), shapely.box(3e-3, 0.0, 5e-3, 2e-3)]),
    "comb": shapely.union_all(
        [shapely.box(k * 1e-3, 0, k * 1e-3 + 4e-4, 4e-3) for k in range(6)] + [shapely.box(0, -1e-3, 5.4e-3, 1e-5)]
    ),
    "needle": millimetres((0, 0), (8, 0.1), (0, 0.2)),
}
COUNTS = [6, 20, 60, 200, 800]


@pytest.fixture(scope="module")
def surface():
    return mjtactile.influence_matrices(PAD, fidelity="fast").surface


def made(outline, count, angle=0.0):
    cells = face_cells(outline, count, angle)
    assert cells is not None
    for array in (cells.centroids, cells.areas, cells.inverse_distance, cells.edges, cells.hull, cells.quadrature):
        assert np.isfinite(array).all()
    return cells


def own_edges(cells):
    """Edges of all cells, cell on the left, and their cells."""
    edges = np.concatenate([cells.edges, cells.edges[:, ::-1]])
    owner = np.concatenate([cells.sides[:, 0], cells.sides[:, 1]])
    return edges[owner >= 0], owner[owner >= 0].astype(np.int64)


def inverse_distance(cells):
    return HalfSpaceIntegrals(cells.edges, cells.sides).inverse_distance


def moments(cells):
    """Areas, centroids and second moments over the area of what the edges of each cell enclose."""
    edges, owner = own_edges(cells)
    (x0, y0), (x1, y1) = (edges - cells.centroids[owner][:, None]).transpose(1, 2, 0)
    cross = x0 * y1 - x1 * y0

    def summed(term):
        return np.bincount(owner, term * cross, cells.count)

    areas = summed(np.full(len(owner), 0.5))
    middle = np.column_stack([summed((x0 + x1) / 6), summed((y0 + y1) / 6)]) / areas[:, None] + cells.centroids
    xx, yy = summed((x0**2 + x0 * x1 + x1**2) / 12) / areas, summed((y0**2 + y0 * y1 + y1**2) / 12) / areas
    xy = summed((2 * x0 * y0 + x0 * y1 + x1 * y0 + 2 * x1 * y1) / 24) / areas
    return areas, middle, np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)


def polygons(cells):
    """What the edges of each cell enclose."""
    edges, owner = own_edges(cells)
    lines = [MultiLineString(list(edges[owner == k])) for k in range(cells.count)]
    return np.asarray(shapely.build_area(np.array(lines)))


def check_sums(outline, cells):
    assert cells.areas.min() > 0.0
    assert cells.areas.sum() == pytest.approx(outline.area, rel=EXACT)
    middle = cells.areas @ cells.centroids / cells.areas.sum()
    far = np.abs(outline.bounds).max()
    assert middle == pytest.approx([outline.centroid.x, outline.centroid.y], abs=1e3 * EXACT * far)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("count", COUNTS)
def test_cells_fill_the_outline(shape, count):
    outline = SHAPES[shape]
    cells = made(outline, count)
    check_sums(outline, cells)
    assert cells.length == pytest.approx(math.sqrt(outline.area), rel=EXACT)
    assert Polygon(cells.corners).symmetric_difference(outline.convex_hull).area <= 1e-9 * outline.area
    assert cells.convex == (outline.convex_hull.area <= (1 + 1e-6) * outline.area)
    if count <= 200:
        parts = polygons(cells)
        # Cells that lay over one another would enclose more than their share.
        np.testing.assert_allclose(shapely.area(parts), cells.areas, rtol=1e-6)
        assert shapely.union_all(parts).symmetric_difference(outline).area <= 1e-6 * outline.area


#: A comb's ring alone has more pieces than a few cells.
@pytest.mark.parametrize("shape", [name for name in SHAPES if name != "comb"])
@pytest.mark.parametrize("count", COUNTS)
def test_there_are_about_as_many_as_wanted(shape, count):
    """More on thin faces, up to 30, and on faces of several pieces, because each has its own rim."""
    outline = SHAPES[shape]
    slender = outline.length**2 / (16 * outline.area)
    wanted = math.sqrt(shapely.get_num_geometries(outline)) * max(count, min(count * slender / 3, 30))
    assert 0.8 * wanted <= made(SHAPES[shape], count).count <= 1.25 * wanted


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("count", [6, 20, 60, 200])
def test_integrals_are_those_of_the_reference(shape, count):
    cells = made(SHAPES[shape], count)
    areas, middle, own_inertia = moments(cells)
    np.testing.assert_allclose(cells.areas, areas, rtol=1e-9)
    np.testing.assert_allclose(cells.centroids, middle, atol=1e-12 * cells.length)
    expected = inverse_distance(cells)
    scale = np.sqrt(np.outer(np.diagonal(expected), np.diagonal(expected)))
    assert np.abs((cells.inverse_distance - expected) / scale).max() <= ALMOST_SAME_INTEGRALS
    np.testing.assert_array_equal(cells.inverse_distance, cells.inverse_distance.T)
    arms = cells.quadrature - cells.centroids[:, None]
    np.testing.assert_allclose(arms.sum(axis=1), 0.0, atol=1e-12 * cells.length)
    inertia = np.einsum("cka,ckb->cab", arms, arms) / 4
    np.testing.assert_allclose(inertia, own_inertia, atol=1e-9 * np.trace(inertia, axis1=1, axis2=2).max())


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("count", [6, 20, 60])
def test_integrals_of_lopsided_outlines_are_the_references_to_rounding(shape, count):
    cells = made(affinity.affine_transform(SHAPES[shape], [1.0, 0.137, 0.0, 0.871, 0.0, 0.0]), count)
    np.testing.assert_allclose(cells.inverse_distance, inverse_distance(cells), rtol=SAME_INTEGRALS)


@pytest.mark.parametrize("shape", SHAPES)
def test_uniform_pressure_gives_the_outlines_own_nodal_forces(shape, surface):
    cells = made(SHAPES[shape], 60)
    steps = cells.steps(np.ones((cells.count, 3)))
    expected = nodal_integrals(surface, SHAPES[shape])[0]
    found = surface.traction_forces(cells.edges, steps)[..., 0]
    np.testing.assert_allclose(found, expected, atol=EXACT * np.abs(expected).max())


MOVES = {
    "turned": [[0.0, -1.0], [1.0, 0.0]],
    "turned twice": [[-1.0, 0.0], [0.0, -1.0]],
    "mirrored": [[-1.0, 0.0], [0.0, 1.0]],
    "mirrored and turned": [[0.0, 1.0], [1.0, 0.0]],
}


def check_same_cells(cells, others, matrix, shift=(0.0, 0.0)):
    """Whether the second cells are the first ones moved, in whatever order."""
    assert cells.count == others.count
    apart, place = KDTree(others.centroids).query(cells.centroids @ np.transpose(matrix) + np.array(shift))
    assert apart.max() <= 1e-9 * cells.length
    assert len(np.unique(place)) == cells.count
    np.testing.assert_allclose(others.areas[place], cells.areas, rtol=1e-8)
    np.testing.assert_allclose(others.inverse_distance[np.ix_(place, place)], cells.inverse_distance, rtol=1e-8)


#: Of a comb's narrow teeth few cells leave strips that two neighbours have an equal claim to.
SYMMETRIC = [(shape, count) for shape in SHAPES for count in (20, 60, 200) if (shape, count) != ("comb", 20)]


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize(("shape", "count"), SYMMETRIC)
def test_a_turned_or_mirrored_outline_has_turned_or_mirrored_cells(shape, move, count):
    matrix = np.array(MOVES[move])
    moved = shapely.transform(SHAPES[shape], lambda points: points @ matrix.T)
    check_same_cells(made(SHAPES[shape], count), made(moved, count), matrix)


@pytest.mark.parametrize("shape", ["square", "star", "doughnut", "angle"])
def test_squares_lie_along_the_angle(shape):
    angle, shift = 0.7, (3e-3, -1e-3)
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c, -s], [s, c]])
    moved = shapely.transform(SHAPES[shape], lambda points: points @ matrix.T + shift)
    check_same_cells(made(SHAPES[shape], 60), made(moved, 60, angle), matrix, shift)


def test_corners_that_do_not_matter_are_left_out():
    outline = regular(3000, 4e-3)
    cells = made(outline, 60)
    assert len(cells.edges) < 700
    assert cells.areas.sum() == pytest.approx(outline.area, rel=2e-3)


def test_collinear_and_repeated_points_change_nothing():
    corners = shapely.get_coordinates(SHAPES["star"])[:-1]
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    more = Polygon(np.stack([corners, corners, middles], axis=1).reshape(-1, 2))
    plain, found = made(SHAPES["star"], 60), made(more, 60)
    check_same_cells(plain, found, np.eye(2))
    assert len(plain.edges) == len(found.edges)


@pytest.mark.parametrize(
    "outline",
    [
        Polygon(),
        millimetres((0, 0), (1, 0), (2, 0)),
        millimetres((0, 0), (1, 0), (1, 1e-13), (0, 1e-13)),
        millimetres((1, 1), (1, 1), (1, 1)),
        Polygon(np.zeros((4, 2))),
    ],
)
def test_outlines_without_area_have_no_cells(outline):
    assert face_cells(outline, 20) is None


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
def test_size_is_only_a_scale(size):
    small, large = made(SHAPES["star"], 60), made(affinity.scale(SHAPES["star"], size, size, origin=(0, 0)), 60)
    np.testing.assert_allclose(large.areas, size**2 * small.areas, rtol=1e-9)
    np.testing.assert_allclose(large.inverse_distance, size**3 * small.inverse_distance, rtol=1e-8)


@st.composite
def star_shaped(draw):
    count = draw(st.integers(3, 40))
    tenths = draw(st.lists(st.integers(0, 3599), min_size=count, max_size=count, unique=True))
    angles = np.deg2rad(0.1 * np.sort(tenths))
    radii = np.array(draw(st.lists(st.floats(0.02, 1.0), min_size=count, max_size=count)))
    outline = Polygon(6e-3 * radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))
    assume(outline.is_valid and outline.area > 1e-3 * outline.length**2 / (4 * math.pi))
    return outline


@st.composite
def convex(draw):
    points = draw(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=3, max_size=60, unique=True))
    outline = shapely.MultiPoint(points).convex_hull
    assume(isinstance(outline, Polygon) and outline.area > 1e-3 * outline.length**2 / (4 * math.pi))
    return affinity.scale(outline, 1e-3, 1e-3, origin=(0, 0))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(outline=st.one_of(star_shaped(), convex()), count=st.integers(1, 150))
def test_any_outline_is_filled(outline, count):
    cells = made(outline, count)
    check_sums(outline, cells)
    assert np.diagonal(cells.inverse_distance).min() > 0.0


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(
    outline=st.one_of(star_shaped(), convex(), st.sampled_from(list(SHAPES.values()))),
    place=st.tuples(st.floats(-1e-2, 1e-2), st.floats(-1e-2, 1e-2), st.floats(-math.pi, math.pi)),
)
def test_an_outline_cut_at_the_sheet_is_what_lies_on_it(outline, place):
    placed = affinity.translate(affinity.rotate(outline, place[2], origin=(0, 0), use_radians=True), *place[:2])
    expected = placed.intersection(shapely.box(*SHEET))
    cut = clip_outline(outline, place, SHEET)
    assert cut.symmetric_difference(expected).area <= 1e-9 * outline.area
    if expected.area <= 1e-3 * outline.area:
        return
    cells = made(cut, 60)
    check_sums(cut, cells)


def test_rings_along_the_cut_are_those_of_the_cut_outline():
    whole, place = SHAPES["square"], (5.5e-3, 0.0, 0.0)
    cut = clip_outline(whole, place, SHEET)
    check_same_cells(made(shapely.box(1.5e-3, -4e-3, 7.5e-3, 4e-3), 60), made(cut, 60), np.eye(2))


def test_a_hole_at_the_sheets_edge_opens_the_outline():
    cut = clip_outline(SHAPES["doughnut"], (7.5e-3, 0.0, 0.0), SHEET)
    assert isinstance(cut, Polygon)
    assert not cut.interiors
    parts = clip_outline(SHAPES["comb"], (0.0, -10e-3, 0.0), SHEET)
    assert isinstance(parts, MultiPolygon)
    assert len(parts.geoms) == 6


@pytest.mark.parametrize("name", ["triangle", "square"])
def test_outlines_that_differ_by_a_turn_and_a_shift_share_their_cells(name):
    outline = mjtactile.indenter_outline(name)
    moved = affinity.translate(affinity.rotate(outline, 3.0, origin=(0, 0)), 1e-3, -2e-3)
    (first, _), (second, (x, y, angle)) = (placed_cells(one, 40) for one in (outline, moved))
    np.testing.assert_array_equal(read(first).centroids, read(second).centroids)
    placed = affinity.translate(affinity.rotate(Polygon(read(second).corners), angle, (0, 0), use_radians=True), x, y)
    assert placed.symmetric_difference(moved.convex_hull).area <= 1e-9 * moved.area


def test_a_face_gets_more_cells_where_these_would_be_wider_than_asked_for():
    sole = shapely.box(-0.1, -0.045, 0.1, 0.045)  # as large as 281 squares of 8 mm; at most 200 cells are added
    smaller = [affinity.scale(sole, factor, factor) for factor in (0.7, 0.2)]
    counts = [len(read(placed_cells(outline, 20, 8e-3)[0]).areas) for outline in (sole, *smaller)]
    # Layouts come within a tenth of the wanted number, in its logarithm.
    assert counts == pytest.approx([200, 138, 20], rel=0.15)
    assert len(read(placed_cells(sole, 20)[0]).areas) == pytest.approx(20, rel=0.15)


def test_rings_of_any_direction_and_order_are_the_same_outline():
    outer, hole = (shapely.Point(0, 0).buffer(radius).exterior for radius in (3e-3, 1e-3))
    ring = Polygon(outer, [hole])
    two = MultiPolygon([ring, shapely.box(4e-3, 4e-3, 5e-3, 5e-3)])
    for outline in (two, shapely.reverse(two)):
        assert read(placed_cells(outline, 60)[0]).areas.sum() == pytest.approx(two.area, rel=1e-9)


@pytest.mark.parametrize("count", [40, 100])
def test_the_first_vertex_of_an_outline_and_its_mirror_image_make_no_difference(count):
    # The sheet's rim cuts this ring so that the rings of cells along its sides cross.
    ring = mjtactile.indenter_outline("doughnut", shift=(5e-3, 4.5e-3), rotate_deg=33.0)
    cut = ring.intersection(shapely.box(*SHEET))
    assert isinstance(cut, Polygon)

    def rolled(places):
        corners = np.roll(shapely.get_coordinates(cut.exterior)[:-1], places, axis=0)
        return Polygon(corners, [hole.coords for hole in cut.interiors])

    expected = np.sort(read(placed_cells(cut, count)[0]).areas)
    mirrored = affinity.scale(cut, -1.0, 1.0, origin=(0, 0))
    assert isinstance(mirrored, Polygon)
    for outline in (rolled(1), rolled(7), mirrored):
        areas = np.sort(read(placed_cells(outline, count)[0]).areas)
        np.testing.assert_allclose(areas, expected, rtol=1e-6)
