"""Rigid bodies on a half space: law "elastic" without a pad, and closed forms for what it must find."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from core_cells import CellForces, cell_forces
from half_space import HalfSpaceIntegrals, half_space_compliance
from shapely import Point, Polygon

from mjtactile._types import Array
from mjtactile.contact.cells import compliance as compliances
from mjtactile.contact.cells.compliance import SurfaceCompliance
from mjtactile.contact.footprint import Footprint, GapFunction
from mjtactile.contact.options import ContactOptions, Wrench
from mjtactile.contact.press import Press
from mjtactile.fidelity import Fidelity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import ContactState
from mjtactile.pad import Layer, Pad, TaxelGrid

YOUNG = 3e6


def half_space(poisson: float, young: float = YOUNG, side: float = 40e-3) -> InfluenceMatrices:
    """A pad without tables whose surface has no remainder, large and deep beside the bodies."""
    pad = Pad(
        size=(side, side),
        layers=(Layer(thickness=side, young=young, poisson=poisson),),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=(side / 4,),
    )
    influence = InfluenceMatrices(pad, Fidelity(mesh="draft"), {})
    ends = np.array([-side / 2, side / 2])
    factor = (1 - poisson**2) / (math.pi * young)
    compliances._known[influence] = SurfaceCompliance(factor, poisson, np.zeros((3, 1, 3, 1)), (ends, ends))
    return influence


def contact_modulus(poisson: float, young: float = YOUNG) -> float:
    """Young's modulus over 1 - nu^2 [Pa]."""
    return young / (1 - poisson**2)


def disc(radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> Polygon:
    """A disc as a polygon of the same area."""
    segments = 64
    step = 2 * math.pi / (4 * segments)
    return Point(centre).buffer(radius * math.sqrt(step / math.sin(step)), quad_segs=segments)


@dataclass(frozen=True)
class Pressed:
    """What law "elastic" found."""

    state: ContactState
    cells: CellForces

    @property
    def forces(self) -> Array:
        """On the cells, (cells, 3) [N]."""
        return self.cells.forces


def pressed(
    influence: InfluenceMatrices,
    body: Polygon | GapFunction,
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
) -> Pressed:
    """A flat face, given as its outline, or a body given by its gap function, pressed by law "elastic"."""
    if isinstance(body, Polygon):
        footprint = Footprint.from_outline(body, influence.surface)
    else:
        footprint = Footprint.from_gap(body, influence.surface, outline=outline)
    options = ContactOptions(law="elastic", tangential=tangential, friction=friction, tilting=tilting, cells=cells)
    vector = np.array([*shear, -force])
    wrench = Wrench(vector, np.cross([*through, 0.0], vector) + np.array([0.0, 0.0, torsion]))
    press = Press(influence, options, strength=0.0, narrowest=1e-9)
    state = press.loads([footprint], [wrench])[0].load.state
    return Pressed(state, cell_forces(press))


def contact_radius(load: Pressed) -> float:
    """Of a disc as large as the contact [m]."""
    return math.sqrt(load.state.contact_area / math.pi)


def surface_motion(poisson: float, load: Pressed) -> Array:
    """Mean displacement of each cell of a half space, (3, cells) [m]."""
    cells = load.cells
    integrals = HalfSpaceIntegrals(cells.edges, cells.sides)
    factor = (1 - poisson**2) / (math.pi * YOUNG)
    return np.einsum("iajb,bj->ia", half_space_compliance(factor, poisson, integrals, cells.areas), cells.forces)
