"""Reduced influence matrices: deep layers respond little to a load's details, so few patterns span their response.

For each sensing layer and symmetry class, a matrix T (columns x rows) is replaced by the product of T V' and V. The
rows of V span the responses to discs of one small diameter all over the sheet, under normal and shear traction. These
discs are the smallest contacts that the reduction is made for; wider contacts are sums of them. V consists of the
leading right singular vectors of these responses, each scaled to norm 1. Singular vectors of T itself would need a
decomposition of the whole matrix and, at equal rank, lose up to twice as much accuracy on real contacts, because some
of them represent loads that alternate from node to node.

The tolerance is tested on further discs between these. It bounds the root mean square error of a layer's stress at its
sample points over the root mean square of that stress, each point weighted as in the readings. That bounds the error of
the readings in the same norm.

The error was measured on the paper's pad with mesh "default", under punches, 2 mm discs and loads half off the rim,
none of which the reduction uses. It was at most 0.7 of the tolerance in the L2 norm of a layer's readings, and at most
1.3 of it in the worst taxel relative to the layer's peak. The tolerance does not bound the relative error of taxels far
from the load, the error under loads narrower than the discs (one and a half tolerances under discs 1 mm wide), or the
error of the mesh itself.

A matrix stays whole unless its factors are faster for a load that covers a third of the columns; factors that are
faster are smaller, too. The shallowest layer usually stays whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Tables
from mjtactile.fem.corner_loads import onto_corners
from mjtactile.fem.stress import DEVIATORIC_COUNT
from mjtactile.fidelity import Fidelity
from mjtactile.influence.forces import by_class, disc_forces, grid_lines
from mjtactile.influence.stress_matrix import stored_matrix
from mjtactile.influence.table import table_name

if TYPE_CHECKING:
    from mjtactile.influence.matrices import InfluenceMatrices

#: Diameter of the discs over the mesh's reference length [-]: 2 mm on the paper's pad.
_DISC = 0.4
#: Least diameter of the discs over the largest element [-]; the mesh does not resolve smaller ones.
_DISC_ELEMENTS = 1.25
#: Distance between the discs that span the responses over their diameter [-], unless there would be too many.
_SPACING = 0.45
#: Largest number of discs on the quarter; on wider sheets they are further apart, and the reduction is smaller.
_MOST_DISCS = 150
#: Fraction of the columns that a typical load uses [-], for comparing the speed of whole and factored matrices.
_USED_SHARE = 1 / 3
#: Singular values that differ by less than this are equal: single precision leaves them six digits.
_TIE = 1e-5


def reduced_tables(influence: InfluenceMatrices, chosen: Fidelity, on_step: Callable[[], None]) -> Tables:
    """All stress matrices, see `stress_matrix.stored_matrix`, each factored if that saves memory or time.

    Args:
        influence: with whole matrices; each is removed from its tables, to save memory.
        chosen: fidelity of the result: its reduction is the relative error, see the module's description.
        on_step: called after each layer's deviatoric matrices, and after each layer's mean ones.
    """
    spanning, control = _disc_loads(influence)
    tables: Tables = {}
    for kind, width in (("deviatoric", DEVIATORIC_COUNT), ("mean", 1)):
        for k in range(influence.pad.sensing_layers):
            names = [table_name(kind, parity, k) for parity in influence.mirrors.classes]
            matrices = [np.asarray(influence.tables.pop(name)) for name in names]
            factors = _reduced_layer(matrices, spanning, control, _row_weights(influence, k, width), chosen.reduction)
            for name, of_class in zip(names, factors, strict=True):
                tables |= stored_matrix(name, of_class, chosen.precision_at(k))
            on_step()
    return tables


def _reduced_layer(
    matrices: list[npt.NDArray[Any]], spanning: list[Array], control: list[Array], weights: Array, tolerance: float
) -> list[tuple[npt.NDArray[Any], ...]]:
    """Factors of the matrix of each class for one sensing layer; a single factor for a matrix that stays whole."""
    weighted = [matrix * weights.astype(matrix.dtype) for matrix in matrices]
    decomposed = [np.linalg.svd(response, full_matrices=False) for response in _responses(spanning, weighted)]
    bases, strengths = [d.Vh for d in decomposed], [d.S for d in decomposed]  # singular values, largest first
    ranks = _sufficient_ranks(_responses(control, weighted), bases, strengths, tolerance)
    factors: list[tuple[npt.NDArray[Any], ...]] = []
    for whole, scaled, basis, rank in zip(matrices, weighted, bases, ranks, strict=True):
        columns, rows = whole.shape
        if rank is None or rank * (_USED_SHARE * columns + rows) >= _USED_SHARE * columns * rows:
            factors.append((whole,))
        else:
            factors.append((scaled @ basis[:rank].T, (basis[:rank] / weights).astype(whole.dtype)))
    return factors


def _responses(loads: list[Array], weighted: list[npt.NDArray[Any]]) -> list[npt.NDArray[Any]]:
    """Responses (loads, rows) of each class, scaled so that the joint norm over a load's classes is 1."""
    responses = [forces.astype(matrix.dtype) @ matrix for forces, matrix in zip(loads, weighted, strict=True)]
    norm = np.sqrt(sum(np.einsum("lr,lr->l", one, one) for one in responses))
    return [one / norm[:, None] for one in responses]


