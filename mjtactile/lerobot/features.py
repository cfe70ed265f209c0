"""Descriptions of the columns of a LeRobotDataset, among them those of a pad's readings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile.errors import DatasetError
from mjtactile.pad import Pad, require_pad
from mjtactile.pad_shape.taxels import FreeTaxels

#: Types of columns.
_KINDS = ("float32", "int64", "bool")
#: Largest number of array axes in the format.
_MOST_AXES = 5


@dataclass(frozen=True, kw_only=True)
class Feature:
    """Description of a column.

    Attributes:
        dtype: "float32", "int64" or "bool".
        shape: shape of one frame's entry; (1,) for a number.
        names: names of the components of a vector, or of the axes of an array; None for none.
        info: units and further information for readers, as plain values.

    Raises:
        DatasetError: the format does not support the type or shape.
    """

    dtype: str = "float32"
    shape: tuple[int, ...] = (1,)
    names: list[str] | None = None
    info: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.dtype not in _KINDS:
            raise DatasetError(f"a feature of type {self.dtype!r}; expected one of {', '.join(_KINDS)}.")
        if not 1 <= len(self.shape) <= _MOST_AXES or min(self.shape) < 1:
            raise DatasetError(f"a feature of shape {self.shape}; expected one to {_MOST_AXES} axes, none empty.")

    @property
    def description(self) -> dict[str, Any]:
        """The column's entry in meta/info.json."""
        said = {"dtype": self.dtype, "shape": list(self.shape), "names": self.names}
        return said | ({"info": self.info} if self.info else {})


def vector(names: list[str], unit: str) -> Feature:
    """A vector of named components in one unit."""
    return Feature(shape=(len(names),), names=names, info={"unit": unit})


def tactile_key(pad: str) -> str:
    """Name of the column of a pad's readings."""
    return f"observation.tactile.{pad}"


def between_key(pad: str) -> str:
    """Name of the column of all readings of a pad since the previous frame, if there are several per frame."""
    return f"observation.tactile_between.{pad}"


def tactile_features(
    name: str, pad: Pad, *, rate: float | None = None, per_frame: int = 1, flat: bool = False
) -> dict[str, Feature]:
    """Columns of a pad's readings.

    `observation.tactile.<name>` is the reading at the frame's time. If the pad is read several times per frame,
    `observation.tactile_between.<name>` contains all readings since the previous frame, oldest first; the last one is
    the frame's own.

    Args:
        name: name of the pad.
        pad: the pad.
        rate: rate of its readings [Hz]; None for single presses without a time.
        per_frame: number of readings per frame.
        flat: whether each reading is stored as a vector, for policies that accept only vectors.

    Returns:
        Features by column; their `info` has the unit, the positions of the taxels [m] and the shape of a reading.

    Raises:
        PadError: `pad` is no pad.
    """
    shape = require_pad(pad).reading_shape
    axes = ["taxel"] if isinstance(pad.taxels, FreeTaxels) else ["layer", "row", "column"]
    info = {
        "quantity": "von Mises stress",
        "unit": "Pa",
        "reading_shape": list(shape),
        "axes": axes,
        **_taxel_places(pad),
        "taxel_unit": "m",
        "frame": "pad: origin in the middle of the sensing surface, z out of it, x along columns, y along rows",
        "pad": pad.description,
    }
    info |= {} if rate is None else {"rate": rate}
    entry = (int(np.prod(shape)),) if flat else shape
    axes = ["taxel"] if flat else axes
    found = {tactile_key(name): Feature(shape=entry, names=axes, info=info)}
    if per_frame > 1:
        found[between_key(name)] = Feature(shape=(per_frame, *entry), names=["reading", *axes], info=info)
    return found


def _taxel_places(pad: Pad) -> dict[str, Any]:
    """Positions of taxels [m]: x and y of a grid, and depths along the normals; or points (x, y, z)."""
    if isinstance(pad.taxels, FreeTaxels):
        return {"taxel_points": [list(point) for point in pad.taxels.points]}
    return {
        "taxel_x": [float(x) for x in pad.grid.x],
        "taxel_y": [float(y) for y in pad.grid.y],
        "taxel_depth": [float(depth) for depth in pad.depths],
    }


def tactile_columns(
    name: str, readings: npt.NDArray[np.floating[Any]], *, flat: bool
) -> dict[str, npt.NDArray[np.float32]]:
    """Values of the columns of `tactile_features`.

    Args:
        name: name of the pad.
        readings: readings of an episode, (frames, readings per frame, *reading_shape) [Pa].
        flat: whether each reading is stored as a vector.
    """
    frames, per_frame = readings.shape[:2]
    entry = (-1,) if flat else readings.shape[2:]
    values = readings.astype(np.float32).reshape(frames, per_frame, *entry)
    found = {tactile_key(name): values[:, -1]}
    return found | ({between_key(name): values} if per_frame > 1 else {})
