"""Loads at the elements' corners only: a quarter of the nodes, so that tables have a quarter of the columns.

The force at a mid-side node is distributed to the four nearest corners along its line, with the weights of cubic
Lagrange interpolation. These reproduce polynomials up to the third degree, so forces keep their moments up to the third
order, and with them their resultants, exactly. The change is confined to three elements around the force and, by
Saint-Venant's principle, to a depth of about one element.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mjtactile._types import Array, Mask
from mjtactile.errors import PresetError
from mjtactile.fem.line import Line

if TYPE_CHECKING:
    from mjtactile.fem.mesh import SheetMesh
    from mjtactile.fem.surface_grid import SurfaceGrid

#: Number of corners that share a mid-side node's force, if the line has that many.
CORNERS = 4


def corner_weights(line: Line) -> Array:
    """Fraction of each node's force that goes to each corner, a vertex of the line [-], shape (corners, nodes)."""
    vertices, nodes = line.vertices, line.nodes
    weights = np.zeros((len(vertices), len(nodes)))
    weights[np.arange(len(vertices)), 2 * np.arange(len(vertices))] = 1.0
    count = min(CORNERS, len(vertices))
    for element in range(line.element_count):
        first = min(max(element - 1, 0), len(vertices) - count)
        near = np.arange(first, first + count)
        for corner in near:
            others = vertices[near[near != corner]]
            middle = 2 * element + 1
            weights[corner, middle] = np.prod((nodes[middle] - others) / (vertices[corner] - others))
    return weights


def onto_corners(forces: Array, surface: SurfaceGrid) -> Array:
    """Nodal forces moved to the elements' corners [N], shape (batch, nodes y, nodes x, 3); zero at other nodes."""
    along_x, along_y = corner_weights(surface.x), corner_weights(surface.y)
    spread = np.zeros_like(forces)
    spread[:, ::2, ::2] = np.einsum("vj,bjic,wi->bvwc", along_y, forces, along_x, optimize=True)
    return spread


def on_corners(quarter: SheetMesh) -> Mask:
    """Mask over degrees of freedom (component, y, x) of the quarter's surface; True at elements' corners."""
    mask = np.zeros((3, quarter.y.node_count, quarter.x.node_count), dtype=bool)
    mask[:, ::2, ::2] = True
    return mask.ravel()


def require_corners_mirrored(mesh: SheetMesh) -> None:
    """Check that mirrors map corners of the sheet onto corners of its quarter.

    Raises:
        PresetError: the sheet has an odd number of elements along an axis.
    """
    counts = mesh.x.element_count, mesh.y.element_count
    if any(count % 2 for count in counts):
        raise PresetError(
            f'loads = "corners" takes a mesh with an even number of elements along both axes, not {counts[0]} x '
            f'{counts[1]}. Use loads = "nodes", or another mesh.'
        )
