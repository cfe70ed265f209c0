"""Footprints: the part of a pad's surface that a body may touch, and the body's height above it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from mjtactile._types import Array
from mjtactile.errors import FootprintError, of_type
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.geometry.contour import region_below
from mjtactile.geometry.planar import Bounds, area_on_sheet, areal
from mjtactile.pad_shape.surfaces import Surface
from mjtactile.units import finite_number, real_numbers

#: Height of a body above the pad's surface, or its plane z = 0, [m] at points x, y [m]; infinite without a body.
GapFunction = Callable[[Array, Array], npt.ArrayLike]

#: Parts further above the first contact point than this, over the sheet's thickness, never come into contact [-].
REACH = 0.2
#: Parts within this height of the lowest point, over the sheet's thickness, touch first [-].
_FIRST_TOUCH = 1e-3
#: Lines of the first grid in the search for the lowest point, and of the following ones, each four times finer.
_FIRST_LINES, _CLOSER_LINES = 61, 17
_REFINEMENTS = 8
#: Under law "uniform" a curved body presses with its part up to this height above the lowest point [m].
FACING_GAP = 50e-6
#: An outline that ends this close to the sheet's rim ends there [m].
_AT_RIM = 1e-9


@dataclass(frozen=True, eq=False)
class Footprint:
    """A covered area of one pad's surface; make it with `from_outline`, `from_gap` or `from_height`.

    Attributes:
        outline: region where the body may touch, in the pad frame [m], clipped to the sheet.
        surface: the pad's surface grid.
        gap: height of the body above the surface, along z [m]; None for a flat face on a flat pad.
        lowest: least height, that of the first contact point [m].
        reach: parts further than this above the lowest point never touch [m].
        bounded: whether contact is limited to the outline, which was given. Otherwise the outline was traced from the
            gap function and is only approximate.
        upright: on a curved pad, height z of the body's lower side in the pad frame [m], at its current position.
        above: height of that position above the one of first contact, along z [m].
        margin: how far beyond the sheet the body's heights count [m]; where the surface leans, the body may touch it
            with a part that is beside the sheet as seen from above.
    """

    outline: Polygon | MultiPolygon
    surface: SurfaceGrid
    gap: GapFunction | None = None
    lowest: float = 0.0
    reach: float = 0.0
    bounded: bool = False
    upright: GapFunction | None = None
    above: float = 0.0
    margin: float = 0.0

    @classmethod
    def from_outline(cls, outline: BaseGeometry, surface: SurfaceGrid) -> Footprint:
        """Footprint of a flat face; on a curved pad, of a face with the curvature of the pad.

        Args:
            outline: polygon or multipolygon in the pad frame, seen from above [m], holes allowed. Parts beyond the pad
                are ignored.
            surface: the pad's surface grid, `influence.surface`.

        Raises:
            FootprintError: the outline is not a valid area, or does not overlap the pad; or `surface` is no grid.
        """
        return cls._of_face(area_on_sheet(outline, _grid(surface).bounds), surface)

    @classmethod
    def _of_face(cls, area: Polygon | MultiPolygon, surface: SurfaceGrid) -> Footprint:
        if surface.outer.is_flat:
            return cls(area, surface)
        height = surface.outer.height
        return cls(area, surface, _no_gap, 0.0, _reach(surface), bounded=True, upright=height)

    @classmethod
    def from_gap(
        cls,
        gap: GapFunction,
        surface: SurfaceGrid,
        *,
        outline: BaseGeometry | None = None,
        lowest: float | None = None,
    ) -> Footprint:
        """Footprint of a body of any shape.

        Args:
            gap: function of x and y [m] in the pad frame, arrays of shape (n,). It returns the height of the body above
                the pad's surface, along z [m], shape (n,); infinite where there is no body. Only differences of height
                matter: the body is lowered until it touches the pad.
            surface: the pad's surface grid, `influence.surface`.
            outline: polygon to which contact is limited [m]; by default it is traced from the gap function, which
                rounds corners by a tenth of a millimetre on the paper's pad.
            lowest: least height over the sheet [m]; by default it is searched for.

        Raises:
            FootprintError: the gap is no function; it returns NaN, minus infinity or another number of heights than
                points; no part of the body is above the pad; `lowest` is not its least height; the outline is not a
                valid area; or `surface` is no grid.
        """
        checked = _checked("gap", gap)
        sheet = _grid(surface).bounds
        bounds = sheet if outline is None else area_on_sheet(outline, sheet).bounds
        reach = _reach(surface)
        if lowest is None:
            lowest = _lowest(checked, bounds, outline)
        elif not finite_number(lowest) - _FIRST_TOUCH * surface.thickness <= _sampled(checked, bounds, outline)[0]:
            raise FootprintError(f"lowest = {lowest!r}; expected the gap function's least height in metres, or None.")
        if outline is None:
            area = region_below(checked, lowest + reach, bounds)
            if area.area == 0.0:
                raise FootprintError(
                    "the body covers too narrow a part of the pad to be found. Pass its outline=... or, if lowest=... "
                    "is below the body, leave that out."
                )
        else:
            area = area_on_sheet(outline, sheet)
        if surface.outer.is_flat:
            return cls(area, surface, checked, lowest, reach, bounded=outline is not None)
        upright = _Shifted(checked, lowest, 1.0, surface.outer)
        return cls(area, surface, checked, lowest, reach, bounded=outline is not None, upright=upright)

    @classmethod
    def from_height(
        cls,
        height: GapFunction,
        surface: SurfaceGrid,
        *,
        outline: BaseGeometry | None = None,
    ) -> Footprint:
        """Footprint of a body at its current position over a pad, curved or flat.

        Args:
            height: function of x and y [m] in the pad frame, arrays of shape (n,). It returns the height z of the
                body's lower side in the pad frame [m], shape (n,); infinite where there is no body. The body should
                touch the pad or be close to contact. The solver moves it along the pad's normal at the point where the
                force acts until it carries the force. Points beside a curved pad are asked for too, because a body
                may touch a rim that leans with a part beside it. NaN there counts as no body.
            surface: the pad's surface grid, `influence.surface`.
            outline: polygon to which contact is limited, seen from above [m]; by default it is traced.

        Raises:
            FootprintError: as `from_gap`.
        """
        outer, checked = _grid(surface).outer, _checked("height", height)
        if outer.is_flat:
            return cls.from_gap(checked, surface, outline=outline)
        made = cls.from_gap(_Shifted(checked, 0.0, -1.0, outer), surface, outline=outline)
        if outline is not None:
            return replace(made, upright=checked, above=made.lowest, margin=0.0)
        upright = _Checked(height, "height", surface.bounds)
        return replace(made, upright=upright, above=made.lowest, margin=made.reach)

    @property
    def bounds(self) -> Bounds:
        """Rectangle (west, south, east, north) in which the body may touch [m]."""
        ends = zip(self.outline.bounds, self.surface.bounds, (-1.0, -1.0, 1.0, 1.0), strict=True)
        west, south, east, north = (
            sheet + outward * self.margin if math.isclose(end, sheet, abs_tol=_AT_RIM) else end
            for end, sheet, outward in ends
        )
        return west, south, east, north

    def heights(self, points: Array) -> Array:
        """Heights of the body at points of the pad frame.

        Args:
            points: (x, y) [m], shape (n, 2).

        Returns:
            Heights [m], shape (n,). On a flat pad, height above the surface at first contact, infinite beyond the
            reach. On a curved pad, height z at the current position. Infinite beyond the pad by more than the
            margin, or beyond a given outline, unless the footprint is that of a flat face.
        """
        if self.gap is None:
            return np.zeros(len(points))
        x, y = points[:, 0], points[:, 1]
        within = _beside(self.surface.bounds, x, y) <= self.margin
        if self.upright is not None:
            heights = np.asarray(self.upright(x, y))
        else:
            heights = np.asarray(self.gap(x, y)) - self.lowest
            within &= heights <= self.reach
        if self.bounded:
            within &= shapely.intersects_xy(self.outline, x, y)
        return np.where(within, heights, np.inf)

    def height(self, x: float, y: float) -> float:
        """`heights` at one point (x, y) [m], for a curved body."""
        assert self.gap is not None
        west, south, east, north = self.surface.bounds
        beside = max(west - x, x - east, south - y, y - north)
        if beside > self.margin:
            return math.inf
        if self.upright is not None:
            height = float(np.asarray(self.upright(np.array([x]), np.array([y])))[0])
        else:
            height = float(np.asarray(self.gap(np.array([x]), np.array([y])))[0]) - self.lowest
            height = height if height <= self.reach else math.inf
        if self.bounded and not shapely.intersects_xy(self.outline, x, y):
            return math.inf
        return height

    @cached_property
    def lowest_part(self) -> Footprint:
        """Footprint of a flat face with the outline of the body's lowest part, for laws that ignore its shape."""
        if self.gap is None:
            return self
        area = self._below(FACING_GAP)
        return Footprint._of_face(self.outline if area.area == 0.0 else area, self.surface)

    @property
    def area(self) -> float:
        """Covered area [m^2]."""
        return self.outline.area

    @cached_property
    def centroid(self) -> tuple[float, float]:
        """Centroid (x, y) [m] of the area that touches first; of the whole outline for a flat face."""
        area = self.outline
        if self.gap is not None:
            first = self._below(_FIRST_TOUCH / REACH * self.reach)
            area = area if first.area == 0.0 else first
        centre = area.centroid
        return centre.x, centre.y

    @cached_property
    def integrals(self) -> Array:
        """Integrals of each node's shape function times 1, x and y over the area, see `SurfaceGrid.nodal_integrals`."""
        return self.surface.nodal_integrals(self.outline)

    def _below(self, height: float) -> Polygon | MultiPolygon:
        """The part of the outline where the body is at most `height` above its lowest point [m]."""
        assert self.gap is not None
        return areal(region_below(self.gap, self.lowest + height, self.outline.bounds).intersection(self.outline))


