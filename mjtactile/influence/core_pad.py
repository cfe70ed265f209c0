"""Influence matrices passed to the compiled core, in its memory layout."""

from __future__ import annotations

import ctypes
import math
import threading
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._native import contiguous, library, pointer, sized
from mjtactile._types import Array, Indices
from mjtactile.influence.forces import largest_force
from mjtactile.influence.layout import PadTables
from mjtactile.influence.stress_matrix import read_matrix
from mjtactile.influence.table import table_name
from mjtactile.pad_shape.core_surface import core_surface

#: In the order of the core's enum Precision; see mjt_pad_new.
_PRECISIONS = ("float16", "float32", "float64", "int8")
#: Forces between 2^-n and 2^n newtons, with this n, are not rescaled.
_COMMON_POWERS = 20


class CorePad:
    """A pad in the compiled core. Stress matrices and data for contacts are added later."""

    def __init__(self, influence: PadTables) -> None:
        grid = influence.surface
        ends, mirrors = [contiguous(line.vertices) for line in (grid.x, grid.y)], influence.mirrors
        signs = contiguous(mirrors.signs)
        handle = library().mjt_pad_new(
            ctypes.c_int(_PRECISIONS.index(influence.fidelity.widest_precision)),
            ctypes.c_int(influence.fidelity.loads == "corners"),
            *(part for line in ends for part in sized(line)),
            *(ctypes.c_int(mirrored) for mirrored in (mirrors.x, mirrors.y)),
            pointer(signs),
        )
        self.handle = ctypes.c_void_p(handle)  #: pointer to the core's object, an argument of the core's functions
        if not grid.outer.is_flat:
            half_size = float(grid.x.vertices[-1]), float(grid.y.vertices[-1])
            library().mjt_pad_set_outer(self.handle, core_surface(grid.outer, half_size).handle)
        self._taxels, self._given, self._giving = influence.pad.reading_shape, set[str](), threading.Lock()
        self._finalizer = weakref.finalize(self, library().mjt_pad_free, self.handle)

    def give(self, what: str, action: Callable[[], None]) -> None:
        """Call `action` once per name, under a lock: data that other threads may be using is never replaced."""
        with self._giving:
            if what not in self._given:
                self._given.add(what)
                action()

    def readings(self, forces: Array) -> Array:
        """Readings [Pa], of shape `Pad.reading_shape`, under nodal forces (nodes y, nodes x, 3) [N].

        Raises:
            InfluenceError: a force is not finite.
        """
        readings = np.empty(self._taxels)
        # Squares of stresses could overflow single precision: forces far from 1 N are scaled by a power of two.
        power = math.frexp(largest_force(forces))[1]
        power = power if abs(power) > _COMMON_POWERS else 0
        forces = contiguous(np.ldexp(forces, -power) if power else forces)
        library().mjt_readings(self.handle, pointer(forces), pointer(readings))
        return np.ldexp(readings, power) if power else readings


_pads: weakref.WeakKeyDictionary[PadTables, dict[bool, CorePad]] = weakref.WeakKeyDictionary()
_making = threading.Lock()


def core_pad(influence: PadTables, *, stress: bool = False) -> CorePad:
    """The core's copy of influence matrices, made at the first call and shared.

    Full stress tensors (`stress`) take a fifth more memory.

    Raises:
        CorruptInfluenceError: the matrices are not those of the pad and the fidelity; the core does not check them.
    """
    with _making:
        made = _pads.setdefault(influence, {})
        if stress not in made:
            made[stress] = _with_matrices(influence, stress)
        return made[stress]


def _with_matrices(influence: PadTables, stress: bool) -> CorePad:
    influence.check()
    pad = CorePad(influence)
    orders = [_by_taxel(influence, k) for k in range(influence.pad.sensing_layers)]
    for k, order in enumerate(orders):
        _add_layer(pad, influence, k, order)
    for number in range(len(influence.mirrors.classes)):
        _set_class(pad, influence, number, orders, "deviatoric")
        if stress:
            _set_class(pad, influence, number, orders, "mean")
    return pad


def _by_taxel(influence: PadTables, sensing_layer: int) -> Indices:
    """Order of the folded sample points in which those of one taxel are neighbours."""
    average: Any = influence.averages[sensing_layer]
    points = average.shape[1] // len(influence.mirrors.images)
    taxel = np.full(points, average.shape[0], dtype=np.int64)
    rows = np.repeat(np.arange(average.shape[0]), np.diff(average.indptr))
    np.minimum.at(taxel, average.indices % points, rows)
    return np.lexsort((np.arange(points), taxel))


def _add_layer(pad: CorePad, influence: PadTables, sensing_layer: int, order: Indices) -> None:
    average: Any = influence.averages[sensing_layer]
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    image, point = np.divmod(average.indices, len(order))
    starts, places = average.indptr.astype(np.int32), (image * len(order) + place[point]).astype(np.int32)
    weights = contiguous(average.data)
    library().mjt_pad_add_layer(
        pad.handle,
        ctypes.c_int(_PRECISIONS.index(influence.fidelity.precision_at(sensing_layer))),
        ctypes.c_size_t(len(order)),
        ctypes.c_size_t(average.shape[0]),
        pointer(starts),
        pointer(places),
        pointer(weights),
    )


def _set_class(pad: CorePad, influence: PadTables, number: int, orders: list[Indices], kind: str) -> None:
    parity, free = influence.mirrors.classes[number], influence.columns[number]
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


def _ordered(matrix: npt.NDArray[Any], order: Indices) -> Array:
    """Rows (point, coordinate) of a matrix (columns, rows) as (coordinate, point), points in another order."""
    by_point = matrix.reshape(len(matrix), len(order), -1)
    return contiguous(by_point[:, order].transpose(0, 2, 1))


def _pointers(arrays: list[Array | None] | list[Array]) -> Any:
    return (ctypes.c_void_p * len(arrays))(*(None if one is None else one.ctypes.data for one in arrays))
