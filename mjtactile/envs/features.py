"""A few numbers that say what a pad's readings look like: how much, where, how wide, how lopsided."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: Features of each layer: logarithm of the mean reading over 1 kPa, centroid, spread and skewness along rows.
MOMENTS = 4
#: Mean readings below this say nothing of where [Pa].
_LEAST = 20.0


def moments(readings: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Moments of readings along the rows (the pad's y), for each layer of each pad.

    Slip along y moves the pattern or, under a fingertip that aligns itself, changes its width; shear along y makes it
    lopsided, the more so the deeper; the normal force scales the whole.

    Args:
        readings: (..., layers, rows, columns) [Pa].

    Returns:
        (..., layers, 4): log(1 + mean / 1 kPa), centroid, standard deviation and cube root of the third moment, the
        last three over half the number of rows and 0 where next to nothing is felt.
    """
    profile = readings.mean(axis=-1)
    rows = profile.shape[-1]
    place = (np.arange(rows) - (rows - 1) / 2.0) / (rows / 2.0)
    mean = profile.mean(axis=-1)
    felt = mean > _LEAST
    share = np.where(felt[..., None], profile / np.where(felt, mean * rows, 1.0)[..., None], 0.0)
    centroid = share @ place
    off = place - centroid[..., None]
    second, third = ((share * off**power).sum(axis=-1) for power in (2, 3))
    spread = np.sqrt(np.maximum(second, 0.0)) * felt
    size = np.log1p(np.maximum(mean, 0.0) / 1e3)
    return np.stack([size, centroid, spread, np.cbrt(third) * felt], axis=-1).astype(np.float32)
