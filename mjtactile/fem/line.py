"""Quadratic finite elements on a line: the one-dimensional factors of every three-dimensional matrix.

The sheet is a box, its mesh a tensor product of three lines, and its layers are uniform in the plane. Each
stiffness matrix is therefore a short sum of Kronecker products of the small matrices of this module, which
scikit-fem integrates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sparse

from mjtactile._types import Array, Indices

if TYPE_CHECKING:
    from skfem import Basis, BilinearForm


@dataclass(frozen=True, eq=False)
class Line:
    """A line of three-node (quadratic) elements."""

    vertices: Array  #: element ends [m], ascending, shape (elements + 1,)

    @property
    def element_count(self) -> int:
        """Number of elements."""
        return len(self.vertices) - 1

    @property
    def node_count(self) -> int:
        """Number of nodes: ends and middles of all elements."""
        return 2 * self.element_count + 1

    @cached_property
    def sizes(self) -> Array:
        """Element lengths [m], shape (elements,)."""
        return np.diff(self.vertices)

    @cached_property
    def nodes(self) -> Array:
        """Node positions [m], ascending: vertices at even indices, middles of elements at odd ones."""
        nodes = np.empty(self.node_count)
        nodes[::2] = self.vertices
        nodes[1::2] = (self.vertices[:-1] + self.vertices[1:]) / 2
        return nodes

    def locate(self, positions: Array) -> tuple[Indices, Array]:
        """Element index and local coordinate in [-1, 1] of each position; ends belong to the inner element."""
        element = np.searchsorted(self.vertices, positions, side="right") - 1
        element = np.clip(element, 0, self.element_count - 1)
        local = 2 * (positions - self.vertices[element]) / self.sizes[element] - 1
        return element, np.clip(local, -1.0, 1.0)

    @cached_property
    def _basis(self) -> Basis:
        from skfem import Basis, ElementLineP2, MeshLine

        # Order 4 integrates the product of two quadratics exactly.
        return Basis(MeshLine(self.vertices), ElementLineP2(), intorder=4)

    @cached_property
    def _node_order(self) -> Indices:
        return np.argsort(self._basis.doflocs[0])

    def _assemble(self, form: BilinearForm, weight: Array | None) -> sparse.csr_array:
        values = np.ones(self.element_count) if weight is None else weight
        matrix = form.assemble(self._basis, weight=values[:, None])
        return sparse.csr_array(matrix)[self._node_order][:, self._node_order]

    def mass(self, weight: Array | None = None) -> sparse.csr_array:
        """Integral of w phi_i phi_j [m, times the unit of w], with one weight w per element; shape (nodes, nodes)."""
        return self._assemble(_form(lambda u, v, w: w["weight"] * u * v), weight)

    def stiffness(self, weight: Array | None = None) -> sparse.csr_array:
        """Integral of w phi_i' phi_j' [1/m, times the unit of w]; shape (nodes, nodes)."""
        return self._assemble(_form(lambda u, v, w: w["weight"] * u.grad[0] * v.grad[0]), weight)

    def gradient(self, weight: Array | None = None) -> sparse.csr_array:
        """Integral of w phi_i phi_j' [the unit of w]; shape (nodes, nodes), row i: test function, column j: trial."""
        return self._assemble(_form(lambda u, v, w: w["weight"] * u.grad[0] * v), weight)

    def legendre_moments(self, order: int) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Moments of shape functions and of their derivatives against a Legendre polynomial on each element.

        Args:
            order: 0 (constant) or 1 (linear, -1 to 1 along the element).

        Returns:
            (H, G): H[e, i] = integral of L phi_i [m], G[e, i] = integral of L phi_i' [-], both (elements, nodes).
        """
        from skfem import Basis, ElementLineP1DG

        pressure = Basis(self._basis.mesh, ElementLineP1DG(), intorder=4)
        # The discontinuous linear functions are 1 at one end each: L0 is their sum, L1 their difference.
        left, right = pressure.element_dofs
        signs = (1.0, 1.0) if order == 0 else (-1.0, 1.0)
        elements = np.arange(self.element_count)
        combine = sparse.csr_array(
            (np.repeat(signs, self.element_count), (np.tile(elements, 2), np.concatenate([left, right]))),
            shape=(self.element_count, pressure.N),
        )
        weight = np.ones((self.element_count, 1))
        values = _form(lambda u, v, w: w["weight"] * u * v).assemble(self._basis, pressure, weight=weight)
        slopes = _form(lambda u, v, w: w["weight"] * u.grad[0] * v).assemble(self._basis, pressure, weight=weight)
        order_of = self._node_order
        return tuple(sparse.csr_array(combine @ sparse.csr_array(m))[:, order_of] for m in (values, slopes))  # type: ignore[return-value]


def _form(integrand: Any) -> BilinearForm:
    from skfem import BilinearForm

    return BilinearForm(integrand)


def quadratic_shapes(local: Array) -> tuple[Array, Array]:
    """Values [-] of the three shape functions at local coordinates in [-1, 1], and their slopes; each (..., 3).

    Slopes are derivatives with respect to the local coordinate [-].
    """
    values = np.stack([local * (local - 1) / 2, 1 - local**2, local * (local + 1) / 2], axis=-1)
    slopes = np.stack([local - 0.5, -2 * local, local + 0.5], axis=-1)
    return values, slopes
