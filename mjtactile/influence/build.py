"""Building influence matrices: the stress at every sample point under every nodal force, by finite elements."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from mjtactile._types import Array, Indices, Tables
from mjtactile.errors import MeshError
from mjtactile.fem.dissection import factor_bytes
from mjtactile.fem.mesh import SheetMesh, sheet_mesh
from mjtactile.fem.solution import SweptPad, loads_at_once, swept_steps
from mjtactile.fem.stress import DEVIATORIC_COUNT
from mjtactile.fem.symmetry import MirrorPlanes, Parity, free_in_plane
from mjtactile.fem.taxel_quadrature import layer_sampling
from mjtactile.fidelity import MeshDensity
from mjtactile.influence.table import table_name
from mjtactile.pad import Pad

#: Memory of a pad's solution: copies of a block's displacements, and matrices of (surface unknowns)^2.
_COPIES, _SQUARES = 4, 3


def build_steps(pad: Pad, density: MeshDensity) -> int:
    """Number of times `build_tables` reports progress."""
    return swept_steps(sheet_mesh(pad, density), sum(map(len, _sample_points(pad, density))))


class _Rows(Protocol):
    """Reduces the rows of a stress matrix, see `build_tables`."""

    def __call__(
        self, kind: str, parity: Parity, sensing_layer: int, matrix: npt.NDArray[Any], /
    ) -> npt.NDArray[Any]: ...


def build_tables(
    pad: Pad,
    density: MeshDensity,
    dtype: npt.DTypeLike = np.float32,
    on_step: Callable[[], None] = lambda: None,
    *,
    rows: _Rows = lambda _kind, _parity, _layer, matrix: matrix,
    columns: Callable[[Parity, npt.NDArray[Any]], npt.NDArray[Any]] = lambda _parity, matrix: matrix,
) -> Iterator[Tables]:
    """Influence matrices of each symmetry class.

    Stress is computed for a block of columns at a time, to bound memory. Blocks are solved in parallel.

    Args:
        pad: the sheet.
        density: of the mesh and the sample points.
        dtype: storage precision of the stresses; the surface compliance stays in double precision.
        on_step: called to report progress, `build_steps` times in all, from several threads.
        rows: reduces the rows of a stress matrix (kind, parity, sensing layer, matrix). It gets some columns at a time
            and may combine rows, not columns.
        columns: reduces the columns of a class's matrix (parity, matrix), after `rows`.

    Yields:
        For class c and sensing layer k: "deviatoric c k", (columns, folded points * 5) [Pa/N]; "mean c k",
        (columns, folded points) [Pa/N]; and "compliance c", (columns, columns) [m/N]. Columns are the free degrees
        of freedom (component, y, x) of the quarter's surface; column j is the response to a unit force on it and on
        its mirror images, with the signs of the class.

    Raises:
        MeshError: the equations need more memory than the machine has, or cannot be solved in double precision.
    """
    mesh = sheet_mesh(pad, density)
    layers, storage = _sample_points(pad, density), _Storage(np.dtype(dtype), rows, columns)
    points = np.concatenate(layers)
    swept, workers = SweptPad(mesh, points), _workers(mesh, loads_at_once(len(points)))
    # One thread per block: the threads of a parallel matrix product would wait for each other on a busy machine.
    with threadpool_limits(limits=1, user_api="blas"):
        for parity in MirrorPlanes(*mesh.outer.mirrors).classes:
            count = int(free_in_plane(mesh.quarter(), parity).sum())
            tables, compliance = _ClassTables(parity, count, layers, storage), np.empty((count, count))
            for block in swept.solve(parity, workers, on_step):
                tables.add(block.places, block.deviatoric, block.mean)
                compliance[:, block.places] = block.surface
            yield tables.finished((compliance + compliance.T) / 2)


@dataclass(frozen=True, eq=False)
class _Storage:
    """Precision and reduction of stored matrices, see `build_tables`."""

    dtype: np.dtype
    rows: _Rows
    columns: Callable[[Parity, npt.NDArray[Any]], npt.NDArray[Any]]


def _sample_points(pad: Pad, density: MeshDensity) -> list[Array]:
    """Folded sample points of each sensing layer [m], (points, 3)."""
    return [layer_sampling(pad, k, density.points_at(k)).positions for k in range(pad.sensing_layers)]


def _workers(mesh: SheetMesh, loads: int) -> int:
    """Number of blocks of so many loads to solve in parallel, by cores and memory; a MeshError if not one has room."""
    part = mesh.quarter()
    columns = 3 * part.x.node_count * part.y.node_count
    unknowns = 2 * part.z.element_count * columns
    elements = part.z.element_count, part.y.element_count, part.x.element_count
    number = np.dtype(float).itemsize
    of_block = number * _COPIES * loads * unknowns
    always = factor_bytes(elements) + number * _SQUARES * columns**2
    there_is = _memory_for(always + of_block, mesh)
    return min(available_cores(), max(1, int((there_is / 2 - always) / of_block)))


def _memory_for(needed: float, mesh: SheetMesh) -> float:
    """The machine's memory [bytes]; refuse a mesh that needs more."""
    there_is = _memory()
    if needed > there_is:
        elements = "elements" if mesh.outer.is_flat else f"elements under a {mesh.outer.kind} surface"
        raise MeshError(
            f"a mesh of {mesh.x.element_count} x {mesh.y.element_count} x {mesh.z.element_count} {elements} takes "
            f"{needed / 1e9:.3g} GB of memory to solve; this machine has {there_is / 1e9:.3g} GB. Use a coarser mesh, "
            "or raise the sampling radius or the shallowest depth, which set its size."
        )
    return there_is


