"""Outer surfaces fitted to meshes: cast vertical rays onto the mesh and fit a smoothing spline to the points hit.

A facet's corners lie on the intended surface, but its interior lies inside a convex surface. A point hit by a ray is
therefore moved outwards by the curvature that the normals at the facet's corners imply (Boubekeur and Alexa, Phong
tessellation, ACM Trans. Graph. 27, 2008; with the factor 1/2, which is exact for spheres to the second order of the
facet's size).

The spline is quintic, so that curvatures are smooth. Smoothing follows P. Dierckx, Curve and Surface Fitting with
Splines (1993), chapter 5, as in SciPy: as few knots as keep the root mean square distance between patch and mesh within
the given bound.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile._files import why_unread
from mjtactile._types import Array, Indices
from mjtactile.errors import PadError, shortened
from mjtactile.pad_shape.surfaces import SurfacePatch, positive_number
from mjtactile.units import real_numbers

if TYPE_CHECKING:
    import trimesh

#: Number of rays along each axis of the rectangle.
_RAYS = 97
#: Margin of the fit around the rectangle where the mesh extends that far, over the rectangle's width [-].
_MARGIN = 0.04
#: Degree of the splines.
_DEGREE = 5
#: Default smoothing over the root mean square distance by which hits were moved off their facets [-].
_OF_FACETS = 0.1
#: Fraction of the distance to the tangent planes at a facet's corners by which a hit is moved [-].
_MOVED = 0.5
#: Facets that meet at a larger angle form a real edge, not a smooth surface [deg].
_CREASE = 30.0
#: Facets shorter than this fraction of another do not bend it: a long one, as on a cylinder between two domes, is
#: straight, although short ones that meet its ends lean [-].
_MUCH_SHORTER = 1 / 3
#: Least smoothing over the rectangle's width [-], far above rounding errors.
_LEAST_SMOOTHING = 1e-6
#: Largest distance between patch and mesh over the rectangle's width [-]; a larger one means a step, an edge or a fold.
_MOST_DEVIATION = 0.02
#: Largest distance of a frame's origin from the mesh over the rectangle's width [-]: half a millimetre on 10 mm. Frames
#: placed by eye, or those of a drawing on a scan, are off by less; one in a finger's middle or on another side by more.
_MOST_OFFSET = 0.05
#: Largest extent of a mesh [m]; a larger one is probably not in metres.
_LARGEST_MESH = 5.0
_SCALE = "metres per unit of the mesh: 1e-3 for millimetres"
#: Tolerance on the orthonormality of a frame's axes [-].
_FRAME_TOLERANCE = 1e-6


def fitted_patch(
    mesh: str | Path | trimesh.Trimesh,
    size: tuple[float, float],
    *,
    frame: npt.ArrayLike | None = None,
    scale: float = 1.0,
    smoothing: float | None = None,
) -> SurfacePatch:
    """A smooth patch through the upper side of a mesh over a rectangle.

    Args:
        mesh: file that trimesh reads, or a mesh.
        size: width of the rectangle along (x, y) of the frame [m].
        frame: pose (4, 4) of the rectangle's frame in the mesh's frame, in metres; None for the mesh's own frame. Its
            origin is on the mesh, or off it by at most a twentieth of the rectangle's width.
        scale: metres per unit of the mesh.
        smoothing: allowed root mean square distance between patch and mesh [m]; None for a tenth of the distance by
            which hits were moved off their facets.

    Returns:
        The patch; its `deviation` is the largest distance from the mesh over the rectangle [m].

    Raises:
        FileNotFoundError: when there is no such file.
        PadError: when the mesh cannot be read, has a hole under the rectangle, or is not smooth there, or the frame is
            off it; the message says where.
    """
    triangles = _triangles_in_frame(mesh, frame, scale)
    lines = [_ray_line(triangles[..., axis], extent) for axis, extent in enumerate(size)]
    heights, owner = _top_heights(triangles, *lines)
    _refuse_holes(heights, lines, triangles)
    _refuse_far_surface(heights, size)
    raised = _raised(triangles, heights, owner, lines)
    if smoothing is None:
        facets = float(np.sqrt(np.mean((raised - heights) ** 2)))
        smoothing = max(_OF_FACETS * facets, _LEAST_SMOOTHING * max(size))
    else:
        expected = "a positive length in metres, such as 1e-5, up to the pad's width"
        smoothing = positive_number("smoothing", smoothing, expected)
        if smoothing > max(size):
            raise PadError(f"smoothing = {smoothing:g}; expected {expected}, {max(size):g} m.")
    return _measured(_spline(lines, raised, smoothing), lines, heights, size)


def _triangles_in_frame(mesh: Any, frame: npt.ArrayLike | None, scale: float) -> Array:
    """Corners of the mesh's triangles in the frame [m], shape (triangles, 3, 3)."""
    import trimesh

    name = "the mesh"
    if isinstance(mesh, str | Path):
        path = Path(mesh)
        name = str(path)
        try:
            found = path.is_file()
        except OSError as error:  # such as a name too long for any file
            raise PadError(
                f"{shortened(name)} cannot be read as a mesh: {why_unread(error)}. Give the file of one, such as an "
                "STL."
            ) from error
        if not found:
            raise FileNotFoundError(f"{path} is no file. Give the file of a mesh, such as an STL.")
        try:
            mesh = trimesh.load(path, force="mesh", process=False)  # processing drops facets with NaN silently
        except Exception as error:  # readers of file formats raise many types
            raise PadError(f"{path} cannot be read as a mesh: {error}. Export it as STL, OBJ or PLY.") from error
        if isinstance(mesh, trimesh.Trimesh) and not len(mesh.faces):
            raise PadError(f"{path} holds no triangles: it is empty, truncated, or not a mesh. Export it again.")
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise PadError(
            f"the mesh is of type {type(mesh).__name__}; expected a trimesh.Trimesh with triangles, or the name of a "
            "file, such as an STL. A scene's parts are joined when its file is named."
        )
    corners = np.asarray(mesh.triangles, dtype=float) * positive_number("scale", scale, _SCALE)
    wrong = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
    if len(wrong):
        raise PadError(
            f"{name} has corners that are not finite in {len(wrong)} of {len(corners)} triangles, the first in "
            f"triangle {int(wrong[0])}. Repair the mesh, or export it again."
        )
    across = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    if across > _LARGEST_MESH:
        raise PadError(
            f"{name} is {across:.4g} m across; expected lengths in metres. If those are millimetres, pass scale=1e-3."
        )
    if frame is None:
        return corners
    pose = real_numbers(frame)
    if pose is None:
        raise PadError(f"frame = {str(frame)[:60]!r}; expected a pose (4, 4) of numbers.")
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise PadError(f"frame has shape {pose.shape}; expected a pose (4, 4) with finite numbers.")
    axes = pose[:3, :3]
    if np.abs(axes.T @ axes - np.eye(3)).max() > _FRAME_TOLERANCE or np.linalg.det(axes) < 0.0:
        raise PadError(
            "the axes of the frame are not orthonormal and right-handed; expected a rotation and a position."
        )
    return (corners - pose[:3, 3]) @ axes


