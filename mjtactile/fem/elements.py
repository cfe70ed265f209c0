"""Isoparametric elements swept along the inward normals of a pad's surface, flat or curved.

Elements are Q2/P-1 hexahedra: 27-node displacements with a discontinuous pressure that is linear in the element's own
coordinates and condensed out inside it. They neither lock nor oscillate as the Poisson ratio approaches 1/2 (Bathe,
Finite Element Procedures, 2014, section 4.4.3). With strain eps, the energy is

    1/2 integral of  2 mu eps : eps  +  lambda (P div u)^2,

where P is the projection onto the pressures. Nodes are at X(x, y, d), see surfaces.py. Stiffness is integrated by three
Gauss points along each axis (section 5.3), which is exact where the surface is flat. Shape functions and Gauss points
are those of scikit-fem. Dissection needs the matrix of each element, computed here for a row of elements at once.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sparse
from skfem.element import ElementHex2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex

from mjtactile._types import Array
from mjtactile.fem.mesh import SheetMesh

#: Nodes of an element along each axis.
NODES = 3
#: Number of pressure polynomials of an element: 1, x, y and z in its own coordinates.
PRESSURES = 4
#: Degree of the polynomials that three Gauss points along each axis integrate exactly.
_DEGREE = 5


def _reference() -> tuple[Array, Array, Array]:
    """Slopes (points, 27 nodes, 3 axes), pressures (points, 4) and weights (points,) at the Gauss points.

    Nodes are ordered (z, y, x), axes (x, y, z).
    """
    element = ElementHex2()
    points, weights = get_quadrature(RefHex, _DEGREE)
    order = np.lexsort(element.doflocs.T)  # the last coordinate counts first
    slopes = np.stack([element.lbasis(points, node)[1] for node in order])
    pressures = np.column_stack([np.ones(len(weights)), 2 * points.T - 1])
    return slopes.transpose(2, 0, 1), pressures, weights


class SweptElements:
    """Elements of a whole pad, or of the part that symmetry leaves."""

    def __init__(self, mesh: SheetMesh) -> None:
        self.mesh = mesh
        z, y, x = np.meshgrid(mesh.z.nodes, mesh.y.nodes, mesh.x.nodes, indexing="ij")
        #: Positions of the nodes [m], shape (nodes z, nodes y, nodes x, 3), base first.
        self.nodes: Array = mesh.outer.positions(x, y, -z)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Elements along (z, y, x)."""
        return self.mesh.z.element_count, self.mesh.y.element_count, self.mesh.x.element_count

    def stiffness_of_row(self, row: int) -> Array:
        """Stiffness of all elements of a row along x, shape (elements x, elements z, 81, 81) [N/m].

        An element's degrees of freedom are ordered (node z, node y, node x, component).
        """
        gradients, volumes = self._gradients(row)
        elements, points = volumes.shape
        mu, lame = self.mesh.shear_modulus, self.mesh.lame_lambda
        layers = elements // self.shape[2]
        mu, lame = (np.tile(of_layer, self.shape[2]) for of_layer in (mu, lame))
        scaled = gradients * (volumes * mu[:, None])[..., None, None]
        flat = gradients.reshape(elements, points, -1)
        # 2 mu eps : eps = mu (grad u : grad v + grad u : grad v^T).
        products = scaled.reshape(elements, points, -1).transpose(0, 2, 1) @ flat
        products = products.reshape(elements, NODES**3, 3, NODES**3, 3)
        stiffness = products.transpose(0, 1, 4, 3, 2).copy()
        traces = np.trace(products, axis1=2, axis2=4)
        for component in range(3):
            stiffness[:, :, component, :, component] += traces
        stiffness = stiffness.reshape(elements, flat.shape[2], flat.shape[2])
        moments, masses = _divergence(gradients, volumes)
        stiffness += lame[:, None, None] * (moments.transpose(0, 2, 1) @ np.linalg.solve(masses, moments))
        return stiffness.reshape(self.shape[2], layers, *stiffness.shape[1:])

    def matrix(self, layers: int | None = None) -> sparse.csr_array:
        """Stiffness over all nodal displacements, the base's included, ordered (plane, y, x, component) [N/m].

        Only so many layers of elements are counted, from the base up; all of them by default.
        """
        high, deep, wide = self.nodes.shape[:3]
        number = np.arange(3 * high * deep * wide).reshape(high, deep, wide, 3)
        rows, columns, values = [], [], []
        for y in range(self.shape[1]):
            for x, of_column in enumerate(self.stiffness_of_row(y)):
                for z, of_element in enumerate(of_column[:layers]):
                    own = number[2 * z : 2 * z + NODES, 2 * y : 2 * y + NODES, 2 * x : 2 * x + NODES].ravel()
                    rows.append(np.repeat(own, len(own)))
                    columns.append(np.tile(own, len(own)))
                    values.append(of_element.ravel())
        places = np.concatenate(rows), np.concatenate(columns)
        return sparse.csr_array((np.concatenate(values), places), shape=(number.size, number.size))

    @cached_property
    def dilation(self) -> Array:
        """Matrices from an element's displacements to the coefficients of its condensed divergence [1/m].

        Shape (elements z, elements y, elements x, 4, 81).
        """
        rows = []
        for row in range(self.shape[1]):
            moments, masses = _divergence(*self._gradients(row))
            of_row = np.linalg.solve(masses, moments)
            rows.append(of_row.reshape(self.shape[2], self.shape[0], *of_row.shape[1:]))
        return np.stack(rows).transpose(2, 0, 1, 3, 4)

    def _gradients(self, row: int) -> tuple[Array, Array]:
        """Gradients of shape functions (elements, points, 27, 3) [1/m] and volumes (elements, points) [m^3] of a row.

        Elements are ordered (x, z).
        """
        layers, _, columns = self.shape
        strip = self.nodes[:, 2 * row : 2 * row + NODES]
        corners = np.empty((columns, layers, NODES, NODES, NODES, 3))
        for k in range(NODES):
            for i in range(NODES):
                part = strip[k : k + 2 * layers - 1 : 2, :, i : i + 2 * columns - 1 : 2]
                corners[:, :, k, :, i] = part.transpose(2, 0, 1, 3)
        corners = corners.reshape(columns * layers, NODES**3, 3)
        slopes, _, weights = _REFERENCE
        jacobian = np.einsum("eni,gna->egia", corners, slopes, optimize=True)
        gradients = np.matmul(slopes, np.linalg.inv(jacobian))
        return gradients, np.linalg.det(jacobian) * weights


def _divergence(gradients: Array, volumes: Array) -> tuple[Array, Array]:
    """Moments of the divergence with the pressures (elements, 4, 81), and the pressures' mass (elements, 4, 4)."""
    _, pressures, _ = _REFERENCE
    weighted = volumes[..., None] * pressures
    flat = gradients.reshape(*volumes.shape, -1)
    return weighted.transpose(0, 2, 1) @ flat, weighted.transpose(0, 2, 1) @ pressures


_REFERENCE = _reference()
