"""Readings as norms of mean stress: the stress is averaged over a taxel's ball, or over each quarter of it.

A reading is then the von Mises stress of the mean stress over the ball, or the mean of those of its four quarters. By
the triangle inequality it is at most the mean of the von Mises stress over all sample points; it is less only where the
stress tensor's direction varies within the averaged part. Near a contact the direction varies more along the surface
than with depth, so two planes through the normal cut the ball into quarters. Tables have the usual format, with one
sample point per part.
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
from mjtactile.fem.taxel_quadrature import folded_sampling, sampling_tables, stored_average
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
        averaging: "mean" for whole balls, "quarters" for their quarters.
    """

    def __init__(self, pad: Pad, sampling: Tables, sensing_layer: int, averaging: str) -> None:
        self._mirrors = MirrorPlanes(*pad.surface.mirrors)
        balls = _whole_balls(pad, sampling, sensing_layer)
        parts = _quarters(pad, sampling, sensing_layer, balls) if averaging == "quarters" else balls
        points, folded = folded_sampling(pad, parts.centres, parts.share, parts.taxel)
        #: Sampling tables that replace the layer's own.
        self.sampling: Tables = sampling_tables(points, sensing_layer)
        # Parts that mirrors map onto each other are represented by one of them.
        _, chosen = np.unique(folded.index, return_index=True)
        self._rows = parts.rows[chosen]
        self._home = folded.quadrant[chosen]  # the mirror image in which each of them lies

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
            of_quadrant = self._rows[:, q * points : (q + 1) * points].astype(matrix.dtype)
            for k in range(width):
                averaged[:, :, k] += signs[q, k] * signs[home, k] * (of_quadrant @ by_point[:, :, k].T).T
        return averaged.reshape(len(matrix), -1)


@dataclass(frozen=True, eq=False)
class _BallParts:
    """Parts of balls whose stress is averaged."""

    taxel: Indices  #: index of each part's taxel, (parts,)
    share: Array  #: fraction of the ball [-], (parts,); those of one taxel sum to 1
    centres: Array  #: positions in the pad frame [m], (parts, 3)
    rows: sparse.csr_array  #: weights of the sample points in each part's mean, (parts, images * folded points)


def _whole_balls(pad: Pad, sampling: Tables, sensing_layer: int) -> _BallParts:
    rows = stored_average(sampling, sensing_layer, MirrorPlanes(*pad.surface.mirrors))
    centres = pad.taxel_points(sensing_layer)
    return _BallParts(np.arange(len(centres)), np.ones(len(centres)), centres, rows)


def _quarters(pad: Pad, sampling: Tables, sensing_layer: int, balls: _BallParts) -> _BallParts:
    """Quarters of balls, cut by two planes through the pad's normal, without those beyond the pad's side."""
    signs = np.array([(*image, 1) for image in MirrorPlanes(*pad.surface.mirrors).images])
    positions = (signs[:, None] * sampling[f"sampling points {sensing_layer}"]).reshape(-1, 3)
    weights = sparse.coo_array(balls.rows)
    feet = pad.taxel_feet(sensing_layer)
    tangents = pad.surface.frames(feet[:, 0], feet[:, 1])[:, :2]
    offsets = np.einsum("eac,ec->ea", tangents[weights.row], positions[weights.col] - balls.centres[weights.row])
    offsets = np.where(np.abs(offsets) < _ON_PLANE * pad.sampling_radius, 0.0, np.sign(offsets))
    quarters = []
    for side in itertools.product((1, -1), repeat=2):
        inside = ((1 + offsets * side) / 2).prod(axis=1)
        rows = sparse.csr_array((weights.data * inside, (weights.row, weights.col)), shape=weights.shape)
        share = rows.sum(axis=1)
        kept = np.flatnonzero(share > _LEAST_SHARE)
        rows = sparse.csr_array(sparse.diags_array(1 / share[kept]) @ rows[kept])
        quarters.append(_BallParts(kept, share[kept], rows @ positions, rows))
    return _BallParts(
        np.concatenate([one.taxel for one in quarters]),
        np.concatenate([one.share for one in quarters]),
        np.concatenate([one.centres for one in quarters]),
        sparse.csr_array(sparse.vstack([one.rows for one in quarters])),
    )
