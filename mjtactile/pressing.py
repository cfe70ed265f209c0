"""Where a body presses, and how hard: contact cells chosen for a footprint, and a law solved on them.

A flat face is covered by cells once. A curved body touches a small part of what it covers, and how small depends on
the force: a coarse lattice finds that part and closes in on it until cells of the wanted number lie where it presses.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely

from mjtactile.cell_contact import CellContact, Pressed, Solver
from mjtactile.cells import Cells
from mjtactile.covered import covered_cells, covered_region, ends_at_rim
from mjtactile.errors import ContactError
from mjtactile.footprint import Footprint
from mjtactile.pad import Array
from mjtactile.partition import Lattice, cells_on_sheet, outline_cells, stretched_cells
from mjtactile.planar import areal, polygons_of
from mjtactile.region import Region
from mjtactile.rigid import RESULTANTS, Mask

#: Cells of the lattices that look for the contact, and of the last ones that do.
_COARSE_CELLS, _SEARCH_CELLS = 36, 100
_SEARCHES = 30
#: A search ends when the contact's surroundings fill this part of the lattice.
_FILLED = 0.7
#: Where fewer of a flat face's cells press than this, and than this share of them, cells are chosen that lie there.
_FEW_CELLS, _FEW_SHARE = 16, 0.5
#: Nearest the force's line may pass to a flat face's rim there, over the root of its area.
_RIM = 1e-3
#: Middles of cells on a flat face's rim, where symmetry often puts them, count as outside: over the root of its area.
_BARELY = 1e-9
#: Least area a search closes in on, over what the body covers.
_SMALLEST = 1e-9


def press(
    footprint: Footprint,
    normal: float,
    through: Array,
    *,
    tilting: bool,
    count: int,
    solver: Solver,
    softness: float,
    known: Pressed | None = None,
) -> Pressed:
    """Press a body into the pad.

    Args:
        footprint: of the body.
        normal: force [N], positive.
        through: point (x, y) the force's line passes through [m]; what the cells cannot reach is moved nearer.
        tilting: whether the body may tilt; otherwise the force passes where it will.
        count: cells wanted.
        solver: contact law.
        softness: surface displacement a point force brings, times its distance, over the force [1/Pa].
        known: the same body pressed otherwise, whose cells serve again if they fit.

    Raises:
        ContactError: when no contact was found.
    """
    flat = footprint.gap is None
    if known is not None and not (flat and known.at.chosen_for > 0.0):  # those lie where another force pressed
        with contextlib.suppress(ContactError):  # cells chosen for another force may be far too coarse
            again = _solved(known.at, normal, through, solver, known.contact.pressed)
            if again.fits if not flat else not _is_small(again):
                return again
    centre = np.array(footprint.centroid)
    if flat:
        cells = outline_cells(footprint.outline, count)
        at = CellContact(cells, np.zeros(cells.count), centre, tilting and cells.count >= 3)
        whole = _solved(at, normal, through, solver, None)
        inner = footprint.outline.convex_hull.buffer(-_RIM * np.sqrt(footprint.area))
        if inner.is_empty or not _is_small(whole):
            return whole
        # What passes beside the face, or along its very rim, would close in on nothing.
        through = shapely.get_coordinates(shapely.shortest_line(inner, shapely.Point(through)))[0]
        with contextlib.suppress(ContactError, ValueError, np.linalg.LinAlgError):
            part = _on_part(footprint, normal, through, centre, tilting, count, solver, softness)
            # On the smallest parts coordinates have no digits left for integrals over cells.
            carried = part.at.cells.nodal_forces(footprint.surface, part.contact.forces[:, None]).sum()
            if abs(carried - normal) <= RESULTANTS * normal:
                return part
        return whole
    shapely.prepare(footprint.outline)
    region, found = _closest(footprint, covered_region(footprint), normal, through, centre, tilting, solver, softness)
    lattice, pressed = region.lattice(count), None
    covered = covered_cells(footprint, lattice)
    if covered.any():
        at = _reachable_on_sheet(footprint, lattice, covered, centre, tilting)
        with contextlib.suppress(ContactError):
            pressed = _solved(at, normal, through, solver, _overlapping(at, found))
    if pressed is None or ends_at_rim(lattice, covered, pressed):
        at = _within_outline(footprint, region, count, centre, tilting)
        pressed = _solved(at, normal, through, solver, _overlapping(at, found))
    return Pressed(replace(pressed.at, chosen_for=pressed.area), pressed.contact)


def _on_part(
    footprint: Footprint,
    normal: float,
    through: Array,
    centre: Array,
    tilting: bool,
    count: int,
    solver: Solver,
    softness: float,
) -> Pressed:
    """Press a flat face on cells that lie where a small part of it presses."""
    shapely.prepare(footprint.outline)
    region, _ = _closest(
        footprint, Region.around(footprint.outline), normal, through, centre, tilting, solver, softness
    )
    lattice = region.lattice(count)
    cells = cells_on_sheet(lattice, np.ones(lattice.columns * lattice.rows, dtype=bool), footprint.outline)
    at = CellContact(cells, np.zeros(cells.count), centre, tilting and cells.count >= 3)
    pressed = _solved(at, normal, through, solver, None)
    return Pressed(replace(at, chosen_for=pressed.area), pressed.contact)


def _closest(
    footprint: Footprint,
    region: Region,
    normal: float,
    through: Array,
    centre: Array,
    tilting: bool,
    solver: Solver,
    softness: float,
) -> tuple[Region, Pressed]:
    """Close in from a region on the contact: the region at last, and the contact on the lattice before."""
    smallest, found, count = _SMALLEST * region.area, None, _COARSE_CELLS
    for _ in range(_SEARCHES):
        at = _on_lattice(footprint, region, count, centre, tilting)
        force = max(normal, at.spreading_force / softness)
        found = _solved(at, force, through, solver, None)
        closer = region.around_pressed(found)
        if closer.area < smallest:
            break  # coordinates have no digits for less
        # A strip narrower than the cells would seem to fill them: look again with longer ones.
        filled = closer.area > _FILLED * region.area and closer.stretch <= region.stretch
        region = closer
        if filled and force == normal:
            if count == _SEARCH_CELLS:
                break
            count = _SEARCH_CELLS
    assert found is not None
    return region, found


def _is_small(pressed: Pressed) -> bool:
    """Whether so few of a flat face's cells press that they are too coarse."""
    return int(pressed.contact.pressed.sum()) < min(_FEW_CELLS, _FEW_SHARE * pressed.at.cells.count)


