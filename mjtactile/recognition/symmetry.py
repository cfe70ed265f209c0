"""Symmetry of square pads: all readings are mirrored into one octant of the pad.

On a square pad with a square grid of taxels, mirroring a press mirrors its readings. So readings are mirrored such that
their centre has x >= y >= 0, recognised there, and the result is mirrored back. Only an eighth of all presses has to be
learnt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.pad import Pad
from mjtactile.pad_shape.taxels import FreeTaxels


@dataclass(frozen=True, eq=False)
class Mirrors:
    """How each reading of a batch was mirrored: first in x, then in y, then x and y swapped."""

    x: np.ndarray  #: whether each reading was mirrored in this way, (readings,) bool
    y: np.ndarray  #: likewise
    swapped: np.ndarray  #: likewise

    def vectors(self, vectors: Array) -> Array:
        """Vectors (readings, 2 or 3) after mirroring."""
        out = np.array(vectors, copy=True)
        out[self.x, 0] *= -1
        out[self.y, 1] *= -1
        out[self.swapped, :2] = out[self.swapped, 1::-1]
        return out

    def original(self, vectors: Array) -> Array:
        """Vectors (readings, 2 or 3) on the pad from those after mirroring; the inverse of `vectors`."""
        out = np.array(vectors, copy=True)
        out[self.swapped, :2] = out[self.swapped, 1::-1]
        out[self.y, 1] *= -1
        out[self.x, 0] *= -1
        return out

    def angles(self, angles: Array) -> Array:
        """Angles from +x towards +y (readings,) [rad] after mirroring."""
        out = np.where(self.x, np.pi - angles, angles)
        out = np.where(self.y, -out, out)
        return np.where(self.swapped, np.pi / 2 - out, out)

    def original_angles(self, angles: Array) -> Array:
        """Angles (readings,) [rad] on the pad from those after mirroring; the inverse of `angles`."""
        out = np.where(self.swapped, np.pi / 2 - angles, angles)
        out = np.where(self.y, -out, out)
        return np.where(self.x, np.pi - out, out)

    def then(self, after: Mirrors) -> Mirrors:
        """The composition of these mirrors and then `after`."""
        x = self.x ^ np.where(self.swapped, after.y, after.x)
        y = self.y ^ np.where(self.swapped, after.x, after.y)
        return Mirrors(x, y, self.swapped ^ after.swapped)


#: What recognisers need of a pad, for error messages.
NEEDED = "recognisers mirror readings into one octant of a flat, square pad with a square, centred grid of taxels"


def is_symmetric(pad: Pad) -> bool:
    """Whether a pad is flat and symmetric under x -> -x, y -> -y and swapping x and y, as its grid of taxels is."""
    if isinstance(pad.taxels, FreeTaxels) or not pad.surface.is_flat:
        return False
    grid = pad.grid
    return (
        pad.size[0] == pad.size[1]
        and grid.rows == grid.columns
        and grid.pitch[0] == grid.pitch[1]
        and (grid.centre == (0.0, 0.0))
    )


def into_octant(readings: Array) -> tuple[Array, Mirrors]:
    """Readings (n, layers, rows, columns) mirrored so that their centre has x >= y >= 0, and the mirrors."""
    total = readings.sum(axis=1)
    rows, columns = total.shape[1:]
    over_x, over_y = np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2
    x, y = total.sum(axis=1) @ over_x.astype(total.dtype), total.sum(axis=2) @ over_y.astype(total.dtype)
    mirrors = Mirrors(x < 0, y < 0, np.abs(y) > np.abs(x))
    return mirrored(readings, mirrors), mirrors


def mirrored(readings: Array, mirrors: Mirrors) -> Array:
    """Readings (n, layers, rows, columns), each mirrored by its own mirrors."""
    if len(readings) == 1:
        one = readings[:, :, :: -1 if mirrors.y[0] else 1, :: -1 if mirrors.x[0] else 1]
        return one.swapaxes(2, 3) if mirrors.swapped[0] else one
    out = np.array(readings, copy=True)
    out[mirrors.x] = out[mirrors.x][:, :, :, ::-1]
    out[mirrors.y] = out[mirrors.y][:, :, ::-1]
    out[mirrors.swapped] = out[mirrors.swapped].swapaxes(2, 3)
    return out
