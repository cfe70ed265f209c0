"""Contact as a quadratic programme: its conditions hold on random problems, and a reference solver agrees."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from shapely import Polygon

from mjtactile.cells import Cells
from mjtactile.complementarity import bonded_contact, rigid_contact
from mjtactile.compliance import SurfaceCompliance
from mjtactile.partition import outline_cells
from mjtactile.rigid import RigidContact

#: What a condition may be off, over the largest force or displacement.
EXACT = 1e-8
SURFACE = SurfaceCompliance(1e-7, 0.4, np.zeros((3, 1, 3, 1)), (np.array([-1.0, 1.0]), np.array([-1.0, 1.0])))
KINDS = ("flat", "round", "rough", "ridge")


class Problem(NamedTuple):
    """Arguments of rigid_contact, and the cells they were made from."""

    compliance: np.ndarray
    modes: np.ndarray
    gaps: np.ndarray
    resultants: np.ndarray
    cells: Cells


def random_problem(seed: int, count: int | None = None) -> Problem:
    """A random outline, gap map, force and centre of pressure, in the hull's middle or close to its edge."""
    random = np.random.default_rng(seed)
    corners = random.integers(3, 11)
    angles = np.sort(random.uniform(0, 2 * math.pi, corners))
    angles = np.concatenate([angles, [0.0, 2.1, 4.2]])
    angles.sort()
    radii = random.uniform(0.4, 1.0, len(angles)) * 10 ** random.uniform(-4, -2)
    outline = Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])).buffer(0.0)
    cells = outline_cells(outline, int(random.integers(4, 90)) if count is None else count)
    places = (cells.centroids - cells.centroids.mean(axis=0)) / math.sqrt(outline.area)
    force = 10.0 ** random.uniform(-9, 3)
    kind = KINDS[seed % len(KINDS)]
    depth = 10.0 ** random.uniform(-2, 2) * force * 1e-7 / math.sqrt(outline.area)
    heights = {
        "flat": np.zeros(cells.count),
        "round": (places**2).sum(axis=1),
        "rough": random.uniform(0, 1, cells.count),
        "ridge": np.abs(places @ random.normal(size=2)),
    }[kind]
    modes = np.ones((cells.count, 1))
    resultants = np.array([force])
    if random.uniform() < 0.7 and cells.count > 3:
        modes = np.column_stack([modes, places])
        weights = random.uniform(0, 1, cells.count) ** random.choice([1, 20, 200])
        resultants = force * (modes.T @ (weights / weights.sum()))
    return Problem(SURFACE.normal(cells), modes, depth * heights, resultants, cells)


def residual(problem: Problem, contact: RigidContact) -> float:
    """Largest violation of the conditions: forces and separations >= 0, one of them 0, resultants as given."""
    compliance, modes, gaps, resultants, _ = problem
    forces = contact.forces[-len(gaps) :]
    separation = compliance @ forces - modes @ contact.motion + gaps
    force, length = np.abs(forces).max(), np.abs(compliance @ forces).max()
    return max(
        float(-forces.min() / force),
        float(-separation.min() / length),
        float(np.minimum(forces / force, np.abs(separation) / length).max()),
        float(np.abs(modes.T @ forces - resultants).max() / resultants[0]),
    )


@pytest.mark.parametrize("seed", range(0, 400, 40))
def test_conditions_hold_on_random_problems(seed):
    for each in range(seed, seed + 40):
        problem = random_problem(each)
        contact = rigid_contact(*problem[:4])
        assert residual(problem, contact) <= EXACT, each
        np.testing.assert_array_equal(contact.pressed | (contact.forces == 0.0), True)


def reference(problem: Problem) -> np.ndarray:
    """Forces by non-negative least squares: |L F + L^-T g|^2 with L^T L = A; the resultants weigh heavily."""
    give, force = float(np.diagonal(problem.compliance).mean()), problem.resultants[0]
    upper = scipy.linalg.cholesky(problem.compliance / give)
    right = -scipy.linalg.solve_triangular(upper, problem.gaps / (give * force), trans=1)
    heavy = 1e5
    matrix = np.vstack([upper, heavy * problem.modes.T])
    return scipy.optimize.nnls(matrix, np.concatenate([right, heavy * problem.resultants / force]))[0] * force


