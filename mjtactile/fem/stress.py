"""Stress at sample points from the displacements of node planes.

Displacement gradients and the condensed pressure are sums of products of one-dimensional rows (stress_recovery.py), so
a plane's contribution is two dense products, along x and along y, followed by the point's own factor across the
thickness.

The deviatoric stress is kept as five coordinates whose Euclidean norm is the von Mises stress:
(3/2 s_zz, sqrt(3)/2 (s_xx - s_yy), sqrt(3) s_xy, sqrt(3) s_yz, sqrt(3) s_zx); nothing in them is singular as the
Poisson ratio approaches 1/2. The mean stress, sigma_kk / 3, completes the tensor.
"""

from __future__ import annotations

import itertools
from collections import defaultdict

import numpy as np

from mjtactile._types import Array
from mjtactile.fem.mesh import SheetMesh
from mjtactile.fem.stiffness import Parity
from mjtactile.fem.stress_recovery import SLOPE, VALUE, fold_rows, moment_row, point_rows

#: Coordinates of the deviatoric stress.
DEVIATORIC_COUNT = 5

_XX, _YY, _ZZ, _XY, _YZ, _ZX, _DIVERGENCE = range(7)
_MEASURES = 7  # six engineering strains and the projected divergence


def _gradient_terms() -> list[tuple[int, int, str, str, str]]:
    """Terms (measure, component, row along x, row along y, row along z) of strains and projected divergence."""
    along = [(SLOPE, VALUE, VALUE), (VALUE, SLOPE, VALUE), (VALUE, VALUE, SLOPE)]
    strains = [(_XX, 0, 0), (_YY, 1, 1), (_ZZ, 2, 2)]
    strains += [(_XY, 1, 0), (_XY, 0, 1), (_YZ, 1, 2), (_YZ, 2, 1), (_ZX, 0, 2), (_ZX, 2, 0)]
    terms = [(measure, component, *along[axis]) for measure, component, axis in strains]
    for orders in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
        for component in range(3):
            x, y, z = (moment_row(order, of_slope=axis == component) for axis, order in enumerate(orders))
            terms.append((_DIVERGENCE, component, x, y, z))
    return terms


_TERMS = _gradient_terms()


class StressSampler:
    """Accumulates the stress at points of the quarter x >= 0, y >= 0, plane by plane, for one symmetry class.

    Args:
        mesh: of the whole sheet.
        parity: symmetry class of the displacements passed to `add`.
        points: positions [m], shape (points, 3), x and y not negative, none on an interface between layers.
        columns: number of loads.
    """

    def __init__(self, mesh: SheetMesh, parity: Parity, points: Array, columns: int = 0) -> None:
        x, x_of_pair, y_of_pair, self._pair = _distinct_pairs(points)
        #: For each distinct x, the range (first, end) of the pairs (x, y) with this x; pairs are ordered by x.
        self._runs = list(itertools.pairwise(np.searchsorted(x_of_pair, np.arange(len(x) + 1))))
        z, self._height = np.unique(points[:, 2], return_inverse=True)
        self._rows_x = point_rows(mesh.x, x)
        self._rows_y = point_rows(mesh.y, y_of_pair)
        self._rows_z = point_rows(mesh.z, z, mesh.interfaces)
        self._parity = parity
        quarter = mesh.quarter()
        self._plane_shape = (3, quarter.y.node_count, quarter.x.node_count)
        element = mesh.z.locate(points[:, 2])[0]
        self._shear_modulus, self._lame_lambda = mesh.shear_modulus[element], mesh.lame_lambda[element]
        self._points = len(points)
        self.restart(columns)
        self._in_plane: dict[tuple[int, str, str], list[tuple[int, str]]] = defaultdict(list)
        for measure, component, x, y, z in _TERMS:
            self._in_plane[component, x, y].append((measure, z))

    def restart(self, columns: int) -> None:
        """Reset to zero stress, for another number of loads."""
        self._measures = np.zeros((_MEASURES, self._points, columns))

    def add(self, plane: int, free: np.ndarray, displacements: Array) -> None:
        """Add the contribution of one plane of nodes.

        Args:
            plane: index of the plane; the base is 0.
            free: mask over the plane's degrees of freedom that `displacements` covers.
            displacements: shape (free degrees of freedom, columns) [m].
        """
        whole = np.zeros((free.size, displacements.shape[1]))
        whole[free] = displacements
        fields = whole.reshape(*self._plane_shape, -1)
        for (component, row_x, row_y), uses in self._in_plane.items():
            factors = [self._rows_z[row_z][:, plane] for _, row_z in uses]
            if not any(factor.any() for factor in factors):
                continue
            sign_x, sign_y = self._parity.component_signs(component)
            along_x = fold_rows(self._rows_x[row_x], sign_x) @ fields[component]  # (nodes y, distinct x, columns)
            rows_of_pairs = fold_rows(self._rows_y[row_y], sign_y)
            sampled = np.empty((len(rows_of_pairs), displacements.shape[1]))
            for place, (first, end) in enumerate(self._runs):
                np.matmul(rows_of_pairs[first:end], along_x[:, place], out=sampled[first:end])
            for (measure, _), factor in zip(uses, factors, strict=True):
                points = np.flatnonzero(factor[self._height])
                self._measures[measure, points] += factor[self._height[points], None] * sampled[self._pair[points]]

    def result(self) -> tuple[Array, Array]:
        """Deviatoric coordinates, shape (points, 5, columns), and mean stress, (points, columns) [Pa per unit load]."""
        strain = self._measures
        mu = self._shear_modulus[:, None]
        dilation = strain[_XX] + strain[_YY] + strain[_ZZ]
        deviatoric = np.stack(
            [
                3.0 * mu * (strain[_ZZ] - dilation / 3),
                np.sqrt(3.0) * mu * (strain[_XX] - strain[_YY]),
                np.sqrt(3.0) * mu * strain[_XY],
                np.sqrt(3.0) * mu * strain[_YZ],
                np.sqrt(3.0) * mu * strain[_ZX],
            ],
            axis=1,
        )
        mean = self._lame_lambda[:, None] * strain[_DIVERGENCE] + 2.0 / 3.0 * mu * dilation
        return deviatoric, mean


def _distinct_pairs(points: Array) -> tuple[Array, np.ndarray, Array, np.ndarray]:
    """Distinct (x, y) of points (points, 3), ordered by x.

    Returns:
        Distinct x [m]; for each pair the index of its x and its y [m]; for each point the index of its pair.
    """
    pairs, pair_of_point = np.unique(points[:, :2], axis=0, return_inverse=True)
    x, x_of_pair = np.unique(pairs[:, 0], return_inverse=True)
    return x, x_of_pair, pairs[:, 1], pair_of_point.ravel()


def von_mises(deviatoric: Array) -> Array:
    """Von Mises stress [Pa] from deviatoric coordinates (..., 5) [Pa]: the Euclidean norm over the last axis."""
    return np.sqrt(np.einsum("...i,...i->...", deviatoric, deviatoric))


def stress_tensor(deviatoric: Array, mean: Array) -> Array:
    """Stress components (..., 6) = xx, yy, zz, xy, yz, zx [Pa] from deviatoric coordinates (..., 5) and mean (...)."""
    s_zz = deviatoric[..., 0] / 1.5
    difference = deviatoric[..., 1] * 2 / np.sqrt(3.0)
    shears = deviatoric[..., 2:] / np.sqrt(3.0)
    normal = np.stack([(difference - s_zz) / 2, (-difference - s_zz) / 2, s_zz], axis=-1) + mean[..., None]
    return np.concatenate([normal, shears], axis=-1)
