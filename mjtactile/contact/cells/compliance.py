"""Compliance of the pad's surface between contact cells: a half space in closed form plus a finite-element remainder.

Close to a patch of traction, the response is that of a half space, known exactly. The effects of the sheet's thickness,
layers and free sides vary slowly over the surface, so a coarse mesh resolves them. The compliance between cells is the
half space's plus a smooth remainder: the finite-element response minus the half space's, averaged over coarse patches
and interpolated by splines that preserve these averages.

On a curved pad, forces and displacements are along each patch's own axes, and the half space is that of the tangent
plane. The effect of curvature is bounded and is part of the remainder.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sparse
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from mjtactile._types import Array
from mjtactile.contact.cells.half_space import bent_responses, flat_responses
from mjtactile.fem.line import Line
from mjtactile.fem.symmetry import fold_forces
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.table import table_name

#: Least number of patches along a side. Otherwise there are half as many as elements, because the remainder varies over
#: lengths of the sheet's thickness. Twice as many patches change readings by 0.1 to 0.2 %, on the draft mesh by 0.4 %.
#: With several layers the remainder varies over lengths of the top layer's thickness: for a top layer of 1 mm, patches
#: of 2 mm cause errors of 15 %, and patches of 1 mm errors of 3 %.
_LEAST_PATCHES = 6
#: The half space has the top layer's modulus unless that layer is thinner than this many patches [-].
_THIN_LAYER = 0.5


@dataclass(frozen=True, eq=False)
class SurfaceCompliance:
    """Compliance of one pad's surface between any contact cells; make it with `surface_compliance`."""

    normal_factor: float  #: of the half space, (1 - nu) / (2 pi G) [1/Pa]
    poisson: float  #: Poisson ratio of the half space [-]
    #: Compliance of the sheet minus that of the half space between patches [m/N], shape (3, patches, 3, patches);
    #: patches row by row, components along the axes of `Surface.frames`.
    remainder: Array
    lines: tuple[Array, Array]  #: boundaries of the patches along x and y [m]

    @cached_property
    def splines(self) -> tuple[PPoly, PPoly]:
        """Weights of the patches along x and along y."""
        return _averaging_spline(self.lines[0]), _averaging_spline(self.lines[1])

    @cached_property
    def spline_remainder(self) -> Array:
        """The remainder as coefficients of B-splines [m/N], shape (3, splines, 3, splines).

        The splines are products of quadratic B-splines over the patches, along each axis one more than there are
        boundaries, x varying fastest. They span the same functions as `splines`, but few are nonzero at a point.
        """
        along_x, along_y = (_in_b_splines(spline) for spline in self.splines)
        both = np.einsum("ak,bl->abkl", along_y, along_x).reshape(len(along_y) * len(along_x), -1)
        return np.einsum("ap,ipjq,bq->iajb", both, self.remainder, both, optimize=True)


_known: weakref.WeakKeyDictionary[InfluenceMatrices, SurfaceCompliance] = weakref.WeakKeyDictionary()


def surface_compliance(influence: InfluenceMatrices) -> SurfaceCompliance:
    """Compliance of the surface of a pad, from its influence matrices; computed once for each."""
    if influence not in _known:
        _known[influence] = _make_compliance(influence)
    return _known[influence]


def _make_compliance(influence: InfluenceMatrices) -> SurfaceCompliance:
    grid = influence.surface
    top = influence.pad.layers[0]
    widest = top.thickness if len(influence.pad.layers) > 1 else np.inf
    lines = _patch_ends(grid.x, widest), _patch_ends(grid.y, widest)
    sheet = _sheet_compliance(influence, lines)
    responses = flat_responses(*lines) if grid.outer.is_flat else bent_responses(*lines, grid.outer)
    factor = (1 - top.poisson) / (2 * np.pi * top.shear_modulus)
    if top.thickness < _THIN_LAYER * min(np.diff(line).min() for line in lines):
        shape = len(lines[1]) - 1, len(lines[0]) - 1
        factor = _felt_factor(sheet[2, :, 2], responses.inverse_distance, shape)
    remainder = sheet - responses.compliance(factor, top.poisson)
    return SurfaceCompliance(factor, top.poisson, remainder, lines)


