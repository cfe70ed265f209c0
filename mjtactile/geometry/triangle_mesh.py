"""Lower surface of a triangle mesh in any pose, exact at every point, including holes and notches.

A grid over the mesh's projection along the pad's normal finds the triangles that face down. The grid depends on that
direction in the mesh's own frame, so it stays valid while the mesh slides on the pad or turns about the pad's normal.
Its cells are slightly enlarged, so that it also stays valid under small changes of tilt.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.affinity import affine_transform

from mjtactile._types import Array, Indices, Mask
from mjtactile.geometry.height_minimum import Rectangle
from mjtactile.geometry.planar import areal
from mjtactile.geometry.primitives import Pose

#: Least and largest number of cells along each side of the grid.
_LEAST_CELLS_PER_SIDE, _MOST_CELLS_PER_SIDE = 16, 256


@dataclass(frozen=True, eq=False)
class ShadowGrid:
    """Triangles sorted into the cells of a grid, by their projection onto a plane with coordinates u and v.

    Attributes:
        corner: least u and v [m], (2,).
        cell: size of a cell along u and v [m], (2,).
        count: number of cells along u, and along v.
        starts: index in `triangles` at which each cell's triangles begin, (count^2 + 1,).
        triangles: triangle indices, cell after cell.
    """

    corner: Array
    cell: Array
    count: int
    starts: Indices
    triangles: Indices

    @classmethod
    def of(cls, shadow: Array, numbers: Indices, margin: float) -> ShadowGrid:
        """Sort each triangle into all cells within a margin of it.

        Args:
            shadow: projected corners (u, v) of the triangles [m], (m, 3, 2).
            numbers: indices of the triangles, (m,).
            margin: distance between triangle and cell [m].
        """
        a, b, c = shadow[:, 0], shadow[:, 1], shadow[:, 2]
        low, high = np.minimum(np.minimum(a, b), c) - margin, np.maximum(np.maximum(a, b), c) + margin
        corner, extent = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
        count = int(np.clip(1.5 * np.sqrt(len(numbers)), _LEAST_CELLS_PER_SIDE, _MOST_CELLS_PER_SIDE))
        cell = extent / count
        first = np.clip(((low - corner) // cell).astype(np.int64), 0, count - 1)
        last = np.clip(((high - corner) // cell).astype(np.int64), 0, count - 1)
        width = last - first + 1
        owner, place = _expanded(width.prod(axis=1))
        columns = width[owner, 0]
        column, row = first[owner, 0] + place % columns, first[owner, 1] + place // columns
        middles = corner + (np.column_stack([column, row]) + 0.5) * cell
        near = _overlapping(shadow, owner, middles, cell, margin)
        owner, number = owner[near], (row * count + column)[near]
        order = np.argsort(number, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=count**2))])
        return cls(corner, cell, count, starts, numbers[owner[order]])

    def candidates(self, points: Array) -> tuple[Indices, Indices]:
        """Pairs (point index, triangle index) where the triangle may be over the point, in the order of points.

        Args:
            points: coordinates (u, v) [m], shape (n, 2).
        """
        place = (points - self.corner) / self.cell
        over = np.flatnonzero(((place >= 0.0) & (place <= self.count)).all(axis=1))
        column, row = np.minimum(place[over].astype(np.int64), self.count - 1).T
        number = row * self.count + column
        owner, local = _expanded(self.starts[number + 1] - self.starts[number])
        return over[owner], self.triangles[self.starts[number][owner] + local]


def _overlapping(shadow: Array, owner: Indices, middles: Array, cell: Array, margin: float) -> Mask:
    """Whether a triangle may be within a margin of a cell, for pairs of them: no edge separates the two.

    Args:
        shadow: projected corners of the triangles [m], (triangles, 3, 2).
        owner: index of the triangle of each pair, (pairs,).
        middles: centre of the cell of each pair [m], (pairs, 2).
        cell: size of a cell [m], (2,).
        margin: [m].
    """
    edges = np.roll(shadow, -1, axis=1) - shadow
    clockwise = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0] < 0.0
    across = np.stack([edges[..., 1], -edges[..., 0]], axis=-1)  # to the right of each edge
    across[clockwise] *= -1.0
    along_x, along_y = across[..., 0].T, across[..., 1].T  # (3, m)
    limit = np.abs(along_x) * (cell[0] / 2) + np.abs(along_y) * (cell[1] / 2) + margin * np.hypot(along_x, along_y)
    limit += along_x * shadow[..., 0].T + along_y * shadow[..., 1].T
    x, y = middles.T
    keep = np.ones(len(owner), bool)
    for k in range(3):
        keep &= along_x[k, owner] * x + along_y[k, owner] * y <= limit[k, owner]
    return keep


def _expanded(counts: Indices) -> tuple[Indices, Indices]:
    """For counts (2, 1, ...): owners (0, 0, 1, ...) and indices within each owner (0, 1, 0, ...)."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


