"""Contact outline of a pad, computed fast enough for every frame of the page."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.influence.surface_load import SurfaceLoad

#: The line runs where vertices bear half of what they bear on the average, of those that bear more than a tenth of the
#: largest: a vertex on a straight edge of what presses has half its surroundings under it.
_LEVEL, _BEARS = 0.5, 0.1


def pressed_outline(load: SurfaceLoad | None) -> Array:
    """Line segments around the nodes that are pressed (segments, 2, 2) [m], pad frame.

    The line lies within a cell of the surface grid of the true one, which `TactileSensor.outline` finds in some tens of
    milliseconds.

    Args:
        load: on the pad; None without contact.
    """
    from contourpy import contour_generator

    if load is None:
        return np.empty((0, 2, 2))
    x, y = load.surface.x.vertices, load.surface.y.vertices
    # Nodes in the middle of elements bear more than those on corners, whatever presses: whole cells are compared.
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
    """Forces of nodes (2 n + 1, 2 m + 1), halves of those between vertices given to either, (n + 1, m + 1)."""
    for _ in range(2):
        whole, between = nodal[::2].copy(), nodal[1::2] / 2
        whole[:-1] += between
        whole[1:] += between
        nodal = whole.T
    return nodal
