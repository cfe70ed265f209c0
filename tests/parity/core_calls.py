"""Functions of the core that only tests call: single steps of what it does at once."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
from lower_surfaces import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Pose, Shape

import mjtactile
from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.contact.core_pad import contact_pad
from mjtactile.contact.footprint import FACING_GAP

_REFUSED, _SLIDES, _SIMPLIFIED = 1, 2, 4


def rigid_contact(compliance: Array, modes: Array, heights: Array, resultants: Array) -> Array:
    """Forces on cells (cells,) [N] that press without friction, see RigidContact."""
    cells, motions = modes.shape
    arrays = [contiguous(one) for one in (compliance, modes, heights, resultants)]
    forces = np.empty(cells)
    found = library().mjt_rigid_contact(
        ctypes.c_size_t(cells), ctypes.c_size_t(motions), *(pointer(one) for one in (*arrays, forces))
    )
    assert found
    return forces


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
        tangential.encode(),
        ctypes.c_double(-1.0 if friction is None else friction),
        pointer(forces),
    )
    return SurfaceShear(forces, bool(told & _REFUSED), bool(told & _SLIDES), bool(told & _SIMPLIFIED))


def shape_numbers(shape: Shape) -> tuple[int, tuple[float, float, float]]:
    """Number of a shape's kind in the core, and its size [m]."""
    match shape:
        case Ellipsoid(semi_axes):
            return 0, semi_axes
        case Capsule(radius, half_length):
            return 1, (radius, half_length, 0.0)
        case Cylinder(radius, half_length):
            return 2, (radius, half_length, 0.0)
        case Box(half_sizes):
            return 3, half_sizes
        case HalfSpace():
            return 4, (0.0, 0.0, 0.0)
    raise TypeError(f"the core knows no {type(shape).__name__}")


def pose_numbers(pose: Pose) -> Array:
    """A pose as the core takes it, shape (12,)."""
    return contiguous([*pose.position, *pose.rotation.ravel()])


def press_body(
    influence: mjtactile.InfluenceMatrices,
    body: ctypes.c_void_p,
    pose: Pose,
    wrench: Array,
    *,
    law: str = "elastic",
    cells: int,
    sunk: float = 0.0,
    strength: float = 0.0,
) -> tuple[Array, Array]:
    """Nodal forces (nodes y, nodes x, 3) [N] and the carried wrench (6,) of a body that may tilt.

    Args:
        influence: of the pad.
        body: in the core.
        pose: of the body in the pad frame.
        wrench: on the pad, about its origin [N, N m], shape (6,).
        law: contact law.
        cells: wanted number of contact cells.
        sunk: how deep MuJoCo lets the body sink in [m].
        strength: largest mean pressure [Pa]; 0 for no bound.
    """
    forces, carried = np.empty((*influence.surface.node_shape, 3)), np.empty(6)
    where, wrench = pose_numbers(pose), contiguous(wrench)
    assert library().mjt_body_press(
        contact_pad(influence).handle,
        body,
        pointer(where),
        pointer(wrench),
        ctypes.c_double(sunk),
        law.encode(),
        b"proportional",
        ctypes.c_int(1),
        ctypes.c_double(-1.0),
        ctypes.c_double(strength),
        ctypes.c_double(FACING_GAP),
        ctypes.c_size_t(cells),
        pointer(forces),
        pointer(carried),
    )
    return forces, carried
