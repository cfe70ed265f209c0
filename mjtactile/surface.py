"""The sensing surface as a grid of quadratic elements, and exact integrals over any polygon on it.

A traction enters the finite elements as consistent nodal forces, the integrals of the traction times the surface's
shape functions. Both are polynomials on each grid cell, so the integrals over a polygon that cuts the cells anywhere
are exact: Green's theorem turns them into sums over the polygon's edges, split at the grid lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile.line import Line
from mjtactile.pad import Array
from mjtactile.planar import polygons_of, rings_of

#: Highest power of a local coordinate: a quadratic shape function times a linear traction.
_DEGREE = 3
#: Gauss points along an edge segment: its integrand has degree 2 * _DEGREE + 1.
_EDGE_NODES, _EDGE_WEIGHTS = np.polynomial.legendre.leggauss(_DEGREE + 1)
#: Monomial coefficients (shape function, power) of the three quadratic shape functions on [-1, 1].
_SHAPE_COEFFICIENTS = np.array([[0.0, -0.5, 0.5], [1.0, 0.0, -1.0], [0.0, 0.5, 0.5]])


@dataclass(frozen=True, eq=False)
class SurfaceGrid:
    """Quadratic elements on the sheet's surface, in the pad frame.

    Attributes:
        x: elements along x over the whole sheet [m].
        y: elements along y over the whole sheet [m].
    """

    x: Line
    y: Line

    @property
    def node_shape(self) -> tuple[int, int]:
        """Nodes (along y, along x)."""
        return self.y.node_count, self.x.node_count

    @property
    def sheet(self) -> Polygon:
        """The surface as a rectangle [m]."""
        return shapely.box(self.x.vertices[0], self.y.vertices[0], self.x.vertices[-1], self.y.vertices[-1])

    @cached_property
    def _full_row(self) -> Array:
        """Integrals of xi^a over [-1, 1], a = 0.._DEGREE."""
        powers = np.arange(_DEGREE + 1)
        return (1 - (-1.0) ** (powers + 1)) / (powers + 1)

    def nodal_integrals(self, region: Polygon | MultiPolygon) -> Array:
        """Integrals of phi, x phi and y phi over a region, for the shape function phi of every node.

        Args:
            region: polygon or multipolygon in the pad frame [m], holes allowed; parts off the sheet are ignored.

        Returns:
            shape (3, nodes along y, nodes along x) [m^2, m^3, m^3]. The first array holds the consistent nodal
            forces of a unit traction; all three sums over nodes are the region's area and first moments.
        """
        moments = self._cell_moments(oriented_edges(region))
        half_x, half_y = self.x.sizes / 2, self.y.sizes / 2
        middle_x = (self.x.vertices[:-1] + self.x.vertices[1:]) / 2
        middle_y = (self.y.vertices[:-1] + self.y.vertices[1:]) / 2
        plain = moments[..., :3, :3]
        times_x = middle_x[:, None, None] * plain + half_x[:, None, None] * moments[..., :3, 1:]
        times_y = middle_y[:, None, None, None] * plain + half_y[:, None, None, None] * moments[..., 1:, :3]
        per_cell = np.einsum(
            "kb,mjiba,la->mjikl", _SHAPE_COEFFICIENTS, np.stack([plain, times_x, times_y]), _SHAPE_COEFFICIENTS
        )
        nodal = np.zeros((3, *self.node_shape))
        rows, columns = 2 * self.y.element_count - 1, 2 * self.x.element_count - 1
        for k in range(3):
            for m in range(3):
                nodal[:, k : k + rows : 2, m : m + columns : 2] += per_cell[..., k, m]
        return nodal

    def _cell_moments(self, edges: Array) -> Array:
        """Integrals of eta^b xi^a over the region's part of each cell, shape (cells y, cells x, b, a) [m^2].

        Green's theorem along x: the area integral equals the boundary integral of F dy, where F(x, y) is the
        integral of the integrand over the part of the cell left of x. An edge thus feeds the cell it runs in, and
        fills all cells of its row further left.
        """
        start, end = self._split(edges)
        middle = (start + end) / 2
        column, row = self.x.locate(middle[:, 0])[0], self.y.locate(middle[:, 1])[0]
        along = (_EDGE_NODES + 1) / 2
        points = start[:, None, :] + along[:, None] * (end - start)[:, None, :]
        half_x = self.x.sizes[column, None] / 2
        xi = (points[..., 0] - self.x.vertices[column, None]) / half_x - 1
        eta = 2 * (points[..., 1] - self.y.vertices[row, None]) / self.y.sizes[row, None] - 1
        dy = (end - start)[:, 1, None] * _EDGE_WEIGHTS / 2
        powers = np.arange(_DEGREE + 1)
        left_integral = half_x[..., None] * (np.clip(xi, -1, 1)[..., None] ** (powers + 1) - (-1.0) ** (powers + 1))
        left_integral /= powers + 1
        height_integral = eta[..., None] ** powers * dy[..., None]

        cells = (self.y.element_count, self.x.element_count)
        moments = np.zeros((*cells, _DEGREE + 1, _DEGREE + 1))
        np.add.at(moments, (row, column), np.einsum("sqb,sqa->sba", height_integral, left_integral))
        passing = np.zeros((*cells, _DEGREE + 1))
        np.add.at(passing, (row, column), height_integral.sum(axis=1))
        from_the_right = np.cumsum(passing[:, ::-1], axis=1)[:, ::-1] - passing
        moments += from_the_right[..., None] * (self._full_row * self.x.sizes[:, None] / 2)[:, None, :]
        return moments

    def _split(self, edges: Array) -> tuple[Array, Array]:
        """Cut edges (count, 2 ends, 2) at the grid lines; drop level ones and those off the sheet along y."""
        start, end = edges[:, 0], edges[:, 1]
        direction = end - start
        cuts = [np.zeros((len(edges), 1)), np.ones((len(edges), 1))]
        for axis, line in ((0, self.x), (1, self.y)):
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = (line.vertices - start[:, axis, None]) / direction[:, axis, None]
            cuts.append(np.where((crossing > 0) & (crossing < 1), crossing, 0.0))
        parameters = np.sort(np.concatenate(cuts, axis=1), axis=1)
        owner, place = np.nonzero(np.diff(parameters, axis=1) > 0)
        first, second = parameters[owner, place, None], parameters[owner, place + 1, None]
        begin = start[owner] + first * direction[owner]
        finish = np.where(second == 1.0, end[owner], start[owner] + second * direction[owner])
        height = (begin[:, 1] + finish[:, 1]) / 2
        kept = (height > self.y.vertices[0]) & (height < self.y.vertices[-1]) & (begin[:, 1] != finish[:, 1])
        return begin[kept], finish[kept]


def oriented_edges(region: Polygon | MultiPolygon) -> Array:
    """Edges of all rings, shape (edges, 2 ends, 2), with the area on their left."""
    rings = [ring for polygon in polygons_of(region) for ring in rings_of(polygon)]
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    return np.concatenate(edges) if edges else np.zeros((0, 2, 2))
