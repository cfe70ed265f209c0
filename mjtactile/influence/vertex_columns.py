"""Stress columns of the elements' corners, fitted so that loads spread onto corners read as they would on all nodes.

The plain columns of the corners answer a force on a corner exactly, which is not what they are used for: a load that
was spread onto them stands for one on all nodes. Their columns are therefore moved, by ridge regression, to where
discs of some diameters all over the sheet, pressed and sheared, respond as on all nodes. On the paper's pad, mesh
"default", that takes away up to half of what spreading gets wrong near corners of punches and under spheres.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely import Point

from mjtactile._types import Array, Mask
from mjtactile.fem.symmetry import fold_forces
from mjtactile.fem.vertex_loads import on_corners, onto_corners, require_corners_mirrored
from mjtactile.influence.matrices import InfluenceMatrices

#: Diameters of the discs over the largest element.
_DISCS = (1.25, 2.0, 4.0)
#: Distance of the discs over the largest element, unless that makes too many.
_SPACING = 0.75
#: Most discs of one diameter on the quarter.
_MOST_DISCS = 150
#: Weight of staying with the plain columns over the mean weight of the loads.
_RIDGE = 0.01
#: Loads of a class below this, over the largest, are rounding.
_UNFELT = 1e-9


class CornerColumns:
    """Columns of the corners from those of all nodes, class by class.

    Args:
        whole: pad and fidelity of matrices with columns of all nodes; its tables are not looked at.

    Raises:
        PresetError: when the mesh has an odd number of elements along an axis.
    """

    def __init__(self, whole: InfluenceMatrices) -> None:
        require_corners_mirrored(whole.mesh)
        corners = on_corners(whole.mesh.quarter())
        forces = _disc_forces(whole)
        on_nodes = _by_class(forces, whole)
        spread = _by_class(onto_corners(forces, whole.surface), _with_corners(whole))
        self._kept = [corners[columns] for columns in whole.columns]
        self._corrections = [_correction(*of_class) for of_class in zip(on_nodes, spread, self._kept, strict=True)]

    def of(self, matrix: npt.NDArray[Any], number: int) -> npt.NDArray[Any]:
        """A class's matrix (columns of the corners, rows) from that of all nodes (columns, rows)."""
        moved = self._corrections[number].astype(matrix.dtype) @ matrix
        return np.ascontiguousarray(matrix[self._kept[number]] + moved)


def _correction(full: Array, few: Array, kept: Mask) -> npt.NDArray[Any]:
    """What the corners' columns are moved by, as a linear map (corners, nodes) of all columns.

    Args:
        full: forces of the discs on all nodes, (loads, columns).
        few: the same spread onto corners, (loads, columns of corners).
        kept: which columns are corners'.
    """
    # Small and large discs count alike; those that a class does not feel, because they lie on a mirror, say nothing.
    size = np.linalg.norm(full, axis=1, keepdims=True)
    felt = size[:, 0] > _UNFELT * size.max()
    full, few = full[felt] / size[felt], few[felt] / size[felt]
    gram = few.T @ few
    gram[np.diag_indices(len(gram))] += _RIDGE * np.trace(gram) / len(gram)
    # The difference of both responses, and through it the columns' correction, is linear in the whole matrix.
    missed = full.copy()
    missed[:, kept] -= few
    return np.linalg.solve(gram, few.T @ missed)


def _with_corners(whole: InfluenceMatrices) -> InfluenceMatrices:
    """The same with loads on the corners; its tables are not in order yet."""
    return InfluenceMatrices(whole.pad, replace(whole.fidelity, loads="corners"), whole.tables)


def _disc_forces(influence: InfluenceMatrices) -> Array:
    """Nodal forces (loads, nodes y, nodes x, 3) of unit tractions along each axis on discs all over the quarter."""
    surface = influence.surface
    largest = float(max(surface.x.sizes.max(), surface.y.sizes.max()))
    half = np.array(influence.pad.size) / 2
    spacing = max(_SPACING * largest, float(np.sqrt(half.prod() / _MOST_DISCS)))
    starts = (
        0.0 if mirrored else -extent for mirrored, extent in zip(influence.pad.surface.mirrors, half, strict=True)
    )
    x, y = (
        np.linspace(start, extent, int(np.ceil((extent - start) / spacing)) + 1)
        for start, extent in zip(starts, half, strict=True)
    )
    discs = [Point(px, py).buffer(d * largest / 2, quad_segs=6) for d in _DISCS for py in y for px in x]
    integrals = np.stack([surface.nodal_integrals(disc)[0] for disc in discs])
    return np.einsum("dyx,ac->adyxc", integrals, np.eye(3)).reshape(-1, *integrals.shape[1:], 3)


def _by_class(forces: Array, influence: InfluenceMatrices) -> list[Array]:
    folded = (fold_forces(forces, parity).reshape(len(forces), -1) for parity in influence.mirrors.classes)
    return [of_class[:, columns] for of_class, columns in zip(folded, influence.columns, strict=True)]
