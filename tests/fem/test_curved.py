"""Swept elements: what they are where the surface is flat, whole against mirrored, in equilibrium, and in one state."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from shapely import Point, box
from small_pads import COARSE, DOME, LAYERED_PAD, in_double_precision

from mjtactile.errors import ContactError, FootprintError
from mjtactile.fem.elements import SweptElements
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.stress_rows import StressRows
from mjtactile.fem.taxel_quadrature import layer_sampling
from mjtactile.fem.tractions import integrated_traction
from mjtactile.fidelity import MeshDensity
from mjtactile.influence.build import build_steps, build_tables
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import CylinderSector, EllipsoidCap, Flat, SphereCap
from mjtactile.pad_shape.taxels import FreeTaxels

ONE_STRAIN = 2e-3


@dataclass(frozen=True)
class Lopsided(EllipsoidCap):
    """An ellipsoid that does not know of some of its mirrors."""

    known: tuple[bool, bool] = (False, False)

    @property
    def mirrors(self) -> tuple[bool, bool]:
        return self.known


def pressure(points, normals):
    return -1e4 * (1 + 100 * points[:, :1]) * normals


def off_the_middle(influence: InfluenceMatrices) -> SurfaceLoad:
    return SurfaceLoad.from_tractions(influence, Point(1e-3, -0.7e-3).buffer(1.4e-3), pressure)


@pytest.fixture(scope="module")
def dome() -> InfluenceMatrices:
    return in_double_precision(DOME, COARSE)


@pytest.mark.parametrize("known", [(True, True), (False, False)])
def test_progress_ends_where_it_was_said_to(known):
    pad, steps = replace(DOME, surface=Lopsided((11e-3, 8e-3, 9e-3), known)), []
    for _ in build_tables(pad, COARSE, on_step=lambda: steps.append(1)):
        pass
    assert len(steps) == build_steps(pad, COARSE)


@pytest.mark.parametrize("known", [(False, False), (True, False), (False, True)])
def test_mirrors_are_a_short_cut_only(dome, known):
    surface = Lopsided((11e-3, 8e-3, 9e-3), known)
    whole = in_double_precision(replace(DOME, surface=surface), COARSE)
    load, same = off_the_middle(dome), off_the_middle(whole)
    np.testing.assert_allclose(same.forces, load.forces, atol=1e-15)
    for ask in (InfluenceMatrices.readings, InfluenceMatrices.stress, InfluenceMatrices.surface_displacement):
        expected = ask(dome, load)
        np.testing.assert_allclose(ask(whole, same), expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_a_mirrored_load_gives_mirrored_readings():
    pad = replace(DOME, taxels=TaxelGrid(rows=3, columns=5, pitch=(1.5e-3, 1.2e-3)))
    influence = in_double_precision(pad, COARSE)
    load = off_the_middle(influence)
    mirrored = SurfaceLoad.from_tractions(
        influence, Point(-1e-3, -0.7e-3).buffer(1.4e-3), lambda p, n: pressure(p * [-1, 1, 1], n)
    )
    expected = influence.readings(load)[:, :, ::-1]
    # The disc's polygon is its own mirror image to rounding.
    np.testing.assert_allclose(influence.readings(mirrored), expected, rtol=1e-9)


def test_a_state_of_one_strain_is_found_everywhere():
    """Displacements that are linear in the place are in the elements, and read as their strain anywhere."""
    mesh = sheet_mesh(DOME, COARSE)
    points = np.concatenate([layer_sampling(DOME, k, 2).positions for k in range(3)])
    rows = StressRows(mesh, DOME.feet(points)[0])
    gradient = np.array([[1.0, 0.3, -0.2], [0.1, -0.4, 0.5], [0.6, 0.2, 0.7]]) * 1e-3
    moved = SweptElements(mesh).nodes @ gradient.T  # the base included
    stress = (rows._combined @ (rows._recovered @ moved.ravel())).reshape(-1, 6)
    layer = np.digitize(DOME.feet(points)[0][:, 2], -np.array(DOME.interfaces))
    for number, material in enumerate(DOME.layers):
        strain = (gradient + gradient.T) / 2
        shear = 2 * material.shear_modulus * (strain - np.trace(strain) / 3 * np.eye(3))
        expected = [1.5 * shear[2, 2], np.sqrt(3) / 2 * (shear[0, 0] - shear[1, 1])]
        expected += [np.sqrt(3) * shear[i, j] for i, j in ((0, 1), (1, 2), (2, 0))]
        bulk = material.lame_lambda + 2 / 3 * material.shear_modulus
        expected += [bulk * np.trace(gradient)]
        inside = stress[layer == number]
        assert len(inside) > 20
        # Slopes are recovered by cubics along the curved lines, whose fourth-order error on three elements this is.
        away = np.abs(inside - expected) / np.abs(expected).max()
        assert away.max() < ONE_STRAIN, f"layer {number}: {away.max():.1e}"


@pytest.mark.parametrize("curved", [SphereCap, CylinderSector])
def test_far_centres_of_curvature_leave_the_flat_pad(curved):
    """What pads of a metre's radius read differs from a flat pad by what depth over radius makes of it, and no more.

    A pressure on a dome has a smaller base to go to, by 1 - 2 depth / radius, on a cylinder by half of that: thin pads
    differ by less than a thousandth. Of thicker ones the difference halves when the radius doubles, to its square.
    """
    flat = replace(LAYERED_PAD, taxels=TaxelGrid(rows=3, columns=3, pitch=(1.2e-3, 1.2e-3)))
    surfaces = Flat(), curved(1.0), curved(2.0)
    pads = [in_double_precision(replace(flat, surface=surface), COARSE) for surface in surfaces]
    none, near, far = (influence.readings(off_the_middle(influence)) for influence in pads)
    size = np.linalg.norm(none)
    assert 1e-4 * size < np.linalg.norm(near - none) < 5e-3 * size
    assert np.linalg.norm(2 * far - near - none) < 2e-5 * size
    thin = replace(
        flat,
        size=(3e-3, 2e-3),
        layers=(Layer(thickness=0.6e-3, young=1e6, poisson=0.49),),
        depths=(0.2e-3, 0.4e-3),
        taxels=TaxelGrid(rows=3, columns=3, pitch=(0.5e-3, 0.5e-3)),
        sampling_radius=0.1e-3,
    )
    finer = replace(COARSE, most_elements=100)
    pads = [in_double_precision(replace(thin, surface=surface), finer) for surface in surfaces[:2]]
    none, near = (
        influence.readings(SurfaceLoad.from_tractions(influence, Point(0, 0).buffer(0.5e-3), lambda p, n: -1e4 * n))
        for influence in pads
    )
    assert np.linalg.norm(near - none) < 1e-3 * np.linalg.norm(none)


def test_balls_under_a_curve_keep_volume_and_middle():
    """Of balls that layer interfaces cut: weights as the pieces' volumes, first moments about the taxel small."""
    pad = replace(DOME, surface=SphereCap(9e-3), taxels=TaxelGrid(rows=3, columns=3, pitch=(1.2e-3, 1.2e-3)))
    sampling = layer_sampling(pad, 0, 3)
    feet = pad.feet(sampling.positions)[0]
    shares = sampling.average.toarray().reshape(9, 4, -1).sum(axis=1)
    drawn = np.random.default_rng(0).uniform(-1, 1, (400_000, 3))
    drawn = drawn[(drawn**2).sum(axis=1) < 1] * pad.sampling_radius
    for taxel, centre in enumerate(pad.taxel_points(0)):
        above = pad.surface.positions(0, 0, 0)[2] - 9e-3
        depth = 9e-3 - np.linalg.norm(centre + drawn - [0, 0, above], axis=1)
        expected = np.mean(depth[depth > 0] < 1e-3)
        found = shares[taxel, feet[:, 2] < 1e-3].sum()
        # 200,000 drawn points are good for 0.1 %; the rule is of the first order in 0.5 mm over 9 mm.
        assert found == pytest.approx(expected, abs=4e-3)


