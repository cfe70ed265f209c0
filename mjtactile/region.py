"""Rectangles that close in on where a body presses, and the lattices of cells that cover them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import MultiPolygon, Polygon

from mjtactile.cell_contact import Pressed
from mjtactile.pad import Array
from mjtactile.partition import Lattice

#: Contacts longer than this many times their width get a lattice turned along them.
_ELONGATED = 1.5
#: Lengths of cells are powers of two, and so may be the proportions of regions, but for rounding.
_ROUNDING = 1e-9
#: Longest cells of such lattices: 2 to this power times as long as wide.
_LONGEST = 5


@dataclass(frozen=True)
class Region:
    """A rectangle in the plane, turned by an angle."""

    centre: tuple[float, float]
    angle: float
    width: float
    height: float

    @classmethod
    def around(cls, outline: Polygon | MultiPolygon) -> Region:
        """The outline's bounds."""
        low_x, low_y, high_x, high_y = outline.bounds
        return cls(((low_x + high_x) / 2, (low_y + high_y) / 2), 0.0, high_x - low_x, high_y - low_y)

    @property
    def area(self) -> float:
        """[m^2]."""
        return self.width * self.height

    @property
    def stretch(self) -> float:
        """Length of cells over their width, a power of two: long contacts take long cells."""
        return float(2 ** np.clip(np.floor(np.log2(self.width / self.height) + _ROUNDING), 0, _LONGEST))

    def lattice(self, count: int) -> Lattice:
        """About `count` equal cells that cover the rectangle."""
        stretched = self.height * self.stretch
        size = np.sqrt(self.width * stretched / count)
        columns, rows = (max(2, int(np.ceil(extent / size - 1e-9))) for extent in (self.width, stretched))
        size = max(self.width / columns, stretched / rows)
        return Lattice(self.centre, self.angle, float(size), columns, rows, self.stretch)

    def polygon(self) -> Polygon:
        """The rectangle itself."""
        x, y = np.array([-1, 1, 1, -1]) * self.width / 2, np.array([-1, -1, 1, 1]) * self.height / 2
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return Polygon(np.column_stack([cosine * x - sine * y, sine * x + cosine * y]) + np.array(self.centre))

    def around_pressed(self, found: Pressed) -> Region:
        """The pressed cells of this region's lattice and one row of others about them, turned along their length."""
        pressed, cells = found.contact.pressed, found.at.cells
        centroids = cells.centroids[pressed]
        sides = np.array([1.0, 1.0 / self.stretch]) * np.sqrt(cells.areas[0] * self.stretch)
        axes = _axes(self.angle)
        offset = centroids - centroids.mean(axis=0)
        spread, principal = np.linalg.eigh(offset.T @ offset / len(offset) + axes @ np.diag(sides**2 / 12) @ axes.T)
        angle = self.angle
        if spread[1] > _ELONGATED**2 * spread[0]:
            angle = float(np.arctan2(principal[1, 1], principal[0, 1]))
        turned = _axes(angle)
        # Half extents of one cell, seen along the new axes, and as much again.
        margin = 1.5 * np.abs(turned.T @ axes) @ sides
        along = centroids @ turned
        low, high = along.min(axis=0) - margin, along.max(axis=0) + margin
        centre = turned @ ((low + high) / 2)
        return Region((float(centre[0]), float(centre[1])), angle, float(high[0] - low[0]), float(high[1] - low[1]))


def _axes(angle: float) -> Array:
    """Unit vectors along and across, as columns."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
