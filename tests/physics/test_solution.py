"""What every linear elastic solution obeys: balance, reciprocity, symmetry, superposition.

And that the way the equations are solved, by quarters and by dissection, changes nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg
from small_pads import COARSE, DOME, LAYERED_PAD, in_double_precision, without_tables

from mjtactile._types import Array
from mjtactile.cli.benchmarks.direct import relative_difference, solve
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.fem.dissection import DissectedPad
from mjtactile.fem.elements import SweptElements
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.stress import von_mises
from mjtactile.fem.symmetry import BOTH, free_in_plane
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad

PADS = {"paper's": Pad(), "layered": LAYERED_PAD}


def random_load(influence: InfluenceMatrices, seed: int) -> SurfaceLoad:
    """Random forces in every direction on every surface node: no symmetry, no smoothness."""
    shape = (*influence.surface.node_shape, 3)
    forces = np.random.default_rng(seed).standard_normal(shape)
    return SurfaceLoad(forces, influence.surface, influence.surface.sheet)


def oblique_load(influence: InfluenceMatrices) -> SurfaceLoad:
    """A star, turned and off the middle, pressed obliquely, with torsion."""
    outline = indenter_outline("star", shift=(1e-3, 0.4e-3), rotate_deg=20, scale=0.45)
    footprint = Footprint.from_outline(outline, influence.surface)
    return contact_load(influence, footprint, (0.03, 0.02, -0.1), moment=(-4e-5, 1.1e-4, 2e-5))


def mirrored(load: SurfaceLoad, axis: int) -> SurfaceLoad:
    """The load seen in the mirror x -> -x (axis 0) or y -> -y (axis 1)."""
    forces = np.flip(load.forces, axis=1 - axis).copy()
    forces[..., axis] *= -1
    return SurfaceLoad(forces, load.surface, load.contact)


def over_the_diagonal(load: SurfaceLoad) -> SurfaceLoad:
    """The load with x and y exchanged."""
    return SurfaceLoad(load.forces.transpose(1, 0, 2)[..., [1, 0, 2]], load.surface, load.contact)


def surface_work(displacement: Array, load: SurfaceLoad) -> float:
    return float(np.einsum("yxc,yxc->", displacement, load.forces))


@pytest.mark.parametrize("pad", [*PADS.values(), DOME], ids=[*PADS, "dome"])
def test_base_carries_the_applied_force_and_moment(pad):
    influence = without_tables(pad, COARSE)
    loads = [oblique_load(influence), random_load(influence, 1)]
    reactions = solve(pad, COARSE, loads).base_reaction
    place = SweptElements(sheet_mesh(pad, COARSE)).nodes
    for load, reaction in zip(loads, reactions, strict=True):
        size = np.linalg.norm(load.forces.reshape(-1, 3), axis=1).sum()
        # Rounding, through a stiffness of condition 1e5.
        np.testing.assert_allclose(reaction.sum(axis=(0, 1)), -load.forces.sum(axis=(0, 1)), atol=1e-9 * size)
        carried, pressed = np.cross(place[0], reaction), np.cross(place[-1], load.forces)
        np.testing.assert_allclose(carried.sum(axis=(0, 1)), -pressed.sum(axis=(0, 1)), atol=1e-9 * size * pad.size[0])


@pytest.mark.parametrize("name", ["coarse_square", "layered"])
def test_compliance_is_reciprocal(name, request):
    """Betti: the work of one load through the displacement of another is the same the other way round."""
    influence = request.getfixturevalue(name)
    first, second = oblique_load(influence), random_load(influence, 2)
    there = surface_work(influence.surface_displacement(first), second)
    back = surface_work(influence.surface_displacement(second), first)
    assert there == pytest.approx(back, rel=1e-12)  # rounding
    assert there != 0


@pytest.mark.parametrize("name", ["coarse_square", "layered"])
def test_compliance_is_symmetric_and_positive(name, request):
    tables = request.getfixturevalue(name).tables
    for parity in BOTH.classes:
        signs = "".join("+" if sign > 0 else "-" for sign in (parity.x, parity.y))
        compliance = tables[f"compliance {signs}"]
        # Rounding.
        np.testing.assert_allclose(compliance, compliance.T, atol=1e-12 * np.abs(compliance).max())
        assert np.linalg.eigvalsh(compliance)[0] > 0


@pytest.mark.parametrize("axis", [0, 1], ids=["x", "y"])
def test_mirrored_load_gives_mirrored_stress(axis, coarse_square):
    load = random_load(coarse_square, 3)
    readings, stress = coarse_square.readings(load), coarse_square.stress(load)
    image = mirrored(load, axis)
    np.testing.assert_allclose(  # rounding
        coarse_square.readings(image), np.flip(readings, axis=2 - axis), rtol=1e-12
    )
    signs = np.array([1, 1, 1, -1, 1, -1] if axis == 0 else [1, 1, 1, -1, -1, 1])[:, None, None, None]
    expected = signs * np.flip(stress, axis=3 - axis)
    np.testing.assert_allclose(coarse_square.stress(image), expected, atol=1e-12 * np.abs(stress).max())
    # The load has no such symmetry itself.
    assert relative_difference(np.flip(readings, axis=2 - axis), readings) > 0.1


def test_load_over_the_diagonal_gives_stress_over_the_diagonal(coarse_square):
    load = random_load(coarse_square, 4)
    readings, stress = coarse_square.readings(load), coarse_square.stress(load)
    image = over_the_diagonal(load)
    swapped, swapped_stress = coarse_square.readings(image), coarse_square.stress(image)
    # Rounding: the two in-plane directions are summed in a different order.
    np.testing.assert_allclose(swapped, readings.transpose(0, 2, 1), rtol=1e-10)
    expected = stress.transpose(0, 1, 3, 2)[[1, 0, 2, 3, 5, 4]]
    np.testing.assert_allclose(swapped_stress, expected, atol=1e-10 * np.abs(stress).max())
    assert relative_difference(readings.transpose(0, 2, 1), readings) > 0.1


@pytest.mark.parametrize("name", ["coarse_square", "layered"])
def test_stress_and_displacement_superpose(name, request):
    influence = request.getfixturevalue(name)
    first, second = oblique_load(influence), random_load(influence, 6)
    both = SurfaceLoad(2 * first.forces - 3 * second.forces, first.surface, first.contact)
    expected = 2 * influence.stress(first) - 3 * influence.stress(second)
    # Rounding.
    np.testing.assert_allclose(influence.stress(both), expected, atol=1e-12 * np.abs(expected).max())
    expected = 2 * influence.surface_displacement(first) - 3 * influence.surface_displacement(second)
    np.testing.assert_allclose(influence.surface_displacement(both), expected, atol=1e-12 * np.abs(expected).max())


def test_one_sample_point_reads_the_von_mises_stress_of_the_tensor():
    """With one point per ball the reading is the norm of that point's stress, which `stress` returns."""
    influence = in_double_precision(LAYERED_PAD, replace(COARSE, points_per_axis=(1,)))
    load = oblique_load(influence)
    xx, yy, zz, xy, yz, zx = influence.stress(load)
    # Balls that an interface cuts still have one point on each side.
    one_point = [k for k, depth in enumerate(LAYERED_PAD.depths) if len(pieces(LAYERED_PAD, depth)) == 1]
    squares = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2 + 6 * (xy**2 + yz**2 + zx**2)
    assert one_point
    expected = np.sqrt(squares / 2)[one_point]
    np.testing.assert_allclose(influence.readings(load)[one_point], expected, rtol=1e-12)  # rounding


