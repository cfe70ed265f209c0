"""Outer surfaces of pads: smooth height fields z(x, y) in the pad frame, with their slopes and curvatures.

A pad is swept from its outer surface along the inward normals. A point of it is X(x, y, d) = s(x, y) - d n(x, y), where
s = (x, y, z(x, y)) is the point of the surface, n the unit normal out of the pad, and d the depth. Derivatives of n
follow do Carmo, Differential Geometry of Curves and Surfaces (1976), section 3-3. Curvatures are positive where the
surface is convex: lengths on the offset surface at depth d are then smaller by the factor 1 - d curvature.
"""

from __future__ import annotations

import inspect
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import PadError, shortened
from mjtactile.units import finite_number, is_whole, real_numbers

#: Largest slope of a surface against the plane z = 0 [deg].
MOST_SLOPE = 60.0
#: Points along each axis of the grid on which a surface is checked.
_CHECK_LINES = 65
#: Newton's iteration for feet: most steps, and length of the last step over half the pad's width. Convergence is
#: quadratic, so that only rounding is left.
_MOST_STEPS, _CONVERGED = 50, 1e-11
#: Radii and semi-axes of a surface, from the least to the largest [m]; the largest is as good as flat.
_RADII = 1e-6, 1e9


class Jet(NamedTuple):
    """Height of a surface and its first and second derivatives at some points; arrays of one shape."""

    z: Array  #: height [m]
    x: Array  #: dz/dx [-]
    y: Array  #: dz/dy [-]
    xx: Array  #: d^2z/dx^2 [1/m]
    xy: Array  #: d^2z/dx dy [1/m]
    yy: Array  #: d^2z/dy^2 [1/m]


