"""Influence matrices: the linear map from nodal forces on the pad's surface to stress at every sample point.

The sheet's mirrors split a load into four symmetry classes (folding.py); per class and sensing layer there is one
matrix. A reading is the mean von Mises stress over the taxel's sample points: a weighted sum of norms of the linear
response, so it scales with the load but loads do not simply add.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from mjtactile.errors import CorruptInfluenceError, InfluenceError, StaleInfluenceError
from mjtactile.fem import PARITIES, free_in_plane
from mjtactile.folding import QUADRANT_SIGNS, QUADRANTS, fold_forces, unfold_field
from mjtactile.mesh import MESHES, MeshDensity, SheetMesh, mesh_density, mesh_description, sheet_mesh
from mjtactile.pad import Array, Layer, Pad, TaxelGrid
from mjtactile.sampling import Sampling
from mjtactile.stress import DEVIATORIC_COUNT, stress_tensor, von_mises
from mjtactile.surface import SurfaceGrid
from mjtactile.table import FORMAT_VERSION, Tables, read_tables, table_name, write_tables

if TYPE_CHECKING:
    from mjtactile.contact import SurfaceLoad

#: From this many loads on, one dense product over the columns any of them uses beats one sparse product each.
_DENSE_BATCH = 8


@dataclass(frozen=True, eq=False)
class InfluenceMatrices:
    """Influence matrices of one pad on one mesh; make them with `influence_matrices`.

    Attributes:
        pad: the sheet and its taxels.
        density: of the mesh and the sample points.
        tables: matrices by name, see `build.build_tables`.
    """

    pad: Pad
    density: MeshDensity
    tables: Tables

    @cached_property
    def mesh(self) -> SheetMesh:
        """The finite-element mesh of the whole sheet."""
        return sheet_mesh(self.pad, self.density)

    @cached_property
    def surface(self) -> SurfaceGrid:
        """The grid on which loads are integrated."""
        return self.mesh.surface

    @cached_property
    def _columns(self) -> list[np.ndarray]:
        """For each class, the surface degrees of freedom (component, y, x) of the quarter that are columns."""
        quarter = self.mesh.quarter()
        return [np.flatnonzero(free_in_plane(quarter, parity)) for parity in PARITIES]

    @cached_property
    def _averages(self) -> list[sparse.csr_array]:
        return [_stored_average(self.tables, k) for k in range(len(self.pad.depths))]

    @property
    def mesh_name(self) -> str:
        """Name of the mesh, or "custom"."""
        return next((name for name, density in MESHES.items() if density == self.density), "custom")

    @property
    def nbytes(self) -> int:
        """Size of all matrices [bytes], those for mean stress and compliance included."""
        return sum(table.nbytes for table in self.tables.values())

    def readings(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> Array:
        """Mean von Mises stress at every taxel.

        Args:
            load: one load on this pad's surface, or a sequence of them.

        Returns:
            (layers, rows, columns) [Pa], top layer first; a sequence of loads puts a batch axis in front.
        """
        if _is_empty(load):
            return np.zeros((0, *self.pad.reading_shape))
        forces, single = self._folded(load)
        readings = np.stack([self._layer_readings(forces, k) for k in range(len(self.pad.depths))], axis=1)
        readings = readings.reshape(-1, *self.pad.reading_shape)
        return readings[0] if single else readings

    def stress(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> Array:
        """Mean stress tensor over every taxel's ball, in the pad frame, tension positive.

        Returns:
            (6, layers, rows, columns) [Pa]: components xx, yy, zz, xy, yz, zx; a sequence of loads puts a batch axis
            in front.
        """
        if _is_empty(load):
            return np.zeros((0, 6, *self.pad.reading_shape))
        forces, single = self._folded(load)
        layers = []
        for k in range(len(self.pad.depths)):
            deviatoric = self._unfold(self._responses(forces, "deviatoric", k, DEVIATORIC_COUNT), _ODD_COORDINATES)
            mean = self._unfold(self._responses(forces, "mean", k, 1), _NO_ODD)[..., 0]
            tensor = stress_tensor(deviatoric, mean)
            averaged = [self._averages[k] @ one.reshape(-1, 6) for one in tensor]
            layers.append(np.stack(averaged).reshape(-1, *self.pad.reading_shape[1:], 6))
        stress = np.moveaxis(np.stack(layers, axis=1), -1, 1)
        return stress[0] if single else stress

    def surface_displacement(self, load: SurfaceLoad) -> Array:
        """Displacement of the surface's nodes under a load, shape (nodes y, nodes x, 3) [m], pad frame."""
        folded, _ = self._folded(load)
        quarter = self.mesh.quarter()
        shape = (3, quarter.y.node_count, quarter.x.node_count)
        classes = []
        for columns, parity, forces in zip(self._columns, PARITIES, folded, strict=True):
            field = np.zeros(np.prod(shape))
            field[columns] = self.tables[table_name("compliance", parity)] @ forces[0]
            classes.append(field.reshape(shape))
        return unfold_field(classes)

    def save(self, path: str | Path) -> None:
        """Write the matrices with their pad's and mesh's description; atomic.

        Raises:
            OSError: when the file cannot be written.
        """
        write_tables(Path(path), self.tables, influence_metadata(self.pad, self.density))

    def _folded(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> tuple[list[Array], bool]:
        """Forces per class, each (batch, columns) [N], and whether one load stood for itself."""
        single = not isinstance(load, Sequence)
        loads = [load] if single else load
        expected = (*self.surface.node_shape, 3)
        for one in loads:
            if one.forces.shape != expected:
                raise InfluenceError(
                    f"the load has nodal forces of shape {one.forces.shape}, but this surface takes {expected}: it was "
                    "made for another pad or mesh. Make the footprint and the load with these influence matrices."
                )
        batch = np.stack([one.forces for one in loads])
        if not np.isfinite(batch).all():
            raise InfluenceError("the load holds NaN or infinite nodal forces; check the traction it was made from.")
        folded = (fold_forces(batch, parity).reshape(len(batch), -1) for parity in PARITIES)
        return [forces[:, columns] for forces, columns in zip(folded, self._columns, strict=True)], single

    def _responses(self, folded: list[Array], kind: str, sensing_layer: int, width: int) -> Array:
        """Stress of each class at the folded points, shape (batch, classes, points, width) [Pa]."""
        classes = []
        for parity, forces in zip(PARITIES, folded, strict=True):
            table = self.tables[table_name(kind, parity, sensing_layer)]
            classes.append(_apply(forces, table).reshape(len(forces), -1, width))
        return np.stack(classes, axis=1)

    def _unfold(self, responses: Array, odd: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]) -> Array:
        """Responses of classes (batch, classes, points, width) in all quadrants (batch, quadrants, points, width)."""
        whole = np.einsum("qc,bcpw->bqpw", QUADRANT_SIGNS, responses)
        for quadrant, (sign_x, sign_y) in enumerate(QUADRANTS):
            whole[:, quadrant] *= np.where(odd[0], sign_x, 1) * np.where(odd[1], sign_y, 1)
        return whole

    def _layer_readings(self, folded: list[Array], sensing_layer: int) -> Array:
        """Readings of one sensing layer, shape (batch, taxels) [Pa]."""
        responses = self._responses(folded, "deviatoric", sensing_layer, DEVIATORIC_COUNT)
        # Signs of odd coordinates do not change their norm.
        norms = von_mises(np.einsum("qc,bcpw->bqpw", QUADRANT_SIGNS, responses))
        return (self._averages[sensing_layer] @ norms.reshape(len(norms), -1).T).T


