"""Where a body presses, and how hard: contact cells chosen for a footprint, and a law solved on them.

A flat face is covered by cells once. A curved body touches a small part of what it covers, and how small depends on
the force: a coarse lattice finds that part and closes in on it until cells of the wanted number lie where it presses.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
import shapely.ops
from shapely import MultiPolygon, Polygon

from mjtactile.cells import Cells, lattice_cells, outline_cells, stretched_cells
from mjtactile.errors import ContactError
from mjtactile.footprint import Footprint
from mjtactile.pad import Array
from mjtactile.planar import areal, polygons_of
from mjtactile.rigid import Mask, RigidContact

#: Cells of the lattices that look for the contact.
_SEARCH_CELLS = 100
_SEARCHES = 30
#: A search ends when the contact's surroundings fill this part of the lattice.
_FILLED = 0.7
#: Contacts longer than this many times their width get a lattice turned along them.
_ELONGATED = 1.5
#: Longest cells of such lattices: 2 to this power times as long as wide.
_LONGEST = 5
#: Cells chosen for one contact serve another whose area differs by no more than this share.
_SAME_CELLS = 0.25
#: Cells that a search presses at least, and the give of one cell over that of a point force at its size's distance.
_SPREAD_CELLS = 10
_CELL_GIVE = 3.5
#: Nearest the force's line may pass to the hull of the cells, over the root of their area.
_HULL_MARGIN = 1e-3


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
    def _hull(self) -> shapely.Geometry:
        """Convex hull of the cells' centroids [m]."""
        return shapely.MultiPoint(self.cells.centroids[self.reached]).convex_hull

    def carried(self, normal: float, through: Array) -> Array | None:
        """The same, if forces on the cells can pass through that point; else None."""
        if self.tilting and self._within_reach(through) is not through:
            return None
        return self.resultants(normal, through)

    def _within_reach(self, through: Array) -> Array:
        """The point, or the nearest to it that forces on the cells can pass through, a margin inside their hull."""
        hull, margin = self._hull, _HULL_MARGIN * self.length
        point = shapely.Point(through)
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


def press(
    footprint: Footprint,
    normal: float,
    through: Array,
    *,
    tilting: bool,
    count: int,
    solver: Solver,
    softness: float,
    known: Pressed | None = None,
) -> Pressed:
    """Press a body into the pad.

    Args:
        footprint: of the body.
        normal: force [N], positive.
        through: point (x, y) the force's line passes through [m]; what the cells cannot reach is moved nearer.
        tilting: whether the body may tilt; otherwise the force passes where it will.
        count: cells wanted.
        solver: contact law.
        softness: surface displacement a point force brings, times its distance, over the force [1/Pa].
        known: the same body pressed otherwise, whose cells serve again if they fit.

    Raises:
        ContactError: when no contact was found.
    """
    if known is not None:
        with contextlib.suppress(ContactError):  # cells chosen for another force may be far too coarse
            again = _solved(known.at, normal, through, solver, known.contact.pressed)
            if footprint.gap is None or again.fits:
                return again
    centre = np.array(footprint.centroid)
    if footprint.gap is None:
        cells = outline_cells(footprint.outline, count)
        at = CellContact(cells, np.zeros(cells.count), centre, tilting and cells.count >= 3)
        return _solved(at, normal, through, solver, None)
    shapely.prepare(footprint.outline)
    region, found = _Region.around(footprint.outline), None
    for _ in range(_SEARCHES):
        at = _on_lattice(footprint, region, centre, tilting)
        force = max(normal, at.spreading_force / softness)
        found = _solved(at, force, through, solver, None)
        closer = region.around_pressed(found)
        # A strip narrower than the cells would seem to fill them: look again with longer ones.
        filled = closer.area > _FILLED * region.area and closer.stretch <= region.stretch
        finished = filled and force == normal
        region = closer
        if finished:
            break
    assert found is not None
    at = _final_cells(footprint, region, count, centre, tilting)
    pressed = _solved(at, normal, through, solver, _overlapping(at, found))
    return Pressed(replace(at, chosen_for=pressed.area), pressed.contact)


def _solved(at: CellContact, normal: float, through: Array, solver: Solver, start: Mask | None) -> Pressed:
    likely = None if start is None else start[at.reached]
    return Pressed(at, solver(at, at.resultants(normal, through), likely).spread(at.reached))


