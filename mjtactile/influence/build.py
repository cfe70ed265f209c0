"""Building influence matrices: the stress at every sample point under every nodal force, by finite elements."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from mjtactile._types import Array, Tables
from mjtactile.errors import MeshError
from mjtactile.fem.block_elimination import EliminatedSheet
from mjtactile.fem.curved.dissection import BLOCK, factor_bytes
from mjtactile.fem.curved.solution import SweptPad, swept_steps
from mjtactile.fem.mesh import SheetMesh, sheet_mesh
from mjtactile.fem.stiffness import PARITIES, Parity, Stiffness, assemble, free_in_plane
from mjtactile.fem.stress import DEVIATORIC_COUNT, StressSampler
from mjtactile.fem.symmetry import MirrorPlanes
from mjtactile.fem.taxel_quadrature import layer_sampling
from mjtactile.fidelity import MeshDensity
from mjtactile.influence.table import table_name
from mjtactile.pad import Pad

#: Memory for stress recovery per class being solved [bytes], and what it needs for each point and column [bytes].
_BLOCK_BYTES, _BYTES_PER_POINT = 1 << 28, 8 * 24
#: Memory of elimination in matrices of (surface degrees of freedom)^2: per element layer, and for everything else.
_MATRICES_PER_LAYER, _MATRICES_BESIDES = 3, 10
#: Elements in the plane of a flat sheet above which it is solved as curved pads are. The time of elimination grows with
#: the cube of their number, that of dissection less: with 34 x 22 x 5 elements it took a sixth.
_DISSECTED_FROM = 600
#: Memory of a swept pad's solution: copies of a block's displacements, and matrices of (surface unknowns)^2.
_SWEPT_COPIES, _SWEPT_SQUARES = 4, 3


def build_steps(pad: Pad, density: MeshDensity) -> int:
    """Number of times `build_tables` reports progress."""
    mesh = sheet_mesh(pad, density)
    if _is_dissected(mesh):
        return swept_steps(mesh)
    points = sum(len(layer) for layer in _sample_points(pad, density))
    quarter = mesh.quarter()
    return sum(
        mesh.z.element_count + len(_blocks(int(free_in_plane(quarter, parity).sum()), points)) * (mesh.z.node_count - 1)
        for parity in _solved_classes(mesh)
    )


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
    """Influence matrices of each symmetry class, in no particular order.

    Classes are solved in parallel, one thread each with a share of the cores; threads then wait less than with all
    cores on one class. Stress is computed for a block of columns at a time, to bound memory.

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
    if _is_dissected(mesh):
        yield from _swept_tables(mesh, layers, storage, on_step)
        return
    workers = _workers(mesh)
    stiffness = assemble(mesh.quarter())
    # The class that also gives its diagonal mirror image takes longest and is started first.
    parities = sorted(_solved_classes(mesh), key=lambda parity: not _has_mirror_image(mesh, parity))
    share = threadpool_limits(limits=max(1, available_cores() // workers), user_api="blas")
    with share, ThreadPoolExecutor(max_workers=workers) as executor:
        futures = [
            executor.submit(_solve_class, mesh, stiffness, parity, layers, storage, on_step) for parity in parities
        ]
        for future in as_completed(futures):
            yield from future.result()


@dataclass(frozen=True, eq=False)
class _Storage:
    """Precision and reduction of stored matrices, see `build_tables`."""

    dtype: np.dtype
    rows: _Rows
    columns: Callable[[Parity, npt.NDArray[Any]], npt.NDArray[Any]]


def _sample_points(pad: Pad, density: MeshDensity) -> list[Array]:
    """Folded sample points of each sensing layer [m], (points, 3)."""
    return [layer_sampling(pad, k, density.points_at(k)).positions for k in range(pad.sensing_layers)]


def _is_dissected(mesh: SheetMesh) -> bool:
    """Whether the mesh is solved by the elements and equations of curved pads."""
    return not mesh.outer.is_flat or mesh.x.element_count * mesh.y.element_count > _DISSECTED_FROM


def _swept_tables(
    mesh: SheetMesh, layers: list[Array], storage: _Storage, on_step: Callable[[], None]
) -> Iterator[Tables]:
    """Tables by the elements and equations of curved pads; they solve flat pads too."""
    swept = SweptPad(mesh, np.concatenate(layers))
    workers = _swept_workers(mesh)
    # One thread per block: the threads of a parallel matrix product would wait for each other on a busy machine.
    with threadpool_limits(limits=1, user_api="blas"):
        for parity in MirrorPlanes(*mesh.outer.mirrors).classes:
            free = free_in_plane(mesh.quarter(), parity)
            of_class = _ClassColumns(parity, free, np.arange(int(free.sum())))
            tables = _ClassTables(of_class, layers, storage)
            compliance = np.empty((len(of_class.order), len(of_class.order)))
            for block in swept.solve(parity, workers, on_step):
                tables.add(block.places, block.deviatoric, block.mean)
                compliance[:, block.places] = block.surface
            yield tables.finished((compliance + compliance.T) / 2)


def _swept_workers(mesh: SheetMesh) -> int:
    """Number of blocks of a swept pad to solve in parallel, within the available cores and memory.

    Raises:
        MeshError: there is not enough memory for one block.
    """
    part = mesh.quarter()
    columns = 3 * part.x.node_count * part.y.node_count
    unknowns = 2 * part.z.element_count * columns
    elements = part.z.element_count, part.y.element_count, part.x.element_count
    number = np.dtype(float).itemsize
    of_block = number * _SWEPT_COPIES * BLOCK * unknowns
    always = factor_bytes(elements) + number * _SWEPT_SQUARES * columns**2
    elements_said = "elements" if mesh.outer.is_flat else f"elements under a {mesh.outer.kind} surface"
    there_is = _memory_for(always + of_block, mesh, elements_said)
    return min(available_cores(), max(1, int((there_is / 2 - always) / of_block)))


def _blocks(columns: int, points: int) -> list[slice]:
    """Slices of columns whose stress is computed at once, within the bound on memory."""
    size = max(1, _BLOCK_BYTES // (_BYTES_PER_POINT * points))
    return [slice(first, min(first + size, columns)) for first in range(0, columns, size)]


def _workers(mesh: SheetMesh) -> int:
    """Number of classes to solve in parallel, within the available cores and memory.

    Raises:
        MeshError: there is not enough memory for one class.
    """
    quarter = mesh.quarter()
    columns = 3 * quarter.x.node_count * quarter.y.node_count
    matrices = _MATRICES_PER_LAYER * mesh.z.element_count + _MATRICES_BESIDES
    needed = np.dtype(float).itemsize * columns**2 * matrices + _BLOCK_BYTES
    there_is = _memory_for(needed, mesh, "elements")
    return min(len(_solved_classes(mesh)), available_cores(), max(1, int(there_is / 2 / needed)))


def _memory_for(needed: float, mesh: SheetMesh, elements: str) -> float:
    """The machine's memory [bytes]; refuse a mesh that needs more."""
    there_is = _memory()
    if needed > there_is:
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


def _is_square(mesh: SheetMesh) -> bool:
    return np.array_equal(mesh.x.vertices, mesh.y.vertices)


def _has_mirror_image(mesh: SheetMesh, parity: Parity) -> bool:
    """Whether swapping x and y, a symmetry of square sheets, maps this class to another."""
    return _is_square(mesh) and parity == Parity(1, -1)


def _solved_classes(mesh: SheetMesh) -> list[Parity]:
    """Classes that must be solved; the others follow by swapping x and y."""
    return [parity for parity in PARITIES if not (_is_square(mesh) and parity == Parity(-1, 1))]


def _solve_class(
    mesh: SheetMesh,
    stiffness: Stiffness,
    parity: Parity,
    layers: list[Array],
    storage: _Storage,
    on_step: Callable[[], None],
) -> list[Tables]:
    """Tables of one class and, if there is one, of the class that follows by swapping x and y."""
    sheet = EliminatedSheet(stiffness, parity, on_step)
    points = np.concatenate(layers)
    count = len(sheet.surface_compliance)
    classes = [_ClassColumns(parity, sheet.free, np.arange(count))]
    if _has_mirror_image(mesh, parity):
        classes.append(classes[0].transposed())
    samplers = [StressSampler(mesh, c.parity, points) for c in classes]
    tables = [_ClassTables(columns, layers, storage) for columns in classes]
    for block in _blocks(count, len(points)):
        for columns, sampler in zip(classes, samplers, strict=True):
            sampler.restart(len(columns.places(block)))
        for plane, displacements in sheet.descend(block):
            for columns, sampler in zip(classes, samplers, strict=True):
                sampler.add(plane, columns.free, displacements[columns.order])
            on_step()
        for columns, sampler, of_class in zip(classes, samplers, tables, strict=True):
            of_class.add(columns.places(block), *sampler.result())
    return [of_class.finished(sheet.surface_compliance) for of_class in tables]


@dataclass(frozen=True, eq=False)
class _ClassColumns:
    """Free degrees of freedom of a class, and their order among those of the solved class."""

    parity: Parity
    free: np.ndarray
    order: np.ndarray

    @property
    def share(self) -> float:
        """Fraction of a column's total force, on a node and its mirror images, that acts on the solved part [-]."""
        return 0.5 ** (abs(self.parity.x) + abs(self.parity.y))

    def transposed(self) -> _ClassColumns:
        """The class that this one becomes by swapping x and y."""
        side = int(np.sqrt(self.free.size // 3))
        swap = np.arange(self.free.size).reshape(3, side, side)[[1, 0, 2]].transpose(0, 2, 1).ravel()
        place = np.cumsum(self.free) - 1
        free = self.free[swap]
        return _ClassColumns(Parity(self.parity.y, self.parity.x), free, place[swap[free]])

    def places(self, block: slice) -> npt.NDArray[np.intp]:
        """Indices, among this class's columns, of a block of the solved class's columns."""
        return np.argsort(self.order)[block]


class _ClassTables:
    """Tables of one class, filled block by block."""

    def __init__(self, columns: _ClassColumns, layers: list[Array], storage: _Storage) -> None:
        self._columns, self._storage = columns, storage
        self._ends = np.cumsum([0, *(len(layer) for layer in layers)]).tolist()
        self._tables: Tables = {}

    def add(self, places: npt.NDArray[np.intp], deviatoric: Array, mean: Array) -> None:
        """Store some columns.

        Args:
            places: indices of the columns.
            deviatoric: deviatoric coordinates [Pa/N], (points, 5, columns).
            mean: mean stress [Pa/N], (points, columns).
        """
        for k, (start, end) in enumerate(itertools.pairwise(self._ends)):
            stress = deviatoric[start:end].reshape((end - start) * DEVIATORIC_COUNT, -1)
            for kind, of_kind in (("deviatoric", stress), ("mean", mean[start:end])):
                whole = np.ascontiguousarray(self._columns.share * of_kind.T, dtype=self._storage.dtype)
                kept = self._storage.rows(kind, self._columns.parity, k, whole)
                name = table_name(kind, self._columns.parity, k)
                if name not in self._tables:
                    self._tables[name] = np.empty((len(self._columns.order), kept.shape[1]), self._storage.dtype)
                self._tables[name][places] = kept

    def finished(self, compliance: Array) -> Tables:
        """All tables, after the last column was stored.

        Raises:
            MeshError: a number is not finite.
        """
        parity, order = self._columns.parity, self._columns.order
        for name in list(self._tables):
            self._tables[name] = self._storage.columns(parity, self._tables[name])
        self._tables[table_name("compliance", parity)] = self._columns.share * compliance[np.ix_(order, order)]
        if not all(np.isfinite(table).all() for table in self._tables.values()):
            raise MeshError(
                f"the stress in the pad exceeds the range of {self._storage.dtype.name}. The pad's sizes or moduli "
                "differ too much from each other, or from those of real pads: lengths are metres (5 mm is 5e-3), "
                "moduli pascals (3 MPa is 3e6)."
            )
        return self._tables
