"""The layered sheet without a mesh, checked against closed forms; and tables of the package checked against it."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from bonded_layer import stresses
from layered_sheet import LayeredSheet, PatchTraction, readings

from mjtactile.fidelity import Fidelity, MeshDensity
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Layer, Pad, TaxelGrid

PERIOD = 40e-3
RUBBER = Layer(thickness=4e-3, young=2e6, poisson=0.4)
PATCHES = (
    PatchTraction((0.3e-3, -0.2e-3), (2e-3, 1e-3), (4e3, -3e3, -1e4)),
    PatchTraction((-1e-3, 1e-3), (0.5e-3, 0.5e-3), (0.0, 5e3, -2e4)),
)
X, Y = np.array([-1.3e-3, 0.0, 0.4e-3, 2e-3]), np.array([-0.5e-3, 0.1e-3, 1.7e-3])


def love(width: float, height: float, depth: float) -> float:
    """Axial stress under the middle of a rectangle under unit pressure on a half space (Love 1929)."""
    a, b = width / 2, height / 2
    r1, r2, r3 = np.hypot(a, depth), np.hypot(b, depth), np.sqrt(a**2 + b**2 + depth**2)
    return -2 / np.pi * (np.arctan(a * b / (depth * r3)) + a * b * depth / r3 * (1 / r1**2 + 1 / r2**2))


def test_under_a_rectangle_on_a_deep_layer_stress_is_loves():
    deep = Layer(thickness=0.1, young=2e6, poisson=0.3)
    for depth in (0.5e-3, 1e-3, 2e-3):
        found = LayeredSheet((deep,), 0.1, depth).stress([PatchTraction((0, 0), (2e-3, 1e-3), (0, 0, -1))], depth)
        np.testing.assert_allclose(found.at(np.zeros(1), np.zeros(1))[0, 0, 2], love(2e-3, 1e-3, depth), rtol=2e-3)


def test_far_from_a_small_load_on_a_deep_layer_stress_is_mindlins():
    """Under a tangential point force on a half space, stress is radial: -3 F x / (2 pi R^5) times x_i x_j, if nu = 1/2.

    Cerruti; Johnson, Contact Mechanics, 1985, eq. 3.76.
    """
    almost = Layer(thickness=0.1, young=2e6, poisson=0.49999)
    size, place = 0.1e-3, np.array([1.5e-3, -1e-3, -1.2e-3])
    load = PatchTraction((0.0, 0.0), (size, size), (1 / size**2, 0.0, 0.0))
    found = LayeredSheet((almost,), 0.1, -place[2]).stress([load], -place[2]).at(place[:1], place[1:2])[0, 0]
    x, y, z = place
    radial = -3 * x / (2 * np.pi * np.linalg.norm(place) ** 5)
    # A cell that repeats adds a pressure, which has no part in the deviator.
    expected = radial * np.array([x * x - z * z, y * y - z * z, x * y, y * z, z * x])
    np.testing.assert_allclose([found[0] - found[2], found[1] - found[2], *found[3:]], expected, atol=5e-3 * 1e5)


def test_a_small_load_gives_the_stress_of_hankel_transforms():
    """A Hertzian disc whose second moment is that of the square: they differ by the fourth power of size over depth."""
    side, x = 0.1e-3, np.array([0.0, 0.5e-3, 1e-3, 2e-3])
    load = PatchTraction((0.0, 0.0), (side, side), (0.0, 0.0, -1 / side**2))
    found = LayeredSheet((RUBBER,), PERIOD, 1e-3).stress([load], 1e-3).at(x, np.zeros(1))[0]
    disc = stresses(RUBBER, side * np.sqrt(5 / 12), np.array([1e-3]), x)[0]
    expected = disc * [1, 1, 1, -1]  # there z runs downward
    np.testing.assert_allclose(found[:, [0, 1, 2, 5]], expected, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("depth", [0.5e-3, 1.5e-3, 3.9e-3])
def test_layers_of_one_material_are_one_layer(depth):
    parts = tuple(Layer(thickness=t, young=RUBBER.young, poisson=RUBBER.poisson) for t in (1.5e-3, 0.4e-3, 2.1e-3))
    one, three = (LayeredSheet(layers, PERIOD, depth).stress(PATCHES, depth) for layers in ((RUBBER,), parts))
    np.testing.assert_allclose(three.at(X, Y), one.at(X, Y), rtol=1e-7, atol=1e-4)


def test_every_level_carries_the_force_and_tractions_pass_interfaces():
    layers = (
        Layer(thickness=1e-3, young=5e4, poisson=0.499),
        Layer(thickness=0.2e-3, young=5e7, poisson=0.3),
        Layer(thickness=2e-3, young=1e6, poisson=0.45),
    )
    force = np.sum([np.multiply(patch.traction, np.prod(patch.size)) for patch in PATCHES], axis=0)
    sheet, whole = LayeredSheet(layers, PERIOD, 0.5e-3), np.arange(512) * PERIOD / 512
    for depth in (0.5e-3, 1.1e-3, 3e-3):
        mean = sheet.stress(PATCHES, depth).at(whole, whole).mean(axis=(0, 1)) * PERIOD**2
        np.testing.assert_allclose(mean[[5, 4, 2]], force, rtol=1e-5)
    above, below = (sheet.stress(PATCHES, depth).at(X, Y) for depth in (1e-3, 1e-3 + 1e-10))
    np.testing.assert_allclose(below[..., [2, 4, 5]], above[..., [2, 4, 5]], rtol=1e-4, atol=1.0)
    assert np.abs(below[..., 0] / above[..., 0]).max() > 10  # stress along the interface jumps


def test_stress_is_in_equilibrium():
    step, sheet = 2e-6, LayeredSheet((RUBBER,), PERIOD, 1e-3)
    places = X[1] + step * np.arange(-1, 2), Y[1] + step * np.arange(-1, 2)
    levels = [sheet.stress(PATCHES, 1.2e-3 - step * move).at(*places) for move in (-1, 0, 1)]  # z runs upward
    xx, yy, zz, xy, yz, zx = np.moveaxis(np.stack(levels), -1, 0)
    slope = lambda part, axis: np.gradient(part, step, axis=axis)[1, 1, 1]  # noqa: E731
    for rows in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)):
        slopes = [slope(part, axis) for part, axis in zip(rows, (2, 1, 0), strict=True)]
        assert abs(sum(slopes)) < 1e-4 * np.abs(slopes).max()


#: A wide pad with a soft layer on a stiff one, and taxels that an interface cuts. Sides are three thicknesses away.
WIDE = Pad(
    size=(14e-3, 12e-3),
    layers=(Layer(thickness=1.2e-3, young=3e5, poisson=0.45), Layer(thickness=0.8e-3, young=5e6, poisson=0.4)),
    taxels=TaxelGrid(rows=4, columns=4, pitch=(1e-3, 1e-3)),
    depths=(0.7e-3, 1.2e-3),
    sampling_radius=0.4e-3,
)
TOUCH = {
    "pressure": PatchTraction((0.2e-3, -0.3e-3), (1.6e-3, 1.1e-3), (0.0, 0.0, -1e4)),
    "shear": PatchTraction((0.2e-3, -0.3e-3), (1.6e-3, 1.1e-3), (5e3, -8e3, 0.0)),
    "both": PatchTraction((-0.4e-3, 0.5e-3), (2.5e-3, 1.7e-3), (3e3, 3e3, -1e4)),
}


def test_tables_of_a_wide_pad_have_the_exact_readings_of_layers_under_pressure_and_shear():
    density = MeshDensity(
        in_plane_size=0.45, through_size=0.25, rim_grading=1.0, base_grading=1.0, points_per_axis=(2,)
    )
    influence = influence_matrices(WIDE, Fidelity(mesh=density), progress=False, cache=False)
    for name, patch in TOUCH.items():
        found, exact = influence.readings(_load(influence, patch)), readings(WIDE, [patch], period=24e-3, points=2)
        errors = np.linalg.norm(found - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
        # Up to 5 and 1.5 %; elements two thirds as wide halve both.
        assert (errors < [0.06, 0.02]).all(), (name, errors)


def _load(influence: InfluenceMatrices, patch: PatchTraction) -> SurfaceLoad:
    (x, y), (width, height) = patch.middle, patch.size
    outline = shapely.box(x - width / 2, y - height / 2, x + width / 2, y + height / 2)
    return SurfaceLoad.from_tractions(influence, outline, lambda points, _: np.tile(patch.traction, (len(points), 1)))
