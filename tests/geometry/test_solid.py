"""Sections of solids by a plane: true outlines, whatever the plane meets."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Polygon

from mjtactile.errors import IndenterError
from mjtactile.geometry.indenter import indenter_outline, indenter_solid, sphere
from mjtactile.geometry.solid import extrude, face_outline


def cube(centre=(0.0, 0.0, 0.0), side=1e-2) -> trimesh.Trimesh:
    return trimesh.creation.box((side, side, side)).apply_translation(centre)


@pytest.mark.parametrize("height", [-5e-3, 0.0, 5e-3])
def test_faces_in_the_plane_belong_to_the_section(height):
    assert face_outline(cube(), height).area == pytest.approx(1e-4, rel=1e-12)


@pytest.mark.parametrize("height", [-5.00001e-3, 5.00001e-3])
def test_a_plane_that_misses_gives_an_empty_polygon(height):
    assert face_outline(cube(), height).is_empty


def test_a_vertex_or_an_edge_in_the_plane_is_no_area():
    on_edge = cube().apply_transform(trimesh.transformations.rotation_matrix(np.pi / 4, [1, 0, 0]))
    assert face_outline(on_edge, on_edge.bounds[0, 2]).area == 0.0
    assert face_outline(sphere(6e-3).solid, 0.0).area == 0.0


def test_a_face_that_a_rotation_left_a_rounding_off_still_counts():
    solid = indenter_solid("star")
    solid.vertices[:10, 2] += np.linspace(-4e-10, 4e-10, 10)
    assert face_outline(solid, 0.0).area == pytest.approx(indenter_outline("star").area, rel=1e-6)


def test_holes_and_non_convex_corners_are_kept():
    doughnut = face_outline(indenter_solid("doughnut"), 1e-3)
    assert isinstance(doughnut, Polygon)
    assert len(doughnut.interiors) == 1
    star = face_outline(indenter_solid("star"), 0.0)
    assert star.convex_hull.area > 1.5 * star.area


def test_separate_bodies_add_up_and_overlapping_ones_count_once():
    pair = cube() + cube((5e-3, 0, 0))
    assert face_outline(pair, 1e-3).area == pytest.approx(1.5e-4, rel=1e-12)
    apart = face_outline(cube() + cube((2e-2, 0, 0)), 0.0)
    assert isinstance(apart, MultiPolygon)
    assert apart.area == pytest.approx(2e-4, rel=1e-12)


def test_a_body_inside_another_ones_hole_is_kept():
    ring, post = indenter_solid("doughnut"), indenter_solid("circle", scale=0.3)
    expected = indenter_outline("doughnut").area + indenter_outline("circle", scale=0.3).area
    assert face_outline(ring + post, 1e-3).area == pytest.approx(expected, rel=1e-12)


def test_sphere_sections_are_circles():
    solid = sphere(6e-3).solid
    for height in (1e-4, 1e-3, 6e-3, 9e-3):
        expected = np.pi * (6e-3**2 - (height - 6e-3) ** 2)
        assert face_outline(solid, height).area == pytest.approx(expected, rel=0.02)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.integers(0, 19))
@settings(deadline=None, max_examples=40)
def test_planes_through_vertices_of_tilted_solids_match_planes_beside_them(about_x, about_y, vertex):
    solid = indenter_solid("star")
    solid.apply_transform(trimesh.transformations.euler_matrix(about_x, about_y, 0.0))
    height = float(solid.vertices[vertex, 2])
    areas = [face_outline(solid, height + step).area for step in (-2e-9, 0.0, 2e-9)]
    assert face_outline(solid, height).is_valid
    assert min(areas[0], areas[2]) - 1e-9 <= areas[1] <= areas[0] + areas[2] + 1e-9


@given(st.floats(0.0, 2 * np.pi), st.floats(0.05, 0.95))
@settings(deadline=None, max_examples=20)
def test_section_integrates_to_the_volume(angle, axis_share):
    axis = [axis_share, 1 - axis_share, 0.0]
    solid = indenter_solid("octagon")
    solid.apply_transform(trimesh.transformations.rotation_matrix(angle, axis))
    low, high = solid.bounds[:, 2]
    nodes, weights = np.polynomial.legendre.leggauss(60)
    heights = low + (nodes + 1) / 2 * (high - low)
    volume = (high - low) / 2 * sum(w * face_outline(solid, h).area for w, h in zip(weights, heights, strict=True))
    assert volume == pytest.approx(solid.volume, rel=5e-3)


def test_only_closed_solids_have_sections():
    mesh = cube()
    mesh.update_faces(np.arange(12) > 0)
    with pytest.raises(IndenterError, match="watertight"):
        face_outline(mesh, 0.0)


def test_outlines_of_several_parts_extrude_together():
    parts = MultiPolygon([indenter_outline("square", scale=0.2), indenter_outline("doughnut", shift=(1e-2, 0.0))])
    assert extrude(parts, 1e-3).volume == pytest.approx(parts.area * 1e-3, rel=1e-12)
    with pytest.raises(IndenterError, match="empty outline"):
        extrude(Polygon(), 1e-3)
