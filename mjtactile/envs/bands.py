"""Ranges of which some bands are for training and the others for testing."""

from __future__ import annotations

import numpy as np

from mjtactile.envs.options import EnvError

#: Which bands are drawn from.
SPLITS = ("all", "train", "test")


class Bands:
    """A range in bands of equal width; every second one, from the second on, is never trained on.

    Args:
        low, high: of the range.
        split: "all" bands, those to "train" with, or those to "test" with.
        count: of bands, odd, so that what is tested lies between what was trained.

    Raises:
        EnvError: there is no such split.
    """

    def __init__(self, low: float, high: float, *, split: str, count: int = 7) -> None:
        if split not in SPLITS:
            raise EnvError(f"split = {split!r} does not exist. Available: {', '.join(SPLITS)}.")
        self._low, self._width = low, (high - low) / count
        self._bands = {"all": np.arange(count), "train": np.arange(0, count, 2), "test": np.arange(1, count, 2)}[split]

    def draw(self, drawn: np.random.Generator) -> float:
        """A value, evenly from the bands."""
        band = self._bands[drawn.integers(len(self._bands))]
        return float(self._low + (band + drawn.random()) * self._width)
