"""Indenters: the seven outlines against exact values, solids, and the shapes people bring."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, affinity

from mjtactile.errors import IndenterError
from mjtactile.geometry.indenter import (
    Indenter,
    box,
    convex_pieces,
    cylinder,
    indenter_outline,
    indenter_solid,
    mesh_indenter,
    punch,
    sphere,
)
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.geometry.planar import convex_parts, even_parts, support_points
from mjtactile.geometry.solid import face_outline, is_prism

REFERENCE = json.loads((Path(__file__).parent / "outlines.json").read_text())["outlines"]
AREAS = {  # [m2], by the formulas of school geometry
    "circle": math.pi * 5e-3**2,
    "doughnut": math.pi * (5e-3**2 - 2.5e-3**2),
    "ellipse": math.pi * 5e-3 * 3e-3,
    "octagon": 2 * (math.sqrt(2) - 1) * 1e-2**2,
    "square": 1e-2**2,
    "star": 10 * 0.5 * 5e-3 * 1.91e-3 * math.sin(math.radians(36)),
    "triangle": math.sqrt(3) / 4 * 1e-2**2,
}
MIRRORS = {
    "circle": "xy",
    "doughnut": "xy",
    "ellipse": "xy",
    "octagon": "xy",
    "square": "xy",
    "star": "x",
    "triangle": "x",
}

names = st.sampled_from(INDENTER_NAMES)
shifts = st.tuples(st.floats(-5e-3, 5e-3), st.floats(-5e-3, 5e-3))
angles = st.floats(-360.0, 360.0)


def difference(a, b) -> float:
    """Area in which two outlines differ, relative to the first."""
    return a.symmetric_difference(b).area / a.area


def corner_set(outline: Polygon) -> np.ndarray:
    corners = np.asarray(outline.exterior.coords)[:-1]
    return corners[np.lexsort(np.round(corners, 9).T)]


@pytest.mark.parametrize("case", REFERENCE, ids=lambda c: f"{c['name']}-{c['shift_mm']}")
def test_corners_match_an_independent_study(case):
    expected = Polygon(np.array(case["vertices_mm"]) * 1e-3)
    outline = indenter_outline(
        case["name"], shift=tuple(np.array(case["shift_mm"]) * 1e-3), rotate_deg=case["rotate_deg"]
    )
    np.testing.assert_allclose(corner_set(outline), corner_set(expected), atol=1e-15)


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_area_is_that_of_the_true_shape(name):
    assert indenter_outline(name).area == pytest.approx(AREAS[name], rel=1e-12)


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_punch_is_circumscribed_by_its_box_and_centred(name):
    outline = indenter_outline(name)
    low_x, low_y, high_x, high_y = outline.bounds
    if name != "triangle":  # centred on its centroid, not on its box
        assert max(-low_x, high_x, -low_y, high_y) == pytest.approx(5e-3, rel=6e-5)
    assert high_x - low_x <= 1e-2 * (1 + 6e-5)
    np.testing.assert_allclose(outline.centroid.coords[0], (0.0, 0.0), atol=1e-15)
    assert outline.exterior.is_ccw


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_outline_has_the_mirrors_of_its_shape(name):
    outline = indenter_outline(name)
    factors = {"x": (-1.0, 1.0), "y": (1.0, -1.0)}
    for axis in MIRRORS[name]:
        assert difference(outline, affinity.scale(outline, *factors[axis], origin=(0, 0))) < 1e-12


def test_star_points_up_and_its_first_corner_is_the_tip():
    corners = np.asarray(indenter_outline("star").exterior.coords)[:-1]
    np.testing.assert_allclose(corners[0], (0.0, 5e-3), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(corners[1::2], axis=1), 1.91e-3, rtol=1e-12)


@given(names, shifts, angles)
@settings(deadline=None, max_examples=50)
def test_moving_an_outline_keeps_its_area_and_moves_its_centroid(name, shift, angle):
    still, moved = indenter_outline(name), indenter_outline(name, shift=shift, rotate_deg=angle)
    assert moved.area == pytest.approx(still.area, rel=1e-12)
    np.testing.assert_allclose(moved.centroid.coords[0], shift, atol=1e-14)


def test_rotation_is_counter_clockwise_and_before_the_shift():
    tip = np.asarray(indenter_outline("star", shift=(1e-3, 0.0), rotate_deg=90.0).exterior.coords)[0]
    np.testing.assert_allclose(tip, (-4e-3, 0.0), atol=1e-15)


def test_scale_scales_lengths():
    assert indenter_outline("star", scale=0.5).area == pytest.approx(AREAS["star"] / 4, rel=1e-12)


@given(names, shifts, angles)
@settings(deadline=None, max_examples=20)
def test_convex_pieces_partition_the_outline(name, shift, angle):
    outline = indenter_outline(name, shift=shift, rotate_deg=angle)
    assert_partition(convex_pieces(name, shift=shift, rotate_deg=angle), outline)


@given(st.lists(st.floats(1.0, 5.0), min_size=5, max_size=12), st.floats(0.1, 0.9))
@settings(deadline=None, max_examples=30)
def test_any_polygon_with_a_hole_is_partitioned(radii, hole):
    turns = 2 * np.pi * np.arange(len(radii)) / len(radii)
    ring = np.array(radii)[:, None] * np.column_stack([np.cos(turns), np.sin(turns)]) * 1e-3
    assert_partition(convex_parts(Polygon(ring, [hole * ring])), Polygon(ring, [hole * ring]))


def assert_partition(pieces: list[Polygon], outline: Polygon) -> None:
    assert all(piece.convex_hull.area == pytest.approx(piece.area, rel=1e-6) for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(outline.area, rel=1e-12)  # no overlap
    rest = outline
    for piece in pieces:
        assert piece.difference(outline).area < 1e-12 * outline.area
        rest = rest.difference(piece.buffer(1e-12))
    assert rest.area < 1e-6 * outline.area


@pytest.mark.parametrize("name", ["doughnut", "star"])
def test_even_parts_cover_the_outline_and_leave_notches_open(name):
    outline = indenter_outline(name)
    parts = even_parts(outline)
    assert all(part.convex_hull.area == pytest.approx(part.area, rel=1e-9) for part in parts)
    whole = shapely.union_all(parts)
    assert whole.area == pytest.approx(sum(part.area for part in parts), rel=1e-6)
    assert whole.symmetric_difference(outline).area < 0.01 * outline.area
    # Of a hole nothing is filled but what chords leave of its arcs, a fiftieth of the squares' side.
    assert whole.difference(outline.buffer(2.6e-5)).area < 1e-12
    sizes = [max(part.bounds[2] - part.bounds[0], part.bounds[3] - part.bounds[1]) for part in parts]
    assert max(sizes) <= 10e-3 / 8 * 1.001


def test_a_prism_is_told_from_other_solids():
    assert is_prism(indenter_solid("star"))
    assert is_prism(cylinder(3e-3, 8e-3, "z").solid)
    assert not is_prism(sphere(6e-3).solid)
    for top in (1.1, 0.9):
        cone = indenter_solid("doughnut")
        cone.vertices[cone.vertices[:, 2] > 0.0, :2] *= top
        assert not is_prism(cone)
    assert not is_prism(indenter_solid("circle") + indenter_solid("square", height=2e-3))


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_convex_pieces_are_few(name):
    most = {"doughnut": 256, "star": 6}
    assert len(convex_pieces(name)) <= most.get(name, 1)


#: To a millionth: coordinates such as 1e-258 divide by zero in the geometry library.
_COORDINATE = st.floats(-1, 1).map(lambda value: round(value, 6))


@given(
    st.lists(st.tuples(_COORDINATE, _COORDINATE), min_size=3, max_size=20).filter(
        lambda points: Polygon(points).convex_hull.area > 0.1
    )
)
@settings(deadline=None, max_examples=100)
def test_support_points_balance_about_the_centroid_inside_the_hull(points):
    area = Polygon(points).convex_hull
    assert isinstance(area, Polygon)
    supports = support_points(area)
    assert 3 <= len(supports) <= 8
    np.testing.assert_allclose(supports.mean(axis=0), area.centroid.coords[0], atol=1e-12)
    assert all(area.buffer(1e-9).covers(Point(p)) for p in supports)


def test_support_points_refuse_a_centroid_outside_the_supports():
    with pytest.raises(IndenterError, match="centroid lies outside"):
        support_points(indenter_outline("square"), indenter_outline("square", shift=(2e-2, 0.0)))


@pytest.mark.parametrize("name", INDENTER_NAMES)
def test_solid_is_the_outline_extruded_upwards(name):
    solid = indenter_solid(name, height=4e-3, scale=1.2)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(AREAS[name] * 1.44 * 4e-3, rel=1e-10)
    np.testing.assert_allclose(solid.bounds[:, 2], (0.0, 4e-3))
    assert difference(indenter_outline(name, scale=1.2), face_outline(solid, 2e-3)) < 1e-12


@pytest.mark.parametrize(
    ("indenter", "flat"),
    [
        (punch("star"), True),
        (sphere(6e-3), False),
        (cylinder(3e-3, 8e-3), False),
        (cylinder(3e-3, 8e-3, "z"), True),
        (box((4e-3, 3e-3, 2e-3)), True),
        (mesh_indenter(indenter_solid("doughnut")), True),
        (mesh_indenter(trimesh.creation.icosphere(radius=4e-3)), False),
    ],
    ids=lambda value: getattr(value, "name", str(value)),
)
def test_every_indenter_stands_on_the_surface(indenter: Indenter, flat: bool):
    assert indenter.solid.bounds[0, 2] == pytest.approx(0.0, abs=1e-15)
    assert (indenter.outline is not None) == flat
    if indenter.outline is not None:
        assert difference(indenter.outline, face_outline(indenter.solid, 0.0)) < 1e-9


def test_primitives_have_the_size_asked_for():
    np.testing.assert_allclose(sphere(6e-3).solid.bounds[1, 2], 12e-3)
    np.testing.assert_allclose(cylinder(3e-3, 8e-3, "x").solid.extents, (8e-3, 6e-3, 6e-3))
    np.testing.assert_allclose(cylinder(3e-3, 8e-3, "y").solid.extents, (6e-3, 8e-3, 6e-3))
    np.testing.assert_allclose(box((4e-3, 3e-3, 2e-3)).solid.extents, (4e-3, 3e-3, 2e-3))


def test_mesh_indenter_reads_files_scales_and_lowers(tmp_path):
    star = indenter_solid("star")
    star.apply_scale(1e3)  # a drawing in millimetres
    star.apply_translation((0, 0, 7.0))
    star.export(tmp_path / "star.stl")
    indenter = mesh_indenter(tmp_path / "star.stl", scale=1e-3)
    assert indenter.outline is not None
    assert difference(indenter_outline("star"), indenter.outline) < 1e-5  # STL holds single precision


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: indenter_outline("star", shift=3), r"shift = 3; expected two lengths"),  # type: ignore[arg-type]
        (lambda: indenter_outline("hexagon"), r"'hexagon' does not exist. Available: circle, doughnut"),
        (lambda: indenter_outline("star", scale=0.0), "scale = 0.0"),
        (lambda: indenter_outline("star", rotate_deg=None), "rotate_deg = None"),  # type: ignore[arg-type]
        (lambda: indenter_solid("star", height="1"), "height = '1'"),  # type: ignore[arg-type]
        (lambda: punch([]), r"indenter \[\] does not exist"),  # type: ignore[arg-type]
        (lambda: sphere("x"), "radius = 'x'"),  # type: ignore[arg-type]
        (lambda: box([1e-3, 1e-3]), r"size = .*expected three lengths"),  # type: ignore[arg-type]
        (lambda: box(1e-3), r"size = 0.001; expected three lengths"),  # type: ignore[arg-type]
        (lambda: indenter_outline("star", shift=(math.nan, 0.0)), "finite"),
        (lambda: indenter_solid("star", height=-1.0), "height = -1.0"),
        (lambda: sphere(-1.0), "radius = -1.0"),
        (lambda: box((1e-3, 0.0, 1e-3)), "size y = 0.0"),
        (lambda: cylinder(1e-3, 1e-3, "w"), "expected 'x', 'y' or 'z'"),  # type: ignore[arg-type]
        (lambda: mesh_indenter("nowhere.stl"), "no mesh file nowhere.stl"),
        (lambda: mesh_indenter(trimesh.creation.box((10, 10, 10))), "pass scale=1e-3"),
        (lambda: mesh_indenter(trimesh.Trimesh()), "no triangles"),
        (lambda: mesh_indenter(open_box()), "not watertight"),
        (lambda: mesh_indenter(inside_out_box()), "inside out"),
        (
            lambda: mesh_indenter(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], process=False)),
            "finite",
        ),
        (lambda: Indenter(name="high", solid=trimesh.creation.box((1e-2, 1e-2, 1e-2))), "'high': its lowest point"),
    ],
)
def test_errors_say_what_is_wrong(make, message):
    with pytest.raises(IndenterError, match=message):
        make()


def open_box() -> trimesh.Trimesh:
    mesh = trimesh.creation.box((1e-2, 1e-2, 1e-2))
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    return mesh


def inside_out_box() -> trimesh.Trimesh:
    mesh = trimesh.creation.box((1e-2, 1e-2, 1e-2))
    mesh.invert()
    return mesh
