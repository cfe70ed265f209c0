"""Meshes fit their pad: interfaces on mesh lines, elements where stress varies, bounded cost."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjtactile.errors import MeshError, MeshWarning
from mjtactile.fem.mesh import sheet_mesh, warn_if_coarser
from mjtactile.fidelity import MESHES, MeshDensity
from mjtactile.pad import FreeTaxels, Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import CylinderSector, SphereCap

GRID = TaxelGrid(rows=3, columns=3)


def stack(*thicknesses):
    return tuple(Layer(thickness=t, young=1e6 * (i + 1), poisson=0.4) for i, t in enumerate(thicknesses))


@given(st.lists(st.floats(1e-6, 3e-3), min_size=1, max_size=6), st.sampled_from(sorted(MESHES)))
def test_every_interface_is_a_mesh_line_and_every_layer_has_its_own_material(thicknesses, name):
    pad = Pad(
        size=(3e-3, 4e-3),
        layers=stack(*thicknesses),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=(sum(thicknesses) / 2,),
        sampling_radius=1e-4,
    )
    mesh = sheet_mesh(pad, MeshDensity(**{**vars(MESHES[name]), "in_plane_size": 1e6}))
    heights = mesh.z.vertices
    assert heights[0] == -pad.thickness
    assert heights[-1] == 0.0
    assert (np.diff(heights) > 0).all()
    np.testing.assert_allclose(heights[list(mesh.interfaces)], sorted(pad.interfaces), rtol=1e-12)
    middles = (heights[:-1] + heights[1:]) / 2
    tops = np.array([0.0, *pad.interfaces])
    for middle, material in zip(middles, mesh.materials, strict=True):
        assert material == pad.layers[np.flatnonzero(tops >= middle)[-1]]


def graded(surface):
    """Largest over smallest element along x and y."""
    pad = Pad(
        size=(12e-3, 12e-3), layers=stack(2e-3), taxels=TaxelGrid(rows=3, columns=3), depths=(1e-3,), surface=surface
    )
    mesh = sheet_mesh(pad, MESHES["default"])
    return [line.sizes.max() / line.sizes.min() for line in (mesh.x, mesh.y)]


def test_elements_are_of_one_size_along_axes_about_which_bodies_roll():
    assert graded(SphereCap(12e-3)) == pytest.approx([1.0, 1.0], abs=1e-3)
    assert graded(CylinderSector(8e-3)) == pytest.approx([1.0, 2.0])
    assert graded(CylinderSector(24e-3))[0] == pytest.approx(2.0**0.517, abs=1e-3)  # asin(1/4) over 30 degrees
    # So that a nearly flat pad has nearly the flat one's mesh.
    assert graded(SphereCap(1.0)) == pytest.approx([1.985, 1.985], abs=2e-3)


def test_elements_shrink_toward_the_rim_and_the_surface():
    mesh = sheet_mesh(Pad(), MESHES["default"])
    outward = mesh.x.sizes[mesh.x.element_count // 2 :]
    assert (np.diff(outward) < 0).all()
    assert outward[0] / outward[-1] == pytest.approx(2.0)
    assert mesh.z.sizes[-1] / mesh.z.sizes[0] == pytest.approx(0.75)


@pytest.mark.parametrize("name", MESHES)
def test_in_plane_lines_are_mirror_symmetric_with_a_vertex_in_the_middle(name):
    line = sheet_mesh(Pad(), MESHES[name]).x
    np.testing.assert_array_equal(line.vertices, -line.vertices[::-1])
    assert 0.0 in line.vertices


def test_a_thick_block_is_fine_where_it_senses_and_coarse_below():
    mesh = sheet_mesh(Pad(layers=stack(50e-3)), MESHES["default"])
    np.testing.assert_allclose(mesh.z.sizes[-8:], 0.625e-3)
    assert mesh.z.element_count < 20
    growth = mesh.z.sizes[:-1] / mesh.z.sizes[1:]
    assert growth.max() < 1.7  # the growth of 1.5, fitted to whole elements
    assert mesh.x.sizes.max() < 1.1e-3


def test_free_taxels_set_the_mesh_by_their_own_radii():
    points = tuple((float(x), 0.0, -0.12e-3) for x in np.linspace(-0.8e-3, 0.8e-3, 9))
    common = {"size": (2.4e-3, 2.4e-3), "layers": stack(2e-3)}
    own = Pad(**common, taxels=FreeTaxels(points, (0.1e-3,) * 9))
    same = Pad(**common, taxels=FreeTaxels(points), sampling_radius=0.1e-3)
    meshes = [sheet_mesh(pad, MESHES["draft"]) for pad in (own, same)]
    for line in ("x", "y", "z"):
        np.testing.assert_array_equal(*(getattr(mesh, line).vertices for mesh in meshes))


def test_equal_layers_make_no_interface():
    def layer() -> Layer:
        return Layer(thickness=1e-3, young=1e6, poisson=0.49)

    assert sheet_mesh(Pad(layers=(layer(), layer()), depths=(1e-3,)), MESHES["draft"]).interfaces == ()


def test_a_sheet_too_thin_for_the_element_count_warns_and_names_the_cure():
    pad = Pad(layers=stack(0.5e-3), depths=(0.1e-3,), sampling_radius=0.1e-3)
    with pytest.warns(MeshWarning, match="most_elements"):
        warn_if_coarser(pad, MESHES["default"])
    mesh = sheet_mesh(pad, MESHES["default"])
    # 2.5 times most_elements = 800 are allowed, because 800 would be wider than 0.6 times the sheet's thickness.
    assert 800 < mesh.x.element_count * mesh.y.element_count <= 2000
    assert mesh.x.element_count == mesh.y.element_count


@pytest.mark.parametrize("name", MESHES)
def test_elements_of_a_wide_sheet_are_narrower_than_it_is_thick(name):
    skin = Pad(size=(30e-3, 20e-3), layers=stack(1e-3), depths=(0.5e-3,), taxels=GRID, sampling_radius=0.3e-3)
    mesh = sheet_mesh(skin, replace(MESHES[name], rim_grading=1.0))
    assert max(mesh.x.sizes.max(), mesh.y.sizes.max()) < 0.601e-3
    with pytest.warns(MeshWarning, match=r"smoothed\. Raise"):
        warn_if_coarser(skin, MESHES[name])


def test_a_sheet_too_wide_for_its_elements_is_warned_of_and_then_refused():
    skin = Pad(size=(40e-3, 30e-3), layers=stack(1e-3), depths=(0.5e-3,), taxels=GRID, sampling_radius=0.3e-3)
    with pytest.warns(MeshWarning, match="15 to 30 % off"):
        warn_if_coarser(skin, MESHES["draft"])
    wide = replace(skin, size=(100e-3, 60e-3))
    with pytest.raises(MeshError, match=r"most_elements=.*reference_length"):
        sheet_mesh(wide, MESHES["draft"])
    sheet_mesh(wide, replace(MESHES["draft"], reference_length=1e-3))


def test_a_sheet_that_is_fine_enough_keeps_to_most_elements():
    sole = Pad(size=(0.15, 0.08), layers=stack(8e-3), depths=(2e-3,), taxels=GRID, sampling_radius=1e-3)
    mesh = sheet_mesh(sole, MESHES["draft"])
    assert mesh.x.element_count * mesh.y.element_count <= 800