class Surface(ABC):
    """A smooth height field z(x, y) in the pad frame. Equal values describe the same surface."""

    #: Name of this kind of surface in descriptions.
    kind: ClassVar[str]

    @abstractmethod
    def jet(self, x: Array, y: Array) -> Jet:
        """Height and derivatives at points (x, y) in the pad frame [m]; NaN where there is no surface."""

    @property
    def mirrors(self) -> tuple[bool, bool]:
        """Whether the surface is symmetric under x -> -x, and under y -> -y; planes and quadrics are."""
        return True, True

    @property
    def numbers(self) -> dict[str, Any]:
        """Constructor arguments of this surface by name, as plain numbers and lists; lengths in metres."""
        own = [one.name for one in fields(cast(Any, self)) if one.compare]  # all surfaces are dataclasses
        return {name: np.asarray(getattr(self, name)).tolist() for name in own}

    @property
    def description(self) -> dict[str, Any]:
        """The surface as plain values; `surface_from` is the inverse."""
        return {"kind": self.kind, **self.numbers}

    @property
    def is_flat(self) -> bool:
        """Whether the surface is the plane z = 0."""
        return False

    def height(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Height z(x, y) at points [m], broadcast shape of x and y."""
        return self.jet(*_points(x, y)).z

    def normals(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Unit normals out of the pad at points (x, y) [m], pad frame, shape (..., 3)."""
        jet = self.jet(*_points(x, y))
        upright = np.stack([-jet.x, -jet.y, np.ones_like(jet.x)], axis=-1)
        return upright / np.linalg.norm(upright, axis=-1, keepdims=True)

    def frames(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Orthonormal axes at points (x, y) [m] in the pad frame, as rows, shape (..., 3, 3).

        They are the pad frame's, turned the shortest way from z to the normal out of the pad, which is the third. So
        they turn with points that are turned about z. The core's tangent planes have the same axes.
        """
        normals = self.normals(x, y)
        between = normals + np.array([0.0, 0.0, 1.0])  # half the turn about the same axis
        tangents = np.eye(3)[:2] - normals[..., :2, None] * (between / between[..., 2:])[..., None, :]
        return np.concatenate([tangents, normals[..., None, :]], axis=-2)

    def stretch(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Area of the surface over the area of its projection at points (x, y) [m], at least 1 [-]."""
        jet = self.jet(*_points(x, y))
        return np.sqrt(1.0 + jet.x**2 + jet.y**2)

    def positions(self, x: npt.ArrayLike, y: npt.ArrayLike, depth: npt.ArrayLike = 0.0) -> Array:
        """Points at a depth [m] along the inward normals below (x, y) [m], pad frame [m], shape (..., 3)."""
        x, y, depth = np.broadcast_arrays(*_points(x, y), np.asarray(depth, dtype=float))
        outer = np.stack([x, y, self.height(x, y)], axis=-1)
        return outer - depth[..., None] * self.normals(x, y)

    def derivatives(self, x: npt.ArrayLike, y: npt.ArrayLike, depth: npt.ArrayLike = 0.0) -> Array:
        """Derivatives of `positions` with respect to x, y and depth (last axis) [-], shape (..., 3, 3)."""
        x, y, depth = np.broadcast_arrays(*_points(x, y), np.asarray(depth, dtype=float))
        jet = self.jet(x, y)
        one, zero = np.ones_like(jet.z), np.zeros_like(jet.z)
        length = np.sqrt(1.0 + jet.x**2 + jet.y**2)
        normal = np.stack([-jet.x, -jet.y, one], axis=-1) / length[..., None]
        columns = []
        for tangent, (a, b) in (
            (np.stack([one, zero, jet.x], axis=-1), (jet.xx, jet.xy)),
            (np.stack([zero, one, jet.y], axis=-1), (jet.xy, jet.yy)),
        ):
            turned = np.stack([-a, -b, zero], axis=-1) / length[..., None]
            turned -= normal * np.einsum("...i,...i->...", normal, turned)[..., None]
            columns.append(tangent - depth[..., None] * turned)
        return np.stack([*columns, -normal], axis=-1)

    def curvatures(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Principal curvatures at points (x, y) [m], the larger first, positive if convex [1/m], shape (..., 2)."""
        jet = self.jet(*_points(x, y))
        square = 1.0 + jet.x**2 + jet.y**2
        # First and second fundamental form of a graph, do Carmo, section 3-3, example 5.
        gauss = (jet.xx * jet.yy - jet.xy**2) / square**2
        mean = (1 + jet.x**2) * jet.yy - 2 * jet.x * jet.y * jet.xy + (1 + jet.y**2) * jet.xx
        mean = -mean / (2 * square**1.5)
        apart = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
        return np.stack([mean + apart, mean - apart], axis=-1)

    def feet(self, points: Array, half_size: tuple[float, float]) -> tuple[Array, Array]:
        """Feet of points on the surface: where the surface normal through each point meets the surface.

        Args:
            points: (n, 3) [m], pad frame.
            half_size: half the pad's projected width along (x, y) [m]; feet are searched within it.

        Returns:
            (feet, miss). feet: (x, y, depth) of each point [m], shape (n, 3). miss: distance between each point and
            the position of its foot at that depth [m], shape (n,); larger than rounding only for points without a foot
            on the pad.
        """
        half = np.array(half_size)
        bound = np.clip(points[:, :2], -half, half)
        feet = np.column_stack([bound, self.height(bound[:, 0], bound[:, 1]) - points[:, 2]])
        feet[:, 2] *= self.normals(feet[:, 0], feet[:, 1])[:, 2]
        for _ in range(_MOST_STEPS):
            missed = points - self.positions(*feet.T)
            slopes = self.derivatives(*feet.T)
            # Where normals meet, no foot is nearer than another; the depth alone decides there.
            slopes[np.linalg.det(slopes) == 0.0] = np.eye(3)
            step = np.linalg.solve(slopes, missed[..., None])[..., 0]
            moved = feet + step
            moved[:, :2] = np.clip(moved[:, :2], -half, half)
            ended = np.abs(moved - feet).max(initial=0.0) <= _CONVERGED * half.max()
            feet = moved
            if ended:
                break
        return feet, np.linalg.norm(points - self.positions(*feet.T), axis=-1)

    def check(self, size: tuple[float, float], thickness: float) -> None:
        """Check that the surface covers a pad smoothly, and that its inward normals do not meet within the thickness.

        Args:
            size: projected width of the pad along (x, y) [m].
            thickness: of the pad along the normals [m].

        Raises:
            PadError: when the surface ends within the pad, is steeper than MOST_SLOPE, or has a radius of curvature
                below the thickness; the message says where.
        """
        x, y = np.meshgrid(*(np.linspace(-extent / 2, extent / 2, _CHECK_LINES) for extent in size))
        jet = self.jet(x, y)
        _refuse_where(
            ~np.isfinite(np.stack(jet)).all(axis=0),
            np.hypot(x, y),
            (x, y),
            lambda _: "there is no surface: it ends within the pad. Give a smaller pad size, or a larger surface",
        )
        slope = np.degrees(np.arctan(np.hypot(jet.x, jet.y)))
        _refuse_where(
            slope > MOST_SLOPE,
            -slope,
            (x, y),
            lambda place: (
                f"the surface has a slope of {slope[place]:.3g} degrees; expected at most {MOST_SLOPE:g}. Give a "
                "smaller pad size, or turn the pad frame"
            ),
        )
        bulge = self.curvatures(x, y)[..., 0]
        _refuse_where(
            bulge * thickness >= 1.0,
            -bulge,
            (x, y),
            lambda place: (
                f"the surface has a radius of curvature of {1e3 / bulge[place]:.4g} mm, but the pad is "
                f"{thickness * 1e3:.4g} mm thick: its inner surface would fold. Give thinner layers or a surface that "
                "is less curved"
            ),
        )


def _points(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
    return np.asarray(x, dtype=float), np.asarray(y, dtype=float)


def _refuse_where(wrong: Any, order: Array, where: tuple[Array, Array], said: Any) -> None:
    """Raise PadError about the first wrong place in the given order, if there is one."""
    if wrong.any():
        place = np.unravel_index(np.argmin(np.where(wrong, order, np.inf)), wrong.shape)
        x, y = (1e3 * float(axis[place]) for axis in where)
        raise PadError(f"at x = {x:.4g} mm, y = {y:.4g} mm {said(place)}.")


def positive_number(name: str, value: Any, expected: str) -> float:
    """The value as a positive finite number.

    Raises:
        PadError: the value is anything else; the message says what was expected.
    """
    number = finite_number(value)
    if not number > 0.0:
        raise PadError(f"{name} = {shortened(value)}; expected {expected}.")
    return number


def _length(name: str, value: Any) -> float:
    least, most = _RADII
    expected = f"a positive length in metres (12 mm is 12e-3), from {least:g} to {most:g} m"
    number = positive_number(name, value, expected)
    if not least <= number <= most:
        raise PadError(f"{name} = {shortened(value)}; expected {expected}.")
    return number


def _check_smooth(name: str, knots: Array, degree: int) -> None:
    """Refuse knots at which the second derivative of a spline jumps, or it has none."""
    places, counts = np.unique(knots, return_counts=True)
    most = np.full(len(places), degree - 2)
    most[[0, -1]] = degree + 1
    if (counts > most).any():
        k = int(np.argmax(counts > most))
        raise PadError(
            f"{name} of a surface patch has {counts[k]} knots at {places[k]:g} m; expected at most {most[k]} of degree "
            f"{degree}, because the surface's curvature must be continuous."
        )


@dataclass(frozen=True)
class Flat(Surface):
    """The plane z = 0."""

    kind: ClassVar[str] = "flat"

    @property
    def is_flat(self) -> bool:
        """True: the surface is the plane z = 0."""
        return True

    def jet(self, x: Array, y: Array) -> Jet:
        """Height and derivatives: zero everywhere."""
        zero = np.zeros(np.broadcast_shapes(x.shape, y.shape))
        return Jet(zero, zero, zero, zero, zero, zero)


class Quadric(Surface):
    """Upper half of x^2 / a^2 + y^2 / b^2 + (z + c)^2 / c^2 = 1; its apex is the origin, and a or b may be infinite."""

    @property
    @abstractmethod
    def principal_axes(self) -> tuple[float, float, float]:
        """Half the quadric's widths a, b and c along x, y and z [m]."""

    def jet(self, x: Array, y: Array) -> Jet:
        """Height and derivatives; NaN beyond the quadric's widest outline."""
        a, b, c = self.principal_axes
        p, q = a**-2, b**-2
        square = 1.0 - p * x**2 - q * y**2
        root = np.sqrt(np.where(square > 0.0, square, np.nan))
        # c (root - 1) would lose digits where the surface is nearly flat.
        z = -c * (p * x**2 + q * y**2) / (1.0 + root)
        xx = -c * p * (1.0 / root + p * x**2 / root**3)
        yy = -c * q * (1.0 / root + q * y**2 / root**3)
        return Jet(z, -c * p * x / root, -c * q * y / root, xx, -c * p * q * x * y / root**3, yy)


@dataclass(frozen=True)
class SphereCap(Quadric):
    """The top of a sphere: z = sqrt(R^2 - x^2 - y^2) - R.

    Raises:
        PadError: when the radius is no positive length.
    """

    radius: float  #: R [m]
    kind: ClassVar[str] = "sphere"

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length("radius", self.radius))

    @property
    def principal_axes(self) -> tuple[float, float, float]:
        """Half the quadric's widths a, b and c along x, y and z [m]."""
        return self.radius, self.radius, self.radius


@dataclass(frozen=True)
class CylinderSector(Quadric):
    """The top of a cylinder that lies along y: z = sqrt(R^2 - x^2) - R.

    Raises:
        PadError: when the radius is no positive length.
    """

    radius: float  #: R [m]
    kind: ClassVar[str] = "cylinder"

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length("radius", self.radius))

    @property
    def principal_axes(self) -> tuple[float, float, float]:
        """Half the quadric's widths a, b and c along x, y and z [m]."""
        return self.radius, math.inf, self.radius


@dataclass(frozen=True)
class EllipsoidCap(Quadric):
    """The top of an ellipsoid with its axes along x, y and z: z = c (sqrt(1 - x^2 / a^2 - y^2 / b^2) - 1).

    Raises:
        PadError: when the semi-axes are not three positive lengths.
    """

    semi_axes: tuple[float, float, float]  #: a, b, c [m]
    kind: ClassVar[str] = "ellipsoid"

    def __post_init__(self) -> None:
        try:
            a, b, c = self.semi_axes
        except (TypeError, ValueError):
            raise PadError(f"semi_axes = {self.semi_axes!r}; expected three lengths (a, b, c) in metres.") from None
        object.__setattr__(self, "semi_axes", tuple(_length("semi-axis", axis) for axis in (a, b, c)))

    @property
    def principal_axes(self) -> tuple[float, float, float]:
        """Half the quadric's widths a, b and c along x, y and z [m]."""
        return self.semi_axes


@dataclass(frozen=True)
class SurfacePatch(Surface):
    """A surface that is a tensor product of B-splines, such as one fitted to a mesh by `Pad.from_mesh`.

    Raises:
        PadError: knots, coefficients and degree do not form a spline with continuous curvature.
    """

    knots_x: tuple[float, ...]  #: along x [m], ascending
    knots_y: tuple[float, ...]  #: along y [m], ascending
    coefficients: tuple[tuple[float, ...], ...]  #: (along x, along y) [m]
    degree: int = 5  #: of the splines; at least 3, for curvatures that are continuous
    #: Largest distance from the data it was fitted to [m]; ignored in comparisons.
    deviation: float = field(default=math.nan, compare=False)
    kind: ClassVar[str] = "patch"

    def __post_init__(self) -> None:
        given = [real_numbers(one) for one in (self.knots_x, self.knots_y, self.coefficients)]
        # Zero without a sign: equal patches would have different descriptions otherwise.
        numbers = [one.astype(float) + 0.0 for one in given if one is not None]
        if len(numbers) < len(given):
            raise PadError("knots and coefficients of a surface patch must be numbers in metres.")
        *knots, values = numbers
        degree = self.degree
        if not (is_whole(degree) and 3 <= degree <= 7):
            raise PadError(f"degree = {shortened(degree)} of a surface patch; expected a whole number from 3 to 7.")
        counts = tuple(line.size - degree - 1 for line in knots)
        fits = all(line.ndim == 1 and np.isfinite(line).all() and (np.diff(line) >= 0).all() for line in knots)
        if not (fits and values.shape == counts and min(counts) > degree and np.isfinite(values).all()):
            raise PadError(
                f"a surface patch with {knots[0].size} and {knots[1].size} knots has coefficients of shape "
                f"{values.shape}; expected {counts}, with finite numbers and ascending knots."
            )
        for name, line in zip(("knots_x", "knots_y"), knots, strict=True):
            _check_smooth(name, line, degree)
            object.__setattr__(self, name, tuple(line.tolist()))
        object.__setattr__(self, "degree", int(degree))
        object.__setattr__(self, "coefficients", tuple(map(tuple, values.tolist())))

    @property
    def mirrors(self) -> tuple[bool, bool]:
        """Whether knots and coefficients are exactly symmetric under x -> -x, and under y -> -y."""
        values = np.array(self.coefficients)
        lines = np.array(self.knots_x), np.array(self.knots_y)
        along = [
            np.array_equal(line, -line[::-1]) and np.array_equal(values, np.flip(values, axis))
            for axis, line in enumerate(lines)
        ]
        return along[0], along[1]

    def jet(self, x: Array, y: Array) -> Jet:
        """Height and derivatives; NaN outside the range of the knots."""
        x, y = np.broadcast_arrays(x, y)
        places = np.stack([x, y], axis=-1)
        orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        return Jet(*(np.asarray(self._spline(places, nu=nu, extrapolate=False)) for nu in orders))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import NdBSpline

        knots = np.array(self.knots_x), np.array(self.knots_y)
        return NdBSpline(knots, np.array(self.coefficients), self.degree)


#: The plane z = 0, the default surface of pads.
FLAT = Flat()
_KINDS: dict[str, type[Surface]] = {
    of_kind.kind: of_kind for of_kind in (Flat, SphereCap, CylinderSector, EllipsoidCap, SurfacePatch)
}


def surface_from(description: Any) -> Surface:
    """The surface that `Surface.description` described.

    Raises:
        PadError: the description is not that of a known surface.
    """
    kind = description.get("kind") if isinstance(description, dict) else None
    if not (isinstance(kind, str) and kind in _KINDS):
        raise PadError(
            f'"surface" = {shortened(description)}; expected an object whose "kind" is one of {", ".join(_KINDS)} '
            '(in a TOML file also mesh), for example {"kind": "sphere", "radius": 12e-3}.'
        )
    values = {name: value for name, value in description.items() if name != "kind"}
    of_kind = _KINDS[kind]
    try:
        made = of_kind(**values)
    except TypeError:
        wanted = [name for name in inspect.signature(of_kind).parameters if name != "deviation"]
        raise PadError(
            f'a surface of kind "{of_kind.kind}" needs {", ".join(wanted) or "nothing else"}, and '
            f"{', '.join(sorted(values)) or 'none'} was given."
        ) from None
    if made.numbers.keys() != values.keys():
        raise PadError(f'a surface of kind "{of_kind.kind}" needs {", ".join(sorted(made.numbers))}.')
    return made