#: Deviatoric coordinates that change sign under x -> -x (xy and zx) and under y -> -y (xy and yz).
_ODD_COORDINATES = (np.array([0, 0, 1, 0, 1], dtype=bool), np.array([0, 0, 1, 1, 0], dtype=bool))
_NO_ODD = (np.zeros(1, dtype=bool), np.zeros(1, dtype=bool))


def _is_empty(load: SurfaceLoad | Sequence[SurfaceLoad]) -> bool:
    return isinstance(load, Sequence) and len(load) == 0


def _apply(forces: Array, table: npt.NDArray[Any]) -> Array:
    """Product (batch, rows) of forces (batch, columns) and a table (columns, rows), touching only columns in use.

    Forces are scaled to 1 before they are rounded to the table's precision, so that any magnitude keeps its digits.
    """
    scale = np.abs(forces).max(axis=1, initial=0.0)
    scaled = (forces / np.where(scale > 0, scale, 1.0)[:, None]).astype(table.dtype)
    used = np.flatnonzero(scaled.any(axis=0))
    if len(forces) < _DENSE_BATCH:
        # The sparse product adds up rows of the table where they lie, without gathering them first.
        entries = (scaled[:, used].ravel(), np.tile(used, len(forces)), len(used) * np.arange(len(forces) + 1))
        product = sparse.csr_array(entries, shape=scaled.shape) @ table
    else:
        product = scaled[:, used] @ table[used]
    return product * scale[:, None]


