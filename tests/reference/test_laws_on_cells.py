"""The compiled core against contact laws written down in a few lines each, on the same cells."""

from __future__ import annotations

import numpy as np
import pytest
from core_cells import CellForces, cell_forces, read
from laws_on_cells import (
    Cells,
    coulomb,
    full_compliance,
    leaning,
    normal_compliance,
    placed,
    pressing,
    proportional,
    sticking,
)
from shapely import box

import mjtactile
from mjtactile.contact.cells.compliance import surface_compliance
from mjtactile.contact.cells.face_cells import placed_cells
from mjtactile.contact.footprint import Footprint
from mjtactile.contact.foundation import foundation_springs
from mjtactile.contact.options import Wrench, contact_options
from mjtactile.contact.press import Press
from mjtactile.fidelity import Fidelity

#: Forces agree to this fraction of the largest: dense systems of some hundred unknowns, solved in two ways.
EXACT = 1e-9
#: Where rounds of pressing and slip end, of the largest movement.
SETTLED = 1e-6
COUNT = 60
FORCE = np.array([0.01, -0.02, -0.2])
OUTLINES = {
    **{
        name: mjtactile.indenter_outline(name, rotate_deg=20, shift=(1e-3, -0.5e-3))
        for name in mjtactile.INDENTER_NAMES
    },
    "over the edge": mjtactile.indenter_outline("star", rotate_deg=31, shift=(5e-3, 1.3e-3)),
    "two parts": box(-4e-3, -1e-3, -2e-3, 1e-3).union(box(0.0, -1e-3, 3e-3, 1e-3)),
}


@pytest.fixture(scope="module")
def influence():
    return mjtactile.influence_matrices(fidelity=Fidelity(mesh="draft"), progress=False)


def solved(influence, footprint: Footprint, lever=(0.0, 0.0), **options) -> tuple[CellForces, Cells, np.ndarray]:
    """What the core finds, the same cells for the reference, and the wrench (6,)."""
    chosen = contact_options(influence, cells=COUNT, **{"law": "elastic", **options})
    moment = np.cross([footprint.centroid[0] + lever[0], footprint.centroid[1] + lever[1], 0.0], FORCE)
    moment[2] += 1e-5
    springs = foundation_springs(influence) if chosen.contact_law.springs else None
    press = Press(influence, chosen, springs=springs, strength=0.0)
    found = press.loads([footprint], [Wrench(FORCE, moment)])[0]
    assert not found.approximated
    assert not found.simplified
    made, place = placed_cells(footprint.outline, COUNT)
    forces, cells = cell_forces(press), placed(read(made), place)
    np.testing.assert_allclose(forces.centroids, cells.centroids, atol=1e-12)
    return forces, cells, np.concatenate([FORCE, moment])


def normal_resultants(cells: Cells, wrench: np.ndarray, tilting: bool) -> np.ndarray:
    middle = cells.centroids.mean(axis=0)
    through = np.array([wrench[4], -wrench[3]]) / -wrench[2]
    return -wrench[2] * np.array([1.0, *((through - middle) / cells.length)][: 3 if tilting else 1])


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=EXACT * np.abs(expected).max())


@pytest.mark.parametrize("tilt", ["free", "fixed"])
@pytest.mark.parametrize("name", OUTLINES)
def test_elastic_and_proportional_shear(influence, name, tilt):
    found, cells, wrench = solved(influence, Footprint.from_outline(OUTLINES[name], influence.surface), tilt=tilt)
    modes = cells.modes if tilt == "free" else cells.modes[:, :1]
    compliance = normal_compliance(surface_compliance(influence), cells)
    normal = pressing(compliance, modes, np.zeros(len(modes)), normal_resultants(cells, wrench, tilt == "free"))
    assert_same(found.forces[:, 2], -normal)
    assert_same(found.forces[:, :2], proportional(cells, normal, wrench).T)


@pytest.mark.parametrize("lever", [(0.9e-3, 0.0), (-0.4e-3, 0.8e-3)])
def test_a_face_that_lifts(influence, lever):
    footprint = Footprint.from_outline(box(-2e-3, -1.5e-3, 2e-3, 1.5e-3), influence.surface)
    found, cells, wrench = solved(influence, footprint, lever)
    compliance = normal_compliance(surface_compliance(influence), cells)
    resultants = normal_resultants(cells, wrench, tilting=True)
    normal = pressing(compliance, cells.modes, np.zeros(len(cells.areas)), resultants)
    assert 0 < (normal == 0.0).sum() < len(normal)
    assert_same(found.forces[:, 2], -normal)


