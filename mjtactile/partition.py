"""The covered area cut into contact cells.

The pressure under a rigid edge grows without bound, but only within a fraction of a millimetre. Narrow rings along
the outline take that up; inside it, square cells of one size suffice. Every cell ends exactly at the outline.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from mjtactile.cells import Area, Cells, Indices, cells_of
from mjtactile.lattice import CutLatticeIntegrals, LatticeIntegrals
from mjtactile.pad import Array
from mjtactile.planar import areal

#: From this many cells on there are two rings along the outline instead of one.
_TWO_RINGS_FROM = 400
#: Widths of the rings, from the outline inward, over the size of the square cells.
_RING_WIDTHS = {1: (0.1,), 2: (0.05, 0.2)}
#: Pieces smaller than this fraction of a whole cell of their ring join a neighbour.
_SLIVER = 0.35
#: Pieces smaller than this fraction of a square are rounding.
_NO_AREA = 1e-14
#: Outlines that agree to this fraction of their size after a rotation and a shift share one set of cells. What lies
#: over the sheet's edge for it carries nothing, so it also bounds what a resultant may be off.
_SAME_SHAPE = 2e-12
#: Sets of cells kept with their half-space integrals, which take longer to make than everything else.
_KEPT_SHAPES = 24
#: Cells of a lattice of which a sheet leaves less than this share are dropped.
_LEAST_SHARE = 1e-2
#: Outlines of more corners lose those that move them by less than this fraction of a cell.
_MOST_CORNERS, _UNSEEN = 400, 1e-3


def outline_cells(outline: Area, count: int) -> Cells:
    """About `count` cells that fill an outline.

    Outlines that differ by a shift and a rotation only, as those of one moving punch do, share their cells and
    half-space integrals: the cells follow the outline's own corners, not the axes.
    """
    corners = shapely.get_coordinates(outline)
    origin = corners[0]
    direction = corners[len(corners) // 2] - origin  # far away, so that rounding turns it little
    angle = float(np.arctan2(direction[1], direction[0]))
    cosine, sine = np.cos(angle), np.sin(angle)
    # On a grid, and without negative zeros: rounding while a punch moves must not make another shape of it.
    resolution = 2.0 ** np.floor(np.log2(_SAME_SHAPE * outline.length))
    turn = np.array([[cosine, -sine], [sine, cosine]]) / resolution
    local = shapely.transform(outline, lambda points: np.round((points - origin) @ turn) + 0.0)
    return _shape_cells(shapely.to_wkb(local), count).placed(resolution, angle, origin)


def stretched_cells(outline: Area, count: int, angle: float, stretch: float) -> Cells:
    """About `count` cells that fill an outline, longer along the direction at an angle [rad] by a factor."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    size = np.sqrt(outline.area)
    there = turn @ np.diag([1.0, stretch]) / size
    origin = shapely.get_coordinates(outline)[0]
    local = shapely.transform(outline, lambda points: (points - origin) @ there)
    cut = _partition(areal(shapely.make_valid(local)), count)
    back = np.linalg.inv(there)
    parts = shapely.transform(cut.parts, lambda points: points @ back + origin)
    return cells_of(parts, cut.part_owner)


