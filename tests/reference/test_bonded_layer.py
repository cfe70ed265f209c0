"""The layer without a mesh, checked against closed forms; the cases stored for the benchmark are its own."""

from __future__ import annotations

import numpy as np
import pytest
from bonded_layer import DATA, PLACES, RADII, REACH, ball_rule, stresses, top_readings

from mjtactile.pad import Layer, Pad

RUBBER = Pad().layers[0]
RADIUS = 0.5e-3
PEAK = 1.5 / (np.pi * RADIUS**2)


def test_on_the_axis_of_a_deep_layer_stress_is_hertzs():
    """Johnson, Contact Mechanics, 1985, eq. 3.45."""
    deep = Layer(thickness=0.1, young=2e6, poisson=0.3)
    z = np.array([0.3e-3, 0.5e-3, 1e-3, 2e-3])
    radial, hoop, axial, shear = stresses(deep, RADIUS, z, np.zeros(1))[:, 0].T
    depth = z / RADIUS
    np.testing.assert_allclose(axial, -PEAK / (1 + depth**2), rtol=1e-3)
    across = -PEAK * (1.3 * (1 - depth * np.arctan(1 / depth)) - 0.5 / (1 + depth**2))
    np.testing.assert_allclose(radial, across, atol=1e-3 * PEAK)
    np.testing.assert_allclose(hoop, radial, rtol=1e-12)
    np.testing.assert_allclose(shear, 0.0, atol=1e-12 * PEAK)


def test_every_level_carries_the_force():
    """A layer that is not nearly incompressible: there the force spreads over a few thicknesses only."""
    r, layer = np.linspace(0.0, 50e-3, 5000), Layer(thickness=5e-3, young=2e6, poisson=0.3)
    axial = stresses(layer, RADIUS, np.array([1e-3, 4e-3]), r)[..., 2]
    np.testing.assert_allclose(np.sum(axial * 2 * np.pi * r, axis=1) * r[1], -1.0, rtol=1e-3)


def test_the_base_does_not_stretch():
    """Without strain along the base, both stresses along it are nu / (1 - nu) times that across it."""
    radial, hoop, axial, _ = stresses(RUBBER, RADIUS, np.array([RUBBER.thickness]), np.array([0.5e-3, 3e-3])).T
    along = RUBBER.poisson / (1 - RUBBER.poisson) * axial
    np.testing.assert_allclose(radial, along, rtol=1e-9)
    np.testing.assert_allclose(hoop, along, rtol=1e-9)


def test_the_mean_over_a_ball_is_exact_for_quadratics():
    points, weights = ball_rule(6)
    np.testing.assert_allclose(weights.sum(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(weights @ points**2, 0.2, rtol=1e-12)
    np.testing.assert_allclose(weights @ points, 0.0, atol=1e-15)


@pytest.mark.parametrize("radius", [0, -1])
def test_the_stored_cases_are_these(radius):
    with np.load(DATA) as stored:
        np.testing.assert_array_equal(stored["radii"], RADII)
        np.testing.assert_array_equal(stored["places"], PLACES)
        found = top_readings(Pad(), float(RADII[radius]), PLACES[1])
        np.testing.assert_allclose(stored["readings"][radius, 1], found, rtol=1e-5)
        assert 9 <= np.isfinite(found).sum() <= (REACH / 1.25e-3 + 1) ** 2 * np.pi
