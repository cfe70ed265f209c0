"""Integrals of 1/r over pairs of cells of a rectangular lattice, in closed form.

The cells are equal, so an integral depends on how many columns and rows lie between the two alone. Integrated twice
along each axis, 1/r has the antiderivative

    F(x, y) = 1/2 x y^2 asinh(x / |y|) + 1/2 x^2 y asinh(y / |x|) - r^3 / 6,

whose second differences over the cells' width and height are the integrals (Love, Phil. Trans. A 228, 1929, has the
case of one integration along each axis). Of cells cut at the sheet's edge, rectangles of the same area, middle and
proportions take their place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from mjtactile.half_space import HalfSpaceIntegrals, Indices
from mjtactile.pad import Array

#: Further away than this many times the longer side, second differences lose more digits than a Taylor series; and
#: for rectangles that differ, of which each pair takes sixteen terms, it does from here.
FAR, FAR_FROM_CUT = 16.0, 6.0


@dataclass(frozen=True, eq=False)
class LatticeIntegrals(HalfSpaceIntegrals):
    """Half-space integrals of a lattice's cells, of which those of 1/r are exact.

    Attributes:
        columns: cells along x.
        rows: cells along y; cells are numbered row by row.
        width: of a cell [m].
        height: of a cell [m].
    """

    columns: int
    rows: int
    width: float
    height: float

    @cached_property
    def inverse_distance(self) -> Array:
        """Integrals of 1/r [m^3]."""
        table = inverse_distance_by_offset(self.columns, self.rows, self.width, self.height)
        column, row = np.arange(self.columns), np.arange(self.rows)
        between_columns = np.abs(column[:, None] - column)
        between_rows = np.abs(row[:, None] - row)
        integrals = table[between_rows[:, None, :, None], between_columns[None, :, None, :]]
        count = self.columns * self.rows
        return np.ascontiguousarray(integrals).reshape(count, count)


@dataclass(frozen=True, eq=False)
class CutLatticeIntegrals(HalfSpaceIntegrals):
    """Half-space integrals of some cells of a lattice, of which some are cut.

    Attributes:
        angle: of the lattice's rows [rad].
        whole: length and width of its whole cells [m].
        place: column and row of each cell, (cells, 2).
        cut: whether it is cut, (cells,).
        centroids: of the cells, (cells, 2) [m].
        sides: of the rectangle that stands for each cell, (cells, 2) [m].
    """

    angle: float
    whole: tuple[float, float]
    place: Indices
    cut: npt.NDArray[np.bool_]
    centroids: Array
    sides: Array

    @cached_property
    def inverse_distance(self) -> Array:
        """Integrals of 1/r [m^3]."""
        between = np.abs(self.place[:, None] - self.place)
        columns, rows = between.max(axis=(0, 1)) + 1
        integrals = inverse_distance_by_offset(int(columns), int(rows), *self.whole)[between[..., 1], between[..., 0]]
        first, second = np.nonzero(np.triu(self.cut[:, None] | self.cut))
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        offset = (self.centroids[second] - self.centroids[first]) @ np.array([[cosine, -sine], [sine, cosine]])
        values = _inverse_distance(offset, self.sides[first], self.sides[second])
        integrals[first, second] = integrals[second, first] = values
        return integrals


def _inverse_distance(offset: Array, first: Array, second: Array) -> Array:
    """Integrals of 1/r over pairs of rectangles with parallel sides (pairs, 2), their middles `offset` apart [m^3]."""
    x, y = offset.T
    signs = ((0.5, 0.5), (-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5))
    shifts = [own * first + other * second for own, other in signs]
    near = np.zeros(len(x))
    for i, along in enumerate(shifts):
        for j, across in enumerate(shifts):
            sign = 1.0 if (i < 2) == (j < 2) else -1.0
            near += sign * _antiderivative(x + along[:, 0], y + across[:, 1])
    longest = np.maximum(first, second).max(axis=1)
    spread = (first**2 + second**2) / 2
    far, series = _far(x, y, longest, first.prod(axis=1) * second.prod(axis=1), spread.T, FAR_FROM_CUT)
    return np.where(far, series, near)


def _far(
    x: Array, y: Array, longest: npt.ArrayLike, areas: npt.ArrayLike, spread: npt.ArrayLike, limit: float
) -> tuple[npt.NDArray[np.bool_], Array]:
    """Which pairs are far apart, and their integrals by a Taylor series about the distance of their middles.

    Args:
        x: from middle to middle [m].
        y: likewise [m].
        longest: side of either [m].
        areas: product of the two [m^4].
        spread: mean squares of their sides along x and y [m^2].
        limit: of the distance over the longest side.
    """
    square = x**2 + y**2
    far = square > (limit * np.asarray(longest)) ** 2
    square = np.where(far, square, 1.0)
    along, across = np.asarray(spread, dtype=float)
    bend = (along * (3 * x**2 - square) + across * (3 * y**2 - square)) / (12 * square**2)
    return far, np.asarray(areas) / np.sqrt(square) * (1.0 + bend)


def inverse_distance_by_offset(columns: int, rows: int, width: float, height: float) -> Array:
    """Integrals of 1/r over two equal rectangles that lie 0, 1, ... columns and rows apart, (rows, columns) [m^3]."""
    x, y = np.meshgrid(width * np.arange(columns, dtype=np.float64), height * np.arange(rows, dtype=np.float64))
    near = np.zeros((rows, columns))
    for i, along in zip((-1, 0, 1), (1.0, -2.0, 1.0), strict=True):
        for j, across in zip((-1, 0, 1), (1.0, -2.0, 1.0), strict=True):
            near += along * across * _antiderivative(x + i * width, y + j * height)
    far, series = _far(x, y, max(width, height), (width * height) ** 2, (width**2, height**2), FAR)
    return np.where(far, series, near)


def _antiderivative(x: Array, y: Array) -> Array:
    return 0.5 * (_half(x, y) + _half(y, x)) - np.hypot(x, y) ** 3 / 6


def _half(a: Array, b: Array) -> Array:
    """Of the antiderivative: a b^2 asinh(a / |b|), and its limit 0 where b vanishes."""
    size = np.abs(b)
    return np.where(size > 0.0, a * b**2 * np.arcsinh(a / np.where(size > 0.0, size, 1.0)), 0.0)
