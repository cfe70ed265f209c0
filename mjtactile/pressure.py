"""A linear pressure on a footprint, zero where it would pull.

The pressure max(0, c0 + c1 x + c2 y) with a given force and first moments is the minimum of a convex function, the
integral of p^2 / 2 minus the work of the given moments: a footprint on springs that cannot pull. Newton's method
with damping finds it; each step needs the moments of the part of the polygon where the pressure is positive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
import shapely.ops
from shapely import MultiPolygon, Polygon

from mjtactile.footprint import Footprint
from mjtactile.pad import Array
from mjtactile.planar import areal
from mjtactile.surface import oriented_edges

Area = Polygon | MultiPolygon

_ITERATIONS = 60
#: Newton's method stops when force and moments fit to this fraction of the force; on the contact it found, both are
#: then made exact.
_TOLERANCE = 1e-10
_DAMPINGS = (0.0, *np.geomspace(1e-10, 1e2, 13))
_SUFFICIENT_DECREASE = 1e-4
_STAGNATION = 1e-14
#: Nearest the force's line may pass to the edge of the footprint's convex hull, over the root of its area. Nearer,
#: the pressure would stand on a sliver and grow without bound.
_HULL_MARGIN = 1e-3


@dataclass(frozen=True, eq=False)
class LinearPressure:
    """Where a linear pressure acts, and the moments it has to have.

    Attributes:
        contact: the part of the footprint under pressure [m]; the footprint's own outline when that is all of it.
        first_moments: integrals of p, x p and y p [N, N m, N m] that the footprint can carry.
    """

    contact: Area
    first_moments: Array


def linear_pressure(footprint: Footprint, normal: float, first_moments: tuple[float, float]) -> LinearPressure:
    """Find where the pressure that carries a normal force and its moments acts.

    Args:
        footprint: the covered area.
        normal: force pressing on it [N], positive.
        first_moments: integrals of x p and y p [N m].

    Returns:
        The contact, with the moments moved to the nearest the footprint can carry if the force passes outside it.
    """
    outline = footprint.outline
    centre, scale = np.array(footprint.centroid), float(np.sqrt(footprint.area))
    through = _into_hull(outline, np.array(first_moments) / normal, _HULL_MARGIN * scale)
    wanted = np.array([1.0, *((through - centre) / scale)])
    local = shapely.transform(outline, lambda points: (points - centre) / scale)
    coefficients: Array = np.linalg.solve(_second_moments(local), wanted).astype(np.float64)
    moments = normal * np.array([1.0, *through])
    corners = shapely.get_coordinates(local)
    if (coefficients[0] + corners @ coefficients[1:]).min() >= 0.0:
        return LinearPressure(outline, moments)
    contact = _positive_part(local, _newton(local, coefficients, wanted))
    return LinearPressure(shapely.transform(contact, lambda points: centre + scale * points), moments)


def _newton(outline: Area, coefficients: Array, wanted: Array) -> Array:
    """Coefficients of the clipped linear pressure whose moments are `wanted`.

    The start, the pressure without clipping, has negative energy; a pressure that is nowhere positive has none. Steps
    that lower the energy therefore never lose the contact.
    """
    energy, moments = _energy(outline, coefficients, wanted)
    for _ in range(_ITERATIONS):
        gradient = moments @ coefficients - wanted
        if np.abs(gradient).max() <= _TOLERANCE:
            break
        for damping in _DAMPINGS:
            # Damping only steps in where the contact is a sliver and its moments nearly singular.
            step = np.linalg.lstsq(moments + damping * np.eye(3), -gradient, rcond=None)[0]
            trial = coefficients + step
            trial_energy, trial_moments = _energy(outline, trial, wanted)
            if trial_energy <= energy + _SUFFICIENT_DECREASE * float(gradient @ step):
                break
        else:
            break
        stagnant = energy - trial_energy <= _STAGNATION * abs(energy)
        coefficients, energy, moments = trial, trial_energy, trial_moments
        if stagnant:
            break
    return coefficients


def _energy(outline: Area, coefficients: Array, wanted: Array) -> tuple[float, Array]:
    moments = _second_moments(_positive_part(outline, coefficients))
    return 0.5 * float(coefficients @ moments @ coefficients) - float(wanted @ coefficients), moments


def _positive_part(outline: Area, coefficients: Array) -> Area:
    """The part of a polygon where c0 + c1 x + c2 y > 0."""
    constant, gradient = coefficients[0], coefficients[1:]
    slope = np.linalg.norm(gradient)
    corners = shapely.get_coordinates(outline)
    reach = 4 * float(np.abs(corners).max()) + abs(constant) / slope if slope > 0 else 0.0
    if slope == 0.0 or (constant + corners @ gradient).min() >= 0.0:
        return outline
    uphill = gradient / slope
    along = np.array([-uphill[1], uphill[0]])
    foot = -constant / slope * uphill
    half_plane = shapely.Polygon(
        [
            foot - reach * along,
            foot + reach * along,
            foot + reach * (along + 2 * uphill),
            foot - reach * (along - 2 * uphill),
        ]
    )
    return areal(outline.intersection(half_plane))


def _second_moments(region: Area) -> Array:
    """Integrals of (1, x, y) (x) (1, x, y) over a polygon, shape (3, 3), by Green's theorem edge by edge."""
    (x0, y0), (x1, y1) = oriented_edges(region).transpose(1, 2, 0)
    cross = x0 * y1 - x1 * y0
    area = cross.sum() / 2
    x, y = ((x0 + x1) * cross).sum() / 6, ((y0 + y1) * cross).sum() / 6
    xx = ((x0**2 + x0 * x1 + x1**2) * cross).sum() / 12
    yy = ((y0**2 + y0 * y1 + y1**2) * cross).sum() / 12
    xy = ((2 * x0 * y0 + x0 * y1 + x1 * y0 + 2 * x1 * y1) * cross).sum() / 24
    return np.array([[area, x, y], [x, xx, xy], [y, xy, yy]])


def _into_hull(outline: Area, point: Array, margin: float) -> Array:
    """The point itself if it lies inside the outline's convex hull by a margin, else the nearest that does."""
    hull = outline.convex_hull.buffer(-margin)
    if hull.is_empty:
        return np.array(outline.centroid.coords[0])
    if hull.covers(shapely.Point(point)):
        return point
    nearest = shapely.ops.nearest_points(hull, shapely.Point(point))[0]
    return np.array(nearest.coords[0])