#: Change of tilt up to which a grid stays valid [rad].
TILT_MARGIN = 1e-3
#: Directions this close count as equal, because rotations are rounded [-].
_SAME_DIRECTION = 1e-12
#: Change of tilt up to which a cached outline is rotated with its body [rad]. The outline is treated as lying at one
#: height; differences of height in the face, at most tens of micrometres, cause an error of this fraction of them.
_SAME_OUTLINE = 1e-3
#: Points this far outside a triangle, relative to its size, still count as in it, so that no gaps open at shared edges.
_SEAM = 1e-9
#: Triangles whose normal has a smaller cosine with the pad's normal are vertical and ignored.
_STEEP = 1e-9
#: Triangles belong to one plane if normals, and offsets over the mesh's radius, agree to this [-].
_SAME_PLANE = 1e-5


class MeshView(NamedTuple):
    """The mesh in axes (u, v, height) about its middle, where height is along the direction of view."""

    axes: Array  #: u, v and the direction of view as rows, in the mesh's frame, shape (3, 3)
    corners: Array  #: (u, v, height) of the corners of each triangle [m], shape (m, 3, 3)
    shares: Array  #: barycentric coordinates of the second and third corner: rates along u, v and value at 0, (m, 6)
    faces_down: Mask  #: shape (m,)
    bottom: Array  #: (u, v, height) of the lowest corner [m], shape (3,)


class _Outline(NamedTuple):
    """Union of some triangles, in the axes of the view it was computed in."""

    axes: Array  #: shape (3, 3)
    triangles: Indices  #: indices of the triangles
    union: Polygon | MultiPolygon  #: in (u, v) [m]
    height: float  #: of the face, along the third axis [m]


