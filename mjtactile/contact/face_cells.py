"""Contact cells of flat faces as the compiled core makes them: a narrow ring along the outline, squares inside."""

from __future__ import annotations

import ctypes
import functools
import math
import weakref
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.errors import ContactError
from mjtactile.geometry.planar import areal
from mjtactile.influence.surface_load import Area

#: Outlines that agree to this fraction of their size after a rotation and a shift share one set of cells.
_SAME_SHAPE = 2e-12
#: Sets of cells kept with their half-space integrals, which take longer to make than everything else.
_KEPT_SHAPES = 64
#: Outlines of more corners count as round.
_ROUND = 60
#: Sides this near to a direction run along it [rad]; directions whose sides' lengths agree to this share are alike.
_PARALLEL, _ALIKE = 1e-3, 1e-6
#: Directions this near to the pad's axes are these [rad].
_LEVEL = 1e-9
#: Difference over sum of the principal moments of inertia above which an area is long.
_LONG = 1e-2


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
    made = CoreCells.made(*_rings(outline), count, angle)
    return None if made is None else made.read()


class CoreCells:
    """Cells of an outline as the core holds them.

    Attributes:
        handle: what the core's functions take.
    """

    def __init__(self, handle: int) -> None:
        self.handle = ctypes.c_void_p(handle)
        weakref.finalize(self, library().mjt_face_cells_free, self.handle)

    @classmethod
    def made(cls, begins: npt.NDArray[np.uintp], corners: Array, count: int, angle: float) -> CoreCells | None:
        """From rings: where they begin, (rings + 1,), and their corners; None where they enclose nothing."""
        core = library()
        handle = core.mjt_face_cells(
            ctypes.c_size_t(len(begins) - 1),
            pointer(begins),
            pointer(corners),
            ctypes.c_size_t(count),
            ctypes.c_double(angle),
        )
        return None if handle is None else cls(handle)

    def read(self) -> FaceCells:
        """The cells as arrays."""
        core = library()
        sizes = np.zeros(5, dtype=np.uintp)
        core.mjt_face_cells_sizes(self.handle, pointer(sizes))
        cells, edges, hull, inner_hull, convex = (int(one) for one in sizes)
        centroids, areas, integrals, ends = map(np.empty, ((cells, 2), (cells,), (cells, cells), (edges, 2, 2)))
        sides, length = np.empty((edges, 2), dtype=np.int32), np.empty(1)
        corners, middles = np.empty((hull, 2)), np.empty((inner_hull, 2))
        quadrature = np.empty((cells, 4, 2))
        arrays = (centroids, areas, integrals, ends, sides, corners, middles, quadrature, length)
        core.mjt_face_cells_copy(self.handle, *(pointer(one) for one in arrays))
        return FaceCells(
            centroids, areas, integrals, ends, sides, corners, middles, quadrature, bool(convex), float(length[0])
        )


def placed_cells(outline: Area, count: int) -> tuple[CoreCells, Array]:
    """About `count` cells that fill an outline, and where they stand: x, y [m] and an angle [rad], (3,).

    Outlines that differ by a shift and a rotation only, as those of one moving punch do, share their cells: squares
    lie along the outline's own direction.

    Raises:
        ContactError: where the outline is too narrow to have any.
    """
    begins, corners = _rings(outline)
    angle = own_direction(begins, corners)
    origin = corners[0]
    cosine, sine = math.cos(angle), math.sin(angle)
    # On a grid, and without negative zeros: rounding while a punch moves must not make another shape of it.
    resolution = 2.0 ** math.floor(math.log2(_SAME_SHAPE * float(np.ptp(corners, axis=0).max())))
    turn = np.array([[cosine, -sine], [sine, cosine]]) / resolution
    local = np.round((corners - origin) @ turn).astype(np.int64)
    cells = _shape_cells(begins.tobytes(), local.tobytes(), resolution, count)
    if cells is None:
        raise ContactError("the outline is too narrow for contact cells. shapely.make_valid mends what crosses itself.")
    return cells, np.array([origin[0], origin[1], angle])


