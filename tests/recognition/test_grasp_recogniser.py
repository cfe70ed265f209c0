"""The grasp recogniser, on presses of a covering face that nothing was taught with."""

import numpy as np
import pytest
import shapely

from mjtactile import Footprint, Pad, WrenchBasis, force_vector, influence_matrices
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.recognition import RecognitionError, load
from mjtactile.recognition.evaluation.arrays import noisy

HALF = 7.5e-3


@pytest.fixture(scope="module")
def basis():
    influence = influence_matrices(fidelity="fast", progress=False)
    return WrenchBasis(influence, Footprint.from_outline(shapely.box(-HALF, -HALF, HALF, HALF), influence.surface))


@pytest.fixture(scope="module")
def recognise():
    return load("grasp", pad=Pad())


def wrenches(count, seed):
    """Pressing 0.3 to 20 N, pulled by up to 1.2 times as much, off the middle by up to 3 mm, twisted."""
    drawn = np.random.default_rng(seed)
    pressing, ratio, around = (
        np.exp(drawn.uniform(-1.2, 3.0, count)),
        drawn.uniform(0, 1.2, count),
        drawn.uniform(0, 6.3),
    )
    force = pressing[:, None] * np.column_stack([ratio * np.cos(around), ratio * np.sin(around), -np.ones(count)])
    centre = np.column_stack([drawn.uniform(-2e-3, 2e-3, (count, 2)), np.zeros(count)])
    torsion = np.column_stack([np.zeros((count, 2)), pressing * drawn.uniform(-3e-3, 3e-3, count)])
    return np.concatenate([force, np.cross(centre, force) + torsion], axis=1), centre[:, :2], torsion[:, 2]


def test_force_centre_and_torsion_with_noise(basis, recognise):
    wanted, centre, torsion = wrenches(150, 5)
    readings = np.array([basis.readings(one[:3], one[3:]) for one in wanted])
    found, pressing = recognise(noisy(readings, 0.01, seed=6)), -wanted[:, 2]
    # Medians are what training/train_grasp.py reports of presses held out, or less: these keep clear of the edges.
    assert np.median(np.abs(found.pressing / pressing - 1.0)) < 0.01
    assert np.median(np.linalg.norm(found.force[:, :2] - wanted[:, :2], axis=1) / pressing) < 0.012
    assert np.median(np.linalg.norm(found.centre - centre, axis=1)) < 5e-5
    assert np.median(np.abs(found.torsion - torsion) / pressing) < 8e-5
    assert found.tangential == pytest.approx(np.hypot(*found.force[:, :2].T))


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_faces_that_cover_the_pad_are_familiar(basis, recognise, noise):
    wanted, _, _ = wrenches(300, 11)
    readings = np.array([basis.readings(one[:3], one[3:]) for one in wanted])
    found = recognise(noisy(readings, noise, seed=12)).familiarity
    assert found.false_alarms == 0.01
    assert np.mean(~found.familiar) <= 0.03


def test_what_does_not_cover_the_pad_is_unfamiliar(recognise, pressed):
    for shape in INDENTER_NAMES:
        readings = pressed(shape, [force_vector(0.98, tilt) for tilt in (0.0, 20.0)], shift=(1e-3, -0.5e-3))
        assert not recognise(readings).familiarity.familiar.any(), shape


def test_ten_times_the_force_reads_as_ten_times_the_force(basis, recognise):
    wanted = wrenches(1, 7)[0][0]
    readings = basis.readings(wanted[:3], wanted[3:])
    np.testing.assert_allclose(recognise(10.0 * readings).force, 10.0 * recognise(readings).force, rtol=1e-5)


@pytest.mark.parametrize("flip", ["x", "y", "swap"])
def test_mirrored_presses_get_mirrored_answers(basis, recognise, flip):
    wanted = wrenches(1, 9)[0][0]
    readings = basis.readings(wanted[:3], wanted[3:])
    seen = {"x": readings[:, :, ::-1], "y": readings[:, ::-1], "swap": readings.swapaxes(1, 2)}[flip]
    mirror = {"x": np.diag([-1, 1]), "y": np.diag([1, -1]), "swap": np.array([[0, 1], [1, 0]])}[flip]
    found, image = recognise(readings), recognise(np.ascontiguousarray(seen))
    np.testing.assert_allclose(image.force[:2], mirror @ found.force[:2], atol=1e-5 * found.pressing)
    np.testing.assert_allclose(image.centre, mirror @ found.centre, atol=1e-8)
    assert image.torsion == pytest.approx(-found.torsion, rel=1e-4)


def test_what_it_cannot_do_is_said():
    with pytest.raises(RecognitionError, match="layers"):
        load("grasp", layers="top")
    with pytest.raises(RecognitionError, match="trained for"):
        load("grasp", pad=Pad(size=(0.016, 0.016)))
