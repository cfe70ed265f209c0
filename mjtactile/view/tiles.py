"""Where a pad's readings stand in a picture seen from above: a tile per layer, with a pixel per taxel or finer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Indices
from mjtactile.pad import Pad
from mjtactile.pad_shape.taxels import FreeTaxels

#: Pixels along the longer side of a pad with free taxels.
_PIXELS = 64
#: A taxel is drawn no smaller than this, in pixels: so far a point may be from the middle of a pixel.
_LEAST_RADIUS = 0.75
#: Weight of depth against distance seen from above, where several taxels stand over one another: the upper is drawn.
_DEPTH = 1e-6


@dataclass(frozen=True, eq=False)
class Tiles:
    """How readings of a pad are laid out.

    Attributes:
        low, high: corners of a tile in the pad frame [m], (2,).
        depths: of each tile, for people.
        taxel: which reading, counted in a row, each pixel shows, (tiles, rows, columns); -1 for none.
    """

    low: Array
    high: Array
    depths: tuple[str, ...]
    taxel: Indices

    @classmethod
    def of(cls, pad: Pad) -> Tiles:
        """A pixel per taxel of a grid; of free taxels discs as large as their balls, on the pad seen from above."""
        depths = tuple(pad.depth_said(layer) for layer in range(len(pad.layers_drawn)))
        half_size = np.array(pad.size) / 2
        if isinstance(pad.taxels, FreeTaxels):
            return cls(-half_size, half_size, depths, _discs(pad, pad.taxels))
        low, high = pad.taxels.corners
        return cls(low, high, depths, np.arange(np.prod(pad.reading_shape)).reshape(pad.reading_shape))

    def laid_out(self, readings: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Readings of the pad as tiles (tiles, rows, columns); NaN where there is no taxel."""
        return np.append(readings.ravel(), np.float32(np.nan))[self.taxel]


def _discs(pad: Pad, taxels: FreeTaxels) -> Indices:
    from scipy.spatial import KDTree

    size = np.array(pad.size)
    pixel = size.max() / _PIXELS
    columns, rows = np.maximum(np.ceil(size / pixel - 1e-9), 1).astype(int)
    x, y = np.meshgrid(
        *((np.arange(count) + 0.5) / count * side - side / 2 for count, side in zip((columns, rows), size, strict=True))
    )
    middles = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    radii = np.maximum(taxels.ball_radii(pad.sampling_radius), _LEAST_RADIUS * pixel)
    feet = pad.taxel_feet(0) * (1.0, 1.0, _DEPTH)
    tiles = []
    for layer in pad.layers_drawn:
        distance, nearest = KDTree(feet[layer]).query(middles)
        shown = np.asarray(layer)[nearest]
        tiles.append(np.where(distance <= radii[shown], shown, -1).reshape(rows, columns))
    return np.stack(tiles)
