"""Solids as closed triangle meshes: checking, extruding an outline, and cutting by a plane z = constant.

Lengths are metres. A solid is a watertight `trimesh.Trimesh`.
"""

from __future__ import annotations

import numpy as np
import shapely
import trimesh
from shapely import MultiPolygon, Polygon
from trimesh.graph import connected_component_labels

from mjtactile._types import Array, Indices, Mask
from mjtactile.errors import IndenterError, shortened
from mjtactile.geometry.planar import areal, polygons_of, triangulate
from mjtactile.units import finite_number

#: Vertices closer than this to the cutting plane count as lying in it [m], because rotations are rounded.
PLANE_TOLERANCE = 1e-9
#: Walls whose normals have a vertical part of no more than this are vertical [-]; files have single precision.
_UPRIGHT = 1e-5
#: Largest extent of a solid [m]; a larger one was almost certainly drawn in millimetres.
LARGEST_EXTENT = 1.0


def checked(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    """The same mesh, after checking that it is a solid: finite, not empty, watertight, normals outwards, sensible size.

    Raises:
        IndenterError: the mesh is no such solid; the message says what is wrong and how to correct it.
    """
    if not isinstance(solid, trimesh.Trimesh):
        raise IndenterError(f"expected a trimesh.Trimesh, got {type(solid).__name__}.")
    if len(solid.faces) == 0:
        raise IndenterError("the mesh has no triangles. Load a surface mesh, not points or curves.")
    if not np.isfinite(solid.vertices).all():
        raise IndenterError("the mesh has vertices that are not finite. Repair the file it came from.")
    if not (solid.is_watertight and solid.is_winding_consistent):
        raise IndenterError(
            "the mesh is not watertight (every edge must join two triangles that wind alike). "
            "Close it, for example with trimesh's fill_holes() and fix_normals()."
        )
    if solid.volume <= 0.0:
        raise IndenterError(f"the mesh's volume is {solid.volume:.3g} m3: it is inside out. Call its invert().")
    if max(solid.extents) > LARGEST_EXTENT:
        raise IndenterError(
            f"the mesh is {max(solid.extents):.4g} m across. Lengths are in metres: "
            "for a mesh drawn in millimetres pass scale=1e-3, at the command line --scale 1e-3."
        )
    return solid


def extrude(area: Polygon | MultiPolygon, height: float) -> trimesh.Trimesh:
    """The prism over `area` from z = 0 to z = height [m], watertight; its corners are the area's own corners.

    Raises:
        IndenterError: the height is not positive, the area is empty, or the prism is no valid solid.
    """
    if not finite_number(height) > 0.0:
        raise IndenterError(f"height = {shortened(height)} m; expected a positive length in metres (5 mm is 5e-3).")
    prisms = [_prism(polygon, height) for polygon in polygons_of(area)]
    if not prisms:
        raise IndenterError("cannot extrude an empty outline.")
    solid = prisms[0]
    for prism in prisms[1:]:
        solid = solid + prism
    return checked(solid)


def _prism(polygon: Polygon, height: float) -> trimesh.Trimesh:
    corners, triangles = triangulate(polygon)
    count = len(corners)
    ring_sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    ring_starts = np.repeat(np.cumsum([0, *ring_sizes[:-1]]), ring_sizes)
    here = np.arange(count)
    after = ring_starts + (here - ring_starts + 1) % np.repeat(ring_sizes, ring_sizes)
    sides = np.vstack(
        [
            triangles[:, ::-1],  # bottom, seen from below
            triangles + count,  # top
            np.column_stack([here, after, after + count]),
            np.column_stack([here, after + count, here + count]),
        ]
    )
    vertices = np.vstack([np.insert(corners, 2, z, axis=1) for z in (0.0, height)])
    return trimesh.Trimesh(vertices, sides, process=False)


def is_prism(solid: trimesh.Trimesh) -> bool:
    """Whether all walls of a solid are vertical and all other triangles lie in its lowest or highest plane."""
    low, high = solid.bounds[:, 2]
    heights = solid.triangles[:, :, 2]
    level = [(np.abs(heights - height) <= PLANE_TOLERANCE).all(axis=1) for height in (low, high)]
    return bool((level[0] | level[1] | (np.abs(solid.face_normals[:, 2]) <= _UPRIGHT)).all())


def silhouette(solid: trimesh.Trimesh) -> Polygon:
    """Convex hull of the solid's projection along z [m]."""
    return shapely.MultiPoint(solid.vertices[:, :2]).convex_hull  # type: ignore[return-value]


def face_outline(
    solid: trimesh.Trimesh, height: float, *, tolerance: float = PLANE_TOLERANCE
) -> Polygon | MultiPolygon:
    """Section of a solid by the plane z = height [m], with concave outlines and holes; empty where it misses the solid.

    The solid includes its surface, so a flat face that lies in the plane belongs to the section. Where vertices lie
    within `tolerance` of the plane, the section is the union of the sections just above and just below it. Both cross
    edges only, so that vertices and edges in the plane need no special cases.

    Args:
        solid: a watertight mesh in the frame in which the plane is z = height [m].
        height: of the plane [m].
        tolerance: vertices within this distance of the plane lie in it [m].

    Raises:
        IndenterError: the mesh is not watertight.
    """
    if not (solid.is_watertight and solid.is_winding_consistent):
        raise IndenterError("only a watertight mesh has a section with an inside. Close it, for example fill_holes().")
    offset = solid.vertices[:, 2] - height
    offset[np.abs(offset) <= tolerance] = 0.0
    section = _section(solid, offset, offset >= 0.0)
    if (offset == 0.0).any():
        section = areal(section.union(_section(solid, offset, offset > 0.0)))
    return section


def _section(solid: trimesh.Trimesh, offset: Array, above: Mask) -> Polygon | MultiPolygon:
    """Section between the vertices marked `above` and the others; `offset` are heights over the plane [m], (n,)."""
    tails, heads = _crossings(np.asarray(solid.faces), above)
    if len(tails) == 0:
        return Polygon()
    low, high = tails.T
    fraction = offset[low] / (offset[low] - offset[high])
    corners = solid.vertices[low, :2] + fraction[:, None] * (solid.vertices[high, :2] - solid.vertices[low, :2])
    body = connected_component_labels(solid.edges_unique, node_count=len(solid.vertices))[low]
    outlines: dict[int, Polygon | MultiPolygon] = {}  # by body
    for loop in _loops(tails, heads):
        if len(loop) < 3:
            continue
        ring = areal(shapely.make_valid(Polygon(corners[loop])))
        key = int(body[loop[0]])
        # Within one body a ring inside a ring is a hole; separate bodies add up.
        outlines[key] = areal(outlines[key].symmetric_difference(ring)) if key in outlines else ring
    return areal(shapely.union_all(list(outlines.values()))) if len(outlines) != 1 else next(iter(outlines.values()))


def _crossings(triangles: Indices, above: Mask) -> tuple[Indices, Indices]:
    """Cut edges in which the section's segments start and end, each (low, high) vertex indices, shapes (m, 2)."""
    marks = above[triangles]
    cut = marks.any(axis=1) & ~marks.all(axis=1)
    triangles, marks = triangles[cut], marks[cut]
    lone_is_above = marks.sum(axis=1) == 1
    lone = np.argmax(marks == lone_is_above[:, None], axis=1)  # the corner alone on its side of the plane
    rows = np.arange(len(triangles))
    apex, after, before = (triangles[rows, (lone + k) % 3] for k in range(3))
    onward, backward = np.column_stack([apex, after]), np.column_stack([apex, before])
    starts = np.where(lone_is_above[:, None], onward, backward)
    ends = np.where(lone_is_above[:, None], backward, onward)
    return np.sort(starts, axis=1), np.sort(ends, axis=1)


def _loops(tails: Indices, heads: Indices) -> list[list[int]]:
    """Closed loops of segment indices; in a watertight mesh each cut edge starts one segment and ends one."""
    start_of = {(int(a), int(b)): i for i, (a, b) in enumerate(tails)}
    following = [start_of[int(a), int(b)] for a, b in heads]
    seen: set[int] = set()
    loops = []
    for first in range(len(following)):
        if first in seen:
            continue
        loop = [first]
        while (step := following[loop[-1]]) != first:
            loop.append(step)
        seen.update(loop)
        loops.append(loop)
    return loops
