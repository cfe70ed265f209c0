"""Readings of mean stress: what they are, in whatever part of the pad a taxel lies, and how far from means of norms."""

from __future__ import annotations

import itertools
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from shapely import Point
from small_pads import COARSE, in_double_precision

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.storage import in_storage
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.influence.taxel_mean import material_cuts
from mjtactile.pad import Layer, Pad, TaxelGrid


def averaged(plain: InfluenceMatrices, averaging: str | tuple[str, ...]) -> InfluenceMatrices:
    return in_storage(plain, replace(plain.fidelity, averaging=averaging))


def load_on(influence: InfluenceMatrices) -> SurfaceLoad:
    return contact_load(
        influence, Footprint.from_outline(Point(1e-3, -0.4e-3).buffer(1.7e-3), influence.surface), (0.02, 0.01, -0.1)
    )


def von_mises_of(stress: np.ndarray) -> np.ndarray:
    xx, yy, zz, xy, yz, zx = stress
    normal = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2
    return np.sqrt(normal + 3 * (xy**2 + yz**2 + zx**2))


def test_readings_are_the_von_mises_stress_of_the_mean_stress(coarse_square):
    mean, load = averaged(coarse_square, "mean"), load_on(coarse_square)
    expected = coarse_square.stress(load)
    for readings in (mean.readings(load), mean.readings_of(mean.point_response(load))):
        np.testing.assert_allclose(readings, von_mises_of(expected), rtol=1e-9)
    np.testing.assert_allclose(mean.stress(load), expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())


def test_each_layer_is_averaged_in_its_own_way(draft):
    ways, load = ("points", "quarters", "mean", "points"), load_on(draft)
    readings = averaged(draft, ways).readings(load)
    for layer, way in enumerate(ways):
        expected = (draft if way == "points" else averaged(draft, way)).readings(load)
        np.testing.assert_allclose(readings[layer], expected[layer], rtol=1e-9)
    others = averaged(draft, "mean").readings(load)
    assert all(np.abs(readings[layer] / others[layer] - 1).max() > 1e-3 for layer in (0, 1, 3))


def part_means(
    influence: InfluenceMatrices, response: np.ndarray, sensing_layer: int, *, quartered: bool
) -> np.ndarray:
    """Mean von Mises stress (taxels,) of the parts of each taxel's ball, from the response at its points one by one."""
    pad, average = influence.pad, influence.averages[sensing_layer]
    signs = np.array([(*image, 1) for image in influence.mirrors.images])
    positions = (signs[:, None] * influence.tables[f"sampling points {sensing_layer}"]).reshape(-1, 3)
    depth, radius = pad.depths[sensing_layer], pad.sampling_radius
    ends = [max(depth - radius, 0), *(-z for z in pad.interfaces if abs(depth + z) < radius), depth + radius]
    slabs = [n for low, high in itertools.pairwise(ends) for n in np.linspace(low, high, 3)[1:]]
    of_layer = response[influence.sample_slices[sensing_layer]]
    readings = []
    for taxel, centre in enumerate(pad.taxel_points(sensing_layer)):
        entries = slice(*average.indptr[taxel : taxel + 2])
        points, weights = average.indices[entries], average.data[entries]
        parts = defaultdict(list)
        for n, point in enumerate(points):
            side = tuple(np.round((positions[point] - centre)[:2], 9) > 0) if quartered else ()
            parts[(*side, int(np.searchsorted(slabs, -positions[point, 2])) if len(ends) > 2 else 0)].append(n)
        readings.append(sum(np.linalg.norm(weights[inside] @ of_layer[points[inside]]) for inside in parts.values()))
    return np.array(readings)


