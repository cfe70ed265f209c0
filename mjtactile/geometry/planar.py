"""Plane geometry of outlines: triangulation, convex parts, and support points that balance about the centroid.

Lengths are metres. Outlines are shapely polygons; holes are kept.
"""

from __future__ import annotations

import math
from itertools import pairwise

import mapbox_earcut
import numpy as np
import shapely
from shapely import GeometryCollection, LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from mjtactile._types import Array, Indices
from mjtactile.errors import FootprintError, IndenterError
from mjtactile.geometry.outlines import turned

#: Limits of an area: west, south, east and north [m].
Bounds = tuple[float, float, float, float]

#: Outlines with more corners than this have support points at equal angles instead of at their corners.
MAXIMUM_SUPPORT_POINTS = 8
#: Corners whose angle differs from straight by less than this (its sine) are ignored [-].
STRAIGHT = 1e-9
#: For `even_parts`: number of squares along an area's longer side; largest distance between the rims of parts and area
#: over a square's side [-]; and least area of a part over a square's [-].
_SQUARES, _OFF_RIM, _LEAST_PART = 8, 0.02, 0.01


def areal(geometry: BaseGeometry) -> Polygon | MultiPolygon:
    """The polygons of a geometry; points and lines, which set operations may leave, are dropped."""
    if isinstance(geometry, Polygon | MultiPolygon):
        return geometry
    parts = geometry.geoms if isinstance(geometry, GeometryCollection) else ()
    polygons = [p for part in parts for p in polygons_of(areal(part))]
    return polygons[0] if len(polygons) == 1 else MultiPolygon(polygons)


def area_on_sheet(outline: BaseGeometry, sheet: Bounds) -> Polygon | MultiPolygon:
    """Intersection of an outline and a pad's sheet, which is given by its bounds, both in the pad frame [m].

    Raises:
        FootprintError: the outline is not a valid area, or does not overlap the sheet.
    """
    if not isinstance(outline, Polygon | MultiPolygon):
        raise FootprintError(
            f"the outline is of type {type(outline).__name__}; expected a shapely Polygon or MultiPolygon in metres."
        )
    if not outline.is_valid:  # as an area with NaN or infinite coordinates is not, either
        if not np.isfinite(shapely.get_coordinates(outline)).all():
            raise FootprintError("the outline has NaN or infinite coordinates; check the pose it was made from.")
        raise FootprintError(
            f"the outline is not a valid area ({shapely.is_valid_reason(outline)}). "
            "shapely.make_valid mends self-crossing polygons."
        )
    covered = outline if _within(outline.bounds, sheet) else areal(outline.intersection(shapely.box(*sheet)))
    if covered.area == 0.0:
        bounds = "nothing" if outline.is_empty else "x {0:.4g}..{2:.4g} m, y {1:.4g}..{3:.4g} m".format(*outline.bounds)
        raise FootprintError(
            f"the outline covers none of the pad: it spans {bounds}, and the sheet "
            "x {:.4g}..{:.4g} m, y {:.4g}..{:.4g} m. Shift it onto the sheet; lengths are metres.".format(
                *(sheet[i] for i in (0, 2, 1, 3))
            )
        )
    return covered


def _within(inner: Bounds, outer: Bounds) -> bool:
    """Whether bounds lie inside others; False for NaN, the bounds of an empty geometry."""
    return inner[0] >= outer[0] and inner[1] >= outer[1] and inner[2] <= outer[2] and inner[3] <= outer[3]


def polygons_of(area: Polygon | MultiPolygon) -> list[Polygon]:
    """The non-empty polygons of an area."""
    parts = area.geoms if isinstance(area, MultiPolygon) else (area,)
    return [part for part in parts if not part.is_empty]


def rings_of(polygon: Polygon) -> list[Array]:
    """Corners of the outer ring and of each hole, shapes (n, 2) [m]; material is on the left, no corner is repeated."""
    oriented = orient(polygon)
    return [np.asarray(ring.coords)[:-1, :2] for ring in (oriented.exterior, *oriented.interiors)]


def triangulate(polygon: Polygon) -> tuple[Array, Indices]:
    """Split a polygon into triangles that use its own corners only.

    Returns: corners, shape (n, 2) [m], in the order of `rings_of`; counter-clockwise triangles, shape (m, 3).
    """
    rings = rings_of(polygon)
    corners = np.ascontiguousarray(np.vstack(rings))
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    triangles = mapbox_earcut.triangulate_float64(corners, ends).reshape(-1, 3).astype(np.int64)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    clockwise = _cross(b - a, c - b) < 0.0
    triangles[clockwise] = triangles[clockwise][:, ::-1]
    return corners, triangles


def convex_parts(polygon: Polygon) -> list[Polygon]:
    """Split a polygon into convex parts that do not overlap and whose union is the polygon.

    Triangles are merged across shared edges while the result stays convex, which gives at most four times the
    smallest possible number of parts.
    Source: Hertel and Mehlhorn, Fast triangulation of simple polygons, FCT 1983.
    """
    corners, triangles = triangulate(polygon)
    parts = {i: [int(v) for v in triangle] for i, triangle in enumerate(triangles)}
    owner = {edge: i for i, part in parts.items() for edge in _edges(part)}
    for tail, head in [edge for edge in owner if edge[0] < edge[1] and edge[::-1] in owner]:
        left, right = owner[tail, head], owner[head, tail]
        merged = _starting_at(parts[left], head) + _starting_at(parts[right], tail)[1:-1]
        if not _turns_left_at(corners, merged, (tail, head)):
            continue
        parts[left] = merged
        del parts[right]
        owner.update(dict.fromkeys(_edges(merged), left))
    return [Polygon(corners[part]) for part in parts.values()]


