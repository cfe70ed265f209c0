"""Influence matrices applied to loads: shapes, batches, scale, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import InfluenceError
from mjtactile.fidelity import Fidelity
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad


def star_load(influence: InfluenceMatrices, force: tuple[float, float, float] = (0.02, 0.01, -0.1)) -> SurfaceLoad:
    outline = indenter_outline("star", shift=(1.25e-3, 0.0), rotate_deg=20)
    return contact_load(influence, Footprint.from_outline(outline, influence.surface), force)


def punch_loads(influence: InfluenceMatrices) -> list[SurfaceLoad]:
    """The seven punches here and there: 14 loads, enough for a dense product."""
    outlines = [indenter_outline(n, shift=s) for n in INDENTER_NAMES for s in ((0.0, 0.0), (1.25e-3, -1.25e-3))]
    return [contact_load(influence, Footprint.from_outline(o, influence.surface), (0.02, 0, -0.1)) for o in outlines]


def test_one_load_gives_one_set_of_readings(draft):
    readings = draft.readings(star_load(draft))
    assert readings.shape == (4, 13, 13)
    assert readings.dtype == np.float64
    assert (readings > 0).all()
    assert draft.stress(star_load(draft)).shape == (6, 4, 13, 13)


@pytest.mark.parametrize("count", [0, 1, 2, 9])
def test_a_sequence_of_loads_gives_a_batch_axis(count, draft):
    loads = [star_load(draft)] * count
    assert draft.readings(loads).shape == (count, 4, 13, 13)
    assert draft.readings(tuple(loads)).shape == (count, 4, 13, 13)
    assert draft.stress(loads).shape == (count, 6, 4, 13, 13)


def test_rows_lie_along_y_and_columns_along_x(draft):
    footprint = Footprint.from_outline(indenter_outline("circle", shift=(2.5e-3, -5e-3), scale=0.3), draft.surface)
    readings = draft.readings(contact_load(draft, footprint, (0, 0, -0.1)))
    assert np.unravel_index(readings[0].argmax(), readings[0].shape) == (2, 8)
    for layer in readings:
        assert layer.sum(axis=0) @ draft.pad.grid.x > 0
        assert layer.sum(axis=1) @ draft.pad.grid.y < 0


def test_shallow_layers_come_first(draft):
    footprint = Footprint.from_outline(indenter_outline("circle", scale=0.3), draft.surface)
    peaks = draft.readings(contact_load(draft, footprint, (0, 0, -0.1))).max(axis=(1, 2))
    assert (np.diff(peaks) < 0).all()


@pytest.mark.parametrize("count", [3, 14], ids=["few", "many"])
def test_batch_gives_what_single_loads_give(count, draft):
    loads = punch_loads(draft)[:count]
    single = np.stack([draft.readings(load) for load in loads])
    # Sums in single precision, in another order.
    np.testing.assert_allclose(draft.readings(loads), single, rtol=3e-6)
    stress = np.stack([draft.stress(load) for load in loads])
    np.testing.assert_allclose(draft.stress(loads), stress, atol=3e-6 * np.abs(stress).max())


def test_batch_of_loads_in_one_place_gives_what_single_loads_give(draft):
    """Only the columns under them are used."""
    outlines = [indenter_outline("circle", shift=(4e-3 + k * 1e-4, -3e-3), scale=0.2) for k in range(10)]
    loads = [contact_load(draft, Footprint.from_outline(o, draft.surface), (0.02, 0, -0.02)) for o in outlines]
    single = np.stack([draft.readings(load) for load in loads])
    np.testing.assert_allclose(draft.readings(loads), single, rtol=3e-6)  # single precision


def test_batch_of_small_and_large_loads_keeps_the_small_ones_digits(draft):
    """From 1e-42 to 1e36 times the load: scaled together, the small ones would vanish in single precision."""
    scales = [10.0 ** (6 * k - 42) for k in range(14)]
    loads = [
        SurfaceLoad(load.forces * scale, load.surface, load.contact)
        for load, scale in zip(punch_loads(draft), scales, strict=True)
    ]
    single = np.stack([draft.readings(load) for load in loads])
    np.testing.assert_allclose(draft.readings(loads), single, rtol=3e-6)  # single precision, at every magnitude


@pytest.mark.parametrize("decade", range(-9, 10, 3))
@pytest.mark.parametrize("name", ["draft", "coarse_square"])
def test_readings_scale_with_the_load(name, decade, request):
    influence = request.getfixturevalue(name)
    load = star_load(influence)
    scaled = SurfaceLoad(load.forces * 10.0**decade, load.surface, load.contact)
    expected = influence.readings(load) * 10.0**decade
    # Rounding of the load's own forces; in single-precision tables it may tip the rounding of a scaled force.
    np.testing.assert_allclose(influence.readings(scaled), expected, rtol=1e-12 if name == "coarse_square" else 1e-6)


def test_a_power_of_two_scales_readings_exactly(draft):
    load = star_load(draft)
    scaled = SurfaceLoad(load.forces * 2.0**-20, load.surface, load.contact)
    np.testing.assert_array_equal(draft.readings(scaled), draft.readings(load) * 2.0**-20)


def test_pressing_and_pulling_read_the_same(draft):
    load = star_load(draft)
    opposite = SurfaceLoad(-load.forces, load.surface, load.contact)
    np.testing.assert_array_equal(draft.readings(opposite), draft.readings(load))
    np.testing.assert_array_equal(draft.stress(opposite), -draft.stress(load))


def test_no_load_reads_zero(draft):
    none = SurfaceLoad.none(draft.surface)
    assert not draft.readings(none).any()
    assert not draft.stress(none).any()
    assert not draft.surface_displacement(none).any()
    together = draft.readings([none, star_load(draft)])
    assert not together[0].any()
    assert together[1].any()


def test_same_load_gives_the_same_bits(draft):
    load = star_load(draft)
    np.testing.assert_array_equal(draft.readings(load), draft.readings(load))


def test_load_of_another_grid_is_refused(draft):
    other = InfluenceMatrices(Pad(), Fidelity(mesh="default"), {})
    with pytest.raises(
        InfluenceError, match=r"shape \(41, 41, 3\), but this surface takes \(\d+, \d+, 3\).*another pad"
    ):
        draft.readings(star_load(other))
    with pytest.raises(InfluenceError, match="another pad or mesh"):
        draft.stress([star_load(draft), star_load(other)])


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_forces_that_are_no_numbers_are_refused(bad, draft):
    load = star_load(draft)
    load.forces[3, 2, 1] = bad
    with pytest.raises(InfluenceError, match="NaN or infinite nodal forces"):
        draft.readings(load)


def test_surface_sinks_under_a_press_and_moves_with_a_shear(draft):
    """The mean sinking under a circle is where the compliance's sign and the axes' order show."""
    footprint = Footprint.from_outline(indenter_outline("circle"), draft.surface)
    middle = np.s_[draft.surface.y.node_count // 2, draft.surface.x.node_count // 2]
    pressed = draft.surface_displacement(contact_load(draft, footprint, (0, 0, -0.1)))
    assert pressed.shape == (*draft.surface.node_shape, 3)
    assert pressed[middle][2] < 0
    assert np.abs(pressed[middle][:2]).max() < 1e-6 * -pressed[middle][2]
    oblique = contact_load(draft, footprint, (0, 0.1, -0.1), moment=(0, 0, 0))
    straight = contact_load(draft, footprint, (0, 0, -0.1), moment=(0, 0, 0))
    sheared = draft.surface_displacement(oblique) - draft.surface_displacement(straight)
    assert sheared[middle][1] > 0
    assert abs(sheared[middle][0]) < 1e-6 * sheared[middle][1]


def test_one_layer_sensor_reads_what_the_four_layer_sensor_reads_there(draft):
    single = influence_matrices(Pad(depths=(1e-3,)), fidelity=Fidelity(mesh="draft"), progress=False)
    readings = single.readings(star_load(single))
    assert readings.shape == (1, 13, 13)
    np.testing.assert_allclose(readings[0], draft.readings(star_load(draft))[0], rtol=1e-5)  # single precision
    assert single.nbytes < 0.5 * draft.nbytes


def test_mesh_is_known_by_name(draft, coarse_square):
    assert draft.mesh_name == "draft"
    assert coarse_square.mesh_name == "custom"


@pytest.mark.parametrize("name", ["draft", "layered"])
def test_readings_are_those_of_the_response(name, request):
    influence = request.getfixturevalue(name)
    outlines = [indenter_outline("star", shift=(x, 0.4e-3), rotate_deg=20, scale=0.45) for x in (0.0, 1e-3, -1.5e-3)]
    loads = [
        contact_load(influence, Footprint.from_outline(o, influence.surface), (0.02, 0.01, -0.1)) for o in outlines
    ]
    response = influence.point_response(loads)
    assert response.shape == (3, influence.sample_slices[-1].stop, 5)
    # The compiled core sums in another order.
    np.testing.assert_allclose(influence.readings_of(response), influence.readings(loads), rtol=2e-6)
    np.testing.assert_array_equal(influence.readings_of(response[1]), influence.readings_of(response)[1])
    single = influence.point_response(loads[1])
    np.testing.assert_allclose(single, response[1], rtol=0, atol=1e-6 * np.abs(single).max())  # single precision
    assert influence.point_response([]).shape == (0, *single.shape)


def test_response_to_a_sum_is_the_sum_of_responses(layered):
    """Six loads as a basis: readings of a combination are those of the combined load; in double precision."""
    outline = indenter_outline("star", shift=(1e-3, 0.4e-3), rotate_deg=20, scale=0.45)
    footprint = Footprint.from_outline(outline, layered.surface)
    units = [contact_load(layered, footprint, (0.02 * (k % 3), 0.01 * k, -0.1 - 0.02 * k)) for k in range(6)]
    weights = np.array([0.3, -1.2, 0.8, 2.0, -0.4, 0.1])
    combined = SurfaceLoad(np.tensordot(weights, [unit.forces for unit in units], axes=1), layered.surface, outline)
    basis = layered.point_response(units)
    response = np.tensordot(weights, basis, axes=1)
    expected = layered.readings(combined)
    np.testing.assert_allclose(layered.readings_of(response), expected, rtol=1e-10)
    narrow = np.tensordot(weights.astype(np.float32), basis.astype(np.float32), axes=1)
    np.testing.assert_allclose(layered.readings_of(narrow), expected, rtol=1e-5)  # single precision


def test_response_lies_layer_by_layer_and_points_along_the_pads_axes(layered):
    """Its mean over a taxel's points is the deviatoric part of the mean stress tensor."""
    footprint = Footprint.from_outline(indenter_outline("star", shift=(1e-3, 0.4e-3), scale=0.45), layered.surface)
    load = contact_load(layered, footprint, (0.03, 0.02, -0.1))
    response, stress = layered.point_response(load), layered.stress(load)
    for k, (of_layer, average) in enumerate(zip(layered.sample_slices, layered.averages, strict=True)):
        xx, yy, zz, xy, yz, zx = stress[:, k].reshape(6, -1)
        expected = np.stack(
            [
                1.5 * (zz - (xx + yy + zz) / 3),
                np.sqrt(3) / 2 * (xx - yy),
                np.sqrt(3) * xy,
                np.sqrt(3) * yz,
                np.sqrt(3) * zx,
            ]
        )
        np.testing.assert_allclose((average @ response[of_layer]).T, expected, atol=1e-12 * np.abs(expected).max())


