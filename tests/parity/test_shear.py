"""Shear in the compiled core: as the NumPy reference spreads it, and never without an answer."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from shapely import box
from test_complementarity import random_problem

import mjtactile
from mjtactile import Footprint, cell_laws, native
from mjtactile.complementarity import rigid_contact
from mjtactile.compliance import SurfaceCompliance, surface_compliance
from mjtactile.errors import ContactError
from mjtactile.friction import ShearGrip
from mjtactile.native import without_native
from mjtactile.native_friction import full_compliance, surface_shear
from mjtactile.options import ContactOptions, Wrench
from mjtactile.partition import Lattice, cells_on_sheet, outline_cells

#: Largest difference of compliances over the largest: sums of some hundred terms in another order.
SAME_COMPLIANCE = 1e-12
#: Largest difference of forces over the largest: where the reference's minimisers end, SLSQP and the interior point.
SAME_FORCES = 1e-6
#: What forces may miss of a wrench, over its size.
CARRIED = 1e-9
FOOTPRINTS = ("circle", "square", "star", "ball", "egg")
#: Of the limit of sliding: well inside, most of it, just inside, just beyond, far beyond.
SHARES = (0.05, 0.6, 0.97, 1.02, 3.0)


@pytest.fixture(scope="module")
def influence():
    return mjtactile.influence_matrices(
        mjtactile.Pad(), preset=mjtactile.Fidelity(mesh="draft", law="elastic", cells=60)
    )


def half_space(poisson: float) -> SurfaceCompliance:
    """A surface without a remainder, on which shear and pressure act on each other as much as on any pad."""
    ends = np.array([-1.0, 1.0])
    return SurfaceCompliance(1e-7, poisson, np.zeros((3, 1, 3, 1)), (ends, ends))


@pytest.fixture(params=("avx512", "avx2", "plain"))
def instruction_set(request):
    before = native.instruction_set()
    try:
        native.use_instruction_set(request.param)
    except mjtactile.NativeError:
        pytest.skip(f"this processor has no {request.param}")
    yield request.param
    native.use_instruction_set(before)


@pytest.mark.parametrize("name", mjtactile.INDENTER_NAMES)
def test_full_compliance_of_fitted_cells(influence, instruction_set, name):
    cells = outline_cells(mjtactile.indenter_outline(name, rotate_deg=33, shift=(1e-3, -0.7e-3)), 60)
    expected = surface_compliance(influence).full(cells)
    assert np.abs(full_compliance(influence, cells) - expected).max() <= SAME_COMPLIANCE * np.abs(expected).max()


@pytest.mark.parametrize("stretch", [1.0, 2.0])
def test_full_compliance_of_a_lattice(influence, stretch):
    lattice = Lattice((1e-3, 2e-3), 0.3, 0.4e-3, 9, 7, stretch)
    chosen = np.ones(63, dtype=bool)
    chosen[[0, 3, 20]] = False
    cells = cells_on_sheet(lattice, chosen, box(-1.0, -1.0, 1.0, 1.0))
    expected = surface_compliance(influence).full(cells)
    for found in (full_compliance(influence, cells),):
        assert np.abs(found - expected).max() <= SAME_COMPLIANCE * np.abs(expected).max()


def test_full_compliance_of_cells_cut_at_the_sheet(influence):
    lattice = Lattice((0.0, 0.0), 0.2, 1e-3, 8, 8)
    cells = cells_on_sheet(lattice, np.ones(64, dtype=bool), box(-2.3e-3, -2.6e-3, 3.1e-3, 2.9e-3))
    expected = surface_compliance(influence).full(cells)
    assert np.abs(full_compliance(influence, cells) - expected).max() <= SAME_COMPLIANCE * np.abs(expected).max()


def pressed_footprint(influence, name):
    if name == "ball":
        return Footprint.from_gap(lambda x, y: (x**2 + y**2) / 16e-3, influence)
    if name == "egg":
        return Footprint.from_gap(lambda x, y: ((x - 1e-3) ** 2 + 0.3 * (y + 0.5e-3) ** 2) / 30e-3, influence)
    return Footprint.from_outline(mjtactile.indenter_outline(name, rotate_deg=20, shift=(1e-3, -0.5e-3)), influence)


def options(tangential="proportional", friction=None):
    return ContactOptions(law="elastic", tangential=tangential, friction=friction, tilting=True, cells=60)


class Case(NamedTuple):
    """A contact without friction, and a wrench that is a share of what friction bears."""

    load: cell_laws.CellLoad
    wrench: Wrench

    def core(self, compliance, tangential, friction):
        pressed = self.load.pressed
        return surface_shear(
            pressed.at.cells.centroids,
            pressed.contact.forces,
            np.concatenate([self.wrench.force, self.wrench.moment]),
            tangential=tangential,
            friction=friction,
            compliance=None if tangential == "proportional" else compliance.full(pressed.at.cells),
            heights=pressed.at.heights,
            middle=pressed.at.centre,
            length=pressed.at.length,
            tilting=pressed.at.tilting,
        )


def case_at(compliance, footprint, force, friction, share, direction):
    """Press with a force [N], and shear it by a share of the limit along a motion (x, y, turn)."""
    off = 0.2e-3
    centre = np.array(footprint.centroid) + off
    normal = np.array([0.0, 0.0, -force])
    pressing = Wrench(normal, np.cross([*centre, 0.0], normal))
    load = cell_laws.cell_load(compliance, footprint, pressing, options())
    grip = cell_laws._grip(load.pressed)
    shear = share * grip.resultants(grip.sliding(np.asarray(direction, dtype=float), friction))
    torsion = shear[2] * grip.length + grip.centre[0] * shear[1] - grip.centre[1] * shear[0]
    moment = np.array([pressing.moment[0], pressing.moment[1], torsion])
    return Case(load, Wrench(np.array([shear[0], shear[1], -force]), moment))


def carried(centroids, forces):
    """Force and moment about the pad's origin of forces on cells, (6,) [N, N m]."""
    points = np.column_stack([centroids, np.zeros(len(centroids))])
    return np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


