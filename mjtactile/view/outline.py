"""Contact outline of a pad, computed fast enough for every frame of the page."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.influence.surface_load import SurfaceLoad

#: The outline is the contour at the first fraction of the mean vertex force [-]. The mean is over the vertices with
#: more than the second fraction of the largest force. A vertex on a straight edge of the contact carries half the mean
#: force, because half of the area around it is under pressure.
_LEVEL, _BEARS = 0.5, 0.1


def pressed_outline(load: SurfaceLoad | None) -> Array:
    """Line segments around the area under pressure of a load, pad frame [m], (segments, 2, 2); none without a load.

    The lines are accurate to a cell of the surface grid. `SurfaceLoad.contact` is accurate to a contact cell, but takes
    several times as long.
    """
    from contourpy import contour_generator

    if load is None:
        return np.empty((0, 2, 2))
    x, y = load.surface.x.vertices, load.surface.y.vertices
    # Forces at mid-side nodes are larger than at corners under any pressure, so they are moved to the corners first.
    pressing = _about_vertices(np.maximum(-load.forces[..., 2], 0.0))
    if not pressing.any():
        return np.empty((0, 2, 2))
    level = _LEVEL * float(pressing[pressing > _BEARS * pressing.max()].mean())
    # A frame of zeros closes lines that reach the sheet's edge.
    wide_x, wide_y = np.concatenate([x[:1], x, x[-1:]]), np.concatenate([y[:1], y, y[-1:]])
    lines = contour_generator(wide_x, wide_y, np.pad(pressing, 1)).lines(level)
    segments = [np.stack([line[:-1], line[1:]], axis=1) for line in map(np.asarray, lines)]
    return np.concatenate(segments) if segments else np.empty((0, 2, 2))


def _about_vertices(nodal: Array) -> Array:
    """Forces of vertices (n + 1, m + 1) from those of nodes (2 n + 1, 2 m + 1); mid-side nodes are split in halves."""
    for _ in range(2):
        whole, between = nodal[::2].copy(), nodal[1::2] / 2
        whole[:-1] += between
        whole[1:] += between
        nodal = whole.T
    return nodal