def _grid(surface: SurfaceGrid) -> SurfaceGrid:
    return of_type(SurfaceGrid, "surface", surface, FootprintError, "influence.surface is one")


def _reach(surface: SurfaceGrid) -> float:
    """Height above the first contact point beyond which there is no contact [m], along z."""
    corners = np.meshgrid(surface.x.vertices[[0, -1]], surface.y.vertices[[0, -1]])
    return REACH * surface.thickness * float(np.max(surface.outer.stretch(*corners)))


# These are functions and classes of the module, not nested functions, so that footprints can be pickled.


def _no_gap(x: Array, _: Array) -> Array:
    """Height of a face with the pad's curvature above the pad [m]."""
    return np.zeros_like(x)


@dataclass(frozen=True)
class _Shifted:
    """Heights minus a height, plus a multiple of those of a pad's surface."""

    heights: Callable[[Array, Array], Array]
    less: float
    share: float
    outer: Surface

    def __call__(self, x: Array, y: Array) -> Array:
        return self.heights(x, y) - self.less + self.share * self.outer.height(x, y)


def _beside(sheet: Bounds, x: Array, y: Array) -> Array:
    """How far points are beyond the nearest side of a sheet, (n,) [m]; negative on it."""
    west, south, east, north = sheet
    return np.maximum(np.maximum(west - x, x - east), np.maximum(south - y, y - north))


