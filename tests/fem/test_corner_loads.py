"""Loads on the elements' corners: what spreading keeps, what it costs, and which meshes it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Point

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import PresetError
from mjtactile.fem.corner_loads import corner_weights, onto_corners, require_corners_mirrored
from mjtactile.fem.line import Line
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.influence.storage import in_storage
from mjtactile.influence.surface_load import SurfaceLoad

GRADED = Line(np.array([-1.0, -0.8, -0.45, 0.0, 0.45, 0.8, 1.0]))


@pytest.mark.parametrize("elements", [1, 2, 3, 6])
def test_weights_keep_moments_as_far_as_there_are_corners(elements):
    line = Line(GRADED.vertices[: elements + 1])
    weights = corner_weights(line)
    for degree in range(min(4, elements + 1)):
        np.testing.assert_allclose(weights.T @ line.vertices**degree, line.nodes**degree, atol=1e-14)


def test_weights_are_mirrored_with_the_line():
    weights = corner_weights(GRADED)
    np.testing.assert_allclose(weights[::-1, ::-1], weights, atol=1e-15)


def test_resultants_are_kept_and_only_corners_hold_forces(draft):
    forces = np.random.default_rng(0).normal(size=(2, *draft.surface.node_shape, 3))
    spread = onto_corners(forces, draft.surface)
    assert not spread[:, 1::2].any()
    assert not spread[:, :, 1::2].any()
    for before, after in zip(forces, spread, strict=True):
        load, other = (SurfaceLoad(f, draft.surface, draft.surface.sheet) for f in (before, after))
        for one, two in zip(load.resultant(), other.resultant(), strict=True):
            np.testing.assert_allclose(two, one, atol=1e-12)


def test_a_mesh_with_an_odd_number_of_elements_is_refused(draft):
    odd = replace(draft.mesh, x=Line(np.array([-1.0, -0.2, 0.2, 1.0])))
    with pytest.raises(PresetError, match=r"even number of elements along both axes, not 3 x 10"):
        require_corners_mirrored(odd)
    require_corners_mirrored(draft.mesh)


@pytest.fixture(scope="module")
def corners(default_influence):
    return in_storage(default_influence, replace(default_influence.fidelity, loads="corners"))


def test_a_quarter_of_the_columns_is_stored(default_influence, corners):
    name = "deviatoric ++ 0"
    assert len(corners.tables[name]) < 0.28 * len(default_influence.tables[name])
    np.testing.assert_array_equal(corners.tables["compliance ++"], default_influence.tables["compliance ++"])
    load = _punch(default_influence, "star", 0)
    np.testing.assert_array_equal(corners.surface_displacement(load), default_influence.surface_displacement(load))


def test_punches_read_nearly_as_on_all_nodes(default_influence, corners):
    """Pressure at their edges is singular; below the first element's depth next to nothing changes."""
    for number, name in enumerate(INDENTER_NAMES):
        load = _punch(default_influence, name, number)
        expected, readings = default_influence.readings(load), corners.readings(load)
        off = np.linalg.norm(readings - expected, axis=(1, 2)) / np.linalg.norm(expected, axis=(1, 2))
        assert (off <= [0.05, 0.015, 0.01, 0.01]).all(), (name, off)
        assert np.linalg.norm(readings - expected) <= 0.035 * np.linalg.norm(expected), name


def test_stress_tensors_are_as_near(default_influence, corners):
    load = _punch(default_influence, "square", 1)
    stress, expected = corners.stress(load), default_influence.stress(load)
    assert np.linalg.norm(stress - expected) <= 0.03 * np.linalg.norm(expected)


def test_an_oblong_layered_sheet_takes_corners_too(layered):
    coarse = in_storage(layered, replace(layered.fidelity, loads="corners"))
    outline = Point(0.4e-3, -0.3e-3).buffer(1.9e-3)
    load = contact_load(layered, Footprint.from_outline(outline, layered.surface), (0.02, 0.01, -0.1))
    expected, readings = layered.readings(load), coarse.readings(load)
    assert 1e-6 < np.linalg.norm(readings - expected) <= 0.1 * np.linalg.norm(expected)


def _punch(influence, name: str, number: int) -> SurfaceLoad:
    outline = indenter_outline(name, shift=(1e-3, -0.7e-3), rotate_deg=40 * number)
    return contact_load(
        influence, Footprint.from_outline(outline, influence.surface), (0.05, -0.03, -0.5), law="elastic"
    )
