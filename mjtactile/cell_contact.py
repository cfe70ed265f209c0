"""A body over contact cells, before and after it is pressed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
import shapely.ops
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from mjtactile.cells import Cells
from mjtactile.pad import Array
from mjtactile.rigid import Mask, RigidContact

#: Cells chosen for one contact serve another whose area differs by no more than this share.
_SAME_CELLS = 0.25
#: Cells that a search presses at least, and the give of one cell over that of a point force at its size's distance.
_SPREAD_CELLS = 10
_CELL_GIVE = 3.5
#: Nearest the force's line may pass to the hull of the cells, over the root of their area.
_HULL_MARGIN = 1e-3
_ANGLES = 2 * np.pi * np.arange(12) / 12
_DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True, eq=False)
class CellContact:
    """Cells, and the gaps and rigid motions at them.

    Attributes:
        cells: polygons on the surface.
        heights: of the body above each cell at first touch [m], shape (cells,); infinite where it cannot touch.
        reference: the approach is counted at this point (x, y) [m].
        tilting: whether the body may tilt.
        chosen_for: area in contact for which these cells were chosen on a curved body [m^2].
    """

    cells: Cells
    heights: Array
    reference: Array
    tilting: bool
    chosen_for: float = 0.0

    @cached_property
    def reached(self) -> Mask:
        """Cells that the body may press on."""
        return np.isfinite(self.heights)

    @property
    def gaps(self) -> Array:
        """Height of the body above the cells it may press on [m], shape (reached cells,)."""
        return self.heights[self.reached]

    @cached_property
    def centre(self) -> Array:
        """Middle of the cells (x, y) [m], about which rigid motions turn the body."""
        return self.cells.centroids[self.reached].mean(axis=0)

    @cached_property
    def length(self) -> float:
        """Length by which tilts are made comparable with the approach [m]."""
        return float(np.sqrt(self.cells.areas[self.reached].sum()))

    @cached_property
    def modes(self) -> Array:
        """Downward displacement per rigid motion: approach and, if tilting, slopes times `length`.

        Shape (reached cells, 1 or 3).
        """
        offset = (self.cells.centroids[self.reached] - self.centre) / self.length
        ones = np.ones((len(offset), 1))
        return np.hstack([ones, offset]) if self.tilting else ones

    @property
    def spreading_force(self) -> float:
        """Force that presses more than a few of these cells on a unit of `softness`, roughly [N Pa].

        A smaller one would rest on single cells, which tells little about where it presses: the search begins with
        this one, and what it presses contains what a smaller one does.
        """
        lowest = np.sort(self.gaps)[:_SPREAD_CELLS]
        return float((lowest[-1] - lowest[0]) * np.sqrt(self.cells.areas.min()) / _CELL_GIVE)

    def resultants(self, normal: float, through: Array) -> Array:
        """What the forces times each mode must add up to, for a force through a point (x, y) [m]."""
        if not self.tilting:
            return np.array([normal])
        return normal * np.array([1.0, *((self._within_reach(through) - self.centre) / self.length)])

    @cached_property
    def _hull(self) -> BaseGeometry:
        """Convex hull of the cells' centroids [m]."""
        return shapely.MultiPoint(self.cells.centroids[self.reached]).convex_hull

    def carried(self, normal: float, through: Array) -> Array | None:
        """The same, if forces on the cells can pass through that point; else None."""
        if self.tilting and self._within_reach(through) is not through:
            return None
        return self.resultants(normal, through)

    def _surely_within(self, through: Array, margin: float) -> bool:
        """Whether a point lies in the polygon of the outermost centroids in a few directions: cheaper than a hull."""
        outermost = (self.cells.centroids[self.reached] @ _DIRECTIONS).argmax(axis=0)
        corners = self.cells.centroids[self.reached][outermost]
        along = np.roll(corners, -1, axis=0) - corners
        offset = through - corners
        across = along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]
        length = np.hypot(along[:, 0], along[:, 1])
        return bool((across[length > 0.0] > margin * length[length > 0.0]).all() and (length > 0.0).sum() >= 3)

    def _within_reach(self, through: Array) -> Array:
        """The point (x, y) [m], or the nearest to it that forces can pass through, a margin inside the cells' hull."""
        margin = _HULL_MARGIN * self.length
        if self._surely_within(through, margin):
            return through
        hull, point = self._hull, shapely.Point(through)
        if isinstance(hull, Polygon) and hull.contains(point) and hull.exterior.distance(point) >= margin:
            return through
        inner = hull.buffer(-margin)
        if inner.is_empty:
            return self.cells.centroids[self.reached].mean(axis=0)
        return np.array(shapely.ops.nearest_points(inner, point)[0].coords[0])


#: Solves one contact on the cells reached: cells, resultants, cells likely in contact.
Solver = Callable[[CellContact, Array, Mask | None], RigidContact]


@dataclass(frozen=True, eq=False)
class Pressed:
    """A solved contact: forces on cells and the body's motion."""

    at: CellContact
    contact: RigidContact

    @property
    def area(self) -> float:
        """Area in contact [m^2]."""
        return float(self.at.cells.areas[self.contact.pressed].sum())

    @property
    def fits(self) -> bool:
        """Whether the contact is about as large as the one its cells were chosen for."""
        return abs(self.area - self.at.chosen_for) <= _SAME_CELLS * self.at.chosen_for

    @property
    def approach(self) -> float:
        """How far the body moved down at the reference [m]."""
        return float(self.contact.motion[0] + self.slopes @ (self.at.reference - self.at.centre))

    @property
    def slopes(self) -> Array:
        """Downward displacement of the body per length along x and y [-]."""
        return self.contact.motion[1:3] / self.at.length if self.at.tilting else np.zeros(2)
