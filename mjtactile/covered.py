"""What of a lattice, or of the sheet, a body covers."""

from __future__ import annotations

import numpy as np
import shapely

from mjtactile.cell_contact import Pressed
from mjtactile.footprint import Footprint
from mjtactile.pad import Array
from mjtactile.partition import Lattice
from mjtactile.region import Region
from mjtactile.rigid import Mask

#: Lines along each side of the sheet of the grid that finds where the search begins.
_LINES = 33
_BISECTIONS = 12


def covered_region(footprint: Footprint) -> Region:
    """Bounds of what the body covers, looked for on a grid over the sheet.

    Of its outline where that slips between the points, or leaves out more than one of them.
    """
    west, south, east, north = footprint.surface.sheet.bounds
    x, y = np.linspace(west, east, _LINES), np.linspace(south, north, _LINES)
    covered = np.isfinite(footprint.heights(np.stack(np.meshgrid(x, y), axis=-1)))
    if not covered.any():
        return Region.around(footprint.outline)
    low_x, high_x = _bounds(footprint, x, y, covered, 0)
    low_y, high_y = _bounds(footprint, y, x, covered.T, 1)
    bounds, step = np.array(footprint.outline.bounds), np.array([x[1] - x[0], y[1] - y[0]])
    low, high = np.array([low_x, low_y]), np.array([high_x, high_y])
    low = np.where(bounds[:2] > low + step, bounds[:2], low)
    high = np.where(bounds[2:] < high - step, bounds[2:], high)
    return Region.around(shapely.box(*low, *high))


def _bounds(footprint: Footprint, along: Array, across: Array, covered: Mask, axis: int) -> tuple[float, float]:
    """Least and greatest coordinate along an axis that the body covers, by bisection from a grid's outermost points."""
    bounds = []
    for lines, cover in ((along, covered), (along[::-1], covered[:, ::-1])):
        rows = np.flatnonzero(cover.any(axis=1))
        first = cover[rows].argmax(axis=1)
        rows, first = (one[first <= first.min() + 1] for one in (rows, first))
        inside, outside = lines[first], lines[np.maximum(first - 1, 0)]
        for _ in range(_BISECTIONS):
            middle = (inside + outside) / 2
            points = np.stack([middle, across[rows]] if axis == 0 else [across[rows], middle], axis=-1)
            over = np.isfinite(footprint.heights(points))
            inside, outside = np.where(over, middle, inside), np.where(over, outside, middle)
        bounds.append(inside)
    return float(bounds[0].min()), float(bounds[1].max())


def covered_cells(footprint: Footprint, lattice: Lattice) -> Mask:
    """Cells of a lattice that the body covers as far as they lie on the sheet."""
    west, south, east, north = footprint.surface.sheet.bounds
    corners = np.clip(lattice.corners(), (west, south), (east, north))
    over = np.isfinite(footprint.heights(corners)) & shapely.intersects_xy(
        footprint.outline, corners[..., 0], corners[..., 1]
    )
    return (over[:-1, :-1] & over[:-1, 1:] & over[1:, 1:] & over[1:, :-1]).ravel()


def ends_at_rim(lattice: Lattice, covered: Mask, pressed: Pressed) -> bool:
    """Whether a cell under pressure has a neighbour that the body does not cover: its rim may end the contact."""
    beside = np.pad(~covered.reshape(lattice.rows, lattice.columns), 1)
    beside = beside[:-2, 1:-1] | beside[2:, 1:-1] | beside[1:-1, :-2] | beside[1:-1, 2:]
    under = lattice.cell_at(pressed.at.cells.centroids[pressed.contact.pressed])
    return bool(beside.ravel()[under].any())
