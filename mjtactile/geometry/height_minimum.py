"""The least height of a surface over a rectangle: exact for polygons, by successive grids for curved convex shapes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mjtactile._types import Array, Mask

#: Height [m] as a function of x and y [m], arrays of shape (n,); infinite where there is no shape.
HeightFunction = Callable[[Array, Array], Array]

#: Points along each axis of the first grid, and of each finer grid.
_COARSE, _CLOSE = 33, 9
#: Largest number of finer grids; each reduces the window to a quarter, unless the minimum lies on the window's rim.
_LOOKS = 40
#: Window size at which the search stops [m].
_FINE = 1e-10


class Rectangle(NamedTuple):
    """An upright rectangle in the pad frame [m]."""

    west: float
    south: float
    east: float
    north: float

    def shrunk(self, margin: float) -> Rectangle:
        """The rectangle with each side moved inwards by a margin [m]."""
        return Rectangle(self.west + margin, self.south + margin, self.east - margin, self.north - margin)

    @property
    def corners(self) -> Array:
        """Corners (x, y), counter-clockwise from the south-west [m], shape (4, 2)."""
        return np.array(
            [[self.west, self.south], [self.east, self.south], [self.east, self.north], [self.west, self.north]]
        )

    def holds(self, x: Array, y: Array) -> Mask:
        """Whether points (x, y) [m] lie in the rectangle or on its sides, shape (n,)."""
        return (x >= self.west) & (x <= self.east) & (y >= self.south) & (y <= self.north)

    def crossings(self, tails: Array, heads: Array) -> Array:
        """Points where edges from `tails` to `heads` (n, 3) cross the rectangle's sides, seen along z [m], (m, 3)."""
        found = [np.empty((0, 3))]
        sides = ((0, self.west), (0, self.east), (1, self.south), (1, self.north))
        for axis, side in sides:
            before, after = tails[:, axis] - side, heads[:, axis] - side
            crossing = before * after < 0.0
            part = before[crossing] / (before[crossing] - after[crossing])
            points = tails[crossing] + part[:, None] * (heads[crossing] - tails[crossing])
            points[:, axis] = side
            found.append(points[self.holds(points[:, 0], points[:, 1])])
        return np.concatenate(found)

    def lowest_of_polygon(self, corners: Array, floor: float) -> float:
        """The least height of a plane convex polygon over the rectangle [m]; infinite if it is not over the rectangle.

        The minimum is at a corner of the polygon, at a crossing of an edge and a side, or at a corner of the rectangle.

        Args:
            corners: of the polygon in order, shape (n, 3) [m].
            floor: points below this height are ignored [m].
        """
        following = np.roll(corners, -1, axis=0)
        points = [corners[self.holds(corners[:, 0], corners[:, 1])], self.crossings(corners, following)]
        middle = corners.mean(axis=0)
        for x, y in self.corners:
            turn = (following[:, 0] - corners[:, 0]) * (y - corners[:, 1])
            turn -= (following[:, 1] - corners[:, 1]) * (x - corners[:, 0])
            if (turn > 0.0).all() or (turn < 0.0).all():
                normal = np.cross(corners[1] - corners[0], corners[-1] - corners[0])
                height = middle[2] - (normal[0] * (x - middle[0]) + normal[1] * (y - middle[1])) / normal[2]
                points.append(np.array([[x, y, height]]))
        heights = np.concatenate(points)[:, 2]
        return float(heights[heights >= floor].min(initial=np.inf))


def lowest_near(heights: HeightFunction, sheet: Rectangle, floor: float, bottom: Array, axis: Array) -> float:
    """The least height of a convex shape over a rectangle [m]; infinite if it is not over the rectangle.

    Args:
        heights: function of x and y that gives the height of the lower surface [m], infinite where there is none.
        sheet: the rectangle.
        floor: points below this height are ignored [m].
        bottom: lowest points of the whole shape, shape (k, 3) [m]; if one is over the rectangle, it is the minimum.
        axis: two points on the shape's longest axis, shape (2, 3) [m]; the search starts there too, so that thin shapes
            are not missed.
    """
    over = bottom[sheet.holds(bottom[:, 0], bottom[:, 1]) & (bottom[:, 2] >= floor)]
    if len(over):
        return float(over[:, 2].min())
    part = np.linspace(0.0, 1.0, 4 * _COARSE)[:, None]
    along = axis[0] + part * (axis[1] - axis[0])
    along = along[sheet.holds(along[:, 0], along[:, 1])]
    x, y = _grid(sheet, _COARSE)
    x, y = np.concatenate([x, along[:, 0]]), np.concatenate([y, along[:, 1]])
    best_x, best_y, best = _best(heights, x, y)
    reach = np.array([sheet.east - sheet.west, sheet.north - sheet.south]) / (_COARSE - 1)
    for _ in range(_LOOKS if np.isfinite(best) else 0):
        window = Rectangle(
            max(best_x - reach[0], sheet.west),
            max(best_y - reach[1], sheet.south),
            min(best_x + reach[0], sheet.east),
            min(best_y + reach[1], sheet.north),
        )
        here = best_x, best_y
        best_x, best_y, best = min((best_x, best_y, best), _best(heights, *_grid(window, _CLOSE)), key=lambda b: b[2])
        # A narrow valley may continue beyond the window: move the window along it before shrinking it.
        if (np.abs(np.subtract((best_x, best_y), here)) < 0.9 * reach).all():
            reach = reach / 4
        if reach.max() < _FINE:
            break
    return best


def _grid(window: Rectangle, count: int) -> tuple[Array, Array]:
    x, y = np.meshgrid(np.linspace(window.west, window.east, count), np.linspace(window.south, window.north, count))
    return x.ravel(), y.ravel()


def _best(heights: HeightFunction, x: Array, y: Array) -> tuple[float, float, float]:
    found = heights(x, y)
    best = int(np.argmin(found))
    return float(x[best]), float(y[best]), float(found[best])
