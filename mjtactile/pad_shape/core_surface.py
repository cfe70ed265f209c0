"""Curved surfaces in the compiled core, and the point at which a wrench presses on them."""

from __future__ import annotations

import ctypes
import weakref
from functools import lru_cache

import numpy as np

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.pad_shape.surfaces import Quadric, Surface

#: Grid lines along each axis on which the core stores a SurfacePatch; bicubic interpolation errs by less than 1 nm.
_PATCH_LINES = 129


class CoreSurface:
    """A curved surface in the core: the axes of a quadric, or heights and slopes on a fine grid.

    It is made for a pad of half a projected width along (x, y) [m].
    """

    def __init__(self, outer: Surface, half_size: tuple[float, float]) -> None:
        sheet = contiguous([-half_size[0], -half_size[1], *half_size])
        if isinstance(outer, Quadric):
            a, b, c = outer.principal_axes
            numbers = (ctypes.c_double(number) for number in (a**-2, b**-2, c))
            handle = library().mjt_outer_quadric(pointer(sheet), *numbers)
        else:
            lines = [np.linspace(-half, half, _PATCH_LINES) for half in half_size]
            jet = outer.jet(*np.meshgrid(*lines))
            jets = contiguous(np.stack([jet.z, jet.x, jet.y, jet.xy], axis=-1))
            handle = library().mjt_outer_patch(
                pointer(sheet), *(ctypes.c_size_t(len(line)) for line in lines), pointer(jets)
            )
        self.handle = ctypes.c_void_p(handle)  #: argument of the core's functions
        weakref.finalize(self, library().mjt_outer_free, self.handle)

    def centre_of_pressure(self, wrench: Array) -> Array | None:
        """Point of the surface, (3,) [m], at which a wrench about the pad's origin presses, (6,) [N, N m], pad frame.

        It is at the sheet's rim if the line of the force passes beside it; None if none is found.
        """
        centre = np.empty(3)
        found = library().mjt_centre_of_pressure(self.handle, pointer(contiguous(wrench)), pointer(centre))
        return centre if found else None


@lru_cache(maxsize=64)
def core_surface(outer: Surface, half_size: tuple[float, float]) -> CoreSurface:
    """The core's copy of a curved surface, made on first use."""
    return CoreSurface(outer, half_size)
