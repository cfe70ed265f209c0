"""The region of the plane where a function lies below a level, as polygons.

A grid finds the region. Bisection along the grid lines then locates its boundary to a millionth of a grid cell, so that
steps of the function, such as the edge of a punch, are placed exactly.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile._types import Array, Mask
from mjtactile.geometry.planar import areal

#: Height [m] as a function of arrays x and y [m] of one shape; infinite where it is undefined.
PlaneFunction = Callable[[Array, Array], npt.ArrayLike]

#: Grid lines along the region's longer side.
_LINES = 120
#: Bisections of a grid step that the boundary crosses; each halves the error.
_BISECTIONS = 22
#: A region smaller than this many grid cells is traced again on a finer grid of its own.
_FEW_CELLS = 40


def region_below(
    function: PlaneFunction, level: float, bounds: tuple[float, float, float, float]
) -> Polygon | MultiPolygon:
    """The region of a rectangle where a function is at most `level` [m]; an empty polygon if no grid point is in it.

    Parts narrower than a grid cell of the rectangle may be missed.

    Args:
        function: height [m] of x and y [m], arrays of one shape; infinite where it is undefined.
        level: largest height that belongs to the region [m].
        bounds: rectangle to search (low x, low y, high x, high y) [m].
    """
    x, y = _grid_lines(bounds)
    inside = _inside(function, level, *np.meshgrid(x, y))
    if not inside.any():
        return Polygon()
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    closer = (
        float(x[max(columns[0] - 1, 0)]),
        float(y[max(rows[0] - 1, 0)]),
        float(x[min(columns[-1] + 1, len(x) - 1)]),
        float(y[min(rows[-1] + 1, len(y) - 1)]),
    )
    # Search again only on a clearly finer grid, so that the recursion ends.
    if max(np.ptp(rows), np.ptp(columns)) < _FEW_CELLS and max(
        closer[2] - closer[0], closer[3] - closer[1]
    ) < 0.6 * max(bounds[2] - bounds[0], bounds[3] - bounds[1]):
        return region_below(function, level, closer)
    return _traced(function, level, x, y, inside)


def _grid_lines(bounds: tuple[float, float, float, float]) -> tuple[Array, Array]:
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    step = max(width, height) / _LINES
    # An odd number of lines has one through the middle, where bodies often touch.
    counts = (2 * max(2, round(extent / step / 2)) + 1 for extent in (width, height))
    lines = (np.linspace(bounds[axis], bounds[axis + 2], count) for axis, count in enumerate(counts))
    return next(lines), next(lines)


def _inside(function: PlaneFunction, level: float, x: Array, y: Array) -> Mask:
    values = np.asarray(function(x.ravel(), y.ravel()), dtype=float).reshape(x.shape)
    return values <= level


def _traced(function: PlaneFunction, level: float, x: Array, y: Array, inside: Mask) -> Polygon | MultiPolygon:
    """Boundary polygons of the marked grid points, moved to where the function crosses the level [m]."""
    from contourpy import FillType, contour_generator

    # A frame of outside points closes regions that reach the bounds; the frame lies on the bounds themselves.
    framed = np.pad(inside, 1).astype(float)
    columns, rows = np.arange(-1, len(x) + 1), np.arange(-1, len(y) + 1)
    generator = contour_generator(columns, rows, framed, fill_type=FillType.OuterOffset)
    # Outer rings with their holes behind them: corners, and where each ring ends.
    filled: Any = generator.filled(0.5, 2.0)
    points, offsets = filled
    places = [np.asarray(one) for one in points]
    if not places:
        return Polygon()
    corners = _crossings(function, level, x, y, np.concatenate(places), inside)
    polygons, start = [], 0
    for one, ends in zip(places, offsets, strict=True):
        rings = [corners[start + low : start + high] for low, high in itertools.pairwise(ends)]
        polygons.append(shapely.make_valid(Polygon(rings[0], rings[1:])))
        start += len(one)
    return areal(shapely.union_all([areal(polygon) for polygon in polygons]))


def _crossings(function: PlaneFunction, level: float, x: Array, y: Array, places: Array, inside: Mask) -> Array:
    """Points on grid lines where the function crosses the level [m], for places half-way between two grid points."""
    low, high = np.floor(places).astype(int), np.ceil(places).astype(int)

    def on_grid(place: npt.NDArray[np.int_]) -> Array:
        # Points of the frame are moved onto the bounds.
        return np.column_stack([x[np.clip(place[:, 0], 0, len(x) - 1)], y[np.clip(place[:, 1], 0, len(y) - 1)]])

    framed = np.pad(inside, 1)
    low_is_inside = framed[low[:, 1] + 1, low[:, 0] + 1]
    within = np.where(low_is_inside[:, None], on_grid(low), on_grid(high))
    without = np.where(low_is_inside[:, None], on_grid(high), on_grid(low))
    for _ in range(_BISECTIONS):
        middle = (within + without) / 2
        is_inside = _inside(function, level, middle[:, 0], middle[:, 1])[:, None]
        within, without = np.where(is_inside, middle, within), np.where(is_inside, without, middle)
    return within
