"""Readings as norms of mean stress: the stress is averaged over a taxel's ball, or over each quarter of it.

A reading is then the von Mises stress of the mean stress over the ball, or the mean of those of its four quarters. By
the triangle inequality it is at most the mean of the von Mises stress over all sample points; it is less only where the
stress tensor's direction varies within the averaged part. Near a contact the direction varies more along the surface
than with depth, so two planes through the normal cut the ball into quarters. Tables have the usual format, with one
sample point per part.

Where the material changes within a ball, stress along the interface jumps, often from pull to push, and across a stiff
sheet that bends it changes its sign. So balls are also cut there, and each material's part once more at half its
height. Without that, readings at a stiff sheet in soft rubber are 20 to 30 % too low, and with it 3 % in the median.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from mjtactile._types import Array, Indices, Mask, Tables
from mjtactile.fem.symmetry import MirrorPlanes
from mjtactile.fem.taxel_quadrature import ball_radii, folded_sampling, sampling_tables, stored_average
from mjtactile.pad import LENGTH_TOLERANCE, Pad

#: Sample points closer than this, over the ball's radius, to a plane between quarters count half in each quarter [-].
_ON_PLANE = 100 * LENGTH_TOLERANCE
#: Quarters with less than this fraction of the clipped ball lie beyond the pad's side and are dropped [-].
_LEAST_SHARE = 1e-9


class LayerMeans:
    """One sensing layer's balls, or their quarters, as one averaged point each.

    Args:
        pad: the sheet and its taxels.
        sampling: tables of the layer's own sample points, see `taxel_quadrature.sampling_tables`.
        sensing_layer: counted from the top.
        averaging: "mean" for whole balls, "quarters" for their quarters; both with `material_cuts`.
    """

    def __init__(self, pad: Pad, sampling: Tables, sensing_layer: int, averaging: str) -> None:
        self._mirrors = MirrorPlanes(*pad.surface.mirrors)
        parts = _ball_parts(pad, sampling, sensing_layer, quartered=averaging == "quarters")
        points, folded = folded_sampling(pad, parts.centres, parts.share, parts.taxel)
        #: Sampling tables that replace the layer's own.
        self.sampling: Tables = sampling_tables(points, sensing_layer)
        # Parts that mirrors map onto each other are represented by one of them.
        _, chosen = np.unique(folded.index, return_index=True)
        self._rows = parts.rows[chosen]
        self._home = folded.image[chosen]  # the mirror image in which each of them lies

    def averaged(self, matrix: npt.NDArray[np.floating], number: int, odd: Sequence[Mask]) -> npt.NDArray[np.floating]:
        """A class's matrix for the averaged points (columns, folded parts * coordinates).

        Args:
            matrix: that for all points (columns, folded points * coordinates), with all or some columns.
            number: index of the class.
            odd: coordinates that change their sign under x -> -x, and under y -> -y.
        """
        mirrors, home, width = self._mirrors, self._home, len(odd[0])
        points = matrix.shape[1] // width
        flips = np.array([np.where(odd[0], x, 1) * np.where(odd[1], y, 1) for x, y in mirrors.images])
        signs = mirrors.signs[:, number, None] * flips  # (images, coordinates), of the class at each mirror image
        by_point = matrix.reshape(len(matrix), points, width)
        averaged = np.zeros((len(matrix), len(home), width), matrix.dtype)
        for q in range(len(mirrors.images)):
            of_image = self._rows[:, q * points : (q + 1) * points].astype(matrix.dtype)
            for k in range(width):
                averaged[:, :, k] += signs[q, k] * signs[home, k] * (of_image @ by_point[:, :, k].T).T
        return averaged.reshape(len(matrix), -1)


@dataclass(frozen=True, eq=False)
class _BallParts:
    """Parts of balls whose stress is averaged."""

    taxel: Indices  #: index of each part's taxel, (parts,)
    share: Array  #: fraction of the ball [-], (parts,); those of one taxel sum to 1
    centres: Array  #: positions in the pad frame [m], (parts, 3)
    rows: sparse.csr_array  #: weights of the sample points in each part's mean, (parts, images * folded points)


def _ball_parts(pad: Pad, sampling: Tables, sensing_layer: int, *, quartered: bool) -> _BallParts:
    """Balls, or their quarters without those beyond the pad's side, cut by `material_cuts`."""
    mirrors = MirrorPlanes(*pad.surface.mirrors)
    rows = stored_average(sampling, sensing_layer, mirrors)
    centres, cuts = pad.taxel_points(sensing_layer), material_cuts(pad, sensing_layer)
    if not (quartered or any(cuts)):
        return _BallParts(np.arange(len(centres)), np.ones(len(centres)), centres, rows)
    signs = np.array([(*image, 1) for image in mirrors.images])
    positions = (signs[:, None] * sampling[f"sampling points {sensing_layer}"]).reshape(-1, 3)
    weights = sparse.coo_array(rows)
    slab = np.zeros(len(weights.data), dtype=np.intp)
    if any(cuts):
        depths = pad.feet(positions)[0][weights.col, 2]
        slab += [np.searchsorted(cuts[taxel], depth) for taxel, depth in zip(weights.row, depths, strict=True)]
    in_quarters = [np.ones(len(weights.data))]
    if quartered:
        in_quarters = _in_quarters(pad, sensing_layer, positions[weights.col] - centres[weights.row], weights.row)
    parts = []
    for inside, number in itertools.product(in_quarters, range(int(slab.max()) + 1)):
        of_part = weights.data * inside * (slab == number)
        part = sparse.csr_array((of_part, (weights.row, weights.col)), shape=weights.shape)
        share = part.sum(axis=1)
        kept = np.flatnonzero(share > _LEAST_SHARE)
        part = sparse.csr_array(sparse.diags_array(1 / share[kept]) @ part[kept])
        parts.append(_BallParts(kept, share[kept], part @ positions, part))
    return _BallParts(
        np.concatenate([one.taxel for one in parts]),
        np.concatenate([one.share for one in parts]),
        np.concatenate([one.centres for one in parts]),
        sparse.csr_array(sparse.vstack([one.rows for one in parts])),
    )


