"""Integrals of 1/r over pairs of cells of a rectangular lattice, in closed form.

The cells are equal, so an integral depends on how many columns and rows lie between the two alone. Integrated twice
along each axis, 1/r has the antiderivative

    F(x, y) = 1/2 x y^2 asinh(x / |y|) + 1/2 x^2 y asinh(y / |x|) - r^3 / 6,

whose second differences over the cells' width and height are the integrals (Love, Phil. Trans. A 228, 1929, has the
case of one integration along each axis).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjtactile.half_space import HalfSpaceIntegrals
from mjtactile.pad import Array

#: Further away than this many times the longer side, second differences lose more digits than a Taylor series.
FAR = 16.0


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


def inverse_distance_by_offset(columns: int, rows: int, width: float, height: float) -> Array:
    """Integrals of 1/r over two equal rectangles that lie 0, 1, ... columns and rows apart, (rows, columns) [m^3]."""
    x, y = np.meshgrid(np.arange(columns) * width, np.arange(rows) * height)
    near = np.zeros((rows, columns))
    for i, along in zip((-1, 0, 1), (1.0, -2.0, 1.0), strict=True):
        for j, across in zip((-1, 0, 1), (1.0, -2.0, 1.0), strict=True):
            near += along * across * _antiderivative(x + i * width, y + j * height)
    square = x**2 + y**2
    far = square > (FAR * max(width, height)) ** 2
    square = np.where(far, square, 1.0)
    bend = (width**2 * (3 * x**2 - square) + height**2 * (3 * y**2 - square)) / (12 * square**2)
    return np.where(far, (width * height) ** 2 / np.sqrt(square) * (1.0 + bend), near)


def _antiderivative(x: Array, y: Array) -> Array:
    return 0.5 * (_half(x, y) + _half(y, x)) - np.hypot(x, y) ** 3 / 6


def _half(a: Array, b: Array) -> Array:
    """a b^2 asinh(a / |b|), and its limit 0 where b vanishes."""
    size = np.abs(b)
    return np.where(size > 0.0, a * b**2 * np.arcsinh(a / np.where(size > 0.0, size, 1.0)), 0.0)
