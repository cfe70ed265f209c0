"""Lower surfaces of rigid shapes in closed form: their heights over the points of a pad.

The part of a body that can touch the pad is its lowest point over each (x, y). A shape is given in its own frame, its
pose in the pad frame. Heights are metres above the pad's plane z = 0, infinite where no part of the shape is above.
Parts below `floor` are beside or behind the pad and are ignored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from dense_cells import Heights

from mjtactile._types import Array, Indices

#: A direction is parallel to a face if the sine of the angle between them is below this.
_PARALLEL = 1e-12
#: Bins along each axis in which triangles are looked up.
BINS = 48
#: Points this far outside a triangle, over its size, still meet it.
SEAM = 1e-9


class Pose(NamedTuple):
    """Pose of a shape in the pad frame."""

    position: Array  #: [m], shape (3,)
    rotation: Array  #: columns are the shape's axes in the pad frame, shape (3, 3)

    def points(self, local: Array) -> Array:
        """Transform points (n, 3) from the shape's frame to the pad frame [m]."""
        return self.position + local @ self.rotation.T


class Rectangle(NamedTuple):
    """An upright rectangle in the pad frame [m]."""

    west: float
    south: float
    east: float
    north: float


class Shape(Protocol):
    """A rigid shape with a lower surface."""

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame.

        Args:
            pose: of the shape in the pad frame.
            x: x coordinates of the points [m], shape (n,).
            y: y coordinates of the points [m], shape (n,).
            floor: parts below this height are ignored [m].

        Returns:
            Heights [m], shape (n,); infinite where no part of the shape is above.
        """
        ...


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid or a sphere about its frame's origin."""

    semi_axes: tuple[float, float, float]  #: [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        enter, leave = _through_unit_ball(origins / self.semi_axes, direction / np.array(self.semi_axes))
        return _above(_entry(enter, leave), floor)


@dataclass(frozen=True)
class Capsule:
    """A cylinder about z with hemispheres on its ends."""

    radius: float  #: [m]
    half_length: float  #: of the cylindrical part [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        slab = _through_slab(origins[:, 2], direction[2], self.half_length)
        height = _entry(*_common(_through_barrel(origins, direction, self.radius), slab))
        for end in (-self.half_length, self.half_length):
            from_end = (origins - (0.0, 0.0, end)) / self.radius
            height = np.minimum(height, _entry(*_through_unit_ball(from_end, direction / self.radius)))
        return _above(height, floor)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about z with flat ends."""

    radius: float  #: [m]
    half_length: float  #: [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        slab = _through_slab(origins[:, 2], direction[2], self.half_length)
        return _above(_entry(*_common(_through_barrel(origins, direction, self.radius), slab)), floor)


@dataclass(frozen=True)
class Box:
    """A box about its frame's origin."""

    half_sizes: tuple[float, float, float]  #: [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        slabs = [_through_slab(origins[:, k], direction[k], self.half_sizes[k]) for k in range(3)]
        return _above(_entry(*_common(*slabs)), floor)


