"""Flat faces of rigid bodies, each in a frame of its own, independent of the body's pose.

A face depends on the body's geometry alone, not on the pose in which it was first found.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, affinity

from mjtactile._types import Array
from mjtactile.errors import FootprintError
from mjtactile.geometry.height_minimum import Rectangle
from mjtactile.geometry.lower_surface import FLATNESS, FlatPart, lower_surface
from mjtactile.geometry.outlines import ellipse
from mjtactile.geometry.primitives import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose, Shape
from mjtactile.geometry.triangle_mesh import TriangleSurface

#: Largest distance of a body's points from its middle for which faces are stored [m].
_FARTHEST = 1.0
#: Directions of faces in their body's frame are rounded to this [-], so that rounding errors make no second face.
_DIRECTION = 1e-7
#: A face may always tilt until one end is higher than the other by this fraction of the facing gap [-].
_LEAN = 0.5
#: A body that may tilt presses with a face whose slope is up to the first number [-], about 12 degrees, and up to the
#: second number times the slope at which another part of the body would touch.
_MOST_LEAN, _LEAN_SHARE = 0.21, 0.8
#: Faces of a mesh that are examined: the largest ones, and at least this fraction of its surface [-].
_MOST_FACES, _LEAST_SHARE = 64, 2e-3


@dataclass(frozen=True, eq=False)
class BodyFace:
    """A flat face of a body that can press on a pad.

    Attributes:
        rotation: from the body's frame to the face's frame, (3, 3). The z axis of the face's frame equals the pad's
            when the face lies flat on the pad.
        height: z of the face in that frame [m].
        outline: of the face in that frame [m].
        most_slope: largest slope of the body at which no other part of it touches [-].
    """

    rotation: Array
    height: float
    outline: Polygon | MultiPolygon
    most_slope: float

    def placed(self, pose: Pose) -> Polygon | MultiPolygon | None:
        """Outline in the pad frame [m] of the face at a pose of its body; None if the body is tilted too far."""
        turn = pose.rotation @ self.rotation.T
        if turn[2, 2] <= 0.0 or np.hypot(*turn[2, :2]) > self.most_slope * turn[2, 2]:
            return None
        angle = float(np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))
        x, y = pose.position[:2] + turn[:2, 2] * self.height
        return self._at(float(x), float(y), angle)

    def heights(self, pose: Pose, points: Array) -> Array:
        """Heights of the face over points (n, 2) in the pad frame [m] at a pose of its body, shape (n,)."""
        normal = pose.rotation @ self.rotation[2]
        offset = points - (pose.position + normal * self.height)[:2]
        return (pose.position + normal * self.height)[2] - offset @ normal[:2] / normal[2]

    def _at(self, x: float, y: float, angle: float) -> Polygon | MultiPolygon:
        turned = affinity.rotate(self.outline, angle, origin=(0, 0), use_radians=True)
        return affinity.translate(turned, x, y)


class BodyFaces:
    """The flat faces of one body.

    Args:
        shapes: of the body's geoms, by a number for each geom.
        local: poses of these geoms in the body's frame.
        facing_gap: parts up to this height above the first contact point belong to the contact face [m].

    Attributes:
        directions: candidates for the pad's normal when the body lies on one of its faces, unit vectors in the body's
            frame, (faces, 3).
    """

    def __init__(self, shapes: Mapping[int, Shape], local: Mapping[int, Pose], *, facing_gap: float) -> None:
        self._shapes, self._local = dict(shapes), dict(local)
        self._facing_gap = facing_gap
        self._points = np.concatenate([_outermost(shape, local[geom]) for geom, shape in shapes.items()])
        self.directions = self._supporting()
        self._made: dict[int, BodyFace | None] = {}

    def face(self, number: int) -> BodyFace | None:
        """A face by the number of its direction, computed once; None if the body cannot lie on it."""
        if number not in self._made:
            self._made[number] = self._face(self.directions[number])
        return self._made[number]

    def towards(self, pose: Pose) -> Iterator[tuple[BodyFace, Polygon | MultiPolygon]]:
        """Faces that point towards the pad at a pose of the body, with their outlines in the pad frame [m]."""
        for number in np.flatnonzero(self.directions @ pose.rotation[2] > 1.0 - _MOST_LEAN):
            face = self.face(int(number))
            outline = None if face is None else face.placed(pose)
            if face is not None and outline is not None:
                yield face, outline

    def _supporting(self) -> Array:
        """Directions of faces below which no part of the body lies, unit vectors, (faces, 3)."""
        found: dict[bytes, Array] = {}
        for geom, shape in self._shapes.items():
            for normal, point in _flat_sides(shape):
                upward = _rounded(-(self._local[geom].rotation @ normal))
                height = self._local[geom].points(point[None])[0] @ upward
                if height <= (self._points @ upward).min(initial=np.inf) + self._facing_gap:
                    found.setdefault(upward.tobytes(), upward)
        return np.array(list(found.values())).reshape(-1, 3)

    def _face(self, upward: Array) -> BodyFace | None:
        rotation = _face_axes(upward)
        height = float((self._points @ upward).min(initial=0.0))
        part = self._flat_part(Pose(np.array([0.0, 0.0, -height]), rotation))
        if part is None:
            return None
        width = float(np.ptp(shapely.get_coordinates(part.outline), axis=0).max())
        lean = min(_MOST_LEAN, _LEAN_SHARE * self._steepness(rotation, height, part))
        return BodyFace(rotation, height, part.outline, max(lean, _LEAN * self._facing_gap / width))

    def _flat_part(self, pose: Pose) -> FlatPart | None:
        """The flat face of the whole body at a pose, wherever it is over the pad's plane."""
        x, y = pose.position[:2]
        everywhere = Rectangle(x - _FARTHEST, y - _FARTHEST, x + _FARTHEST, y + _FARTHEST)
        placed = [(shape, composed(pose, self._local[geom])) for geom, shape in self._shapes.items()]
        try:
            surface = lower_surface(placed, everywhere, depth=_FARTHEST, facing_gap=self._facing_gap)
        except FootprintError:
            return None
        return surface.flat_part(self._facing_gap)

    def _steepness(self, rotation: Array, height: float, part: FlatPart) -> float:
        """Least slope from the face's rim to any other point of the body [-]."""
        points = self._points @ rotation.T
        rise = points[:, 2] - height
        above = rise > FLATNESS
        away = np.asarray(shapely.distance(shapely.points(points[above, :2]), part.outline.convex_hull))
        slopes = rise[above][away > 0.0] / away[away > 0.0]
        return float(slopes.min(initial=np.inf))


