"""Curved pads and free taxels at every door: taken, or refused with what can be done instead."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from shapely import Point, box
from small_pads import COARSE, DOME, LAYERED_PAD, in_double_precision

import mjtactile
from mjtactile.errors import ContactError, PadError, StaleInfluenceError
from mjtactile.fidelity import Fidelity
from mjtactile.influence import cache
from mjtactile.influence.matrices import InfluenceMatrices, load_influence
from mjtactile.influence.provenance import influence_fingerprint
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_names import pad_text
from mjtactile.pad_shape.surfaces import EllipsoidCap, SphereCap
from mjtactile.pad_shape.taxels import FreeTaxels
from mjtactile.recognition.symmetry import is_symmetric

MESH = Fidelity(mesh=COARSE)


@pytest.fixture(scope="module")
def dome() -> InfluenceMatrices:
    return in_double_precision(DOME, COARSE)


def pressed(influence: InfluenceMatrices) -> SurfaceLoad:
    return SurfaceLoad.from_tractions(influence, Point(1e-3, -0.5e-3).buffer(1.2e-3), lambda p, n: -1e4 * n)


def test_tables_of_curved_pads_are_cached_and_come_back(tmp_path, monkeypatch):
    monkeypatch.setenv("MJTACTILE_CACHE", str(tmp_path))
    built = mjtactile.influence_matrices(DOME, MESH, progress=False)
    again = mjtactile.influence_matrices(DOME, MESH, progress=False)
    assert len(list(tmp_path.glob("*.safetensors"))) == 1
    np.testing.assert_array_equal(again.readings(pressed(again)), built.readings(pressed(built)))
    (path,) = tmp_path.glob("*.safetensors")
    assert load_influence(path).pad == DOME
    with pytest.raises(StaleInfluenceError):
        load_influence(path, LAYERED_PAD, MESH)
    assert "ellipsoid pad" in cache.cached_tables()[0].contents


def free_of(pad: Pad) -> Pad:
    points = np.concatenate([pad.taxel_points(k) for k in range(3)])
    return replace(pad, taxels=FreeTaxels(points), depths=())  # type: ignore[arg-type]


def loss_of_storage(pad: Pad, fidelity: Fidelity) -> float:
    """Relative L2 difference of what a fidelity reads from what plain tables on its mesh read."""
    plain = cache.build_influence(pad, MESH, progress=False)
    stored = cache.build_influence(pad, fidelity, progress=False)
    stored.check()
    expected, found = plain.readings(pressed(plain)), stored.readings(pressed(stored))
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


@pytest.mark.parametrize("name", ["fast", "balanced", "precise"])
def test_storage_costs_curved_pads_what_it_costs_flat_ones(name):
    """On three elements per half, corners and averages cost some per cent; on a curved pad not half as much again."""
    fidelity = replace(mjtactile.PRESETS[name], mesh=COARSE)
    flat = loss_of_storage(LAYERED_PAD, fidelity)
    for pad in (DOME, free_of(replace(DOME, surface=lopsided_patch()))):
        assert loss_of_storage(pad, fidelity) < 1.5 * flat + 1e-3


def lopsided_patch() -> mjtactile.SurfacePatch:
    x, y = np.meshgrid(np.linspace(-5e-3, 5e-3, 41), np.linspace(-4e-3, 4e-3, 41), indexing="ij")
    from scipy.interpolate import RectBivariateSpline

    heights = EllipsoidCap((11e-3, 8e-3, 9e-3)).height(x, y) + 2.0 * x**2 * y - 0.02 * x
    spline = RectBivariateSpline(x[:, 0], y[0], heights, kx=5, ky=5, s=(1e-7) ** 2 * x.size)  # type: ignore[arg-type]
    knots = spline.get_knots()
    shape = len(knots[0]) - 6, len(knots[1]) - 6
    return mjtactile.SurfacePatch(
        tuple(knots[0]), tuple(knots[1]), tuple(map(tuple, spline.get_coeffs().reshape(shape)))
    )


def test_storage_of_a_flat_pad_with_free_taxels_reads_as_the_grid():
    points = np.concatenate([LAYERED_PAD.taxel_points(k) for k in range(3)])
    free = replace(LAYERED_PAD, taxels=FreeTaxels(points), depths=())  # type: ignore[arg-type]
    fidelity = Fidelity(mesh=COARSE, precision="float16")
    grid, found = (cache.build_influence(pad, fidelity, progress=False) for pad in (LAYERED_PAD, free))
    np.testing.assert_allclose(found.readings(pressed(found)), grid.readings(pressed(grid)).ravel(), rtol=2e-3)


def test_a_footprint_belongs_to_its_surface(dome):
    flat = in_double_precision(LAYERED_PAD, COARSE)
    footprint = mjtactile.Footprint.from_outline(box(-1e-3, -1e-3, 1e-3, 1e-3), flat.surface)
    with pytest.raises(
        ContactError, match=r"made on a .*\(flat, .*but the pad's is a .*\(ellipsoid, .*influence\.surface"
    ):
        mjtactile.contact_load(dome, footprint, force=(0, 0, -0.1), law="elastic")


def test_a_wrench_basis_of_a_curved_pad_is_its_load(dome):
    footprint = mjtactile.Footprint.from_gap(lambda x, y: 60 * (x**2 + y**2), dome.surface)
    basis = mjtactile.WrenchBasis(dome, footprint, law="elastic")
    for force in (-0.1, -0.2, -0.1, -0.1):
        load = mjtactile.contact_load(dome, footprint, force=(0, 0, force), law="elastic")
        np.testing.assert_allclose(basis.readings((0, 0, force)), dome.readings(load), rtol=1e-6)


def test_free_taxels_are_read_by_a_sensor_in_mujoco():
    """The same press, read by a grid and by points where it has its taxels."""
    points = np.concatenate([LAYERED_PAD.taxel_points(k) for k in range(3)])
    free = replace(LAYERED_PAD, taxels=FreeTaxels(points), depths=())  # type: ignore[arg-type]
    model = mjtactile.press_scene("circle", pad=LAYERED_PAD)
    data = mujoco.MjData(model)
    mjtactile.press(model, data, (0.0, 0.0, -0.05))
    found = []
    for pad in (LAYERED_PAD, free):
        influence = in_double_precision(pad, COARSE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", mjtactile.ContactWarning)
            found.append(mjtactile.TactileSensor(model, influence=influence).read(data))
    assert found[1].shape == (60,)
    np.testing.assert_allclose(found[1], found[0].ravel(), rtol=1e-9)
    assert found[0].max() > 0.0


def test_what_needs_a_grid_says_so_of_free_taxels():
    free = replace(LAYERED_PAD, taxels=FreeTaxels(((0.0, 0.0, -1e-3),)), depths=())
    assert not is_symmetric(free)
    with pytest.raises(PadError, match="taxels on a grid"):
        _ = free.grid


def test_keys_of_flat_pads_are_what_they_were():
    # The table in the package, and those in users' caches, are found by it.
    assert influence_fingerprint(Pad(), mjtactile.PRESETS["fast"])[:20] in {
        path.stem.removeprefix("influence-") for path in cache.SHIPPED.glob("*.safetensors")
    }
    assert pad_text(Pad()).count("surface") == 0


def test_a_fingertip_from_a_file_is_read_in_ten_lines(tmp_path: Path):
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=12.0)
    sphere.apply_translation([0.0, 0.0, -12.0])
    sphere.export(tmp_path / "fingertip.stl")
    pad = Pad.from_mesh(
        tmp_path / "fingertip.stl",
        scale=1e-3,  # it is in millimetres
        size=(8e-3, 8e-3),
        layers=[Layer(thickness=2e-3, young=0.3e6, poisson=0.49)],
        taxels=TaxelGrid(rows=5, columns=5, pitch=(1.2e-3, 1.2e-3)),
        depths=(1.0e-3,),
        sampling_radius=0.4e-3,
    )
    mesh = Fidelity(mesh=replace(COARSE, most_elements=100))
    influence = cache.build_influence(pad, mesh, progress=False)
    disc = Point(1e-3, 0.0).buffer(1.5e-3)
    load = SurfaceLoad.from_tractions(influence, disc, lambda points, normals: -10e3 * normals)
    readings = influence.readings(load)
    assert readings.shape == (1, 5, 5)
    assert np.unravel_index(readings[0].argmax(), (5, 5))[0] == 2
    known = cache.build_influence(replace(pad, surface=SphereCap(12e-3)), mesh, progress=False)
    expected = known.readings(SurfaceLoad.from_tractions(known, disc, lambda points, normals: -10e3 * normals))
    # The patch is within 3 um of the sphere, 0.3 % of the taxels' depth.
    assert np.linalg.norm(readings - expected) < 0.005 * np.linalg.norm(expected)
