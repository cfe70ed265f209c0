"""Fully connected networks trained with RPROP, several initialisations at once.

RPROP uses only the sign of each weight's gradient (Riedmiller and Braun 1993), so networks stacked along a leading axis
are trained independently; `torch.optim.Rprop` updates all of them at once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from mjtactile._types import Array
from mjtactile.experiments.study.wide import WideGradient

#: Factors by which a step shrinks and grows, from Riedmiller and Braun.
SHRINK, GROW = 0.5, 1.2
#: Largest step of a weight, from the same source.
LARGEST_STEP = 50.0
#: Number of iterations between two evaluations of the training error, at which the best weights are stored.
LOOK_EVERY = 10
#: Widths of the initial weights: "fan-in" is uniform within 1 / sqrt(inputs).
INITIALS = ("fan-in", "half", "small")

_HIDDEN = {"sigmoid": torch.sigmoid, "tanh": torch.tanh}


@dataclass(frozen=True, kw_only=True)
class NetworkDesign:
    """Architecture and initialisation of a network."""

    hidden: tuple[int, ...]  #: units of each hidden layer
    output: str = "linear"  #: activation of the last layer: "linear" or "sigmoid"
    activation: str = "sigmoid"  #: activation of hidden units: "sigmoid" or "tanh"
    initial: str = "fan-in"  #: initial weights: one of INITIALS
    #: First step of every weight. Riedmiller and Braun use 0.1, with which a unit with 676 inputs saturates at once and
    #: does not learn, as the training error shows.
    first_step: float = 0.01
    #: Smallest step of every weight. With PyTorch's default of 1e-6 the magnitude networks stop at a training error of
    #: 0.4 gf after a thousand iterations.
    smallest_step: float = 1e-12


@dataclass(frozen=True, eq=False)
class Networks:
    """Trained networks of one design, one per seed."""

    design: NetworkDesign  #: their architecture
    weights: list[torch.Tensor]  #: weights of each layer, (seeds, inputs, outputs)
    biases: list[torch.Tensor]  #: biases of each layer, (seeds, 1, outputs)
    error: Array  #: root mean square error over the training samples and outputs, (seeds,)
    iterations: int  #: number of training iterations of all networks together

    def __call__(self, inputs: Array) -> Array:
        """Outputs (seeds, samples, outputs) for inputs (samples, inputs) or, by seed, (seeds, samples, inputs)."""
        with torch.no_grad():
            given = torch.as_tensor(inputs, dtype=self.weights[0].dtype)
            return _forward(self.design, self.weights, self.biases, given).double().numpy()


@dataclass(frozen=True, kw_only=True)
class Training:
    """Parameters of a training."""

    seeds: Sequence[int]  #: seeds of the initial weights, one for each network; networks do not depend on each other
    iterations: int  #: largest number of iterations
    tolerance: float = 0.0  #: root mean square error at which the training of a network stops
    precision: torch.dtype = torch.float32  #: floating-point type


def train(design: NetworkDesign, inputs: Array, targets: Array, training: Training) -> Networks:
    """Train one network per seed on all samples at once; the weights with the least training error are kept.

    Inputs have shape (samples, inputs), wanted outputs (samples, outputs).

    The training of a network stops at the tolerance, independently of the others.
    """
    precision, tolerance, iterations = training.precision, training.tolerance, training.iterations
    sizes = (inputs.shape[1], *design.hidden, targets.shape[1])
    weights, biases = _initial(design, sizes, training.seeds, precision)
    given, wanted = torch.as_tensor(inputs, dtype=precision), torch.as_tensor(targets, dtype=precision)
    parameters = [*weights, *biases]
    for parameter in parameters:
        parameter.requires_grad_()
    optimiser = torch.optim.Rprop(
        parameters, lr=design.first_step, etas=(SHRINK, GROW), step_sizes=(design.smallest_step, LARGEST_STEP)
    )
    best = [parameter.detach().clone() for parameter in parameters]
    least = torch.full((len(training.seeds),), math.inf, dtype=precision)
    done, error_and_gradient = 0, _error_and_gradient(design, given, wanted, weights, biases)
    for done in range(iterations + 1):
        error = error_and_gradient()
        if done % LOOK_EVERY == 0 or done == iterations:
            least = _keep_better(best, parameters, least, error, tolerance)
            if done == iterations or bool((least.sqrt() <= tolerance).all()):
                break
        optimiser.step()
    count = len(weights)
    return Networks(design, best[:count], best[count:], least.sqrt().double().numpy(), done)


def _error_and_gradient(
    design: NetworkDesign,
    given: torch.Tensor,
    wanted: torch.Tensor,
    weights: list[torch.Tensor],
    biases: list[torch.Tensor],
) -> Callable[[], torch.Tensor]:
    """A function that returns the mean square error of each network and stores its gradient in the parameters."""
    if len(design.hidden) == 1 and wanted.shape[1] == 1 and (design.activation, design.output) == ("sigmoid", "linear"):
        return WideGradient(given, wanted, weights, biases).error

    def differentiated() -> torch.Tensor:
        for parameter in (*weights, *biases):
            parameter.grad = None
        error = ((_forward(design, weights, biases, given) - wanted) ** 2).mean(dim=(1, 2))
        error.sum().backward()
        return error.detach()

    return differentiated


def _keep_better(
    best: list[torch.Tensor], parameters: list[torch.Tensor], least: torch.Tensor, error: torch.Tensor, tolerance: float
) -> torch.Tensor:
    """Copy the weights of networks with a new least error above the tolerance; return the least error of each."""
    better = (error < least) & (least.sqrt() > tolerance)
    with torch.no_grad():
        for kept, now in zip(best, parameters, strict=True):
            kept[better] = now[better]
    return torch.where(better, error, least)


def _forward(
    design: NetworkDesign, weights: list[torch.Tensor], biases: list[torch.Tensor], inputs: torch.Tensor
) -> torch.Tensor:
    """Outputs (seeds, samples, outputs)."""
    values = inputs.expand(weights[0].shape[0], *inputs.shape[-2:])
    for k, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        values = torch.baddbmm(bias, values, weight)
        if k < len(weights) - 1:
            values = _HIDDEN[design.activation](values)
    return torch.sigmoid(values) if design.output == "sigmoid" else values


def _initial(
    design: NetworkDesign, sizes: Sequence[int], seeds: Sequence[int], precision: torch.dtype
) -> tuple[list[torch.Tensor], list[torch.Tensor]]:
    """Initial weights and biases; a seed draws its own from the first layer to the last."""
    drawn = [np.random.default_rng(seed) for seed in seeds]
    weights, biases = [], []
    for inputs, outputs in itertools.pairwise(sizes):
        layer = np.stack([_draw(design.initial, each, inputs, (inputs + 1, outputs)) for each in drawn])
        weights.append(torch.as_tensor(layer[:, :-1], dtype=precision).contiguous())
        biases.append(torch.as_tensor(layer[:, -1:], dtype=precision).contiguous())
    return weights, biases


def _draw(initial: str, drawn: np.random.Generator, inputs: int, shape: tuple[int, int]) -> Array:
    match initial:
        case "fan-in":
            return drawn.uniform(-1.0, 1.0, shape) / math.sqrt(inputs)
        case "half":
            return drawn.uniform(-0.5, 0.5, shape)
        case "small":
            return 0.05 * drawn.standard_normal(shape)
        case other:
            raise ValueError(f"initial weights {other!r} do not exist. Available: {', '.join(INITIALS)}.")
