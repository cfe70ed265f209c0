"""Closed-form response of an elastic half space to tractions that are constant on polygons.

A half space answers a point force on its surface with displacements of the form 1/r, x^2/r^3, x y/r^3 and x/r^2
(Boussinesq, Cerruti; Johnson, Contact Mechanics, 1985, section 3.2). Averages over one polygon of the response to
another are area integrals of these kernels over both. Each kernel is a sum of second derivatives, 1/r of the distance
r itself, so the divergence theorem turns both area integrals into integrals over the polygons' edges,

    int_A int_B d_a d_b r dA dB = - oint_A oint_B n_a n'_b r ds ds',

with a smooth integrand. A Taylor series does for edges far apart; for near ones the inner integral is in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from mjtactile.pad import Array

Indices = npt.NDArray[np.int64]

#: Edges nearer than this, over the sum of their lengths, are integrated in closed form; just off the distances on which
#: edges of equal cells lie, so that rounding does not decide.
_NEAR = 1.5 * (1.0 + 1e-9)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
#: Edges count as one where middles and lengths agree to this fraction of the whole extent.
_SAME_EDGE = 1e-10
#: Lengths count as one where they agree to this fraction.
_SAME_LENGTH = 1e-9


@dataclass(frozen=True, eq=False)
class HalfSpaceIntegrals:
    """Integrals over pairs of cells, r and (x, y) from a point of the second cell to one of the first.

    Attributes:
        edges: of all cells, cell on the left, shape (edges, 2 ends, 2) [m].
        owner: the cell each edge belongs to, shape (edges,).
    """

    edges: Array
    owner: Indices

    @cached_property
    def hessian(self) -> tuple[Array, Array, Array]:
        """Integrals of the second derivatives of r, xx, xy and yy, each (cells, cells) [m^3]."""
        return _hessian_integrals(self.edges, self.owner)

    @property
    def xx(self) -> Array:
        """Integrals of y^2/r^3 [m^3]."""
        return self.hessian[0]

    @property
    def xy(self) -> Array:
        """Integrals of -x y/r^3 [m^3]."""
        return self.hessian[1]

    @property
    def yy(self) -> Array:
        """Integrals of x^2/r^3 [m^3]."""
        return self.hessian[2]

    @cached_property
    def inverse_distance(self) -> Array:
        """Integrals of 1/r [m^3]."""
        return self.xx + self.yy

    @cached_property
    def coupling(self) -> tuple[Array, Array]:
        """Integrals of x/r^2 and y/r^2 [m^3]."""
        return _coupling_integrals(self.edges, self.owner)

    def placed(self, scale: float, angle: float) -> PlacedIntegrals:
        """The integrals of the same cells scaled and turned counter-clockwise by an angle [rad]."""
        return PlacedIntegrals(self, scale, angle)


@dataclass(frozen=True, eq=False)
class PlacedIntegrals:
    """Integrals of cells elsewhere, from those of the same cells; made as far as they are asked for."""

    shape: HalfSpaceIntegrals
    scale: float
    angle: float

    @cached_property
    def inverse_distance(self) -> Array:
        """Integrals of 1/r [m^3]."""
        return self.scale**3 * self.shape.inverse_distance

    @cached_property
    def xx(self) -> Array:
        """Integrals of y^2/r^3 [m^3]."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        xx, xy, yy = self.shape.hessian
        return self.scale**3 * (c**2 * xx - 2 * c * s * xy + s**2 * yy)

    @cached_property
    def xy(self) -> Array:
        """Integrals of -x y/r^3 [m^3]."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        xx, xy, yy = self.shape.hessian
        return self.scale**3 * (c * s * (xx - yy) + (c**2 - s**2) * xy)

    @cached_property
    def yy(self) -> Array:
        """Integrals of x^2/r^3 [m^3]."""
        return self.inverse_distance - self.xx

    @cached_property
    def coupling(self) -> tuple[Array, Array]:
        """Integrals of x/r^2 and y/r^2 [m^3]."""
        along, across = (self.scale**3 * one for one in self.shape.coupling)
        c, s = np.cos(self.angle), np.sin(self.angle)
        return c * along - s * across, s * along + c * across


def _hessian_integrals(edges: Array, owner: Indices) -> tuple[Array, Array, Array]:
    first, place = distinct_edges(edges)
    distinct = edges[first]
    distances = _edge_integrals_of_distance(distinct)
    normal_x, normal_y = _boundary_operators(edges, owner, place, len(distinct))
    along_x, along_y = normal_x @ distances, normal_y @ distances
    xx, xy, yy = -(normal_x @ along_x.T), -(normal_y @ along_x.T), -(normal_y @ along_y.T)
    return (xx + xx.T) / 2, (xy + xy.T) / 2, (yy + yy.T) / 2


def distinct_edges(edges: Array) -> tuple[Indices, Indices]:
    """Edges without duplicates, whichever way they run: their places, and for each edge its place among them."""
    resolution = _SAME_EDGE * np.ptp(edges.reshape(-1, 2), axis=0).max()
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    keys = np.column_stack([edges.mean(axis=1), length]) / resolution
    _, first, place = np.unique(np.round(keys).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    return first, place.ravel().astype(np.int64)


def _boundary_operators(edges: Array, owner: Indices, place: Indices, count: int) -> list[sparse.csr_array]:
    """Outward normals x and y as matrices (cells, distinct edges)."""
    along = edges[:, 1] - edges[:, 0]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    shape = (int(owner.max()) + 1, count)
    return [sparse.csr_array((normal, (owner, place)), shape=shape) for normal in (along[:, 1], -along[:, 0])]


def _edge_integrals_of_distance(edges: Array) -> Array:
    """Double integrals of the distance over all pairs of edges, shape (edges, edges) [m^3]."""
    start, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    length = np.linalg.norm(along, axis=1)
    unit, middle = along / length[:, None], edges.mean(axis=1)
    distance = _distances(middle)
    integrals = _expanded(unit, middle, length, distance)
    near = distance < _NEAR * (length[:, None] + length)
    # Gauss points on the shorter edge, the closed form along the longer one; edges of one length take turns.
    same = np.abs(length[:, None] - length) <= _SAME_LENGTH * (length[:, None] + length)
    shorter, longer = np.nonzero(near & (same | (length[:, None] < length)))
    values = np.zeros(len(shorter))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        points = middle[shorter] + node / 2 * along[shorter]
        values += weight / 2 * length[shorter] * _line_integral(points, start[longer], unit[longer], length[longer])
    integrals[shorter, longer] = values
    uneven = ~same[shorter, longer]
    integrals[longer[uneven], shorter[uneven]] = values[uneven]
    return np.where(same, (integrals + integrals.T) / 2, integrals)


def _expanded(unit: Array, middle: Array, length: Array, distance: Array) -> Array:
    """Integrals of the distance over pairs of far edges: its Taylor series to second order about the middles."""
    projection = unit @ middle.T
    own = np.diagonal(projection)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / distance
        sine_first = 1.0 - ((own[:, None] - projection) * inverse) ** 2
        bend = length[:, None] ** 2 * sine_first * inverse
        return (distance + (bend + bend.T) / 24) * (length[:, None] * length)


def _line_integral(points: Array, start: Array, unit: Array, length: Array) -> Array:
    """Integral of the distance from each point along a line: 1/2 [s r + d^2 asinh(s / d)] between its ends."""
    offset = start - points
    low = np.einsum("ei,ei->e", offset, unit)
    high = low + length
    square = np.maximum(np.einsum("ei,ei->e", offset, offset) - low**2, 0.0)
    # The larger end first: the logarithm of the other cancels only where its factor, the square, vanishes.
    low, high = np.where(low + high < 0.0, -high, low), np.where(low + high < 0.0, -low, high)
    to_low, to_high = np.sqrt(low**2 + square), np.sqrt(high**2 + square)
    bend = square * np.log((high + to_high) / np.maximum(low + to_low, 1e-12 * length))
    return 0.5 * (high * to_high - low * to_low + bend)


def _distances(points: Array) -> Array:
    """Between all pairs of points (n, 2), shape (n, n)."""
    x, y = points[:, 0], points[:, 1]
    square = (x[:, None] - x) ** 2
    square += (y[:, None] - y) ** 2
    return np.sqrt(square, out=square)


def _coupling_integrals(edges: Array, owner: Indices) -> tuple[Array, Array]:
    """Integrals of x/r^2 and y/r^2 over pairs of cells [m^3].

    x/r^2 is the Laplacian of x (2 ln r - 1) / 4, smooth enough for Gauss points throughout.
    """
    first_places, place = distinct_edges(edges)
    distinct = edges[first_places]
    along, middle = distinct[:, 1] - distinct[:, 0], distinct.mean(axis=1)
    length = np.linalg.norm(along, axis=1)
    potentials = np.zeros((2, len(distinct), len(distinct)))
    for first, first_weight in zip(_NODES, _WEIGHTS, strict=True):
        for second, second_weight in zip(_NODES, _WEIGHTS, strict=True):
            offset = (middle + first / 2 * along)[:, None, :] - (middle + second / 2 * along)[None, :, :]
            square = np.einsum("abi,abi->ab", offset, offset)
            logarithm = np.log(np.where(square > 0.0, square, 1.0)) - 1.0
            potentials += first_weight * second_weight / 16 * (offset.transpose(2, 0, 1) * logarithm)
    potentials *= length[:, None] * length
    operators = _boundary_operators(edges, owner, place, len(distinct))
    normal_x, normal_y = operators
    coupled = [-(normal_x @ (normal_x @ one).T + normal_y @ (normal_y @ one).T).T for one in potentials]
    along_x, along_y = ((one - one.T) / 2 for one in coupled)
    return along_x, along_y
