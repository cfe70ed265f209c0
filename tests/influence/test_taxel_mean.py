"""Readings of mean stress: what they are, in whatever quadrant a taxel lies, and how far from means of norms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Point

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.geometry.indenter import INDENTER_NAMES, indenter_outline
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.storage import in_storage
from mjtactile.influence.surface_load import SurfaceLoad


def averaged(plain: InfluenceMatrices, averaging: str) -> InfluenceMatrices:
    return in_storage(plain, replace(plain.fidelity, averaging=averaging))


def load_on(influence: InfluenceMatrices) -> SurfaceLoad:
    return contact_load(
        influence, Footprint.from_outline(Point(1e-3, -0.4e-3).buffer(1.7e-3), influence.surface), (0.02, 0.01, -0.1)
    )


def von_mises_of(stress: np.ndarray) -> np.ndarray:
    xx, yy, zz, xy, yz, zx = stress
    normal = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2
    return np.sqrt(normal + 3 * (xy**2 + yz**2 + zx**2))


@pytest.mark.parametrize("pad", ["coarse_square", "layered"])
def test_readings_are_the_von_mises_stress_of_the_mean_stress(pad, request):
    """On a sheet whose mirrors map taxels onto each other, and on one where they do not."""
    plain = request.getfixturevalue(pad)
    mean, load = averaged(plain, "mean"), load_on(plain)
    expected = plain.stress(load)
    for readings in (mean.readings(load), mean.readings_of(mean.point_response(load))):
        np.testing.assert_allclose(readings, von_mises_of(expected), rtol=1e-9)
    np.testing.assert_allclose(mean.stress(load), expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())


def test_deep_leaves_the_shallowest_layer_as_it_is(layered):
    deep, mean, load = averaged(layered, "deep"), averaged(layered, "mean"), load_on(layered)
    np.testing.assert_allclose(deep.readings(load)[0], layered.readings(load)[0], rtol=1e-12)
    np.testing.assert_allclose(deep.readings(load)[1:], mean.readings(load)[1:], rtol=1e-12)


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