class TriangleSurface:
    """A rigid triangle mesh with its lower surface.

    Args:
        vertices: in the mesh's own frame [m], shape (n, 3).
        triangles: vertex indices of each triangle, counter-clockwise from outside, shape (m, 3).
        closed: whether the mesh is watertight. In an open mesh both sides of each triangle are solid.
    """

    def __init__(self, vertices: Array, triangles: Indices, *, closed: bool) -> None:
        self.vertices, self.triangles, self.closed = vertices, triangles, closed
        self._middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self._corners = np.ascontiguousarray(vertices[triangles] - self._middle)
        edges = self._corners[:, 1:] - self._corners[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1])
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
        self._radius = float(np.linalg.norm(vertices - self._middle, axis=1).max())
        self._view: MeshView | None = None
        self._grid: tuple[Array, ShadowGrid] | None = None  # with the axes of the view it was made for
        self._outline: _Outline | None = None

    def view(self, pose: Pose) -> MeshView:
        """The mesh seen along the pad's normal; cached while that direction is the same in the mesh's frame."""
        direction = pose.rotation[2]
        if self._view is None or np.abs(self._view.axes[2] - direction).max() > _SAME_DIRECTION:
            grid = self._grid
            if grid is not None and np.linalg.norm(grid[0][2] - direction) <= TILT_MARGIN:
                self._view = self._seen_along(direction, grid[0][0])
            else:
                self._view = self._seen_along(direction, _least_aligned(direction))
                self._grid = self._view.axes, self._gridded(self._view)
        return self._view

    def in_pad(self, pose: Pose, points: Array) -> Array:
        """Transform points (u, v, height) of the view to the pad frame [m], shapes (..., 3)."""
        axes = self.view(pose).axes
        return (points @ axes) @ pose.rotation.T + self._centre(pose)

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        view, centre = self.view(pose), self._centre(pose)
        assert self._grid is not None  # view has made it
        across = (pose.rotation @ view.axes[:2].T)[:2]  # (x, y) of u and v: neither has a component along z
        shadow = np.column_stack([x - centre[0], y - centre[1]]) @ across
        point, triangle = self._grid[1].candidates(shadow)
        u, v = shadow[point].T
        rates = view.shares[triangle].T
        second = rates[0] * u + rates[1] * v + rates[2]
        third = rates[3] * u + rates[4] * v + rates[5]
        met = np.flatnonzero((second >= -_SEAM) & (third >= -_SEAM) & (second + third <= 1.0 + _SEAM))
        second, third = second[met], third[met]
        first_height, second_height, third_height = view.corners[triangle[met], :, 2].T
        height = centre[2] + first_height
        height += second * (second_height - first_height) + third * (third_height - first_height)
        found = np.full(len(shadow), np.inf)
        counted = height >= floor
        np.minimum.at(found, point[met[counted]], height[counted])
        return found

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; see `Shape.lowest`."""
        view = self.view(pose)
        bottom = self.in_pad(pose, view.bottom)
        if sheet.holds(*bottom[:2]) and bottom[2] >= floor:
            return float(bottom[2])
        corners = self.in_pad(pose, view.corners[view.faces_down])
        vertices = corners.reshape(-1, 3)
        known = sheet.holds(vertices[:, 0], vertices[:, 1]) & (vertices[:, 2] >= floor)
        crossings = sheet.crossings(vertices, np.roll(corners, -1, axis=1).reshape(-1, 3))
        at_corners = self.heights(pose, sheet.corners[:, 0], sheet.corners[:, 1], floor)
        found = np.concatenate([vertices[known, 2], crossings[crossings[:, 2] >= floor, 2], at_corners])
        return float(found.min(initial=np.inf))

    def flat_sides(self, most: int, least_share: float) -> Iterator[tuple[Array, Array]]:
        """Outward unit normal (3,) and a point (3,) [m] of each of the largest flat parts, in the mesh's frame.

        Args:
            most: number of normals examined, those of the largest area first.
            least_share: least area of a flat part over that of the whole surface [-].
        """
        edges = self._corners[:, 1:] - self._corners[:, :1]
        areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
        offsets = (self._normals * self._corners[:, 0]).sum(axis=1) / max(self._radius, np.finfo(float).tiny)
        planes = np.round(np.column_stack([self._normals, offsets]) / _SAME_PLANE)
        _, first, group = np.unique(planes, axis=0, return_index=True, return_inverse=True)
        total = np.bincount(group.ravel(), areas)
        for number in np.argsort(-total, kind="stable")[:most]:
            if total[number] < least_share * areas.sum():
                return
            triangle = first[number]
            yield self._normals[triangle], self._corners[triangle, 0] + self._middle

    def downward_triangles(self, pose: Pose, sheet: Rectangle, floor: float, ceiling: float) -> tuple[Indices, Array]:
        """Triangles that face down, are near a rectangle, and overlap the heights from floor to ceiling [m].

        Returns: their indices, shape (k,), and their corners in the pad frame [m], shape (k, 3, 3).
        """
        view = self.view(pose)
        height = view.corners[:, :, 2] + self._centre(pose)[2]
        number = np.flatnonzero(view.faces_down & (height < ceiling).any(axis=1) & (height >= floor).any(axis=1))
        corners = self.in_pad(pose, view.corners[number])
        low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
        near = (low[:, 0] < sheet.east) & (high[:, 0] > sheet.west) & (low[:, 1] < sheet.north)
        near &= high[:, 1] > sheet.south
        return number[near], corners[near]

    def outline(self, pose: Pose, triangles: Indices) -> Polygon | MultiPolygon:
        """Union of some triangles of a flat face, seen along the pad's normal [m].

        The last result is cached and moved with the body while its tilt changes little.
        """
        kept = self._outline
        direction = pose.rotation[2]
        if (
            kept is None
            or not np.array_equal(kept.triangles, triangles)
            or np.linalg.norm(kept.axes[2] - direction) > _SAME_OUTLINE
        ):
            view = self.view(pose)
            corners = view.corners[triangles]
            union = areal(shapely.union_all(shapely.polygons(corners[..., :2])))
            kept = self._outline = _Outline(view.axes, triangles, union, float(corners[..., 2].mean()))
        turn = pose.rotation @ kept.axes.T
        shift = self._centre(pose) + kept.height * turn[:, 2]
        return affine_transform(kept.union, [*turn[0, :2], *turn[1, :2], shift[0], shift[1]])

    def _centre(self, pose: Pose) -> Array:
        return pose.position + pose.rotation @ self._middle

    def _seen_along(self, direction: Array, nearly_across: Array) -> MeshView:
        u = nearly_across - (nearly_across @ direction) * direction
        u /= np.linalg.norm(u)
        axes = np.stack([u, np.cross(direction, u), direction])
        corners = self._corners @ axes.T
        facing = self._normals @ direction
        faces_down = facing < -_STEEP if self.closed else np.abs(facing) > _STEEP
        edges = corners[:, 1:, :2] - corners[:, :1, :2]
        determinant = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
        faces_down &= determinant != 0.0
        # Triangles that face away are never hit: comparisons with NaN are false.
        determinant = np.where(faces_down, determinant, np.nan)
        shares = np.empty((len(corners), 6))
        shares[:, 0], shares[:, 1] = edges[:, 1, 1], -edges[:, 1, 0]
        shares[:, 3], shares[:, 4] = -edges[:, 0, 1], edges[:, 0, 0]
        shares[:, 2] = -(shares[:, :2] * corners[:, 0, :2]).sum(axis=1)
        shares[:, 5] = -(shares[:, 3:5] * corners[:, 0, :2]).sum(axis=1)
        bottom = corners.reshape(-1, 3)[np.argmin(corners[..., 2])]
        return MeshView(axes, corners, shares / determinant[:, None], faces_down, bottom)

    def _gridded(self, view: MeshView) -> ShadowGrid:
        """Grid of the triangles that face down, or would after a tilt within the margin."""
        facing = self._normals @ view.axes[2]
        used = np.flatnonzero(facing < 2 * TILT_MARGIN) if self.closed else np.arange(len(facing))
        return ShadowGrid.of(view.corners[used, :, :2], used, 2 * TILT_MARGIN * self._radius)


def _least_aligned(direction: Array) -> Array:
    axis = np.zeros(3)
    axis[np.argmin(np.abs(direction))] = 1.0
    return axis
