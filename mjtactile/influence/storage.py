"""Conversion of whole matrices to the storage of a fidelity: averaging, columns, reduction and precision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Tables
from mjtactile.fem.symmetry import MirrorPlanes, Parity
from mjtactile.fidelity import Fidelity
from mjtactile.influence.matrices import ODD, InfluenceMatrices
from mjtactile.influence.stress_matrix import stored_matrix
from mjtactile.influence.table import table_name
from mjtactile.pad import Pad

if TYPE_CHECKING:
    from mjtactile.influence.taxel_mean import LayerMeans

_STRESSES = ("deviatoric", "mean")


class ClassStorage:
    """The steps of a fidelity's storage that work on one class and a block of columns at a time, to save memory.

    Args:
        pad: the sheet.
        chosen: the fidelity.
        sampling: tables of all sample points, see `taxel_quadrature.sampling_tables`.

    Raises:
        PresetError: loads="corners" on a mesh with an odd number of elements along an axis.
    """

    def __init__(self, pad: Pad, chosen: Fidelity, sampling: Tables) -> None:
        plain = plain_fidelity(chosen)
        #: Fidelity of the result: the chosen one without reduction, in the precision of the whole matrices.
        self.fidelity = replace(plain, averaging=chosen.averaging, loads=chosen.loads)
        self.sampling = dict(sampling)  #: tables of the remaining sample points
        self._classes = MirrorPlanes(*pad.surface.mirrors).classes
        self._means: dict[int, LayerMeans] = {}  # by sensing layer; none where the sample points stay
        self._corners = None
        if chosen.averaging != "points":
            from mjtactile.influence.taxel_mean import LayerMeans

            ways = [chosen.averaging_at(k) for k in range(pad.sensing_layers)]
            self._means = {k: LayerMeans(pad, sampling, k, way) for k, way in enumerate(ways) if way != "points"}
            for means in self._means.values():
                self.sampling |= means.sampling
        if chosen.loads == "corners":
            from mjtactile.influence.corner_columns import CornerColumns

            # The surface compliance keeps all columns.
            self._corners = CornerColumns(InfluenceMatrices(pad, plain, {}))

    def averaged(self, kind: str, parity: Parity, sensing_layer: int, matrix: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Rows of the remaining sample points, from some columns of a matrix (columns, rows of all points)."""
        if sensing_layer not in self._means:
            return matrix
        return self._means[sensing_layer].averaged(matrix, self._classes.index(parity), ODD[kind])

    def columns(self, parity: Parity, matrix: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The remaining columns of a matrix (columns, rows)."""
        return matrix if self._corners is None else self._corners.of(matrix, self._classes.index(parity))


def plain_fidelity(chosen: Fidelity) -> Fidelity:
    """The fidelity of the table that `chosen` is derived from: the same mesh, whole matrices in float32 or float64."""
    precision = "float64" if chosen.precision == "float64" else "float32"
    return Fidelity(mesh=chosen.mesh, precision=precision)


def narrowing_steps(pad: Pad, made: Fidelity, chosen: Fidelity) -> int:
    """Number of times `reduced_and_narrowed` reports progress."""
    unchanged = chosen.reduction == 0.0 and chosen.precision == made.precision
    return 0 if unchanged else len(_STRESSES) * pad.sensing_layers


def in_storage(
    plain: InfluenceMatrices, chosen: Fidelity, on_step: Callable[[], None] = lambda: None
) -> InfluenceMatrices:
    """Influence matrices in the storage of a fidelity, from those at `plain_fidelity(chosen)`.

    `on_step` is called `narrowing_steps` times.

    Raises:
        PresetError: loads="corners" on a mesh with an odd number of elements along an axis.
    """
    storage = ClassStorage(plain.pad, chosen, {n: t for n, t in plain.tables.items() if n.startswith("sampling")})
    tables = {name: table for name, table in plain.tables.items() if name.startswith("compliance")} | storage.sampling
    for kind in _STRESSES:
        for k in range(plain.pad.sensing_layers):
            for parity in plain.mirrors.classes:
                name = table_name(kind, parity, k)
                averaged = storage.averaged(kind, parity, k, np.asarray(plain.tables[name]))
                tables[name] = storage.columns(parity, averaged)
    whole = InfluenceMatrices(plain.pad, replace(storage.fidelity, precision=plain.fidelity.precision), tables)
    return reduced_and_narrowed(whole, chosen, on_step)


def reduced_and_narrowed(whole: InfluenceMatrices, chosen: Fidelity, on_step: Callable[[], None]) -> InfluenceMatrices:
    """Matrices in the storage of a fidelity, from matrices that differ in reduction and precision only.

    To save memory, matrices are removed from the tables of `whole`, which cannot be used afterwards. Calls
    `on_step` `narrowing_steps` times.
    """
    if not narrowing_steps(whole.pad, whole.fidelity, chosen):
        return replace(whole, fidelity=chosen)
    others = {name: table for name, table in whole.tables.items() if not name.startswith(_STRESSES)}
    if chosen.reduction > 0.0:
        from mjtactile.influence.low_rank import reduced_tables

        stresses = reduced_tables(whole, chosen, on_step)
    else:
        stresses = _narrowed(whole, chosen, on_step)
    return InfluenceMatrices(whole.pad, chosen, others | stresses)


def _narrowed(whole: InfluenceMatrices, chosen: Fidelity, on_step: Callable[[], None]) -> Tables:
    """All stress matrices, whole, in the precision of another fidelity."""
    tables: Tables = {}
    for kind in _STRESSES:
        for k in range(whole.pad.sensing_layers):
            for parity in whole.mirrors.classes:
                name = table_name(kind, parity, k)
                tables |= stored_matrix(name, (whole.tables.pop(name),), chosen.precision_at(k))
            on_step()
    return tables
