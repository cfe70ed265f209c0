"""Readings as pictures: one tile per layer, side by side, the top layer first; rows run upwards, as y does."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.pad import Pad

Picture = npt.NDArray[np.uint8]

#: About as many pixels make up the width of a pad's tiles together, and the gap between two of them.
WIDTH, GAP = 384, 4
#: What is no larger is black at any scale [Pa].
LEAST_SCALE = 1e3
#: How fast the scale falls back to what is read now, per frame.
_DECAY = 0.97
_COLOURS = 256


class Scale:
    """The reading that is shown brightest, the same for all pads: the largest there was lately."""

    def __init__(self) -> None:
        self.peak = LEAST_SCALE

    def follow(self, readings: list[npt.NDArray[np.float32]]) -> float:
        """Take in the readings of a frame.

        Args:
            readings: of each pad [Pa].

        Returns:
            The reading that is brightest now [Pa].
        """
        now = max((float(one.max()) for one in readings), default=0.0)
        self.peak = max(_DECAY * self.peak, now, LEAST_SCALE)
        return self.peak


def taxel_pixels(reading_shape: tuple[int, int, int]) -> int:
    """Pixels along each side of a taxel."""
    layers, _, columns = reading_shape
    return max(1, (WIDTH - GAP * (layers - 1)) // (layers * columns))


def heat_map(readings: npt.NDArray[np.float32], peak: float) -> Picture:
    """RGB tiles of all layers (height, width, 3).

    Args:
        readings: (layers, rows, columns) [Pa].
        peak: the reading that is brightest [Pa].
    """
    layers, rows, columns = readings.shape
    size = taxel_pixels((layers, rows, columns))
    level = np.clip(readings / peak * (_COLOURS - 1), 0, _COLOURS - 1).astype(np.intp)
    tiles = palette()[level[:, ::-1]].repeat(size, axis=1).repeat(size, axis=2)
    width = columns * size
    picture = np.full((rows * size, layers * (width + GAP) - GAP, 3), 255, dtype=np.uint8)
    for layer, tile in enumerate(tiles):
        left = layer * (width + GAP)
        picture[:, left : left + width] = tile
    return picture


def draw_outline(picture: Picture, outline: Array, pad: Pad) -> Picture:
    """Draw what presses onto every tile of a heat map.

    Args:
        picture: of `heat_map`.
        outline: line segments in the pad frame [m], (segments, 2, 2).
        pad: whose taxels these are.
    """
    from PIL import Image, ImageDraw

    if not len(outline):
        return picture
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    places = _pixels(outline, pad)
    layers, _, columns = pad.reading_shape
    step = columns * taxel_pixels(pad.reading_shape) + GAP
    for layer in range(layers):
        for start, end in places + np.array([layer * step, 0.0]):
            draw.line([*start, *end], fill=(255, 255, 255))
    return np.asarray(image)


def _pixels(points: Array, pad: Pad) -> Array:
    """Points of the pad frame [m] on the first tile, (..., 2)."""
    _, rows, columns = pad.reading_shape
    size, taxels = taxel_pixels(pad.reading_shape), pad.taxels
    corner = np.array([taxels.x[0] - taxels.pitch[0] / 2, taxels.y[0] - taxels.pitch[1] / 2])
    place = (points - corner) / np.array(taxels.pitch) * size
    place[..., 1] = rows * size - 1 - place[..., 1]
    # Pads are wider than their taxels: what lies beyond them is drawn on the tile's edge.
    return np.clip(place, 0.0, np.array([columns, rows]) * size - 1.0)


@cache
def palette() -> Picture:
    """Colours from nothing to the largest reading, (256, 3)."""
    from matplotlib import colormaps

    return (colormaps["magma"](np.arange(_COLOURS))[:, :3] * 255).astype(np.uint8)
