"""Solving a pad for many surface loads, by nested dissection of the plane.

Columns of elements are merged in pairs, pairs of pairs and so on. At each merge the interior unknowns are eliminated;
those shared with the outside remain (George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal.
10, 1973; Duff and Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM Trans. Math.
Softw. 9, 1983). Every step is a dense matrix product, for all columns of the influence matrices in a block at once. A
sparse Cholesky factor would be applied to thousands of right-hand sides; docs/solver.md compares the two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.linalg import cho_solve, get_lapack_funcs, solve_triangular

from mjtactile._types import Array, Indices, Mask
from mjtactile.errors import MeshError
from mjtactile.fem.elements import NODES, SweptElements


@dataclass(frozen=True, eq=False)
class _Front:
    """A union of element columns whose inner unknowns are eliminated."""

    inner: slice  #: of the unknowns that are eliminated here
    outer: Indices  #: indices of the unknowns shared with other unions
    factor: Array  #: Cholesky factor of the stiffness of the inner unknowns
    from_outer: Array  #: matrix in the back-substitution u_inner = K^-1 f - from_outer u_outer
    children: tuple[_Front, ...]  #: the two unions it was merged from; none for a single column of elements


#: Unknowns that a union shares with others, their condensed stiffness, and the union (None for a single column).
_Part = tuple[Indices, Array, _Front | None]

#: Element columns from west to east and from south to north.
_Rectangle = tuple[int, int, int, int]


class DissectedPad:
    """The factorised equations of a swept pad.

    Args:
        elements: of the pad, or of the part that symmetry leaves.
        free: mask over a plane's degrees of freedom (component, y, x); False where symmetry fixes one at zero.
        executor: threads in which the two halves of the pad are eliminated in parallel.
        on_column: called after each column of elements to report progress, from several threads.

    Raises:
        MeshError: the stiffness is not positive definite in double precision.
    """

    def __init__(
        self,
        elements: SweptElements,
        free: Mask,
        executor: ThreadPoolExecutor | None = None,
        on_column: Callable[[], None] = lambda: None,
    ) -> None:
        layers, rows, columns = elements.shape
        self._elements, self._on_column = elements, on_column
        self._planes = 2 * layers
        nodes = 2 * rows + 1, 2 * columns + 1
        in_plane = free.reshape(3, *nodes).transpose(1, 2, 0)
        mask = np.broadcast_to(in_plane[:, :, None, :], (*nodes, self._planes, 3))
        eliminating = _elimination_order(rows, columns)
        of_unknown = np.broadcast_to(eliminating[:, :, None, None], mask.shape)[mask]
        #: Number of all unknowns.
        self.count = len(of_unknown)
        in_order = np.argsort(of_unknown, kind="stable")
        #: Number of each unknown, (nodes y, nodes x, planes above the base, 3); -1 where symmetry fixes it at zero.
        #: Numbers are in the order of elimination.
        self.number: Indices = np.full(mask.shape, -1)
        self.number[mask] = np.argsort(in_order)
        self._ends = np.cumsum(np.bincount(of_unknown))
        self._rows: dict[int, Array] = {}
        remaining, _, whole = self._eliminated((0, columns, 0, rows), executor)
        assert not len(remaining)
        #: Unions of element columns, each after those that it was merged from.
        self._fronts = _in_order(whole)
        self._place = {id(front): place for place, front in enumerate(self._fronts)}
        self._rows.clear()
        on_top = self.number[:, :, -1].transpose(2, 0, 1).ravel()
        #: Unknowns of the surface, in the order (component, y, x).
        self.surface: Indices = on_top[on_top >= 0]

    def blocks(self, size: int) -> list[Indices]:
        """Indices of the surface's unknowns in blocks of up to `size` neighbours, each to be solved at once."""
        sorted_places = np.argsort(self.surface)
        return [sorted_places[first : first + size] for first in range(0, len(sorted_places), size)]

    def nodal(self, displacements: Array) -> Array:
        """Displacements of unknowns, (unknowns, columns), at all nodes, (plane, y, x, component, columns) [m].

        They are zero on the base and where symmetry fixes them.
        """
        padded = np.concatenate([displacements, np.zeros((1, displacements.shape[1]))])  # number -1 is the last row
        above = padded[self.number].transpose(2, 0, 1, 3, 4)
        return np.concatenate([np.zeros_like(above[:1]), above])

    def restricted(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """A matrix over all nodal displacements, see `SweptElements.matrix`, on the unknowns alone."""
        number = np.full((self._planes + 1, *self.number.shape[:2], 3), -1)
        number[1:] = self.number.transpose(2, 0, 1, 3)
        places = np.argsort(number, axis=None, kind="stable")[-self.count :]
        return sparse.csr_array(matrix[places][:, places])

    def displacements(self, places: Indices) -> Array:
        """Displacements of all unknowns under unit forces on some of the surface's [m/N], (unknowns, forces)."""
        forces = np.zeros((self.count, len(places)))
        forces[self.surface[places], np.arange(len(places))] = 1.0
        return self.solve(forces)

    def solve(self, forces: Array) -> Array:
        """Displacements [m] under forces [N], (unknowns, columns); the array of forces is overwritten with them."""
        loaded = np.zeros(len(self._fronts), dtype=bool)
        for place, front in enumerate(self._fronts):
            below = any(loaded[self._place[id(child)]] for child in front.children)
            loaded[place] = below or forces[front.inner].any()
            if loaded[place]:
                forces[front.outer] -= front.from_outer.T @ forces[front.inner]
        for place in reversed(range(len(self._fronts))):
            front = self._fronts[place]
            inner = front.from_outer @ forces.take(front.outer, axis=0)
            if loaded[place]:
                inner -= cho_solve((front.factor, True), forces[front.inner], check_finite=False)
            np.negative(inner, out=forces[front.inner])
        return forces

    def _eliminated(self, rectangle: _Rectangle, executor: ThreadPoolExecutor | None = None) -> _Part:
        """A rectangle of element columns with its inner unknowns eliminated."""
        halves = _halves(rectangle)
        several = map if executor is None else executor.map
        parts = list(several(self._eliminated, halves)) or [self._column(rectangle[2], rectangle[0])]
        unknowns = np.unique(np.concatenate([part[0] for part in parts]))
        stiffness = np.zeros((len(unknowns), len(unknowns)))
        for of_part, resistance, _ in parts:
            places = np.searchsorted(unknowns, of_part)
            stiffness[np.ix_(places, places)] += resistance
        children = tuple(front for _, _, front in parts if front is not None)
        del parts
        # Numbers are in the order of elimination, so inner unknowns come first.
        first = int(unknowns[0])
        end = int(self._ends[np.searchsorted(self._ends, first, side="right")])
        count = end - first
        factor = _cholesky(stiffness[:count, :count])
        # The Schur complement subtracts a matrix times its transpose: inverses would lose twice as many digits.
        coupling = solve_triangular(factor, stiffness[:count, count:], lower=True, check_finite=False)
        left = stiffness[count:, count:] - coupling.T @ coupling
        from_outer = solve_triangular(factor, coupling, lower=True, trans=1, check_finite=False)
        outer = unknowns[count:]
        return outer, left, _Front(slice(first, end), outer, factor, from_outer, children)

    def _column(self, row: int, column: int) -> _Part:
        """Stiffness of a column of elements on the clamped base."""
        if row not in self._rows:
            self._rows[row] = self._elements.stiffness_of_row(row)
        of_elements = self._rows[row][column]
        nodes = self.number[2 * row : 2 * row + NODES, 2 * column : 2 * column + NODES]
        # Element degrees of freedom are ordered (z, y, x, component), those of the column (y, x, plane, component).
        local = np.full((self._planes + 1, NODES, NODES, 3), -1)
        local[1:] = np.arange(nodes.size).reshape(nodes.shape).transpose(2, 0, 1, 3)
        stiffness = np.zeros((nodes.size, nodes.size))
        for layer, of_element in enumerate(of_elements):
            places = local[2 * layer : 2 * layer + NODES].ravel()
            kept = places >= 0
            stiffness[np.ix_(places[kept], places[kept])] += of_element[np.ix_(kept, kept)]
        numbers = nodes.ravel()
        free = np.flatnonzero(numbers >= 0)
        free = free[np.argsort(numbers[free])]
        self._on_column()
        return numbers[free], stiffness[np.ix_(free, free)], None


def _halves(rectangle: _Rectangle) -> tuple[_Rectangle, ...]:
    """The two rectangles that one is cut into along its longer side; none of a single column."""
    west, east, south, north = rectangle
    if (east - west, north - south) == (1, 1):
        return ()
    if east - west >= north - south:
        middle = (west + east) // 2
        return (west, middle, south, north), (middle, east, south, north)
    middle = (south + north) // 2
    return (west, east, south, middle), (west, east, middle, north)


def _elimination_order(rows: int, columns: int) -> Indices:
    """For each node of a plane of (rows, columns) elements, the place of the union that eliminates it.

    A union eliminates the nodes inside it, and those on the pad's sides, that its halves have left.
    """
    places = np.full((2 * rows + 1, 2 * columns + 1), -1)
    count = 0

    def visit(rectangle: _Rectangle) -> None:
        nonlocal count
        for half in _halves(rectangle):
            visit(half)
        west, east, south, north = rectangle
        inside = places[
            2 * south + (south > 0) : 2 * north + (north == rows), 2 * west + (west > 0) : 2 * east + (east == columns)
        ]
        inside[inside < 0] = count
        count += 1

    visit((0, columns, 0, rows))
    return places


def _cholesky(matrix: Array) -> Array:
    """Lower Cholesky factor of a stiffness; one that is not positive definite in double precision is a MeshError."""
    (factorise,) = get_lapack_funcs(("potrf",), (matrix,))
    factor, failed = factorise(matrix, lower=1, clean=1)
    if failed:
        raise MeshError(
            "the finite-element equations are not positive definite in double precision. A layer is too thin or too "
            "soft beside its neighbours, too curved, or its Poisson ratio is too near 0.5."
        )
    return factor


def _in_order(front: _Front | None) -> list[_Front]:
    """All unions of a tree in the order of elimination."""
    if front is None:
        return []
    return [one for child in front.children for one in _in_order(child)] + [front]


def factor_bytes(elements: tuple[int, int, int]) -> float:
    """Estimated memory of the factors [bytes] for numbers of elements along (z, y, x)."""
    return 8.0 * sum(_numbers_kept(elements[0], elements[2], elements[1]))


def _numbers_kept(layers: int, wide: int, deep: int) -> Iterator[float]:
    """Approximate number of entries of the factors at each level of the tree."""
    unions = 1
    while wide * deep >= 1:
        longer, shorter = max(wide, deep), min(wide, deep)
        inner, outer = 6.0 * layers * (2 * shorter - 1), 6.0 * layers * 2 * (2 * (longer + shorter))
        yield unions * (inner**2 + inner * (outer if unions > 1 else 0.0))
        if longer == 1:
            return
        wide, deep = (longer + 1) // 2, shorter
        unions *= 2