@dataclass(frozen=True)
class Lattice:
    """Rectangular cells in rows and columns about a centre [m], turned by an angle [rad].

    They are `size` [m] long, along the rows, and `size / stretch` wide.
    """

    centre: tuple[float, float]
    angle: float
    size: float
    columns: int
    rows: int
    stretch: float = 1.0

    @functools.cached_property
    def cells(self) -> Cells:
        """All of them, row by row."""
        return _unit_lattice(self.columns, self.rows, self.stretch).placed(self.size, self.angle, self.centre)

    def corners(self) -> Array:
        """Of the cells, shape (rows + 1, columns + 1, 2) [m]."""
        along = (np.arange(self.columns + 1) - self.columns / 2) * self.size
        across = (np.arange(self.rows + 1) - self.rows / 2) * self.size / self.stretch
        x, y = np.meshgrid(along, across)
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1) + self.centre

    def cell_at(self, points: Array) -> Indices:
        """Numbers of the cells that points (n, 2) lie in, which they must [m]."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        x, y = ((points - self.centre) @ np.array([[cosine, -sine], [sine, cosine]])).T
        column = np.floor(x / self.size + self.columns / 2).astype(np.int64)
        row = np.floor(y * self.stretch / self.size + self.rows / 2).astype(np.int64)
        return row * self.columns + column

    def boxes(self) -> npt.NDArray[np.object_]:
        """The cells as polygons [m], shape (cells,)."""
        corners = self.corners()
        around = [corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]]
        return np.asarray(shapely.polygons(np.stack(around, axis=2).reshape(-1, 4, 2)))


def cells_on_sheet(lattice: Lattice, chosen: npt.NDArray[np.bool_], sheet: Polygon) -> Cells:
    """The chosen cells of a lattice, (cells,), as far as they lie on a sheet; next to nothing of a cell is dropped."""
    boxes = lattice.boxes()
    whole = np.asarray(shapely.covers(sheet, boxes))
    if whole.all() and chosen.all():
        return lattice.cells
    parts = np.where(whole, boxes, shapely.intersection(boxes, sheet))
    kept = np.flatnonzero(chosen & (shapely.area(parts) > _LEAST_SHARE * lattice.size**2 / lattice.stretch))
    cells = cells_of(parts[kept], np.arange(len(kept)))
    axes = np.array([[np.cos(lattice.angle), np.sin(lattice.angle)], [-np.sin(lattice.angle), np.cos(lattice.angle)]])
    along, across = np.einsum("ij,cjk,ik->ic", axes, cells.inertia, axes)
    length = np.sqrt(cells.areas * np.sqrt(along / across))
    integrals = CutLatticeIntegrals(
        cells.edges,
        cells.owner,
        lattice.angle,
        (lattice.size, lattice.size / lattice.stretch),
        np.column_stack([kept % lattice.columns, kept // lattice.columns]),
        ~whole[kept],
        cells.centroids,
        np.column_stack([length, cells.areas / length]),
    )
    return replace(cells, known_integrals=integrals)


@functools.lru_cache(maxsize=_KEPT_SHAPES)
def _shape_cells(outline: bytes, count: int) -> Cells:
    area = areal(shapely.make_valid(shapely.from_wkb(outline)))
    if shapely.get_num_coordinates(area) > _MOST_CORNERS:  # the work grows with their square
        area = areal(shapely.make_valid(area.simplify(_UNSEEN * np.sqrt(area.area / count))))
    return _partition(area, count)


@functools.lru_cache(maxsize=_KEPT_SHAPES)
def _unit_lattice(columns: int, rows: int, stretch: float) -> Cells:
    x, y = np.meshgrid(np.arange(columns) - columns / 2, (np.arange(rows) - rows / 2) / stretch)
    boxes = shapely.box(x.ravel(), y.ravel(), x.ravel() + 1, y.ravel() + 1 / stretch)
    cells = cells_of(boxes, np.arange(len(boxes)))
    return replace(cells, known_integrals=LatticeIntegrals(cells.edges, cells.owner, columns, rows, 1.0, 1 / stretch))


def _partition(outline: Area, count: int) -> Cells:
    widths = _RING_WIDTHS[2 if count >= _TWO_RINGS_FROM else 1]
    # area / h^2 squares inside and about one piece per ring and length h along the outline
    along = len(widths) * outline.length
    size = (along + np.sqrt(along**2 + 4 * count * outline.area)) / (2 * count)
    pieces, wholes = [], []
    rest = outline
    for width in (*(fraction * size for fraction in widths), None):
        inner = Polygon() if width is None else _inset(rest, width)
        ring = areal(rest.difference(inner)) if width is not None else rest
        cut = _cut_into_squares(ring, outline.bounds, size)
        pieces.append(cut)
        wholes.append(np.full(len(cut), size * (size if width is None else width)))
        rest = inner
    group = np.repeat(np.arange(len(pieces)), [len(cut) for cut in pieces])
    cells = np.concatenate(pieces)
    label = _join_slivers(cells, group, _SLIVER * np.concatenate(wholes))
    return cells_of(cells, label)


def _inset(outline: Area, width: float) -> Area:
    """The outline moved inward, its curves drawn no finer than the ring needs."""
    inner = outline.buffer(-width, join_style="mitre", mitre_limit=5.0)
    return areal(inner.simplify(0.1 * width).intersection(outline))


def _cut_into_squares(region: Area, bounds: tuple[float, float, float, float], size: float) -> npt.NDArray[np.object_]:
    """Connected pieces of a region between the lines of a square lattice over the bounds."""
    low_x, low_y, high_x, high_y = bounds
    x = np.linspace(low_x, high_x, max(1, round((high_x - low_x) / size)) + 1)
    y = np.linspace(low_y, high_y, max(1, round((high_y - low_y) / size)) + 1)
    low_corners, high_corners = np.meshgrid(x[:-1], y[:-1]), np.meshgrid(x[1:], y[1:])
    left, bottom, right, top = (c.ravel() for c in (*low_corners, *high_corners))
    boxes = shapely.box(left, bottom, right, top)
    shapely.prepare(region)
    whole = shapely.covers(region, boxes)
    crossed = shapely.intersects(region, boxes) & ~whole
    cut = [shapely.clip_by_rect(region, *box.bounds) for box in boxes[crossed]]
    parts = shapely.get_parts(shapely.get_parts(np.array(cut, dtype=object)))
    parts = parts[(shapely.get_type_id(parts) == shapely.GeometryType.POLYGON)]
    parts = parts[shapely.area(parts) > _NO_AREA * size**2]
    return np.concatenate([boxes[whole], parts])


def _join_slivers(pieces: npt.NDArray[np.object_], group: Indices, least: Array) -> Indices:
    """Number of the cell each piece belongs to: pieces under their least area join their group's longest neighbour."""
    area = shapely.area(pieces)
    parent = np.arange(len(pieces))

    def root(k: int) -> int:
        while parent[k] != k:
            k = parent[k]
        return k

    slivers = [int(k) for k in np.argsort(area, kind="stable") if area[k] < least[k]]
    if slivers:
        query, found = shapely.STRtree(pieces).query(pieces[slivers], predicate="intersects")
        for place, sliver in enumerate(slivers):
            own = root(sliver)
            if area[own] >= least[sliver]:
                continue
            near = np.array([k for k in found[query == place] if group[k] == group[sliver] and root(int(k)) != own])
            shared = shapely.length(shapely.intersection(pieces[near], pieces[sliver])) if len(near) else np.zeros(0)
            if len(near) and shared.max() > 0.0:
                other = root(int(near[shared.argmax()]))
                parent[own] = other
                area[other] += area[own]
    return np.unique([root(k) for k in range(len(pieces))], return_inverse=True)[1].astype(np.int64)
