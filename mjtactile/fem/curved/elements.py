"""Isoparametric elements swept along a curved surface's inward normals.

They are the flat sheet's Q2/P-1 hexahedra (stiffness.py) with nodes at X(x, y, d), see surfaces.py: 27 nodes, and a
pressure that is linear in the element's own coordinates and condensed out inside it. Stiffness is integrated by three
Gauss points along each axis (Bathe, Finite Element Procedures, 2014, section 5.3), which is exact where the surface is
flat. scikit-fem would assemble the whole matrix. Dissection needs the matrix of each element, computed here for a row
of elements at once.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mjtactile._types import Array
from mjtactile.fem.line import quadratic_shapes
from mjtactile.fem.mesh import SheetMesh

#: Nodes of an element along each axis.
NODES = 3
#: Number of pressure polynomials of an element: 1, x, y and z in its own coordinates.
PRESSURES = 4

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def _reference() -> tuple[Array, Array, Array]:
    """Slopes (points, 27 nodes, 3 axes), pressures (points, 4) and weights (points,) at the Gauss points.

    Nodes and points are ordered (z, y, x), axes (x, y, z).
    """
    values, slopes = quadratic_shapes(_GAUSS)
    along = [
        np.einsum("ck,bj,ai->cbakji", *(slopes if axis == derived else values for axis in (2, 1, 0)))
        for derived in (0, 1, 2)
    ]
    z, y, x = np.meshgrid(_GAUSS, _GAUSS, _GAUSS, indexing="ij")
    pressures = np.stack([np.ones_like(x), x, y, z], axis=-1).reshape(-1, PRESSURES)
    weights = np.einsum("c,b,a->cba", _WEIGHTS, _WEIGHTS, _WEIGHTS).ravel()
    return np.stack(along, axis=-1).reshape(len(weights), NODES**3, 3), pressures, weights


class SweptElements:
    """Elements of a whole pad, or of the part that symmetry leaves.

    Args:
        mesh: element lines of (x, y, -depth), materials and the outer surface.
    """

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
