"""Why the sheet is solved by block elimination: `python benchmarks/solver.py` compares it with sparse factors.

Every column of one symmetry class of the paper's pad on mesh "default" is wanted. A sparse factor is timed on a few
right-hand sides and scaled to all. cholespy is optional: pip install cholespy.
"""

import time

import numpy as np
import scipy.sparse.linalg

from mjtactile.fem.block_elimination import EliminatedSheet
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.stiffness import PARITIES, assemble, free_in_plane
from mjtactile.fidelity import mesh_density
from mjtactile.pad import Pad

SAMPLE = 64


def main() -> None:
    mesh = sheet_mesh(Pad(), mesh_density("default")).quarter()
    stiffness, parity = assemble(mesh), PARITIES[0]
    free = np.tile(free_in_plane(mesh, parity), stiffness.plane_count)
    free[: free.size // stiffness.plane_count] = False
    kept = np.flatnonzero(free)
    matrix = stiffness.matrix()[kept][:, kept].tocsc()
    columns = int(free_in_plane(mesh, parity).sum())
    forces = np.random.default_rng(0).normal(size=(len(kept), SAMPLE))
    print(f"{len(kept)} unknowns, {columns} columns wanted\n")
    print("| solver | factor | per column | all columns |\n|---|---|---|---|")

    start = time.perf_counter()
    for _ in EliminatedSheet(stiffness, parity).descend():
        pass
    print(f"| block elimination | - | - | {time.perf_counter() - start:.1f} s |")

    start = time.perf_counter()
    factor = scipy.sparse.linalg.splu(matrix)
    report("scipy splu", time.perf_counter() - start, lambda: factor.solve(forces), columns)
    try:
        import cholespy  # type: ignore[import-not-found]  # optional, as said above
    except ImportError:
        return
    compressed = matrix.tocsr()
    start = time.perf_counter()
    cholesky = cholespy.CholeskySolverD(
        len(kept),
        compressed.indptr.astype(np.int32),
        compressed.indices.astype(np.int32),
        compressed.data,
        cholespy.MatrixType.CSR,
    )
    solution = np.zeros_like(forces)
    report("cholespy", time.perf_counter() - start, lambda: cholesky.solve(forces, solution), columns)


def report(name, factor_time, solve, columns) -> None:
    start = time.perf_counter()
    solve()
    per_column = (time.perf_counter() - start) / SAMPLE
    total = factor_time + columns * per_column
    print(f"| {name} | {factor_time:.1f} s | {per_column * 1e3:.1f} ms | {total:.0f} s |")


if __name__ == "__main__":
    main()
