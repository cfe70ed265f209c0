"""The pad: a layered elastic body with sensing elements (taxels) at known depths.

Lengths are in metres, stresses in pascals. The origin of the pad frame is the middle of the sensing surface. Its z axis
points out of the pad; x runs along the rows of taxels (from column to column), y from row to row. The sensing surface
is a plane or curved, see pad_shape/surfaces.py.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Indices
from mjtactile.errors import PadError, of_type, shortened
from mjtactile.pad_shape.surfaces import FLAT, Surface
from mjtactile.pad_shape.taxels import FreeTaxels, as_taxels, depth_bands
from mjtactile.units import finite_number, is_whole, real_numbers

if TYPE_CHECKING:
    import trimesh

#: Least thickness of a layer [m]; describe thinner ones by another modulus of the neighbouring layer.
MINIMUM_LAYER_THICKNESS = 1e-6
#: Least and largest length of a pad [m].
LENGTHS = 1e-6, 10.0
#: Least and largest Young's modulus [Pa]: softer than any gel, stiffer than diamond.
MODULI = 1.0, 1e15
#: Largest ratio of a sheet's length to its width [-].
MOST_ASPECT = 1000.0
#: Largest numbers of layers, of sensing layers, and of readings (taxels times sensing layers).
MOST_LAYERS, MOST_DEPTHS, MOST_READINGS = 64, 64, 100_000
#: Lengths closer than this fraction of the sheet's thickness count as equal.
LENGTH_TOLERANCE = 1e-9

#: Default depths of the sensing layers [m], those of Aoyagi 2008.
_DEPTHS = (1e-3, 2e-3, 3e-3, 4e-3)


def _require(condition: bool | np.bool_, message: str) -> None:
    if not condition:
        raise PadError(message)


def _number(name: str, value: Any, unit: str) -> float:
    """A real number as a float; NaN and infinity are accepted.

    Zero has no sign afterwards: equal pads would have different texts and fingerprints otherwise.
    """
    refused = isinstance(value, str | bytes | bool | np.bool_)
    # float() reads arrays of text, and drops imaginary parts of NumPy's numbers.
    if refused or (hasattr(value, "dtype") and real_numbers(value) is None):
        raise PadError(f"{name} = {shortened(value)}; expected a number{unit}.")
    try:
        return float(value) + 0.0
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    except (TypeError, ValueError):
        raise PadError(f"{name} = {shortened(value)}; expected a number{unit}.") from None


def _is_length(value: float) -> bool:
    return LENGTHS[0] <= value <= LENGTHS[1]


_LENGTH_RANGE = f"from {LENGTHS[0]:g} to {LENGTHS[1]:g} m"


@dataclass(frozen=True, kw_only=True)
class Layer:
    """One homogeneous, isotropic, linear-elastic layer, bonded to its neighbours.

    Raises:
        PadError: a value is not a number, or outside its range.
    """

    thickness: float  #: thickness [m]
    young: float  #: Young's modulus [Pa]
    poisson: float  #: Poisson ratio [-], in [0, 0.5)

    def __post_init__(self) -> None:
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
    """A rectangular grid of taxels, seen from above: rows along y, columns along x.

    Raises:
        PadError: a count is not a whole number of at least 1, or a length is not finite or outside its range.
    """

    rows: int = 13  #: taxels along y
    columns: int = 13  #: taxels along x
    pitch: tuple[float, float] = (1.25e-3, 1.25e-3)  #: spacing along (x, y) [m]
    centre: tuple[float, float] = (0.0, 0.0)  #: middle of the grid in the pad frame (x, y) [m]

    def __post_init__(self) -> None:
        object.__setattr__(self, "pitch", _pair("pitch", self.pitch))
        object.__setattr__(self, "centre", _pair("centre", self.centre))
        for name in ("rows", "columns"):
            count = getattr(self, name)
            _require(
                is_whole(count) and count >= 1,
                f"TaxelGrid {name} = {shortened(count)}; expected a whole number of at least 1.",
            )
            _require(
                count <= MOST_READINGS,
                f"TaxelGrid {name} = {shortened(count)}; expected at most {MOST_READINGS}, as many as a pad may read.",
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

    @property
    def corners(self) -> Array:
        """Low and high corner (x, y) of the grid's area, half a pitch beyond the outer taxels [m], shape (2, 2)."""
        ends = np.array([[self.x[0], self.y[0]], [self.x[-1], self.y[-1]]])
        return ends + np.array([[-0.5], [0.5]]) * self.pitch


