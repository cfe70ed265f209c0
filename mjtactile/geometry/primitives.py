"""Lower surfaces of rigid shapes in closed form: their heights over the points of a pad.

The part of a body that can touch the pad is its lowest point over each (x, y). A shape is given in its own frame, its
pose in the pad frame. Heights are metres above the pad's plane z = 0, infinite where no part of the shape is above.
Parts below `floor` are beside or behind the pad and are ignored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from shapely import Polygon

from mjtactile._types import Array
from mjtactile.geometry.height_minimum import Rectangle, lowest_near
from mjtactile.geometry.outlines import ellipse

#: A direction is parallel to a face if the sine of the angle between them is below this.
_PARALLEL = 1e-12


class Pose(NamedTuple):
    """Pose of a shape in the pad frame."""

    position: Array  #: [m], shape (3,)
    rotation: Array  #: columns are the shape's axes in the pad frame, shape (3, 3)

    def points(self, local: Array) -> Array:
        """Transform points (n, 3) from the shape's frame to the pad frame [m]."""
        return self.position + local @ self.rotation.T


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

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle [m]; infinite if no part of the shape is above it.

        Args:
            pose: of the shape in the pad frame.
            sheet: the rectangle, in the pad frame [m].
            floor: parts below this height are ignored [m].
        """
        ...


@dataclass(frozen=True)
class Facet:
    """A flat part of a lower surface."""

    outline: Polygon  #: seen along the pad's normal, in the pad frame [m]
    plane: tuple[float, float, float]  #: its height is plane[0] + plane[1] x + plane[2] y [m]

    def heights(self, x: Array, y: Array) -> Array:
        """Height of the facet's plane at points (x, y) [m], shape (n,)."""
        return self.plane[0] + self.plane[1] * x + self.plane[2] * y

    @classmethod
    def through(cls, outline: Polygon, point: Array, normal: Array) -> Facet:
        """The facet in the plane through a point (3,) [m] with a normal (3,), whose z component must not be zero."""
        along_x, along_y = -normal[0] / normal[2], -normal[1] / normal[2]
        return cls(outline, (float(point[2] - along_x * point[0] - along_y * point[1]), along_x, along_y))


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid or a sphere about its frame's origin."""

    semi_axes: tuple[float, float, float]  #: [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        enter, leave = _through_unit_ball(origins / self.semi_axes, direction / np.array(self.semi_axes))
        return _above(_entry(enter, leave), floor)

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; see `Shape.lowest`."""
        down = -pose.rotation[2]
        scaled = np.array(self.semi_axes) * down
        bottom = pose.points((np.array(self.semi_axes) * scaled / np.linalg.norm(scaled))[None])
        longest = np.zeros(3)
        longest[np.argmax(self.semi_axes)] = max(self.semi_axes)
        axis = pose.points(np.stack([-longest, longest]))
        return lowest_near(lambda x, y: self.heights(pose, x, y, floor), sheet, floor, bottom, axis)


@dataclass(frozen=True)
class Capsule:
    """A cylinder about z with hemispheres on its ends."""

    radius: float  #: [m]
    half_length: float  #: of the cylindrical part [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        height = _entry(*_common(_through_barrel(origins, direction, self.radius), self._slab(origins, direction)))
        for end in (-self.half_length, self.half_length):
            from_end = (origins - (0.0, 0.0, end)) / self.radius
            height = np.minimum(height, _entry(*_through_unit_ball(from_end, direction / self.radius)))
        return _above(height, floor)

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; see `Shape.lowest`."""
        axis = pose.points(np.array([[0.0, 0.0, -self.half_length], [0.0, 0.0, self.half_length]]))
        bottom = _lower(axis) - (0.0, 0.0, self.radius)
        return lowest_near(lambda x, y: self.heights(pose, x, y, floor), sheet, floor, bottom, axis)

    def _slab(self, origins: Array, direction: Array) -> tuple[Array, Array]:
        return _through_slab(origins[:, 2], direction[2], self.half_length)


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

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; see `Shape.lowest`."""
        axis = pose.points(np.array([[0.0, 0.0, -self.half_length], [0.0, 0.0, self.half_length]]))
        sideways = -pose.rotation[2, :2]
        length = float(np.linalg.norm(sideways))
        arm = np.zeros(3) if length < _PARALLEL else np.array([*(self.radius / length * sideways), 0.0])
        bottom = _lower(axis) + pose.rotation @ arm
        return lowest_near(lambda x, y: self.heights(pose, x, y, floor), sheet, floor, bottom, axis)

    def facets(self, pose: Pose) -> list[Facet]:
        """The end that faces down, as a polygon with the circle's area."""
        up = pose.rotation[2, 2]
        if abs(up) < _PARALLEL:
            return []
        rim = np.array(ellipse(self.radius, self.radius).exterior.coords)[:-1]
        corners = pose.points(np.column_stack([rim, np.full(len(rim), -np.sign(up) * self.half_length)]))
        return [Facet.through(Polygon(corners[:, :2]), corners.mean(axis=0), pose.rotation[:, 2])]