def _ray_line(along: Array, extent: float) -> Array:
    """Coordinates of the rays along one axis [m]: over the rectangle and, where the mesh extends that far, a margin."""
    half, margin = extent / 2, _MARGIN * extent
    reach = min(half + margin, float(along.max()), -float(along.min()))
    return np.linspace(-1.0, 1.0, _RAYS) * (reach if reach >= half else half)


def _top_heights(triangles: Array, x: Array, y: Array) -> tuple[Array, Indices]:
    """First hits of vertical rays from above: heights [m] and triangle indices, both (rays y, rays x).

    A ray without a hit has NaN and -1. trimesh's own ray casting needs rtree. These rays are vertical and on a grid, so
    the bounds of a triangle give the rays that may hit it.
    """
    heights = np.full((len(y), len(x)), -np.inf)
    owner = np.full(heights.shape, -1)
    slack = 1e-9
    spans = []
    for line, axis in ((x, 0), (y, 1)):
        width = slack * (line[-1] - line[0])
        spans.append(np.searchsorted(line, triangles[..., axis].min(axis=1) - width))
        spans.append(np.searchsorted(line, triangles[..., axis].max(axis=1) + width, side="right"))
    wide, deep = spans[1] - spans[0], spans[3] - spans[2]
    for number in np.flatnonzero((wide > 0) & (deep > 0)).tolist():
        columns, rows = slice(spans[0][number], spans[1][number]), slice(spans[2][number], spans[3][number])
        a, b, c = triangles[number]
        doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if doubled == 0.0:
            continue
        px, py = x[None, columns], y[rows, None]
        of_b = ((px - a[0]) * (c[1] - a[1]) - (py - a[1]) * (c[0] - a[0])) / doubled
        of_c = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / doubled
        height = a[2] + of_b * (b[2] - a[2]) + of_c * (c[2] - a[2])
        inside = (of_b >= -slack) & (of_c >= -slack) & (of_b + of_c <= 1 + slack)
        better = inside & (height > heights[rows, columns])
        heights[rows, columns] = np.where(better, height, heights[rows, columns])
        owner[rows, columns] = np.where(better, number, owner[rows, columns])
    return np.where(owner >= 0, heights, np.nan), owner


