"""Cells that break under a pressure of their own: loads they cannot bear come as near as cells bear them."""

import numpy as np
import pytest
from core_cells import cell_forces
from rigid_bodies import YOUNG, half_space
from scipy.optimize import linprog
from shapely import Point, Polygon

from mjtactile import indenter_outline
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import ContactOptions, Wrench
from mjtactile.contact.press import Press

#: Share of the way from the even load to what cells bear just so, to which loads beyond it are brought.
SAFE = 1 / 1.01
#: What the search for the nearest leaves open of the distance.
CLOSE = 2e-3
OUTLINES = {
    "square": indenter_outline("square", rotate_deg=20),
    "triangle": indenter_outline("triangle", shift=(1e-3, 0.5e-3)),
    "long": Polygon([(-4e-3, -1e-3), (4e-3, -1e-3), (4e-3, 1e-3), (-4e-3, 1e-3)]),
}


def _farthest(areas, centroids, force, strength, along) -> float:
    """How far along a direction a force can pass that the cells bear [m].

    A linear programme: forces between 0 and what each cell bears, of a given sum.
    """
    found = linprog(
        -(centroids @ along) * 1e3,
        A_eq=np.ones((1, len(areas))),
        b_eq=[force],
        bounds=[(0.0, strength * area) for area in areas],
    )
    assert found.status == 0
    return -found.fun / 1e3 / force


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("direction", [0.3, 2.0, 4.5])
@pytest.mark.parametrize("name", OUTLINES)
def test_a_load_that_breaks_cells_moves_to_the_nearest_they_bear(name, direction, share):
    influence, outline, strength = half_space(0.45), OUTLINES[name], 0.3 * YOUNG
    press = Press(
        influence,
        ContactOptions(law="elastic", tangential="proportional", friction=None, tilting=True, cells=100),
        strength=strength,
        narrowest=1e-9,
    )
    footprint, toward = (
        Footprint.from_outline(outline, influence.surface),
        np.array([np.cos(direction), np.sin(direction)]),
    )
    middle = np.array(outline.centroid.coords[0])
    # Within the middles of the outermost cells.
    rim = 0.75 * max(t for t in np.linspace(0, 8e-3, 800) if outline.contains(Point(middle + t * toward)))
    vector = np.array([0.0, 0.0, -share * strength * outline.area])
    wrench = Wrench(vector, np.cross([*(middle + rim * toward), 0.0], vector))
    found = press.loads([footprint], [wrench])[0]
    cells = cell_forces(press)
    normal = -cells.forces[:, 2]
    assert normal.sum() == pytest.approx(-vector[2], rel=1e-9)
    assert normal.min() >= 0.0
    assert (normal <= strength * cells.areas * (1 + 1e-9)).all()
    even = cells.areas @ cells.centroids / cells.areas.sum()
    at, asked = normal @ cells.centroids / normal.sum(), middle + rim * toward
    # What is carried is nearest where it lies on the rim of all loads that are, straight under what was asked for.
    away = asked - at
    distance = float(np.hypot(*away))
    if distance <= 1e-9:
        return
    along = away / distance
    farthest = _farthest(cells.areas, cells.centroids, -vector[2], strength, along)
    assert at @ along == pytest.approx(even @ along + SAFE * (farthest - even @ along), abs=CLOSE * distance)
    assert not found.approximated
    # What is told as left over is what the cells do not carry.
    carried = np.cross(np.column_stack((cells.centroids, np.zeros(len(normal)))), cells.forces).sum(axis=0)
    assert np.allclose(found.load.residual_moment, wrench.moment - carried, atol=1e-12)
