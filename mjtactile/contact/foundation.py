"""Stiffness of the springs of law "foundation", calibrated against the elastic surface.

The stiffness per area of an elastic surface decreases with the size of the contact. The springs' stiffness therefore
depends on the contact area: a flat round punch of that area has the same indentation on the springs as on the pad.
"""

from __future__ import annotations

import weakref

import numpy as np
import shapely

from mjtactile._types import Array
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import Wrench, contact_options
from mjtactile.contact.press import Press
from mjtactile.influence.matrices import InfluenceMatrices

#: Radii of the punches over half the sheet's shorter side [-].
_RADII = (0.02, 0.05, 0.1, 0.2, 0.4, 0.65, 0.95)
#: Number of contact cells of each punch.
_CELLS = 60
#: Sides of the polygon for a quarter of a punch's rim.
_QUADRANT_SEGMENTS = 12

_calibrations: weakref.WeakKeyDictionary[InfluenceMatrices, tuple[Array, Array]] = weakref.WeakKeyDictionary()


def foundation_springs(influence: InfluenceMatrices) -> tuple[Array, Array]:
    """Logarithms of contact areas [m^2], ascending, and of the stiffness per area for each [Pa/m]; computed once."""
    if influence not in _calibrations:
        areas, stiffnesses = _calibrate(influence)
        _calibrations[influence] = np.log(areas), np.log(stiffnesses)
    return _calibrations[influence]


def _calibrate(influence: InfluenceMatrices) -> tuple[Array, Array]:
    surface = influence.surface
    press = Press(influence, contact_options(influence, law="elastic", tilt="fixed", cells=_CELLS), strength=0.0)
    west, south, east, north = surface.bounds
    wrench = Wrench(np.array([0.0, 0.0, -1.0]), np.zeros(3))
    areas, stiffnesses = [], []
    for radius in np.array(_RADII) * min(east - west, north - south) / 2:
        disc = shapely.Point(0.0, 0.0).buffer(radius, quad_segs=_QUADRANT_SEGMENTS)
        state = press.loads([Footprint.from_outline(disc, surface)], [wrench])[0].load.state
        areas.append(disc.area)
        stiffnesses.append(1.0 / (state.indentation * disc.area))
    return np.array(areas), np.array(stiffnesses)