def _patch_ends(line: Line, widest: float) -> Array:
    """Mesh lines that are boundaries of the patches, about every second one, symmetric about the middle [m].

    Patches are no wider than `widest` [m] if the mesh is fine enough.
    """
    wanted = int(min(np.ceil((line.vertices[-1] - line.vertices[0]) / widest), line.element_count))
    count = min(line.element_count, max(_LEAST_PATCHES, line.element_count // 2, wanted))
    half = np.round(np.linspace(0, line.element_count // 2, count // 2 + 1)).astype(int)
    places = np.concatenate([half, line.element_count - half[-2::-1]]) if line.element_count % 2 == 0 else None
    return line.vertices if places is None else line.vertices[places]


def _sheet_compliance(influence: InfluenceMatrices, lines: tuple[Array, Array]) -> Array:
    """Finite-element compliance between patches under constant traction, (3, patches, 3, patches) [m/N]."""
    grid = influence.surface
    shares_x, shares_y = _nodal_shares(grid.x, lines[0]), _nodal_shares(grid.y, lines[1])
    nodal = np.einsum("ky,lx->klyx", shares_y, shares_x).reshape(-1, *grid.node_shape)
    axes = grid.outer.frames(*np.meshgrid(grid.x.nodes, grid.y.nodes))
    forces = np.einsum("pyx,yxac->apyxc", nodal, axes)
    total = 0.0
    for parity, columns in zip(influence.mirrors.classes, influence.free, strict=True):
        # Sparse: a patch has few nodes.
        folded = sparse.csr_array(fold_forces(forces, parity).reshape(3 * len(nodal), -1)[:, columns])
        total = total + folded @ np.asarray(influence.tables[table_name("compliance", parity)]) @ folded.T
    symmetric = (np.asarray(total) + np.asarray(total).T) / 2
    return symmetric.reshape(3, len(nodal), 3, len(nodal))


def _nodal_shares(line: Line, ends: Array) -> Array:
    """Nodal forces of a unit force uniform over each patch [-], (patches, nodes); Simpson's rule is exact here."""
    shares = np.zeros((len(ends) - 1, line.node_count))
    patch = np.searchsorted(ends, line.middles) - 1
    for place, share in enumerate((1 / 6, 4 / 6, 1 / 6)):
        np.add.at(shares, (patch, 2 * np.arange(line.element_count) + place), share * line.sizes)
    return shares / np.diff(ends)[:, None]


def _felt_factor(sheet: Array, inverse_distance: Array, shape: tuple[int, int]) -> float:
    """`normal_factor` of the half space with the sheet's compliance under a load that alternates between patches.

    Used for top layers much thinner than a patch, whose modulus does not determine the compliance at that distance.
    """
    row, column = shape[0] // 2, shape[1] // 2
    load = np.zeros(shape)
    load[row, column] = 1.0
    for near_row, near_column in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
        load[near_row % shape[0], near_column % shape[1]] -= 0.25
    force = load.ravel()
    return float(force @ sheet @ force / (force @ inverse_distance @ force))


def _averaging_spline(ends: Array) -> PPoly:
    """Quadratic splines, one per patch: their combination with patch values has these values as averages on patches."""
    running = np.vstack([np.zeros(len(ends) - 1), np.cumsum(np.diag(np.diff(ends)), axis=0)])
    return CubicSpline(ends, running, axis=0).derivative()


def _in_b_splines(spline: PPoly) -> Array:
    """Coefficients of quadratic B-splines for each patch value, (ends + 1, patches); the outermost knots are triple."""
    knots = np.concatenate([spline.x[[0, 0]], spline.x, spline.x[[-1, -1]]])
    places = (knots[1:-2] + knots[2:-1]) / 2  # as many as splines, each where one of them is largest
    return np.asarray(make_interp_spline(places, spline(places), k=2, t=knots).c)
