"""Loads split into symmetry classes, ready to be multiplied by the matrices of each class."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import Point

from mjtactile._types import Array
from mjtactile.errors import InfluenceError, of_type
from mjtactile.fem.surface_grid import SurfaceGrid, oriented_edges
from mjtactile.fem.symmetry import MirrorPlanes, fold_forces
from mjtactile.influence.stress_matrix import ClassForces, StressMatrix
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad

#: Forces below this times the precision's rounding, relative to the load's largest force, are neglected [-].
_NEGLIGIBLE = 1 / 16


@dataclass(frozen=True, eq=False)
class FoldedLoads:
    """A batch of loads, split into symmetry classes."""

    #: Forces of each class divided by `scale`, which avoids overflow and underflow in float32.
    classes: list[ClassForces]
    scale: Array  #: largest force of each load [N], shape (batch,)

    def times(self, matrices: list[StressMatrix]) -> Array:
        """Stress coordinates [Pa], (batch, classes, rows), with one matrix per class."""
        responses = [matrix.times(forces) for matrix, forces in zip(matrices, self.classes, strict=True)]
        return np.stack(responses, axis=1) * self.scale[:, None, None]


def nodal_batch(loads: Sequence[SurfaceLoad], surface: SurfaceGrid) -> Array:
    """Nodal forces of several loads in one array [N], shape (batch, nodes y, nodes x, 3).

    Raises:
        InfluenceError: a load belongs to another surface or is not finite.
    """
    forces = [nodal_forces(load, surface) for load in loads]
    batch = forces[0][None] if len(forces) == 1 else np.stack(forces)
    largest_force(batch)
    return batch


def nodal_forces(load: SurfaceLoad, surface: SurfaceGrid) -> Array:
    """Nodal forces of one load [N], shape (nodes y, nodes x, 3), which may not be finite.

    Raises:
        InfluenceError: the load belongs to another surface.
    """
    forces = of_type(SurfaceLoad, "load", load, InfluenceError, "contact_load(...) makes one").forces
    expected = (*surface.node_shape, 3)
    if forces.shape != expected:
        raise InfluenceError(
            f"the load has nodal forces of shape {forces.shape}, but this surface takes {expected}: it was "
            "made for another pad or mesh. Make the footprint and the load with these influence matrices."
        )
    if not surface.matches(load.surface):
        raise InfluenceError(
            f"the load was made for another pad or mesh: on {load.surface.summary}, but this is {surface.summary}. "
            "Make the footprint and the load with these influence matrices."
        )
    return forces


def largest_force(forces: Array) -> float:
    """Largest size of a component of nodal forces [N].

    Raises:
        InfluenceError: a force is not finite.
    """
    largest = max(float(forces.max()), -float(forces.min()))  # without an array of sizes; NaN if a force is
    if not math.isfinite(largest):
        raise InfluenceError("the load holds NaN or infinite nodal forces; check the traction it was made from.")
    return largest


def by_class(batch: Array, columns: list[np.ndarray], mirrors: MirrorPlanes) -> list[Array]:
    """Forces (batch, columns) of each class [N], from nodal forces and columns as for `folded_loads`."""
    folded = (fold_forces(batch, parity).reshape(len(batch), -1) for parity in mirrors.classes)
    return [of_class[:, kept] for of_class, kept in zip(folded, columns, strict=True)]


def grid_lines(pad: Pad, spacing: float) -> list[Array]:
    """Positions [m] along x and along y, at most `spacing` apart, from the mirror plane or else a side to a side."""
    ends = np.array(pad.size) / 2
    lines = [(0.0 if mirrored else -end, end) for mirrored, end in zip(pad.surface.mirrors, ends, strict=True)]
    return [np.linspace(start, end, int(np.ceil((end - start) / spacing)) + 1) for start, end in lines]


def disc_forces(surface: SurfaceGrid, x: Array, y: Array, diameters: Sequence[float]) -> Array:
    """Nodal forces [N] of unit tractions along each axis on discs of each diameter, centred on a grid.

    The result has shape (axes * diameters * centres, nodes y, nodes x, 3).
    """
    discs = (Point(px, py).buffer(diameter / 2, quad_segs=6) for diameter in diameters for py in y for px in x)
    edges = (oriented_edges(disc) for disc in discs)
    integrals = np.stack([surface.traction_forces(of_disc, np.ones((len(of_disc), 3)))[..., 0] for of_disc in edges])
    return np.einsum("dyx,ac->adyxc", integrals, np.eye(3)).reshape(-1, *integrals.shape[1:], 3)


def folded_loads(batch: Array, columns: list[np.ndarray], twofold: bool, mirrors: MirrorPlanes) -> FoldedLoads:
    """Split nodal forces into symmetry classes.

    A symmetric load has forces in some classes only, and rounding errors in the others. Forces smaller than the
    rounding of the matrices are set to zero, so that the matrices of those classes need not be read.

    Args:
        batch: nodal forces (batch, nodes y, nodes x, 3) [N].
        columns: for each class, the degrees of freedom of the quarter that are columns of its matrices.
        twofold: whether the matrices are stored in double precision.
        mirrors: of the pad.
    """
    forces = by_class(batch, columns, mirrors)
    scale = np.max([np.abs(of_class).max(axis=1, initial=0.0) for of_class in forces], axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    negligible = _NEGLIGIBLE * np.finfo(np.float64 if twofold else np.float32).eps
    scaled = (of_class / scale[:, None] for of_class in forces)
    return FoldedLoads([ClassForces(np.where(np.abs(values) < negligible, 0.0, values)) for values in scaled], scale)