def test_tractions_are_integrated_over_the_surface_itself():
    grid = sheet_mesh(DOME, COARSE).surface
    found = integrated_traction(grid, grid.sheet, lambda p, n: np.tile([0.0, 0.0, -1.0], (len(p), 1)))
    x, y = np.meshgrid(*(np.linspace(-h, h, 1201) for h in (4.5e-3, 3e-3)))
    stretch = DOME.surface.stretch(x, y)
    area = np.trapezoid(np.trapezoid(stretch, x[0], axis=1), y[:, 0])
    assert found.area == pytest.approx(area, rel=1e-6)
    assert found.forces[..., 2].sum() == pytest.approx(-found.area, rel=1e-12)
    # A closed pressure: the force of a uniform pressure along z is that on the projection.
    pressed = integrated_traction(grid, box(-2e-3, -1e-3, 1e-3, 2e-3), lambda p, n: -n)
    assert pressed.forces[..., 2].sum() == pytest.approx(-9e-6, rel=1e-9)
    assert pressed.peak == pytest.approx(1.0)


def test_tractions_of_a_flat_pad_are_those_of_its_polygons(layered):
    hole = Point(0.3e-3, 0.2e-3).buffer(2e-3).difference(box(0, 0, 1e-3, 1e-3))
    load = SurfaceLoad.from_tractions(layered, hole, lambda p, n: np.tile([1.0, -2.0, -3.0], (len(p), 1)))
    exact = layered.surface.nodal_integrals(hole)[0][..., None] * [1.0, -2.0, -3.0]
    np.testing.assert_allclose(load.forces, exact, rtol=0, atol=1e-12 * np.abs(exact).max())
    assert load.contact_area == pytest.approx(hole.area)


