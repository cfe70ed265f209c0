"""Bodies as the compiled core presses them: flat faces as contact cells, and shapes with a lower surface."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import shapely

from mjtactile.cells import Cells
from mjtactile.envelope import TriangleSurface
from mjtactile.faces import BodyFace
from mjtactile.gap import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose, Shape
from mjtactile.influence import InfluenceMatrices
from mjtactile.native import contiguous, library, native_pad, pointer
from mjtactile.options import ContactOptions
from mjtactile.pad import Array
from mjtactile.partition import outline_cells
from mjtactile.region import Region

#: Laws in the order the core numbers them.
LAWS = ("elastic", "foundation", "uniform")


class NativeFace:
    """A face's cells as the core holds them.

    Attributes:
        handle: what the core's functions take.
    """

    def __init__(self, face: BodyFace, count: int, *, cut: bool = False) -> None:
        self._count = count
        cells = outline_cells(face.outline, count)
        ends, sides = _cell_edges(cells)
        corners = contiguous(shapely.get_coordinates(face.outline.convex_hull)[:-1])
        arrays = [contiguous(one) for one in (cells.centroids, cells.areas, cells.half_space.inverse_distance)]
        rotation, core = contiguous(face.rotation), library()
        self.handle = ctypes.c_void_p(
            core.mjt_face_new(
                pointer(rotation),
                ctypes.c_double(face.height),
                ctypes.c_double(face.most_slope),
                ctypes.c_size_t(cells.count),
                *(pointer(one) for one in arrays),
                ctypes.c_size_t(len(ends)),
                pointer(ends),
                pointer(sides),
                ctypes.c_size_t(len(corners)),
                pointer(corners),
                ctypes.c_int(cut),
            )
        )
        self._finalizer = weakref.finalize(self, core.mjt_face_free, self.handle)

    def nodal_forces(
        self,
        influence: InfluenceMatrices,
        pose: Pose,
        wrench: Array,
        *,
        tilting: bool,
        friction: float | None,
        law: str = "elastic",
    ) -> Array | None:
        """Nodal forces (nodes y, nodes x, 3) [N] of the face at a pose in the pad frame under a wrench (6,) [N, N m].

        None where the NumPy reference has to take over.
        """
        forces = np.empty((*influence.surface.node_shape, 3))
        numbers, wanted = _pose_numbers(pose), contiguous(wrench)
        found = library().mjt_face_press(
            native_pad(influence).handle,
            self.handle,
            pointer(numbers),
            pointer(wanted),
            ctypes.c_int(LAWS.index(law)),
            ctypes.c_int(tilting),
            ctypes.c_double(-1.0 if friction is None else friction),
            ctypes.c_size_t(self._count),
            pointer(forces),
        )
        return forces if found else None


class NativeBody:
    """A body's geometry as the core holds it.

    Args:
        shapes: of the body's geoms; only bodies of nothing but shapes the core knows are pressed by it when curved.
        local: their poses in the body's frame.
        facing: directions of flat faces, see BodyFaces, (faces, 3).
        limits: depth of the pad, reach and facing gap [m], see Footprint and lower_surface.

    Attributes:
        handle: what the core's functions take.
    """

    def __init__(
        self, shapes: Mapping[int, Shape], local: Mapping[int, Pose], facing: Array, limits: tuple[float, float, float]
    ) -> None:
        core, numbers, directions = library(), contiguous(limits), contiguous(facing)
        self.handle = ctypes.c_void_p(
            core.mjt_body_new(pointer(numbers), ctypes.c_size_t(len(directions)), pointer(directions))
        )
        self._finalizer = weakref.finalize(self, core.mjt_body_free, self.handle)
        if all(isinstance(shape, TriangleSurface) or type(shape) in _KINDS for shape in shapes.values()):
            for geom, shape in shapes.items():
                self._add(shape, local[geom])

    def heights(self, pose: Pose, sheet: Array, points: Array) -> Array | None:
        """Heights over points (n, 2) of a sheet (west, south, east, north) [m], from the lowest; None if off it."""
        heights, numbers = np.empty(len(points)), _pose_numbers(pose)
        sheet, points = contiguous(sheet), contiguous(points)
        found = library().mjt_body_heights(
            self.handle,
            pointer(numbers),
            pointer(sheet),
            ctypes.c_size_t(len(points)),
            pointer(points),
            pointer(heights),
        )
        return heights if found else None

    def nodal_forces(
        self,
        influence: InfluenceMatrices,
        pose: Pose,
        wrench: Array,
        options: ContactOptions,
        *,
        within: Region | None = None,
    ) -> Array | None:
        """Nodal forces (nodes y, nodes x, 3) [N] of the body's curved side at a pose in the pad frame.

        None where the NumPy reference has to take over. The contact is looked for within a region, where one is given.
        """
        forces, numbers, wanted = np.empty((*influence.surface.node_shape, 3)), _pose_numbers(pose), contiguous(wrench)
        region = None
        if within is not None:
            region = contiguous([*within.centre, within.angle, within.width, within.height])
        found = library().mjt_body_press(
            native_pad(influence).handle,
            self.handle,
            pointer(numbers),
            pointer(wanted),
            ctypes.c_int(LAWS.index(options.law)),
            ctypes.c_int(options.tilting),
            ctypes.c_double(-1.0 if options.friction is None else options.friction),
            ctypes.c_size_t(options.cells),
            pointer(region),
            pointer(forces),
        )
        return forces if found else None

    def _add(self, shape: Shape, local: Pose) -> None:
        core, numbers = library(), _pose_numbers(local)
        if isinstance(shape, TriangleSurface):
            vertices, corners = contiguous(shape.vertices), np.ascontiguousarray(shape.faces, dtype=np.int32)
            core.mjt_body_add_mesh(
                self.handle,
                pointer(numbers),
                ctypes.c_size_t(len(vertices)),
                pointer(vertices),
                ctypes.c_size_t(len(corners)),
                pointer(corners),
                ctypes.c_int(shape.closed),
            )
            return
        size = contiguous(_size(shape))
        core.mjt_body_add_shape(self.handle, ctypes.c_int(_KINDS.index(type(shape))), pointer(size), pointer(numbers))


#: Shapes in the order the core numbers them.
_KINDS: tuple[type, ...] = (Ellipsoid, Capsule, Cylinder, Box, HalfSpace)


def _size(shape: Shape) -> tuple[float, float, float]:
    if isinstance(shape, Ellipsoid):
        return shape.semi_axes
    if isinstance(shape, Box):
        return shape.half_sizes
    if isinstance(shape, Capsule | Cylinder):
        return shape.radius, shape.half_length, 0.0
    return 0.0, 0.0, 0.0


def _pose_numbers(pose: Pose) -> Array:
    return contiguous([*pose.position, *pose.rotation.ravel()])


def _cell_edges(cells: Cells) -> tuple[Array, npt.NDArray[np.int32]]:
    """Distinct edges (count, 2 ends, 2) [m], and the cells to their left and right, -1 for none."""
    first, steps = cells.steps
    sides = np.full((len(first), 2), -1, dtype=np.int32)
    coordinates = steps.tocoo()
    for side, sign in enumerate((1.0, -1.0)):
        there = coordinates.data == sign
        sides[coordinates.row[there], side] = coordinates.col[there]
    return contiguous(cells.edges[first]), np.ascontiguousarray(sides)
