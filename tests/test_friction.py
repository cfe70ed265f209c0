"""Shear under friction: resultants as given, the cone obeyed, the least energy, and the nearest wrench."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_complementarity import SURFACE

from mjtactile.friction import ShearGrip, coulomb_shear, proportional_shear
from mjtactile.indenter import indenter_outline
from mjtactile.partition import outline_cells

CELLS = outline_cells(indenter_outline("triangle"), 60)
#: Conditions hold to this fraction of the largest force or displacement.
EXACT = 1e-8


def random_grip(seed: int) -> ShearGrip:
    random = np.random.default_rng(seed)
    normal = random.uniform(0.05, 1.0, CELLS.count)
    centre = normal @ CELLS.centroids / normal.sum()
    return ShearGrip(CELLS.centroids, normal, centre, math.sqrt(CELLS.areas.sum()))


def sphere_directions(count: int) -> np.ndarray:
    """Directions (count, 3), evenly spread."""
    k = np.arange(count) + 0.5
    height, angle = 1 - 2 * k / count, math.pi * (1 + math.sqrt(5)) * k
    across = np.sqrt(1 - height**2)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), height])


@pytest.mark.parametrize("seed", range(5))
def test_proportional_shear_has_the_resultants(seed):
    grip, random = random_grip(seed), np.random.default_rng(seed)
    wanted = random.normal(size=3)
    shear = proportional_shear(grip, wanted)
    np.testing.assert_allclose(grip.resultants(shear), wanted, atol=1e-12)
    # Without torsion it has the direction of the force and the distribution of the pressure.
    pushed = proportional_shear(grip, np.array([1.0, 2.0, 0.0]))
    np.testing.assert_allclose(pushed, np.outer([1.0, 2.0], grip.normal / grip.normal.sum()), atol=1e-12)


def test_torsion_is_counted_about_the_centre_of_pressure():
    grip = random_grip(0)
    force, torsion = np.array([0.3, -0.2]), 0.7
    shear = proportional_shear(grip, grip.about_centre(force, torsion))
    x, y = grip.points.T
    np.testing.assert_allclose(shear.sum(axis=1), force, atol=1e-12)
    assert x @ shear[1] - y @ shear[0] == pytest.approx(torsion, rel=1e-10)


@pytest.mark.parametrize("share", [0.1, 0.6, 0.95, 0.995])
@pytest.mark.parametrize("seed", range(4))
def test_coulomb_shear_meets_its_conditions(seed, share):
    """Cells that stick move with the body; those that slip carry mu F against the way they slip."""
    grip, friction, random = random_grip(seed), 0.4, np.random.default_rng(seed)
    full = SURFACE.full(CELLS)
    tangential, slip = full[:2, :, :2], -np.einsum("iaj,j->ia", full[:2, :, 2], grip.normal)
    limit = grip.resultants(grip.sliding(random.normal(size=3), friction))
    wanted = share * limit
    shear = coulomb_shear(tangential, grip, slip, wanted, friction)
    size, bound = np.linalg.norm(shear, axis=0), friction * grip.normal
    assert (size <= bound * (1 + EXACT)).all()
    np.testing.assert_allclose(grip.resultants(shear), wanted, atol=EXACT * np.abs(wanted).max())

    surface = np.einsum("iajb,jb->ia", tangential, shear) + slip
    holds = size < (1 - 1e-6) * bound
    # The rigid motion the sticking cells follow; where few stick, the slip directions tell as much.
    scale = np.abs(surface).max()
    if holds.sum() >= 2:
        modes = grip.modes[:, holds].reshape(-1, 3)
        motion = np.linalg.lstsq(modes, surface[:, holds].ravel(), rcond=None)[0]
        relative = grip.modes @ motion - surface
        assert np.abs(relative[:, holds]).max() <= 1e-6 * scale
        along = (relative * shear).sum(axis=0)[~holds]
        across = (relative[0] * shear[1] - relative[1] * shear[0])[~holds]
        assert (along >= -1e-6 * scale * bound[~holds]).all()
        assert np.abs(across).max(initial=0.0) <= 1e-5 * scale * bound.max()


@pytest.mark.parametrize("share", [0.999, 0.9999, 1 - 1e-6])
@pytest.mark.parametrize("seed", range(4))
def test_shear_at_the_verge_of_sliding_is_carried(seed, share):
    grip, friction, random = random_grip(seed), 0.4, np.random.default_rng(seed)
    full = SURFACE.full(CELLS)
    slip = -np.einsum("iaj,j->ia", full[:2, :, 2], grip.normal)
    wanted = share * grip.resultants(grip.sliding(random.normal(size=3), friction))
    shear = coulomb_shear(full[:2, :, :2], grip, slip, wanted, friction)
    assert (np.linalg.norm(shear, axis=0) <= friction * grip.normal * (1 + EXACT)).all()
    np.testing.assert_allclose(grip.resultants(shear), wanted, atol=1e-7 * np.abs(wanted).max())


def test_firm_grip_sticks_everywhere():
    """With a large coefficient the shear is that of a bonded face."""
    grip = random_grip(1)
    full = SURFACE.full(CELLS)
    count = CELLS.count
    wanted = np.array([0.1, 0.05, 0.02])
    shear = coulomb_shear(full[:2, :, :2], grip, np.zeros((2, count)), wanted, 1e3)
    matrix, modes = full[:2, :, :2].reshape(2 * count, -1), grip.modes.reshape(-1, 3)
    answers = np.linalg.solve(matrix, modes)
    expected = answers @ np.linalg.solve(modes.T @ answers, wanted)
    np.testing.assert_allclose(shear.ravel(), expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(8))
def test_nearest_wrench_is_nearest(seed):
    """Against the support function in many directions: the point lies in the set, and behind it nothing is nearer."""
    grip, friction, random = random_grip(seed), 0.3, np.random.default_rng(seed)
    wanted = friction * grip.normal.sum() * random.uniform(0.8, 3.0) * random.normal(size=3)
    found, shear = grip.nearest(wanted, friction)
    directions = sphere_directions(4000)
    reach = friction * np.linalg.norm(np.einsum("aci,di->acd", grip.modes, directions), axis=0).T @ grip.normal
    if shear is None:
        assert (directions @ wanted <= reach * (1 + 1e-6)).all()
        np.testing.assert_array_equal(found, wanted)
        return
    limit = friction * grip.normal.sum()
    assert (directions @ found <= reach + 1e-6 * limit).all()
    np.testing.assert_allclose(grip.resultants(shear), found, atol=1e-12 * limit)
    assert (np.linalg.norm(shear, axis=0) <= friction * grip.normal * (1 + 1e-12)).all()
    # How far the set is, seen from outside along the best of all directions.
    distance = np.linalg.norm(wanted - found)
    assert (directions @ wanted - reach).max() <= distance + 1e-9 * limit
    assert (directions @ wanted - reach).max() >= (1 - 2e-3) * distance


def test_wrench_within_the_limit_is_left_alone():
    grip = random_grip(2)
    for share in (0.0, 0.5, 0.9, 1.0 - 1e-6):
        wanted = share * grip.resultants(grip.sliding(np.array([0.3, -0.1, 0.4]), 0.5))
        found, shear = grip.nearest(wanted, 0.5)
        assert shear is None
        np.testing.assert_array_equal(found, wanted)
    found, shear = grip.nearest(1.01 * grip.resultants(grip.sliding(np.array([0.3, -0.1, 0.4]), 0.5)), 0.5)
    assert shear is not None


def test_pure_push_slides_at_mu_times_the_force():
    grip = random_grip(3)
    found, shear = grip.nearest(np.array([9.0, 0.0, 0.0]) * grip.normal.sum(), 0.25)
    assert shear is not None
    np.testing.assert_allclose(found, [0.25 * grip.normal.sum(), 0, 0], atol=1e-6 * grip.normal.sum())


def test_without_friction_nothing_is_carried():
    grip = random_grip(4)
    found, shear = grip.nearest(np.array([1.0, 2.0, 3.0]), 0.0)
    np.testing.assert_array_equal(found, 0.0)
    assert shear is not None
    assert not shear.any()
    found, shear = grip.nearest(np.zeros(3), 0.0)
    assert shear is None
