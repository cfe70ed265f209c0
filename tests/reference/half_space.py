"""Closed-form response of an elastic half space to tractions that are constant on polygons.

A half space answers a point force on its surface with displacements of the form 1/r, x^2/r^3, x y/r^3 and x/r^2
(Boussinesq, Cerruti; Johnson, Contact Mechanics, 1985, section 3.2). Averages over one polygon of the response to
another are area integrals of these kernels over both. Each kernel is a sum of second derivatives, 1/r of the distance
r itself, so the divergence theorem turns both area integrals into integrals over the polygons' edges,

    int_A int_B d_a d_b r dA dB = - oint_A oint_B n_a n'_b r ds ds',

with a smooth integrand. A Taylor series does for edges far apart; for near ones the inner integral is in closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array

Indices = npt.NDArray[np.integer]

#: Edges nearer than this, over the sum of their lengths, are integrated in closed form; just under the distances on
#: which edges of equal cells lie, so that rounding does not decide.
_NEAR = 1.4999
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
#: Lengths count as one where they agree to this fraction.
_SAME_LENGTH = 1e-9


@dataclass(frozen=True, eq=False)
class HalfSpaceIntegrals:
    """Integrals over pairs of cells, r and (x, y) from a point of the second cell to one of the first.

    Attributes:
        edges: between cells, each once, (edges, 2 ends, 2) [m].
        sides: cells to the left and right of each edge, (edges, 2); -1 for none.
    """

    edges: Array
    sides: Indices

    @cached_property
    def hessian(self) -> tuple[Array, Array, Array]:
        """Integrals of the second derivatives of r, xx, xy and yy, each (cells, cells) [m^3]."""
        distances = _edge_integrals_of_distance(self.edges)
        normal_x, normal_y = self._normals
        along_x, along_y = normal_x @ distances, normal_y @ distances
        xx, xy, yy = -(along_x @ normal_x.T), -(along_x @ normal_y.T), -(along_y @ normal_y.T)
        return (xx + xx.T) / 2, (xy + xy.T) / 2, (yy + yy.T) / 2

    @cached_property
    def _normals(self) -> tuple[Array, Array]:
        """Outward normals x and y of the cells on their edges, each (cells, edges)."""
        along = self.edges[:, 1] - self.edges[:, 0]
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        turns = np.zeros((int(self.sides.max()) + 2, len(self.edges)))
        every = np.arange(len(self.edges))
        np.add.at(turns, (self.sides[:, 0], every), 1.0)
        np.add.at(turns, (self.sides[:, 1], every), -1.0)
        return turns[:-1] * along[:, 1], turns[:-1] * -along[:, 0]  # the last row stands for no cell

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
        """Integrals of x/r^2 and y/r^2 [m^3].

        x/r^2 is the Laplacian of x (2 ln r - 1) / 4.
        """
        potentials = _edge_integrals_of_coupling(self.edges)
        normal_x, normal_y = self._normals
        along_x, along_y = (-(normal_x @ one @ normal_x.T + normal_y @ one @ normal_y.T) for one in potentials)
        return (along_x - along_x.T) / 2, (along_y - along_y.T) / 2


def half_space_compliance(factor: float, poisson: float, integrals: HalfSpaceIntegrals, areas: Array) -> Array:
    """Mean displacement per force on a half space, (3, cells, 3, cells) [m/N], z out of the pad.

    Args:
        factor: (1 - nu) / (2 pi G) [1/Pa].
        poisson: nu [-].
        integrals: of the cells.
        areas: of the cells, (cells,) [m^2].

    Source: surface response to a point force, Johnson 1985, eqs. 3.18 and 3.75 to 3.77.
    """
    share, slope = poisson / (1 - poisson), (1 - 2 * poisson) / (2 * (1 - poisson))
    along, across = integrals.coupling
    rows = (
        (integrals.inverse_distance + share * integrals.yy, -share * integrals.xy, slope * along),
        (-share * integrals.xy, integrals.inverse_distance + share * integrals.xx, slope * across),
        (-slope * along, -slope * across, integrals.inverse_distance),
    )
    compliance = np.stack([np.stack(row, axis=1) for row in rows])
    return compliance * factor / (areas[:, None, None] * areas)


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges, each of them (edges, ...), and which pairs of them are near."""

    middle: Array
    along: Array
    length: Array
    distance: Array
    same: npt.NDArray[np.bool_]
    shorter: Indices
    longer: Indices

    @classmethod
    def of(cls, edges: Array) -> _Edges:
        along, middle = edges[:, 1] - edges[:, 0], edges.mean(axis=1)
        length = np.linalg.norm(along, axis=1)
        distance, sums = _distances(middle), length[:, None] + length
        # Gauss points on the shorter edge, the closed form along the longer one; edges of one length take turns.
        same = np.abs(length[:, None] - length) <= _SAME_LENGTH * sums
        shorter, longer = np.nonzero((distance < _NEAR * sums) & (same | (length[:, None] < length)))
        return cls(middle, along, length, distance, same, shorter, longer)

    def near(self, line_integral: Callable[[_Lines], Array]) -> Array:
        """Double integrals of the near pairs, (..., pairs)."""
        long = self.longer
        unit = self.along[long] / self.length[long, None]
        start = self.middle[long] - self.along[long] / 2
        total = np.zeros(())
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            points = self.middle[self.shorter] + node / 2 * self.along[self.shorter]
            lines = _Lines.seen_from(points, start, unit, self.length[long])
            total = total + weight / 2 * self.length[self.shorter] * line_integral(lines)
        return total

    def with_near(self, far: Array, near: Array, sign: float) -> Array:
        """All pairs; `sign` is that of an integral whose edges change places."""
        integrals = far.copy()
        integrals[self.shorter, self.longer] = near
        uneven = ~self.same[self.shorter, self.longer]
        integrals[self.longer[uneven], self.shorter[uneven]] = sign * near[uneven]
        return np.where(self.same, (integrals + sign * integrals.T) / 2, integrals)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines as seen from points: places of both ends along them, and how far they pass on their left, (n,) [m]."""

    unit: Array
    low: Array
    high: Array
    beside: Array

    @classmethod
    def seen_from(cls, points: Array, start: Array, unit: Array, length: Array) -> _Lines:
        offset = start - points
        low = np.einsum("ei,ei->e", offset, unit)
        return cls(unit, low, low + length, offset[:, 1] * unit[:, 0] - offset[:, 0] * unit[:, 1])

    def distance(self) -> Array:
        """Integral of the distance: 1/2 [s r + d^2 asinh(s / d)] between the ends."""
        low, high, square = self.low, self.high, self.beside**2
        length = high - low
        # The larger end first: the logarithm of the other cancels only where its factor, the square, vanishes.
        low, high = np.where(low + high < 0.0, -high, low), np.where(low + high < 0.0, -low, high)
        to_low, to_high = np.sqrt(low**2 + square), np.sqrt(high**2 + square)
        bend = square * np.log((high + to_high) / np.maximum(low + to_low, 1e-12 * length))
        return 0.5 * (high * to_high - low * to_low + bend)

    def coupling(self) -> Array:
        """Integral of (x, y) (ln r^2 - 1) / 4, (x, y) from the line to the point, shape (2, n).

        Of s (ln r^2 - 1) along the line it is 1/2 r^2 ln r^2 - s^2, and of ln r^2 - 1 it is s ln r^2 - 3 s plus twice
        d times the angle under which the point sees the line.
        """
        low, high, beside = self.low, self.high, self.beside
        to_low, to_high = low**2 + beside**2, high**2 + beside**2
        log_low, log_high = (np.log(np.maximum(one, np.finfo(float).tiny)) for one in (to_low, to_high))
        angle = np.arctan2(np.abs(beside) * (high - low), beside**2 + low * high)
        along = (to_high * log_high - to_low * log_low) / 2 - (high**2 - low**2)
        across = beside * (high * log_high - low * log_low - 3 * (high - low) + 2 * np.abs(beside) * angle)
        x, y = self.unit.T
        return -np.stack([along * x - across * y, along * y + across * x]) / 4


def _edge_integrals_of_distance(edges: Array) -> Array:
    """Double integrals of the distance over all pairs of edges, shape (edges, edges) [m^3]."""
    pairs = _Edges.of(edges)
    return pairs.with_near(_expanded(pairs), pairs.near(_Lines.distance), 1.0)


def _edge_integrals_of_coupling(edges: Array) -> Array:
    """Double integrals of (x, y) (2 ln r - 1) / 4 over all pairs of edges, shape (2, edges, edges) [m^3]."""
    pairs = _Edges.of(edges)
    far = np.zeros((2, len(edges), len(edges)))
    for first, first_weight in zip(_NODES, _WEIGHTS, strict=True):
        for second, second_weight in zip(_NODES, _WEIGHTS, strict=True):
            ends = pairs.middle + first / 2 * pairs.along, pairs.middle + second / 2 * pairs.along
            offset = ends[0][:, None, :] - ends[1][None, :, :]
            square = np.einsum("abi,abi->ab", offset, offset)
            logarithm = np.log(np.where(square > 0.0, square, 1.0)) - 1.0
            far += first_weight * second_weight / 16 * (offset.transpose(2, 0, 1) * logarithm)
    far *= pairs.length[:, None] * pairs.length
    near = pairs.near(_Lines.coupling)
    return np.stack([pairs.with_near(*one, -1.0) for one in zip(far, near, strict=True)])


def _expanded(pairs: _Edges) -> Array:
    """Integrals of the distance over pairs of far edges: its Taylor series to second order about the middles."""
    length, unit = pairs.length, pairs.along / pairs.length[:, None]
    projection = unit @ pairs.middle.T
    own = np.diagonal(projection)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / pairs.distance
        sine_first = 1.0 - ((own[:, None] - projection) * inverse) ** 2
        bend = length[:, None] ** 2 * sine_first * inverse
        return (pairs.distance + (bend + bend.T) / 24) * (length[:, None] * length)


def _distances(points: Array) -> Array:
    """Between all pairs of points (n, 2), shape (n, n)."""
    x, y = points[:, 0], points[:, 1]
    square = (x[:, None] - x) ** 2
    square += (y[:, None] - y) ** 2
    return np.sqrt(square, out=square)
