"""Springs: linear pressure on a flat face, nothing pulls, and no search is left unfinished."""

from __future__ import annotations

import numpy as np
import pytest
from test_complementarity import EXACT, Problem, random_problem, residual

from mjtactile.winkler import winkler_contact


def springs(problem: Problem, seed: int) -> Problem:
    stiffness = np.random.default_rng(seed).uniform(0.5, 2.0, len(problem.gaps)) * problem.cells.areas * 1e9
    return problem._replace(compliance=np.diag(1.0 / stiffness))


@pytest.mark.parametrize("seed", range(0, 200, 40))
def test_conditions_hold_on_random_problems(seed):
    for each in range(seed, seed + 40):
        problem = springs(random_problem(each), each)
        contact = winkler_contact(1.0 / np.diagonal(problem.compliance), *problem[1:4])
        assert residual(problem, contact) <= EXACT, each


@pytest.mark.parametrize("through", [(0.0, 0.0), (0.1, -0.05)], ids=str)
def test_pressure_under_a_flat_face_is_linear(through):
    """p = P/A + (moments) as in law "uniform": a rectangle a x b has p = P/A (1 + 12 x x0 / a^2 + 12 y y0 / b^2)."""
    x, y = (one.ravel() for one in np.meshgrid((np.arange(40) - 19.5) / 40, (np.arange(30) - 14.5) / 40))
    modes = np.column_stack([np.ones(len(x)), x, y])
    contact = winkler_contact(np.full(len(x), 3.0), modes, np.zeros(len(x)), 5.0 * np.array([1.0, *through]))
    spread = (x**2).mean(), (y**2).mean()
    expected = 5.0 / len(x) * (1 + x * through[0] / spread[0] + y * through[1] / spread[1])
    np.testing.assert_allclose(contact.forces, expected, rtol=1e-10)
    np.testing.assert_allclose(contact.forces, 3.0 * (modes @ contact.motion), rtol=1e-10)
    assert contact.pressed.all()


def test_force_beyond_the_core_lifts_the_far_side():
    """Outside the middle third the pressure is a triangle three times as long as the force is from the edge."""
    x = (np.arange(1000) - 499.5) / 1000
    modes = np.column_stack([np.ones(len(x)), x])
    contact = winkler_contact(np.ones(len(x)), modes, np.zeros(len(x)), np.array([1.0, 0.4]))
    assert contact.pressed.mean() == pytest.approx(0.3, abs=0.002)
    assert contact.forces.max() == pytest.approx(2 / 300, rel=0.01)


def test_one_spring_carries_a_force():
    contact = winkler_contact(np.array([4.0]), np.ones((1, 1)), np.array([7.0]), np.array([2.0]))
    assert contact.motion[0] == pytest.approx(7.5)
    assert contact.forces[0] == pytest.approx(2.0)