def _overlapping(at: CellContact, found: Pressed) -> Mask | None:
    """Cells the body would overlap after the motion found on other cells; None if too few to start from."""
    depth = found.contact.motion[0] + (at.cells.centroids - found.at.centre) @ found.slopes - at.heights
    start = depth > 0.0
    return start if start.sum() >= 6 else None


@dataclass(frozen=True)
class _Region:
    """A rectangle in the plane, turned by an angle."""

    centre: tuple[float, float]
    angle: float
    width: float
    height: float

    @classmethod
    def around(cls, outline: Polygon | MultiPolygon) -> _Region:
        low_x, low_y, high_x, high_y = outline.bounds
        return cls(((low_x + high_x) / 2, (low_y + high_y) / 2), 0.0, high_x - low_x, high_y - low_y)

    @property
    def area(self) -> float:
        return self.width * self.height

    @property
    def stretch(self) -> float:
        """Length of cells over their width, a power of two: long contacts take long cells."""
        return float(2 ** np.clip(np.floor(np.log2(self.width / self.height)), 0, _LONGEST))

    def lattice(self, count: int) -> Cells:
        """About `count` equal cells that cover the rectangle."""
        stretched = self.height * self.stretch
        size = np.sqrt(self.width * stretched / count)
        columns, rows = (max(2, int(np.ceil(extent / size - 1e-9))) for extent in (self.width, stretched))
        size = max(self.width / columns, stretched / rows)
        return lattice_cells(self.centre, self.angle, size, columns, rows, self.stretch)

    def polygon(self) -> Polygon:
        x, y = np.array([-1, 1, 1, -1]) * self.width / 2, np.array([-1, -1, 1, 1]) * self.height / 2
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return Polygon(np.column_stack([cosine * x - sine * y, sine * x + cosine * y]) + np.array(self.centre))

    def around_pressed(self, found: Pressed) -> _Region:
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
        return _Region((float(centre[0]), float(centre[1])), angle, float(high[0] - low[0]), float(high[1] - low[1]))


def _axes(angle: float) -> Array:
    """Unit vectors along and across, as columns."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _on_lattice(footprint: Footprint, region: _Region, centre: Array, tilting: bool) -> CellContact:
    """A coarse lattice, on the cells whose middles the body covers."""
    lattice = region.lattice(_SEARCH_CELLS)
    heights = _mean_heights(footprint, lattice)
    heights[~shapely.intersects_xy(footprint.outline, lattice.centroids)] = np.inf
    here = region.polygon()
    for part in polygons_of(footprint.outline):
        point = shapely.get_coordinates(part.point_on_surface())
        # What is smaller than a cell may hold no cell's middle.
        if shapely.intersects_xy(here, point)[0] and not shapely.intersects_xy(part, lattice.centroids).any():
            nearest = int(((lattice.centroids - point) ** 2).sum(axis=1).argmin())
            heights[nearest] = min(heights[nearest], float(footprint.heights(point)[0]))
    return _reachable(lattice, heights, centre, tilting)


def _final_cells(footprint: Footprint, region: _Region, count: int, centre: Array, tilting: bool) -> CellContact:
    """Square cells where the contact ends by itself; cells fitted to the outline where that may end it."""
    cells = region.lattice(count)
    if not shapely.contains_xy(footprint.outline, *cells.edges[:, 0].T).all():
        within = areal(footprint.outline.intersection(region.polygon()))
        if within.area == 0.0:
            raise ContactError("the body touches in an area too narrow to find. Pass its outline=... to from_gap.")
        cells = stretched_cells(within, count, region.angle, region.stretch)
    return _reachable(cells, _mean_heights(footprint, cells), centre, tilting)


def _reachable(cells: Cells, heights: Array, centre: Array, tilting: bool) -> CellContact:
    count = np.isfinite(heights).sum()
    if count == 0:
        raise ContactError("the body is out of the pad's reach everywhere. Check its gap map.")
    return CellContact(cells, heights, centre, tilting and bool(count >= 3))


def _mean_heights(footprint: Footprint, cells: Cells) -> Array:
    """Height of the body averaged over each cell: exact for a quadratic surface; infinite out of reach."""
    points = np.concatenate([cells.centroids[:, None], cells.quadrature], axis=1)
    heights: npt.NDArray[np.float64] = footprint.heights(points)
    around = heights[:, 1:].mean(axis=1)
    return np.where(np.isfinite(around), around, heights[:, 0])