CHOICES = [("proportional", True), ("stick", False), ("stick", True), ("coulomb", True)]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("name", FOOTPRINTS)
@pytest.mark.parametrize(("tangential", "bounded"), CHOICES)
def test_forces_are_those_of_the_reference(influence, tangential, bounded, name, share):
    compliance, footprint, friction = surface_compliance(influence), pressed_footprint(influence, name), 0.6
    for number, direction in enumerate([(1.0, 0.4, 0.0), (0.0, 0.0, 1.0), (-0.5, 0.3, 2.0)]):
        with without_native():
            case = case_at(compliance, footprint, (0.05, 1.0, 4.0)[number], friction, share, direction)
            chosen = options(tangential, friction if bounded else None)
            expected = cell_laws.cell_load(compliance, footprint, case.wrench, chosen)
        found = case.core(compliance, tangential, friction if bounded else None)
        assert not found.refused
        assert not found.simplified
        assert found.slides == (bounded and share > 1.0)
        assert np.abs(found.forces - expected.forces).max() <= SAME_FORCES * np.abs(expected.forces).max()
        if found.slides:
            continue
        wrench = np.concatenate([case.wrench.force, case.wrench.moment])
        missed = carried(expected.cells.centroids, found.forces) - wrench
        force = np.abs(wrench[:3]).max()
        assert np.abs(missed[:3]).max() <= CARRIED * force
        assert np.abs(missed[3:]).max() <= CARRIED * max(force * case.load.pressed.at.length, *np.abs(wrench[3:]))


@pytest.mark.parametrize("tangential", ["proportional", "stick", "coulomb"])
@pytest.mark.parametrize("power", [-12, -6, 6, 12])
def test_forces_of_any_size(influence, tangential, power):
    """Under a flat face forces are linear in the wrench: tiny and huge ones spread as others do."""
    compliance, footprint = surface_compliance(influence), pressed_footprint(influence, "star")

    def per_force(force):
        case = case_at(compliance, footprint, force, 0.5, 0.7, (1.0, 0.4, 0.5))
        return case.core(compliance, tangential, 0.5).forces / force

    one, other = per_force(1.0), per_force(10.0**power)
    np.testing.assert_allclose(other, one, atol=1e-9 * np.abs(one).max())