@pytest.mark.parametrize("seed", range(24))
def test_forces_are_those_of_a_reference_solver(seed):
    problem = random_problem(1000 + seed, count=12)
    contact = rigid_contact(*problem[:4])
    np.testing.assert_allclose(contact.forces, reference(problem), atol=1e-5 * contact.forces.max())


@pytest.mark.parametrize("seed", range(12))
def test_where_the_search_starts_does_not_matter(seed):
    problem = random_problem(2000 + seed)
    cold = rigid_contact(*problem[:4])
    random = np.random.default_rng(seed)
    for start in (cold.pressed, ~cold.pressed, random.uniform(size=len(problem.gaps)) < 0.5):
        warm = rigid_contact(*problem[:4], start=start)
        np.testing.assert_allclose(warm.forces, cold.forces, atol=EXACT * cold.forces.max())
        np.testing.assert_allclose(
            problem.modes @ warm.motion, problem.modes @ cold.motion, rtol=1e-6, atol=EXACT * np.abs(cold.motion).max()
        )


def test_a_solution_is_a_map_of_its_resultants():
    problem = random_problem(1)._replace(gaps=np.zeros(len(random_problem(1).gaps)))
    contact = rigid_contact(*problem[:4])
    more = contact.under(2.5 * problem.resultants)
    assert more is not None
    direct = rigid_contact(problem.compliance, problem.modes, problem.gaps, 2.5 * problem.resultants)
    np.testing.assert_allclose(more.forces, direct.forces, atol=EXACT * direct.forces.max())
    np.testing.assert_allclose(more.motion, direct.motion, rtol=1e-7)


def test_other_cells_in_contact_are_noticed():
    compliance, modes, gaps, resultants, _ = random_problem(5, count=60)
    modes, resultants = modes[:, :1], resultants[:1]
    contact = rigid_contact(compliance, modes, gaps * (resultants[0] * 1e-7 / gaps.max() / 1e-5), resultants)
    assert contact.pressed.sum() < 20
    assert contact.under(1e3 * resultants) is None


def test_centre_of_pressure_at_the_edge_lifts_the_far_side():
    cells = outline_cells(Polygon([(0, 0), (4e-3, 0), (4e-3, 4e-3), (0, 4e-3)]), 100)
    places = (cells.centroids - 2e-3) / 4e-3
    modes, force = np.column_stack([np.ones(cells.count), places]), 0.3
    problem = Problem(SURFACE.normal(cells), modes, np.zeros(cells.count), force * np.array([1, 0.46, 0]), cells)
    contact = rigid_contact(*problem[:4])
    assert residual(problem, contact) <= EXACT
    assert not contact.pressed[places[:, 0] < 0.0].any()
    assert contact.separation[places[:, 0] < -0.4].min() > 0.0


@pytest.mark.parametrize("seed", range(8))
def test_bonded_cells_move_with_the_body(seed):
    problem = random_problem(3000 + seed, count=25)
    cells, count = problem.cells, len(problem.gaps)
    downward = np.array([1.0, 1.0, -1.0])
    full = SURFACE.full(cells) * downward[:, None, None, None] * downward[:, None]
    modes = np.zeros((3, count, problem.modes.shape[1] + 2))
    modes[2, :, :-2] = problem.modes
    modes[0, :, -2] = modes[1, :, -1] = 1.0
    resultants = np.append(problem.resultants, problem.resultants[0] * np.array([0.1, -0.05]))
    gaps = np.zeros(count)  # a flat face
    contact = bonded_contact(full, modes, gaps, resultants)
    forces = contact.forces.reshape(3, count)
    moved = np.einsum("iajb,jb->ia", full, forces)
    rigid = modes @ contact.motion
    scale = np.abs(moved).max()
    np.testing.assert_allclose(moved[:, contact.pressed], rigid[:, contact.pressed], atol=EXACT * scale)
    assert forces[2].min() >= -EXACT * forces[2].max()
    assert (moved - rigid)[2].min() >= -EXACT * scale
    np.testing.assert_allclose(np.einsum("iam,ia->m", modes, forces), resultants, atol=EXACT * np.abs(resultants).max())
