"""The pad: a layered elastic sheet, its sensing elements (taxels), and where their readings are taken.

Lengths are metres, stresses pascals. The pad frame has its origin in the middle of the sensing surface,
z out of the pad, x along taxel columns and y along taxel rows.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from mjtactile._types import Array
from mjtactile.errors import PadError

#: Thinnest layer that is meshed [m]; thinner ones are better described by a change of their neighbour's modulus.
MINIMUM_LAYER_THICKNESS = 1e-6
#: Lengths of a pad, least and most [m]: from a micrometre to ten metres.
LENGTHS = 1e-6, 10.0
#: Young's moduli of a pad, least and most [Pa]: far softer than any gel, far stiffer than diamond.
MODULI = 1.0, 1e15
#: Longest sheet over its width [-].
MOST_ASPECT = 1000.0
#: Most layers of a stack, most sensing layers, and most readings of a pad: taxels times sensing layers.
MOST_LAYERS, MOST_DEPTHS, MOST_READINGS = 64, 64, 100_000
#: Lengths closer than this fraction of the sheet's thickness count as equal.
LENGTH_TOLERANCE = 1e-9


def _require(condition: bool | np.bool_, message: str) -> None:
    if not condition:
        raise PadError(message)


def _number(name: str, value: Any, unit: str) -> float:
    """A real number as a float; NaN and infinities pass."""
    if isinstance(value, str | bytes | bool | np.bool_):
        raise PadError(f"{name} = {value!r}; expected a number{unit}.")
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    except (TypeError, ValueError):
        raise PadError(f"{name} = {_shortened(value)}; expected a number{unit}.") from None


def _shortened(value: Any) -> str:
    """A value for a message, however long."""
    try:
        said = repr(value)
    except ValueError:  # Python writes out no integers of many thousand digits
        return "a very large number"
    return said if len(said) <= _LONGEST_VALUE else f"{said[:_LONGEST_VALUE]}..."


def _is_length(value: float) -> bool:
    return LENGTHS[0] <= value <= LENGTHS[1]


#: Most characters of a value in a message.
_LONGEST_VALUE = 120
_LENGTH_RANGE = f"from {LENGTHS[0]:g} to {LENGTHS[1]:g} m"


@dataclass(frozen=True, kw_only=True)
class Layer:
    """One homogeneous, isotropic, linear-elastic layer, bonded to its neighbours."""

    thickness: float  #: [m]
    young: float  #: Young's modulus [Pa]
    poisson: float  #: Poisson ratio [-], in [0, 0.5)

    def __post_init__(self) -> None:
        """Normalise number types and refuse values no elastic layer has."""
        for name, unit in (("thickness", " in metres"), ("young", " in pascals"), ("poisson", "")):
            object.__setattr__(self, name, _number(name, getattr(self, name), unit))
        _require(
            MINIMUM_LAYER_THICKNESS <= self.thickness <= LENGTHS[1],
            f"layer thickness = {self.thickness} m; expected {MINIMUM_LAYER_THICKNESS} to {LENGTHS[1]:g} m. "
            "Lengths are in metres: 5 mm is 5e-3. Merge thinner films with a neighbouring layer.",
        )
        _require(
            MODULI[0] <= self.young <= MODULI[1],
            f"young = {self.young} Pa; expected a modulus from {MODULI[0]:g} to {MODULI[1]:g} Pa. Moduli are in "
            "pascals: 3 MPa is 3e6.",
        )
        _require(
            math.isfinite(self.poisson) and 0.0 <= self.poisson < 0.5,
            f"poisson = {self.poisson} is outside [0, 0.5). For nearly incompressible silicone use 0.49.",
        )

    @property
    def shear_modulus(self) -> float:
        """Shear modulus mu = E / (2 (1 + nu)) [Pa]."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def lame_lambda(self) -> float:
        """First Lame parameter lambda = E nu / ((1 + nu)(1 - 2 nu)) [Pa]."""
        return self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))