def _in_quarters(pad: Pad, sensing_layer: int, offsets: Array, taxel: Indices) -> list[Array]:
    """Fraction of each sample point in each quarter of its ball, cut by two planes through the pad's normal.

    Args:
        pad: the sheet and its taxels.
        sensing_layer: counted from the top.
        offsets: of the points from their taxels [m], (points, 3).
        taxel: of each point, (points,).
    """
    feet = pad.taxel_feet(sensing_layer)
    tangents = pad.surface.frames(feet[:, 0], feet[:, 1])[:, :2]
    along = np.einsum("eac,ec->ea", tangents[taxel], offsets)
    sides = np.where(np.abs(along) < _ON_PLANE * pad.sampling_radius, 0.0, np.sign(along))
    return [((1 + sides * side) / 2).prod(axis=1) for side in itertools.product((1, -1), repeat=2)]


def material_cuts(pad: Pad, sensing_layer: int) -> list[list[float]]:
    """Depths at which each ball of a sensing layer is cut [m], top first; none for a ball in one material.

    A ball is cut where the material changes, and halfway between these depths and its ends.
    """
    changes = [
        -height
        for height, above, below in zip(pad.interfaces, pad.layers, pad.layers[1:], strict=False)
        if (above.young, above.poisson) != (below.young, below.poisson)
    ]
    depths = pad.taxel_feet(sensing_layer)[:, 2].tolist()
    radii = ball_radii(pad, len(depths)).tolist()
    tolerance = LENGTH_TOLERANCE * pad.thickness
    cuts: list[list[float]] = []
    for depth, radius in zip(depths, radii, strict=True):
        top, bottom = max(depth - radius, 0.0), min(depth + radius, pad.thickness)
        ends = [top, *(change for change in changes if top + tolerance < change < bottom - tolerance), bottom]
        halves = [(upper + lower) / 2 for upper, lower in itertools.pairwise(ends)]
        cuts.append(sorted([*ends[1:-1], *halves]) if len(ends) > 2 else [])
    return cuts
