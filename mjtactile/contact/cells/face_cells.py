"""Contact cells of flat faces, made and held by the compiled core: a narrow ring along the outline, squares inside."""

from __future__ import annotations

import ctypes

import numpy as np
import numpy.typing as npt
import shapely

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.errors import ContactError
from mjtactile.geometry.planar import polygons_of
from mjtactile.influence.surface_load import Area


class CoreCells:
    """Cells of an outline as the core holds them.

    Attributes:
        handle: what the core's functions take.
    """

    def __init__(self, handle: int) -> None:
        self.handle = ctypes.c_void_p(handle)
        self._free = library().mjt_face_cells_free

    def __del__(self) -> None:
        self._free(self.handle)


def placed_cells(outline: Area, count: int) -> tuple[CoreCells, Array]:
    """About `count` cells that fill an outline, and where they stand: x, y [m] and an angle [rad], (3,).

    Outlines that differ by a shift and a rotation only, as those of one moving punch do, share their cells: squares
    lie along the outline's own direction.

    Raises:
        ContactError: where the outline is too narrow to have any.
    """
    (begins, corners), place = rings_of(outline), np.empty(3)
    handle = library().mjt_placed_cells(
        ctypes.c_size_t(len(begins) - 1), pointer(begins), pointer(corners), ctypes.c_size_t(count), pointer(place)
    )
    if handle is None:
        raise ContactError("the outline is too narrow for contact cells. shapely.make_valid mends what crosses itself.")
    return CoreCells(handle), place


def rings_of(outline: Area) -> tuple[npt.NDArray[np.uintp], Array]:
    """Rings of an outline as the core takes them: where each begins, (rings + 1,), and all corners, (corners, 2) [m].

    Outer rings run counter-clockwise, holes clockwise.
    """
    parts = polygons_of(outline)
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    if len(rings) == 1:  # most outlines, and arrays of one are slow
        alone = shapely.get_coordinates(rings[0])[:-1]
        return np.array([0, len(alone)], dtype=np.uintp), contiguous(alone if rings[0].is_ccw else alone[::-1])
    outer = [k == 0 for part in parts for k in range(1 + len(part.interiors))]
    coordinates, ring_of = shapely.get_coordinates(rings, return_index=True)
    ends = np.searchsorted(ring_of, np.arange(1, len(rings) + 1))
    begins = np.zeros(len(rings) + 1, dtype=np.uintp)
    begins[1:] = ends - np.arange(1, len(rings) + 1)  # the last corner of each ring is its first
    for k in np.flatnonzero(shapely.is_ccw(rings) != outer):
        begin = ends[k - 1] if k else 0
        coordinates[begin : ends[k] - 1] = coordinates[begin : ends[k] - 1][::-1]
    return begins, np.delete(coordinates, ends - 1, axis=0)
