"""A network that estimates values and their standard deviations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.network import Network

#: Limits of the logarithms of scaled standard deviations.
_LEAST, _MOST = -8.0, 4.0


@dataclass(frozen=True, eq=False)
class Estimator:
    """Maps features to values and their standard deviations."""

    network: Network  #: its outputs are the scaled values, then the logarithms of their scaled standard deviations
    mean: np.ndarray  #: (values,); a value is mean + scale times its scaled value
    scale: np.ndarray  #: (values,)

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], name: str) -> Estimator:
        """The estimator whose network is stored as `name`, from the arrays of a file of weights."""
        return cls(Network.from_arrays(arrays, name), arrays["target mean"], arrays["target scale"])

    def __call__(self, features: np.ndarray) -> tuple[Array, Array]:
        """Values and their standard deviations, (n, values) each, from features (n, features)."""
        outputs = self.network(features).astype(np.float64)
        count = len(self.scale)
        deviations = np.exp(np.clip(outputs[:, count:], _LEAST, _MOST)) * self.scale
        return outputs[:, :count] * self.scale + self.mean, deviations
