"""The sheet's two mirrors: loads split into four symmetry classes, responses put together again.

Every table holds a quarter of the sheet per class. A load is folded by adding up its mirror images with the class's
signs; a response at a mirrored point is the sum over classes with the same signs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.fem.stiffness import PARITIES, Parity

#: Quadrants of the plane as signs (x, y), in the order sample points refer to them.
QUADRANTS = ((1, 1), (-1, 1), (1, -1), (-1, -1))
#: Sign with which each class enters each quadrant, shape (quadrants, classes).
QUADRANT_SIGNS = np.array([[(p.x if sx < 0 else 1) * (p.y if sy < 0 else 1) for p in PARITIES] for sx, sy in QUADRANTS])


def fold_forces(forces: Array, parity: Parity) -> Array:
    """Nodal forces on the whole surface as forces on the quarter x >= 0, y >= 0 in one symmetry class.

    Args:
        forces: (..., nodes y, nodes x, 3) [N], nodes of a mirror-symmetric grid.
        parity: the class.

    Returns:
        (..., 3, quarter nodes y, quarter nodes x) [N]: each node's forces and those of its mirror images, added with
        the class's signs.
    """
    signs = np.array([parity.component_signs(component) for component in range(3)])
    folded = np.moveaxis(forces, -1, -3)
    for axis, of_component in ((-1, signs[:, 0]), (-2, signs[:, 1])):
        folded = np.moveaxis(folded, axis, -1)
        middle = folded.shape[-1] // 2
        mirrored = folded[..., middle - 1 :: -1]
        folded = folded[..., middle:].copy()
        folded[..., 1:] += of_component[:, None, None] * mirrored
        folded = np.moveaxis(folded, -1, axis)
    return folded


def unfold_field(classes: list[Array]) -> Array:
    """A vector field on the whole surface from its four classes on the quarter.

    Args:
        classes: one array (..., 3, quarter nodes y, quarter nodes x) per class, in the order of PARITIES.

    Returns:
        (..., nodes y, nodes x, 3).
    """
    whole = 0.0
    for parity, quarter in zip(PARITIES, classes, strict=True):
        components = []
        for component in range(3):
            sign_x, sign_y = parity.component_signs(component)
            half = np.concatenate([sign_x * quarter[..., component, :, :0:-1], quarter[..., component, :, :]], axis=-1)
            components.append(np.concatenate([sign_y * half[..., :0:-1, :], half], axis=-2))
        whole = whole + np.stack(components, axis=-1)
    return np.asarray(whole)


def unfold_points(classes: Array, odd_in_x: Mask, odd_in_y: Mask) -> Array:
    """Coordinates at points in all quadrants from their four classes at the folded points.

    Args:
        classes: (batch, classes, folded points * coordinates).
        odd_in_x: which coordinates change their sign under x -> -x, shape (coordinates,).
        odd_in_y: the same under y -> -y.

    Returns:
        (batch, quadrants * folded points, coordinates), quadrant by quadrant.
    """
    batch = len(classes)
    signs = [np.where(odd_in_x, x, 1) * np.where(odd_in_y, y, 1) for x, y in QUADRANTS]
    whole = np.matmul(QUADRANT_SIGNS.astype(classes.dtype), classes).reshape(batch, len(QUADRANTS), -1, len(odd_in_x))
    whole *= np.array(signs)[:, None, :]
    return whole.reshape(batch, -1, len(odd_in_x))


@dataclass(frozen=True, eq=False)
class FoldedPoints:
    """Points folded onto the quarter x >= 0, y >= 0.

    Attributes:
        positions: distinct folded positions [m], shape (folded points, 3).
        index: for each original point, its folded point, shape (points,).
        quadrant: for each original point, its place in QUADRANTS, shape (points,).
    """

    positions: Array
    index: np.ndarray
    quadrant: np.ndarray


def fold_points(positions: Array, resolution: float) -> FoldedPoints:
    """Fold points (points, 3) [m]; mirror images within `resolution` [m] of each other become one."""
    folded = np.concatenate([np.abs(positions[:, :2]), positions[:, 2:]], axis=1)
    # Rounding gives points that share a coordinate exactly one value of it, which the sampler exploits.
    folded = np.round(folded / resolution) * resolution
    distinct, index = np.unique(folded, axis=0, return_inverse=True)
    quadrant = np.where(positions[:, 0] < -resolution, 1, 0) + np.where(positions[:, 1] < -resolution, 2, 0)
    return FoldedPoints(distinct, index.ravel(), quadrant)
