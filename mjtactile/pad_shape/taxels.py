"""Taxels at free positions in a pad, given as an array or in a file."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjtactile._files import path_from, read_text, why_unread
from mjtactile._types import Array, Indices
from mjtactile.errors import PadError, shortened
from mjtactile.units import real_numbers

_WHAT = (
    "expected one row (x, y, z) per taxel, in metres and in the pad frame; for a grid give "
    "TaxelGrid(rows=13, columns=13)"
)

#: With more depth bands than this, all taxels are drawn as one layer.
_MOST_BANDS = 8


@dataclass(frozen=True)
class FreeTaxels:
    """Taxels at arbitrary points; readings of such a pad have the shape (taxels,).

    Raises:
        PadError: the points are not finite and of shape (n, 3), or a radius is not positive.
    """

    #: Centres in the pad frame [m], (n, 3); z is 0 in the middle of the sensing surface and negative below it.
    points: tuple[tuple[float, float, float], ...]
    #: Radius of the ball that each taxel averages over [m], (n,); None for the pad's sampling radius.
    radii: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        points = _numbers("points", self.points)
        if points.ndim != 2 or points.shape[1] != 3 or not len(points):
            raise PadError(f"taxels = {shortened(self.points)}, points of shape {points.shape}; {_WHAT}.")
        _refuse(~np.isfinite(points).all(axis=1), "has coordinates that are not finite", points)
        object.__setattr__(self, "points", tuple(map(tuple, points.tolist())))
        if self.radii is None:
            return
        radii = _numbers("radii", self.radii)
        if radii.shape != (len(points),):
            raise PadError(f"free taxels have radii of shape {radii.shape}; expected one per taxel, ({len(points)},).")
        _refuse(~(np.isfinite(radii) & (radii > 0)), "has no positive radius in metres", points)
        object.__setattr__(self, "radii", tuple(radii.tolist()))

    def __len__(self) -> int:
        return len(self.points)

    @property
    def positions(self) -> Array:
        """Centres in the pad frame [m], shape (n, 3)."""
        return np.array(self.points)

    def ball_radii(self, otherwise: float) -> Array:
        """Radius of each taxel's ball [m], shape (n,); `otherwise` if none were given."""
        return np.full(len(self), otherwise) if self.radii is None else np.array(self.radii)

    @classmethod
    def from_file(cls, path: str | Path) -> FreeTaxels:
        """Taxels from a CSV or JSON file; lengths are in metres, in the pad frame.

        CSV has the columns x, y, z and optionally radius, in this order, or in the order of a header line. JSON is a
        list of rows, or an object with "points" and optionally "radii".

        Raises:
            PadError: there is no such file, or it does not contain taxels.
        """
        path = path_from(path, "path", PadError)
        try:
            text = read_text(path)
        except (OSError, ValueError) as error:  # ValueError: a null character in the name, or not UTF-8
            raise PadError(
                f"taxels in {str(path)!r} cannot be read: {why_unread(error)}. Give a CSV or JSON file, points, or "
                "TaxelGrid(rows=13, columns=13)."
            ) from error
        try:
            rows = _from_json(text) if path.suffix.lower() == ".json" else _from_csv(text)
            return cls(*rows)
        except (PadError, ValueError, RecursionError, csv.Error) as error:
            raise PadError(f"{path} holds no taxels: {error}") from error


def depth_bands(depths: Array, radius: float) -> list[Indices]:
    """Ascending indices of taxels in bands of similar depth, top first; each band is drawn as one layer.

    A band ends where the next taxel is deeper by more than `radius`. So taxels in separate layers form one band each,
    and taxels at evenly spread depths form a single band.

    Args:
        depths: of the taxels [m], shape (n,).
        radius: of their balls [m].
    """
    order = np.argsort(depths, kind="stable")
    ends = np.flatnonzero(np.diff(depths[order]) > radius) + 1
    if len(ends) >= _MOST_BANDS:
        return [np.arange(len(depths))]
    return [np.sort(band) for band in np.split(order, ends)]


def as_taxels(value: Any) -> Any:
    """FreeTaxels from points or a file name; anything else, such as a TaxelGrid, is returned unchanged."""
    if isinstance(value, str | Path):
        return FreeTaxels.from_file(value)
    if isinstance(value, np.ndarray | list | tuple):
        return FreeTaxels(value)  # type: ignore[arg-type]
    return value


def _numbers(name: str, values: npt.ArrayLike | None) -> Array:
    numbers = real_numbers(values)
    if numbers is None:
        raise PadError(f"taxels = {shortened(values)} have {name} that are no numbers; {_WHAT}.")
    # Zero without a sign: equal pads would have different texts and fingerprints otherwise.
    return numbers.astype(float) + 0.0


def _refuse(wrong: Any, said: str, points: Array) -> None:
    if wrong.any():
        taxel = int(np.flatnonzero(wrong)[0])
        raise PadError(f"taxel {taxel} at {tuple(points[taxel].tolist())} m {said}.")


def _from_json(text: str) -> tuple[Any, Any]:
    values = json.loads(text)
    if isinstance(values, dict):
        if not {"points"} <= values.keys() <= {"points", "radii"}:
            raise PadError('expected an object with "points" and, if wanted, "radii".')
        return values["points"], values.get("radii")
    return values, None


def _from_csv(text: str) -> tuple[Any, Any]:
    rows = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)]
    if not rows:
        raise PadError("it is empty.")
    names = [cell.strip().lower() for cell in rows[0]]
    if all(_is_number(name) for name in names):
        names = ["x", "y", "z", "radius"][: len(names)]
    else:
        rows = rows[1:]
    if set(names) not in ({"x", "y", "z"}, {"x", "y", "z", "radius"}) or len(set(names)) < len(names):
        raise PadError(
            f"its columns are {', '.join(names)}; expected x, y, z and, if wanted, radius, separated by commas, with "
            "decimal points."
        )
    for number, row in enumerate(rows):
        if len(row) != len(names) or not all(_is_number(cell) for cell in row):
            raise PadError(f"row {number + 1} is {row}; expected {len(names)} numbers.")
    table = np.array([[float(cell) for cell in row] for row in rows]).reshape(len(rows), len(names))
    places = {name: table[:, place] for place, name in enumerate(names)}
    return np.column_stack([places[name] for name in "xyz"]), places.get("radius")


def _is_number(text: str) -> bool:
    try:
        return not math.isnan(float(text))
    except ValueError:
        return False
