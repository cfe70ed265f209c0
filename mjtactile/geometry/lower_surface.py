"""The lower surface of a body over a pad: first contact point, gap function, and the flat face if there is one.

A body consists of shapes in given poses; its lower surface is the lowest of theirs. A part that lies far below the rest
within a narrow margin of the sheet's rim belongs to something beside the pad and is ignored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile._types import Array, Indices
from mjtactile.errors import FootprintError
from mjtactile.geometry.height_minimum import Rectangle
from mjtactile.geometry.planar import areal
from mjtactile.geometry.primitives import Box, Cylinder, HalfSpace, Pose, Shape
from mjtactile.geometry.triangle_mesh import TriangleSurface

#: A face is flat if all its corners are within this distance of one plane [m].
FLATNESS = 1e-7
#: Area near the pad besides the flat face, over the face's area [-]. With more, such as that of chamfers, the face
#: counts as curved.
_BESIDE = 1e-3


class FlatPart(NamedTuple):
    """A flat face of a body."""

    outline: Polygon | MultiPolygon  #: seen along the pad's normal, in the pad frame [m]
    corners: Array  #: of its parts over the sheet, in the pad frame [m], shape (n, 3)


@dataclass(frozen=True)
class LowerSurface:
    """Lower surface of a body over a sheet, in the pad frame."""

    shapes: Sequence[tuple[Shape, Pose]]  #: of the body, with their poses in the pad frame
    sheet: Rectangle  #: the sensing surface [m]
    floor: float  #: parts below this height are beside the pad and ignored [m]
    touch: float  #: least height over the sheet, that of the first contact point [m]

    def gap(self, x: Array, y: Array) -> Array:
        """Height above the first contact point at points (n,) [m], shape (n,); infinite where no body is above."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        heights = [shape.heights(pose, x.ravel(), y.ravel(), self.floor) for shape, pose in self.shapes]
        return np.maximum(np.minimum.reduce(heights) - self.touch, 0.0).reshape(x.shape)

    def flat_face(self, facing_gap: float, *, level: bool = False) -> Polygon | MultiPolygon | None:
        """Outline of the flat face towards the pad [m], or None; see `flat_part`."""
        part = self.flat_part(facing_gap, level=level)
        return None if part is None else part.outline

    def flat_part(self, facing_gap: float, *, level: bool = False) -> FlatPart | None:
        """The flat face towards the pad, or None if there is none.

        A face is flat if its corners over the sheet lie in one plane to `FLATNESS`, none of them is more than
        `facing_gap` above the first contact point, and almost no other part of the body is that low.

        Args:
            facing_gap: parts up to this height above the first contact point belong to the face [m].
            level: whether the plane must also be parallel to the pad, to `FLATNESS`.
        """
        ceiling = self.touch + facing_gap
        near = [pair for pair in self.shapes if pair[0].lowest(pair[1], self.sheet, self.floor) < ceiling]
        faces = []
        for shape, pose in near:
            face = _face(shape, pose, self.sheet, self.floor, ceiling)
            if face is None or not _is_plane(face.corners, level):
                return None
            faces.append(face)
        if not faces:
            return None
        corners = np.concatenate([face.corners for face in faces])
        return FlatPart(_union([_outline(face) for face in faces]), corners) if _is_plane(corners, level) else None


def lower_surface(
    shapes: Sequence[tuple[Shape, Pose]], sheet: Rectangle, *, depth: float, facing_gap: float
) -> LowerSurface:
    """Lower surface of a body over a pad.

    Args:
        shapes: of the body, with their poses in the pad frame.
        sheet: the sensing surface [m].
        depth: thickness of the pad [m]; parts below its underside, or higher than this above it, are ignored.
        facing_gap: parts within half this distance of the sheet's rim that are lower than the rest by more than this
            are beside the pad and ignored [m].

    Raises:
        FootprintError: no other part of the body is above the sheet.
    """
    inner = sheet.shrunk(facing_gap / 2)
    touch = min((shape.lowest(pose, inner, -depth) for shape, pose in shapes), default=np.inf)
    if touch > depth:
        raise FootprintError(
            f"nothing of it is over the surface, or only a sliver at the rim, {facing_gap / 2 * 1e6:.3g} um wide. "
            "Press further in from the edge."
        )
    floor = max(touch - facing_gap, -depth)
    touch = min(touch, *(shape.lowest(pose, sheet, floor) for shape, pose in shapes))
    return LowerSurface(shapes, sheet, floor, touch)


class _Face(NamedTuple):
    """The flat parts of one shape that face the pad."""

    corners: Array  #: of their parts over the sheet, in the pad frame [m], shape (n, 3)
    outlines: list[Polygon]  #: of each [m]; empty for triangles
    triangles: tuple[TriangleSurface, Pose, Indices] | None = None  #: mesh, its pose, and indices of the triangles


