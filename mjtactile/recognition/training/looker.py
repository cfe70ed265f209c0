"""Batches of training features with random noise.

Noise is added to projections instead of readings. The principal components are orthonormal, so white noise on the
taxels is white noise on the projections, and the residual's sum of squares has a chi-squared distribution. This is
equivalent and several times faster.
"""

from __future__ import annotations

import torch

from mjtactile.recognition.features import PrincipalComponents, noise_feature
from mjtactile.recognition.training.examples import Examples
from mjtactile.recognition.training.presses import Presses


class Looker:
    """Computes features of presses, in the octant and projected on a view's components, with random noise."""

    def __init__(self, presses: Presses | Examples, view: PrincipalComponents, generator: torch.Generator) -> None:
        self.readings = torch.tensor(presses.readings)
        self.parts = torch.tensor(view.parts)
        self.projected = torch.tensor(presses.projected)
        self.energy = torch.tensor(presses.energy)
        self.peak = torch.tensor(presses.peak)
        self.mean, self.scale = torch.tensor(view.mean), torch.tensor(view.scale)
        self.outside = view.parts.shape[0] - view.parts.shape[1]
        self.generator = generator

    def features(
        self, index: torch.Tensor, noise: torch.Tensor, imperfect: int = 0
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Features of some presses, (n, parts + 1), and norms of their projections, (n,).

        Args:
            index: indices of the presses, (n,).
            noise: standard deviation over the press's largest reading [-], (n,).
            imperfect: number of presses, from the first on, that are read by imperfect transducers.
        """
        clean, energy = self.projected[index], self.energy[index]
        if imperfect:
            flat = self._imperfect(self.readings[index[:imperfect]])
            clean = torch.cat([flat @ self.parts, clean[imperfect:]])
            energy = torch.cat([(flat**2).sum(1), energy[imperfect:]])
        sigma = noise * self.peak[index]
        inside = (clean**2).sum(1)
        left = (energy - inside).clamp_min(0.0)
        # Residual with noise: sum of (e + sigma z)^2; the chi-squared sum of z^2 is nearly normal for so many taxels.
        z = torch.randn((2, len(index)), generator=self.generator)
        spread = self.outside + (2.0 * self.outside) ** 0.5 * z[0]
        outside = (left + sigma**2 * spread + 2.0 * sigma * left.sqrt() * z[1]).clamp_min(0.0)
        noisy = clean + sigma[:, None] * torch.randn(clean.shape, generator=self.generator)
        size = (noisy**2).sum(1).sqrt()
        level = (outside / self.outside).sqrt() / size
        last = noise_feature(level, torch.log)
        features = (noisy / size[:, None] - self.mean) * self.scale
        return torch.cat([features, last[:, None]], 1), size

    def _imperfect(self, readings: torch.Tensor) -> torch.Tensor:
        """Readings [Pa], (n, taxels), with crosstalk and a spread of gains."""
        spread = torch.rand((2, len(readings), 1, 1, 1), generator=self.generator)
        # Crosstalk up to 1.5 % to each neighbour, gains with a standard deviation up to 2 %.
        padded = torch.nn.functional.pad(readings, (1, 1, 1, 1), mode="replicate")
        around = padded[..., 1:-1, 2:] + padded[..., 1:-1, :-2] + padded[..., 2:, 1:-1] + padded[..., :-2, 1:-1]
        coupled = readings + 0.015 * spread[0] * (around - 4.0 * readings)
        gains = 1.0 + 0.02 * spread[1] * torch.randn(readings.shape, generator=self.generator)
        return (coupled * gains).flatten(1)