def even_parts(area: Polygon | MultiPolygon) -> list[Polygon]:
    """Convex parts of about one size that cover an area [m] and leave its notches and holes open.

    A grid of squares, centred on the area's bounds, cuts the area into pieces. `convex_parts` cuts those pieces that
    are not convex. Pieces smaller than a hundredth of a square are left out. Arcs are replaced by chords that deviate
    from them by up to a fiftieth of a square's side.
    """
    west, south, east, north = area.bounds
    side = max(east - west, north - south) / _SQUARES
    x, y = (_even_lines(low, high, side) for low, high in ((west, east), (south, north)))
    squares = [shapely.box(x0, y0, x1, y1) for y0, y1 in pairwise(y) for x0, x1 in pairwise(x)]
    found = []
    for piece in shapely.intersection(area, squares).tolist():
        for polygon in polygons_of(areal(piece)):
            if polygon.area > _LEAST_PART * side**2:
                found += [p for q in polygons_of(areal(polygon.simplify(_OFF_RIM * side))) for p in convex_parts(q)]
    return [part for part in found if part.area > _LEAST_PART * side**2]


def support_points(area: Polygon | MultiPolygon, within: Polygon | MultiPolygon | None = None) -> Array:
    """A few points at an area's rim whose mean is the area's centroid.

    A rigid face that cannot tilt presses with equal force at each point, so the points must balance about the centroid.
    The candidates are the corners of the convex hull if they are few, otherwise points of its rim at equal angles. Let
    r_i be the vector from the centroid to candidate i. The result is centroid + t_i r_i. The factors t_i satisfy
    sum t_i r_i = 0 and are as close to 1 as possible (least squares). They are then scaled so that the largest is 1:
    no point leaves the hull.

    Args:
        area: the loaded area [m].
        within: region that the points must lie in [m]; by default the area's convex hull.
    Returns: shape (n, 2) [m], 3 <= n <= MAXIMUM_SUPPORT_POINTS.

    Raises:
        IndenterError: no points inside `within` balance about the centroid.
    """
    hull = (area if within is None else within).convex_hull
    centre = np.array([area.centroid.x, area.centroid.y])
    if not isinstance(hull, Polygon) or hull.is_empty or not hull.contains(area.centroid):
        raise IndenterError("the area to support is empty or a line, or its centroid lies outside the supports.")
    for candidates in (_corners(hull), _rim(hull, centre, MAXIMUM_SUPPORT_POINTS)):
        arms = candidates - centre
        shares = 1.0 - arms @ np.linalg.solve(arms.T @ arms, arms.sum(axis=0))
        if len(candidates) <= MAXIMUM_SUPPORT_POINTS and shares.min() > 0.0:
            return centre + (shares / shares.max())[:, None] * arms
    raise IndenterError(
        f"no {MAXIMUM_SUPPORT_POINTS} points of the area balance about its centroid "
        f"({centre[0]:.6g}, {centre[1]:.6g}) m: it is too thin or too lopsided. Use a more compact face."
    )


def _even_lines(low: float, high: float, distance: float) -> list[float]:
    """Coordinates at equal distances, symmetric about the middle of two limits, that reach both limits [m]."""
    count = max(1, math.ceil((high - low) / distance - STRAIGHT))
    return ((low + high) / 2 + distance * (np.arange(count + 1) - count / 2)).tolist()


def _corners(hull: Polygon) -> Array:
    """Corners of a convex polygon without those on straight edges, shape (n, 2) [m]."""
    corners = rings_of(hull)[0]
    after = np.roll(corners, -1, axis=0) - corners
    # Normalise each edge by itself: the product of two tiny lengths would underflow.
    after = after / np.linalg.norm(after, axis=1, keepdims=True)
    return corners[_cross(np.roll(after, 1, axis=0), after) > STRAIGHT]


def _rim(hull: Polygon, centre: Array, count: int) -> Array:
    """Points where rays at equal angles from `centre` leave a convex polygon, shape (count, 2) [m]."""
    tips = centre + 2.0 * hull.length * turned(count)
    return np.array([LineString([centre, tip]).intersection(hull).coords[-1] for tip in tips])


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _edges(loop: list[int]) -> list[tuple[int, int]]:
    return list(zip(loop, loop[1:] + loop[:1], strict=True))


def _starting_at(loop: list[int], vertex: int) -> list[int]:
    start = loop.index(vertex)
    return loop[start:] + loop[:start]


def _turns_left_at(corners: Array, loop: list[int], vertices: tuple[int, int]) -> bool:
    for vertex in vertices:
        at = loop.index(vertex)
        before, after = (
            corners[loop[at]] - corners[loop[at - 1]],
            corners[loop[(at + 1) % len(loop)]] - corners[loop[at]],
        )
        if _cross(before, after) < -STRAIGHT * np.linalg.norm(before) * np.linalg.norm(after):
            return False
    return True
