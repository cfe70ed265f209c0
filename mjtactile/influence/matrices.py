"""Influence matrices: the linear map from nodal forces on the pad's surface to stress at every sample point.

Loads are split into four symmetry classes (fem/symmetry.py); there is one matrix for each class and sensing layer. A
reading is the mean von Mises stress over the taxel's sample points, a weighted sum of norms of the linear response. It
scales with the load, but readings of several loads do not add up. Responses do: add the responses of the loads, then
take the readings of the sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mjtactile._files import path_from
from mjtactile._types import Array, Mask
from mjtactile.errors import CorruptInfluenceError, InfluenceError, OutputError, of_type
from mjtactile.fem.corner_loads import onto_corners
from mjtactile.fem.mesh import warn_if_coarser
from mjtactile.fem.stress import DEVIATORIC_COUNT, stress_tensor, von_mises
from mjtactile.fem.symmetry import unfold_field, unfold_points
from mjtactile.fidelity import Fidelity, mesh_name
from mjtactile.influence.core_pad import core_pad
from mjtactile.influence.forces import FoldedLoads, folded_loads, nodal_batch, nodal_forces
from mjtactile.influence.layout import PadTables
from mjtactile.influence.provenance import check_provenance, influence_metadata
from mjtactile.influence.stress_matrix import StressMatrix, read_matrix
from mjtactile.influence.table import read_tables, table_name, write_tables
from mjtactile.pad import Pad

if TYPE_CHECKING:
    from mjtactile.influence.surface_load import SurfaceLoad

#: Coordinates of each kind of stress that change sign under x -> -x (xy and zx), and under y -> -y (xy and yz).
ODD: dict[str, tuple[Mask, Mask]] = {
    "deviatoric": (np.array([0, 0, 1, 0, 1], dtype=bool), np.array([0, 0, 1, 1, 0], dtype=bool)),
    "mean": (np.zeros(1, dtype=bool), np.zeros(1, dtype=bool)),
}


@dataclass(frozen=True, eq=False)
class InfluenceMatrices(PadTables):
    """Influence matrices of one pad, which turn loads into readings; make them with `influence_matrices`."""

    @cached_property
    def _deviatoric_matrices(self) -> list[list[StressMatrix]]:
        """Matrices by sensing layer and class; float16 and int8 are widened at the first use."""
        return self._stress_matrices("deviatoric")

    @cached_property
    def _mean_matrices(self) -> list[list[StressMatrix]]:
        return self._stress_matrices("mean")

    @property
    def mesh_name(self) -> str:
        """Name of the mesh, or "custom"."""
        return mesh_name(self.density) or "custom"

    @property
    def nbytes(self) -> int:
        """Size of all stored matrices [bytes], including those for mean stress and compliance."""
        return sum(table.nbytes for table in self.tables.values())

    def readings(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> Array:
        """Mean von Mises stress at every taxel.

        Args:
            load: one load on this pad's surface, or a sequence of them.

        Returns:
            (layers, rows, columns) [Pa], top layer first, or (taxels,) for free taxels; with a leading batch axis for
            a sequence of loads.

        Raises:
            InfluenceError: a load belongs to another surface or is not finite.
        """
        if _is_empty(load):
            return np.zeros((0, *self.pad.reading_shape))
        single = not isinstance(load, Sequence)
        batch = [nodal_forces(one, self.surface) for one in ([load] if single else load)]
        core = core_pad(self)
        readings = [core.readings(forces) for forces in batch]
        return readings[0] if single else np.stack(readings)

    def point_response(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> Array:
        """Deviatoric stress at every sample point: linear in the load, and sufficient for its readings.

        Args:
            load: one load on this pad's surface, or a sequence of them.

        Returns:
            (points, 5) [Pa], pad frame, coordinates as in fem/stress.py, points of layer k at `sample_slices[k]`; with
            a leading batch axis for a sequence of loads.

        Raises:
            InfluenceError: a load belongs to another surface or is not finite.
        """
        points = self.sample_slices[-1].stop
        if _is_empty(load):
            return np.zeros((0, points, DEVIATORIC_COUNT))
        loads, single = self._folded(load)
        response = np.empty((len(loads.scale), points, DEVIATORIC_COUNT))
        for k, of_layer in enumerate(self.sample_slices):
            response[:, of_layer] = self._deviatoric(loads, k)
        return response[0] if single else response

    def readings_of(self, response: Array) -> Array:
        """Readings of a response, or of a sum of responses.

        Args:
            response: (..., points, 5) [Pa], of any precision, see `point_response`.

        Returns:
            (..., layers, rows, columns) [Pa], or (..., taxels) for free taxels.

        Raises:
            InfluenceError: the response was made with other influence matrices.
        """
        expected = (self.sample_slices[-1].stop, DEVIATORIC_COUNT)
        of_type(np.ndarray, "response", response, InfluenceError, "point_response(load) makes one")
        if response.shape[-2:] != expected:
            raise InfluenceError(
                f"the response has shape {response.shape}, but these influence matrices make (..., {expected[0]}, "
                f"{expected[1]}): it was made with others. Make it with point_response of these."
            )
        batch = response.reshape(-1, *expected)
        norms = (von_mises(batch[:, of_layer]) for of_layer in self.sample_slices)
        layers = [(average @ norm.T).T for average, norm in zip(self.averages, norms, strict=True)]
        return np.stack(layers, axis=1).reshape(*response.shape[:-2], *self.pad.reading_shape)

    def stress(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> Array:
        """Mean stress tensor over every taxel's ball, in the pad frame, tension positive.

        Args:
            load: one load on this pad's surface, or a sequence of them.

        Returns:
            Components xx, yy, zz, xy, yz, zx [Pa], shape (6, layers, rows, columns), or (6, taxels) for free taxels;
            with a leading batch axis for a sequence of loads.

        Raises:
            InfluenceError: a load belongs to another surface or is not finite.
        """
        if _is_empty(load):
            return np.zeros((0, 6, *self.pad.reading_shape))
        loads, single = self._folded(load)
        layers = []
        for k in range(self.pad.sensing_layers):
            mean = unfold_points(loads.times(self._mean_matrices[k]), *ODD["mean"], self.mirrors)[..., 0]
            tensor = stress_tensor(self._deviatoric(loads, k), mean)
            layers.append(np.stack([self.averages[k] @ one for one in tensor]))
        stress = np.moveaxis(np.stack(layers, axis=1), -1, 1).reshape(len(loads.scale), 6, *self.pad.reading_shape)
        return stress[0] if single else stress

    def surface_displacement(self, load: SurfaceLoad) -> Array:
        """Displacement of the surface's nodes under a load, shape (nodes y, nodes x, 3) [m], pad frame.

        Raises:
            InfluenceError: the load belongs to another surface or is not finite.
        """
        loads = folded_loads(nodal_batch([load], self.surface), self.free, twofold=True, mirrors=self.mirrors)
        quarter = self.mesh.quarter()
        shape = (3, quarter.y.node_count, quarter.x.node_count)
        classes = []
        for columns, parity, of_class in zip(self.free, self.mirrors.classes, loads.classes, strict=True):
            field = np.zeros(np.prod(shape))
            field[columns] = self.tables[table_name("compliance", parity)] @ of_class.values[0] * loads.scale
            classes.append(field.reshape(shape))
        return unfold_field(classes, self.mirrors)

    def save(self, path: str | Path) -> None:
        """Write the matrices and a description of pad and fidelity to a file, completely or not at all.

        Raises:
            OutputError: it is no path, or the file cannot be written.
        """
        write_tables(path_from(path, "path", OutputError), self.tables, influence_metadata(self.pad, self.fidelity))

    def _folded(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> tuple[FoldedLoads, bool]:
        """Loads split into classes, on the nodes that have columns, and whether a single load was given."""
        single = not isinstance(load, Sequence)
        batch = nodal_batch([load] if single else load, self.surface)
        if self.fidelity.loads == "corners":
            batch = onto_corners(batch, self.surface)
        return folded_loads(batch, self.columns, self.fidelity.precision == "float64", self.mirrors), single

    def _deviatoric(self, loads: FoldedLoads, sensing_layer: int) -> Array:
        """Deviatoric stress (batch, points, 5) [Pa] at one sensing layer's sample points."""
        response = loads.times(self._deviatoric_matrices[sensing_layer])
        return unfold_points(response, *ODD["deviatoric"], self.mirrors)

    def _stress_matrices(self, kind: str) -> list[list[StressMatrix]]:
        layers = range(self.pad.sensing_layers)
        classes = self.mirrors.classes
        return [[read_matrix(self.tables, table_name(kind, parity, k)) for parity in classes] for k in layers]


