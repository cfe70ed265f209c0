"""A network that returns values and their standard deviations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.network import Network

#: Logarithms of standard deviations, over the scale, are taken no further than this.
_LEAST, _MOST = -8.0, 4.0


@dataclass(frozen=True, eq=False)
class Estimator:
    """Features to values and standard deviations.

    Attributes:
        network: features to scaled values, then the logarithms of their scaled standard deviations.
        mean, scale: of the values.
    """

    network: Network
    mean: np.ndarray
    scale: np.ndarray

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], name: str) -> Estimator:
        """The estimator whose network is stored under this name."""
        return cls(Network.from_arrays(arrays, name), arrays["target mean"], arrays["target scale"])

    def __call__(self, features: np.ndarray) -> tuple[Array, Array]:
        """Values and standard deviations, (n, values) each, of features (n, features)."""
        outputs = self.network(features).astype(np.float64)
        count = len(self.scale)
        deviations = np.exp(np.clip(outputs[:, count:], _LEAST, _MOST)) * self.scale
        return outputs[:, :count] * self.scale + self.mean, deviations
