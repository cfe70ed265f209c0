"""Stress columns for loads at elements' corners, fitted so that readings are close to those of loads at all nodes.

The original columns of the corners are exact for a force at a corner. But forces at corners represent loads that were
distributed over all nodes. The columns are therefore corrected by ridge regression, so that discs of several diameters
all over the sheet, under normal and shear traction, have the response of loads at all nodes. On the paper's pad, mesh
"default", this removes up to half of the error of loads at corners near corners of punches and under spheres.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Mask
from mjtactile.fem.corner_loads import on_corners, onto_corners, require_corners_mirrored
from mjtactile.influence.forces import by_class, disc_forces, grid_lines
from mjtactile.influence.matrices import InfluenceMatrices

#: Diameters of the discs over the largest element [-].
_DISCS = (1.25, 2.0, 4.0)
#: Distance between the discs over the largest element [-], unless there would be too many.
_SPACING = 0.75
#: Largest number of discs of one diameter on the quarter.
_MOST_DISCS = 150
#: Ridge parameter: weight of the original columns over the mean weight of the loads [-].
_RIDGE = 0.01
#: Loads of a class below this, over the largest, are neglected as rounding errors [-].
_UNFELT = 1e-9


class CornerColumns:
    """Columns of the corners from those of all nodes, for each class. Only pad and fidelity of `whole` are used.

    Raises:
        PresetError: the mesh has an odd number of elements along an axis.
    """

    def __init__(self, whole: InfluenceMatrices) -> None:
        require_corners_mirrored(whole.mesh)
        corners = on_corners(whole.mesh.quarter())
        forces = _disc_forces(whole)
        on_nodes = by_class(forces, whole.columns, whole.mirrors)
        cornered = InfluenceMatrices(whole.pad, replace(whole.fidelity, loads="corners"), whole.tables)
        spread = by_class(onto_corners(forces, whole.surface), cornered.columns, whole.mirrors)
        self._kept = [corners[columns] for columns in whole.columns]
        self._corrections = [_correction(*of_class) for of_class in zip(on_nodes, spread, self._kept, strict=True)]

    def of(self, matrix: npt.NDArray[Any], number: int) -> npt.NDArray[Any]:
        """Matrix (columns of the corners, rows) of the class with index `number`, from that of all nodes."""
        moved = self._corrections[number].astype(matrix.dtype) @ matrix
        return np.ascontiguousarray(matrix[self._kept[number]] + moved)


def _correction(full: Array, few: Array, kept: Mask) -> npt.NDArray[Any]:
    """Correction of the corners' columns as a linear map of all columns, (corners, nodes).

    Args:
        full: forces of the discs on all nodes, (loads, columns).
        few: the same loads moved to the corners, (loads, columns of corners).
        kept: mask of the corners' columns.
    """
    # All discs get equal weight, except those on a mirror plane without a response in the class.
    size = np.linalg.norm(full, axis=1, keepdims=True)
    felt = size[:, 0] > _UNFELT * size.max()
    full, few = full[felt] / size[felt], few[felt] / size[felt]
    gram = few.T @ few
    gram[np.diag_indices(len(gram))] += _RIDGE * np.trace(gram) / len(gram)
    # The difference of both responses, and thus the correction of the columns, is linear in the whole matrix.
    missed = full.copy()
    missed[:, kept] -= few
    return np.linalg.solve(gram, few.T @ missed)


def _disc_forces(influence: InfluenceMatrices) -> Array:
    """Nodal forces (loads, nodes y, nodes x, 3) of unit tractions along each axis on discs all over the quarter."""
    surface = influence.surface
    largest = float(max(surface.x.sizes.max(), surface.y.sizes.max()))
    spacing = max(_SPACING * largest, float(np.sqrt(np.prod(influence.pad.size) / 4 / _MOST_DISCS)))
    x, y = grid_lines(influence.pad, spacing)
    return disc_forces(surface, x, y, [d * largest for d in _DISCS])