def test_response_of_other_matrices_is_refused(draft, layered):
    with pytest.raises(InfluenceError, match=r"shape \(5, 5\), but these influence matrices make .*with others"):
        draft.readings_of(np.zeros((5, 5)))
    with pytest.raises(InfluenceError, match="with others"):
        layered.readings_of(np.zeros((2, draft.sample_slices[-1].stop, 5)))


def test_a_symmetric_press_reads_one_class_only(draft):
    """Rounding puts forces of 1e-17 of the load into the others, which would quadruple the work."""
    footprint = Footprint.from_outline(indenter_outline("circle"), draft.surface)
    load = contact_load(draft, footprint, (0, 0, -0.1))
    forces = load.forces.copy()
    forces[3, 4] += 1e-17 * np.abs(forces).max()
    loads, _ = draft._folded(SurfaceLoad(forces, load.surface, load.contact))
    assert [bool(of_class.runs) for of_class in loads.classes] == [True, False, False, False]
    np.testing.assert_allclose(
        draft.readings(SurfaceLoad(forces, load.surface, load.contact)), draft.readings(load), rtol=1e-6
    )


def test_plain_matrices_say_so(draft, coarse_square):
    assert draft.fidelity == Fidelity(mesh="draft", precision="float32", reduction=0.0, law="uniform", cells=400)
    assert coarse_square.fidelity.precision == "float64"
    assert coarse_square.density == coarse_square.fidelity.mesh