def random_case(seed):
    """Random cells, pressing and a wrench at, inside or beyond the limit; None where nothing presses."""
    random, problem = np.random.default_rng(seed), random_problem(seed)
    compliance = half_space(random.choice([0.05, 0.3, 0.4, 0.49])).full(problem.cells)
    try:
        pressing = rigid_contact(compliance[2, :, 2], problem.modes, problem.gaps, problem.resultants).forces
    except ContactError:
        return None
    kept, points = pressing > 0.0, problem.cells.centroids
    length, friction = math.sqrt(problem.cells.areas.sum()), 10 ** random.uniform(-2, 0.7)
    grip = ShearGrip(points[kept], pressing[kept], pressing[kept] @ points[kept] / pressing[kept].sum(), length)
    direction = random.normal(size=3) * random.choice([[1.0, 1.0, 1.0], [1e-6, 1e-6, 1.0], [1.0, 1.0, 0.0]])
    shares = [0.0, 1e-9, 0.3, 0.9, 0.99, 0.9999, 1 - 1e-6, 1.0, 1 + 1e-9, 1 + 1e-6, 1.01, 2.0, 1e3, 1e9]
    shear = random.choice(shares) * grip.resultants(grip.sliding(direction, friction))
    torsion = shear[2] * length + grip.centre[0] * shear[1] - grip.centre[1] * shear[0]
    return problem, compliance, pressing, friction, np.array([*shear[:2], -pressing.sum(), 0.0, 0.0, torsion])


@pytest.mark.parametrize("seeds", [range(start, start + 25) for start in range(0, 100, 25)], ids=str)
@pytest.mark.parametrize(("tangential", "bounded"), CHOICES)
def test_every_contact_gets_shear_that_carries_the_wrench(tangential, bounded, seeds):
    """Finite, within friction where it is bounded, and the whole wrench unless it slides."""
    for case in map(random_case, seeds):
        if case is None:
            continue
        problem, compliance, pressing, friction, wrench = case
        points, force = problem.cells.centroids, pressing.sum()
        length = math.sqrt(problem.cells.areas.sum())
        found = surface_shear(
            points,
            pressing,
            wrench,
            tangential=tangential,
            friction=friction if bounded else None,
            compliance=compliance,
            heights=problem.gaps,
            middle=points.mean(axis=0),
            length=length,
            tilting=problem.modes.shape[1] == 3,
        )
        assert np.isfinite(found.forces).all()
        assert not found.refused
        pressed = np.column_stack([np.zeros_like(points), -pressing])
        missed = carried(points - points.mean(axis=0), found.forces) - carried(points - points.mean(axis=0), pressed)
        wanted = wrench[5] - (points[:, 0].mean() * wrench[1] - points[:, 1].mean() * wrench[0])
        missed -= [wrench[0], wrench[1], 0.0, 0.0, 0.0, wanted]
        missed[3:] /= length
        size = max(force, *np.abs(wrench[:2]), abs(wanted) / length)
        assert abs(missed[2]) <= CARRIED * force
        if problem.modes.shape[1] == 3:
            assert np.abs(missed[3:5]).max() <= CARRIED * force
        if not found.slides:
            assert np.abs(missed[[0, 1, 5]]).max() <= CARRIED * size
        if bounded and (found.slides or tangential == "coulomb"):
            borne = friction * np.maximum(-found.forces[:, 2], 0.0)
            assert (np.hypot(*found.forces[:, :2].T) <= borne + 1e-8 * borne.max()).all()


def run(points, pressing, wrench, tangential, friction, **others):
    """Cells in given places on a half space, as point-like ones: give falls as 1/r, and is finite on each."""
    points = np.asarray(points, dtype=float)
    distance = np.linalg.norm(points[:, None] - points, axis=-1)
    give = 1.0 / (distance + 1e-4)
    compliance = np.einsum("ab,ij->iajb", give, np.eye(3))
    return surface_shear(
        points,
        np.asarray(pressing, dtype=float),
        np.asarray(wrench, dtype=float),
        tangential=tangential,
        friction=friction,
        compliance=compliance,
        middle=points.mean(axis=0),
        length=1e-3,
        **others,
    )


