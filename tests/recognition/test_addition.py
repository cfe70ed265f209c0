"""One more shape: its module begins as those most like it, and becomes loudest on its own shape alone."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mjtactile.recognition.network import Network
from mjtactile.recognition.shape import ShapeModule
from mjtactile.recognition.training.addition import Looks, NewModule, fit_module, most_alike
from mjtactile.recognition.training.fitting import Schedule

INPUTS, WIDTH = 5, 8


@pytest.fixture
def known():
    rng = np.random.default_rng(2)
    sizes = ((INPUTS, WIDTH), (WIDTH, WIDTH), (WIDTH, 1))
    return [
        ShapeModule(
            name,
            Network(
                tuple(rng.normal(size=size).astype(np.float32) for size in sizes),
                tuple(rng.normal(size=size[1]).astype(np.float32) for size in sizes),
            ),
            f"shape-{name}.safetensors",
        )
        for name in ("circle", "star", "square")
    ]


@pytest.fixture
def looks(known):
    """The new shape is where the first input is large."""
    inputs = np.random.default_rng(3).normal(size=(800, INPUTS)).astype(np.float32)
    scores = np.concatenate([module.network(inputs) for module in known], axis=1)
    return Looks(torch.tensor(inputs), torch.tensor(scores), torch.tensor(inputs[:, 0] > 0.8))


def test_a_new_module_begins_as_the_mean_of_those_it_is_like(known, looks):
    network = NewModule(known[1:])
    wanted = np.mean([module.network(looks.inputs.numpy())[:, 0] for module in known[1:]], axis=0)
    np.testing.assert_allclose(network(looks.inputs).detach().numpy(), wanted, rtol=1e-4, atol=1e-4)


def test_what_it_is_like_is_loudest_on_its_presses(known, looks):
    loudness = [module.network(looks.inputs[looks.own].numpy()).mean() for module in known]
    chosen = most_alike(looks, known, 2)
    assert [known.index(module) for module in chosen] == np.argsort(loudness)[::-1][:2].tolist()


def test_a_fitted_module_is_loudest_on_its_own_shape_alone(known, looks):
    torch.manual_seed(0)
    network = NewModule(known)
    before = [module.network.weights[0].copy() for module in known]
    fit_module(network, looks, Schedule(steps=800, batch=128, rate=1e-2), torch.Generator().manual_seed(0), "new")
    with torch.no_grad():
        louder = network(looks.inputs) > looks.scores.max(1).values
    assert (louder == looks.own).float().mean() > 0.95
    for module, weights in zip(known, before, strict=True):
        np.testing.assert_array_equal(module.network.weights[0], weights)


def test_what_is_stored_answers_as_what_was_fitted(known, looks):
    network = NewModule(known[:2])
    stored = Network.from_arrays(network.arrays(), "shape")
    found = network(looks.inputs).detach().numpy()
    np.testing.assert_allclose(stored(looks.inputs.numpy())[:, 0], found, rtol=0.02, atol=0.02)
