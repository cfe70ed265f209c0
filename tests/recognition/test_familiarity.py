"""Whether recognisers say that readings look like nothing they were taught."""

from __future__ import annotations

import dataclasses
import shutil

import numpy as np
import pytest

from mjtactile import Pad, force_vector, recognition
from mjtactile.cli.evaluate import stranger_table
from mjtactile.fidelity import as_fidelity
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.recognition.evaluation.arrays import noisy
from mjtactile.recognition.evaluation.strangers import KINDS, noticed, strange_contacts
from mjtactile.recognition.registry import REGISTRY, read_registry, register
from mjtactile.recognition.weight_files import SHIPPED


@pytest.fixture(scope="module", params=["all", "top"])
def recognise(request):
    return recognition.load("force", layers=request.param)


@pytest.fixture(scope="module")
def punches(pressed) -> np.ndarray:
    """Presses of the seven punches at random places, sizes, forces and tilts."""
    rng = np.random.default_rng(31)
    presses = []
    for shape in INDENTER_NAMES:
        for _ in range(20):
            tilts, turns = rng.uniform(0.0, 35.0, 4), rng.uniform(0.0, 360.0, 4)
            forces = [force_vector(*one) for one in zip(rng.uniform(0.05, 1.9, 4), tilts, turns, strict=True)]
            shift, rotation = tuple(rng.uniform(-2.5e-3, 2.5e-3, 2)), rng.uniform(0.0, 6.3)
            presses.append(pressed(shape, forces, shift=shift, rotation=rotation, size=rng.uniform(0.7, 1.3)))
    return np.concatenate(presses)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_few_presses_like_the_taught_ones_are_called_unfamiliar(recognise, punches, noise):
    found = recognise(noisy(punches, noise, seed=1)).familiarity
    assert found.false_alarms == 0.01
    # Of 140 poses, each with forces that are much alike.
    assert np.mean(~found.familiar) <= 0.03
    # Neither are all of them next to a taught press: the limit is where one in a hundred lies.
    assert np.quantile(found.distance, 0.9) > found.limit / 3.0


@pytest.fixture(scope="module")
def strangers():
    return strange_contacts(Pad(), as_fidelity("fast"), count=3, seed=5)


def test_contacts_that_were_not_taught_are_noticed(recognise, strangers):
    rates = noticed(strangers, recognise, noise=0.01, seed=1)
    assert tuple(rates) == KINDS
    for kind in KINDS[:3]:
        assert rates[kind]["contacts"] == 3
        assert rates[kind]["unfamiliar"] == 1.0
        assert rates[kind]["missed"] == 0.0
    assert max(rate["wrong"] for rate in rates.values()) > 0.5
    text = stranger_table({"strangers": {"all": rates, "top": rates}})
    assert "| a lying rod | 3 | 100 / 100 |" in text


def test_force_and_shape_say_the_same_with_the_readings_batch_axes(punches):
    force, shape = recognition.load("force"), recognition.load("shape")
    readings = punches[:6].reshape(2, 3, 4, 13, 13)
    one, other = force(readings).familiarity, shape(readings).familiarity
    assert one is not None
    assert other is not None
    assert one.distance.shape == one.familiar.shape == (2, 3)
    np.testing.assert_array_equal(one.distance, other.distance)
    alone = force(readings[1, 2]).familiarity
    assert alone is not None
    assert alone.familiar.shape == ()
    np.testing.assert_allclose(alone.distance, one.distance[1, 2], atol=1e-3)


def test_familiarity_does_not_depend_on_magnitude_mirrors_and_the_size_of_the_batch(recognise, punches):
    once = recognise(punches).familiarity.distance
    np.testing.assert_allclose(recognise(3.0 * punches[..., ::-1]).familiarity.distance, once, atol=2e-3)
    many = recognise(np.concatenate([punches, punches])).familiarity.distance
    np.testing.assert_allclose(many, np.concatenate([once, once]), atol=2e-3)


def test_noise_is_taken_off_distances(recognise, punches):
    """One press with noise of its own 300 times, compared with itself alone: what is left over says how much it is."""
    view = recognise.view

    def see(readings):
        return view.see(view.checked(readings)[0])

    parts = recognise.taught.presses.shape[1]
    alone = dataclasses.replace(recognise.taught, presses=see(punches[:1]).features[:, :parts])
    seen = see(noisy(np.repeat(punches[:1], 300, axis=0), 0.05, seed=2))
    untold = alone.distances(dataclasses.replace(seen, noise=np.zeros(300)))
    assert np.mean(alone.distances(seen) ** 2) < 0.5 * np.mean(untold**2)


def test_weights_without_taught_presses_say_that_it_is_not_known(tmp_path, punches):
    """As those that were trained before there were any."""
    shutil.copytree(SHIPPED / "top", tmp_path / "top")
    kept = [entry for name, entry in read_registry(SHIPPED / "top").items() if name != "familiarity"]
    (tmp_path / "top" / REGISTRY).unlink()
    for entry in kept:
        register(tmp_path / "top", entry.file, optional=entry.optional)
    for name in ("force", "shape"):
        assert recognition.load(name, folder=tmp_path, layers="top")(punches[0]).familiarity is None
    force = recognition.load("force", folder=tmp_path, layers="top")
    shipped = recognition.load("force", layers="top")
    np.testing.assert_array_equal(force(punches).force, shipped(punches).force)


def test_no_sum_of_squares_is_negative_next_to_a_taught_press(recognise):
    view, taught = recognise.view, recognise.taught
    features = np.zeros((len(taught.presses), view.parts.shape[1] + 1), dtype=np.float32)
    features[:, : taught.presses.shape[1]] = taught.presses
    seen = view.see(view.checked(np.ones((1, *view.reading_shape)))[0])
    quiet = np.zeros(len(features))
    at_them = dataclasses.replace(seen, features=features, noise=quiet)
    assert taught.distances(at_them).max() < 1e-2
