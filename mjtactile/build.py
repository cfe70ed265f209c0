"""Building influence matrices: every surface load through the finite elements, stress read at every sample point."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from mjtactile.elimination import EliminatedSheet
from mjtactile.fem import PARITIES, Parity, Stiffness, assemble
from mjtactile.mesh import MeshDensity, SheetMesh, sheet_mesh
from mjtactile.pad import Array, Pad
from mjtactile.sampling import layer_sampling
from mjtactile.stress import DEVIATORIC_COUNT, StressSampler
from mjtactile.table import Tables, table_name

#: A column's unit force acts on a node and, with the class's signs, on its mirror images; a quarter model sees a
#: quarter of their sum.
_QUARTER = 0.25


def build_steps(pad: Pad, density: MeshDensity) -> int:
    """Number of times `build_tables` reports progress."""
    mesh = sheet_mesh(pad, density)
    return len(_solved_classes(mesh)) * (mesh.z.element_count + mesh.z.node_count - 1)


def build_tables(
    pad: Pad, density: MeshDensity, dtype: npt.DTypeLike = np.float32, on_step: Callable[[], None] = lambda: None
) -> Iterator[Tables]:
    """Influence matrices of one symmetry class after another, in no particular order.

    Classes are solved side by side, one thread each with its share of the cores: that wastes less time waiting than
    all cores on one class, above all when the machine is busy with something else too.

    Args:
        pad: the sheet.
        density: of the mesh and the sample points.
        dtype: storage precision of the stresses; the surface compliance stays in double precision.
        on_step: called after each bounded piece of work, `build_steps` times in all, from several threads.

    Yields:
        For class c and sensing layer k: "deviatoric c k", (columns, folded points * 5) [Pa/N]; "mean c k",
        (columns, folded points) [Pa/N]; and "compliance c", (columns, columns) [m/N]. Columns are the free degrees
        of freedom (component, y, x) of the quarter's surface; column j is the response to a unit force on it and on
        its mirror images, with the signs of the class.
    """
    mesh = sheet_mesh(pad, density)
    stiffness = assemble(mesh.quarter())
    layers = [layer_sampling(pad, k, density.points_at(k)).positions for k in range(len(pad.depths))]
    # The class that also yields its diagonal mirror image takes longest and goes first.
    parities = sorted(_solved_classes(mesh), key=lambda parity: not _has_mirror_image(mesh, parity))
    workers = min(len(parities), available_cores())
    share = threadpool_limits(limits=max(1, available_cores() // workers), user_api="blas")
    with share, ThreadPoolExecutor(max_workers=workers) as executor:
        futures = [
            executor.submit(_solve_class, mesh, stiffness, parity, layers, np.dtype(dtype), on_step)
            for parity in parities
        ]
        for future in as_completed(futures):
            yield from future.result()


def available_cores() -> int:
    """Processor cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _is_square(mesh: SheetMesh) -> bool:
    return np.array_equal(mesh.x.vertices, mesh.y.vertices)


def _has_mirror_image(mesh: SheetMesh, parity: Parity) -> bool:
    """Whether a square sheet's diagonal mirror turns this class into another."""
    return _is_square(mesh) and parity == Parity(1, -1)


def _solved_classes(mesh: SheetMesh) -> list[Parity]:
    """Classes that need a solution of their own."""
    return [parity for parity in PARITIES if not (_is_square(mesh) and parity == Parity(-1, 1))]


def _solve_class(
    mesh: SheetMesh,
    stiffness: Stiffness,
    parity: Parity,
    layers: list[Array],
    dtype: np.dtype,
    on_step: Callable[[], None],
) -> list[Tables]:
    """Tables of one class and, where the diagonal makes another class its copy, of that class."""
    sheet = EliminatedSheet(stiffness, parity, on_step)
    points = np.concatenate(layers)
    classes = [_ClassColumns(parity, sheet.free, np.arange(len(sheet.surface_compliance)))]
    if _has_mirror_image(mesh, parity):
        classes.append(classes[0].transposed())
    samplers = [StressSampler(mesh, c.parity, points, len(c.order)) for c in classes]
    for plane, displacements in sheet.descend():
        for columns, sampler in zip(classes, samplers, strict=True):
            sampler.add(plane, columns.free, displacements[np.ix_(columns.order, columns.order)])
        on_step()
    return [
        _class_tables(columns, sampler, sheet.surface_compliance, layers, dtype)
        for columns, sampler in zip(classes, samplers, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class _ClassColumns:
    """Free degrees of freedom of a class, and their order among those of the class that was solved."""

    parity: Parity
    free: np.ndarray
    order: np.ndarray

    def transposed(self) -> _ClassColumns:
        """The class that x <-> y turns this one into."""
        side = int(np.sqrt(self.free.size // 3))
        swap = np.arange(self.free.size).reshape(3, side, side)[[1, 0, 2]].transpose(0, 2, 1).ravel()
        place = np.cumsum(self.free) - 1
        free = self.free[swap]
        return _ClassColumns(Parity(self.parity.y, self.parity.x), free, place[swap[free]])


def _class_tables(
    columns: _ClassColumns, sampler: StressSampler, compliance: Array, layers: list[Array], dtype: np.dtype
) -> Tables:
    deviatoric, mean = sampler.result()
    parity, order = columns.parity, columns.order
    tables: Tables = {table_name("compliance", parity): _QUARTER * compliance[np.ix_(order, order)]}
    ends = np.cumsum([0, *(len(layer) for layer in layers)])
    for k, (start, end) in enumerate(itertools.pairwise(ends)):
        stress = deviatoric[start:end].reshape((end - start) * DEVIATORIC_COUNT, -1)
        tables[table_name("deviatoric", parity, k)] = np.ascontiguousarray(_QUARTER * stress.T, dtype=dtype)
        tables[table_name("mean", parity, k)] = np.ascontiguousarray(_QUARTER * mean[start:end].T, dtype=dtype)
    return tables
