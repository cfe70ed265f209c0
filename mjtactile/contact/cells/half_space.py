"""Compliance of a half space between patches of traction, in closed form, on flat and curved surfaces."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.pad_shape.surfaces import Surface

#: On a curved surface, pairs of patches up to the first number apart along both axes are integrated in closed form in
#: the tangent plane of one of them; other pairs by a Gauss rule with the second number of points along each side.
_NEAR, _FAR_ORDER = 2, 2


@dataclass(frozen=True, eq=False)
class HalfSpaceResponses:
    """Means over pairs of patches, each of shape (patches, patches).

    (x, y) is the vector from a point of the second patch to a point of the first, r its length.
    """

    inverse_distance: Array  #: of 1/r [1/m]
    xx: Array  #: of y^2/r^3 [1/m]
    xy: Array  #: of -x y/r^3 [1/m]
    yy: Array  #: of x^2/r^3 [1/m]
    along: Array  #: of x/r^2 [1/m]
    across: Array  #: of y/r^2 [1/m]

    def compliance(self, factor: float, poisson: float) -> Array:
        """Mean displacement per force [m/N], shape (3, patches, 3, patches), z out of the pad.

        Surface response to a point force: Johnson 1985, eqs. 3.18 and 3.75 to 3.77.

        Args:
            factor: (1 - nu) / (2 pi G) [1/Pa].
            poisson: nu [-].
        """
        share, slope = poisson / (1 - poisson), (1 - 2 * poisson) / (2 * (1 - poisson))
        distance, count = self.inverse_distance, len(self.inverse_distance)
        compliance = np.empty((3, count, 3, count))
        compliance[0, :, 0] = distance + share * self.yy
        compliance[1, :, 1] = distance + share * self.xx
        compliance[0, :, 1] = compliance[1, :, 0] = -share * self.xy
        compliance[2, :, 2] = distance
        compliance[0, :, 2], compliance[2, :, 0] = slope * self.along, -slope * self.along
        compliance[1, :, 2], compliance[2, :, 1] = slope * self.across, -slope * self.across
        return factor * compliance


def half_space(edges: Array, sides: npt.NDArray[np.integer[Any]], cells: int) -> Array:
    """The six means of `HalfSpaceResponses` times the areas of both cells [m^3], shape (6, cells, cells).

    Args:
        edges: of the cells, each once, (edges, 2 ends, 2) [m].
        sides: indices of the cells to the left and right of each edge, (edges, 2); -1 for none.
        cells: number of cells.
    """
    edges, sides = contiguous(edges), np.ascontiguousarray(sides, dtype=np.int32)
    integrals = np.empty((len(fields(HalfSpaceResponses)), cells, cells))
    library().mjt_half_space(
        ctypes.c_size_t(cells), ctypes.c_size_t(len(edges)), pointer(edges), pointer(sides), pointer(integrals)
    )
    return integrals


def flat_responses(x: Array, y: Array) -> HalfSpaceResponses:
    """Responses of patches of a flat surface, by row, between ascending boundaries along x and along y [m]."""
    areas = np.outer(np.diff(y), np.diff(x)).ravel()
    return HalfSpaceResponses(*half_space(*_patch_edges(x, y), len(areas)) / (areas[:, None] * areas))


def bent_responses(x: Array, y: Array, outer: Surface) -> HalfSpaceResponses:
    """Responses of patches of a curved surface, by row, components along each patch's own axes.

    The patches are between ascending boundaries along x and along y in the projection [m].
    """
    found = _far(x, y, outer)
    columns, rows = len(x) - 1, len(y) - 1
    near = np.full((6, rows * columns, rows * columns), np.nan)
    for row in range(rows):
        for column in range(columns):
            west, east = max(column - _NEAR, 0), min(column + _NEAR + 1, columns)
            south, north = max(row - _NEAR, 0), min(row + _NEAR + 1, rows)
            own = (row - south) * (east - west) + column - west
            places = np.add.outer(np.arange(south, north) * columns, np.arange(west, east)).ravel()
            near[:, row * columns + column, places] = _in_plane(x[west : east + 1], y[south : north + 1], outer, own)
    back = near.transpose(0, 2, 1).copy()
    back[4:] *= -1.0  # along and across change sign when the two patches are exchanged
    both = (near + back) / 2
    return HalfSpaceResponses(*np.where(np.isnan(both), found, both))


def _in_plane(x: Array, y: Array, outer: Surface, own: int) -> Array:
    """Means between the patch with index `own` and all patches [1/m], in its tangent plane, (6, patches)."""
    edges, sides = _patch_edges(x, y)
    count = (len(x) - 1) * (len(y) - 1)
    places = np.stack(np.meshgrid((x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2), axis=-1).reshape(-1, 2)
    middles, axes = outer.positions(*places.T), outer.frames(*places[own])
    seen = (outer.positions(edges[..., 0], edges[..., 1]) - middles[own]) @ axes[:2].T
    start, end = seen[:, 0], seen[:, 1]
    crossed = (start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]) / 2
    areas = np.zeros(count + 1)
    np.add.at(areas, sides[:, 0], crossed)
    np.add.at(areas, sides[:, 1], -crossed)  # index -1, no patch, is the additional last entry
    means = half_space(seen, sides, count)[:, own] / (areas[own] * areas[:count])
    apart = middles - middles[own]
    chord, in_plane = np.linalg.norm(apart, axis=1), np.linalg.norm(apart @ axes[:2].T, axis=1)
    return means * np.divide(in_plane, chord, out=np.ones(count), where=chord > 0)


def _far(x: Array, y: Array, outer: Surface) -> Array:
    """Means between patches that are not near each other, (6, patches, patches) [1/m]."""
    nodes, weights = np.polynomial.legendre.leggauss(_FAR_ORDER)
    points_x, points_y = (((line[:-1] + line[1:])[:, None] + np.diff(line)[:, None] * nodes) / 2 for line in (x, y))
    rows, columns, order = len(y) - 1, len(x) - 1, _FAR_ORDER
    along = np.broadcast_to(points_x[None, :, None, :], (rows, columns, order, order)).reshape(-1, order * order)
    across = np.broadcast_to(points_y[:, None, :, None], (rows, columns, order, order)).reshape(-1, order * order)
    weight = np.outer(weights, weights).ravel() / 4
    positions = outer.positions(along, across)
    middles = np.stack(np.meshgrid((x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2), axis=-1).reshape(-1, 2)
    axes = outer.frames(*middles.T)
    found = np.zeros((6, len(middles), len(middles)))
    for i, own in enumerate(positions):
        apart = own[:, None, None] - positions
        between = axes[i] + axes
        u, v = (
            np.einsum("qpsc,pc->qps", apart, between[:, k] / np.linalg.norm(between[:, k], axis=-1, keepdims=True))
            for k in range(2)
        )
        r = np.linalg.norm(apart, axis=-1)
        r[r == 0.0] = np.inf
        parts = np.stack([1 / r, v**2 / r**3, -u * v / r**3, u**2 / r**3, u / r**2, v / r**2])
        found[:, i] = np.einsum("kqps,q,s->kp", parts, weight, weight)
    return found


def _patch_edges(x: Array, y: Array) -> tuple[Array, npt.NDArray[np.int_]]:
    """Edges of the patches, each once, (edges, 2 ends, 2) [m], and indices of the patches to their left and right."""
    columns, rows = len(x) - 1, len(y) - 1
    patch = np.pad(np.arange(rows * columns).reshape(rows, columns), 1, constant_values=-1)
    along = np.meshgrid(x, y)
    corners = np.stack(along, axis=-1)
    level = np.stack([corners[:, :-1], corners[:, 1:]], axis=2).reshape(-1, 2, 2)
    upright = np.stack([corners[:-1], corners[1:]], axis=2).reshape(-1, 2, 2)
    level_sides = np.stack([patch[1:, 1:-1], patch[:-1, 1:-1]], axis=-1).reshape(-1, 2)
    upright_sides = np.stack([patch[1:-1, :-1], patch[1:-1, 1:]], axis=-1).reshape(-1, 2)
    return np.concatenate([level, upright]), np.concatenate([level_sides, upright_sides])
