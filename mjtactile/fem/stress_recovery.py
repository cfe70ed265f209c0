"""Point values of finite-element fields along a line, recovered from where the elements are most accurate.

The slope of a quadratic element is accurate to one more order at its two Gauss points than elsewhere
(superconvergence: Barlow, Optimal stress locations in finite element models, 1976). Slopes, and the element's
linear pressure, are therefore taken at the Gauss points and interpolated between them by cubics, across elements
but never across a jump in material. On coarse meshes this removes most of the error of a stress read at an
arbitrary point.
"""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.fem.line import Line, quadratic_shapes

#: The two Gauss points of an element, in its coordinate from -1 to 1.
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
#: Number of Gauss points from which a value is interpolated, by a cubic.
_WINDOW = 4


def point_rows(line: Line, positions: Array, jumps: tuple[int, ...] = ()) -> tuple[Array, Array]:
    """Rows that turn nodal values along a line into point values [-] and recovered slopes [1/m], (points, nodes) each.

    Args:
        line: elements.
        positions: where the values are wanted [m], shape (points,).
        jumps: interior vertices, by index, across which nothing is interpolated.
    """
    element, local = line.locate(positions)
    values = _scatter(line, element, quadratic_shapes(local)[0])
    interpolation = gauss_weights(line, positions, jumps)

    owner = np.repeat(np.arange(line.element_count), 2)
    gauss = np.tile(GAUSS, line.element_count)
    slopes = _scatter(line, owner, quadratic_shapes(gauss)[1] * (2 / line.sizes[owner])[:, None])
    return values, interpolation @ slopes


def _scatter(line: Line, element: np.ndarray, local_rows: Array) -> Array:
    """Rows over an element's three nodes, shape (points, 3), as rows over all nodes."""
    rows = np.zeros((len(element), line.node_count))
    np.put_along_axis(rows, 2 * element[:, None] + np.arange(3), local_rows, axis=1)
    return rows


def gauss_weights(line: Line, positions: Array, jumps: tuple[int, ...] = ()) -> Array:
    """Lagrange weights of all Gauss points for each position [-], shape (positions, 2 * elements).

    Args:
        line: elements.
        positions: where values are interpolated [m], shape (positions,).
        jumps: interior vertices, by index, across which nothing is interpolated.
    """
    element = line.locate(positions)[0]
    gauss = (line.middles[:, None] + line.sizes[:, None] / 2 * GAUSS).ravel()
    ends = np.array([0, *jumps, line.element_count])
    part = np.searchsorted(ends, element, side="right") - 1
    weights = np.zeros((len(positions), len(gauss)))
    for point, (position, first, last) in enumerate(zip(positions, 2 * ends[part], 2 * ends[part + 1], strict=True)):
        count = min(_WINDOW, last - first)
        start = int(np.clip(np.searchsorted(gauss, position) - count // 2, first, last - count))
        nodes = gauss[start : start + count]
        differences = nodes[:, None] - nodes + np.eye(count)
        factors = np.where(np.eye(count, dtype=bool), 1.0, (position - nodes) / differences)
        weights[point, start : start + count] = factors.prod(axis=1)
    return weights
