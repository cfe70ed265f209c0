"""Readings as norms of mean stress: one averaged point per taxel in place of the points in its ball.

A reading is then the von Mises stress of the mean stress over the taxel's ball. By the triangle inequality it is at
most the mean of the von Mises stress, and less only as far as the stress changes its direction within the ball. What
is stored has the form of tables with one sample point per taxel, so that everything that reads tables reads these.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from mjtactile._types import Indices, Mask, Tables
from mjtactile.fem.symmetry import FoldedPoints, MirrorPlanes, fold_points
from mjtactile.fem.taxel_quadrature import Sampling, sampling_tables, stored_average
from mjtactile.pad import LENGTH_TOLERANCE, Pad


class LayerMeans:
    """One sensing layer's taxels as one averaged point each.

    Args:
        pad: the sheet and its taxels.
        sampling: tables of the layer's own sample points, see `taxel_quadrature.sampling_tables`.
        sensing_layer: counted from the top.
    """

    def __init__(self, pad: Pad, sampling: Tables, sensing_layer: int) -> None:
        self._mirrors = MirrorPlanes(*pad.surface.mirrors)
        folded = _folded_taxels(pad, sensing_layer, self._mirrors)
        #: Sampling tables that take the place of the layer's own.
        self.sampling: Tables = sampling_tables(
            Sampling(folded.positions, _one_point_each(folded, self._mirrors)), sensing_layer
        )
        # Of the taxels that the mirrors map onto each other, any one may stand for all.
        _, chosen = np.unique(folded.index, return_index=True)
        self._rows = stored_average(sampling, sensing_layer, self._mirrors)[chosen]
        self._home = folded.quadrant[chosen]

    def averaged(self, matrix: npt.NDArray[np.floating], number: int, odd: Sequence[Mask]) -> npt.NDArray[np.floating]:
        """One class's matrix of the averaged points (columns, folded taxels * coordinates) from that of all points.

        Args:
            matrix: (columns, folded points * coordinates), of all columns or some.
            number: of the class.
            odd: coordinates that change their sign under x -> -x, and under y -> -y.
        """
        return _averaged(matrix, self._rows, self._home, (self._mirrors, number), odd)


def _folded_taxels(pad: Pad, sensing_layer: int, mirrors: MirrorPlanes) -> FoldedPoints:
    return fold_points(pad.taxel_points(sensing_layer), LENGTH_TOLERANCE * pad.sampling_radius, mirrors)


def _one_point_each(folded: FoldedPoints, mirrors: MirrorPlanes) -> sparse.csr_array:
    """The averaging matrix (taxels, images * folded taxels) that takes every taxel's own point."""
    taxels, points = len(folded.index), len(folded.positions)
    places = folded.quadrant * points + folded.index
    return sparse.csr_array(
        (np.ones(taxels), (np.arange(taxels), places)), shape=(taxels, len(mirrors.images) * points)
    )


def _averaged(
    matrix: npt.NDArray[np.floating],
    rows: sparse.csr_array,
    home: Indices,
    of_class: tuple[MirrorPlanes, int],
    odd: Sequence[Mask],
) -> npt.NDArray[np.floating]:
    """One class's matrix (columns, folded taxels * coordinates) from that of all points.

    Args:
        matrix: (columns, folded points * coordinates).
        rows: averaging rows (folded taxels, images * folded points) of the taxels that stand for the others.
        home: image each of these lies in.
        of_class: the pad's mirrors, and the number of the class.
        odd: coordinates that change their sign under x -> -x, and under y -> -y.
    """
    (mirrors, number), taxels, width = of_class, len(home), len(odd[0])
    points = matrix.shape[1] // width
    flips = np.array([np.where(odd[0], x, 1) * np.where(odd[1], y, 1) for x, y in mirrors.images])
    signs = mirrors.signs[:, number, None] * flips  # (images, coordinates), of the class at each mirror image
    by_point = matrix.reshape(len(matrix), points, width)
    averaged = np.zeros((len(matrix), taxels, width), matrix.dtype)
    for q in range(len(mirrors.images)):
        of_quadrant = rows[:, q * points : (q + 1) * points].astype(matrix.dtype)
        for k in range(width):
            averaged[:, :, k] += signs[q, k] * signs[home, k] * (of_quadrant @ by_point[:, :, k].T).T
    return averaged.reshape(len(matrix), -1)