def _sufficient_ranks(
    responses: list[npt.NDArray[Any]], bases: list[npt.NDArray[Any]], strengths: list[Array], tolerance: float
) -> list[int | None]:
    """Number of rows of each class's basis for which all control responses are within tolerance; None if not enough.

    Rows of all classes are taken in the order of their singular values, at least one of each class. Rows with equal
    singular values are taken or left together: rotating the pad by 90 degrees exchanges two classes, which then have
    equal values.
    """
    coefficients = [response @ basis.T for response, basis in zip(responses, bases, strict=True)]
    outside = sum(
        ((response - c @ basis) ** 2).sum(axis=1)
        for response, c, basis in zip(responses, coefficients, bases, strict=True)
    )
    together = np.concatenate(strengths)
    order = np.argsort(-together, kind="stable")
    in_order = together[order]
    squares = np.concatenate(coefficients, axis=1)[:, order] ** 2
    # Column n: the squared error left when the first n rows are taken.
    left = np.cumsum(np.pad(squares, ((0, 0), (0, 1)))[:, ::-1], axis=1)[:, ::-1] + np.reshape(outside, (-1, 1))
    enough = np.flatnonzero((left <= tolerance**2).all(axis=0))
    if not len(enough):
        return [None] * len(bases)
    owner = np.repeat(np.arange(len(bases)), [len(s) for s in strengths])[order[: _ends_of_ties(in_order)[enough[0]]]]
    return [max(1, int(count)) for count in np.bincount(owner, minlength=len(bases))]


def _ends_of_ties(descending: Array) -> npt.NDArray[np.intp]:
    """For each number of leading values, the least number not below it that does not separate equal values."""
    parts = np.append(descending[1:] < (1.0 - _TIE) * descending[:-1], True)
    ends = np.flatnonzero(parts) + 1
    return np.concatenate([[0], ends[np.searchsorted(ends, np.arange(1, len(descending) + 1))]])


def _row_weights(influence: InfluenceMatrices, sensing_layer: int, width: int) -> Array:
    """Square roots of the summed weights of a layer's folded sample points in the readings, shape (points * width,).

    With these weights the norm of a response is at least that of its readings.
    """
    total = influence.averages[sensing_layer].sum(axis=0).reshape(len(influence.mirrors.images), -1).sum(axis=0)
    return np.repeat(np.sqrt(total), width)


def _disc_loads(influence: InfluenceMatrices) -> tuple[list[Array], list[Array]]:
    """Forces (loads, columns) of each class for the discs that span the responses, and for control discs between."""
    surface, density = influence.surface, influence.density
    largest = max(surface.x.sizes.max(), surface.y.sizes.max())
    diameter = max(_DISC * density.length_for(influence.pad), _DISC_ELEMENTS * float(largest))
    spacing = max(_SPACING * diameter, float(np.sqrt(np.prod(influence.pad.size) / 4 / _MOST_DISCS)))
    lines = grid_lines(influence.pad, spacing * 2 ** (influence.pad.surface.mirrors.count(False) / 2))
    between = [np.append((line[1:] + line[:-1]) / 2, line[-1]) for line in lines]
    spanning, control = (_discs(influence, x, y, diameter) for x, y in (lines, between))
    return spanning, control


def _discs(influence: InfluenceMatrices, x: Array, y: Array, diameter: float) -> list[Array]:
    """Forces (loads, columns) of each class for unit tractions along each axis on discs with centres on a grid."""
    forces = disc_forces(influence.surface, x, y, (diameter,))
    if influence.fidelity.loads == "corners":
        forces = onto_corners(forces, influence.surface)
    return by_class(forces, influence.columns, influence.mirrors)
