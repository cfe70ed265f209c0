"""The sensing surface as a grid of quadratic elements, and exact integrals over any polygon on it.

A traction enters the finite elements as consistent nodal forces, the integrals of the traction times the surface's
shape functions. Both are polynomials on each grid cell, so the integrals over a polygon that cuts the cells anywhere
are exact: Green's theorem turns them into sums over the polygon's edges, split at the grid lines.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sparse
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile._native import contiguous, library, pointer, sized
from mjtactile._types import Array
from mjtactile.fem.line import Line
from mjtactile.geometry.planar import Bounds, polygons_of, rings_of
from mjtactile.pad_shape.surfaces import FLAT, Surface

#: Highest power of a local coordinate: a quadratic shape function times a linear traction.
_DEGREE = 3
#: The integrand along an edge has degree 2 * _DEGREE + 1.
_GAUSS = np.polynomial.legendre.leggauss(_DEGREE + 1)
#: Monomial coefficients (shape function, power) of the three quadratic shape functions on [-1, 1].
_SHAPE_COEFFICIENTS = np.array([[0.0, -0.5, 0.5], [1.0, 0.0, -1.0], [0.0, 0.5, 0.5]])


@dataclass(frozen=True, eq=False)
class SurfaceGrid:
    """Grid of quadratic elements on the sheet's surface, in the pad frame; on the projection of a curved surface."""

    x: Line  #: elements along x over the whole sheet [m]
    y: Line  #: elements along y over the whole sheet [m]
    thickness: float  #: of the sheet [m]
    outer: Surface = FLAT  #: the outer surface; nodal integrals are those over its projection

    @cached_property
    def node_shape(self) -> tuple[int, int]:
        """Nodes (along y, along x)."""
        return self.y.node_count, self.x.node_count

    @cached_property
    def node_heights(self) -> Array:
        """Heights z of the nodes [m], shape (nodes y, nodes x)."""
        return self.outer.height(*np.meshgrid(self.x.nodes, self.y.nodes))

    @cached_property
    def sheet(self) -> Polygon:
        """The surface as a rectangle [m]."""
        return shapely.box(*self.bounds)

    @cached_property
    def bounds(self) -> Bounds:
        """Limits of the surface: west, south, east and north [m]."""
        x, y = self.x.vertices, self.y.vertices
        return float(x[0]), float(y[0]), float(x[-1]), float(y[-1])

    @property
    def summary(self) -> str:
        """Size, kind and nodes, for messages."""
        west, south, east, north = self.bounds
        sides = " x ".join(f"{side * 1e3:.6g}" for side in (east - west, north - south, self.thickness))
        return f"a surface of {sides} mm ({self.outer.kind}, {self.x.node_count} x {self.y.node_count} nodes)"

    def matches(self, other: SurfaceGrid) -> bool:
        """Whether loads and footprints on another grid are also those on this one: grid, thickness and shape agree."""
        return self is other or (
            np.array_equal(self.x.vertices, other.x.vertices)
            and np.array_equal(self.y.vertices, other.y.vertices)
            and self.thickness == other.thickness
            and self.outer == other.outer
        )

    def nodal_integrals(self, region: Polygon | MultiPolygon) -> Array:
        """Integrals of phi, x phi and y phi over a region, for the shape function phi of every node.

        Args:
            region: polygon or multipolygon in the pad frame [m], holes allowed; parts off the sheet are ignored.

        Returns:
            shape (3, nodes along y, nodes along x) [m^2, m^3, m^3]. The first array holds the consistent nodal
            forces of a unit traction; all three sums over nodes are the region's area and first moments.
        """
        edges = oriented_edges(region)
        moments = self._cell_moments(edges)
        half_x, half_y = self.x.sizes / 2, self.y.sizes / 2
        plain = moments[..., :3, :3]
        times_x = self.x.middles[:, None, None] * plain + half_x[:, None, None] * moments[..., :3, 1:]
        times_y = self.y.middles[:, None, None, None] * plain + half_y[:, None, None, None] * moments[..., 1:, :3]
        per_cell = np.einsum(
            "kb,mjiba,la->mjikl", _SHAPE_COEFFICIENTS, np.stack([plain, times_x, times_y]), _SHAPE_COEFFICIENTS
        )
        return self._gather(per_cell)

    def traction_forces(self, edges: Array, tractions: Array) -> Array:
        """Consistent nodal forces (nodes y, nodes x, 3) [N] of tractions that are constant on polygons.

        Args:
            edges: of all polygons, each with its polygon on the left, pad frame [m], shape (edges, 2 ends, 2).
            tractions: for each edge, the traction on its polygon, pad frame [Pa], shape (edges, 3).
        """
        forces = np.empty((*self.node_shape, 3))
        edges, tractions = contiguous(edges), contiguous(tractions)
        x, y = contiguous(self.x.vertices), contiguous(self.y.vertices)
        library().mjt_traction_forces(
            *sized(x), *sized(y), ctypes.c_size_t(len(edges)), pointer(edges), pointer(tractions), pointer(forces)
        )
        return forces

    def _gather(self, per_cell: Array) -> Array:
        """Sum (k, cells y, cells x, 3, 3) over the nodes that cells share, shape (k, nodes y, nodes x)."""
        nodal = np.zeros((len(per_cell), *self.node_shape))
        rows, columns = 2 * self.y.element_count - 1, 2 * self.x.element_count - 1
        for k in range(3):
            for m in range(3):
                nodal[:, k : k + rows : 2, m : m + columns : 2] += per_cell[..., k, m]
        return nodal

    def _cell_moments(self, edges: Array) -> Array:
        """Integrals of eta^b xi^a, a, b <= 3, over the part of each cell within edges, (cells y, cells x, b, a) [m^2].

        By Green's theorem the area integral equals the boundary integral of F dy, where F(x, y) is the integral of the
        integrand over the part of the cell left of x. An edge thus contributes to the cell it lies in and to all cells
        of its row further left. In the column of the first edge, F is measured from that edge: otherwise polygons much
        smaller than a cell would be small differences of large areas.
        """
        start, end = self._split(edges)
        middle = (start + end) / 2
        column, row = self.x.locate(middle[:, 0])[0], self.y.locate(middle[:, 1])[0]
        nodes, node_weights = _GAUSS
        along = (nodes + 1) / 2
        points = start[:, None, :] + along[:, None] * (end - start)[:, None, :]
        half_x = self.x.sizes[column, None] / 2
        xi = (points[..., 0] - self.x.vertices[column, None]) / half_x - 1
        eta = 2 * (points[..., 1] - self.y.vertices[row, None]) / self.y.sizes[row, None] - 1
        dy = (end - start)[:, 1, None] * node_weights / 2
        powers = np.arange(_DEGREE + 1)
        reference = self._references(edges)
        left_integral = half_x[..., None] * (
            _powers(np.clip(xi, -1, 1), _DEGREE + 1)[..., 1:] - reference[column][:, None, :]
        )
        left_integral /= powers + 1
        height_integral = _powers(eta, _DEGREE) * dy[..., None]

        cells = (self.y.element_count, self.x.element_count)
        # One sparse product adds each edge's share to its cell.
        place = (row * self.x.element_count + column, np.arange(len(row)))
        to_cells = sparse.csr_array((np.ones(len(row)), place), shape=(int(np.prod(cells)), len(row)))
        own = height_integral.transpose(0, 2, 1) @ left_integral
        moments = (to_cells @ own.reshape(len(row), (_DEGREE + 1) ** 2)).reshape(*cells, *own.shape[1:])
        heights = (to_cells @ height_integral.sum(axis=1)).reshape(*cells, _DEGREE + 1)
        from_the_right = np.cumsum(heights[:, ::-1], axis=1)[:, ::-1] - heights
        full_row = (1 - (-1.0) ** (powers + 1)) / (powers + 1)  # integrals of xi^a over [-1, 1]
        widths = full_row * self.x.sizes[:, None] / 2
        parts = (reference - (-1.0) ** (powers + 1)) / (powers + 1) * self.x.sizes[:, None] / 2
        filled = from_the_right[..., None] * widths[:, None, :]
        return moments + (filled + heights[..., None] * parts[:, None, :])

    def _references(self, edges: Array) -> Array:
        """Powers 1 to 4 of the xi from which F is measured in each column, (columns, 4)."""
        xi = np.full(self.x.element_count, -1.0)
        if len(edges):
            x = edges[0, 0, 0]
            column = self.x.locate(np.array([x]))[0][0]
            xi[column] = np.clip(2 * (x - self.x.vertices[column]) / self.x.sizes[column] - 1, -1, 1)
        return _powers(xi, _DEGREE + 1)[:, 1:]

    def _split(self, edges: Array) -> tuple[Array, Array]:
        """Cut edges (count, 2 ends, 2) at the grid lines; drop those parallel to x and those off the sheet along y.

        Returns: starts and ends of the pieces.
        """
        start, end = edges[:, 0], edges[:, 1]
        direction = end - start
        every = np.arange(len(edges))
        owners, parameters = [every, every], [np.zeros(len(edges)), np.ones(len(edges))]
        for axis, line in ((0, self.x), (1, self.y)):
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = (line.vertices - start[:, axis, None]) / direction[:, axis, None]
            crossed, at = np.nonzero((crossing > 0) & (crossing < 1))
            owners.append(crossed)
            parameters.append(crossing[crossed, at])
        owner, parameter = np.concatenate(owners), np.concatenate(parameters)
        order = np.lexsort((parameter, owner))
        owner, parameter = owner[order], parameter[order]
        piece = np.flatnonzero((owner[:-1] == owner[1:]) & (parameter[:-1] < parameter[1:]))
        first, second, owner = parameter[piece, None], parameter[piece + 1, None], owner[piece]
        begin = start[owner] + first * direction[owner]
        finish = np.where(second == 1.0, end[owner], start[owner] + second * direction[owner])
        height = (begin[:, 1] + finish[:, 1]) / 2
        kept = (height > self.y.vertices[0]) & (height < self.y.vertices[-1]) & (begin[:, 1] != finish[:, 1])
        return begin[kept], finish[kept]


def _powers(values: Array, degree: int) -> Array:
    """Powers 0 to `degree` of values, along a new last axis."""
    powers = np.ones((*values.shape, degree + 1))
    for k in range(degree):
        np.multiply(powers[..., k], values, out=powers[..., k + 1])
    return powers


def oriented_edges(region: Polygon | MultiPolygon) -> Array:
    """Edges of all rings of an area [m], with the area on their left, shape (edges, 2 ends, 2)."""
    rings = [ring for polygon in polygons_of(region) for ring in rings_of(polygon)]
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    return np.concatenate(edges) if edges else np.zeros((0, 2, 2))
