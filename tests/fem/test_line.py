"""Quadratic elements on a line: nodes, shape functions, and where positions are."""

from __future__ import annotations

import numpy as np

from mjtactile.fem.line import Line, quadratic_shapes

LINE = Line(np.array([-2.0, -1.5, 0.0, 0.3, 1.0]))


def test_nodes_are_ends_and_middles():
    np.testing.assert_allclose(LINE.nodes, [-2, -1.75, -1.5, -0.75, 0, 0.15, 0.3, 0.65, 1], atol=1e-15)
    assert LINE.node_count == 9
    assert LINE.element_count == 4


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
