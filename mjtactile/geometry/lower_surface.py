"""The lower surface of a rigid shape over a pad, as the compiled core sees it."""

from __future__ import annotations

import ctypes
import math
import weakref

import numpy as np
import numpy.typing as npt
import trimesh

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array

#: Numbers of the shapes in the core.
_ELLIPSOID, _CYLINDER, _BOX = 0, 2, 3


class LowerSurface:
    """A rigid shape about the origin of its own frame. Only its lowest point over each (x, y) can touch a pad."""

    def __init__(self) -> None:
        core = library()
        #: The shape in the core, as a body.
        self.handle = ctypes.c_void_p(core.mjt_body_new())
        self._finalizer = weakref.finalize(self, core.mjt_body_free, self.handle)

    @classmethod
    def of_sphere(cls, radius: float) -> LowerSurface:
        """A sphere of a radius [m]."""
        return cls._of_shape(_ELLIPSOID, (radius, radius, radius))

    @classmethod
    def of_cylinder(cls, radius: float, length: float) -> LowerSurface:
        """A cylinder about z, of a radius and a length [m]."""
        return cls._of_shape(_CYLINDER, (radius, length / 2, 0.0))

    @classmethod
    def of_box(cls, size: npt.ArrayLike) -> LowerSurface:
        """A box with edges of three lengths [m] along x, y and z."""
        return cls._of_shape(_BOX, np.asarray(size) / 2)

    @classmethod
    def of_solid(cls, solid: trimesh.Trimesh) -> LowerSurface:
        """A triangle mesh [m], its corners in single precision as in MuJoCo."""
        made, here = cls(), _numbers(np.zeros(3), np.eye(3))
        points = np.ascontiguousarray(solid.vertices, dtype=np.float32)
        triangles = np.ascontiguousarray(solid.faces, dtype=np.int32)
        library().mjt_body_add_mesh(
            made.handle,
            pointer(here),
            ctypes.c_size_t(len(points)),
            pointer(points),
            ctypes.c_size_t(len(triangles)),
            pointer(triangles),
        )
        return made

    def heights(self, position: Array, rotation: Array, x: Array, y: Array, *, floor: float = -math.inf) -> Array:
        """Heights of the lower surface over points of the pad frame [m], (n,); infinite where nothing is above.

        Args:
            position: of the shape's origin in the pad frame [m], shape (3,).
            rotation: matrix whose columns are the shape's axes in the pad frame, shape (3, 3).
            x: coordinates of the points [m], shape (n,).
            y: likewise.
            floor: parts of the shape below this height are ignored [m].
        """
        points, pose = contiguous(np.column_stack([x, y])), _numbers(position, rotation)
        found = np.empty(len(points))
        if not len(points):
            return found
        sheet = contiguous([*points.min(axis=0), *points.max(axis=0)])
        there = library().mjt_body_heights(
            self.handle,
            pointer(pose),
            pointer(sheet),
            ctypes.c_double(floor),
            ctypes.c_double(math.inf),
            ctypes.c_size_t(len(points)),
            pointer(points),
            pointer(found),
        )
        return found if there else np.full(len(points), np.inf)

    @classmethod
    def _of_shape(cls, kind: int, size: npt.ArrayLike) -> LowerSurface:
        made, here, numbers = cls(), _numbers(np.zeros(3), np.eye(3)), contiguous(size)
        library().mjt_body_add_shape(made.handle, ctypes.c_int(kind), pointer(numbers), pointer(here))
        return made


def _numbers(position: Array, rotation: Array) -> Array:
    """A pose as the core takes it, shape (12,)."""
    return contiguous([*position, *np.ravel(rotation)])
