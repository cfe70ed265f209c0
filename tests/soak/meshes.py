"""Meshes that soak scenes press with, as vertices [m] and triangles, and as MJCF."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from mjtactile._types import Array

Triangles = npt.NDArray[np.int64]
Mesh = tuple[Array, Triangles]


def torus(middle: float, tube: float, around: int = 48, across: int = 24) -> Mesh:
    """A torus about z: radius of the tube's middle and of the tube [m]; numbers of sections."""
    turn = 2 * np.pi * np.arange(around) / around
    angle = 2 * np.pi * np.arange(across) / across
    reach = middle + tube * np.cos(angle)
    x, y = np.outer(np.cos(turn), reach), np.outer(np.sin(turn), reach)
    z = np.broadcast_to(tube * np.sin(angle), x.shape)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corner = [((i + a) % around) * across + (j + b) % across for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return _points(x, y, z), _quads(*corner)


def revolved(profile: Array, around: int = 32) -> Mesh:
    """A body of revolution about z, closed at the poles: a profile of (radius, height) [m] from bottom to top, (n, 2).

    The first and the last point are on the axis (radius 0).
    """
    turn = 2 * np.pi * np.arange(around) / around
    rings = profile[1:-1]
    x, y = np.outer(rings[:, 0], np.cos(turn)), np.outer(rings[:, 0], np.sin(turn))
    z = np.broadcast_to(rings[:, 1:], x.shape)
    vertices = np.vstack([_points(x, y, z), [0, 0, profile[0, 1]], [0, 0, profile[-1, 1]]])
    bottom, top = len(vertices) - 2, len(vertices) - 1
    k = np.arange(around)
    follows = (k + 1) % around
    faces = [np.column_stack([np.full(around, bottom), follows, k])]
    for ring in range(len(rings) - 1):
        low, high = ring * around, (ring + 1) * around
        faces.append(_quads(low + k, low + follows, high + follows, high + k))
    last = (len(rings) - 1) * around
    faces.append(np.column_stack([np.full(around, top), last + k, last + follows]))
    return vertices, np.vstack(faces)


def cone(radius: float, height: float, around: int = 32) -> Mesh:
    """A cone that stands on its point [m]."""
    return revolved(np.array([[0, 0], [radius, height], [0, height]]), around)


def ball(radius: float, rings: int = 12, around: int = 24) -> Mesh:
    """A ball [m] of triangles."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    profile = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return revolved(profile, around)


def prism(outline: Array, height: float) -> Mesh:
    """A prism over a counter-clockwise outline (n, 2) [m] that is seen whole from the origin, from z = 0 up.

    Its caps are fans from the middle, so that stars and other notched outlines are right.
    """
    count = len(outline)
    low = np.column_stack([outline, np.zeros(count)])
    vertices = np.vstack([low, low + np.array([0, 0, height]), [[0, 0, 0], [0, 0, height]]])
    k = np.arange(count)
    follows = (k + 1) % count
    below = np.column_stack([np.full(count, 2 * count), follows, k])
    above = np.column_stack([np.full(count, 2 * count + 1), count + k, count + follows])
    return vertices, np.vstack([below, above, _quads(k, follows, count + follows, count + k)])


def star(outer: float, inner: float, height: float, points: int = 5) -> Mesh:
    """A prism over a star: radii of its points and of its notches, height [m]."""
    turn = np.pi * np.arange(2 * points) / points
    radius = np.where(np.arange(2 * points) % 2 == 0, outer, inner)
    return prism(radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]), height)


def hull(points: Array) -> Mesh:
    """The convex hull of points (n, 3) [m]."""
    found = ConvexHull(points)
    faces = found.simplices.astype(np.int64)
    corner = points[faces]
    outward = np.einsum(
        "ij,ij->i", np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), found.equations[:, :3]
    )
    faces[outward < 0] = faces[outward < 0][:, ::-1]
    used = np.unique(faces)
    return points[used], np.searchsorted(used, faces)


def mjcf(name: str, mesh: Mesh, inertia: str = "convex") -> str:
    """The mesh as an asset of a model; `inertia` is "shell" for one that is open."""
    vertices, faces = mesh
    return (
        f'<mesh name="{name}" inertia="{inertia}" vertex="{" ".join(f"{x:.9g}" for x in vertices.ravel())}" '
        f'face="{" ".join(map(str, faces.ravel()))}"/>'
    )


def _points(x: Array, y: Array, z: Array) -> Array:
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def _quads(a: Triangles, b: Triangles, c: Triangles, d: Triangles) -> Triangles:
    a, b, c, d = (part.ravel() for part in (a, b, c, d))
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
