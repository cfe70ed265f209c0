"""What of a body faces a curved pad, seen from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import MultiPolygon, Polygon

from mjtactile._types import Array
from mjtactile.errors import FootprintError
from mjtactile.geometry.contour import region_below
from mjtactile.geometry.primitives import Pose, Shape
from mjtactile.pad import Pad

#: Points along each axis at which the first touch is looked for.
_LOOKS = 129


def curved_outline(shapes: Sequence[tuple[Shape, Pose]], pad: Pad, *, facing_gap: float) -> Polygon | MultiPolygon:
    """Where a body stands no further than `facing_gap` over the outer surface, seen from its first touch [m].

    Gaps are vertical ones times the cosine of the surface's slope: near a touch, as far along the normal.

    Args:
        shapes: of the body, with their poses in the pad frame.
        pad: curved.
        facing_gap: what is no further than this above the first touch faces the pad [m].

    Raises:
        FootprintError: nothing of the body is over the pad within its thickness.
    """
    x, y = (np.linspace(-side / 2, side / 2, _LOOKS) for side in pad.size)
    u, v = (line.ravel() for line in np.meshgrid(x, y))
    floor = float(pad.surface.height(u, v).min()) - pad.thickness

    def gap(x: Array, y: Array) -> Array:
        lower = np.minimum.reduce([shape.heights(pose, x, y, floor) for shape, pose in shapes])
        return (lower - pad.surface.height(x, y)) * pad.surface.normals(x, y)[..., 2]

    touch = float(gap(u, v).min())
    if not touch <= pad.thickness:
        raise FootprintError("nothing of it is over the surface. Press further in from the edge.")
    return region_below(gap, touch + facing_gap, (x[0], y[0], x[-1], y[-1]))