def sampling_tables(sampling: Sampling, sensing_layer: int) -> Tables:
    """A sensing layer's sample points and averaging matrix as plain arrays, to be stored with the matrices."""
    average = sampling.average
    arrays = {"data": average.data, "indices": average.indices, "indptr": average.indptr, "points": sampling.positions}
    return {f"sampling {name} {sensing_layer}": array for name, array in arrays.items()}


def _stored_average(tables: Tables, sensing_layer: int) -> sparse.csr_array:
    data, indices, indptr, points = (
        tables[f"sampling {name} {sensing_layer}"] for name in ("data", "indices", "indptr", "points")
    )
    return sparse.csr_array((data, indices, indptr), shape=(len(indptr) - 1, len(QUADRANTS) * len(points)))


def influence_metadata(pad: Pad, density: MeshDensity) -> dict[str, Any]:
    """What is written beside a table: enough to rebuild the pad and to refuse any other."""
    return {"pad": pad.description, "density": asdict(density), "fingerprint": influence_fingerprint(pad, density)}


def influence_fingerprint(pad: Pad, density: MeshDensity) -> str:
    """SHA-256 over the pad, the mesh and the format version: what a table's numbers depend on."""
    description = [FORMAT_VERSION, pad.description, mesh_description(sheet_mesh(pad, density), density)]
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()


def load_influence(
    path: str | Path, pad: Pad | None = None, mesh: str | MeshDensity | None = None
) -> InfluenceMatrices:
    """Map saved influence matrices.

    Args:
        path: file written by `InfluenceMatrices.save`.
        pad: the pad they must belong to; by default the one the file describes.
        mesh: the mesh they must have been built on; by default the one the file describes.

    Raises:
        FileNotFoundError: when there is no such file.
        CorruptInfluenceError: when the file is damaged or not an influence table.
        StaleInfluenceError: when it belongs to another pad, mesh or format version.
    """
    path = Path(path)
    tables, metadata = read_tables(path)
    try:
        stored_pad = _pad_from_description(metadata["pad"])
        stored_density = MeshDensity(
            **{**metadata["density"], "points_per_axis": tuple(metadata["density"]["points_per_axis"])}
        )
        stored_fingerprint = metadata["fingerprint"]
    except (KeyError, TypeError, ValueError) as error:
        raise CorruptInfluenceError(
            f"{path} describes no pad ({error}). Delete it and rebuild: mjtactile build"
        ) from error
    pad = stored_pad if pad is None else pad
    density = stored_density if mesh is None else mesh_density(mesh)
    if stored_fingerprint != influence_fingerprint(pad, density):
        raise StaleInfluenceError(
            f"{path} was built for a {stored_pad.summary} by another mesh, pad or version, but a {pad.summary} was "
            "asked for. Rebuild it: mjtactile build"
        )
    return InfluenceMatrices(pad, density, tables)


def _pad_from_description(description: dict[str, Any]) -> Pad:
    layers = tuple(Layer(**layer) for layer in description["layers"])
    taxels = TaxelGrid(**description["taxels"])
    return Pad(**{**description, "layers": layers, "taxels": taxels})