@dataclass(frozen=True)
class HalfSpace:
    """All points with z < 0 in its frame, as MuJoCo's infinite plane."""

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        normal = pose.rotation[:, 2]
        if normal[2] > -_PARALLEL:
            return np.full(np.shape(x), np.inf)
        offset = normal @ pose.position
        return _above((offset - normal[0] * x - normal[1] * y) / normal[2], floor)


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A triangle mesh."""

    vertices: Array  #: [m], shape (n, 3)
    triangles: Indices  #: vertices of each, counter-clockwise from outside, shape (m, 3)
    closed: bool = True  #: in an open mesh both sides of each triangle are solid

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        corners = pose.points(self.vertices)[self.triangles]
        both = corners if self.closed else np.concatenate([corners, corners[:, ::-1]])
        return triangle_heights(both, floor)(x, y)


def triangle_heights(corners: Array, floor: float) -> Heights:
    """Lower surface of triangles that are counter-clockwise from outside, (n, 3 corners, 3) [m].

    Those that face down count, as far as they are no lower than `floor` [m]. Triangles are put into bins over the
    points that are asked for, so that each point meets few.
    """
    first, along, across = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
    size = np.abs(along).max(axis=1) + np.abs(across).max(axis=1)
    facing = area < -1e-9 * size**2
    corners, first, along, across, area = (one[facing] for one in (corners, first, along, across, area))
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)

    def heights(x: Array, y: Array) -> Array:
        points = np.column_stack([x, y])
        found = np.full(len(points), np.inf)
        if not len(points):
            return found
        start, end = points.min(axis=0), points.max(axis=0)
        seen = np.flatnonzero(((low <= end) & (high >= start)).all(axis=1))
        if not len(seen):
            return found
        width = np.maximum(end - start, 1e-12) * (1 + 1e-9) / BINS
        bin_of = np.floor((points - start) / width).astype(np.int64)
        slack = 1e-6 * width
        west, east = (
            np.clip(np.floor((side - start) / width).astype(np.int64), 0, BINS - 1)
            for side in (low[seen] - slack, high[seen] + slack)
        )
        # One entry per triangle and bin that its box meets.
        spans = east - west + 1
        counts = spans.prod(axis=1)
        owner = np.repeat(np.arange(len(seen)), counts)
        place = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        column = west[owner, 0] + place // spans[owner, 1]
        row = west[owner, 1] + place % spans[owner, 1]
        key = column * BINS + row
        order = np.argsort(key, kind="stable")
        starts = np.searchsorted(key[order], np.arange(BINS * BINS + 1))
        point_key = bin_of[:, 0] * BINS + bin_of[:, 1]
        entries = starts[point_key + 1] - starts[point_key]
        point = np.repeat(np.arange(len(points)), entries)
        entry = starts[point_key][point] + np.arange(len(point)) - np.repeat(np.cumsum(entries) - entries, entries)
        triangle = seen[owner[order[entry]]]
        offset = points[point] - first[triangle, :2]
        second = (offset[:, 0] * across[triangle, 1] - offset[:, 1] * across[triangle, 0]) / area[triangle]
        third = (along[triangle, 0] * offset[:, 1] - along[triangle, 1] * offset[:, 0]) / area[triangle]
        z = first[triangle, 2] + second * along[triangle, 2] + third * across[triangle, 2]
        met = (second >= -SEAM) & (third >= -SEAM) & (second + third <= 1 + SEAM) & (z >= floor)
        np.minimum.at(found, point[met], z[met])
        return found

    return heights


def _rays(pose: Pose, x: Array, y: Array) -> tuple[Array, Array]:
    """Lines along the pad's normal through (x, y, 0) in the shape's frame: points (n, 3) [m], direction (3,)."""
    from_origin = np.column_stack([x, y, np.zeros(len(x))]) - pose.position
    return from_origin @ pose.rotation, pose.rotation[2]


def _through_unit_ball(origins: Array, direction: Array) -> tuple[Array, Array]:
    """Parameters at which lines enter and leave the unit ball, each (n,); entry > exit for lines that miss it."""
    square = float(direction @ direction)
    nearest = -(origins @ direction) / square
    return _around(nearest, 1.0 - ((origins + nearest[:, None] * direction) ** 2).sum(axis=1), square)


def _through_barrel(origins: Array, direction: Array, radius: float) -> tuple[Array, Array]:
    """Parameters at which lines enter and leave the infinite cylinder about z, as in `_through_unit_ball`."""
    square = float(direction[:2] @ direction[:2])
    if square < _PARALLEL**2:
        outside = (origins[:, :2] ** 2).sum(axis=1) > radius**2
        return np.where(outside, np.inf, -np.inf), np.where(outside, -np.inf, np.inf)
    nearest = -(origins[:, :2] @ direction[:2]) / square
    distance = ((origins[:, :2] + nearest[:, None] * direction[:2]) ** 2).sum(axis=1)
    return _around(nearest, radius**2 - distance, square)


def _around(nearest: Array, within: Array, square: float) -> tuple[Array, Array]:
    """Interval about the parameter nearest to an axis; empty (infinity, minus infinity) where `within` is negative."""
    half = np.sqrt(np.maximum(within, 0.0) / square)
    return np.where(within >= 0.0, nearest - half, np.inf), np.where(within >= 0.0, nearest + half, -np.inf)


def _through_slab(origins: Array, direction: float, half: float) -> tuple[Array, Array]:
    """Parameters at which lines enter and leave |coordinate| <= half, given the coordinate at 0 and its rate."""
    if abs(direction) < _PARALLEL:
        outside = np.abs(origins) > half
        return np.where(outside, np.inf, -np.inf), np.where(outside, -np.inf, np.inf)
    reach = half / abs(direction)
    middle = -origins / direction
    return middle - reach, middle + reach


def _common(*intervals: tuple[Array, Array]) -> tuple[Array, Array]:
    enters, leaves = zip(*intervals, strict=True)
    return np.maximum.reduce(enters), np.minimum.reduce(leaves)


def _entry(enter: Array, leave: Array) -> Array:
    return np.where(enter <= leave, enter, np.inf)


def _above(height: Array, floor: float) -> Array:
    return np.where(height >= floor, height, np.inf)
