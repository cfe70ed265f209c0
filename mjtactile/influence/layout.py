"""The arrays that a table must contain for a pad and a fidelity, with their types and shapes."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from mjtactile._types import Tables
from mjtactile.errors import CorruptInfluenceError
from mjtactile.fem.corner_loads import on_corners
from mjtactile.fem.mesh import SheetMesh, sheet_mesh
from mjtactile.fem.stress import DEVIATORIC_COUNT
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.fem.symmetry import MirrorPlanes, free_in_plane
from mjtactile.fem.taxel_quadrature import stored_average
from mjtactile.fidelity import Fidelity, MeshDensity
from mjtactile.influence.table import table_name
from mjtactile.pad import Pad

_INDICES = (np.int32, np.int64)
#: Lengths along the axes; None where any length of at least 1 is accepted.
_Shape = tuple[int | None, ...]


@dataclass(frozen=True, eq=False)
class PadTables:
    """Tables of one pad, with the properties of pad and fidelity that are needed to interpret them."""

    pad: Pad  #: the sheet and its taxels
    fidelity: Fidelity  #: mesh, storage and contact law
    tables: Tables = field(repr=False)  #: matrices by name, see `build.build_tables` and `stress_matrix.stored_matrix`

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """The tables themselves: they never change, and they are large."""
        return self

    @property
    def density(self) -> MeshDensity:
        """Density of the mesh and the sample points."""
        return self.fidelity.density

    @cached_property
    def mesh(self) -> SheetMesh:
        """The finite-element mesh of the whole sheet."""
        return sheet_mesh(self.pad, self.density)

    @property
    def mirrors(self) -> MirrorPlanes:
        """Mirror symmetries of the pad, which determine the symmetry classes of its matrices."""
        return MirrorPlanes(*self.pad.surface.mirrors)

    @cached_property
    def surface(self) -> SurfaceGrid:
        """The grid on which loads are integrated."""
        return self.mesh.surface

    @cached_property
    def columns(self) -> list[np.ndarray]:
        """For each class, indices (component, y, x) of the quarter's surface degrees of freedom with stress columns."""
        quarter = self.mesh.quarter()
        corners = on_corners(quarter) if self.fidelity.loads == "corners" else np.True_
        return [np.flatnonzero(free_in_plane(quarter, parity) & corners) for parity in self.mirrors.classes]

    @cached_property
    def free(self) -> list[np.ndarray]:
        """For each class, indices (component, y, x) of all free degrees of freedom of the quarter's surface."""
        quarter = self.mesh.quarter()
        return [np.flatnonzero(free_in_plane(quarter, parity)) for parity in self.mirrors.classes]

    @cached_property
    def averages(self) -> list[sparse.csr_array]:
        """For each sensing layer, the matrix (taxels, points) that averages the layer's sample points."""
        return [stored_average(self.tables, k, self.mirrors) for k in range(self.pad.sensing_layers)]

    @cached_property
    def sample_slices(self) -> list[slice]:
        """For each sensing layer, the slice of its sample points among all, ordered image by image."""
        images, layers = len(self.mirrors.images), range(self.pad.sensing_layers)
        counts = [images * len(self.tables[f"sampling points {k}"]) for k in layers]
        ends = np.cumsum([0, *counts]).tolist()
        return [slice(start, end) for start, end in itertools.pairwise(ends)]

    def check(self) -> None:
        """Check that the tables are those of the pad and the fidelity.

        Raises:
            CorruptInfluenceError: an array is missing or unknown, has another type or shape, or has indices out of
                range; the message names it.
        """
        layout = _Layout(self.tables)
        points = [_check_sampling(layout, self.pad, k) for k in range(self.pad.sensing_layers)]
        for parity, columns, free in zip(self.mirrors.classes, self.columns, self.free, strict=True):
            layout.take(table_name("compliance", parity), (np.float64,), (len(free), len(free)))
            for kind, width in (("deviatoric", DEVIATORIC_COUNT), ("mean", 1)):
                for k, of_layer in enumerate(points):
                    shape = len(columns), of_layer * width
                    _check_matrix(layout, table_name(kind, parity, k), shape, self.fidelity, k)
        layout.require_nothing_else()


def _check_sampling(layout: _Layout, pad: Pad, sensing_layer: int) -> int:
    """Check one layer's sample points and return how many there are."""
    taxels = math.prod(pad.reading_shape) // pad.sensing_layers
    names = {name: f"sampling {name} {sensing_layer}" for name in ("points", "data", "indices", "indptr")}
    points = layout.take(names["points"], (np.float64,), (None, 3))
    weights = layout.take(names["data"], (np.float64,), (None,))
    layout.take(names["indices"], _INDICES, weights.shape)
    layout.take(names["indptr"], _INDICES, (taxels + 1,))
    stored_average(layout.tables, sensing_layer, MirrorPlanes(*pad.surface.mirrors))
    return len(points)


def _check_matrix(layout: _Layout, name: str, shape: tuple[int, int], fidelity: Fidelity, sensing_layer: int) -> None:
    """Check a stress matrix (columns, rows): whole, or in two factors if it is reduced, see `stored_matrix`."""
    (columns, rows), precision = shape, fidelity.precision_at(sensing_layer)
    if name in layout.tables or fidelity.reduction == 0.0:
        factors: dict[str, _Shape] = {name: (columns, rows)}
    else:
        left = f"{name} left"
        # The rank is known from the left factor alone.
        rank = layout.tables[left].shape[-1] if left in layout.tables and layout.tables[left].ndim else None
        factors = {left: (columns, rank), f"{name} right": (rank, rows)}
    last = list(factors)[-1]
    for place, of_factor in factors.items():
        narrow = {"int8": np.int8 if place == last else np.float16, "float16": np.float16}.get(precision)
        layout.take(place, (narrow or np.dtype(precision).type,), of_factor)
        if narrow is not None:
            layout.take(f"{place} scale", (np.float32,), (of_factor[0], 1))


class _Layout:
    """Tables that are checked one by one."""

    def __init__(self, tables: Tables) -> None:
        self.tables = tables  #: all of them
        self._left = set(tables)

    def take(self, name: str, dtypes: tuple[type[np.generic], ...], shape: _Shape) -> npt.NDArray[Any]:
        """A table by name, after checking that it exists and has one of the types and the shape."""
        if name not in self.tables:
            raise CorruptInfluenceError(f"the array {name!r} is missing. {_CURE}")
        table = self.tables[name]
        fits = len(table.shape) == len(shape) and all(
            length == wanted if wanted is not None else length > 0
            for length, wanted in zip(table.shape, shape, strict=True)
        )
        if table.dtype not in dtypes or not fits:
            types = " or ".join(np.dtype(dtype).name for dtype in dtypes)
            lengths = ", ".join("any" if length is None else str(length) for length in shape)
            raise CorruptInfluenceError(
                f"the array {name!r} is {table.dtype.name} {table.shape}; expected {types} ({lengths}). {_CURE}"
            )
        self._left.discard(name)
        return table

    def require_nothing_else(self) -> None:
        """Refuse tables that were not passed to `take`."""
        if self._left:
            unknown = ", ".join(map(repr, sorted(self._left)))
            raise CorruptInfluenceError(f"it holds arrays that this table does not have: {unknown}. {_CURE}")


_CURE = "Delete the table and build it anew: mjtactile build"
