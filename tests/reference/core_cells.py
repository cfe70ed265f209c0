"""Contact cells of the core as arrays, to be looked at: only tests do."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.contact.cells.face_cells import CoreCells, rings_of
from mjtactile.contact.press import Press
from mjtactile.geometry.planar import areal
from mjtactile.influence.surface_load import Area


@dataclass(frozen=True, eq=False)
class FaceCells:
    """Cells that fill an outline.

    Attributes:
        centroids: of the cells, (cells, 2) [m].
        areas: (cells,) [m^2].
        inverse_distance: integrals of 1/r over pairs of cells, (cells, cells) [m^3].
        edges: between cells, each once, (edges, 2 ends, 2) [m].
        sides: cells to the left and right of each edge, (edges, 2); -1 for none.
        corners: of the outline's convex hull, counter-clockwise, (corners, 2) [m].
        hull: convex hull of the centroids, counter-clockwise, (corners, 2) [m].
        quadrature: points whose mean integrates quadratic functions over each cell, (cells, 4, 2) [m].
        convex: whether the outline's hull is all of it.
        length: root of the area [m].
    """

    centroids: Array
    areas: Array
    inverse_distance: Array
    edges: Array
    sides: npt.NDArray[np.int32]
    corners: Array
    hull: Array
    quadrature: Array
    convex: bool
    length: float

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.areas)

    def steps(self, tractions: Array) -> Array:
        """Steps of tractions (cells, components) across the edges, from right to left, (edges, components)."""
        padded = np.concatenate([tractions, np.zeros((1, tractions.shape[1]))])
        return padded[self.sides[:, 0]] - padded[self.sides[:, 1]]


def face_cells(outline: Area, count: int, angle: float = 0.0) -> FaceCells | None:
    """About `count` cells that fill an outline; None where it encloses nothing or crosses itself.

    Args:
        outline: polygon or polygons [m].
        count: number of cells wanted.
        angle: direction of the squares inside, counter-clockwise from the x axis [rad].
    """
    begins, corners = rings_of(outline)
    handle = library().mjt_face_cells(
        ctypes.c_size_t(len(begins) - 1),
        pointer(begins),
        pointer(corners),
        ctypes.c_size_t(count),
        ctypes.c_double(angle),
    )
    return None if handle is None else read(CoreCells(handle))


def read(cells_of_core: CoreCells) -> FaceCells:
    """Cells that the core holds, as arrays."""
    core = library()
    sizes = np.zeros(5, dtype=np.uintp)
    core.mjt_face_cells_copy(cells_of_core.handle, pointer(sizes), *[None] * 9)
    cells, edges, hull, inner_hull, convex = (int(one) for one in sizes)
    centroids, areas, integrals, ends = map(np.empty, ((cells, 2), (cells,), (cells, cells), (edges, 2, 2)))
    sides, length = np.empty((edges, 2), dtype=np.int32), np.empty(1)
    corners, middles = np.empty((hull, 2)), np.empty((inner_hull, 2))
    quadrature = np.empty((cells, 4, 2))
    arrays = (centroids, areas, integrals, ends, sides, corners, middles, quadrature, length)
    core.mjt_face_cells_copy(cells_of_core.handle, *(pointer(one) for one in (sizes, *arrays)))
    return FaceCells(
        centroids, areas, integrals, ends, sides, corners, middles, quadrature, bool(convex), float(length[0])
    )


def clip_outline(outline: Area, place: tuple[float, float, float], sheet: tuple[float, float, float, float]) -> Area:
    """An outline shifted to (x, y) [m] and turned [rad], where it lies on a sheet (west, south, east, north) [m]."""
    begins, corners = rings_of(outline)
    where, bounds = contiguous(np.array(place)), contiguous(np.array(sheet))
    room = 16 + 4 * len(corners)
    cut_begins, cut_corners = np.zeros(room, dtype=np.uintp), np.empty((room, 2))
    rings = library().mjt_clip_outline(
        ctypes.c_size_t(len(begins) - 1),
        *(pointer(one) for one in (begins, corners, where, bounds)),
        ctypes.c_size_t(room),
        pointer(cut_begins),
        pointer(cut_corners),
    )
    if rings < 0:
        raise AssertionError("each side of the sheet adds at most two corners for every corner it cuts off")
    cut = [cut_corners[cut_begins[k] : cut_begins[k + 1]] for k in range(rings)]
    outer = [Polygon(ring) for ring in cut if shapely.is_ccw(shapely.linearrings(ring))]
    holes = [Polygon(ring) for ring in cut if not shapely.is_ccw(shapely.linearrings(ring))]
    return areal(shapely.difference(shapely.union_all(outer), shapely.union_all(holes)))


class CellForces(NamedTuple):
    """Forces on the contact cells of one body, pad frame.

    Attributes:
        centroids: (cells, 2) [m].
        areas: (cells,) [m^2].
        forces: (cells, 3) [N].
        heights: of the body above each cell before it moved, (cells,) [m].
        edges: of the cells, each once, (edges, 2 ends, 2) [m].
        sides: indices of the cells to the left and right of each edge, (edges, 2); -1 for none.
    """

    centroids: Array
    areas: Array
    forces: Array
    heights: Array
    edges: Array
    sides: npt.NDArray[np.int32]


def cell_forces(press: Press) -> CellForces:
    """Forces on the cells of the first body in the last call of `press.loads`, under a law with cells."""
    core, body = library(), ctypes.c_size_t(0)
    edges = int(core.mjt_press_edges(press._handle, body, None, None))
    ends, sides = np.empty((edges, 2, 2)), np.empty((edges, 2), dtype=np.int32)
    core.mjt_press_edges(press._handle, body, pointer(ends), pointer(sides))
    count = int(sides.max()) + 1
    arrays = np.empty((count, 2)), np.empty(count), np.empty((count, 3)), np.empty(count)
    core.mjt_press_cells(press._handle, body, *map(pointer, arrays))
    return CellForces(*arrays, ends, sides)
