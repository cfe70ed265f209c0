"""Influence matrices and surface compliance handed to the compiled core, in the order it reads them in."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile._native import NativePad, contiguous, library, pointer
from mjtactile.contact.compliance import SurfaceCompliance, surface_compliance
from mjtactile.contact.linear_range import linear_range
from mjtactile.fem.stiffness import PARITIES
from mjtactile.fem.symmetry import QUADRANT_SIGNS, QUADRANTS
from mjtactile.influence.stress_matrix import read_matrix
from mjtactile.influence.table import table_name
from mjtactile.pad import Array

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

    from mjtactile.influence.matrices import InfluenceMatrices

_PRECISIONS = ("float16", "float32", "float64", "int8")


def make_pad(influence: InfluenceMatrices, *, stress: bool = False) -> NativePad:
    """The core's copy of influence matrices; with `stress` also those that whole stress tensors take.

    Raises:
        CorruptInfluenceError: when the matrices are not those the pad and the fidelity need; the core does not look.
    """
    influence.check()
    pad = contact_pad(influence, surface_compliance(influence))
    orders = [_by_taxel(influence, k) for k in range(len(influence.pad.depths))]
    for k, order in enumerate(orders):
        _add_layer(pad, influence, k, order)
    for number in range(len(PARITIES)):
        _set_class(pad, influence, number, orders, "deviatoric")
        if stress:
            _set_class(pad, influence, number, orders, "mean")
    return pad


def contact_pad(influence: InfluenceMatrices, compliance: SurfaceCompliance | None) -> NativePad:
    """What the core needs of a pad to press on it, without stress matrices.

    Args:
        influence: of the pad.
        compliance: of its surface; None where no law asks for it.
    """
    surface = influence.surface
    ends = [contiguous(line.vertices) for line in (surface.x, surface.y)]
    if compliance is None:
        patches, splines = [line[[0, -1]] for line in ends], [np.array([0.0, 0.0, 1.0])] * 2
        remainder, factor = np.zeros((1, 1)), 0.0
    else:
        patches = [contiguous(line) for line in compliance.lines]
        splines = [_coefficients(spline) for spline in compliance.splines]
        remainder, factor = contiguous(compliance.remainder[2, :, 2, :]), compliance.normal_factor
    signs, limits = contiguous(QUADRANT_SIGNS), contiguous([*linear_range(influence.pad), influence.pad.thickness])
    handle = library().mjt_pad_new(
        ctypes.c_int(_PRECISIONS.index(influence.fidelity.precision)),
        ctypes.c_int(influence.fidelity.loads == "corners"),
        pointer(limits),
        *(part for line in ends for part in (ctypes.c_size_t(len(line)), pointer(line))),
        ctypes.c_double(factor),
        *(
            part
            for line, spline in zip(patches, splines, strict=True)
            for part in (ctypes.c_size_t(len(line) - 1), pointer(line), pointer(spline))
        ),
        pointer(remainder),
        pointer(signs),
    )
    return NativePad(handle, influence.pad.reading_shape)


def _coefficients(spline: PPoly) -> Array:
    """Of a quadratic spline, (3, intervals, patches), highest power first."""
    coefficients = np.asarray(spline.c)
    return contiguous(np.concatenate([np.zeros((3 - len(coefficients), *coefficients.shape[1:])), coefficients]))


def _by_taxel(influence: InfluenceMatrices, sensing_layer: int) -> npt.NDArray[np.int64]:
    """Folded sample points in an order that keeps those of one taxel together."""
    average: Any = influence.averages[sensing_layer]
    points = average.shape[1] // len(QUADRANTS)
    taxel = np.full(points, average.shape[0], dtype=np.int64)
    rows = np.repeat(np.arange(average.shape[0]), np.diff(average.indptr))
    np.minimum.at(taxel, average.indices % points, rows)
    return np.lexsort((np.arange(points), taxel))


def _add_layer(pad: NativePad, influence: InfluenceMatrices, sensing_layer: int, order: npt.NDArray[np.int64]) -> None:
    average: Any = influence.averages[sensing_layer]
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    quadrant, point = np.divmod(average.indices, len(order))
    starts, places = average.indptr.astype(np.int32), (quadrant * len(order) + place[point]).astype(np.int32)
    weights = contiguous(average.data)
    library().mjt_pad_add_layer(
        pad.handle,
        ctypes.c_size_t(len(order)),
        ctypes.c_size_t(average.shape[0]),
        pointer(starts),
        pointer(places),
        pointer(weights),
    )


def _set_class(
    pad: NativePad, influence: InfluenceMatrices, number: int, orders: list[npt.NDArray[np.int64]], kind: str
) -> None:
    parity, free = PARITIES[number], influence.columns[number]
    quarter = influence.mesh.quarter()
    column_of = np.full((3, quarter.y.node_count, quarter.x.node_count), -1, dtype=np.int32)
    column_of.ravel()[free] = np.arange(len(free))
    if influence.fidelity.loads == "corners":
        column_of = np.ascontiguousarray(column_of[:, ::2, ::2])
    signs = contiguous([parity.component_signs(component) for component in range(3)])
    ranks, lefts, rights = [], [], []
    for k, order in enumerate(orders):
        factors = read_matrix(influence.tables, table_name(kind, parity, k)).factors
        ranks.append(0 if len(factors) == 1 else factors[0].shape[1])
        ordered = _ordered(factors[-1], order)
        lefts.append(ordered if len(factors) == 1 else contiguous(factors[0]))
        rights.append(None if len(factors) == 1 else ordered)
    library().mjt_pad_set_class(
        pad.handle,
        ctypes.c_int(number),
        ctypes.c_size_t(len(free)),
        pointer(column_of),
        pointer(signs),
        (ctypes.c_size_t * len(ranks))(*ranks),
        _pointers(lefts),
        _pointers(rights),
        ctypes.c_int(kind == "mean"),
    )


def _ordered(matrix: npt.NDArray[Any], order: npt.NDArray[np.int64]) -> Array:
    """Rows (point, coordinate) of a matrix (columns, rows) as (coordinate, point), points in another order."""
    by_point = matrix.reshape(len(matrix), len(order), -1)
    return contiguous(by_point[:, order].transpose(0, 2, 1))


def _pointers(arrays: list[Array | None] | list[Array]) -> Any:
    return (ctypes.c_void_p * len(arrays))(*(None if one is None else one.ctypes.data for one in arrays))
