"""Shear under a contact in the compiled core: the full compliance of cells, and forces for every tangential choice."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile.cells import Cells
from mjtactile.compliance import surface_compliance
from mjtactile.influence import InfluenceMatrices
from mjtactile.native import NativePad, contiguous, library, native_pad, pointer
from mjtactile.options import TANGENTIALS
from mjtactile.pad import Array

_REFUSED, _SLIDES, _SIMPLIFIED = 1, 2, 4


def shearable_pad(influence: InfluenceMatrices) -> NativePad:
    """The core's copy of influence matrices, with what shear needs besides."""
    pad = native_pad(influence)
    pad.set_tangential(surface_compliance(influence))
    return pad


def full_compliance(influence: InfluenceMatrices, cells: Cells) -> Array:
    """Mean displacement per force, (3, cells, 3, cells) [m/N], pad frame; see `SurfaceCompliance.full`."""
    shape = cells if cells.shape is None else cells.shape
    scale, angle = cells.placement
    ends, sides = cell_edges(shape)
    ends = contiguous(scale * ends)
    arrays = [contiguous(one) for one in (cells.centroids, cells.areas, cells.half_space.inverse_distance)]
    compliance = np.empty((3, cells.count, 3, cells.count))
    library().mjt_full_compliance(
        shearable_pad(influence).handle,
        ctypes.c_size_t(cells.count),
        *(pointer(one) for one in arrays),
        ctypes.c_size_t(len(ends)),
        pointer(ends),
        pointer(sides),
        ctypes.c_double(angle),
        pointer(compliance),
    )
    return compliance


@dataclass(frozen=True, eq=False)
class SurfaceShear:
    """Forces that the core found for a contact.

    Attributes:
        forces: on each cell, pad frame, (cells, 3) [N].
        refused: whether there was no contact, or numbers that are not finite; forces are zero then.
        slides: whether friction carries only the nearest wrench.
        simplified: whether a simpler choice carries the wrench, because none was found as asked for.
    """

    forces: Array
    refused: bool
    slides: bool
    simplified: bool


def surface_shear(
    centroids: Array,
    pressing: Array,
    wrench: Array,
    *,
    tangential: str = "proportional",
    friction: float | None = None,
    compliance: Array | None = None,
    heights: Array | None = None,
    middle: Array,
    length: float,
    tilting: bool = True,
) -> SurfaceShear:
    """Spread a wrench's shear and torsion over cells whose pressing without friction is known.

    Args:
        centroids: of the cells (cells, 2) [m].
        pressing: force on each without friction, (cells,) [N].
        wrench: force and moment about the pad's origin, (6,) [N, N m].
        tangential: "proportional", "stick" or "coulomb".
        friction: coefficient; None: no bound.
        compliance: (3, cells, 3, cells) [m/N], for all but "proportional".
        heights: of the body above the cells at first touch, (cells,) [m]; infinite out of reach; None: flat.
        middle: point about which the body tilts (2,) [m].
        length: by which tilts and torsion compare with forces [m].
        tilting: whether the body may tilt.
    """
    centroids, pressing, wrench = contiguous(centroids), contiguous(pressing), contiguous(wrench)
    compliance = None if compliance is None else contiguous(compliance)
    heights = None if heights is None else contiguous(heights)
    frame = contiguous([*middle, length])
    forces = np.empty((len(pressing), 3))
    told = library().mjt_surface_shear(
        ctypes.c_size_t(len(pressing)),
        pointer(centroids),
        pointer(pressing),
        pointer(heights),
        pointer(frame),
        ctypes.c_int(tilting),
        pointer(compliance),
        pointer(wrench),
        ctypes.c_int(TANGENTIALS.index(tangential)),
        ctypes.c_double(-1.0 if friction is None else friction),
        pointer(forces),
    )
    return SurfaceShear(forces, bool(told & _REFUSED), bool(told & _SLIDES), bool(told & _SIMPLIFIED))


def cell_edges(cells: Cells) -> tuple[Array, npt.NDArray[np.int32]]:
    """Distinct edges (count, 2 ends, 2) [m], and the cells to their left and right, -1 for none."""
    first, steps = cells.steps
    sides = np.full((len(first), 2), -1, dtype=np.int32)
    coordinates = steps.tocoo()
    for side, sign in enumerate((1.0, -1.0)):
        there = coordinates.data == sign
        sides[coordinates.row[there], side] = coordinates.col[there]
    return contiguous(cells.edges[first]), np.ascontiguousarray(sides)
