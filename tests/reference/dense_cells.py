"""Cells of the dense contact: equal rectangles on a lattice, and how high a body stands over each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mjtactile._types import Array, Indices, Mask

#: Height of a body's lower surface over points (x, y) [m], each (n,), over any plane; infinite where there is none.
Heights = Callable[[Array, Array], Array]

#: Points along each side of the sheet where a body's heights are looked at.
SIEVE = 256
#: Longest cell, length over width.
STRETCH = 64.0


class Lattice(NamedTuple):
    """Equal rectangles along turned axes (u, v), numbered (column, row) from the lower left corner."""

    origin: Array  #: lower left corner (u, v) [m]
    size: Array  #: of a cell (u, v) [m]
    shape: tuple[int, int]  #: columns and rows
    angle: float  #: of the axes, counter-clockwise [rad]

    def turned(self, points: Array) -> Array:
        """Points or offsets (x, y) along the lattice's axes, shapes (..., 2)."""
        return points @ rotation(self.angle)

    def centres(self, index: Indices) -> Array:
        """Middles of cells (x, y), shape (n, 2) [m]."""
        return self.points(index, np.array([0.5, 0.5]))

    def points(self, index: Indices, places: Array) -> Array:
        """Points (x, y) at places in cells, each from 0 to 1 along u and v; (..., 2) [m]."""
        return (self.origin + (index + places) * self.size) @ rotation(self.angle).T

    def holding(self, points: Array) -> Indices:
        """The cells that hold points (x, y), shape (n, 2) [m]."""
        index = np.floor((self.turned(points) - self.origin) / self.size).astype(np.int64)
        return np.clip(index, 0, np.array(self.shape) - 1)

    def divided(self, parts: tuple[int, int]) -> Lattice:
        """The lattice with every cell cut into columns and rows."""
        shape = (self.shape[0] * parts[0], self.shape[1] * parts[1])
        return Lattice(self.origin, self.size / parts, shape, self.angle)

    def around(self, index: Indices, width: int = 1) -> Indices:
        """Cells, and their neighbours up to `width` away."""
        steps = np.arange(-width, width + 1)
        moves = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        grown = (index[:, None] + moves).reshape(-1, 2)
        inside = ((grown >= 0) & (grown < self.shape)).all(axis=1)
        return np.unique(grown[inside], axis=0)


def rotation(angle: float) -> Array:
    """Columns are axes turned counter-clockwise by an angle [rad]; not turned by nothing, to the last digit."""
    cosine, sine = (np.cos(angle), np.sin(angle)) if angle else (1.0, 0.0)
    return np.array([[cosine, -sine], [sine, cosine]])


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one body.

    Attributes:
        lattice: they belong to.
        index: their numbers, (n, 2).
        heights: mean height of the body over each [m], (n,).
        slopes: mean slopes of the body over each along x and y [-], (n, 2).
        rough: by how much the mean is above the least height that was looked at [m], (n,).
        share: of each cell that the body covers [-], (n,).
    """

    lattice: Lattice
    index: Indices
    heights: Array
    slopes: Array
    rough: Array
    share: Array

    @property
    def centres(self) -> Array:
        """Middles (n, 2) [m]."""
        return self.lattice.centres(self.index)

    @property
    def area(self) -> float:
        """Of one cell [m^2]."""
        return float(self.lattice.size.prod())

    def chosen(self, which: Mask) -> Cells:
        """Some of the cells."""
        heights, slopes, rough, share = (one[which] for one in (self.heights, self.slopes, self.rough, self.share))
        return Cells(self.lattice, self.index[which], heights, slopes, rough, share)


def covered_box(heights: Heights, points: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Corners of the box about all that a body covers, of whose points some are known; ends are found by bisection."""
    step = (high - low) / SIEVE
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    for axis in (0, 1):
        other = 1 - axis
        along = low[other] + (np.arange(2 * SIEVE) + 0.5) / (2 * SIEVE) * (high - low)[other]
        for end, sign in ((0, -1.0), (1, 1.0)):
            covered = box[end, axis]
            limit = np.clip(covered + sign * step[axis], low[axis], high[axis])
            for _ in range(40):
                at = (covered + limit) / 2 if _ else limit
                pair = [np.full(len(along), at), along]
                if np.isfinite(heights(pair[axis], pair[other])).any():
                    covered = at
                else:
                    limit = at
            # Ends on the sheet's own rim are that rim.
            box[end, axis] = limit if abs(limit - covered) < 1e-9 * step[axis] else covered
    return box[0], box[1]


