"""Training of a module for one more shape, while the existing modules stay fixed.

The scores of the existing modules for a press are summarised by one number, the logarithm of the sum of their
exponentials, computed once. The new module's score minus this number is the log-odds that the press is of the new
shape, so the training is a logistic regression. The new module is initialised with the existing modules whose shapes
resemble the new one most: most of what distinguishes an octagon from a circle also distinguishes a hexagon.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from mjtactile.recognition.shape import ShapeModule
from mjtactile.recognition.training.fitting import Schedule, descend, stored_layers
from mjtactile.recognition.training.looker import Looker
from mjtactile.recognition.training.shape_networks import FixedNetwork, PoseNetworks

#: Number of presses processed at once.
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class Looks:
    """Training samples: presses with random noise."""

    inputs: torch.Tensor  #: inputs of shape modules, (looks, inputs)
    scores: torch.Tensor  #: scores of the existing modules, (looks, modules)
    own: torch.Tensor  #: whether the press is of the new shape, (looks,) bool


@dataclass(frozen=True, eq=False)
class KnownModules:
    """The existing modules, which stay fixed."""

    poses: PoseNetworks  #: modules for position, size and orientation
    shapes: Sequence[ShapeModule]  #: modules for the existing shapes


def look_at(
    looker: Looker,
    index: torch.Tensor,
    own: torch.Tensor,
    noise: torch.Tensor,
    known: KnownModules,
    imperfect: float = 0.0,
) -> Looks:
    """Training samples of presses, each with its own noise.

    Args:
        looker: computes features of the presses.
        index: index of each sample's press, (looks,).
        own: whether each press is of the new shape, (presses,) bool.
        noise: standard deviation of each sample's noise over its largest reading [-], (looks,).
        known: the existing modules.
        imperfect: fraction of the samples with imperfect transducers [-].
    """
    networks = [FixedNetwork(module.network) for module in known.shapes]
    inputs, scores = [], []
    with torch.no_grad():
        for here, level in zip(index.split(_CHUNK), noise.split(_CHUNK), strict=True):
            features, _ = looker.features(here, level, int(imperfect * len(here)))
            inputs.append(torch.cat([features, known.poses(features)], 1))
            scores.append(torch.cat([network(inputs[-1]) for network in networks], 1))
    return Looks(torch.cat(inputs), torch.cat(scores), own[index])


class NewModule(torch.nn.Module):
    """A network with two hidden layers, which at first returns the mean score of several existing modules.

    The hidden units of the existing modules lie side by side.
    """

    def __init__(self, like: Sequence[ShapeModule]) -> None:
        super().__init__()
        weights = [[torch.tensor(module.network.weights[k]) for module in like] for k in range(3)]
        biases = [[torch.tensor(module.network.biases[k]) for module in like] for k in range(3)]
        first, last = torch.cat(weights[0], 1), torch.cat(weights[2]) / len(like)
        self.weights = torch.nn.ParameterList([first, torch.block_diag(*weights[1]), last])
        self.biases = torch.nn.ParameterList(
            [torch.cat(biases[0]), torch.cat(biases[1]), torch.stack(biases[2]).mean(0)]
        )

    def forward(self, inputs: torch.Tensor) -> torch.Tensor:
        """Scores of the new shape, (looks,), from inputs (looks, inputs)."""
        for weights, bias in zip(list(self.weights)[:-1], self.biases, strict=False):
            inputs = torch.nn.functional.silu(torch.addmm(bias, inputs, weights))
        return torch.addmm(self.biases[-1], inputs, self.weights[-1])[:, 0]

    def arrays(self) -> dict[str, np.ndarray]:
        """Weights in half precision and biases, by the names that `Network.from_arrays` expects."""
        return stored_layers("shape", self.weights, self.biases)


def most_alike(looks: Looks, known: Sequence[ShapeModule], count: int) -> list[ShapeModule]:
    """The existing modules with the largest scores on the new shape, in descending order."""
    return [known[k] for k in looks.scores[looks.own].mean(0).argsort(descending=True)[:count].tolist()]


def fit_module(network: NewModule, looks: Looks, schedule: Schedule, generator: torch.Generator, label: str) -> None:
    """Fit a new module, in place, to training samples; half of each batch is of the new shape.

    In use, all shapes are equally likely a priori. So the bias is lowered by the logarithm of the number of existing
    shapes at the end.
    """
    others = looks.scores.logsumexp(1)
    pools = [torch.nonzero(looks.own == own)[:, 0] for own in (True, False)]
    half = schedule.batch // 2
    answers = torch.cat([torch.ones(half), torch.zeros(half)])

    def loss() -> torch.Tensor:
        index = torch.cat([pool[torch.randint(len(pool), (half,), generator=generator)] for pool in pools])
        odds = network(looks.inputs[index]) - others[index]
        return torch.nn.functional.binary_cross_entropy_with_logits(odds, answers)

    descend(network, loss, schedule, label)
    network.biases[-1].data -= float(np.log(looks.scores.shape[1]))
