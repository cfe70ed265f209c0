"""Surfaces as values: what their derivatives, offsets and curvatures are, and which of them no pad can have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mjtactile.errors import PadError
from mjtactile.pad import FreeTaxels, Layer, Pad, TaxelGrid
from mjtactile.pad_names import pad_from_text, pad_text
from mjtactile.pad_shape.surface_fit import fitted_patch
from mjtactile.pad_shape.surfaces import (
    CylinderSector,
    EllipsoidCap,
    Flat,
    SphereCap,
    Surface,
    SurfacePatch,
    surface_from,
)

HALF = 5e-3
radii = st.floats(11e-3, 0.2)
places = st.tuples(st.floats(-HALF, HALF), st.floats(-HALF, HALF), st.floats(0.0, 3e-3))


def wavy_patch() -> SurfacePatch:
    """A quintic patch over 12 x 12 mm without any mirror."""
    knots = np.concatenate([np.full(5, -6e-3), np.linspace(-6e-3, 6e-3, 5), np.full(5, 6e-3)])
    i, j = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    heights = -1.5e-3 * (i**2 + 0.6 * j**2 + 0.3 * i * j) + 1e-4 * np.sin(3 * i + j)
    return SurfacePatch(tuple(knots), tuple(knots), tuple(map(tuple, heights)))


surfaces = st.one_of(
    radii.map(SphereCap),
    radii.map(CylinderSector),
    st.tuples(radii, radii, radii).map(EllipsoidCap),
    st.just(wavy_patch()),
    st.just(Flat()),
)


def dome(**changes: object) -> Pad:
    pad = Pad(
        size=(10e-3, 10e-3),
        layers=(Layer(thickness=1e-3, young=1e6, poisson=0.49), Layer(thickness=1e-3, young=3e6, poisson=0.4)),
        taxels=TaxelGrid(rows=3, columns=3, pitch=(1e-3, 1e-3)),
        depths=(0.5e-3, 1.5e-3),
        sampling_radius=0.3e-3,
        surface=SphereCap(12e-3),
    )
    return replace(pad, **changes)  # type: ignore[arg-type]


@settings(deadline=None)  # the first spline imports scipy
@given(surfaces, places)
def test_derivatives_are_those_of_positions(surface: Surface, place):
    # Central differences of a smooth map: their error is of the second order in the step.
    step, place = 1e-6, np.array(place)
    found = surface.derivatives(*place)
    for axis in range(3):
        move = step * np.eye(3)[axis]
        inside = np.clip(place + move, -HALF - 1e-4, HALF + 1e-4), np.clip(place - move, -HALF - 1e-4, HALF + 1e-4)
        slope = (surface.positions(*inside[0]) - surface.positions(*inside[1])) / (2 * step)
        np.testing.assert_allclose(found[:, axis], slope, atol=1e-6)


@settings(deadline=None)  # the first spline imports scipy
@given(surfaces, places)
def test_a_point_finds_its_foot(surface: Surface, place):
    point = surface.positions(*place)
    feet, miss = surface.feet(point[None], (HALF, HALF))
    np.testing.assert_allclose(feet[0], place, atol=1e-12)
    assert miss[0] < 1e-14


@settings(deadline=None)  # the first spline imports scipy
@given(surfaces, places)
def test_axes_on_a_surface_are_turned_the_shortest_way(surface: Surface, place):
    axes = surface.frames(*place[:2])
    np.testing.assert_allclose(axes[2], surface.normals(*place[:2]), rtol=0, atol=1e-15)
    turn = Rotation.from_matrix(axes.T)
    np.testing.assert_allclose(turn.as_matrix(), axes.T, rtol=0, atol=1e-14)  # they are a rotation
    assert turn.as_rotvec()[2] == pytest.approx(0.0, abs=1e-14)  # about an axis in the plane


@given(radii, places)
def test_offsets_of_a_sphere_are_spheres(radius: float, place):
    away = SphereCap(radius).positions(*place) + np.array([0.0, 0.0, radius])
    assert np.linalg.norm(away) == pytest.approx(radius - place[2], rel=1e-12)


@given(radii, places)
def test_curvatures_of_sphere_and_cylinder(radius: float, place):
    x, y, _ = place
    np.testing.assert_allclose(SphereCap(radius).curvatures(x, y), 1 / radius, rtol=1e-6)
    np.testing.assert_allclose(CylinderSector(radius).curvatures(x, y), [1 / radius, 0.0], atol=1e-7 / radius)


@settings(deadline=None)  # the first spline imports scipy
@given(surfaces, places)
def test_offset_surfaces_shrink_by_both_curvatures(surface: Surface, place):
    x, y, depth = place
    large, small = surface.curvatures(x, y)
    area = abs(np.linalg.det(surface.derivatives(x, y, depth)))
    assert area == pytest.approx(float(surface.stretch(x, y)) * (1 - depth * large) * (1 - depth * small), rel=1e-9)


@given(radii, places)
def test_an_ellipsoid_with_equal_axes_is_a_sphere(radius: float, place):
    both = [
        surface.jet(*map(np.asarray, place[:2]))
        for surface in (EllipsoidCap((radius, radius, radius)), SphereCap(radius))
    ]
    assert both[0] == both[1]


@settings(deadline=None)  # the first spline imports scipy
@given(surfaces)
def test_descriptions_make_equal_surfaces(surface: Surface):
    again = surface_from(surface.description)
    assert again == surface
    assert hash(again) == hash(surface)


def test_a_flat_pad_says_nothing_of_its_surface():
    # So that tables from before there were others stay valid.
    assert Pad().description.keys() == {"size", "layers", "taxels", "depths", "sampling_radius"}
    assert Pad().fingerprint == "79f0ce2d8722764c2472f1ffbdad7b505531a27fa2299d5386e153416ba614b4"


@pytest.mark.parametrize("surface", [SphereCap(12e-3), EllipsoidCap((9e-3, 14e-3, 10e-3)), wavy_patch()], ids=repr)
def test_pads_come_back_from_text(surface):
    pad = dome(surface=surface)
    assert pad_from_text(pad_text(pad)) == pad
    assert pad.fingerprint != dome(surface=Flat()).fingerprint


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"kind": "sphere"}', "needs radius, and none was given"),
        ('{"kind": "sphere", "radius": 0.01, "colour": 1}', "needs radius, and colour, radius was given"),
        ('{"kind": "torus"}', "one of flat, sphere"),
        ('{"kind": "sphere", "radius": "wide"}', "positive length"),
        ('{"kind": []}', "expected an object whose .kind. is one of .* .in a TOML file also mesh."),
        ("3", "expected an object whose .kind. is one of"),
    ],
)
def test_texts_of_no_surface_are_refused(text, said):
    whole = pad_text(dome()).replace('{"kind":"sphere","radius":0.012}', text)
    with pytest.raises(PadError, match=said):
        pad_from_text(whole)


@pytest.mark.parametrize(
    ("surface", "said"),
    [
        (SphereCap(1.9e-3), "there is no surface"),
        (SphereCap(5.05e-3), "there is no surface"),
        (SphereCap(7.2e-3), r"x = -5 mm, y = -5 mm the surface has a slope of 79"),
    ],
)
def test_surfaces_that_no_pad_can_have_say_where(surface, said):
    with pytest.raises(PadError, match=said):
        dome(surface=surface)


def test_a_surface_whose_inner_offset_folds_says_where():
    # At its apex the ellipsoid has the radius a^2 / c = 1.8 mm.
    with pytest.raises(
        PadError, match=r"x = .* mm the surface has a radius of curvature of 1.8 mm, but the pad is 2 mm"
    ):
        dome(size=(2e-3, 2e-3), surface=EllipsoidCap((12e-3, 12e-3, 80e-3)))


def test_a_hollow_may_be_as_narrow_as_it_likes():
    # Offsets of a hollow surface widen: only what bulges out can fold.
    x = np.linspace(-6e-3, 6e-3, 61)
    height = 1.0e-3 * (1 - np.exp(-(x[:, None] ** 2 + x**2) / (1.4e-3) ** 2))
    from scipy.interpolate import RectBivariateSpline

    spline = RectBivariateSpline(x, x, height, kx=5, ky=5, s=0)
    knots = spline.get_knots()
    patch = SurfacePatch(tuple(knots[0]), tuple(knots[1]), tuple(map(tuple, spline.get_coeffs().reshape(61, 61))))
    assert patch.curvatures(0.0, 0.0)[1] < -1 / 2e-3
    dome(surface=patch)


def test_mirrors_are_those_of_the_surface():
    assert SphereCap(1.0).mirrors == (True, True)
    assert wavy_patch().mirrors == (False, False)
    line = tuple(np.concatenate([np.full(4, -1.0), np.full(4, 1.0)]))
    rows = ((0.0, 1.0, 2.0, 3.0), (0.0, 0.5, 1.0, 2.0), (0.0, 0.5, 1.0, 2.0), (0.0, 1.0, 2.0, 3.0))
    assert SurfacePatch(line, line, rows, degree=3).mirrors == (True, False)


@pytest.mark.parametrize("value", [0.0, -1.0, 1e-200, 1e300, math.nan, math.inf, "a", None, True])
def test_radii_are_positive_lengths(value):
    for make in (SphereCap, CylinderSector, lambda r: EllipsoidCap((1.0, r, 1.0))):
        with pytest.raises(PadError, match="positive length"):
            make(value)


def test_patches_that_are_no_splines_are_refused():
    patch = wavy_patch()
    with pytest.raises(PadError, match="expected \\(9, 9\\)"):
        replace(patch, coefficients=patch.coefficients[:-1])
    with pytest.raises(PadError, match="degree"):
        replace(patch, degree=2)
    with pytest.raises(PadError, match="ascending"):
        replace(patch, knots_x=patch.knots_x[::-1])
    with pytest.raises(PadError, match="1 and 1 knots has coefficients of shape"):
        SurfacePatch(5, 5, 5)  # type: ignore[arg-type]
    with pytest.raises(PadError, match="must be numbers"):
        replace(patch, knots_x=tuple(map(str, patch.knots_x)))


@pytest.mark.parametrize("middle", [[0.0] * 4, [0.0] * 3, [0.0, 0.0]])
def test_patches_whose_curvature_jumps_are_refused(middle):
    knots = [-HALF] * 4 + middle + [HALF] * 4
    count = len(knots) - 4
    with pytest.raises(PadError, match="curvature must be continuous"):
        SurfacePatch(tuple(knots), tuple(knots), tuple([(0.0,) * count] * count), 3)


def test_a_taxel_where_all_normals_meet_is_outside_the_pad():
    radius = 12e-3
    for surface in (SphereCap(radius), CylinderSector(radius), EllipsoidCap((radius, radius, radius))):
        with pytest.raises(PadError, match="taxel 0"):
            Pad(size=(8e-3, 8e-3), surface=surface, taxels=FreeTaxels(((0.0, 0.0, -radius),)))


def test_a_zero_of_a_patch_has_no_sign():
    patch = wavy_patch()
    flat, below = (
        replace(patch, coefficients=tuple(map(tuple, np.full((9, 9), zero).tolist()))) for zero in (0.0, -0.0)
    )
    assert flat == below
    assert str(flat.description) == str(below.description)


def rounded_block(surface: Surface, lines: int = 81, half: float = 6e-3):
    """A mesh of a surface over a square, as it may come out of a file."""
    import trimesh

    x = np.linspace(-half, half, lines)
    grid_x, grid_y = np.meshgrid(x, x)
    vertices = np.column_stack([grid_x.ravel(), grid_y.ravel(), surface.height(grid_x, grid_y).ravel()])
    a = (np.arange(lines - 1)[:, None] * lines + np.arange(lines - 1)).ravel()
    faces = np.concatenate([np.column_stack([a, a + 1, a + lines]), np.column_stack([a + 1, a + lines + 1, a + lines])])
    return trimesh.Trimesh(vertices, faces, process=False)


def test_a_mesh_of_a_known_cap_gives_that_cap(tmp_path):
    """An STL of a sphere in millimetres, turned and moved; its facets stand up to 13 um off the sphere."""
    import trimesh
    from scipy.spatial.transform import Rotation

    mesh = trimesh.creation.icosphere(subdivisions=4, radius=12.0)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [0.4, -0.3, 1.0]).as_matrix()
    pose[:3, 3] = [0.02, -0.01, 0.03]
    in_millimetres = pose.copy()
    in_millimetres[:3, 3] *= 1e3
    mesh.apply_translation([0.0, 0.0, -12.0])
    mesh.apply_transform(in_millimetres)
    mesh.export(tmp_path / "tip.stl")
    pad = Pad.from_mesh(
        tmp_path / "tip.stl", frame=pose, scale=1e-3, size=(10e-3, 10e-3), layers=dome().layers, depths=(1e-3,),
        taxels=TaxelGrid(rows=3, columns=3, pitch=(1e-3, 1e-3)),
    )  # fmt: skip
    x, y = np.meshgrid(*[np.linspace(-5e-3, 5e-3, 31)] * 2)
    sphere = SphereCap(12e-3)
    away = (pad.surface.height(x, y) - sphere.height(x, y)) / sphere.stretch(x, y)
    assert np.abs(away).max() < 3e-6
    np.testing.assert_allclose(pad.surface.curvatures(x, y), 1 / 12e-3, rtol=0.1)
    assert isinstance(pad.surface, SurfacePatch)
    assert 5e-6 < pad.surface.deviation < 20e-6
    assert pad_from_text(pad_text(pad)) == pad


def test_a_fit_reproduces_a_cylinder_and_an_ellipsoid():
    x, y = np.meshgrid(*[np.linspace(-5e-3, 5e-3, 31)] * 2)
    for surface in (CylinderSector(9e-3), EllipsoidCap((10e-3, 14e-3, 8e-3))):
        patch = fitted_patch(rounded_block(surface), (10e-3, 10e-3))
        assert np.abs(patch.height(x, y) - surface.height(x, y)).max() < 2e-6


def test_a_mesh_gives_the_surface():
    with pytest.raises(PadError, match="leave surface="):
        Pad.from_mesh("tip.stl", size=(8e-3, 8e-3), thickness=2e-3, surface=Flat())


def test_folds_and_wrong_frames_of_meshes_are_refused():
    mesh = rounded_block(SphereCap(12e-3))
    with pytest.raises(PadError, match="scale"):
        fitted_patch(mesh, (10e-3, 10e-3), scale=0.0)
    stepped = mesh.copy()
    stepped.vertices[stepped.vertices[:, 0] > 1e-3, 2] -= 2e-3
    with pytest.raises(PadError, match=r"at x = (0\.9|1)\d* mm, y = .* mm the surface has a slope of"):
        Pad.from_mesh(
            stepped, size=(10e-3, 10e-3), thickness=1e-3, depths=(0.5e-3,), taxels=TaxelGrid(rows=3, columns=3)
        )
    with pytest.raises(PadError, match=r"no smooth graph over the rectangle: at x = "):
        fitted_patch(stepped, (10e-3, 10e-3), smoothing=0.4e-3)
    with pytest.raises(PadError, match="orthonormal"):
        fitted_patch(mesh, (10e-3, 10e-3), frame=2 * np.eye(4))
    with pytest.raises(FileNotFoundError, match="no_such"):
        Pad.from_mesh("no_such.stl", size=(1e-2, 1e-2), thickness=2e-3)
    with pytest.raises(PadError, match="one of the two"):
        Pad.from_mesh(mesh, size=(1e-2, 1e-2))