def _solved(at: CellContact, normal: float, through: Array, solver: Solver, start: Mask | None) -> Pressed:
    likely = None if start is None else start[at.reached]
    return Pressed(at, solver(at, at.resultants(normal, through), likely).spread(at.reached))


def _overlapping(at: CellContact, found: Pressed) -> Mask | None:
    """Cells the body would overlap after the motion found on other cells; None if too few to start from."""
    depth = found.contact.motion[0] + (at.cells.centroids - found.at.centre) @ found.slopes - at.heights
    start = depth > 0.0
    return start if start.sum() >= 6 else None


def _on_lattice(footprint: Footprint, region: Region, count: int, centre: Array, tilting: bool) -> CellContact:
    """A lattice over a region, on the cells whose middles the body covers."""
    lattice = region.lattice(count).cells
    heights = _mean_heights(footprint, lattice)
    within = (
        footprint.outline.buffer(-_BARELY * np.sqrt(footprint.area)) if footprint.gap is None else footprint.outline
    )
    heights[~shapely.intersects_xy(within, lattice.centroids)] = np.inf
    here = region.polygon()
    for part in polygons_of(footprint.outline):
        middle = part.centroid
        point = shapely.get_coordinates(middle if part.contains(middle) else part.point_on_surface())
        # What is smaller than a cell may hold no cell's middle.
        if shapely.intersects_xy(here, point)[0] and not shapely.intersects_xy(part, lattice.centroids).any():
            nearest = int(((lattice.centroids - point) ** 2).sum(axis=1).argmin())
            heights[nearest] = min(heights[nearest], float(footprint.heights(point)[0]))
    return _reachable(lattice, heights, centre, tilting)


def _reachable_on_sheet(
    footprint: Footprint, lattice: Lattice, covered: Mask, centre: Array, tilting: bool
) -> CellContact:
    cells = cells_on_sheet(lattice, covered, footprint.surface.sheet)
    return _reachable(cells, _mean_heights(footprint, cells), centre, tilting)


def _within_outline(footprint: Footprint, region: Region, count: int, centre: Array, tilting: bool) -> CellContact:
    """Cells fitted to the outline where that may end the contact."""
    within = areal(footprint.outline.intersection(region.polygon()))
    if within.area == 0.0:
        raise ContactError("the body touches in an area too narrow to find. Pass its outline=... to from_gap.")
    cells = stretched_cells(within, count, region.angle, region.stretch)
    return _reachable(cells, _mean_heights(footprint, cells), centre, tilting)


def _reachable(cells: Cells, heights: Array, centre: Array, tilting: bool) -> CellContact:
    count = np.isfinite(heights).sum()
    if count == 0:
        raise ContactError("the body is out of the pad's reach everywhere. Check its gap map.")
    return CellContact(cells, heights, centre, tilting and bool(count >= 3))


def _mean_heights(footprint: Footprint, cells: Cells) -> Array:
    """Height of the body averaged over each cell: exact for a quadratic surface; infinite out of reach."""
    points = np.concatenate([cells.centroids[:, None], cells.quadrature], axis=1)
    heights: npt.NDArray[np.float64] = footprint.heights(points)
    around = heights[:, 1:].mean(axis=1)
    return np.where(np.isfinite(around), around, heights[:, 0])
