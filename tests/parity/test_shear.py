"""Shear in the compiled core: never a contact without an answer."""

import math
from typing import NamedTuple

import laws_on_cells
import numpy as np
import pytest
from core_calls import surface_shear
from core_cells import FaceCells, face_cells
from half_space import HalfSpaceIntegrals, half_space_compliance
from shapely import Polygon

#: What forces may miss of a wrench, over its size.
CARRIED = 1e-9
KINDS = ("flat", "round", "rough", "ridge")


class Problem(NamedTuple):
    """Random cells under a rigid body."""

    cells: FaceCells
    compliance: np.ndarray
    gaps: np.ndarray
    pressing: np.ndarray
    tilting: bool


def random_problem(seed: int) -> Problem | None:
    """A random outline, gap function, force and centre of pressure, on a half space; None where nothing presses."""
    random = np.random.default_rng(seed)
    angles = np.sort(np.concatenate([random.uniform(0, 2 * math.pi, random.integers(3, 11)), [0.0, 2.1, 4.2]]))
    radii = random.uniform(0.4, 1.0, len(angles)) * 10 ** random.uniform(-4, -2)
    outline = Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])).buffer(0.0)
    cells = face_cells(outline, int(random.integers(4, 90)))
    if cells is None:
        return None
    poisson, force = random.choice([0.05, 0.3, 0.4, 0.49]), 10.0 ** random.uniform(-9, 3)
    places = (cells.centroids - cells.centroids.mean(axis=0)) / cells.length
    heights = {
        "flat": np.zeros(cells.count),
        "round": (places**2).sum(axis=1),
        "rough": random.uniform(0, 1, cells.count),
        "ridge": np.abs(places @ random.normal(size=2)),
    }[KINDS[seed % len(KINDS)]]
    gaps = heights * 10.0 ** random.uniform(-2, 2) * force * 1e-7 / cells.length
    tilting = bool(random.uniform() < 0.7 and cells.count > 3)
    modes = np.column_stack([np.ones(cells.count), places])[:, : 3 if tilting else 1]
    weights = random.uniform(0, 1, cells.count) ** random.choice([1, 20, 200])
    resultants = force * (modes.T @ (weights / weights.sum()))
    integrals = HalfSpaceIntegrals(cells.edges, cells.sides)
    compliance = half_space_compliance(1e-7, poisson, integrals, cells.areas)
    try:
        pressing = laws_on_cells.pressing(compliance[2, :, 2], modes, gaps, resultants)
    except ArithmeticError:
        return None
    return Problem(cells, compliance, gaps, pressing, tilting)


def carried(centroids, forces):
    """Force and moment about the pad's origin of forces on cells, (6,) [N, N m]."""
    points = np.column_stack([centroids, np.zeros(len(centroids))])
    return np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


CHOICES = [("proportional", True), ("stick", False), ("stick", True), ("coulomb", True)]


def random_case(seed):
    """Random cells, pressing and a wrench at, inside or beyond the limit; None where nothing presses."""
    random, problem = np.random.default_rng(seed), random_problem(seed)
    if problem is None:
        return None
    pressing, points, length = problem.pressing, problem.cells.centroids, problem.cells.length
    friction = 10 ** random.uniform(-2, 0.7)
    centre = pressing @ points / pressing.sum()
    direction = random.normal(size=3) * random.choice([[1.0, 1.0, 1.0], [1e-6, 1e-6, 1.0], [1.0, 1.0, 0.0]])
    shares = [0.0, 1e-9, 0.3, 0.9, 0.99, 0.9999, 1 - 1e-6, 1.0, 1 + 1e-9, 1 + 1e-6, 1.01, 2.0, 1e3, 1e9]
    # All cells slide by one rigid motion.
    x, y = (points - centre).T / length
    motion = np.stack([direction[0] - y * direction[2], direction[1] + x * direction[2]])
    sliding = friction * pressing * motion / np.maximum(np.hypot(*motion), np.finfo(float).tiny)
    shear = random.choice(shares) * np.array([*sliding.sum(axis=1), x @ sliding[1] - y @ sliding[0]])
    torsion = shear[2] * length + centre[0] * shear[1] - centre[1] * shear[0]
    return problem, friction, np.array([*shear[:2], -pressing.sum(), 0.0, 0.0, torsion])


def sheared(problem, pressing, wrench, tangential, friction):
    """What the core finds for a random problem, pressed with given forces (cells,) [N]."""
    points = problem.cells.centroids
    return surface_shear(
        points,
        pressing,
        wrench,
        tangential=tangential,
        friction=friction,
        compliance=problem.compliance,
        heights=problem.gaps,
        middle=points.mean(axis=0),
        length=problem.cells.length,
        tilting=problem.tilting,
    )


@pytest.mark.parametrize("seeds", [range(start, start + 25) for start in range(0, 100, 25)], ids=str)
@pytest.mark.parametrize(("tangential", "bounded"), CHOICES)
def test_every_contact_gets_shear_that_carries_the_wrench(tangential, bounded, seeds):
    """Finite, within friction where it is bounded, and the whole wrench unless it slides."""
    for case in map(random_case, seeds):
        if case is None:
            continue
        problem, friction, wrench = case
        pressing, points, length = problem.pressing, problem.cells.centroids, problem.cells.length
        force = pressing.sum()
        found = sheared(problem, pressing, wrench, tangential, friction if bounded else None)
        assert np.isfinite(found.forces).all()
        assert not found.refused
        pressed = np.column_stack([np.zeros_like(points), -pressing])
        missed = carried(points - points.mean(axis=0), found.forces) - carried(points - points.mean(axis=0), pressed)
        wanted = wrench[5] - (points[:, 0].mean() * wrench[1] - points[:, 1].mean() * wrench[0])
        missed -= [wrench[0], wrench[1], 0.0, 0.0, 0.0, wanted]
        missed[3:] /= length
        size = max(force, *np.abs(wrench[:2]), abs(wanted) / length)
        assert abs(missed[2]) <= CARRIED * force
        if problem.tilting:
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
    problem, friction, wrench = case

    def forces(tangential):
        return sheared(problem, problem.pressing, wrench, tangential, friction).forces

    first = {tangential: forces(tangential) for tangential in ("coulomb", "stick", "proportional")}
    for tangential in ("proportional", "stick", "coulomb", "stick"):
        np.testing.assert_array_equal(forces(tangential), first[tangential])


@pytest.mark.parametrize(("tangential", "bounded"), CHOICES)
def test_a_cell_that_only_touches_makes_no_difference(tangential, bounded):
    """Rounding decides whether it presses."""
    for seed in range(60):
        case = random_case(seed)
        if case is None:
            continue
        problem, friction, wrench = case
        touching = np.where(problem.pressing == 0.0, 1e-16 * problem.pressing.max(), problem.pressing)
        one, other = (
            sheared(problem, pressing, wrench, tangential, friction if bounded else None).forces
            for pressing in (problem.pressing, touching)
        )
        np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-9 * np.abs(one).max(), err_msg=f"seed {seed}")
