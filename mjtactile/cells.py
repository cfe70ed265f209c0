"""Contact cells: the covered area cut into polygons, each under one constant traction.

The pressure under a rigid edge grows without bound, but only within a fraction of a millimetre. Narrow rings along
the outline take that up; inside it, square cells of one size suffice. Every cell ends exactly at the outline.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile.half_space import HalfSpaceIntegrals, PlacedIntegrals, distinct_edges, half_space_integrals
from mjtactile.pad import Array
from mjtactile.planar import areal
from mjtactile.surface import SurfaceGrid, oriented_edges

Area = Polygon | MultiPolygon
Indices = npt.NDArray[np.int64]

#: From this many cells on there are two rings along the outline instead of one.
_TWO_RINGS_FROM = 400
#: Widths of the rings, from the outline inward, over the size of the square cells.
_RING_WIDTHS = {1: (0.1,), 2: (0.05, 0.2)}
#: Pieces smaller than this fraction of a whole cell of their ring join a neighbour.
_SLIVER = 0.35
#: Outlines that agree to this fraction of their size after a rotation and a shift share one set of cells. What lies
#: over the sheet's edge for it carries nothing, so it also bounds what a resultant may be off.
_SAME_SHAPE = 1e-11
#: Sets of cells kept with their half-space integrals, which take longer to make than everything else.
_KEPT_SHAPES = 64
#: Grid on which cells are joined into an outline, over the size of the largest.
_GRID = 1e-7
#: Outlines of more corners lose those that move them by less than this fraction of a cell.
_MOST_CORNERS, _UNSEEN = 400, 1e-3
#: Edges shorter than this fraction of the extent are none.
_NO_EDGE = 1e-12
_NO_PARTS: npt.NDArray[np.object_] = np.array([], dtype=object)


@dataclass(frozen=True, eq=False)
class Cells:
    """Polygons that carry one constant traction each.

    Attributes:
        edges: of all cells, cell on the left, shape (edges, 2 ends, 2) [m].
        owner: the cell each edge belongs to, shape (edges,).
        parts: polygons the cells consist of; empty if `shape` has them.
        part_owner: the cell each part belongs to.
        shape: the same cells elsewhere, whose half-space integrals are shared; None: these ones.
        placement: (scale, angle [rad]) that turn `shape` into these cells, apart from a shift.
    """

    edges: Array
    owner: Indices
    parts: npt.NDArray[np.object_]
    part_owner: Indices
    shape: Cells | None = None
    placement: tuple[float, float] = (1.0, 0.0)

    @cached_property
    def count(self) -> int:
        """Number of cells."""
        return int(self.owner.max()) + 1 if len(self.owner) else 0

    @cached_property
    def _moments(self) -> Array:
        """Area and first moments about a corner of the first cell, shape (3, cells)."""
        (x0, y0), (x1, y1) = (self.edges - self._anchor).transpose(1, 2, 0)
        cross = x0 * y1 - x1 * y0
        terms = (cross / 2, (x0 + x1) * cross / 6, (y0 + y1) * cross / 6)
        return np.stack([np.bincount(self.owner, term, self.count) for term in terms]).astype(np.float64)

    @cached_property
    def quadrature(self) -> Array:
        """Four points per cell whose mean integrates quadratic functions over it, (cells, 4, 2) [m].

        They lie on the cell's principal axes of inertia.
        """
        own = self.edges - self.centroids[self.owner][:, None, :]
        (x0, y0), (x1, y1) = own.transpose(1, 2, 0)
        cross = x0 * y1 - x1 * y0
        terms = (
            (x0**2 + x0 * x1 + x1**2) * cross / 12,
            (2 * x0 * y0 + x0 * y1 + x1 * y0 + 2 * x1 * y1) * cross / 24,
            (y0**2 + y0 * y1 + y1**2) * cross / 12,
        )
        xx, xy, yy = (np.bincount(self.owner, term, self.count) / self.areas for term in terms)
        spread, axes = np.linalg.eigh(np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2))
        arms = np.swapaxes(np.sqrt(2 * np.maximum(spread, 0.0))[:, None, :] * axes, 1, 2)
        return self.centroids[:, None, :] + np.concatenate([arms, -arms], axis=1)

    @property
    def _anchor(self) -> Array:
        return self.edges[0, 0]

    @property
    def areas(self) -> Array:
        """[m^2], shape (cells,)."""
        return self._moments[0]

    @cached_property
    def centroids(self) -> Array:
        """Shape (cells, 2) [m]."""
        return (self._moments[1:] / self._moments[0]).T + self._anchor

    @cached_property
    def half_space(self) -> HalfSpaceIntegrals | PlacedIntegrals:
        """Integrals of the half-space kernels over every pair of these cells."""
        if self.shape is not None:
            return self.shape.half_space.placed(*self.placement)
        return half_space_integrals(self.edges - self._anchor, self.owner)

    @cached_property
    def _steps(self) -> tuple[Indices, sparse.csr_array]:
        """Places of distinct edges, and cell tractions to their steps across these edges, (edges, cells)."""
        if self.shape is not None:
            return self.shape._steps
        first, place = distinct_edges(self.edges)
        representative = self.edges[first][place]
        along = np.einsum("ei,ei->e", self.edges[:, 1] - self.edges[:, 0], representative[:, 1] - representative[:, 0])
        steps = sparse.csr_array((np.sign(along), (place, self.owner)), shape=(len(first), self.count))
        return first, steps

    def nodal_forces(self, surface: SurfaceGrid, forces: Array) -> Array:
        """Nodal forces (nodes y, nodes x, components) [N] of forces on cells (cells, components) [N]."""
        first, to_steps = self._steps
        loaded = forces.any(axis=0)
        steps = to_steps @ (forces[:, loaded] / self.areas[:, None])
        stepped = steps.any(axis=1)
        nodal = np.zeros((*surface.node_shape, forces.shape[1]))
        nodal[..., loaded] = surface.traction_forces(self.edges[first[stepped]], steps[stepped])
        return nodal

    def placed(self, scale: float, angle: float, origin: npt.ArrayLike) -> Cells:
        """These cells scaled, turned counter-clockwise [rad], then shifted so that (0, 0) lands on `origin` [m]."""
        cosine, sine = scale * np.cos(angle), scale * np.sin(angle)
        turned = self.edges @ np.array([[cosine, sine], [-sine, cosine]]) + np.asarray(origin)
        return Cells(turned, self.owner, _NO_PARTS, np.zeros(0, dtype=np.int64), self, (scale, angle))

    def outline(self, chosen: npt.NDArray[np.bool_]) -> Area:
        """Union of the chosen cells [m]."""
        origin = self if self.shape is None else self.shape
        parts = origin.parts[chosen[origin.part_owner]]
        if not len(parts):
            return Polygon()
        scale, angle = self.placement
        turn = scale * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        shift = self.edges[0, 0] - origin.edges[0, 0] @ turn
        placed = shapely.transform(parts, lambda points: points @ turn + shift)
        # Neighbours share whole edges up to rounding.
        return areal(shapely.union_all(placed, grid_size=_GRID * np.sqrt(self.areas.max())))


def outline_cells(outline: Area, count: int) -> Cells:
    """About `count` cells that fill an outline.

    Outlines that differ by a shift and a rotation only, as those of one moving punch do, share their cells and
    half-space integrals: the cells follow the outline's first edge, not the axes.
    """
    corners = shapely.get_coordinates(outline)
    origin = corners[0]
    direction = corners[1] - origin
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


def lattice_cells(
    centre: npt.ArrayLike, angle: float, size: float, columns: int, rows: int, stretch: float = 1.0
) -> Cells:
    """Rectangular cells in rows and columns about a centre [m], turned by an angle [rad].

    They are `size` [m] long, along the rows, and `size / stretch` wide.
    """
    return _unit_lattice(columns, rows, stretch).placed(size, angle, centre)


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
    return cells_of(boxes, np.arange(len(boxes)))


def cells_of(parts: npt.NDArray[np.object_], part_owner: Indices) -> Cells:
    """Cells that consist of polygons, numbered from 0 without a hole."""
    rings = [oriented_edges(part) for part in parts]
    edges, owner = np.concatenate(rings), np.repeat(part_owner, [len(one) for one in rings])
    # Cuts leave corners that coincide but for rounding; edges between them have no direction.
    length = np.abs(edges[:, 1] - edges[:, 0]).max(axis=1)
    kept = length > _NO_EDGE * np.ptp(edges, axis=(0, 1)).max()
    return Cells(edges[kept], owner[kept], parts, part_owner)


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
    parts = parts[(shapely.get_type_id(parts) == shapely.GeometryType.POLYGON) & (shapely.area(parts) > 0.0)]
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