def _checked(name: str, gap: GapFunction) -> Callable[[Array, Array], Array]:
    """The function of an argument of this name, with checks of the heights that it returns."""
    if not callable(gap):
        raise FootprintError(
            f"{name} is of type {type(gap).__name__}; expected a function of arrays x and y in metres that returns one "
            "height per point. For a flat face: Footprint.from_outline(...)."
        )
    return gap if isinstance(gap, _Checked) else _Checked(gap, name)


@dataclass(frozen=True)
class _Checked:
    """A gap function with checks of the heights that it returns."""

    gap: GapFunction  #: the function
    name: str  #: of the argument that gave it
    #: If given, NaN outside of this rectangle [m] stands for no body, and warns of nothing: the function may be written
    #: for the sheet alone.
    sheet: Bounds | None = None

    def __call__(self, x: Array, y: Array) -> Array:
        with np.errstate(invalid=None if self.sheet is None else "ignore"):
            values = real_numbers(self.gap(x, y))
        if values is None:
            raise FootprintError(
                f"the {self.name} function gave heights that are no real numbers. It must take arrays x and y and "
                "return one height in metres per point."
            )
        values = np.asarray(values, dtype=float)
        if values.shape != x.shape:
            raise FootprintError(
                f"the {self.name} function gave heights of shape {values.shape} for points of shape {x.shape}. It must "
                "take arrays x and y and return one height per point."
            )
        if self.sheet is not None:
            values = np.where(np.isnan(values) & (_beside(self.sheet, x, y) > 0.0), np.inf, values)
        if not (values > -np.inf).all():  # false for NaN too
            wrong = ~(values > -np.inf)
            first = int(np.flatnonzero(wrong)[0])
            raise FootprintError(
                f"the {self.name} function is {values[first]} at x = {x[first]:.6g} m, y = {y[first]:.6g} m. Heights "
                "are finite, or numpy.inf where there is no body."
            )
        return values


def _lowest(gap: Callable[[Array, Array], Array], bounds: Bounds, outline: BaseGeometry | None) -> float:
    """Least height over the bounds [m], on successively finer grids."""
    low_x, low_y, high_x, high_y = bounds
    lowest = np.inf
    for lines in (_FIRST_LINES, *[_CLOSER_LINES] * _REFINEMENTS):
        least, x, y = _sampled(gap, (low_x, low_y, high_x, high_y), outline, lines)
        if not np.isfinite(least):
            break
        lowest = min(lowest, least)
        span_x, span_y = 2 * (high_x - low_x) / (lines - 1), 2 * (high_y - low_y) / (lines - 1)
        low_x, high_x = max(bounds[0], x - span_x), min(bounds[2], x + span_x)
        low_y, high_y = max(bounds[1], y - span_y), min(bounds[3], y + span_y)
    if not np.isfinite(lowest):
        raise FootprintError(
            "the gap function is infinite over the whole sheet: there is no body above it, or one too small to find. "
            "Shift it onto the sheet, or pass its outline=...; lengths are metres."
        )
    return lowest


def _sampled(
    gap: Callable[[Array, Array], Array], bounds: Bounds, outline: BaseGeometry | None, lines: int = _CLOSER_LINES
) -> tuple[float, float, float]:
    """Least height on a grid over the bounds, and the point (x, y) where it is [m]."""
    along_x, along_y = (np.linspace(bounds[axis], bounds[axis + 2], lines) for axis in (0, 1))
    x, y = (line.ravel() for line in np.meshgrid(along_x, along_y))
    values = gap(x, y)
    if outline is not None:
        values = np.where(shapely.intersects_xy(outline, x, y), values, np.inf)
    place = int(values.argmin())
    return float(values[place]), float(x[place]), float(y[place])
