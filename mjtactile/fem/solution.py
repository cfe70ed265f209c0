"""Responses of a swept pad to every surface load, for each symmetry class, with the stress at points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array, Indices
from mjtactile.fem.dissection import DissectedPad
from mjtactile.fem.elements import SweptElements
from mjtactile.fem.mesh import SheetMesh
from mjtactile.fem.stress import DEVIATORIC_COUNT
from mjtactile.fem.stress_rows import StressRows
from mjtactile.fem.symmetry import MirrorPlanes, Parity, free_in_plane

#: Most surface loads solved at once.
MOST_LOADS = 384
#: Memory for the stress of loads solved at once [bytes], and what it needs for each point and load [bytes].
_STRESS_BYTES, _BYTES_PER_POINT = 1 << 28, 8 * 24
#: Points whose rows are made at once: what they are made from takes several times their own memory.
_POINTS = 8192
#: Progress of one block of loads, in units of the elimination of one column of elements.
_STEPS_OF_BLOCK = 40


@dataclass(frozen=True, eq=False)
class SolvedBlock:
    """Responses to unit forces on some of the surface's free degrees of freedom."""

    places: Indices  #: indices of the loaded degrees of freedom in the order (component, y, x), (forces,)
    deviatoric: Array  #: deviatoric coordinates at the points, see stress.py [Pa/N], (points, 5, forces)
    mean: Array  #: mean stress at the points [Pa/N], (points, forces)
    surface: Array  #: displacements of the surface's free degrees of freedom [m/N], (free, forces)


class SweptPad:
    """A swept pad, and points (n, 3) [m] of the part that symmetry leaves, at which its stress is computed."""

    def __init__(self, mesh: SheetMesh, points: Array) -> None:
        half = float(mesh.x.vertices[-1]), float(mesh.y.vertices[-1])
        feet = points * np.array([1.0, 1.0, -1.0]) if mesh.outer.is_flat else mesh.outer.feet(points, half)[0]
        self.mesh, self._loads = mesh, loads_at_once(len(points))
        self._rows = [StressRows(mesh, feet[first : first + _POINTS]) for first in range(0, len(feet), _POINTS)]
        self._part = mesh.quarter()
        #: Elements of the part that symmetry leaves.
        self.elements = SweptElements(self._part)

    def equations(
        self, parity: Parity, executor: ThreadPoolExecutor | None = None, on_column: Callable[[], None] = lambda: None
    ) -> DissectedPad:
        """The factorised equations of a symmetry class, see `DissectedPad`."""
        return DissectedPad(self.elements, free_in_plane(self._part, parity), executor, on_column)

    def stress(self, parity: Parity, equations: DissectedPad) -> Callable[[Array], tuple[Array, Array]]:
        """The function from displacements in a symmetry class [m], (unknowns, columns), to the stress at the points.

        It returns deviatoric coordinates, see stress.py, (points, 5, columns), and mean stress, (points, columns) [Pa].
        """
        rows = [some.rows(parity, equations.number) for some in self._rows]

        def recovered(displacements: Array) -> tuple[Array, Array]:
            parts = [combine @ (recover @ displacements) for combine, recover in rows]
            found = np.concatenate(parts).reshape(-1, DEVIATORIC_COUNT + 1, displacements.shape[1])
            return found[:, :DEVIATORIC_COUNT], found[:, DEVIATORIC_COUNT]

        return recovered

    def solve(self, parity: Parity, workers: int, on_step: Callable[[], None]) -> Iterator[SolvedBlock]:
        """Responses to a unit force on each free degree of freedom of the surface, block by block.

        Args:
            parity: symmetry class of the responses.
            workers: number of threads. Two eliminate one half of the pad each; then all solve blocks.
            on_step: called to report progress, `swept_steps` times for all classes, from several threads.

        Raises:
            MeshError: the equations cannot be solved in double precision.
        """
        with ThreadPoolExecutor(workers) as executor:
            equations = self.equations(parity, executor, on_step)
            stress = self.stress(parity, equations)

            def solved(places: Indices) -> SolvedBlock:
                displacements = equations.displacements(places)
                deviatoric, mean = stress(displacements)
                surface = displacements[equations.surface]
                for _ in range(_STEPS_OF_BLOCK):
                    on_step()
                return SolvedBlock(places, deviatoric, mean, surface)

            blocks = equations.blocks(self._loads)
            # At most one block per thread at a time: finished blocks need memory.
            for first in range(0, len(blocks), workers):
                yield from executor.map(solved, blocks[first : first + workers])


def loads_at_once(points: int) -> int:
    """Number of surface loads solved at once, so that the stress at a number of points has room."""
    return min(MOST_LOADS, max(1, _STRESS_BYTES // (_BYTES_PER_POINT * points)))


def swept_steps(mesh: SheetMesh, points: int) -> int:
    """Number of progress reports of `SweptPad.solve`, for all classes together and the stress at a number of points."""
    part, steps = mesh.quarter(), 0
    for parity in MirrorPlanes(*mesh.outer.mirrors).classes:
        blocks = -(-int(free_in_plane(part, parity).sum()) // loads_at_once(points))
        steps += part.x.element_count * part.y.element_count + _STEPS_OF_BLOCK * blocks
    return steps
