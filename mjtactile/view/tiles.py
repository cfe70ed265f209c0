"""Layout of a pad's readings in an image seen from above: one tile per layer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Indices
from mjtactile.pad import Pad
from mjtactile.pad_shape.taxels import FreeTaxels

#: Pixels along the longer side of a pad with free taxels.
_PIXELS = 64
#: Least radius of a taxel [pixels]; a point may be this far from the centre of the nearest pixel.
_LEAST_RADIUS = 0.75
#: Weight of depth against horizontal distance, so that the upper of several overlapping taxels is drawn.
_DEPTH = 1e-6


@dataclass(frozen=True, eq=False)
class Tiles:
    """Layout of a pad's readings."""

    low: Array  #: lower corner of a tile in the pad frame [m], (2,)
    high: Array  #: upper corner [m], (2,)
    depths: tuple[str, ...]  #: text with the depth of each tile
    taxel: Indices  #: index of each pixel's reading in the flattened readings, (tiles, rows, columns); -1 for none

    @classmethod
    def of(cls, pad: Pad) -> Tiles:
        """Layout of a pad: one pixel per taxel of a grid; free taxels are discs of the size of their balls."""
        depths = tuple(pad.depth_said(layer) for layer in range(len(pad.layers_drawn)))
        half_size = np.array(pad.size) / 2
        if isinstance(pad.taxels, FreeTaxels):
            return cls(-half_size, half_size, depths, _discs(pad))
        low, high = pad.taxels.corners
        return cls(low, high, depths, np.arange(np.prod(pad.reading_shape)).reshape(pad.reading_shape))

    def laid_out(self, readings: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Readings of the pad as tiles (tiles, rows, columns); NaN where there is no taxel."""
        return np.append(readings.ravel(), np.float32(np.nan))[self.taxel]


def _discs(pad: Pad) -> Indices:
    from scipy.spatial import KDTree

    size = np.array(pad.size)
    pixel = size.max() / _PIXELS
    columns, rows = np.maximum(np.ceil(size / pixel - 1e-9), 1).astype(int)
    x, y = np.meshgrid(
        *((np.arange(count) + 0.5) / count * side - side / 2 for count, side in zip((columns, rows), size, strict=True))
    )
    middles = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    radii = np.maximum(pad.sensed_radii, _LEAST_RADIUS * pixel)
    feet = pad.taxel_feet(0) * (1.0, 1.0, _DEPTH)
    tiles = []
    for layer in pad.layers_drawn:
        distance, nearest = KDTree(feet[layer]).query(middles)
        shown = np.asarray(layer)[nearest]
        tiles.append(np.where(distance <= radii[shown], shown, -1).reshape(rows, columns))
    return np.stack(tiles)
