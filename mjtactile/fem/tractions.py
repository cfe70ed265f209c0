"""Any traction on a pad's surface as consistent nodal forces, by cubature over an outline in the projection.

The outline is cut along the grid lines, so that shape functions are smooth on every piece. Whole cells are integrated
by a product Gauss rule, other pieces by such a rule collapsed onto each of their triangles (Stroud, Approximate
Calculation of Multiple Integrals, 1971, section 2.4). Areas are those of the surface, not of its projection.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile._types import Array, Indices
from mjtactile.errors import ContactError, shortened
from mjtactile.fem.line import Line, quadratic_shapes
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.geometry.planar import areal, polygons_of, triangulate
from mjtactile.units import real_numbers

#: Traction [Pa] at points of the surface (n, 3) [m] with unit normals (n, 3) out of the pad.
Traction = Callable[[Array, Array], npt.ArrayLike]

#: Gauss points along each side of a cell or triangle.
_ORDER = 6
#: Pieces smaller than this fraction of a cell are ignored as rounding of set operations.
_NEGLIGIBLE = 1e-12

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(_ORDER)


@dataclass(frozen=True, eq=False)
class IntegratedTraction:
    """Nodal forces, area and peak pressure of a traction."""

    forces: Array  #: on the grid's nodes in the pad frame [N], (nodes y, nodes x, 3)
    area: float  #: of the surface under the outline [m^2]
    peak: float  #: largest pressure at a point of the cubature [Pa]


def integrated_traction(grid: SurfaceGrid, outline: Polygon | MultiPolygon, traction: Traction) -> IntegratedTraction:
    """Consistent nodal forces of a traction on the surface under an outline.

    Args:
        grid: of the surface.
        outline: in the projection [m], on the sheet.
        traction: force per area of the surface in the pad frame [Pa], see `Traction`.

    Raises:
        ContactError: the traction does not return shape (n, 3), or is not finite.
    """
    points, weights, cells = _cubature(grid, outline)
    weights = weights * grid.outer.stretch(points[:, 0], points[:, 1])
    places = grid.outer.positions(points[:, 0], points[:, 1])
    normals = grid.outer.normals(points[:, 0], points[:, 1])
    values = _checked(traction, places, normals)
    row, column = np.divmod(cells, grid.x.element_count)
    along = []
    for line, element, axis in ((grid.x, column, 0), (grid.y, row, 1)):
        local = 2 * (points[:, axis] - line.vertices[element]) / line.sizes[element] - 1
        along.append(quadratic_shapes(local)[0])
    shapes = along[1][:, :, None] * along[0][:, None, :] * weights[:, None, None]
    rows, columns = grid.node_shape
    node = (2 * row[:, None] + np.arange(3))[:, :, None] * columns + (2 * column[:, None] + np.arange(3))[:, None, :]
    spread = (shapes.ravel(), (node.ravel(), np.repeat(np.arange(len(points)), 9)))
    forces = sparse.csr_array(spread, shape=(rows * columns, len(points))) @ values
    pressure = -np.einsum("pi,pi->p", values, normals)
    return IntegratedTraction(
        np.asarray(forces).reshape(rows, columns, 3), float(weights.sum()), max(0.0, float(pressure.max(initial=0.0)))
    )


def cell_integrals(grid: SurfaceGrid) -> Array:
    """Integrals of every cell's shape functions over its surface [m^2], (cells y, cells x, 3 along y, 3 along x)."""
    (y, along_y), (x, along_x) = _gauss_on(grid.y), _gauss_on(grid.x)
    stretch = grid.outer.stretch(*np.meshgrid(x.ravel(), y.ravel())).reshape(*y.shape, *x.shape)
    return np.einsum("jqa,ipb,jqip->jiab", along_y, along_x, stretch)