def test_tractions_that_are_none_are_refused(dome):
    disc = Point(0, 0).buffer(1e-3)
    with pytest.raises(ContactError, match=r"shape \(\d+,\)"):
        SurfaceLoad.from_tractions(dome, disc, lambda p, n: p[:, 0])
    for wrong in (lambda p, n: 1j * n, lambda p, n: np.full(p.shape, "7"), lambda p, n: [[1, 2], [3]]):
        with pytest.raises(ContactError, match="real numbers"):
            SurfaceLoad.from_tractions(dome, disc, wrong)
    with pytest.raises(ContactError, match=r"nan.* at x = "):
        SurfaceLoad.from_tractions(dome, disc, lambda p, n: np.where(p[:, :1] > 0.5e-3, np.nan, n))
    with pytest.raises(FootprintError, match="covers none"):
        SurfaceLoad.from_tractions(dome, Point(1.0, 0).buffer(1e-3), lambda p, n: n)


@pytest.mark.parametrize("pad", [LAYERED_PAD, DOME], ids=["flat", "dome"])
def test_free_taxels_read_as_those_of_a_grid(pad):
    """Points where a grid has its taxels read what the grid reads, in their own order and with balls of their own."""
    points = np.concatenate([pad.taxel_points(k) for k in range(3)])
    order = np.random.default_rng(3).permutation(len(points))
    # Sizes of elements go by the shallowest taxel, so that both have one mesh.
    free = replace(pad, taxels=FreeTaxels(points[order]), depths=())  # type: ignore[arg-type]
    grids, frees = in_double_precision(pad, COARSE), in_double_precision(free, COARSE)
    expected = grids.readings(off_the_middle(grids)).ravel()[order]
    found = frees.readings(off_the_middle(frees))
    assert found.shape == (60,)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert frees.stress(off_the_middle(frees)).shape == (6, 60)
    radii = np.where(np.arange(60) == 7, 0.3e-3, 0.5e-3)
    smaller = in_double_precision(
        replace(free, taxels=FreeTaxels(points[order], tuple(radii))), COARSE  # type: ignore[arg-type]
    )  # fmt: skip
    changed = smaller.readings(off_the_middle(smaller)) != pytest.approx(found, rel=1e-9)
    assert changed


def test_a_load_rolled_about_a_cylinder_gives_rolled_readings():
    """The patch that rolls by 15 degrees reads the same 15 degrees on; far sides, which do not roll, are far away."""
    turn, radius = np.radians(15.0), 8e-3
    roll = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    axis = np.array([0.0, 0.0, -radius])
    angles, across = np.radians([-12.0, -5.0, 0.0, 4.0, 9.0]), np.array([-1e-3, 0.0, 1.5e-3])
    a, y, depth = (grid.ravel() for grid in np.meshgrid(angles, across, [0.6e-3, 1.2e-3], indexing="ij"))
    points = np.column_stack([(radius - depth) * np.sin(a), y, (radius - depth) * np.cos(a) - radius])
    rolled = (points - axis) @ roll.T + axis
    pad = Pad(
        size=(13.2e-3, 8e-3),
        layers=(Layer(thickness=1.8e-3, young=1e6, poisson=0.45),),
        taxels=np.concatenate([points, rolled]),  # type: ignore[arg-type]
        sampling_radius=0.3e-3,
        surface=CylinderSector(radius),
    )
    density = MeshDensity(
        in_plane_size=0.3, through_size=0.25, rim_grading=1.2, base_grading=1.0, points_per_axis=(2,)
    )  # fmt: skip
    influence = in_double_precision(pad, density)

    def load(around: float, turned: np.ndarray) -> SurfaceLoad:
        west, east = (radius * np.sin(around + side) for side in (-0.2, 0.2))
        push = np.array([300.0, 500.0, -2e3])
        return SurfaceLoad.from_tractions(
            influence, box(west, -1.5e-3, east, 1.5e-3), lambda p, n: -5e3 * n + turned @ push
        )

    first = influence.readings(load(0.0, np.eye(3)))[: len(points)]
    second = influence.readings(load(turn, roll))[len(points) :]
    assert np.linalg.norm(second - first) < 0.01 * np.linalg.norm(first)