@dataclass(frozen=True, kw_only=True)
class Pad:
    """A layered elastic body over a rectangle, bonded to a rigid base; its sides and top are free.

    Its outer surface is a plane or a smooth height field over the rectangle, `surface`. Thickness, layers and depths
    are measured along the inward normals. The base is the offset surface at the full thickness; the sides run along the
    normals at the rectangle's edges.

    The defaults are the sensor of Aoyagi 2008 (Recognition of Contact State of Four Layers Arrayed Type Tactile
    Sensor by Using Neural Networks): 15 x 15 x 5 mm of PDMS, E = 3 MPa, 13 x 13 taxels at 1.25 mm pitch at depths
    of 1, 2, 3 and 4 mm, each reading the mean von Mises stress within 0.625 mm. The paper gives no Poisson ratio;
    0.49 is ours. Layers are listed from the sensing surface down.

    Raises:
        PadError: a value is outside its range, or values contradict each other; the message says what to change.
    """

    size: tuple[float, float] = (15e-3, 15e-3)  #: extent along (x, y) [m]
    layers: tuple[Layer, ...] = (Layer(thickness=5e-3, young=3e6, poisson=0.49),)  #: top first
    #: Positions of the taxels: a grid seen from above; or FreeTaxels, points (n, 3) [m], or the name of a file of them.
    taxels: TaxelGrid | FreeTaxels = field(default_factory=TaxelGrid)
    depths: tuple[float, ...] = _DEPTHS  #: of the sensing layers [m], top first; () for free taxels
    sampling_radius: float = 0.625e-3  #: a reading is the mean over a ball of this radius [m]
    surface: Surface = FLAT  #: the outer surface over the rectangle

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", _pair("size", self.size))
        object.__setattr__(self, "layers", _tuple_of_layers(self.layers))
        object.__setattr__(self, "taxels", as_taxels(self.taxels))
        free = isinstance(self.taxels, FreeTaxels)
        # Free taxels have depths of their own: with them, only the default of `depths` is accepted.
        unasked = isinstance(self.depths, tuple | list) and tuple(self.depths) in ((), _DEPTHS)
        depths = () if free and unasked else _tuple_of_depths(self.depths)
        object.__setattr__(self, "depths", depths)
        object.__setattr__(self, "sampling_radius", _number("sampling_radius", self.sampling_radius, " in metres"))
        _require(
            isinstance(self.taxels, TaxelGrid | FreeTaxels),
            f"taxels = {shortened(self.taxels)}; expected a TaxelGrid, for example TaxelGrid(rows=13, columns=13); or "
            "points (n, 3) in metres, or the name of a file of them.",
        )
        _require(
            not (free and depths),
            f"depths = {depths} m beside free taxels, which have depths of their own. Leave depths out.",
        )
        _require(
            isinstance(self.surface, Surface),
            f"surface = {shortened(self.surface)}; expected a surface, for example SphereCap(12e-3).",
        )
        _check_size(self.size)
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
            f"{LENGTHS[0]:g} m to the sheet's largest dimension, {largest:.6g} m.",
        )
        if not self.surface.is_flat:
            self.surface.check(self.size, self.thickness)
        self._check_depths()
        _require(
            math.prod(self.reading_shape) <= MOST_READINGS,
            f"{self._said_taxels} are {math.prod(self.reading_shape)} readings; expected at most {MOST_READINGS}. Use "
            "a larger pitch, or several pads.",
        )
        if isinstance(self.taxels, FreeTaxels):
            self._check_taxels_in_pad(self.taxels, largest)
        else:
            self._check_taxels_on_sheet(self.taxels)

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

    def _check_taxels_in_pad(self, taxels: FreeTaxels, largest: float) -> None:
        points, radii = taxels.positions, taxels.ball_radii(self.sampling_radius)
        for taxel, radius in enumerate(radii.tolist()):
            _require(
                LENGTHS[0] <= radius <= largest,
                f"taxel {taxel} has a radius of {radius} m; expected from {LENGTHS[0]:g} m to the sheet's largest "
                f"dimension, {largest:.6g} m.",
            )
        feet, miss = self.feet(points)
        tolerance = LENGTH_TOLERANCE * largest
        inside = (miss <= tolerance) & (np.abs(feet[:, :2]) <= np.array(self.size) / 2 + tolerance).all(axis=1)
        inside &= (feet[:, 2] >= -tolerance) & (feet[:, 2] <= self.thickness + tolerance)
        if not inside.all():
            taxel = int(np.flatnonzero(~inside)[0])
            x, y, depth = feet[taxel]
            place = f"at a depth of {depth:.6g} m under x = {x:.6g} m, y = {y:.6g} m"
            raise PadError(
                f"taxel {taxel} at {tuple(points[taxel].tolist())} m lies outside the pad"
                f"{': it is ' + place if miss[taxel] <= tolerance else ''}. Expected depths from 0 to "
                f"{self.thickness:.6g} m under |x| <= {self.size[0] / 2:.6g} m, |y| <= {self.size[1] / 2:.6g} m; "
                "lengths are metres, and z is negative inside."
            )

    def _check_taxels_on_sheet(self, grid: TaxelGrid) -> None:
        for axis, name, positions in ((0, "columns", grid.x), (1, "rows", grid.y)):
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
        """Heights z of the interfaces between layers below the surface [m], negative, top first.

        The surface and the base are not included.
        """
        return tuple(-math.fsum(layer.thickness for layer in self.layers[: i + 1]) for i in range(len(self.layers) - 1))

    @property
    def reading_shape(self) -> tuple[int, ...]:
        """Shape of one set of readings: (sensing layers, rows, columns), or (taxels,) for free taxels."""
        if isinstance(self.taxels, FreeTaxels):
            return (len(self.taxels),)
        return len(self.depths), self.taxels.rows, self.taxels.columns

    @property
    def grid(self) -> TaxelGrid:
        """The taxels' grid.

        Raises:
            PadError: when the pad has free taxels.
        """
        if isinstance(self.taxels, FreeTaxels):
            raise PadError(
                "this needs taxels on a grid, but the pad has free ones, whose readings are (taxel,). Read those with "
                "InfluenceMatrices.readings or a TactileSensor, or give the pad a TaxelGrid."
            )
        return self.taxels

    @property
    def grid_shape(self) -> tuple[int, int, int]:
        """Shape of readings on a grid: (sensing layers, rows, columns).

        Raises:
            PadError: when the pad has free taxels.
        """
        grid = self.grid
        return len(self.depths), grid.rows, grid.columns

    @property
    def sensing_layers(self) -> int:
        """Number of sensing layers; free taxels count as one."""
        return len(self.depths) or 1

    @cached_property
    def sensed_depths(self) -> tuple[float, ...]:
        """Depths of the sensing layers, or of each free taxel [m]."""
        if isinstance(self.taxels, FreeTaxels):
            return tuple(self.feet(self.taxels.positions)[0][:, 2].tolist())
        return self.depths

    @cached_property
    def sensed_radii(self) -> tuple[float, ...]:
        """Radii of the taxels' balls in each sensing layer, or of each free taxel [m]."""
        if isinstance(self.taxels, FreeTaxels):
            return tuple(self.taxels.ball_radii(self.sampling_radius).tolist())
        return (self.sampling_radius,) * len(self.depths)

    def taxel_feet(self, sensing_layer: int) -> Array:
        """Foot (x, y) of each taxel of a layer in the projection, and its depth along the normal [m], shape (n, 3)."""
        if isinstance(self.taxels, FreeTaxels):
            return self.feet(self.taxels.positions)[0]
        y, x = np.meshgrid(self.taxels.y, self.taxels.x, indexing="ij")
        return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, self.depths[sensing_layer])])

    def taxel_points(self, sensing_layer: int) -> Array:
        """Centres of the taxels of a sensing layer in the pad frame [m], shape (n, 3)."""
        if isinstance(self.taxels, FreeTaxels):
            return self.taxels.positions
        feet = self.taxel_feet(sensing_layer)
        return self.surface.positions(feet[:, 0], feet[:, 1], feet[:, 2])

    def feet(self, points: Array) -> tuple[Array, Array]:
        """Feet of points (n, 3) in the pad frame [m] on the pad's surface, see `Surface.feet`.

        Returns:
            (feet, miss): (x, y, depth) of each point [m], shape (n, 3); and the distance by which the normal at the
            foot misses the point [m], shape (n,).
        """
        if self.surface.is_flat:
            return points * np.array([1.0, 1.0, -1.0]), np.zeros(len(points))
        return self.surface.feet(points, (self.size[0] / 2, self.size[1] / 2))

    @cached_property
    def layers_drawn(self) -> list[Indices]:
        """Indices of flattened readings drawn together: those of a sensing layer, or of a depth band of free taxels."""
        if isinstance(self.taxels, FreeTaxels):
            radius = max(self.sensed_radii)
            return depth_bands(np.array(self.sensed_depths), radius)
        return list(np.arange(math.prod(self.reading_shape)).reshape(len(self.depths), -1))

    def depth_said(self, layer: int) -> str:
        """Depth of one of `layers_drawn` as text: "1 mm", or "0.8 to 2.1 mm"."""
        if not isinstance(self.taxels, FreeTaxels):
            return f"{self.depths[layer] * 1e3:g} mm"
        depths = np.array(self.sensed_depths)[self.layers_drawn[layer]] * 1e3
        least, most = f"{depths.min():.3g}", f"{depths.max():.3g}"
        return f"{least} mm" if least == most else f"{least} to {most} mm"

    @property
    def description(self) -> dict[str, Any]:
        """The pad as plain numbers, as stored with saved tables."""
        numbers = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "surface"}
        numbers |= {"layers": tuple(asdict(layer) for layer in self.layers), "taxels": asdict(self.taxels)}
        # A flat pad has no entry "surface", as in versions without curved pads: their tables stay valid.
        return numbers if self.surface.is_flat else numbers | {"surface": self.surface.description}

    @property
    def fingerprint(self) -> str:
        """SHA-256 of all numbers of the pad; equal only for equal pads."""
        return hashlib.sha256(json.dumps(self.description, sort_keys=True).encode()).hexdigest()

    @property
    def summary(self) -> str:
        """One line of text: size, layers and taxels."""
        stack = " + ".join(
            f"{layer.thickness * 1e3:.4g} mm (E {layer.young / 1e6:.4g} MPa, nu {layer.poisson:g})"
            for layer in self.layers
        )
        kind = "sheet" if self.surface.is_flat else f"{self.surface.kind} pad"
        return f"{self.size[0] * 1e3:.4g} x {self.size[1] * 1e3:.4g} mm {kind} of {stack}, {self._said_taxels}"

    @property
    def _said_taxels(self) -> str:
        if isinstance(self.taxels, FreeTaxels):
            return f"{len(self.taxels)} free taxels"
        layers = len(self.depths)
        return f"{self.taxels.rows} x {self.taxels.columns} taxels at {layers} depth{'s' if layers > 1 else ''}"

    @classmethod
    def from_mesh(
        cls,
        mesh: str | Path | trimesh.Trimesh,
        *,
        size: tuple[float, float],
        thickness: float | None = None,
        layers: Layer | Iterable[Layer] | None = None,
        frame: npt.ArrayLike | None = None,
        scale: float = 1.0,
        smoothing: float | None = None,
        **others: Any,
    ) -> Pad:
        """A pad whose outer surface is a smooth patch fitted to a mesh, such as a fingertip's.

        Args:
            mesh: a trimesh mesh, or a file that trimesh reads, such as an STL.
            size: projected width of the pad along (x, y) [m].
            thickness: of a single layer of the default material [m]; alternative to `layers`.
            layers: top first; alternative to `thickness`.
            frame: pose (4, 4) of the pad frame in the mesh's frame, translation in metres. The third column is the
                direction out of the pad, the fourth the origin, which is on the mesh or off it by at most a
                twentieth of the pad's width. By default the mesh's own frame.
            scale: metres per unit of the mesh: 1e-3 for a mesh in millimetres.
            smoothing: root mean square distance between patch and mesh that is accepted for smoothness [m]; by default
                a tenth of the distance between the mesh's facets and a smooth surface through their corners.
            others: further arguments of Pad: taxels, depths, sampling_radius.

        Returns:
            The pad; `pad.surface.deviation` is the largest distance between patch and mesh [m].

        Raises:
            FileNotFoundError: when there is no such file.
            PadError: when the mesh cannot be read, has a hole, a fold or a step under the rectangle, or is not where
                the frame's origin is, or the pad cannot exist; the message says where.
        """
        from mjtactile.pad_shape.surface_fit import fitted_patch

        if "surface" in others:
            raise PadError("Pad.from_mesh fits the surface to the mesh; leave surface=... out, or call Pad(...).")
        if (thickness is None) == (layers is None):
            raise PadError("Pad.from_mesh takes either thickness=... or layers=...; give exactly one of the two.")
        if layers is None:
            layers = Layer(thickness=_number("thickness", thickness, " in metres"), young=3e6, poisson=0.49)
        width, stack = _pair("size", size), _tuple_of_layers(layers)
        _check_size(width)
        patch = fitted_patch(mesh, width, frame=frame, scale=scale, smoothing=smoothing)
        try:
            patch.check(width, math.fsum(layer.thickness for layer in stack))
        except PadError as error:
            raise PadError(
                f"{error} A hole or a step in the mesh may be the cause. If the mesh is a scan, its noise may be the "
                "cause: give smoothing=..., such as 3e-5 m."
            ) from error
        return cls(size=size, layers=stack, surface=patch, **others)


