"""Integrals of a surface grid's shape functions over a polygon: cell by cell, and triangle by triangle."""

from __future__ import annotations

import numpy as np
from shapely import MultiPolygon, Polygon, box

from mjtactile._types import Array
from mjtactile.fem.line import quadratic_shapes
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.geometry.planar import areal, polygons_of, triangulate


def nodal_integrals(grid: SurfaceGrid, region: Polygon | MultiPolygon) -> Array:
    """What `SurfaceGrid.nodal_integrals` returns, (3, nodes y, nodes x) [m^2, m^3, m^3]."""
    rule, weights = _triangle_rule()
    total = np.zeros((3, *grid.node_shape))
    for column, (x0, x1) in enumerate(zip(grid.x.vertices, grid.x.vertices[1:], strict=False)):
        for row, (y0, y1) in enumerate(zip(grid.y.vertices, grid.y.vertices[1:], strict=False)):
            own = total[:, 2 * row : 2 * row + 3, 2 * column : 2 * column + 3]
            for part in polygons_of(areal(region.intersection(box(x0, y0, x1, y1)))):
                corners, triangles = triangulate(part)
                for a, b, c in corners[triangles]:
                    points = a + rule[:, :1] * (b - a) + rule[:, 1:] * (c - a)
                    area = abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
                    x, y = points.T
                    along_x = quadratic_shapes((2 * x - x0 - x1) / (x1 - x0))[0]
                    along_y = quadratic_shapes((2 * y - y0 - y1) / (y1 - y0))[0]
                    factors = area * weights * np.stack([np.ones_like(x), x, y])
                    own += np.einsum("kp,pj,pi->kji", factors, along_y, along_x)
    return total


def _triangle_rule() -> tuple[Array, Array]:
    """Points (n, 2) and weights on the triangle (0, 0), (1, 0), (0, 1): a square's Gauss rule, collapsed."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    nodes, weights = (nodes + 1) / 2, weights / 2
    u, v = np.meshgrid(nodes, nodes)
    return np.stack([u, v * (1 - u)], axis=-1).reshape(-1, 2), (np.outer(weights, weights) * (1 - u)).ravel()
