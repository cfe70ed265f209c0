"""Contact cells of flat faces, made by the compiled core: a narrow ring along the outline, squares inside."""

from __future__ import annotations

import ctypes

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.errors import ContactError
from mjtactile.geometry.planar import polygons_of
from mjtactile.influence.surface_load import Area


class CoreCells:
    """Cells of an outline in the compiled core."""

    def __init__(self, handle: int) -> None:
        self.handle = ctypes.c_void_p(handle)  #: pointer to the core's object, an argument of the core's functions
        self._free = library().mjt_face_cells_free

    def __del__(self) -> None:
        self._free(self.handle)


def placed_cells(outline: Area, count: int, widest: float = 0.0) -> tuple[CoreCells, Array]:
    """About `count` cells that fill an outline, and their placement: x, y [m] and angle [rad], (3,).

    There are more, up to 200, where cells would be wider than `widest` on the average [m]; 0 stands for any width.

    Outlines that differ by a shift and a rotation only, such as those of a moving punch, share their cells, which are
    aligned with the outline.

    Raises:
        ContactError: the outline is too narrow for any cell, or crosses itself.
    """
    (begins, corners), place = rings_of(outline), np.empty(3)
    handle = library().mjt_placed_cells(
        ctypes.c_size_t(len(begins) - 1),
        pointer(begins),
        pointer(corners),
        ctypes.c_size_t(count),
        ctypes.c_double(widest),
        pointer(place),
    )
    if handle is None:
        raise ContactError(
            "the outline is too narrow for contact cells, or it crosses itself. Give a wider one, or mend it with "
            "shapely.make_valid."
        )
    return CoreCells(handle), place


def rings_of(outline: Area) -> tuple[npt.NDArray[np.uintp], Array]:
    """Rings of an outline for the core: index of each ring's first corner, (rings + 1,), and corners, (corners, 2) [m].

    Outer rings run counter-clockwise, holes clockwise.
    """
    if isinstance(outline, Polygon) and not outline.interiors:  # the usual case, without lists of one ring
        alone = shapely.get_coordinates(outline)[:-1]
        return np.array([0, len(alone)], dtype=np.uintp), contiguous(alone if outline.exterior.is_ccw else alone[::-1])
    parts = polygons_of(outline)
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    outer = [k == 0 for part in parts for k in range(1 + len(part.interiors))]
    coordinates, ring_of = shapely.get_coordinates(rings, return_index=True)
    ends = np.searchsorted(ring_of, np.arange(1, len(rings) + 1))
    begins = np.zeros(len(rings) + 1, dtype=np.uintp)
    begins[1:] = ends - np.arange(1, len(rings) + 1)  # the last corner of each ring is its first
    for k in np.flatnonzero(shapely.is_ccw(rings) != outer):
        begin = ends[k - 1] if k else 0
        coordinates[begin : ends[k] - 1] = coordinates[begin : ends[k] - 1][::-1]
    return begins, np.delete(coordinates, ends - 1, axis=0)
