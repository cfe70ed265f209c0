"""Shape modules during training: small networks side by side, with fixed features and pose modules."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from mjtactile.recognition.network import Network
from mjtactile.recognition.pose import POSE_KINDS, PoseModule
from mjtactile.recognition.training.fitting import stored_layers
from mjtactile.recognition.weight_files import read_weights


class PoseNetworks(torch.nn.Module):
    """Fixed modules for position, size and orientation, which map features to all their scaled values."""

    def __init__(self, modules: Sequence[PoseModule]) -> None:
        super().__init__()
        self._networks = torch.nn.ModuleList([FixedNetwork(module.network) for module in modules])
        self.outputs = sum(POSE_KINDS[module.kind] for module in modules)

    @classmethod
    def from_folder(cls, folder: Path) -> PoseNetworks:
        """The modules in a folder of weights."""
        return cls([PoseModule.from_stored(read_weights(folder / f"{kind}.safetensors")) for kind in POSE_KINDS])

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Scaled values of all modules, (presses, outputs)."""
        return torch.cat([network(features) for network in self._networks], 1)


class FixedNetwork(torch.nn.Module):
    """A stored network in torch, with fixed weights."""

    def __init__(self, network: Network) -> None:
        super().__init__()
        self._layers = [
            (torch.tensor(weights), torch.tensor(biases))
            for weights, biases in zip(network.weights, network.biases, strict=True)
        ]

    def forward(self, inputs: torch.Tensor) -> torch.Tensor:
        """Outputs (n, outputs)."""
        with torch.no_grad():
            for weights, biases in self._layers[:-1]:
                inputs = torch.nn.functional.silu(inputs @ weights + biases)
            weights, biases = self._layers[-1]
            return inputs @ weights + biases


class ShapeNetworks(torch.nn.Module):
    """One network with two hidden layers of `width` units for each shape, after fixed pose modules."""

    def __init__(self, poses: PoseNetworks, count: int, width: int, inputs: int) -> None:
        super().__init__()
        self.poses, self.count, self.width = poses, count, width
        self.first = torch.nn.Linear(inputs, count * width)
        self.second = torch.nn.Parameter(torch.randn(count, width, width) / width**0.5)
        self.second_bias = torch.nn.Parameter(torch.zeros(count, 1, width))
        self.last = torch.nn.Parameter(torch.randn(count, width, 1) / width**0.5)
        self.last_bias = torch.nn.Parameter(torch.zeros(count, 1, 1))

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Scores, (presses, shapes), from features (presses, features)."""
        inputs = torch.cat([features, self.poses(features)], 1)
        hidden = torch.nn.functional.silu(self.first(inputs)).view(-1, self.count, self.width).transpose(0, 1)
        hidden = torch.nn.functional.silu(torch.baddbmm(self.second_bias, hidden, self.second))
        return torch.baddbmm(self.last_bias, hidden, self.last)[..., 0].T

    def arrays(self, k: int) -> dict[str, np.ndarray]:
        """Weights in half precision and biases of the k-th network, by the names that `Network.from_arrays` expects."""
        own = slice(k * self.width, (k + 1) * self.width)
        weights = [self.first.weight[own].T, self.second[k], self.last[k]]
        biases = [self.first.bias[own], self.second_bias[k, 0], self.last_bias[k, 0]]
        return stored_layers("shape", weights, biases)