def _check_size(size: tuple[float, float]) -> None:
    _require(
        all(_is_length(side) for side in size),
        f"pad size = {size} m; expected two positive lengths in metres (15 mm is 15e-3), {_LENGTH_RANGE}.",
    )


def require_pad(pad: object) -> Pad:
    """The argument unchanged, after checking that it is a Pad.

    Raises:
        PadError: it is not a Pad.
    """
    return of_type(Pad, "pad", pad, PadError)


def require_flat(pad: Pad, door: str, cure: str) -> None:
    """Refuse a curved pad where only flat pads are supported; `door` is the caller's name, `cure` what to do instead.

    Raises:
        PadError: when the pad's surface is curved.
    """
    if not pad.surface.is_flat:
        raise PadError(
            f"{door} takes flat pads only, and this one is a {pad.summary}. {cure} Or give a pad with surface=Flat()."
        )


def _pair(name: str, value: Any) -> tuple[float, float]:
    try:
        first, second = value
    except (TypeError, ValueError):
        raise PadError(f"{name} = {shortened(value)}; expected two numbers (x, y) in metres.") from None
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
        raise PadError(f"depths = {shortened(depths)}; expected numbers in metres, top layer first.")
    _require(len(listed) <= MOST_DEPTHS, f"more than {MOST_DEPTHS} sensing depths; expected fewer. Leave some out.")
    try:
        numbers = tuple(_number("depth", depth, " in metres") for depth in listed)
    except PadError:
        raise PadError(f"depths = {shortened(depths)}; expected numbers in metres, top layer first.") from None
    _require(len(numbers) > 0, "depths is empty; give at least one sensing depth in metres, for example (1e-3,).")
    _require(all(map(math.isfinite, numbers)), f"depths = {numbers}; expected finite numbers in metres.")
    return numbers


