"""The study's samples: readings of the paper's presses, computed with a contact law."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from mjtactile._types import Array
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.experiments.study.protocol import DISC_RADIUS, SHAPE_FORCE
from mjtactile.geometry.indenter import indenter_outline
from mjtactile.geometry.outlines import INDENTER_NAMES, ellipse
from mjtactile.influence.matrices import InfluenceMatrices


def oblique_readings(influence: InfluenceMatrices, law: str, angles_deg: Sequence[float]) -> Array:
    """Readings (angles, layers, rows, columns) [Pa] of 1 N on the 3 mm disc, tilted in the x-z plane.

    Under every contact law, the readings of a flat punch are proportional to its force. So those of other forces are
    multiples of these.
    """
    disc = ellipse(DISC_RADIUS, DISC_RADIUS)
    return np.stack([_readings(influence, disc, law, force_along(angle)) for angle in angles_deg])


def force_along(angle_deg: float) -> Array:
    """A force of 1 N on the pad at an angle from its inward normal, in the x-z plane [N], (3,)."""
    angle = np.radians(angle_deg)
    return np.array([np.sin(angle), 0.0, -np.cos(angle)])


def unit_vectors(angles_deg: Sequence[float]) -> Array:
    """Training targets of the direction network: (sin, 0, cos) along x, y and into the pad, shape (angles, 3)."""
    return np.stack([force_along(angle) * (1.0, 1.0, -1.0) for angle in angles_deg])


def punch_readings(influence: InfluenceMatrices, law: str, shift: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Readings (7, layers, rows, columns) [Pa] of all punches under 10 gf, in the order of `INDENTER_NAMES`."""
    return np.stack([punch_reading(influence, law, name, shift) for name in INDENTER_NAMES])


def punch_reading(influence: InfluenceMatrices, law: str, name: str, shift: tuple[float, float]) -> Array:
    """Readings (layers, rows, columns) [Pa] of one punch under 10 gf, its middle shifted by (x, y) [m]."""
    return _readings(influence, _outline(name, shift), law, np.array([0.0, 0.0, -SHAPE_FORCE]))


def law_difference(influence: InfluenceMatrices, law: str) -> float:
    """Largest relative difference of readings from law "uniform" over the study's centred presses, L2 norm [-]."""
    force = force_along(27.0)
    disc = ellipse(DISC_RADIUS, DISC_RADIUS)
    pairs = [[_readings(influence, disc, each, force) for each in (law, "uniform")]]
    pairs += list(zip(*(punch_readings(influence, each) for each in (law, "uniform")), strict=True))
    return max(float(np.linalg.norm(a - b) / np.linalg.norm(b)) for a, b in pairs)


@cache
def _outline(name: str, shift: tuple[float, float]) -> Polygon:
    return indenter_outline(name, shift=shift)


def _readings(influence: InfluenceMatrices, outline: BaseGeometry, law: str, force: Array) -> Array:
    footprint = Footprint.from_outline(outline, influence.surface)
    return influence.readings(contact_load(influence, footprint, force, law=law))
