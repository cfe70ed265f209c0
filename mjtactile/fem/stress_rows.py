"""Stress at points of a swept pad as linear functions (rows) of its unknowns.

The mesh is a tensor product in (x, y, -depth). Derivatives of the displacements by these coordinates, and the condensed
divergence, are recovered line by line (stress_recovery.py). The Jacobian of the swept position at the point converts
these derivatives to gradients.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sparse

from mjtactile._types import Array, Indices
from mjtactile.fem.elements import NODES, PRESSURES, SweptElements
from mjtactile.fem.line import Line
from mjtactile.fem.mesh import SheetMesh
from mjtactile.fem.stress import DEVIATORIC_COUNT
from mjtactile.fem.stress_recovery import GAUSS, gauss_weights, point_rows
from mjtactile.fem.symmetry import Parity

#: Entries of a displacement gradient.
_GRADIENT = 9
#: Rows of a point: five deviatoric coordinates and the mean stress.
_ROWS = DEVIATORIC_COUNT + 1


class StressRows:
    """Rows that turn a swept pad's displacements into stress at points.

    Args:
        mesh: of the whole pad.
        feet: of the points, (x, y, depth) [m], shape (points, 3); none on an interface between layers.
    """

    def __init__(self, mesh: SheetMesh, feet: Array) -> None:
        self._mesh, self._feet = mesh, feet
        self._places = feet * np.array([1.0, 1.0, -1.0])
        element = mesh.z.locate(self._places[:, 2])[0]
        self._mu, self._lame = mesh.shear_modulus[element], mesh.lame_lambda[element]

    def rows(self, parity: Parity, number: Indices) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Matrices from the displacements in a symmetry class to the stress at the points.

        Args:
            parity: the class.
            number: indices of the unknowns, see `DissectedPad.number`.

        Returns:
            (combine, recover), whose product maps displacements [m] to stress [Pa]. recover: displacements to
            recovered derivatives and divergences, (quantities, unknowns). combine: these to the five deviatoric
            coordinates and the mean stress of each point, (points * 6, quantities).
        """
        return self._combined, _compact(self._recovered @ self._folding(parity, number))

    @property
    def _recovered(self) -> sparse.csr_array:
        """Rows of derivatives (points * 9), by (component, axis), and of the divergence coefficients that points need.

        Columns are the nodal displacements of the whole pad (plane, y, x, component), including the base.
        """
        lines = self._lines
        rows = [point_rows(line, self._places[:, a], jumps) for a, (line, jumps) in enumerate(lines)]
        derivatives = []
        for axis in range(3):
            along = [_few(of_line[int(a == axis)]) for a, of_line in enumerate(rows)]
            derivatives.append(_product(along, tuple(line.node_count for line, _ in lines)))
        points = len(self._feet)
        stacked = sparse.vstack(derivatives, format="csr")  # (axis, point)
        by_component = sparse.kron(stacked, sparse.eye_array(3), format="csr")  # (axis, point, component)
        order = np.arange(_GRADIENT * points).reshape(3, points, 3).transpose(1, 2, 0).ravel()
        gradients = sparse.csr_array(by_component)[order]
        return sparse.csr_array(sparse.vstack([gradients, self._coefficients], format="csr"))

    @property
    def _lines(self) -> list[tuple[Line, tuple[int, ...]]]:
        return [(self._mesh.x, ()), (self._mesh.y, ()), (self._mesh.z, self._mesh.interfaces)]

    @cached_property
    def _coefficients(self) -> sparse.csr_array:
        """Rows of the condensed divergence's coefficients of the reached elements, (elements * 4, displacements)."""
        mesh = self._mesh
        dilation = SweptElements(mesh).dilation
        z, y, x = np.unravel_index(self._reached, dilation.shape[:3])
        nodes = [2 * start[:, None] + np.arange(NODES) for start in (z, y, x)]
        wide, deep = mesh.x.node_count, mesh.y.node_count
        node = (nodes[0][:, :, None, None] * deep + nodes[1][:, None, :, None]) * wide + nodes[2][:, None, None, :]
        columns = (3 * node[..., None] + np.arange(3)).reshape(len(z), 1, -1)
        values = dilation[z, y, x]
        columns = np.broadcast_to(columns, values.shape)
        starts = np.arange(0, values.size + 1, values.shape[2])
        shape = (len(z) * PRESSURES, 3 * wide * deep * mesh.z.node_count)
        return sparse.csr_array((values.ravel(), columns.ravel(), starts), shape=shape)

    @cached_property
    def _pressures(self) -> sparse.csr_array:
        """Matrix from the coefficients of the elements to the divergence at the points, (points, elements * 4)."""
        weights = []
        for axis, (line, jumps) in enumerate(self._lines):
            of_gauss = gauss_weights(line, self._places[:, axis], jumps).reshape(len(self._places), -1, 2)
            weights.append((of_gauss.sum(axis=2), of_gauss @ GAUSS))
        counts = tuple(line.element_count for line, _ in self._lines)
        modes = [_product([_few(weights[a][int(a == mode)], 3) for a in range(3)], counts) for mode in (None, 0, 1, 2)]
        stacked = sparse.hstack(modes, format="csr")
        elements = int(np.prod(counts))
        order = np.arange(PRESSURES * elements).reshape(PRESSURES, elements).T.ravel()
        return sparse.csr_array(sparse.csr_array(stacked)[:, order])

    @cached_property
    def _reached(self) -> Indices:
        """Indices (z, y, x order) of the elements whose pressure enters the stress of some point."""
        return np.unique(self._pressures.indices // PRESSURES).astype(np.int64)

    @cached_property
    def _combined(self) -> sparse.csr_array:
        """Stress rows (points * 6, recovered quantities)."""
        points = len(self._feet)
        swept = self._mesh.outer.derivatives(*self._feet.T)
        swept[..., 2] *= -1.0  # the third coordinate is minus the depth
        inverse = np.linalg.inv(swept)
        # Coordinates of the deviatoric stress and the dilation, each linear in the gradient du_i / dx_j.
        of_gradient = np.einsum("rij,paj->pria", _COORDINATES, inverse) * self._mu[:, None, None, None]
        dense = of_gradient.reshape(points, _ROWS, _GRADIENT)
        row = np.arange(points * _ROWS).reshape(points, _ROWS, 1)
        column = np.arange(points * _GRADIENT).reshape(points, 1, _GRADIENT)
        row, column = (np.broadcast_to(index, dense.shape).ravel() for index in (row, column))
        shape = (points * _ROWS, points * _GRADIENT)
        of_gradient = sparse.csr_array((dense.ravel(), (row, column)), shape=shape)
        kept = (self._reached[:, None] * PRESSURES + np.arange(PRESSURES)).ravel()
        pressure = sparse.diags_array(self._lame) @ self._pressures[:, kept]
        last = np.zeros((_ROWS, 1))
        last[-1] = 1.0
        return _compact(sparse.csr_array(sparse.hstack([of_gradient, sparse.kron(pressure, last)])))

    def _folding(self, parity: Parity, number: Indices) -> sparse.csr_array:
        """Matrix from the unknowns of a class to nodal displacements of the whole pad, (displacements, unknowns)."""
        mesh, part = self._mesh, self._mesh.quarter()
        place_y, sign_y = _mirrored(mesh.y, part.y)
        place_x, sign_x = _mirrored(mesh.x, part.x)
        unknown = number[place_y][:, place_x]  # (y, x, planes above the base, component)
        signs = np.ones(unknown.shape)
        for component in range(3):
            of_x, of_y = parity.component_signs(component)
            signs[..., component] *= np.where(sign_x < 0, of_x, 1.0)[None, :, None]
            signs[..., component] *= np.where(sign_y < 0, of_y, 1.0)[:, None, None]
        unknown, signs = (array.transpose(2, 0, 1, 3) for array in (unknown, signs))
        above_base = np.arange(unknown.size) + 3 * mesh.x.node_count * mesh.y.node_count
        free = unknown.ravel() >= 0
        shape = (3 * mesh.x.node_count * mesh.y.node_count * mesh.z.node_count, int(number.max()) + 1)
        entries = (signs.ravel()[free], (above_base[free], unknown.ravel()[free]))
        return sparse.csr_array(entries, shape=shape)


def _coordinates() -> Array:
    """Coefficients of the deviatoric coordinates (stress.py) over mu, and of 2/3 dilation, in gradients: (6, 3, 3)."""
    rows = np.zeros((_ROWS, 3, 3))
    rows[0] = np.diag([-1.0, -1.0, 2.0])
    rows[1] = np.sqrt(3.0) * np.diag([1.0, -1.0, 0.0])
    for row, (i, j) in enumerate(((0, 1), (1, 2), (2, 0)), start=2):
        rows[row, i, j] = rows[row, j, i] = np.sqrt(3.0)
    rows[5] = 2.0 / 3.0 * np.eye(3)
    return rows


_COORDINATES = _coordinates()


def _few(rows: Array, least: int = 1) -> tuple[Indices, Array]:
    """Column indices and values of each row's nonzero entries, padded to equal length, shape (rows, most)."""
    count = min(max(least, int((rows != 0.0).sum(axis=1).max(initial=1))), rows.shape[1])
    places = np.argsort(rows == 0.0, axis=1, kind="stable")[:, :count]
    return places, np.take_along_axis(rows, places, axis=1)


def _product(along: list[tuple[Indices, Array]], counts: tuple[int, ...]) -> sparse.csr_array:
    """Rows over a grid, in the order (z, y, x), from rows along x, y and z."""
    (at_x, x), (at_y, y), (at_z, z) = along
    wide, deep, high = counts
    values = z[:, :, None, None] * y[:, None, :, None] * x[:, None, None, :]
    places = (at_z[:, :, None, None] * deep + at_y[:, None, :, None]) * wide + at_x[:, None, None, :]
    starts = np.arange(0, values.size + 1, values[0].size)
    made = sparse.csr_array((values.ravel(), places.ravel(), starts), shape=(len(x), wide * deep * high))
    made.eliminate_zeros()
    return made


def _compact(matrix: sparse.csr_array) -> sparse.csr_array:
    """The same matrix with short indices: pads of many taxels have millions of entries."""
    indices, ends = matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    return sparse.csr_array((matrix.data, indices, ends), shape=matrix.shape)


def _mirrored(whole: Line, part: Line) -> tuple[Indices, Array]:
    """Index of each node of a line on the part that symmetry leaves, and its sign: -1 for mirror images."""
    places = np.arange(whole.node_count)
    if part.node_count == whole.node_count:
        return places, np.ones(whole.node_count)
    middle = whole.node_count // 2
    return np.abs(places - middle), np.where(places < middle, -1.0, 1.0)
