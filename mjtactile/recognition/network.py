"""A fully connected network in NumPy, so that recognition does not need torch; a call takes tens of microseconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Network:
    """A network of layers x -> W x + b, with silu(z) = z / (1 + exp(-z)) between them."""

    weights: tuple[np.ndarray, ...]  #: weights of each layer, (inputs, outputs) float32
    biases: tuple[np.ndarray, ...]  #: biases of each layer, (outputs,) float32

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """Outputs (n, outputs) for inputs (n, inputs), float32."""
        for weights, biases in zip(self.weights[:-1], self.biases[:-1], strict=True):
            inputs = silu(inputs @ weights + biases)
        return inputs @ self.weights[-1] + self.biases[-1]

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], name: str) -> Network:
        """The network stored as arrays `name weights k` and `name biases k` of any precision, k = 0, 1, ..."""
        count = sum(key.startswith(f"{name} weights ") for key in arrays)
        return cls(
            tuple(arrays[f"{name} weights {k}"].astype(np.float32) for k in range(count)),
            tuple(arrays[f"{name} biases {k}"].astype(np.float32) for k in range(count)),
        )


def silu(z: np.ndarray) -> np.ndarray:
    """The function z / (1 + exp(-z)); for large negative values exp overflows, which gives the correct limit zero."""
    with np.errstate(over="ignore"):
        return z / (1.0 + np.exp(-z))
