"""Presses kept beside the weights: what is read back is what was seen, to half a byte's step."""

from __future__ import annotations

import numpy as np
import pytest

from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.training.examples import Examples, choose, read_examples
from mjtactile.recognition.weight_files import SHIPPED, Stored, read_weights


@pytest.fixture(scope="module")
def view():
    return PrincipalComponents.from_stored(read_weights(SHIPPED / "top" / "view.safetensors"))


@pytest.fixture
def examples(view):
    rng = np.random.default_rng(4)
    projected = rng.normal(size=(60, view.parts.shape[1])).astype(np.float32)
    projected /= np.linalg.norm(projected, axis=1, keepdims=True)
    return Examples(
        projected,
        1.0 + rng.uniform(0.0, 1e-3, 60).astype(np.float32),
        rng.uniform(0.1, 0.4, 60).astype(np.float32),
        np.resize(["star", "circle", "sphere"], 60),
        np.arange(60) % 7 == 0,
        (projected @ view.parts.T).reshape(-1, 1, 13, 13),
    )


def test_examples_come_back_to_half_a_step(view, examples, tmp_path):
    arrays = examples.arrays()
    back = Examples.from_stored(Stored(arrays, {"shapes": examples.names}, tmp_path / "examples"), view)
    assert (np.abs(back.projected - examples.projected) <= 0.501 * arrays["scale"]).all()
    np.testing.assert_array_equal(back.shapes, examples.shapes)
    np.testing.assert_array_equal(back.held_out, examples.held_out)
    np.testing.assert_allclose(back.peak, examples.peak, rtol=1e-3)
    left, before = ((one.energy - (one.projected**2).sum(axis=1)) for one in (back, examples))
    np.testing.assert_allclose(left, before, atol=1e-5)
    np.testing.assert_allclose(back.readings.reshape(60, -1) @ view.parts, back.projected, atol=1e-5)


def test_joined_examples_are_these_and_then_the_others(examples):
    both = examples.joined(examples)
    np.testing.assert_array_equal(both.projected[60:], examples.projected)
    assert both.names == ["circle", "sphere", "star"]


def test_shapes_are_kept_in_equal_numbers_and_spheres_a_quarter_as_often():
    class Presses:
        shapes = np.repeat(["circle", "sphere", "star"], [500, 300, 200])

    chosen = choose(Presses(), 90, seed=1)  # type: ignore[arg-type]
    assert len(set(chosen.tolist())) == len(chosen)
    names, counts = np.unique(Presses.shapes[chosen], return_counts=True)
    assert dict(zip(names.tolist(), counts.tolist(), strict=True)) == {"circle": 40, "sphere": 10, "star": 40}


def test_a_folder_without_examples_has_none(tmp_path, view):
    assert read_examples(tmp_path, view) is None
