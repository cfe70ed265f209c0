"""Contact cells: polygons on the sensing surface, each under one constant traction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
import shapely
from scipy.spatial import KDTree
from shapely import MultiPolygon, Polygon

from mjtactile.half_space import HalfSpaceIntegrals, PlacedIntegrals, distinct_edges
from mjtactile.pad import Array
from mjtactile.planar import areal
from mjtactile.surface import SurfaceGrid, oriented_edges

Area = Polygon | MultiPolygon
Indices = npt.NDArray[np.int64]

#: Grid on which cells are joined into an outline, over the size of the largest.
_GRID = 1e-7
#: Moments of inertia off the axes, over those on them, that count as none.
_ROUND = 1e-9
#: Corners closer together than this fraction of the extent are one.
_SAME_CORNER = 1e-11
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
        known_integrals: over pairs of these cells, where there is a better way to them than the edges.
    """

    edges: Array
    owner: Indices
    parts: npt.NDArray[np.object_]
    part_owner: Indices
    shape: Cells | None = None
    placement: tuple[float, float] = (1.0, 0.0)
    known_integrals: HalfSpaceIntegrals | None = None

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
    def inertia(self) -> Array:
        """Second moments of area about each centroid, over the area, (cells, 2, 2) [m^2]."""
        own = self.edges - self.centroids[self.owner][:, None, :]
        (x0, y0), (x1, y1) = own.transpose(1, 2, 0)
        cross = x0 * y1 - x1 * y0
        terms = (
            (x0**2 + x0 * x1 + x1**2) * cross / 12,
            (2 * x0 * y0 + x0 * y1 + x1 * y0 + 2 * x1 * y1) * cross / 24,
            (y0**2 + y0 * y1 + y1**2) * cross / 12,
        )
        xx, xy, yy = (np.bincount(self.owner, term, self.count) / self.areas for term in terms)
        return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)

    @cached_property
    def quadrature(self) -> Array:
        """Four points per cell whose mean integrates quadratic functions over it, (cells, 4, 2) [m].

        They lie on the cell's principal axes of inertia, of cells that were placed on those they had before.
        """
        if self.shape is not None:
            turn = self._turn
            return self.shape.quadrature @ turn + (self.edges[0, 0] - self.shape.edges[0, 0] @ turn)
        # Squares have no principal axes but those that rounding makes.
        round_off = np.abs(self.inertia) < _ROUND * np.trace(self.inertia, axis1=1, axis2=2)[:, None, None]
        spread, axes = np.linalg.eigh(np.where(round_off, 0.0, self.inertia))
        arms = np.swapaxes(np.sqrt(2 * np.maximum(spread, 0.0))[:, None, :] * axes, 1, 2)
        return self.centroids[:, None, :] + np.concatenate([arms, -arms], axis=1)

    @property
    def _turn(self) -> Array:
        scale, angle = self.placement
        return scale * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

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
        return self._own_integrals if self.shape is None else self.shape._own_integrals.placed(*self.placement)

    @cached_property
    def _own_integrals(self) -> HalfSpaceIntegrals:
        return self.known_integrals or HalfSpaceIntegrals(self.edges - self._anchor, self.owner)

    @cached_property
    def steps(self) -> tuple[Indices, sparse.csr_array]:
        """Places of distinct edges, and cell tractions to their steps across these edges, (edges, cells)."""
        if self.shape is not None:
            return self.shape.steps
        first, place = distinct_edges(self.edges)
        representative = self.edges[first][place]
        along = np.einsum("ei,ei->e", self.edges[:, 1] - self.edges[:, 0], representative[:, 1] - representative[:, 0])
        steps = sparse.csr_array((np.sign(along), (place, self.owner)), shape=(len(first), self.count))
        return first, steps

    def nodal_forces(self, surface: SurfaceGrid, forces: Array) -> Array:
        """Nodal forces (nodes y, nodes x, components) [N] of forces on cells (cells, components) [N]."""
        first, to_steps = self.steps
        steps = to_steps @ (forces / self.areas[:, None])
        stepped = steps.any(axis=1)
        return surface.traction_forces(self.edges[first[stepped]], steps[stepped])

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
        turn = self._turn
        shift = self.edges[0, 0] - origin.edges[0, 0] @ turn
        placed = shapely.transform(parts, lambda points: points @ turn + shift)
        # Neighbours share whole edges up to rounding.
        return areal(shapely.union_all(placed, grid_size=_GRID * np.sqrt(self.areas.max())))


def cells_of(parts: npt.NDArray[np.object_], part_owner: Indices) -> Cells:
    """Cells that consist of polygons, numbered from 0 without a hole."""
    rings = [oriented_edges(part) for part in parts]
    edges, owner = np.concatenate(rings), np.repeat(part_owner, [len(one) for one in rings])
    edges = _joined(edges)
    kept = (edges[:, 0] != edges[:, 1]).any(axis=1)
    return Cells(edges[kept], owner[kept], parts, part_owner)


def _joined(edges: Array) -> Array:
    """Edges whose corners, where cuts left them apart by rounding, are the same to the last digit.

    Neighbours' edges are merged where forces are spread over nodes: what they differ by would be a gap there.
    """
    corners = edges.reshape(-1, 2)
    pairs = KDTree(corners).query_pairs(_SAME_CORNER * np.ptp(corners, axis=0).max(), output_type="ndarray")
    first = np.arange(len(corners))
    np.minimum.at(first, pairs[:, 1], pairs[:, 0])
    return corners[first].reshape(edges.shape)