@pytest.mark.parametrize("name", ["circle", "star", "triangle"])
def test_foundation_is_a_bed_of_springs(influence, name):
    found, cells, wrench = solved(
        influence, Footprint.from_outline(OUTLINES[name], influence.surface), law="foundation"
    )
    areas, stiffnesses = foundation_springs(influence)
    pressed = cells.areas[found.forces[:, 2] < 0.0].sum()
    stiffness = np.exp(np.interp(np.log(pressed), areas, stiffnesses))
    springs = np.diag(1.0 / (stiffness * cells.areas))
    resultants = normal_resultants(cells, wrench, tilting=True)
    assert_same(found.forces[:, 2], -pressing(springs, cells.modes, np.zeros(len(cells.areas)), resultants))


@pytest.mark.parametrize("name", OUTLINES)
def test_shear_that_sticks(influence, name):
    found, cells, wrench = solved(
        influence, Footprint.from_outline(OUTLINES[name], influence.surface), tangential="stick"
    )
    if (found.forces[:, 2] >= 0.0).any():
        return  # not all of the face presses
    assert_same(found.forces, sticking(full_compliance(surface_compliance(influence), cells), cells, wrench))


@pytest.mark.parametrize("friction", [0.2, 0.5])
@pytest.mark.parametrize("name", OUTLINES)
def test_shear_that_slips_where_friction_does_not_hold(influence, name, friction):
    footprint = Footprint.from_outline(OUTLINES[name], influence.surface)
    found, cells, _ = solved(influence, footprint, tangential="coulomb", friction=friction)
    full = full_compliance(surface_compliance(influence), cells)
    left = coulomb(full, cells, found.forces, np.zeros(len(cells.areas)), friction)
    assert left.over <= EXACT
    assert max(left.stuck, left.across, left.apart) <= SETTLED


#: Movements under cells of a lattice, whose integrals over two cells that are not near are sums over points.
SUMMED = 1e-3
#: Of a paraboloid, which is steep enough for its normals to count [m], and where it stands [m].
ROUND, MIDDLE = 4e-3, np.array([0.7e-3, -1.2e-3])


def under_a_paraboloid(influence, **options) -> tuple[CellForces, Cells, np.ndarray, np.ndarray]:
    """What the core finds, its cells, the wrench (6,), and the slopes of the body over each cell (cells, 2)."""

    def gap(x, y):
        return ((x - MIDDLE[0]) ** 2 + (y - MIDDLE[1]) ** 2) / (2 * ROUND)

    chosen = contact_options(influence, cells=COUNT, law="elastic", tilt="fixed", **options)
    moment = np.cross([*MIDDLE, 0.0], FORCE)
    moment[2] += 2e-6
    press = Press(influence, chosen, strength=0.0)
    found = press.loads([Footprint.from_gap(gap, influence.surface)], [Wrench(FORCE, moment)])[0]
    assert not found.approximated
    assert not found.simplified
    forces = cell_forces(press)
    middles = forces.centroids[:, None]  # these cells are smaller than the remainder's patches
    cells = Cells(forces.centroids, forces.areas, forces.edges, forces.sides, middles)
    return forces, cells, np.concatenate([FORCE, moment]), (forces.centroids - MIDDLE) / ROUND


def test_a_round_body_presses_along_its_normals(influence):
    found, cells, wrench, slopes = under_a_paraboloid(influence)
    normal = -found.forces[:, 2]
    assert np.linalg.norm(slopes[normal > 0.0], axis=1).max() > 0.1
    expected = leaning(cells, normal, slopes) + proportional(cells, normal, wrench)
    assert_same(found.forces[:, :2], expected.T)


@pytest.mark.parametrize("friction", [0.2, 0.3, 0.5])
def test_friction_does_not_bear_what_leans(influence, friction):
    found, cells, _, slopes = under_a_paraboloid(influence, tangential="coulomb", friction=friction)
    full = full_compliance(surface_compliance(influence), cells)
    along = leaning(cells, -found.forces[:, 2], slopes)
    left = coulomb(full, cells, found.forces, found.heights, friction, along)
    assert left.over <= EXACT
    assert max(left.stuck, left.across) <= SUMMED


def test_what_sticks_does_not_lean(influence):
    found, cells, wrench, _ = under_a_paraboloid(influence, tangential="stick")
    full = full_compliance(surface_compliance(influence), cells)
    left = coulomb(full, cells, found.forces, found.heights, 1e9)
    assert left.stuck <= SUMMED
    np.testing.assert_allclose(found.forces[:, :2].sum(axis=0), wrench[:2], atol=1e-12)
