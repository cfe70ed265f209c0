"""Stiffness of the springs that stand for the pad under law "foundation", calibrated against the elastic surface.

An elastic surface gives more under a large face than springs of one stiffness would. The springs' stiffness therefore
depends on the area in contact: it is the one with which a flat round punch of that area sinks in as far as on the
pad itself.
"""

from __future__ import annotations

import weakref

import numpy as np
import shapely

from mjtactile.cell_contact import CellContact
from mjtactile.complementarity import rigid_contact
from mjtactile.compliance import SurfaceCompliance
from mjtactile.pad import Array
from mjtactile.partition import outline_cells
from mjtactile.rigid import Mask, RigidContact
from mjtactile.winkler import winkler_contact

#: Radii of the punches, over half the sheet's shorter side.
_RADII = (0.02, 0.05, 0.1, 0.2, 0.4, 0.65, 0.95)
_CELLS = 60
_QUADRANT_SEGMENTS = 12
#: Rounds in which contact area and stiffness adapt to each other.
_ROUNDS = 30
_SAME_AREA = 1e-9

_calibrations: weakref.WeakKeyDictionary[SurfaceCompliance, tuple[Array, Array]] = weakref.WeakKeyDictionary()


def foundation_stiffness(compliance: SurfaceCompliance, area: float) -> float:
    """Pressure per indentation of the springs under a contact of an area [m^2], in Pa/m."""
    areas, stiffnesses = foundation_springs(compliance)
    logarithm = np.interp(np.log(area), areas, stiffnesses)
    # Small contacts feel a half space, on which stiffness per area falls with the radius.
    below = 0.5 * max(0.0, float(areas[0] - np.log(area)))
    return float(np.exp(logarithm + below))


def foundation_springs(compliance: SurfaceCompliance) -> tuple[Array, Array]:
    """Logarithms of contact areas [m^2], ascending, and of the stiffness per area under each [Pa/m]; made once."""
    if compliance not in _calibrations:
        areas, stiffnesses = _calibrate(compliance)
        _calibrations[compliance] = np.log(areas), np.log(stiffnesses)
    return _calibrations[compliance]


def foundation_contact(
    compliance: SurfaceCompliance, at: CellContact, resultants: Array, start: Mask | None
) -> RigidContact:
    """Press a body into springs whose stiffness fits the area that comes into contact."""
    areas = at.cells.areas[at.reached]
    area = float(areas.sum() if start is None or not start.any() else areas[start].sum())
    contact = None
    for _ in range(_ROUNDS):
        springs = foundation_stiffness(compliance, area) * areas
        contact = winkler_contact(springs, at.modes, at.gaps, resultants)
        pressed = float(areas[contact.pressed].sum())
        if abs(pressed - area) <= _SAME_AREA * area:
            break
        area = (area + pressed) / 2 if abs(pressed - area) < 0.1 * area else pressed
    assert contact is not None
    return contact


def _calibrate(compliance: SurfaceCompliance) -> tuple[Array, Array]:
    areas, stiffnesses = [], []
    half = min(line[-1] - line[0] for line in compliance.lines) / 2
    for radius in np.array(_RADII) * half:
        cells = outline_cells(shapely.Point(0.0, 0.0).buffer(radius, quad_segs=_QUADRANT_SEGMENTS), _CELLS)
        matrix, one = compliance.normal(cells), np.ones((cells.count, 1))
        contact = rigid_contact(matrix, one, np.zeros(cells.count), np.ones(1))
        area = float(cells.areas.sum())
        areas.append(area)
        stiffnesses.append(1.0 / (contact.motion[0] * area))
    return np.array(areas), np.array(stiffnesses)