def _gauss_on(line: Line) -> tuple[Array, Array]:
    """Gauss points of every element (elements, points) [m], and weights times shapes (elements, points, 3) [m]."""
    points = line.middles[:, None] + line.sizes[:, None] / 2 * _GAUSS
    return points, line.sizes[:, None, None] / 2 * (_WEIGHTS[:, None] * quadratic_shapes(_GAUSS)[0])


def _checked(traction: Traction, places: Array, normals: Array) -> Array:
    given = traction(places.copy(), normals.copy())
    values = real_numbers(given)
    if values is None:
        raise ContactError(f"the traction gave {shortened(given)}; expected real numbers in pascals, shape (n, 3).")
    values = values.astype(float)
    if values.shape != places.shape:
        raise ContactError(
            f"the traction gave values of shape {values.shape} for points of shape {places.shape}. It must take points "
            "(n, 3) and normals (n, 3) and return one traction (x, y, z) per point, shape (n, 3)."
        )
    wrong = ~np.isfinite(values).all(axis=1)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        x, y, z = places[first].tolist()
        raise ContactError(
            f"the traction is {values[first].tolist()} at x = {x:.6g} m, y = {y:.6g} m, z = {z:.6g} m; expected finite "
            "numbers in pascals."
        )
    return values


def _cubature(grid: SurfaceGrid, outline: Polygon | MultiPolygon) -> tuple[Array, Array, Indices]:
    """Points (n, 2) [m], weights (n,) [m^2] and cell indices (n,), in (y, x) order, of a cubature of an outline."""
    x, y = grid.x.vertices, grid.y.vertices
    south, west = np.meshgrid(y[:-1], x[:-1], indexing="ij")
    north, east = np.meshgrid(y[1:], x[1:], indexing="ij")
    boxes = shapely.box(west.ravel(), south.ravel(), east.ravel(), north.ravel())
    shapely.prepare(outline)
    touched = np.flatnonzero(shapely.intersects(outline, boxes))
    whole = shapely.covers(outline, boxes[touched])
    points, weights, cells = [], [], []
    for cell, is_whole in zip(touched.tolist(), whole.tolist(), strict=True):
        row, column = divmod(cell, grid.x.element_count)
        if is_whole:
            rules = [_rectangle(x[column], y[row], x[column + 1], y[row + 1])]
        else:
            piece = areal(shapely.intersection(outline, boxes[cell]))
            if piece.area <= _NEGLIGIBLE * boxes[cell].area:
                continue
            rules = [rule for polygon in polygons_of(piece) for rule in _triangles(polygon)]
        for of_points, of_weights in rules:
            points.append(of_points)
            weights.append(of_weights)
            cells.append(np.full(len(of_weights), cell))
    if not points:
        return np.empty((0, 2)), np.empty(0), np.empty(0, dtype=np.int64)
    return np.concatenate(points), np.concatenate(weights), np.concatenate(cells)


def _rectangle(west: float, south: float, east: float, north: float) -> tuple[Array, Array]:
    x, y = np.meshgrid((west + east + (east - west) * _GAUSS) / 2, (south + north + (north - south) * _GAUSS) / 2)
    weights = np.outer(_WEIGHTS, _WEIGHTS) * (east - west) * (north - south) / 4
    return np.column_stack([x.ravel(), y.ravel()]), weights.ravel()


def _triangles(polygon: Polygon) -> list[tuple[Array, Array]]:
    """Points and weights for each triangle of a polygon: product Gauss rules with one side collapsed to a corner."""
    corners, triangles = triangulate(polygon)
    s, t = np.meshgrid((1 + _GAUSS) / 2, (1 + _GAUSS) / 2)
    share = np.stack([1 - s, s * (1 - t), s * t], axis=-1).reshape(-1, 3)
    weights = (np.outer(_WEIGHTS, _WEIGHTS) / 4 * s).ravel()
    rules = []
    for a, b, c in corners[triangles]:
        doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        rules.append((share @ np.stack([a, b, c]), weights * abs(doubled)))
    return rules
