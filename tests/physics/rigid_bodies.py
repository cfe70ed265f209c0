"""Rigid bodies on a half space: the contact laws without a pad, and closed forms for what they must find."""

from __future__ import annotations

import math

import numpy as np
from shapely import Point, Polygon

from mjtactile.cell_laws import CellLoad, cell_load
from mjtactile.compliance import SurfaceCompliance
from mjtactile.footprint import Footprint, GapMap
from mjtactile.influence import InfluenceMatrices
from mjtactile.options import ContactOptions, Wrench
from mjtactile.pad import Array, Layer, Pad, TaxelGrid
from mjtactile.preset import Fidelity

YOUNG = 3e6


def half_space(poisson: float, young: float = YOUNG) -> SurfaceCompliance:
    """A surface without a remainder."""
    shear = young / (2 * (1 + poisson))
    ends = np.array([-1.0, 1.0])
    return SurfaceCompliance((1 - poisson) / (2 * math.pi * shear), poisson, np.zeros((3, 1, 3, 1)), (ends, ends))


def contact_modulus(poisson: float, young: float = YOUNG) -> float:
    """Young's modulus over 1 - nu^2 [Pa]."""
    return young / (1 - poisson**2)


def sheet_to_cover(poisson: float, side: float = 40e-3) -> InfluenceMatrices:
    """What footprints need, without tables: a surface to cover, large beside the bodies."""
    pad = Pad(
        size=(side, side),
        layers=(Layer(thickness=side, young=YOUNG, poisson=poisson),),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=(side / 4,),
    )
    return InfluenceMatrices(pad, Fidelity(mesh="draft"), {})


def disc(radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> Polygon:
    """A disc as a polygon of the same area."""
    segments = 64
    step = 2 * math.pi / (4 * segments)
    return Point(centre).buffer(radius * math.sqrt(step / math.sin(step)), quad_segs=segments)


def pressed(
    compliance: SurfaceCompliance,
    body: Polygon | GapMap,
    force: float,
    *,
    shear: tuple[float, float] = (0.0, 0.0),
    torsion: float = 0.0,
    through: tuple[float, float] = (0.0, 0.0),
    tangential: str = "proportional",
    friction: float | None = None,
    tilting: bool = False,
    cells: int = 400,
    outline: Polygon | None = None,
) -> CellLoad:
    """A flat face, given as its outline, or a body given by its gap map, pressed by law "elastic"."""
    sheet = sheet_to_cover(compliance.poisson)
    if isinstance(body, Polygon):
        footprint = Footprint.from_outline(body, sheet)
    else:
        footprint = Footprint.from_gap(body, sheet, outline=outline)
    options = ContactOptions(law="elastic", tangential=tangential, friction=friction, tilting=tilting, cells=cells)
    vector = np.array([*shear, -force])
    wrench = Wrench(vector, np.cross([*through, 0.0], vector) + np.array([0.0, 0.0, torsion]))
    return cell_load(compliance, footprint, wrench, options)


def surface_motion(compliance: SurfaceCompliance, load: CellLoad) -> Array:
    """Mean displacement of each cell, (3, cells) [m]."""
    return np.einsum("iajb,bj->ia", compliance.full(load.cells), load.forces)


def contact_radius(load: CellLoad) -> float:
    """Of a disc as large as the contact [m]."""
    return math.sqrt(load.state.contact_area / math.pi)
