"""The solid of a curved pad as meshes that MuJoCo can collide: convex pieces, together as thick as the pad.

MuJoCo collides the convex hull of a mesh. If the outer surface is convex, such as a dome, the hull coincides with it
and fills only the hollow on the inner side. A surface with hollows is cut along x and y into pieces whose hulls are
close to it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mjtactile._types import Array, Indices
from mjtactile.pad import Pad

#: Largest distance between a convex surface and the chords between its vertices [m]. On a dome of radius 12 mm,
#: vertices are 0.44 mm apart, and the normals of neighbouring facets differ by 2 degrees.
SAGITTA = 2e-6
#: Largest height of a piece's hull over a hollow [m], and largest number of pieces. If a pad needs more pieces, the
#: height is doubled until it does not.
PROUD, MOST_PIECES = 2e-5, 64
#: Largest number of cells along a side of a pad; it takes precedence over `SAGITTA`.
_MOST_CELLS = 64
#: Number of points along each axis at which a surface is sampled.
_SAMPLES = 25


class Solid(NamedTuple):
    """A closed mesh in the pad frame."""

    vertices: Array  #: (n, 3) [m]
    faces: Indices  #: (m, 3), counter-clockwise from outside


class PadSolid(NamedTuple):
    """A pad as meshes."""

    pieces: tuple[Solid, ...]  #: side by side; one for a pad with a convex surface
    proud: float  #: largest height of their hulls over the outer surface [m]


class _Part(NamedTuple):
    """A rectangle of the projection [m]."""

    west: float
    south: float
    east: float
    north: float


@lru_cache(maxsize=64)
def pad_solid(pad: Pad) -> PadSolid:
    """The solid of a pad as meshes, swept along its normals.

    They are as few pieces as possible with hulls within `PROUD` of the surface, but at most `MOST_PIECES`.
    """
    x, y = pad.size[0] / 2, pad.size[1] / 2
    proud = PROUD
    while True:
        parts = _parts(pad, _Part(-x, -y, x, y), proud)
        if len(parts) <= MOST_PIECES:
            return PadSolid(tuple(_swept(pad, part) for part, _ in parts), max(over for _, over in parts))
        proud *= 2.0


def rise(pad: Pad) -> float:
    """Height of the highest point of a pad's meshes over the origin of its frame [m]; 0 if no point is higher."""
    return max(0.0, *(float(piece.vertices[:, 2].max()) for piece in pad_solid(pad).pieces))


def _parts(pad: Pad, part: _Part, proud: float) -> list[tuple[_Part, float]]:
    """Parts whose hulls are at most `proud` above the surface, with that height for each part [m]."""
    over = _hull_over_surface(pad, part)
    if over <= proud:
        return [(part, over)]
    x, y = _sample_points(part)
    jet = pad.surface.jet(x, y)
    width, length = part.east - part.west, part.north - part.south
    # If the surface is hollow along one axis only, cuts across that axis give convex pieces.
    hollow = max(float(jet.xx.max()), 0.0) * width**2, max(float(jet.yy.max()), 0.0) * length**2
    across_x = hollow[0] > hollow[1] if hollow[0] != hollow[1] else width >= length
    if across_x:
        middle = (part.west + part.east) / 2
        halves = part._replace(east=middle), part._replace(west=middle)
    else:
        middle = (part.south + part.north) / 2
        halves = part._replace(north=middle), part._replace(south=middle)
    found: list[tuple[_Part, float]] = []
    for half in halves:
        found += _parts(pad, half, proud)
        if len(found) > MOST_PIECES:
            break
    return found


def _sample_points(part: _Part) -> tuple[Array, Array]:
    """Coordinates x and y of a grid of points over a part [m], (_SAMPLES, _SAMPLES) each."""
    x, y = np.linspace(part.west, part.east, _SAMPLES), np.linspace(part.south, part.north, _SAMPLES)
    grid = np.meshgrid(x, y, indexing="ij")
    return grid[0], grid[1]


def _hull_over_surface(pad: Pad, part: _Part) -> float:
    """Largest height of the convex hull of a part of the outer surface above it, along the normal [m]."""
    x, y = _sample_points(part)
    jet = pad.surface.jet(x, y)
    if (jet.xx <= 0.0).all() and (jet.xx * jet.yy >= jet.xy**2).all():
        return 0.0
    from scipy.spatial import ConvexHull, QhullError

    z = jet.z
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    # An additional point far below gives the hull a volume even if the part is plane.
    below = np.array([[points[:, 0].mean(), points[:, 1].mean(), z.min() - (part.east - part.west)]])
    try:
        planes = ConvexHull(np.concatenate([points, below])).equations
    except QhullError:  # no extent along some axis: the height is zero
        return 0.0
    upper = planes[planes[:, 2] > 0.0]
    heights = -(points[:, :2] @ upper[:, :2].T + upper[:, 3]) / upper[:, 2]
    upright = pad.surface.normals(x, y)[..., 2].ravel()
    return float(np.max((heights.min(axis=1) - points[:, 2]) * upright, initial=0.0))


def _swept(pad: Pad, part: _Part) -> Solid:
    """A part of the outer surface, swept inwards to the base: a closed mesh over a rectangular grid."""
    x, y = _lines(pad, part)
    u, v = np.meshgrid(x, y, indexing="ij")
    outer, inner = (pad.surface.positions(u, v, depth).reshape(-1, 3) for depth in (0.0, pad.thickness))
    columns, rows = len(x), len(y)
    number = np.arange(columns * rows).reshape(columns, rows)
    here, right, up, across = (a.ravel() for a in (number[:-1, :-1], number[1:, :-1], number[:-1, 1:], number[1:, 1:]))
    top = np.concatenate([np.column_stack([here, right, across]), np.column_stack([here, across, up])])
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    after, below = np.roll(rim, -1), columns * rows
    walls = np.concatenate(
        [np.column_stack([rim, rim + below, after + below]), np.column_stack([rim, after + below, after])]
    )
    return Solid(np.concatenate([outer, inner]), np.concatenate([top, top[:, ::-1] + below, walls]))


def _lines(pad: Pad, part: _Part) -> tuple[Array, Array]:
    """Coordinates of the vertices along x and y [m], as close as `SAGITTA` requires."""
    x, y = _sample_points(part)
    jet = pad.surface.jet(x, y)
    upright = pad.surface.normals(x, y)[..., 2]
    lines = []
    for low, high, whole, bend in (
        (part.west, part.east, pad.size[0], np.abs(jet.xx) + np.abs(jet.xy)),
        (part.south, part.north, pad.size[1], np.abs(jet.yy) + np.abs(jet.xy)),
    ):
        most = float((bend * upright).max())
        cells = int(np.ceil((high - low) * np.sqrt(most / (8.0 * SAGITTA))))
        lines.append(np.linspace(low, high, 1 + max(1, min(cells, round(_MOST_CELLS * (high - low) / whole)))))
    return lines[0], lines[1]
