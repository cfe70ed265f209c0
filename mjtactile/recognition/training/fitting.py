"""Fitting of networks, shared by the scripts in training/."""

from __future__ import annotations

import itertools
import math
import platform
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mjtactile._installed import __version__
from mjtactile._progress import progress_bar
from mjtactile.errors import RecognitionError
from mjtactile.recognition.network import Network
from mjtactile.recognition.training.looker import Looker


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """Hyperparameters of a fit."""

    steps: int  #: number of batches
    batch: int = 512  #: presses in each batch
    rate: float = 1.5e-3  #: largest learning rate; see `learning_rate`
    decay: float = 1e-4  #: weight decay of AdamW
    quiet: float = 0.3  #: fraction of a batch without noise [-]
    noise: float = 0.06  #: largest standard deviation of noise over the largest reading [-]; its square root is uniform
    imperfect: float = 0.15  #: fraction of a batch with imperfect transducers [-]


def perceptron(sizes: list[int]) -> torch.nn.Sequential:
    """A fully connected network, silu between its layers; see network.py."""
    layers: list[torch.nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.SiLU()]
    return torch.nn.Sequential(*layers[:-1])


def perceptron_arrays(network: torch.nn.Module, name: str) -> dict[str, np.ndarray]:
    """A perceptron's weights in half precision, by the names that `Network.from_arrays` expects."""
    linear = [layer for layer in network.modules() if isinstance(layer, torch.nn.Linear)]
    return stored_layers(name, [layer.weight.T for layer in linear], [layer.bias for layer in linear])


def stored_layers(name: str, weights: Iterable[torch.Tensor], biases: Iterable[torch.Tensor]) -> dict[str, np.ndarray]:
    """Weights (inputs, outputs) in half precision and biases of layers, by the names of `perceptron_arrays`."""
    arrays: dict[str, np.ndarray] = {}
    for k, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        arrays[f"{name} weights {k}"] = weight.detach().numpy().astype(np.float16)
        arrays[f"{name} biases {k}"] = bias.detach().numpy().astype(np.float32)
    return arrays


def set_weights(network: torch.nn.Sequential, stored: Network) -> None:
    """Initialise a perceptron with the weights of a stored one of the same sizes.

    Raises:
        RecognitionError: the sizes differ.
    """
    linear = [layer for layer in network if isinstance(layer, torch.nn.Linear)]
    sizes = [(layer.in_features, layer.out_features) for layer in linear]
    if sizes != [weights.shape for weights in stored.weights]:
        raise RecognitionError(
            f"the network to start from has layers {[weights.shape for weights in stored.weights]}, but the network to "
            f"fit has {sizes}. Ask for the same width and depth, and the same view."
        )
    for layer, weights, biases in zip(linear, stored.weights, stored.biases, strict=True):
        layer.weight.data = torch.tensor(weights.T.copy())
        layer.bias.data = torch.tensor(biases)


def learning_rate(schedule: Schedule, step: int) -> float:
    """The learning rate of a step: it rises over the first steps and falls as a cosine."""
    rise, fall = min(1.0, (step + 1) / 300), 0.5 * (1.0 + math.cos(math.pi * step / schedule.steps))
    return schedule.rate * rise * fall + 1e-7


def fit(
    network: torch.nn.Module,
    looker: Looker,
    train: np.ndarray,
    loss_of: Callable[[torch.Tensor, torch.Tensor, torch.Tensor], torch.Tensor],
    schedule: Schedule,
    *,
    label: str,
) -> float:
    """Fit a network by AdamW on noisy presses; return the elapsed time [s].

    Args:
        network: maps features to outputs.
        looker: computes features of the presses.
        train: indices of the presses.
        loss_of: function of outputs, indices of the presses and their sizes that returns the loss.
        schedule: hyperparameters.
        label: text of the progress bar.
    """
    start, generator = time.perf_counter(), looker.generator
    pool = torch.tensor(train)

    def loss() -> torch.Tensor:
        index = pool[torch.randint(len(pool), (schedule.batch,), generator=generator)]
        drawn = torch.rand((2, schedule.batch), generator=generator)
        noise = torch.where(drawn[0] < schedule.quiet, 0.0, drawn[1] ** 2 * schedule.noise)
        features, size = looker.features(index, noise, int(schedule.imperfect * schedule.batch))
        return loss_of(network(features), index, size)

    descend(network, loss, schedule, label)
    return time.perf_counter() - start


def descend(network: torch.nn.Module, draw_loss: Callable[[], torch.Tensor], schedule: Schedule, label: str) -> None:
    """Change a network by AdamW; each call of `draw_loss` draws a batch and returns the network's loss on it."""
    optimiser = torch.optim.AdamW(network.parameters(), lr=schedule.rate, weight_decay=schedule.decay)
    with progress_bar(label, schedule.steps) as advance:
        for step in range(schedule.steps):
            for group in optimiser.param_groups:
                group["lr"] = learning_rate(schedule, step)
            loss = draw_loss()
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            optimiser.step()
            advance(1)


def rate(right: np.ndarray) -> str:
    """Fraction of correct answers as text; `right` is bool, (answers,)."""
    return f"{right.mean():.2%} of {len(right)}" if len(right) else "none asked"


def provenance(config: Any, dataset: dict[str, Any], seconds: float) -> dict[str, Any]:
    """Metadata of trained weights: configuration without its paths, versions, dataset and training time [s]."""
    import mujoco

    return {
        "config": {name: value for name, value in asdict(config).items() if not isinstance(value, Path)},
        "dataset": {"spec_fingerprint": dataset["spec_fingerprint"], "spec": dataset["spec"]},
        "versions": {
            "mjtactile": __version__,
            "mujoco": mujoco.mj_versionString(),
            "numpy": np.__version__,
            "torch": torch.__version__,
            "python": platform.python_version(),
        },
        "training_seconds": round(seconds, 1),
    }
