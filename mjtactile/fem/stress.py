"""Coordinates of the stress at a point.

The deviatoric stress is kept as five coordinates whose Euclidean norm is the von Mises stress:
(3/2 s_zz, sqrt(3)/2 (s_xx - s_yy), sqrt(3) s_xy, sqrt(3) s_yz, sqrt(3) s_zx); nothing in them is singular as the
Poisson ratio approaches 1/2. The mean stress, sigma_kk / 3, completes the tensor.
"""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array

#: Coordinates of the deviatoric stress.
DEVIATORIC_COUNT = 5


def von_mises(deviatoric: Array) -> Array:
    """Von Mises stress [Pa] from deviatoric coordinates (..., 5) [Pa]: the Euclidean norm over the last axis."""
    return np.sqrt(np.einsum("...i,...i->...", deviatoric, deviatoric))


def stress_tensor(deviatoric: Array, mean: Array) -> Array:
    """Stress components (..., 6) = xx, yy, zz, xy, yz, zx [Pa] from deviatoric coordinates (..., 5) and mean (...)."""
    s_zz = deviatoric[..., 0] / 1.5
    difference = deviatoric[..., 1] * 2 / np.sqrt(3.0)
    shears = deviatoric[..., 2:] / np.sqrt(3.0)
    normal = np.stack([(difference - s_zz) / 2, (-difference - s_zz) / 2, s_zz], axis=-1) + mean[..., None]
    return np.concatenate([normal, shears], axis=-1)