def load_influence(
    path: str | Path, pad: Pad | None = None, fidelity: str | Fidelity | None = None
) -> InfluenceMatrices:
    """Load saved influence matrices; arrays are memory-mapped.

    Args:
        path: file written by `InfluenceMatrices.save`.
        pad: the pad that the file must be for; by default the one it describes.
        fidelity: the fidelity that the file must have; by default the one it describes. The contact law may differ: the
            result has the law of this argument.

    Raises:
        FileNotFoundError: there is no such file.
        InfluenceError: `path` is no path.
        CorruptInfluenceError: the file is damaged, not an influence table, or lacks an array its fidelity needs.
        StaleInfluenceError: the file is for another pad, mesh, storage or format version.
        PresetError: there is no such fidelity.

    Warns:
        MeshWarning: the pad is too wide or thin for the mesh's full resolution.
    """
    influence = read_influence(path, pad, fidelity)
    warn_if_coarser(influence.pad, influence.density)
    return influence


def read_influence(
    path: str | Path, pad: Pad | None = None, fidelity: str | Fidelity | None = None
) -> InfluenceMatrices:
    """Load saved influence matrices as `load_influence` does, with its errors but without its warning."""
    file = path_from(path, "path", InfluenceError)
    tables, metadata = read_tables(file)
    pad, chosen = check_provenance(file, metadata, pad, fidelity)
    influence = InfluenceMatrices(pad, chosen, tables)
    try:
        influence.check()
    except CorruptInfluenceError as error:
        raise CorruptInfluenceError(f"{path} is not a whole influence table: {error}") from error
    return influence


def _is_empty(load: SurfaceLoad | Sequence[SurfaceLoad]) -> bool:
    return isinstance(load, Sequence) and len(load) == 0
