"""Solving the sheet for every surface load at once, by eliminating one layer of elements after another.

A plane of nodes is coupled only to the planes of its own element layers, so the stiffness is block tridiagonal once
each element layer's middle plane is condensed out. Elimination from the clamped base upwards leaves the condensed
stiffness of the surface; its inverse is the surface compliance. Back-substitution downwards gives the displacement of
each plane as a matrix times that of the plane above. Both passes are dense matrix products, which suits influence
matrices because they need every column. (A sparse Cholesky factor would be applied to thousands of right-hand sides;
docs/solver.md compares the two.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import get_lapack_funcs, solve_triangular

from mjtactile._types import Array
from mjtactile.errors import MeshError
from mjtactile.fem.stiffness import Parity, Stiffness, free_in_plane


@dataclass(frozen=True, eq=False)
class _ElementLayer:
    """Displacements of the planes of one element layer as functions of those of its upper plane.

    u_lower = lower_from_upper u_upper and u_middle = middle_from_upper u_upper + middle_from_lower u_lower.
    The lower plane of the bottom layer is clamped: its matrices are None.
    """

    middle_from_upper: Array
    middle_from_lower: Array | None
    lower_from_upper: Array | None


class EliminatedSheet:
    """A sheet whose element layers have been eliminated from the base up.

    Args:
        stiffness: of the sheet or of a quarter of it.
        parity: symmetry class of a quarter model; None for a mesh of the whole sheet.
        on_layer: called after each element layer, to report progress.

    Raises:
        MeshError: an element layer is not positive definite in double precision.
    """

    def __init__(
        self, stiffness: Stiffness, parity: Parity | None, on_layer: Callable[[], None] = lambda: None
    ) -> None:
        self.free = free_in_plane(stiffness.mesh, parity)
        self._stiffness = stiffness.restricted(self.free)
        self._layers: list[_ElementLayer] = []
        surface = self._eliminate(on_layer)
        #: Displacement of the surface per surface force [m/N], symmetric, over the free degrees of freedom.
        self.surface_compliance: Array = _inverse(surface)

    def _eliminate(self, on_layer: Callable[[], None]) -> Array:
        """Condensed stiffness of the surface plane; stores the back-substitution in self._layers, base first."""
        block = self._stiffness.block
        below = np.empty((0, 0))  # condensed stiffness of all layers below; none below the base
        for element in range(self._stiffness.mesh.z.element_count):
            lower, middle, upper = 2 * element, 2 * element + 1, 2 * element + 2
            # With Cholesky factors K_mm = L L^T, a plane adds (L^-1 K_mu)^T (L^-1 K_mu) to the next. Products with
            # inverses would lose twice as many digits: all of them where the Poisson ratio is near 0.5.
            of_middle = cholesky(block(middle, middle).toarray())
            to_upper = forward(of_middle, block(middle, upper).toarray())
            stiffness = block(upper, upper).toarray() - to_upper.T @ to_upper
            middle_from_lower, lower_from_upper = None, None
            if element > 0:
                to_lower = forward(of_middle, block(middle, lower).toarray())
                of_lower = cholesky(below - to_lower.T @ to_lower)
                through = forward(of_lower, block(lower, upper).toarray() - to_lower.T @ to_upper)
                stiffness -= through.T @ through
                middle_from_lower, lower_from_upper = -backward(of_middle, to_lower), -backward(of_lower, through)
            self._layers.append(_ElementLayer(-backward(of_middle, to_upper), middle_from_lower, lower_from_upper))
            below = stiffness
            on_layer()
        return below

    def descend(self, forces: Array | slice = slice(None)) -> Iterator[tuple[int, Array]]:
        """Displacements of each plane of nodes, from the surface down to the plane above the base.

        Args:
            forces: nodal forces on the surface [N], shape (free degrees of freedom, columns); or a slice of the free
                degrees of freedom, each loaded by a unit force in a column of its own. By default, all of them.

        Yields:
            (plane, displacements): the plane's index, 0 being the base, and the displacements of its free degrees of
            freedom under each column's load [m], shape (free degrees of freedom, columns).
        """
        upper = self.surface_compliance[:, forces] if isinstance(forces, slice) else self.surface_compliance @ forces
        yield 2 * len(self._layers), upper
        for element in reversed(range(len(self._layers))):
            layer = self._layers[element]
            middle = layer.middle_from_upper @ upper
            if layer.lower_from_upper is None or layer.middle_from_lower is None:
                yield 2 * element + 1, middle
            else:
                upper = layer.lower_from_upper @ upper
                middle += layer.middle_from_lower @ upper
                yield 2 * element + 1, middle
                yield 2 * element, upper

    def base_reaction(self, plane_1: Array, plane_2: Array) -> Array:
        """Nodal forces of the clamped base on the sheet [N], from the displacements [m] of the two planes above it."""
        block = self._stiffness.block
        return block(0, 1) @ plane_1 + block(0, 2) @ plane_2


def cholesky(matrix: Array) -> Array:
    """Lower Cholesky factor of a stiffness.

    Raises:
        MeshError: it is not positive definite in double precision.
    """
    (factorise,) = get_lapack_funcs(("potrf",), (matrix,))
    factor, failed = factorise(matrix, lower=1, clean=1)
    if failed:
        raise MeshError(
            "the finite-element equations are not positive definite in double precision. A layer is too thin or too "
            "soft beside its neighbours, too curved, or its Poisson ratio is too near 0.5."
        )
    return factor


def forward(factor: Array, right: Array) -> Array:
    """L^-1 times a matrix."""
    return solve_triangular(factor, right, lower=True, check_finite=False)


def backward(factor: Array, right: Array) -> Array:
    """L^-T times a matrix."""
    return solve_triangular(factor, right, lower=True, trans=1, check_finite=False)


def _inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix, by Cholesky; exactly symmetric."""
    factor = cholesky(matrix)
    (invert,) = get_lapack_funcs(("potri",), (factor,))
    lower, _ = invert(factor, lower=1, overwrite_c=1)
    inverse = np.tril(lower)
    inverse += np.tril(lower, -1).T
    return inverse