def composed(body: Pose, local: Pose) -> Pose:
    """Pose of a geom in the pad frame.

    Args:
        body: pose of the geom's body in the pad frame.
        local: pose of the geom in its body's frame.
    """
    return Pose(body.position + body.rotation @ local.position, body.rotation @ local.rotation)


def _flat_sides(shape: Shape) -> Iterator[tuple[Array, Array]]:
    """Outward normals of a shape's flat sides, and a point of each, in its own frame."""
    if isinstance(shape, Box):
        for axis in range(3):
            for sign in (-1.0, 1.0):
                normal = np.zeros(3)
                normal[axis] = sign
                yield normal, normal * shape.half_sizes[axis]
    elif isinstance(shape, Cylinder):
        for sign in (-1.0, 1.0):
            yield np.array([0.0, 0.0, sign]), np.array([0.0, 0.0, sign * shape.half_length])
    elif isinstance(shape, HalfSpace):
        yield np.array([0.0, 0.0, 1.0]), np.zeros(3)
    elif isinstance(shape, TriangleSurface):
        yield from shape.flat_sides(_MOST_FACES, _LEAST_SHARE)


def _outermost(shape: Shape, local: Pose) -> Array:
    """Points whose convex hull is about that of a shape, in the body's frame [m], shape (n, 3)."""
    if isinstance(shape, Box):
        signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
        return local.points(signs * shape.half_sizes)
    if isinstance(shape, Cylinder | Capsule):
        rim = np.array(ellipse(shape.radius, shape.radius).exterior.coords)[:-1]
        ends = [np.column_stack([rim, np.full(len(rim), end)]) for end in (-shape.half_length, shape.half_length)]
        if isinstance(shape, Capsule):
            ends += [shape.radius * _sphere() + (0.0, 0.0, end) for end in (-shape.half_length, shape.half_length)]
        return local.points(np.concatenate(ends))
    if isinstance(shape, Ellipsoid):
        return local.points(_sphere() * shape.semi_axes)
    if isinstance(shape, TriangleSurface):
        return local.points(shape.vertices)
    return local.points(np.zeros((1, 3)))


def _sphere() -> Array:
    """Points spread over the unit sphere, including its poles, shape (n, 3)."""
    polar, azimuth = np.meshgrid(np.linspace(0.0, np.pi, 17), np.linspace(0.0, 2 * np.pi, 32, endpoint=False))
    points = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    return np.stack(points, axis=-1).reshape(-1, 3)


def _rounded(direction: Array) -> Array:
    rounded = np.round(direction / np.linalg.norm(direction) / _DIRECTION) * _DIRECTION + 0.0
    return rounded / np.linalg.norm(rounded)


def _face_axes(normal: Array) -> Array:
    """Axes of the face in the body's frame, as rows, shape (3, 3)."""
    along = np.zeros(3)
    along[int(np.argmin(np.abs(normal)))] = 1.0
    x = along - normal * (along @ normal)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal])
