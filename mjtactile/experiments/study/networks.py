"""Fully connected networks trained with RPROP, several initialisations side by side.

RPROP takes only the sign of each weight's own gradient (Riedmiller and Braun 1993), so networks stacked along a leading
axis learn just as each would alone; `torch.optim.Rprop` moves all of them at once.
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

#: The factors a step grows and shrinks by: Riedmiller and Braun's.
SHRINK, GROW = 0.5, 1.2
#: Largest step of a weight: theirs, too.
LARGEST_STEP = 50.0
#: Iterations between two looks at the training error, when the best weights so far are kept.
LOOK_EVERY = 10
#: Widths of the initial weights: "fan-in" is uniform within 1 / sqrt(inputs).
INITIALS = ("fan-in", "half", "small")

_HIDDEN = {"sigmoid": torch.sigmoid, "tanh": torch.tanh}


@dataclass(frozen=True, kw_only=True)
class NetworkDesign:
    """What a network looks like before it has learnt anything."""

    hidden: tuple[int, ...]  #: units of each hidden layer
    output: str = "linear"  #: of the last layer: "linear" or "sigmoid"
    activation: str = "sigmoid"  #: of hidden units: "sigmoid" or "tanh"
    initial: str = "fan-in"  #: initial weights: one of INITIALS
    #: Of every weight. Riedmiller and Braun begin with 0.1, which throws a unit of 676 inputs so far that it saturates
    #: and never learns: seen on the training samples alone.
    first_step: float = 0.01
    #: Of every weight. PyTorch's own least, 1e-6, ends the magnitude networks' learning at a training error of 0.4 gf
    #: after a thousand iterations: again seen on the training samples alone.
    smallest_step: float = 1e-12


@dataclass(frozen=True, eq=False)
class Networks:
    """Trained networks of one design, one per seed.

    Attributes:
        design: their shape.
        weights: of each layer, (seeds, inputs, outputs); biases: (seeds, 1, outputs).
        error: root mean square error over the training samples and outputs, (seeds,).
        iterations: of training, for all of them.
    """

    design: NetworkDesign
    weights: list[torch.Tensor]
    biases: list[torch.Tensor]
    error: Array
    iterations: int

    def __call__(self, inputs: Array) -> Array:
        """Outputs (seeds, samples, outputs) for inputs (samples, inputs) or, by seed, (seeds, samples, inputs)."""
        with torch.no_grad():
            given = torch.as_tensor(inputs, dtype=self.weights[0].dtype)
            return _forward(self.design, self.weights, self.biases, given).double().numpy()


@dataclass(frozen=True, kw_only=True)
class Training:
    """How many networks are trained, and how long.

    Attributes:
        seeds: of the initial weights; a seed's network does not depend on which others learn beside it.
        iterations: at most.
        tolerance: root mean square error at which a network learns no more.
        precision: of the arithmetic.
        progress: told the share of the work done.
    """

    seeds: Sequence[int]
    iterations: int
    tolerance: float = 0.0
    precision: torch.dtype = torch.float32
    progress: Callable[[float], None] = lambda share: None


def train(design: NetworkDesign, inputs: Array, targets: Array, training: Training) -> Networks:
    """Train one network per seed on all samples at once; each keeps the weights with its least training error.

    A network that is content learns no more, however long the others take.

    Args:
        design: of the networks.
        inputs: (samples, inputs).
        targets: (samples, outputs).
        training: how long they learn.
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
            training.progress(done / iterations)
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
    """The function that tells the mean square error of each network and leaves its gradient in the parameters."""
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
    best: list[torch.Tensor],
    parameters: list[torch.Tensor],
    least: torch.Tensor,
    error: torch.Tensor,
    tolerance: float,
) -> torch.Tensor:
    """Copy the weights of networks that are better than ever and were not content; the least error of each."""
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
