"""Which triangles may be over which points of a mesh's shadow: a grid of cells, each with the triangles near it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

#: Cells along each side of the grid: finer ones take longer to fill, coarser ones hold more triangles to try.
_LEAST_CELLS_PER_SIDE, _MOST_CELLS_PER_SIDE = 16, 256


@dataclass(frozen=True, eq=False)
class ShadowGrid:
    """Triangles sorted into cells of the plane.

    Attributes:
        corner: least u and v [m], (2,).
        cell: size along u and v [m], (2,).
        count: cells along u and along v.
        starts: where each cell's triangles begin, (count^2 + 1,).
        triangles: their numbers, cell after cell.
    """

    corner: Array
    cell: Array
    count: int
    starts: Indices
    triangles: Indices

    @classmethod
    def of(cls, shadow: Array, numbers: Indices, margin: float) -> ShadowGrid:
        """Sort triangles into the cells they come near.

        Args:
            shadow: (u, v) of the triangles' corners [m], (m, 3, 2).
            numbers: by which the triangles are known, (m,).
            margin: how near [m].
        """
        a, b, c = shadow[:, 0], shadow[:, 1], shadow[:, 2]
        low, high = np.minimum(np.minimum(a, b), c) - margin, np.maximum(np.maximum(a, b), c) + margin
        corner, extent = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
        count = int(np.clip(1.5 * np.sqrt(len(numbers)), _LEAST_CELLS_PER_SIDE, _MOST_CELLS_PER_SIDE))
        cell = extent / count
        first = np.clip(((low - corner) // cell).astype(np.int64), 0, count - 1)
        last = np.clip(((high - corner) // cell).astype(np.int64), 0, count - 1)
        width = last - first + 1
        owner, place = _expanded(width.prod(axis=1))
        columns = width[owner, 0]
        column, row = first[owner, 0] + place % columns, first[owner, 1] + place // columns
        owner, column, row = _overlapping(shadow, owner, column, row, corner, cell, margin)
        number = row * count + column
        order = np.argsort(number, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=count**2))])
        return cls(corner, cell, count, starts, numbers[owner[order]])

    def candidates(self, points: Array) -> tuple[Indices, Indices]:
        """Pairs of a point (n, 2) [m] and a triangle that may be over it, by number; points in order."""
        place = (points - self.corner) / self.cell
        over = np.flatnonzero(((place >= 0.0) & (place <= self.count)).all(axis=1))
        column, row = np.minimum(place[over].astype(np.int64), self.count - 1).T
        number = row * self.count + column
        owner, local = _expanded(self.starts[number + 1] - self.starts[number])
        return over[owner], self.triangles[self.starts[number][owner] + local]


def _overlapping(
    shadow: Array, owner: Indices, column: Indices, row: Indices, corner: Array, cell: Array, margin: float
) -> tuple[Indices, Indices, Indices]:
    """The pairs of triangle and cell in which no edge of the triangle keeps the whole cell off by the margin."""
    edges = np.roll(shadow, -1, axis=1) - shadow
    clockwise = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0] < 0.0
    across = np.stack([edges[..., 1], -edges[..., 0]], axis=-1)  # to the right of each edge
    across[clockwise] *= -1.0
    along_x, along_y = across[..., 0].T, across[..., 1].T  # (3, m)
    limit = np.abs(along_x) * (cell[0] / 2) + np.abs(along_y) * (cell[1] / 2) + margin * np.hypot(along_x, along_y)
    limit += along_x * shadow[..., 0].T + along_y * shadow[..., 1].T
    x, y = corner[0] + (column + 0.5) * cell[0], corner[1] + (row + 0.5) * cell[1]
    keep = np.ones(len(owner), bool)
    for k in range(3):
        keep &= along_x[k, owner] * x + along_y[k, owner] * y <= limit[k, owner]
    return owner[keep], column[keep], row[keep]


def _expanded(counts: Indices) -> tuple[Indices, Indices]:
    """For counts (2, 1, ...): owners (0, 0, 1, ...) and places within each owner (0, 1, 0, ...)."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