@dataclass(frozen=True)
class Box:
    """A box about its frame's origin."""

    half_sizes: tuple[float, float, float]  #: [m]

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        origins, direction = _rays(pose, x, y)
        slabs = [_through_slab(origins[:, k], direction[k], self.half_sizes[k]) for k in range(3)]
        return _above(_entry(*_common(*slabs)), floor)

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; see `Shape.lowest`."""
        bottom = pose.position - pose.rotation @ (np.sign(pose.rotation[2]) * self.half_sizes)
        if sheet.holds(bottom[0], bottom[1]) and bottom[2] >= floor:
            return float(bottom[2])
        return min((sheet.lowest_of_polygon(corners, floor) for corners in self._lower_faces(pose)), default=np.inf)

    def facets(self, pose: Pose) -> list[Facet]:
        """The faces that face down."""
        faces = self._lower_faces(pose)
        normals = [np.cross(corners[1] - corners[0], corners[3] - corners[0]) for corners in faces]
        # A vertical wall has no area seen from above, and its height is no function of (x, y).
        seen = [(c, n) for c, n in zip(faces, normals, strict=True) if n[2] != 0.0]
        return [Facet.through(Polygon(c[:, :2]), c.mean(axis=0), n) for c, n in seen]

    def _lower_faces(self, pose: Pose) -> list[Array]:
        """Corners of the faces that face down, in order around each, shapes (4, 3) [m]."""
        faces = []
        for axis in range(3):
            up = pose.rotation[2, axis]
            if abs(up) < _PARALLEL:
                continue
            corners = np.empty((4, 3))
            corners[:, axis] = -np.sign(up) * self.half_sizes[axis]
            for other, signs in ((axis - 1, (-1, 1, 1, -1)), (axis - 2, (-1, -1, 1, 1))):
                corners[:, other] = self.half_sizes[other] * np.array(signs)
            faces.append(pose.points(corners))
        return faces


@dataclass(frozen=True)
class HalfSpace:
    """All points with z < 0 in its frame, as MuJoCo's infinite plane."""

    def heights(self, pose: Pose, x: Array, y: Array, floor: float) -> Array:
        """Height of the lower surface over points (x, y) of the pad frame [m], shape (n,); see `Shape.heights`."""
        facets = self.facets(pose)
        return _above(facets[0].heights(x, y), floor) if facets else np.full(np.shape(x), np.inf)

    def lowest(self, pose: Pose, sheet: Rectangle, floor: float) -> float:
        """The least height over a rectangle of the pad frame [m]; see `Shape.lowest`."""
        return float(self.heights(pose, sheet.corners[:, 0], sheet.corners[:, 1], floor).min())

    def facets(self, pose: Pose) -> list[Facet]:
        """The plane if it faces down, as a square of one kilometre."""
        normal = pose.rotation[:, 2]
        if normal[2] > -_PARALLEL:
            return []
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 500.0
        return [Facet.through(Polygon(square), pose.position, normal)]


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


def _lower(ends: Array) -> Array:
    """The lower of two points, or both where they are level, shape (1 or 2, 3) [m]."""
    rise = ends[1, 2] - ends[0, 2]
    return ends if abs(rise) < _PARALLEL else ends[[0 if rise > 0 else 1]]