@dataclass(frozen=True, kw_only=True)
class TaxelGrid:
    """A rectangular grid of taxels, seen from above: rows along y, columns along x."""

    rows: int = 13  #: taxels along y
    columns: int = 13  #: taxels along x
    pitch: tuple[float, float] = (1.25e-3, 1.25e-3)  #: spacing along (x, y) [m]
    centre: tuple[float, float] = (0.0, 0.0)  #: middle of the grid in the pad frame (x, y) [m]

    def __post_init__(self) -> None:
        """Normalise number types and refuse empty grids."""
        object.__setattr__(self, "pitch", _pair("pitch", self.pitch))
        object.__setattr__(self, "centre", _pair("centre", self.centre))
        for name in ("rows", "columns"):
            count = getattr(self, name)
            _require(
                isinstance(count, int | np.integer) and not isinstance(count, bool) and count >= 1,
                f"TaxelGrid {name} = {_shortened(count)}; expected a whole number of at least 1.",
            )
            _require(
                count <= MOST_READINGS,
                f"TaxelGrid {name} = {_shortened(count)}; expected at most {MOST_READINGS}, as many as a pad may read.",
            )
            object.__setattr__(self, name, int(count))
        _require(
            all(_is_length(p) for p in self.pitch),
            f"TaxelGrid pitch = {self.pitch} m; expected two positive lengths in metres (1.25 mm is 1.25e-3), "
            f"{_LENGTH_RANGE}.",
        )
        _require(
            all(math.isfinite(c) for c in self.centre),
            f"TaxelGrid centre = {self.centre} m; expected two finite coordinates in the pad frame.",
        )

    @property
    def x(self) -> Array:
        """Column positions [m], shape (columns,)."""
        return self.centre[0] + (np.arange(self.columns, dtype=np.float64) - (self.columns - 1) / 2) * self.pitch[0]

    @property
    def y(self) -> Array:
        """Row positions [m], shape (rows,)."""
        return self.centre[1] + (np.arange(self.rows, dtype=np.float64) - (self.rows - 1) / 2) * self.pitch[1]


@dataclass(frozen=True, kw_only=True)
class Pad:
    """A rectangular layered sheet bonded to a rigid base, sides and top free.

    The defaults are the sensor of Aoyagi 2008 (Recognition of Contact State of Four Layers Arrayed Type Tactile
    Sensor by Using Neural Networks): 15 x 15 x 5 mm of PDMS, E = 3 MPa, 13 x 13 taxels at 1.25 mm pitch at depths
    of 1, 2, 3 and 4 mm, each reading the mean von Mises stress within 0.625 mm. The paper gives no Poisson ratio;
    0.49 is ours. Layers are listed from the sensing surface down.

    Raises:
        PadError: for any value no such sheet has; the message names the value and the cure.
    """

    size: tuple[float, float] = (15e-3, 15e-3)  #: extent along (x, y) [m]
    layers: tuple[Layer, ...] = (Layer(thickness=5e-3, young=3e6, poisson=0.49),)  #: top first
    taxels: TaxelGrid = field(default_factory=TaxelGrid)  #: where its taxels are
    depths: tuple[float, ...] = (1e-3, 2e-3, 3e-3, 4e-3)  #: sensing layers below the surface [m], top first
    sampling_radius: float = 0.625e-3  #: a reading is the mean over a ball of this radius [m]

    def __post_init__(self) -> None:
        """Normalise number types and refuse pads that cannot exist."""
        object.__setattr__(self, "size", _pair("size", self.size))
        object.__setattr__(self, "layers", _tuple_of_layers(self.layers))
        object.__setattr__(self, "depths", _tuple_of_depths(self.depths))
        object.__setattr__(self, "sampling_radius", _number("sampling_radius", self.sampling_radius, " in metres"))
        _require(
            isinstance(self.taxels, TaxelGrid),
            f"taxels = {_shortened(self.taxels)}; expected a TaxelGrid, for example TaxelGrid(rows=13, columns=13).",
        )
        _require(
            all(_is_length(s) for s in self.size),
            f"pad size = {self.size} m; expected two positive lengths in metres (15 mm is 15e-3), {_LENGTH_RANGE}.",
        )
        _require(
            max(self.size) <= MOST_ASPECT * min(self.size),
            f"pad size = {self.size} m; expected a sheet at most {MOST_ASPECT:g} times as long as wide. Lengths are in "
            "metres: 15 mm is 15e-3.",
        )
        _require(
            self.thickness <= LENGTHS[1],
            f"the sheet is {self.thickness:.6g} m thick; expected at most {LENGTHS[1]:g} m. Lengths are in metres.",
        )
        largest = max(*self.size, self.thickness)
        _require(
            LENGTHS[0] <= self.sampling_radius <= largest,
            f"sampling_radius = {self.sampling_radius} m; expected a positive length, for example 0.625e-3, from "
            f"{LENGTHS[0]:g} m to what the sheet measures, {largest:.6g} m.",
        )
        self._check_depths()
        layers, rows, columns = self.reading_shape
        _require(
            layers * rows * columns <= MOST_READINGS,
            f"{rows} x {columns} taxels in {layers} layers are {layers * rows * columns} readings; expected at most "
            f"{MOST_READINGS}. Use a larger pitch, or several pads.",
        )
        self._check_taxels_on_sheet()

    def _check_depths(self) -> None:
        _require(
            all(a < b for a, b in zip(self.depths, self.depths[1:], strict=False)),
            f"depths = {self.depths} m; expected them to increase from the surface down, without repeats.",
        )
        tolerance = LENGTH_TOLERANCE * self.thickness
        for depth in self.depths:
            _require(
                -tolerance <= depth <= self.thickness + tolerance,
                f"sensing depth {depth} m lies outside the sheet, which is {self.thickness:.6g} m thick. "
                f"Give depths between 0 and {self.thickness:.6g} m, or thicker layers.",
            )

    def _check_taxels_on_sheet(self) -> None:
        for axis, name, positions in ((0, "columns", self.taxels.x), (1, "rows", self.taxels.y)):
            half = self.size[axis] / 2
            reach = float(np.max(np.abs(positions)))
            _require(
                reach <= half * (1 + LENGTH_TOLERANCE),
                f"the outer taxel {name} stand {reach:.6g} m from the middle, but the sheet ends at {half:.6g} m. "
                "Use fewer taxels, a smaller pitch or a larger size.",
            )

    @property
    def thickness(self) -> float:
        """Total thickness of the sheet [m]."""
        return math.fsum(layer.thickness for layer in self.layers)

    @property
    def interfaces(self) -> tuple[float, ...]:
        """Heights z of the bonded interfaces between layers [m], top first, without surface and base."""
        return tuple(-math.fsum(layer.thickness for layer in self.layers[: i + 1]) for i in range(len(self.layers) - 1))

    @property
    def reading_shape(self) -> tuple[int, int, int]:
        """Shape of one set of readings: (sensing layers, rows, columns)."""
        return len(self.depths), self.taxels.rows, self.taxels.columns

    @property
    def description(self) -> dict[str, Any]:
        """The pad as plain numbers, as written beside saved tables."""
        return asdict(self)

    @property
    def fingerprint(self) -> str:
        """SHA-256 over every number of the pad: two pads share it only if they are the same pad."""
        return hashlib.sha256(json.dumps(self.description, sort_keys=True).encode()).hexdigest()

    @property
    def summary(self) -> str:
        """One line for people: size, stack and taxels."""
        stack = " + ".join(
            f"{layer.thickness * 1e3:.4g} mm (E {layer.young / 1e6:.4g} MPa, nu {layer.poisson:g})"
            for layer in self.layers
        )
        layers, rows, columns = self.reading_shape
        return (
            f"{self.size[0] * 1e3:.4g} x {self.size[1] * 1e3:.4g} mm sheet of {stack}, "
            f"{rows} x {columns} taxels at {layers} depth{'s' if layers > 1 else ''}"
        )


