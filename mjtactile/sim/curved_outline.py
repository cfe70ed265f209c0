"""The part of a body that faces a curved pad, seen from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import MultiPolygon, Polygon

from mjtactile._types import Array
from mjtactile.errors import FootprintError
from mjtactile.geometry.contour import region_below
from mjtactile.geometry.primitives import Pose, Shape
from mjtactile.pad import Pad

#: Number of points along each axis of the grid on which the first contact point is searched.
_SAMPLES = 129


def curved_outline(shapes: Sequence[tuple[Shape, Pose]], pad: Pad, *, facing_gap: float) -> Polygon | MultiPolygon:
    """Outline in the pad frame's x-y plane [m] of the part of a body that faces a curved pad.

    There the body's gap to the pad is at most `facing_gap` larger than its least gap. A gap is the vertical distance
    times the cosine of the surface's slope, which is close to the distance along the normal.

    Args:
        shapes: shapes of the body, with their poses in the pad frame.
        pad: a curved pad.
        facing_gap: parts up to this distance above the first contact point face the pad [m].

    Raises:
        FootprintError: no part of the body is over the pad within the pad's thickness.
    """
    x, y = (np.linspace(-side / 2, side / 2, _SAMPLES) for side in pad.size)
    u, v = (line.ravel() for line in np.meshgrid(x, y))
    floor = float(pad.surface.height(u, v).min()) - pad.thickness

    def gap(x: Array, y: Array) -> Array:
        lower = np.minimum.reduce([shape.heights(pose, x, y, floor) for shape, pose in shapes])
        return (lower - pad.surface.height(x, y)) * pad.surface.normals(x, y)[..., 2]

    touch = float(gap(u, v).min())
    if not touch <= pad.thickness:
        raise FootprintError("nothing of it is over the surface. Press further in from the edge.")
    return region_below(gap, touch + facing_gap, (x[0], y[0], x[-1], y[-1]))
