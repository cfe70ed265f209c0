"""Why pads are solved by dissection: `python benchmarks/solver.py` compares it with sparse factors.

Every column of one symmetry class of the paper's pad on mesh "default" is wanted. A sparse factor is timed on a few
right-hand sides and scaled to all. All of them work in one thread. cholespy is optional: pip install cholespy.
"""

import time

import numpy as np
import scipy.sparse.linalg
from threadpoolctl import threadpool_limits

from mjtactile.fem.dissection import DissectedPad
from mjtactile.fem.elements import SweptElements
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.solution import MOST_LOADS
from mjtactile.fem.symmetry import BOTH, free_in_plane
from mjtactile.fidelity import mesh_density
from mjtactile.pad import Pad

SAMPLE = 64


def main() -> None:
    quarter = sheet_mesh(Pad(), mesh_density("default")).quarter()
    elements, free = SweptElements(quarter), free_in_plane(quarter, BOTH.classes[0])
    start = time.perf_counter()
    equations = DissectedPad(elements, free)
    factored = time.perf_counter()
    for block in equations.blocks(MOST_LOADS):
        equations.displacements(block)
    solved = time.perf_counter()
    matrix = equations.restricted(elements.matrix()).tocsr()
    columns = len(equations.surface)
    forces = np.random.default_rng(0).normal(size=(equations.count, SAMPLE))
    print(f"{equations.count} unknowns, {columns} columns wanted\n")
    print("| solver | factor | per column | all columns |\n|---|---|---|---|")
    report("dissection", factored - start, (solved - factored) / columns, columns)

    start = time.perf_counter()
    factor = scipy.sparse.linalg.splu(matrix.tocsc())
    report("scipy splu", time.perf_counter() - start, seconds_per_column(lambda: factor.solve(forces)), columns)
    try:
        import cholespy  # type: ignore[import-not-found]  # optional, as said above
    except ImportError:
        return
    start = time.perf_counter()
    cholesky = cholespy.CholeskySolverD(
        equations.count,
        matrix.indptr.astype(np.int32),
        matrix.indices.astype(np.int32),
        matrix.data,
        cholespy.MatrixType.CSR,
    )
    solution = np.zeros_like(forces)
    factoring = time.perf_counter() - start
    report("cholespy", factoring, seconds_per_column(lambda: cholesky.solve(forces, solution)), columns)


def seconds_per_column(solve) -> float:
    start = time.perf_counter()
    solve()
    return (time.perf_counter() - start) / SAMPLE


def report(name, factoring, per_column, columns) -> None:
    total = factoring + columns * per_column
    print(f"| {name} | {factoring:.1f} s | {per_column * 1e3:.1f} ms | {total:.1f} s |")


if __name__ == "__main__":
    with threadpool_limits(limits=1):
        main()