def pieces(pad: Pad, depth: float) -> list[float]:
    inside = [z for z in pad.interfaces if abs(z + depth) < pad.sampling_radius]
    return [depth, *inside]


def test_sheet_that_does_not_spread_is_compressed_uniformly():
    """Poisson ratio 0, pressure p all over: sigma_zz = -p and nothing else, everywhere, the rim and layers included."""
    layers = tuple(replace(layer, poisson=0.0) for layer in LAYERED_PAD.layers)
    influence = in_double_precision(replace(LAYERED_PAD, layers=layers), COARSE)
    sheet = Footprint.from_outline(influence.surface.sheet, influence.surface)
    pressure = 1000.0
    load = contact_load(influence, sheet, (0, 0, -pressure * sheet.area))
    stress, sinking = influence.stress(load), -influence.surface_displacement(load)[..., 2]
    expected = np.zeros_like(stress)
    expected[2] = -pressure
    # Rounding, through a stiffness of condition 1e5.
    np.testing.assert_allclose(stress, expected, atol=1e-10 * pressure)
    np.testing.assert_allclose(influence.readings(load), pressure, rtol=1e-10)
    np.testing.assert_allclose(sinking, sum(pressure * t.thickness / t.young for t in layers), rtol=1e-10)


def whole_pad(pad: Pad) -> tuple[SweptElements, DissectedPad]:
    mesh = sheet_mesh(pad, COARSE)
    elements = SweptElements(mesh)
    return elements, DissectedPad(elements, free_in_plane(mesh, None))


