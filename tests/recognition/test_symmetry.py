from __future__ import annotations

import numpy as np
import pytest

from mjtactile import Pad, TaxelGrid
from mjtactile.recognition.symmetry import Mirrors, into_octant, is_symmetric, mirrored


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_readings_end_up_with_their_middle_in_the_octant(rng):
    readings = rng.random((200, 2, 5, 5))
    octant, _ = into_octant(readings)
    total, places = octant.sum(axis=1), np.arange(5) - 2
    x, y = total.sum(axis=1) @ places, total.sum(axis=2) @ places
    assert (x >= y - 1e-9).all()
    assert (y >= -1e-9).all()


def test_vectors_and_angles_come_back_as_they_went(rng):
    _, mirrors = into_octant(rng.random((100, 1, 4, 4)))
    vectors, angles = rng.normal(size=(100, 3)), rng.uniform(-3, 3, 100)
    np.testing.assert_allclose(mirrors.original(mirrors.vectors(vectors)), vectors)
    np.testing.assert_allclose(np.exp(1j * mirrors.original_angles(mirrors.angles(angles))), np.exp(1j * angles))


def test_vectors_are_mirrored_as_readings_are():
    """A spot's place, as a vector from the middle, goes where the spot goes; the angle of that vector as well."""
    for k in range(8):
        mirrors = Mirrors(*(np.array([bool(k >> bit & 1)]) for bit in range(3)))
        readings = np.zeros((1, 1, 5, 5))
        readings[0, 0, 1, 4] = 1.0  # row (y) 1, column (x) 4: the vector (2, -1)
        row, column = divmod(int(mirrored(readings, mirrors)[0, 0].argmax()), 5)
        vector = mirrors.vectors(np.array([[2.0, -1.0]]))[0]
        np.testing.assert_array_equal(vector, [column - 2, row - 2])
        angle = mirrors.angles(np.array([np.arctan2(-1.0, 2.0)]))[0]
        np.testing.assert_allclose(np.hypot(*vector) * np.array([np.cos(angle), np.sin(angle)]), vector, atol=1e-12)


def test_one_at_a_time_is_the_same_as_many(rng):
    readings = rng.random((40, 2, 5, 5))
    together, _ = into_octant(readings)
    for k in range(40):
        np.testing.assert_array_equal(into_octant(readings[k : k + 1])[0][0], together[k])


def test_only_square_pads_with_square_grids_are_symmetric():
    assert is_symmetric(Pad())
    assert not is_symmetric(Pad(size=(16e-3, 15e-3)))
    assert not is_symmetric(Pad(taxels=TaxelGrid(rows=11)))