@pytest.mark.parametrize(("tangential", "bounded"), CHOICES)
def test_few_cells_carry_what_they_can(tangential, bounded):
    """One cell takes no torsion, a row of them does; cells in one place and next to none are no reason to fail."""
    friction = 2.0 if bounded else None
    single = run([[1e-3, 0.0]], [1.0], [0.5, 0.1, -1.0, 0.0, 1e-3, 1e-4], tangential, friction)
    np.testing.assert_allclose(single.forces, [[0.5, 0.1, -1.0]], atol=1e-9)
    row = np.column_stack([np.linspace(-1e-3, 1e-3, 5), np.zeros(5)])
    along = run(row, np.ones(5), [0.1, 0.2, -5.0, 0.0, 0.0, 1e-3], tangential, friction)
    np.testing.assert_allclose(carried(row, along.forces), [0.1, 0.2, -5.0, 0.0, 0.0, 1e-3], atol=1e-9)
    tiny = run([*row, [0.0, 1e-3]], [1, 1, 1, 1, 1, 1e-14], [0.1, 0.0, -5.0, 0.0, 0.0, 0.0], tangential, friction)
    assert np.isfinite(tiny.forces).all()
    np.testing.assert_allclose(tiny.forces.sum(axis=0), [0.1, 0.0, -5.0], atol=1e-9)


@pytest.mark.parametrize(("tangential", "bounded"), CHOICES)
def test_numbers_that_are_not_finite_are_refused(tangential, bounded):
    friction = 0.5 if bounded else None
    square = np.array([[0.0, 0.0], [1e-3, 0.0], [1e-3, 1e-3], [0.0, 1e-3]])
    whole = [0.1, 0.0, -4.0, 0.0, 0.0, 0.0]
    for pressing, wrench in [
        (np.ones(4), [math.nan, *whole[1:]]),
        (np.ones(4), [*whole[:5], math.inf]),
        ([1.0, math.nan, 1.0, 1.0], whole),
        (np.zeros(4), whole),
    ]:
        found = run(square, pressing, wrench, tangential, friction)
        assert found.refused
        assert not found.forces.any()


def test_without_friction_nothing_shears():
    square = np.array([[0.0, 0.0], [1e-3, 0.0], [1e-3, 1e-3], [0.0, 1e-3]])
    for tangential in ("proportional", "coulomb"):
        found = run(square, np.ones(4), [0.1, 0.0, -4.0, 0.0, 0.0, 0.0], tangential, 0.0)
        assert found.slides
        np.testing.assert_array_equal(found.forces[:, :2], 0.0)
        np.testing.assert_allclose(found.forces[:, 2], -1.0, rtol=1e-12)


def test_cells_out_of_reach_carry_nothing():
    row = np.column_stack([np.linspace(-1e-3, 1e-3, 5), [0.0, 1e-3, 0.0, 1e-3, 0.0]])
    heights = np.array([0.0, 0.0, 0.0, 0.0, math.inf])
    for tangential in ("stick", "coulomb"):
        pressing, wrench = [1, 1, 1, 1, 0], [0.2, 0, -4, -2e-3, -2e-3, 0]
        found = run(row, pressing, wrench, tangential, 0.5, heights=heights, tilting=False)
        assert not found.forces[4].any()
        np.testing.assert_allclose(found.forces.sum(axis=0), [0.2, 0.0, -4.0], atol=1e-9)


def test_a_turn_about_a_cell_slides_like_any_other():
    """The limit has a corner there: the cell under the turn's centre bears whatever balances the others."""
    row = np.column_stack([np.linspace(-2e-3, 2e-3, 5), np.zeros(5)])
    found = run(row, np.ones(5), [0.0, 0.05, -5.0, 0.0, 0.0, 1.0], "proportional", 0.5)
    assert found.slides
    force = carried(row, found.forces)
    assert force[5] == pytest.approx(0.5 * (2e-3 + 1e-3) * 2, rel=1e-6)
    assert force[1] == pytest.approx(0.05, rel=1e-3)
    assert (np.hypot(*found.forces[:, :2].T) <= 0.5 * (1 + 1e-9)).all()


def test_the_same_contact_gives_the_same_bits():
    case = random_case(7)
    assert case is not None
    problem, compliance, pressing, friction, wrench = case
    points = problem.cells.centroids

    def forces(tangential):
        return surface_shear(
            points,
            pressing,
            wrench,
            tangential=tangential,
            friction=friction,
            compliance=compliance,
            heights=problem.gaps,
            middle=points.mean(axis=0),
            length=1e-3,
        ).forces

    first = {tangential: forces(tangential) for tangential in ("coulomb", "stick", "proportional")}
    for tangential in ("proportional", "stick", "coulomb", "stick"):
        np.testing.assert_array_equal(forces(tangential), first[tangential])