@pytest.mark.parametrize("name", PADS)
def test_quarter_models_together_are_the_full_model(name, request):
    """A random load, solved on the whole sheet at once and by four quarters: displacement of every surface node."""
    quarters = request.getfixturevalue("coarse_square" if name == "paper's" else "layered")
    load = random_load(quarters, 7)
    _, equations = whole_pad(PADS[name])
    displacements = np.zeros((equations.count, 1))
    displacements[equations.surface, 0] = np.moveaxis(load.forces, -1, 0).ravel()
    whole = equations.nodal(equations.solve(displacements))[-1, ..., 0]
    # Rounding, through a stiffness of condition 1e5.
    assert relative_difference(quarters.surface_displacement(load), whole) < 1e-11


@pytest.mark.parametrize("pad", [*PADS.values(), DOME], ids=[*PADS, "dome"])
def test_dissection_solves_the_assembled_equations(pad):
    """Displacements under forces on all unknowns against a sparse direct solution of the whole matrix."""
    elements, equations = whole_pad(pad)
    forces = np.random.default_rng(8).standard_normal((equations.count, 2))
    expected = scipy.sparse.linalg.splu(equations.restricted(elements.matrix()).tocsc()).solve(forces)
    # Rounding, through a stiffness of condition 1e5.
    assert relative_difference(equations.solve(forces.copy()), expected) < 1e-10


@pytest.mark.parametrize("parity", BOTH.classes, ids=lambda p: f"{p.x:+d}{p.y:+d}")
def test_quarter_model_is_held_where_its_class_is_odd(parity):
    mesh = sheet_mesh(LAYERED_PAD, COARSE).quarter()
    free = free_in_plane(mesh, parity).reshape(3, mesh.y.node_count, mesh.x.node_count)
    for component in range(3):
        sign_x, sign_y = parity.component_signs(component)
        assert free[component, 1:, 0].all() == (sign_x > 0)
        assert free[component, 0, 1:].all() == (sign_y > 0)
        assert free[component, 1:, 1:].all()


@pytest.mark.parametrize("name", ["coarse_square", "layered"])
def test_tables_hold_what_the_elements_answer(name, request):
    """Readings through tables of all columns against a solution for the load itself."""
    influence = request.getfixturevalue(name)
    loads = [oblique_load(influence), random_load(influence, 9)]
    response = solve(influence.pad, COARSE, loads)
    np.testing.assert_allclose(influence.readings(loads), response.readings, rtol=1e-10)  # rounding
    displacement = influence.surface_displacement(loads[1])
    np.testing.assert_allclose(displacement, response.displacement[1], atol=1e-12 * np.abs(displacement).max())


def test_readings_average_norms_not_stresses(coarse_square):
    """A reading is at least the von Mises stress of the ball's mean stress, and more where stress varies."""
    load = oblique_load(coarse_square)
    xx, yy, zz, xy, yz, zx = coarse_square.stress(load)
    of_mean = np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + zx**2))
    readings = coarse_square.readings(load)
    assert (readings >= of_mean * (1 - 1e-12)).all()
    assert (readings / of_mean).max() > 1.01


def test_von_mises_of_pure_states():
    stress = 7.0
    uniaxial = np.array([1.5 * (2 / 3), 0, 0, 0, 0]) * stress  # along z: s_zz = 2/3 sigma, s_xx = s_yy
    shear = np.array([0, 0, 0, np.sqrt(3), 0]) * stress
    assert von_mises(uniaxial) == pytest.approx(stress)
    assert von_mises(shear) == pytest.approx(np.sqrt(3) * stress)
