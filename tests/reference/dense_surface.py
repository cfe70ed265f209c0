"""How a pad's surface gives under the cells of the dense contact, and their forces as nodal forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dense_cells import Cells, Lattice

from mjtactile._types import Array
from mjtactile.contact.cells.compliance import SurfaceCompliance
from mjtactile.fem.line import Line
from mjtactile.fem.surface_grid import SurfaceGrid

#: Cells this many lengths apart see each other as points with a size; nearer ones exactly.
FAR = 20.0


def mean_inverse_distance(x: Array, y: Array, first: Array, second: Array) -> Array:
    """Mean of 1/r between two rectangles along the axes [1/m].

    1/r is the fourth derivative, twice along each axis, of G = (x^2 y asinh(y/|x|) + x y^2 asinh(x/|y|)) / 2 - r^3 / 6
    (up to what its differences drop), so that the integral over both rectangles is a sum of G over the distances of
    their sides. Far apart digits cancel there, but two terms of the Taylor series are exact to 1e-7.

    Args:
        x: from middle to middle [m].
        y: the same along y, same shape.
        first: sides of the one (x, y) [m].
        second: sides of the other.
    """
    square = x**2 + y**2
    near = square < (FAR * max(*first, *second)) ** 2
    mean = np.empty_like(square)
    far_x, far_y, far = x[~near], y[~near], square[~near]
    spread = (first**2 + second**2) / 24
    bend = spread[0] * (2 * far_x**2 - far_y**2) + spread[1] * (2 * far_y**2 - far_x**2)
    mean[~near] = (1.0 + bend / far**2) / np.sqrt(far)
    total = np.zeros(int(near.sum()))
    signs = [(a, b) for a in (-1, 1) for b in (-1, 1)]
    for a, b in signs:
        for c, d in signs:
            across, along = (a * first[0] + b * second[0]) / 2, (c * first[1] + d * second[1]) / 2
            total += a * b * c * d * _fourth_integral(x[near] + across, y[near] + along)
    mean[near] = total / (first.prod() * second.prod())
    return mean


def _fourth_integral(x: Array, y: Array) -> Array:
    x, y = np.abs(x), np.abs(y)
    tiny = np.finfo(float).tiny
    to_y, to_x = np.arcsinh(y / np.maximum(x, tiny)), np.arcsinh(x / np.maximum(y, tiny))
    return (x**2 * y * np.where(x > 0.0, to_y, 0.0) + x * y**2 * np.where(y > 0.0, to_x, 0.0)) / 2 - np.hypot(
        x, y
    ) ** 3 / 6


def _between(cells: Cells, others: Cells) -> Array:
    """Mean of 1/r between every two cells [1/m], (cells, others)."""
    size = cells.lattice.size
    if cells is not others:
        sizes = [size, others.lattice.size]
        axes = cells.lattice
        if axes.angle != others.lattice.angle:  # far enough apart that their area alone counts
            sizes = [np.full(2, np.sqrt(one.prod())) for one in sizes]
        return mean_inverse_distance(*_offsets(axes, cells.centres, others.centres), *sizes)
    # Of equal cells only the offset counts, and of offsets there are few.
    index = cells.index - cells.index.min(axis=0)
    span = index.max(axis=0) + 1
    column, row = (np.abs(index[:, axis, None] - index[:, axis]) for axis in (0, 1))
    if span.prod() > row.size:
        return mean_inverse_distance(column * size[0], row * size[1], size, size)
    table_x, table_y = np.meshgrid(size[0] * np.arange(span[0]), size[1] * np.arange(span[1]), indexing="ij")
    column *= span[1]
    column += row
    return mean_inverse_distance(table_x, table_y, size, size).ravel()[column]


def _offsets(lattice: Lattice, points: Array, others: Array) -> tuple[Array, Array]:
    """From every point to every other along a lattice's axes, (points, others) each [m]."""
    points, others = lattice.turned(points), lattice.turned(others)
    return points[:, None, 0] - others[:, 0], points[:, None, 1] - others[:, 1]


def _patch_weights(surface: SurfaceCompliance, points: Array) -> Array:
    """Share of each patch of the remainder's table in the remainder at points, (n, patches)."""
    along_x, along_y = surface.splines[0](points[:, 0]), surface.splines[1](points[:, 1])
    return (along_y[:, :, None] * along_x[:, None, :]).reshape(len(points), -1)


def compliance(surface: SurfaceCompliance, cells: Sequence[Cells]) -> Array:
    """How far each cell sinks per force on each, over all bodies' cells [m/N]: the half space and the remainder."""
    weights = np.concatenate([_patch_weights(surface, one.centres) for one in cells])
    matrix = weights @ (surface.remainder[2, :, 2, :] @ weights.T)
    ends = np.cumsum([0, *(len(one.index) for one in cells)])
    for i, one in enumerate(cells):
        for j in range(i + 1):
            block = surface.normal_factor * _between(one, cells[j])
            matrix[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] += block
            if j < i:
                matrix[ends[j] : ends[j + 1], ends[i] : ends[i + 1]] += block.T
    return (matrix + matrix.T) / 2


def sinking(surface: SurfaceCompliance, cells: Cells, pressing: Array, points: Array) -> Array:
    """How far the surface sinks [m] at points (n, 2) [m] off the cells that are pressed with forces (cells,) [N]."""
    pressed = pressing > 0.0
    centres, forces, size = cells.centres[pressed], pressing[pressed], cells.lattice.size
    if not len(points):
        return np.zeros(0)
    offsets = _offsets(cells.lattice, points, centres)
    sunk = surface.normal_factor * mean_inverse_distance(*offsets, size, size) @ forces
    smooth = surface.remainder[2, :, 2, :] @ (_patch_weights(surface, centres).T @ forces)
    return sunk + _patch_weights(surface, points) @ smooth


def nodal_forces(surface: SurfaceGrid, cells: Cells, forces: Array) -> Array:
    """Consistent nodal forces (nodes y, nodes x, 3) [N] of forces spread evenly over cells, (cells, 3) [N]."""
    lattice = cells.lattice
    if lattice.angle:
        corners = lattice.points(cells.index[:, None], np.array([[0, 0], [1, 0], [1, 1], [0, 1]]))
        edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
        return surface.traction_forces(edges, np.repeat(forces / cells.area, 4, axis=0))
    # Integrals of a node's shape function over a rectangle are products of integrals along x and y.
    along_x, along_y = (
        _shape_means(line, lattice.origin[axis] + cells.index[:, axis] * lattice.size[axis], lattice.size[axis])
        for axis, line in enumerate((surface.x, surface.y))
    )
    return np.stack([(along_y * forces[:, k, None]).T @ along_x for k in range(3)], axis=-1)


def _shape_means(line: Line, starts: Array, width: float) -> Array:
    """Mean of every node's shape function over intervals of a line, (n, nodes)."""
    low, place = np.unique(starts, return_inverse=True)
    means = np.zeros((len(low), line.node_count))
    for element in range(line.element_count):
        left, size = line.vertices[element], line.sizes[element]
        a, b = (np.clip(2 * (end - left) / size - 1, -1.0, 1.0) for end in (low, low + width))
        first, second, third = (b**k - a**k for k in (1, 2, 3))
        # Integrals of s (s - 1) / 2, 1 - s^2 and s (s + 1) / 2 from a to b.
        shares = np.stack([third / 6 - second / 4, first - third / 3, third / 6 + second / 4], axis=1)
        means[:, 2 * element : 2 * element + 3] += shares * (size / 2 / width)
    return means[place.ravel()]