@functools.lru_cache(maxsize=_KEPT_SHAPES)
def _shape_cells(begins: bytes, corners: bytes, resolution: float, count: int) -> CoreCells | None:
    local = np.frombuffer(corners, dtype=np.int64).reshape(-1, 2) * resolution
    return CoreCells.made(np.frombuffer(begins, dtype=np.uintp), contiguous(local), count, 0.0)


def own_direction(begins: npt.NDArray[np.uintp], corners: Array) -> float:
    """Angle of an outline's own axes from the pad's, within a quarter turn [rad].

    The direction along and across which the most of its sides and of its hull's run; of round outlines that of their
    length. Where several are alike, that nearest to the pad's axes.

    Args:
        begins: where its rings begin, (rings + 1,).
        corners: of the rings, (corners, 2) [m].
    """
    following = np.arange(1, len(corners) + 1)
    following[begins[1:].astype(np.int64) - 1] = begins[:-1]
    if len(corners) > _ROUND:
        return _direction_of_length(corners, corners[following])
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(corners)))
    sides = np.concatenate([corners[following] - corners, np.diff(hull, axis=0)])
    length = np.hypot(sides[:, 0], sides[:, 1])
    angles = _within_quarter(np.arctan2(sides[:, 1], sides[:, 0]))
    shared = (np.abs(_within_quarter(angles[:, None] - angles)) < _PARALLEL) @ length
    best = angles[shared >= (1.0 - _ALIKE) * shared.max()]
    angle = float(best[np.abs(best).argmin()])
    return 0.0 if abs(angle) < _LEVEL else angle


def _direction_of_length(start: Array, end: Array) -> float:
    """Principal axis of the area within edges (edges, 2), as an angle within a quarter turn; 0 where there is none."""
    middle = start.mean(axis=0)
    (x0, y0), (x1, y1) = (start - middle).T, (end - middle).T
    cross = x0 * y1 - x1 * y0
    area, x, y = cross.sum() / 2, ((x0 + x1) * cross).sum() / 6, ((y0 + y1) * cross).sum() / 6
    xx = ((x0**2 + x0 * x1 + x1**2) * cross).sum() / 12 - x * x / area
    yy = ((y0**2 + y0 * y1 + y1**2) * cross).sum() / 12 - y * y / area
    xy = ((2 * x0 * y0 + x0 * y1 + x1 * y0 + 2 * x1 * y1) * cross).sum() / 24 - x * y / area
    if math.hypot(xx - yy, 2 * xy) < _LONG * (xx + yy):
        return 0.0
    angle = float(_within_quarter(np.array(0.5 * math.atan2(2 * xy, xx - yy))))
    return 0.0 if abs(angle) < _LEVEL else angle


def _within_quarter(angles: Array) -> Array:
    return (angles + np.pi / 4) % (np.pi / 2) - np.pi / 4


def clip_outline(outline: Area, place: tuple[float, float, float], sheet: tuple[float, float, float, float]) -> Area:
    """An outline shifted to (x, y) [m] and turned [rad], where it lies on a sheet (west, south, east, north) [m]."""
    begins, corners = _rings(outline)
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


def _rings(outline: Area) -> tuple[npt.NDArray[np.uintp], Array]:
    """Where the rings begin, (rings + 1,), and their corners, outer rings counter-clockwise, holes clockwise."""
    parts = shapely.get_parts(outline)
    rings, owner = shapely.get_rings(parts, return_index=True)
    outer = np.diff(owner, prepend=-1) > 0
    coordinates = [shapely.get_coordinates(ring)[:-1] for ring in rings]
    turned = shapely.is_ccw(rings) != outer
    ordered = [ring[::-1] if turn else ring for ring, turn in zip(coordinates, turned, strict=True)]
    begins = np.cumsum([0, *(len(ring) for ring in ordered)]).astype(np.uintp)
    return begins, contiguous(np.concatenate(ordered) if ordered else np.zeros((0, 2)))
