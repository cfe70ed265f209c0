"""The gradient of networks with one hidden layer and one output; all initialisations form one wide network.

The magnitude networks are trained for a hundred thousand iterations, so their gradient is written out. With inputs x,
hidden units h = sigmoid(x V + c), output o = h w + b and error e = o - y over n samples,

    dE/dw = sum_n e h,    dE/db = sum_n e,    dE/d(V, c) = w sum_n (x, 1) e h (1 - h)

up to a positive factor, which does not affect RPROP. The hidden layers of all initialisations lie side by side in one
matrix, so the samples' inputs are multiplied only once. This is twice as fast as automatic differentiation.
"""

from __future__ import annotations

import torch


class WideGradient:
    """Errors and gradients of `seeds` networks of sigmoid hidden units and one linear output.

    Args:
        inputs: (samples, inputs).
        targets: (samples, 1).
        weights: weights of the two layers, (seeds, inputs, hidden) and (seeds, hidden, 1); the trained parameters.
        biases: biases of the two layers, (seeds, 1, hidden) and (seeds, 1, 1); likewise.
    """

    def __init__(
        self, inputs: torch.Tensor, targets: torch.Tensor, weights: list[torch.Tensor], biases: list[torch.Tensor]
    ) -> None:
        seeds, count, hidden = weights[0].shape
        self._inputs = torch.cat([inputs, torch.ones_like(inputs[:, :1])], dim=1)
        self._targets = targets[:, 0]
        self._weights, self._biases = weights, biases
        self._wide = inputs.new_empty(count + 1, seeds, hidden)
        self._hidden = inputs.new_empty(len(inputs), seeds * hidden)
        self._back = inputs.new_empty(len(inputs), seeds, hidden)
        self._summed = inputs.new_empty(count + 1, seeds * hidden)
        for parameter in (*weights, *biases):
            parameter.grad = torch.empty_like(parameter)

    def error(self) -> torch.Tensor:
        """Mean square error of each network (seeds,), with its gradient in every parameter's `grad`."""
        first, second = self._weights
        count, seeds, hidden = self._wide.shape
        with torch.no_grad():
            self._wide[:-1] = first.transpose(0, 1)
            self._wide[-1] = self._biases[0][:, 0]
            torch.mm(self._inputs, self._wide.view(count, -1), out=self._hidden).sigmoid_()
            units = self._hidden.view(-1, seeds, hidden)
            outputs = torch.bmm(units.transpose(0, 1), second)[..., 0] + self._biases[1][:, 0]
            error = outputs - self._targets
            torch.ops.aten.sigmoid_backward.grad_input(
                error.T[..., None].expand_as(units), units, grad_input=self._back
            )
            torch.mm(self._inputs.T, self._back.view(len(units), -1), out=self._summed)
            into_hidden = self._summed.view(count, seeds, hidden) * second[..., 0]
            for parameter, gradient in (
                (first, into_hidden[:-1].transpose(0, 1)),
                (self._biases[0], into_hidden[-1][:, None]),
                (second, torch.bmm(error[:, None], units.transpose(0, 1)).transpose(1, 2)),
                (self._biases[1], error.sum(dim=1)[:, None, None]),
            ):
                assert parameter.grad is not None
                parameter.grad.copy_(gradient)
            return (error**2).mean(dim=1)