def cells_over(heights: Heights, lattice: Lattice, index: Indices) -> Cells:
    """Cells with a body's mean heights over them; those it does not cover are left out.

    Four Gauss points do where the body covers them all; elsewhere the mean is over what it covers of 4 x 4 points.
    """
    mean, slopes, least, found = _sampled(heights, lattice, index, 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0))
    share = np.ones(len(index))
    cut = np.flatnonzero(found < 4)
    if len(cut):
        mean[cut], slopes[cut], least[cut], count = _sampled(heights, lattice, index[cut], (np.arange(4) + 0.5) / 4)
        share[cut] = count / 16
    kept = share > 0.0
    return Cells(lattice, index[kept], mean[kept], slopes[kept], (mean - least)[kept], share[kept])


def _sampled(heights: Heights, lattice: Lattice, index: Indices, places: Array) -> tuple[Array, Array, Array, Array]:
    """Mean, slopes (n, 2), least and number of the finite heights over a square of points in each cell; (n,) each."""
    offsets = np.stack(np.meshgrid(places, places), axis=-1).reshape(-1, 2)
    points = lattice.points(index[:, None], offsets).reshape(-1, 2)
    values = heights(points[:, 0], points[:, 1]).reshape(len(index), -1)
    finite = np.isfinite(values)
    count = finite.sum(axis=1)
    mean = np.where(finite, values, 0.0).sum(axis=1) / np.maximum(count, 1)
    slopes = _slopes(offsets @ np.diag(lattice.size), values, finite) @ rotation(lattice.angle).T
    return mean, slopes, np.where(count > 0, values.min(axis=1), 0.0), count


def _slopes(offsets: Array, values: Array, finite: Mask) -> Array:
    """Slopes (n, 2) of planes through the finite values (n, points), by least squares; 0 where none is determined."""
    count = np.maximum(finite.sum(axis=1), 1)
    middle = finite @ offsets / count[:, None]
    arms = np.where(finite[:, :, None], offsets - middle[:, None], 0.0)
    above = np.where(finite, values - np.where(finite, values, 0.0).sum(axis=1)[:, None] / count[:, None], 0.0)
    moments = np.einsum("npi,npj->nij", arms, arms)
    return np.einsum("nij,npj,np->ni", np.linalg.pinv(moments, rcond=1e-9, hermitian=True), arms, above)


def division(region: Indices, size: Array, wanted: int, most: int, narrowest: float) -> tuple[int, int]:
    """How cells of a region are cut, so that there are as many as wanted, about as stretched as its parts are.

    None is cut into more than `most` parts, or narrower than some width [m].

    The region's own measure is the mean run of its cells along each axis: a line along an axis has long runs along
    it, a slanted line or a ring has the same both ways.
    """
    runs = []
    for axis in (0, 1):
        ordered = region[np.lexsort((region[:, axis], region[:, 1 - axis]))]
        same = (np.diff(ordered[:, axis]) == 1) & (np.diff(ordered[:, 1 - axis]) == 0)
        runs.append(size[axis] * len(region) / (len(region) - int(same.sum())))
    stretch = np.clip(runs[0] / runs[1], 1 / STRETCH, STRETCH)
    wished = size[0] / size[1] / stretch  # columns over rows
    columns_most, rows_most = (max(1, min(most, int(side / narrowest))) for side in size)
    # Hardly better is not better: a lattice that stays is the end of the search.
    best, parts = abs(np.log(len(region) / wanted)) + abs(np.log(wished)) - 0.1, (1, 1)
    for columns in range(1, columns_most + 1):
        for rows in range(1, min(rows_most, most // columns) + 1):
            misfit = abs(np.log(columns * rows * len(region) / wanted)) + abs(np.log(columns / rows / wished))
            if misfit < best - 1e-9:
                best, parts = misfit, (columns, rows)
    return parts


def among(index: Indices, others: Indices) -> Mask:
    """Whether each cell is one of the others."""
    width = 1 + max(int(index[:, 1].max(initial=0)), int(others[:, 1].max(initial=0)))
    return np.isin(index[:, 0] * width + index[:, 1], others[:, 0] * width + others[:, 1])
