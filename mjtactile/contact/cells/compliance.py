"""How far the pad's surface gives under contact cells: closed form near by, finite elements for the rest.

What a patch of traction does close to itself is the response of a half space, known exactly. What
the sheet adds, its thickness, layers and free sides, varies slowly and is resolved by a coarse mesh. The compliance
between cells is therefore the half space's plus a smooth remainder: the finite elements' response minus the half
space's, averaged over coarse patches and interpolated by splines that keep these averages.

On a curved pad forces and displacements are those along each patch's own axes, and the half space is that of the
tangent plane: what its curvature does is bounded as well, and belongs to the remainder.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from mjtactile._types import Array
from mjtactile.contact.cells.half_space import bent_responses, flat_responses
from mjtactile.fem.line import Line
from mjtactile.fem.symmetry import fold_forces
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.table import table_name

#: Patches along a side are half as many as elements, but no fewer than this: the remainder varies over the sheet's
#: thickness. Twice as many change readings by .1 to .2 %, on the draft mesh by .4 %. Under a top layer on others it
#: varies over that layer's thickness: on one of 1 mm patches of 2 mm leave errors of 15 %, patches of 1 mm 3 %.
_LEAST_PATCHES = 6
#: A top layer thinner than this many patches is not what the surface feels like from a patch's distance.
_THIN_LAYER = 0.5


@dataclass(frozen=True, eq=False)
class SurfaceCompliance:
    """Compliance of one pad's surface between any contact cells; make it with `surface_compliance`.

    Attributes:
        normal_factor: of the half space, (1 - nu) / (2 pi G) [1/Pa].
        poisson: Poisson ratio of the half space [-].
        remainder: sheet minus half space between coarse patches, (3, patches, 3, patches) [m/N]; patches by row,
            components along the surface above x, across it, and along its normal, see `Surface.frames`.
        lines: patch ends along x and y [m].
    """

    normal_factor: float
    poisson: float
    remainder: Array
    lines: tuple[Array, Array]

    @cached_property
    def splines(self) -> tuple[PPoly, PPoly]:
        """Weights of the patches along x and along y."""
        return _averaging_spline(self.lines[0]), _averaging_spline(self.lines[1])

    @cached_property
    def spline_remainder(self) -> Array:
        """The remainder in B-splines, of which few are not zero at a point, (3, splines, 3, splines) [m/N].

        Products of quadratic B-splines over the patches, one more along each axis than patch ends, those along x
        first. They span what `splines` do.
        """
        along_x, along_y = (_in_b_splines(spline) for spline in self.splines)
        both = np.einsum("ak,bl->abkl", along_y, along_x).reshape(len(along_y) * len(along_x), -1)
        return np.einsum("ap,ipjq,bq->iajb", both, self.remainder, both, optimize=True)


_known: weakref.WeakKeyDictionary[InfluenceMatrices, SurfaceCompliance] = weakref.WeakKeyDictionary()


def surface_compliance(influence: InfluenceMatrices) -> SurfaceCompliance:
    """Compliance of the surface of the pad that influence matrices belong to; made once for each."""
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
    """Mesh lines that bound the patches, about every second one, symmetric about the middle.

    Patches are no wider than `widest` [m], as far as the mesh has lines.
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
        folded = fold_forces(forces, parity).reshape(3 * len(nodal), -1)[:, columns]
        total = total + folded @ np.asarray(influence.tables[table_name("compliance", parity)]) @ folded.T
    symmetric = (np.asarray(total) + np.asarray(total).T) / 2
    return symmetric.reshape(3, len(nodal), 3, len(nodal))


def _nodal_shares(line: Line, ends: Array) -> Array:
    """Nodal forces of a unit force spread evenly over each patch, (patches, nodes); Simpson's rule is exact here."""
    shares = np.zeros((len(ends) - 1, line.node_count))
    patch = np.searchsorted(ends, (line.vertices[:-1] + line.vertices[1:]) / 2) - 1
    for place, share in enumerate((1 / 6, 4 / 6, 1 / 6)):
        np.add.at(shares, (patch, 2 * np.arange(line.element_count) + place), share * line.sizes)
    return shares / np.diff(ends)[:, None]


def _felt_factor(sheet: Array, inverse_distance: Array, shape: tuple[int, int]) -> float:
    """Factor of the half space that gives like the sheet under a load that alternates in the middle of the surface.

    A skin thinner than the patches says little about how the surface gives at their distance.
    """
    row, column = shape[0] // 2, shape[1] // 2
    load = np.zeros(shape)
    load[row, column] = 1.0
    for near_row, near_column in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
        load[near_row % shape[0], near_column % shape[1]] -= 0.25
    force = load.ravel()
    return float(force @ sheet @ force / (force @ inverse_distance @ force))


def _averaging_spline(ends: Array) -> PPoly:
    """Quadratic spline weights of patch values whose interpolant has these values as its averages over the patches."""
    running = np.vstack([np.zeros(len(ends) - 1), np.cumsum(np.diag(np.diff(ends)), axis=0)])
    return CubicSpline(ends, running, axis=0).derivative()


def _in_b_splines(spline: PPoly) -> Array:
    """Coefficients of quadratic B-splines per patch value, (ends + 1, patches), outermost ends counted thrice."""
    knots = np.concatenate([spline.x[[0, 0]], spline.x, spline.x[[-1, -1]]])
    places = (knots[1:-2] + knots[2:-1]) / 2  # as many as splines, each where one of them is largest
    return np.asarray(make_interp_spline(places, spline(places), k=2, t=knots).c)