def _refuse_far_surface(heights: Array, size: tuple[float, float]) -> None:
    """Refuse a frame whose origin is off the surface, as with one in a body's middle, or a mesh that is upside down."""
    middle = float(heights[heights.shape[0] // 2, heights.shape[1] // 2])
    if abs(middle) > _MOST_OFFSET * max(size):
        raise PadError(
            f"over the frame's origin the mesh's upper side stands at z = {1e3 * middle:.4g} mm, but the origin is the "
            f"middle of the pad's surface and may be off it by {1e3 * _MOST_OFFSET * max(size):.4g} mm. Move the frame "
            f"by {1e3 * middle:.4g} mm along its z. If that is the wrong side of the mesh, it is upside down: z points "
            "out of the finger."
        )


def _refuse_holes(heights: Array, lines: list[Array], triangles: Array) -> None:
    missing = np.isnan(heights)
    if not missing.any():
        return
    x, y = np.meshgrid(*lines)
    place = np.unravel_index(np.argmin(np.where(missing, np.hypot(x, y), np.inf)), heights.shape)
    raise PadError(
        f"the mesh has nothing over x = {1e3 * x[place]:.4g} mm, y = {1e3 * y[place]:.4g} mm: it has a hole there, "
        f"or ends. {int(missing.sum())} of {missing.size} rays hit nothing. In the frame the mesh reaches "
        f"{_reaches(triangles)}. Move the frame, whose z points out of the pad; or give a smaller size; or, if the "
        "mesh is in millimetres, give scale=1e-3."
    )


def _reaches(triangles: Array) -> str:
    """The extent of a mesh as text for an error message."""
    low, high = 1e3 * triangles.min(axis=(0, 1)), 1e3 * triangles.max(axis=(0, 1))
    return ", ".join(f"from {name} = {a:.4g} to {b:.4g} mm" for name, a, b in zip("xyz", low, high, strict=True))


def _raised(triangles: Array, heights: Array, owner: Indices, lines: list[Array]) -> Array:
    """Heights moved off the facets, onto the smooth surface through their corners."""
    x, y = np.meshgrid(*lines)
    places = np.stack([x, y, heights], axis=-1).reshape(-1, 3)
    hit, of_ray = np.unique(owner, return_inverse=True)
    normals = _corner_normals(triangles, hit)[of_ray.ravel()]
    normals = normals * np.where(normals[..., 2:] < 0.0, -1.0, 1.0)  # facets hit from above face up
    corners = triangles[owner.ravel()]
    shares = _barycentric(corners, places)
    away = np.einsum("pci,pci->pc", corners - places[:, None], normals)
    moved = _MOVED * np.einsum("pc,pc,pci->pi", shares, away, normals)
    upright = np.einsum("pc,pci->pi", shares, normals)
    # The displacement along the normal, as a change of height at the same (x, y).
    lifted = np.einsum("pi,pi->p", moved, upright) / np.where(upright[:, 2] > 0.0, upright[:, 2], np.inf)
    return heights + lifted.reshape(heights.shape)


def _barycentric(corners: Array, places: Array) -> Array:
    """Barycentric coordinates of points in their triangles, seen from above, shape (points, 3)."""
    a, b, c = (corners[:, k, :2] for k in range(3))
    p = places[:, :2]

    def doubled(u: Array, v: Array) -> Array:
        return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]

    whole = doubled(b - a, c - a)
    of_b, of_c = doubled(p - a, c - a) / whole, doubled(b - a, p - a) / whole
    return np.stack([1.0 - of_b - of_c, of_b, of_c], axis=1)


def _corner_normals(triangles: Array, chosen: Indices) -> Array:
    """Unit normals (chosen, 3 corners, 3) of the surface at the corners of some triangles.

    Facets that share the corner are averaged with weights equal to their angles at it (Thuermer and Wuethrich,
    Computing vertex normals from polygonal facets, J. Graphics Tools 3, 1998), except across creases and much shorter
    ones.
    """
    from scipy.sparse import csr_array

    rounded = np.round(triangles.reshape(-1, 3) / (1e-9 * max(float(np.abs(triangles).max()), 1e-12)))
    _, vertex = np.unique(rounded, axis=0, return_inverse=True)
    vertex = vertex.ravel()
    sides = np.roll(triangles, -1, axis=1) - triangles
    lengths = np.linalg.norm(sides, axis=-1)
    normals = np.cross(sides[:, 0], sides[:, 1])
    areas = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(areas > 0.0, areas, 1.0)[:, None]
    product = lengths * np.roll(lengths, 1, axis=1)
    cosine = -np.einsum("fci,fci->fc", sides, np.roll(sides, 1, axis=1)) / np.where(product > 0.0, product, 1.0)
    angles = np.arccos(np.clip(cosine, -1.0, 1.0)).ravel()
    # Pairs of a chosen triangle's corner and a facet's corner at the same vertex.
    wanted = (3 * chosen[:, None] + np.arange(3)).ravel()
    count = int(vertex.max()) + 1
    of_vertex = csr_array((np.ones(len(vertex)), (vertex, np.arange(len(vertex)))), shape=(count, len(vertex)))
    pairs = of_vertex[vertex[wanted]].tocoo()
    own, other = wanted[pairs.row] // 3, pairs.col // 3
    # Facets may be wound either way, as in a mirrored mesh.
    aligned = np.einsum("pi,pi->p", normals[own], normals[other])
    longest = lengths.max(axis=1)
    alike = longest[other] >= _MUCH_SHORTER * longest[own]
    smooth = alike & (np.abs(aligned) > np.cos(np.radians(_CREASE)))
    weights = angles[pairs.col] * smooth * np.sign(aligned)
    sums = np.zeros((len(wanted), 3))
    np.add.at(sums, pairs.row, weights[:, None] * normals[other])
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    found = np.where(length > 0.0, sums / np.where(length > 0.0, length, 1.0), normals[wanted // 3])
    return found.reshape(len(chosen), 3, 3)


def _spline(lines: list[Array], heights: Array, smoothing: float) -> SurfacePatch:
    from scipy.interpolate import RectBivariateSpline

    x, y = lines
    spline = RectBivariateSpline(
        x,
        y,
        np.ascontiguousarray(heights.T),
        kx=_DEGREE,
        ky=_DEGREE,
        s=heights.size * smoothing**2,  # type: ignore[arg-type]  # its stubs say int
    )
    knots_x, knots_y = spline.get_knots()
    shape = len(knots_x) - _DEGREE - 1, len(knots_y) - _DEGREE - 1
    return SurfacePatch(tuple(knots_x), tuple(knots_y), spline.get_coeffs().reshape(shape), _DEGREE)


def _measured(patch: SurfacePatch, lines: list[Array], heights: Array, size: tuple[float, float]) -> SurfacePatch:
    """The patch with its deviation from the hits, after checking that the deviation is small enough."""
    x, y = np.meshgrid(*lines)
    away = np.abs(patch.height(x, y) - heights) / patch.stretch(x, y)
    away = np.where((np.abs(x) <= size[0] / 2) & (np.abs(y) <= size[1] / 2), away, 0.0)
    place = np.unravel_index(np.argmax(away), away.shape)
    deviation = float(away[place])
    if deviation > _MOST_DEVIATION * max(size):
        raise PadError(
            f"the mesh is no smooth graph over the rectangle: at x = {1e3 * x[place]:.4g} mm, y = {1e3 * y[place]:.4g} "
            f"mm a smooth patch is {1e3 * deviation:.4g} mm away from it. It folds there, or has a step or an edge, or "
            "smoothing is too large. Move or turn the frame, whose z points out of the pad, or give a smaller size."
        )
    return SurfacePatch(patch.knots_x, patch.knots_y, patch.coefficients, patch.degree, deviation)
