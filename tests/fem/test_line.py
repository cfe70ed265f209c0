"""Quadratic elements on a line: matrices against integrals of polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from mjtactile.fem.line import Line, quadratic_shapes

LINE = Line(np.array([-2.0, -1.5, 0.0, 0.3, 1.0]))
WEIGHT = np.array([1.0, 3.0, 0.5, 2.0])
U, V = Polynomial([0.3, -1.2, 0.7]), Polynomial([1.0, 0.4, -0.9])


def integral(integrand: Polynomial, weight: np.ndarray | None = None) -> float:
    antiderivative = integrand.integ()
    shares = antiderivative(LINE.vertices[1:]) - antiderivative(LINE.vertices[:-1])
    return float(shares @ (np.ones(LINE.element_count) if weight is None else weight))


def test_nodes_are_ends_and_middles():
    np.testing.assert_allclose(LINE.nodes, [-2, -1.75, -1.5, -0.75, 0, 0.15, 0.3, 0.65, 1], atol=1e-15)
    assert LINE.node_count == 9
    assert LINE.element_count == 4


@pytest.mark.parametrize("weight", [None, WEIGHT], ids=["plain", "weighted"])
@pytest.mark.parametrize(
    ("matrix", "trial", "test"),
    [("mass", U, V), ("stiffness", U.deriv(), V.deriv()), ("gradient", U.deriv(), V)],
)
def test_matrices_integrate_quadratics_exactly(matrix, trial, test, weight):
    assembled = getattr(LINE, matrix)(weight)
    value = V(LINE.nodes) @ (assembled @ U(LINE.nodes))
    assert value == pytest.approx(integral(trial * test, weight), rel=1e-13)  # rounding


@pytest.mark.parametrize("order", [0, 1])
def test_legendre_moments_of_quadratics_are_exact(order):
    values, slopes = LINE.legendre_moments(order)
    for moments, function in ((values, U), (slopes, U.deriv())):
        for element, moment in enumerate(moments @ U(LINE.nodes)):
            start, end = LINE.vertices[element], LINE.vertices[element + 1]
            legendre = Polynomial([-(start + end), 2.0]) / (end - start) if order else Polynomial([1.0])
            antiderivative = (legendre * function).integ()
            assert moment == pytest.approx(antiderivative(end) - antiderivative(start), rel=1e-12, abs=1e-14)


def test_shapes_are_one_at_their_node_and_sum_to_one():
    values, slopes = quadratic_shapes(np.array([-1.0, 0.0, 1.0]))
    np.testing.assert_array_equal(values, np.eye(3))
    np.testing.assert_allclose(quadratic_shapes(np.linspace(-1, 1, 7))[0].sum(axis=1), 1, rtol=1e-15)
    np.testing.assert_allclose(slopes.sum(axis=1), 0, atol=1e-15)
    np.testing.assert_allclose(slopes @ [1.0, 0.0, 1.0], [-2, 0, 2])  # of the square


def test_positions_are_found_in_their_element():
    element, local = LINE.locate(np.array([-2.0, -1.75, -1.5, 0.1, 1.0]))
    np.testing.assert_array_equal(element, [0, 0, 1, 2, 3])
    np.testing.assert_allclose(local, [-1, 0, -1, -1 / 3, 1], atol=1e-15)


def test_positions_past_the_ends_belong_to_the_end_elements():
    element, local = LINE.locate(np.array([-3.0, 1.0 + 1e-12]))
    np.testing.assert_array_equal(element, [0, 3])
    np.testing.assert_array_equal(local, [-1, 1])
