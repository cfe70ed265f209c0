"""Quadratic hexahedra of scikit-fem on a tensor grid of elements, and where their degrees of freedom lie."""

from __future__ import annotations

import numpy as np
from skfem import Basis, ElementHex2, ElementVector, MeshHex

from mjtactile._types import Array, Indices

ELEMENT = ElementVector(ElementHex2())


def nodes_along(line: Array) -> Array:
    """Nodes of quadratic elements that end at the given coordinates: these and the middles [m]."""
    return np.sort(np.concatenate([line, (line[1:] + line[:-1]) / 2]))


def degrees_of_freedom(bricks: MeshHex, lines: tuple[Array, Array, Array]) -> Indices:
    """Numbers of the degrees of freedom on the grid of nodes.

    Args:
        bricks: the mesh of the tensor grid.
        lines: where elements end along the three axes, ascending [m].

    Returns:
        Numbers, shape (nodes x, nodes y, nodes z, 3).
    """
    basis, nodes = Basis(bricks, ELEMENT, intorder=1), [nodes_along(line) for line in lines]
    at = [np.abs(along[:, None] - where).argmin(axis=0) for along, where in zip(nodes, basis.doflocs, strict=True)]
    found = np.empty((*map(len, nodes), 3), dtype=int)
    for component in range(3):
        own = basis.get_dofs(elements=True).all(f"u^{component + 1}")
        found[at[0][own], at[1][own], at[2][own], component] = own
    return found
