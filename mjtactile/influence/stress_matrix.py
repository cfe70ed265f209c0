"""Stress matrices as they are stored and applied: whole or as a product of two, in one of four precisions.

Applying one is bound by the memory it touches. Columns lie as (component, y, x), so those under a contact form a few
contiguous runs, and a run is read in order by one product of its own, where gathering it first would read it twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile.influence.precision import narrow, narrow_to_bytes, widen
from mjtactile.influence.table import Tables
from mjtactile.pad import Array

if TYPE_CHECKING:
    from mjtactile.influence.forces import ClassForces


@dataclass(frozen=True, eq=False)
class StressMatrix:
    """A linear map from forces to stress coordinates.

    Attributes:
        factors: one array (columns, rows), or two whose product it is, (columns, rank) and (rank, rows) [Pa/N].
    """

    factors: tuple[npt.NDArray[Any], ...]

    def times(self, forces: ClassForces) -> Array:
        """Stress coordinates (batch, rows) of the scaled forces, in the matrix's precision."""
        first, *others = self.factors
        values = forces.values.astype(first.dtype)
        product = np.zeros((len(values), first.shape[1]), first.dtype)
        for run in forces.runs:
            product += values[:, run] @ first[run]
        for factor in others:
            product = product @ factor
        return product


def stored_matrix(name: str, factors: tuple[npt.NDArray[Any], ...], precision: str) -> Tables:
    """Arrays under which a matrix is stored: whole as `name`, factored as `name left` and `name right`.

    In float16 and int8, `... scale` beside each array holds the scales of its rows. In int8 a left factor is stored in
    float16: it is small, its rows mix patterns of very different strength, and every force passes through it.
    """
    tables: Tables = {}
    places = _names(name, len(factors))
    for place, factor in zip(places, factors, strict=True):
        if precision == "int8" and place == places[-1]:
            tables[place], tables[f"{place} scale"] = narrow_to_bytes(factor)
        elif precision in ("int8", "float16"):
            tables[place], tables[f"{place} scale"] = narrow(factor)
        else:
            tables[place] = np.ascontiguousarray(factor, dtype=precision)
    return tables


def read_matrix(tables: Tables, name: str) -> StressMatrix:
    """The matrix stored by `stored_matrix`; float16 and int8 are widened here, the others stay where they lie.

    Raises:
        KeyError: when there is no such matrix.
    """
    factors = (_read(tables, place) for place in _names(name, 1 if name in tables else 2))
    return StressMatrix(tuple(factors))


def _names(name: str, count: int) -> tuple[str, ...]:
    return (name,) if count == 1 else (f"{name} left", f"{name} right")


def _read(tables: Tables, place: str) -> npt.NDArray[Any]:
    table = tables[place]
    return widen(table, tables[f"{place} scale"]) if table.dtype in (np.float16, np.int8) else table