def _memory() -> float:
    """Physical memory [bytes]; infinite if the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def available_cores() -> int:
    """Processor cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _ClassTables:
    """Tables of one class, filled block by block."""

    def __init__(self, parity: Parity, count: int, layers: list[Array], storage: _Storage) -> None:
        self._parity, self._count, self._storage = parity, count, storage
        #: Fraction of a column's total force, on a node and its mirror images, that acts on the solved part [-].
        self._share = 0.5 ** (abs(parity.x) + abs(parity.y))
        self._ends = np.cumsum([0, *(len(layer) for layer in layers)]).tolist()
        self._tables: Tables = {}

    def add(self, places: Indices, deviatoric: Array, mean: Array) -> None:
        """Store some columns.

        Args:
            places: indices of the columns.
            deviatoric: deviatoric coordinates [Pa/N], (points, 5, columns).
            mean: mean stress [Pa/N], (points, columns).
        """
        for k, (start, end) in enumerate(itertools.pairwise(self._ends)):
            stress = deviatoric[start:end].reshape((end - start) * DEVIATORIC_COUNT, -1)
            for kind, of_kind in (("deviatoric", stress), ("mean", mean[start:end])):
                whole = np.ascontiguousarray(self._share * of_kind.T, dtype=self._storage.dtype)
                kept = self._storage.rows(kind, self._parity, k, whole)
                name = table_name(kind, self._parity, k)
                if name not in self._tables:
                    self._tables[name] = np.empty((self._count, kept.shape[1]), self._storage.dtype)
                self._tables[name][places] = kept

    def finished(self, compliance: Array) -> Tables:
        """All tables, after the last column was stored.

        Raises:
            MeshError: a number is not finite.
        """
        for name in list(self._tables):
            self._tables[name] = self._storage.columns(self._parity, self._tables[name])
        self._tables[table_name("compliance", self._parity)] = self._share * compliance
        if not all(np.isfinite(table).all() for table in self._tables.values()):
            raise MeshError(
                f"the stress in the pad exceeds the range of {self._storage.dtype.name}. The pad's sizes or moduli "
                "differ too much from each other, or from those of real pads: lengths are metres (5 mm is 5e-3), "
                "moduli pascals (3 MPa is 3e6)."
            )
        return self._tables