def _first_of(values: Any, most: int) -> tuple[Any, ...] | None:
    """The first `most` + 1 items of an iterable; None for anything that is not iterable."""
    try:
        return tuple(itertools.islice(values, most + 1))
    except TypeError:
        return None


def force_vector(magnitude: float, tilt_deg: float = 0.0, azimuth_deg: float = 0.0) -> Array:
    """Force vector F (sin t cos a, sin t sin a, -cos t) in the pad frame [N], shape (3,).

    Args:
        magnitude: F [N]; 1 gf is 9.80665e-3 N.
        tilt_deg: angle t between the force and the pad's inward normal (-z) [deg].
        azimuth_deg: direction a of the tangential part, counter-clockwise from +x towards +y [deg].

    Raises:
        PadError: a value is not a finite number.
    """
    named = {"magnitude": magnitude, "tilt_deg": tilt_deg, "azimuth_deg": azimuth_deg}
    numbers = {name: finite_number(value) for name, value in named.items()}
    for name, number in numbers.items():
        _require(math.isfinite(number), f"{name} = {shortened(named[name])}; expected a finite number.")
    force, tilt, azimuth = numbers["magnitude"], math.radians(numbers["tilt_deg"]), math.radians(numbers["azimuth_deg"])
    tangential = math.sin(tilt)
    return force * np.array([tangential * math.cos(azimuth), tangential * math.sin(azimuth), -math.cos(tilt)])