def _pair(name: str, value: Any) -> tuple[float, float]:
    try:
        first, second = value
    except (TypeError, ValueError):
        raise PadError(f"{name} = {_shortened(value)}; expected two numbers (x, y) in metres.") from None
    return _number(name, first, " in metres"), _number(name, second, " in metres")


def _tuple_of_layers(layers: Any) -> tuple[Layer, ...]:
    listed = (layers,) if isinstance(layers, Layer) else _first_of(layers, MOST_LAYERS) or ()
    _require(
        len(listed) > 0 and all(isinstance(layer, Layer) for layer in listed),
        "layers must hold at least one Layer(thickness=..., young=..., poisson=...), top first.",
    )
    _require(len(listed) <= MOST_LAYERS, f"more than {MOST_LAYERS} layers; merge thin ones with their neighbours.")
    return listed


def _tuple_of_depths(depths: Any) -> tuple[float, ...]:
    listed = (depths,) if isinstance(depths, int | float | np.number) else _first_of(depths, MOST_DEPTHS)
    if listed is None or isinstance(depths, str | bytes):
        raise PadError(f"depths = {_shortened(depths)}; expected numbers in metres, top layer first.")
    _require(len(listed) <= MOST_DEPTHS, f"more than {MOST_DEPTHS} sensing depths; expected at most so many.")
    try:
        numbers = tuple(_number("depth", depth, " in metres") for depth in listed)
    except PadError:
        raise PadError(f"depths = {_shortened(depths)}; expected numbers in metres, top layer first.") from None
    _require(len(numbers) > 0, "depths is empty; give at least one sensing depth in metres, for example (1e-3,).")
    _require(all(map(math.isfinite, numbers)), f"depths = {numbers}; expected finite numbers in metres.")
    return numbers


def _first_of(values: Any, most: int) -> tuple[Any, ...] | None:
    """What an iterable holds, one more than `most` at most; None when it is no iterable."""
    try:
        return tuple(itertools.islice(values, most + 1))
    except TypeError:
        return None


def force_vector(magnitude: float, tilt_deg: float = 0.0, azimuth_deg: float = 0.0) -> Array:
    """Force F (sin t cos a, sin t sin a, -cos t) in the pad frame [N], shape (3,).

    Args:
        magnitude: F [N]; 1 gf is 9.80665e-3 N.
        tilt_deg: t, from straight into the pad [deg].
        azimuth_deg: a, of the tangential part, from +x towards +y [deg].
    """
    tilt, azimuth = math.radians(tilt_deg), math.radians(azimuth_deg)
    tangential = math.sin(tilt)
    return magnitude * np.array([tangential * math.cos(azimuth), tangential * math.sin(azimuth), -math.cos(tilt)])