def _face(shape: Shape, pose: Pose, sheet: Rectangle, floor: float, ceiling: float) -> _Face | None:
    """Flat parts of a shape below the ceiling [m]; None if it has none, or if curved parts are below it too."""
    if isinstance(shape, TriangleSurface):
        return _triangle_face(shape, pose, sheet, floor, ceiling)
    if not isinstance(shape, Box | Cylinder | HalfSpace):
        return None
    facets = shape.facets(pose)
    parts = shapely.intersection([facet.outline for facet in facets], shapely.box(*sheet))
    corners, outlines, areas, beside = [], [], 0.0, 0.0
    for facet, part in zip(facets, parts, strict=True):
        if part.area == 0.0:
            continue
        rim = shapely.get_coordinates(part)
        points = np.column_stack([rim, facet.heights(*rim.T)])
        low, high = points[:, 2].min(), points[:, 2].max()
        if high <= ceiling and low >= floor:
            corners.append(points)
            outlines.append(facet.outline)
            areas += part.area
        elif low < ceiling and high >= floor:
            beside += part.area * (ceiling - low) / (high - low)
    if not corners or beside > _BESIDE * areas:
        return None
    return _Face(np.concatenate(corners), outlines)


def _triangle_face(
    surface: TriangleSurface, pose: Pose, sheet: Rectangle, floor: float, ceiling: float
) -> _Face | None:
    numbers, corners = surface.downward_triangles(pose, sheet, floor, ceiling)
    points, owner = _clipped(corners, sheet)
    if len(points) == 0:
        return None
    low, high = (np.full(len(corners), limit) for limit in (np.inf, -np.inf))
    np.minimum.at(low, owner, points[:, 2])
    np.maximum.at(high, owner, points[:, 2])
    flat = (high <= ceiling) & (low >= floor)
    slanted = (low < ceiling) & (high > ceiling)
    areas = np.asarray(shapely.area(shapely.polygons(corners[..., :2])))
    # With t = (ceiling - low) / (high - low), between t^2 and 1 - (1 - t)^2 of a triangle's area is below the ceiling.
    # The share t is close enough, and triangles need not be cut.
    beside = (areas[slanted] * (ceiling - low[slanted]) / (high[slanted] - low[slanted])).sum()
    if not flat.any() or beside > _BESIDE * areas[flat].sum():
        return None
    return _Face(points[flat[owner]], [], (surface, pose, numbers[flat]))


def _clipped(corners: Array, sheet: Rectangle) -> tuple[Array, Indices]:
    """Corners of triangles clipped to a rectangle, shape (n, 3) [m], and the index of each corner's triangle."""
    inside = sheet.holds(corners[..., 0], corners[..., 1]).all(axis=1)
    whole, cut = np.flatnonzero(inside), np.flatnonzero(~inside)
    points, owner = corners[whole].reshape(-1, 3), np.repeat(whole, 3)
    if len(cut) == 0:
        return points, owner
    parts = np.asarray(shapely.intersection(shapely.polygons(corners[cut, :, :2]), shapely.box(*sheet)))
    parts[np.asarray(shapely.area(parts)) == 0.0] = Polygon()
    rims, index = shapely.get_coordinates(parts, return_index=True)
    first = corners[cut[index], 0]
    a, b = corners[cut[index], 1] - first, corners[cut[index], 2] - first
    normal = np.cross(a, b)
    offset = rims - first[:, :2]
    height = first[:, 2] - (normal[:, :2] * offset).sum(axis=1) / normal[:, 2]
    return np.concatenate([points, np.column_stack([rims, height])]), np.concatenate([owner, cut[index]])


def _is_plane(points: Array, level: bool) -> bool:
    if level:
        return bool(np.ptp(points[:, 2]) <= FLATNESS)
    centred = points - points.mean(axis=0)
    slope, *_ = np.linalg.lstsq(centred[:, :2], centred[:, 2], rcond=None)
    return bool(np.abs(centred[:, 2] - centred[:, :2] @ slope).max() <= FLATNESS)


def _outline(face: _Face) -> Polygon | MultiPolygon:
    if face.triangles is None:
        return _union(face.outlines)
    surface, pose, numbers = face.triangles
    return surface.outline(pose, numbers)


def _union(areas: Sequence[Polygon | MultiPolygon]) -> Polygon | MultiPolygon:
    """Union of areas; a single area is returned unchanged, so that cached footprints recognise its first corner."""
    return areas[0] if len(areas) == 1 else areal(shapely.union_all(areas))
