"""Outlines of the seven flat punches of Aoyagi 2008, each circumscribed by a 10 mm square and centred on (0, 0).

Lengths are in metres. Curves are polygons of `SIDES` sides with the area of the true curve. Their corners lie outside
the curve by 5e-5 of the radius, the middles of their sides inside it by half as much.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from shapely import Polygon

from mjtactile._types import Array
from mjtactile.errors import IndenterError, shortened

#: Sides of the polygon for a full circle; a multiple of 4, so that reflections in x and y map corners to corners.
SIDES = 256

_HALF_BOX = 5e-3  # half the circumscribed square
_STAR_INNER_RADIUS = 1.91e-3  # that of a regular pentagram, to three digits


def ellipse(semi_x: float, semi_y: float) -> Polygon:
    """Ellipse about the origin with these semi-axes along x and y [m], as a polygon of the same area."""
    step = 2.0 * math.pi / SIDES
    same_area = math.sqrt(step / math.sin(step))
    return Polygon(turned(SIDES) * same_area * (semi_x, semi_y))


def punch_outline(name: str) -> Polygon:
    """Outline of one of the seven punches, counter-clockwise and centred on the origin [m].

    Raises:
        IndenterError: the name is none of `INDENTER_NAMES`.
    """
    if not (isinstance(name, str) and name in _PUNCHES):
        raise IndenterError(f"indenter {shortened(name)} does not exist. Available: {', '.join(INDENTER_NAMES)}.")
    return _PUNCHES[name]()


def turned(corners: int, start_deg: float = 0.0) -> Array:
    """Unit vectors at equal angles, counter-clockwise from `start_deg`, shape (corners, 2)."""
    angles = math.radians(start_deg) + 2.0 * np.pi * np.arange(corners) / corners
    return np.column_stack([np.cos(angles), np.sin(angles)])


_PUNCHES: dict[str, Callable[[], Polygon]] = {
    "circle": lambda: ellipse(_HALF_BOX, _HALF_BOX),
    "doughnut": lambda: Polygon(
        ellipse(_HALF_BOX, _HALF_BOX).exterior, [ellipse(_HALF_BOX / 2, _HALF_BOX / 2).exterior]
    ),
    "ellipse": lambda: ellipse(_HALF_BOX, 3e-3),
    "octagon": lambda: Polygon(_HALF_BOX / math.cos(math.pi / 8) * turned(8, 22.5)),
    "square": lambda: Polygon(_HALF_BOX * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])),
    "star": lambda: Polygon(np.tile([_HALF_BOX, _STAR_INNER_RADIUS], 5)[:, None] * turned(10, 90.0)),
    "triangle": lambda: Polygon(2.0 * _HALF_BOX / math.sqrt(3.0) * turned(3, 90.0)),
}

#: Names of the seven punches.
INDENTER_NAMES: tuple[str, ...] = tuple(_PUNCHES)
