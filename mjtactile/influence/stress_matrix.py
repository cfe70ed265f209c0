"""Stress matrices as they are stored and applied: whole or as a product of two, in one of four precisions.

The time of a product is that of reading the matrix from memory. Columns are ordered (component, y, x), so those under a
contact form a few contiguous runs. Each run is read once, by a product of its own, without gathering columns first.

In half precision and in bytes every row is scaled to what float16 or int8 can hold. The scale of float16 is a power of
two, so scaling itself loses nothing: entries down to 4e-9 of the row's largest keep eleven bits, and smaller ones an
error of at most 2e-12 of it, whatever the magnitude of the matrix. In int8 a row keeps an error of at most 1/254 of its
largest entry, which suits rows whose entries matter as much as they are large: stress at all points under one force.

numpy has no fast product in either type. Matrices are therefore widened to float32 when they are first used, and kept.
Narrow storage makes the file and its memory map smaller, but every matrix in use takes the memory of float32 as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Tables

#: Up to this many unused columns between two runs are read rather than skipped.
_BRIDGED = 12
#: Exponent of the largest entry of a scaled row; float16 ends just below 2^16.
_TOP_EXPONENT = 15
#: Largest entry of a row scaled for int8.
_TOP_BYTE = 127


def narrow(matrix: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float16], npt.NDArray[np.float32]]:
    """A matrix (columns, rows) in half precision, and the scale of each of its rows, shape (columns, 1)."""
    largest = np.abs(matrix).max(axis=1, keepdims=True, initial=0.0)
    exponent = np.where(largest > 0, np.frexp(largest)[1] - _TOP_EXPONENT, 0)
    scaled = np.ldexp(matrix, -exponent)
    return scaled.astype(np.float16), np.ldexp(np.float32(1.0), exponent).astype(np.float32)


def narrow_to_bytes(matrix: npt.NDArray[Any]) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.float32]]:
    """A matrix (columns, rows) in one byte per entry, and the scale of each of its rows, shape (columns, 1)."""
    largest = np.abs(matrix).max(axis=1, keepdims=True, initial=0.0)
    scale = (largest / _TOP_BYTE).astype(np.float32)
    scale[scale == 0.0] = 1.0
    return np.clip(np.rint(matrix / scale), -_TOP_BYTE, _TOP_BYTE).astype(np.int8), scale


def widen(
    stored: npt.NDArray[np.float16] | npt.NDArray[np.int8], scale: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    """A matrix from `narrow` or `narrow_to_bytes` in single precision, as a new array (columns, rows)."""
    wide = stored.astype(np.float32)
    wide *= scale
    return wide


@dataclass(frozen=True, eq=False)
class ClassForces:
    """Nodal forces of some loads in one symmetry class, scaled so that none is larger than 1."""

    values: Array  #: scaled forces [-], shape (batch, columns)

    @cached_property
    def runs(self) -> list[slice]:
        """Slices of columns that together contain all nonzero forces."""
        used = np.flatnonzero(self.values.any(axis=0))
        if not len(used):
            return []
        ends = np.flatnonzero(np.diff(used) > _BRIDGED)
        starts, stops = used[np.r_[0, ends + 1]], used[np.r_[ends, -1]] + 1
        return [slice(start, stop) for start, stop in zip(starts.tolist(), stops.tolist(), strict=True)]


@dataclass(frozen=True, eq=False)
class StressMatrix:
    """A linear map from forces to stress coordinates."""

    #: One array (columns, rows) [Pa/N], or two arrays (columns, rank) and (rank, rows) with this product.
    factors: tuple[npt.NDArray[Any], ...]

    def times(self, forces: ClassForces) -> Array:
        """Stress coordinates (batch, rows) under scaled forces, in the matrix's precision."""
        first, *others = self.factors
        values = forces.values.astype(first.dtype)
        product = np.zeros((len(values), first.shape[1]), first.dtype)
        for run in forces.runs:
            product += values[:, run] @ first[run]
        for factor in others:
            product = product @ factor
        return product


def stored_matrix(name: str, factors: tuple[npt.NDArray[Any], ...], precision: str) -> Tables:
    """Arrays, by name, in which a matrix is stored: `name` if whole, `name left` and `name right` if factored.

    In float16 and int8, an additional array `... scale` has the scales of each array's rows. With int8, left factors
    are stored in float16: they are small, and their entries differ much in size.
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
    """The matrix stored by `stored_matrix`; float16 and int8 are widened, other precisions are not copied.

    Raises:
        KeyError: there is no such matrix.
    """
    factors = (_read(tables, place) for place in _names(name, 1 if name in tables else 2))
    return StressMatrix(tuple(factors))


def _names(name: str, count: int) -> tuple[str, ...]:
    return (name,) if count == 1 else (f"{name} left", f"{name} right")


def _read(tables: Tables, place: str) -> npt.NDArray[Any]:
    table = tables[place]
    return widen(table, tables[f"{place} scale"]) if table.dtype in (np.float16, np.int8) else table