@pytest.mark.parametrize("averaging", ["mean", "quarters"])
@pytest.mark.parametrize("pad", ["coarse_square", "layered"])
def test_readings_are_means_of_the_von_mises_stress_of_their_parts_mean_stress(pad, averaging, request):
    """On a sheet whose mirrors map taxels onto each other, and on one of three materials where they do not."""
    plain = request.getfixturevalue(pad)
    means, load = averaged(plain, averaging), load_on(plain)
    response = plain.point_response(load)
    readings = means.readings(load).reshape(plain.pad.sensing_layers, -1)
    for k, of_layer in enumerate(readings):
        expected = part_means(plain, response, k, quartered=averaging == "quarters")
        np.testing.assert_allclose(of_layer, expected, rtol=1e-9)
    np.testing.assert_allclose(means.readings_of(means.point_response(load)).ravel(), readings.ravel(), rtol=1e-9)
    stress = plain.stress(load)
    np.testing.assert_allclose(means.stress(load), stress, rtol=1e-9, atol=1e-11 * np.abs(stress).max())


def test_a_stiff_sheet_inside_a_ball_is_not_averaged_with_the_rubber_around_it():
    """Its stress changes sign across it. Taxels on a grid and free ones."""
    rubber, stiff = Layer(thickness=0.8e-3, young=5e5, poisson=0.45), Layer(thickness=0.2e-3, young=5e7, poisson=0.3)
    pad = Pad(
        size=(5e-3, 5e-3),
        layers=(rubber, stiff, rubber, rubber),
        taxels=TaxelGrid(rows=2, columns=3, pitch=(0.9e-3, 0.8e-3)),
        depths=(0.6e-3, 0.9e-3, 1.8e-3),
        sampling_radius=0.4e-3,
    )
    plain = in_double_precision(pad, COARSE)
    load = contact_load(
        plain, Footprint.from_outline(Point(2e-4, 1e-4).buffer(8e-4), plain.surface), (2e-3, 0.0, -0.02)
    )
    points, means = (averaged(plain, way).readings(load) for way in ("points", "mean"))
    assert (
        np.linalg.norm(means - points, axis=(1, 2)) < [0.08, 0.08, 0.05] * np.linalg.norm(points, axis=(1, 2))
    ).all()
    centres = np.concatenate([pad.taxel_points(k) for k in range(3)])
    free = in_double_precision(replace(pad, taxels=centres, depths=()), COARSE)
    np.testing.assert_allclose(averaged(free, "mean").readings(load), means.ravel(), rtol=1e-9)
    # Between layers of one material, balls stay whole.
    assert [len(one) for one in material_cuts(pad, 2)] == [0] * 6


def test_quarters_lie_between_means_and_points(draft):
    """By the triangle inequality; on a disc they lose less than half of what means lose."""
    load = load_on(draft)
    points, quarters, means = (averaged(draft, name).readings(load) for name in ("points", "quarters", "mean"))
    assert (means <= quarters * (1 + 1e-5)).all()
    assert (quarters <= points * (1 + 1e-5)).all()
    assert np.linalg.norm(points - quarters) < 0.5 * np.linalg.norm(points - means)


def test_one_point_per_taxel_is_stored_and_bases_read_it(draft):
    mean, load = averaged(draft, "mean"), load_on(draft)
    assert [len(mean.tables[f"sampling points {k}"]) for k in range(4)] == [49] * 4  # a quarter of 13 x 13
    assert mean.nbytes < 0.4 * draft.nbytes
    np.testing.assert_allclose(mean.readings_of(mean.point_response(load)), mean.readings(load), rtol=2e-5)


def test_means_are_a_little_below_what_they_stand_for(draft):
    """A mean's norm is at most the mean norm; on punches some percent are lost, least in deep layers."""
    mean = averaged(draft, "mean")
    for number, name in enumerate(INDENTER_NAMES):
        outline = indenter_outline(name, shift=(1e-3, -0.7e-3), rotate_deg=40 * number)
        load = contact_load(draft, Footprint.from_outline(outline, draft.surface), (0.05, -0.03, -0.5), law="elastic")
        plain, reading = draft.readings(load), mean.readings(load)
        assert (reading <= plain * (1 + 1e-5)).all()
        lost = np.linalg.norm(reading - plain, axis=(1, 2)) / np.linalg.norm(plain, axis=(1, 2))
        assert (lost <= [0.06, 0.03, 0.03, 0.04]).all(), (name, lost)
