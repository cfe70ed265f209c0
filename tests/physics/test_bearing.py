"""Cells that break under a pressure of their own: loads they cannot bear where they are come as near as they can."""

import numpy as np
import pytest
from rigid_bodies import YOUNG, half_space
from scipy.optimize import linprog
from shapely import Point, Polygon

from mjtactile import indenter_outline
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.options import ContactOptions, Wrench
from mjtactile.contact.press import Press

#: Share of what cells bear of which loads that would need more are given.
SAFE = 1 / 1.01
#: What the search for how far a load may stand leaves open.
CLOSE = 2e-3
OUTLINES = {
    "square": indenter_outline("square", rotate_deg=20),
    "triangle": indenter_outline("triangle", shift=(1e-3, 0.5e-3)),
    "long": Polygon([(-4e-3, -1e-3), (4e-3, -1e-3), (4e-3, 1e-3), (-4e-3, 1e-3)]),
}


def _farthest(areas, centroids, force, strength, even, toward) -> float:
    """How far from the even load's point a force can pass that the cells bear, towards a direction [m].

    A linear programme: forces between 0 and what each cell bears, of a given sum, whose centre lies on a line.
    """
    count = len(areas)
    # Unknowns: forces, and how far their moment is from that of the even load [N m].
    balance = np.vstack((np.append(np.ones(count), 0.0), np.column_stack(((centroids - even).T, -toward))))
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_eq=balance * np.array([[1.0], [1e3], [1e3]]),
        b_eq=[force, 0.0, 0.0],
        bounds=[*((0.0, strength * area) for area in areas), (0.0, None)],
    )
    assert found.status == 0
    return float(found.x[-1]) / force


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("direction", [0.3, 2.0, 4.5])
@pytest.mark.parametrize("name", OUTLINES)
def test_a_load_that_breaks_cells_moves_towards_their_middle_as_far_as_it_must(name, direction, share):
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
    cells = press.cell_forces()
    normal = -cells.forces[:, 2]
    assert normal.sum() == pytest.approx(-vector[2], rel=1e-9)
    assert normal.min() >= 0.0
    assert (normal <= strength * cells.areas * (1 + 1e-9)).all()
    even = cells.areas @ cells.centroids / cells.areas.sum()
    asked = middle + rim * toward - even
    away = float(np.hypot(*asked))
    farthest = _farthest(cells.areas, cells.centroids, -vector[2], strength, even, asked / away)
    expected = even + min(1.0, SAFE * farthest / away) * asked
    assert np.hypot(*(normal @ cells.centroids / normal.sum() - expected)) <= CLOSE * away
    assert not found.bounded
    # What is told as left over is what the cells do not carry.
    carried = np.cross(np.column_stack((cells.centroids, np.zeros(len(normal)))), cells.forces).sum(axis=0)
    assert np.allclose(found.load.residual_moment, wrench.moment - carried, atol=1e-12)
