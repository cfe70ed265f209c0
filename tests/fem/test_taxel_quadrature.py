"""Where readings are taken: cubature of balls, cut by faces and interfaces."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import gamma

from mjtactile.fem.symmetry import BOTH, fold_points
from mjtactile.fem.taxel_quadrature import Sampling, _ball_rule, _taxel_rule, layer_sampling
from mjtactile.pad import Layer, Pad, TaxelGrid

WHOLE = (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)
COUNTS = [1, 2, 3, 4, 5]


def ball_moment(powers: tuple[int, ...], halved: tuple[bool, ...]) -> float:
    """Integral of x^a y^b z^c over the unit ball, or the part of it where the halved coordinates are positive.

    Integral over the sphere 2 G(a) G(b) G(c) / Gamma((a + b + c + 3) / 2), with G(a) = Gamma((a + 1) / 2) (Folland, How
    to integrate a polynomial over a sphere, Am. Math. Monthly 108 (2001) 446), times that over the radius.
    """
    if any(power % 2 and not half for power, half in zip(powers, halved, strict=True)):
        return 0.0
    total = sum(powers)
    on_sphere = 2 * math.prod(gamma((p + 1) / 2) for p in powers) / gamma((total + 3) / 2)
    return on_sphere / (total + 3) / 2 ** sum(halved)


def powers_up_to(degree: int) -> list[tuple[int, ...]]:
    return [p for p in itertools.product(range(degree + 1), repeat=3) if sum(p) <= degree]


def rule_moment(rule: tuple[np.ndarray, np.ndarray], powers: tuple[int, ...]) -> float:
    points, weights = rule
    return float(weights @ np.prod(points**powers, axis=1))


HALVES = [h for h in itertools.product([False, True], repeat=3) if sum(h) <= 1]
QUARTERS = [h for h in itertools.product([False, True], repeat=3) if sum(h) > 1]


@pytest.mark.parametrize("halved", HALVES, ids=str)
@pytest.mark.parametrize("count", COUNTS)
def test_moments_of_balls_and_their_halves_are_exact(count, halved):
    low = [0.0 if half else -1.0 for half in halved]
    rule = _ball_rule(count, (*low, 1.0, 1.0, 1.0))
    for powers in powers_up_to(2 * count - 1):
        # Rounding, through 96-point auxiliary rules.
        assert rule_moment(rule, powers) == pytest.approx(ball_moment(powers, halved), abs=1e-12), powers


@pytest.mark.parametrize("halved", QUARTERS, ids=str)
@pytest.mark.parametrize("count", COUNTS)
def test_moments_of_quarter_and_eighth_balls_are_nearly_exact(count, halved):
    low = [0.0 if half else -1.0 for half in halved]
    rule = _ball_rule(count, (*low, 1.0, 1.0, 1.0))
    for powers in powers_up_to(2 * count - 1):
        expected = ball_moment(powers, halved)
        even = all(power % 2 == 0 for power in powers)
        # Even moments to rounding; odd ones hold roots: 8.4 % of a moment was seen with one point per axis.
        tolerance = 1e-12 if even or expected == 0 else {1: 0.09, 2: 0.045}.get(count, 0.025) * abs(expected)
        assert rule_moment(rule, powers) == pytest.approx(expected, abs=tolerance), powers


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("box", [(-0.3, -1, -1, 1, 1, 1), (-0.3, -0.3, -1, 1, 1, 1), (0, 0, -0.5, 1, 1, 0.2)], ids=str)
def test_diagonal_mirror_maps_rules_onto_rules(count, box):
    points, weights = _ball_rule(count, box)
    swapped, swapped_weights = _ball_rule(count, tuple(box[i] for i in (1, 0, 2, 4, 3, 5)))
    swapped = swapped[:, [1, 0, 2]]
    order, other = np.lexsort(points.round(9).T), np.lexsort(swapped.round(9).T)
    np.testing.assert_allclose(points[order], swapped[other], atol=1e-12)
    np.testing.assert_allclose(weights[order], swapped_weights[other], atol=1e-12)


@pytest.mark.parametrize("count", COUNTS)
def test_one_degree_more_is_not_exact(count):
    """So the test above would notice a rule of fewer points."""
    rule = _ball_rule(count, WHOLE)
    assert rule_moment(rule, (2 * count, 0, 0)) != pytest.approx(ball_moment((2 * count, 0, 0), (False,) * 3), rel=1e-3)


def test_two_points_per_axis_on_a_whole_ball_are_corners_of_a_cube():
    points, weights = _ball_rule(2, WHOLE)
    corner = math.sqrt(1 / 5)  # radius sqrt(3/5)
    expected = np.array(list(itertools.product([-corner, corner], repeat=3)))
    np.testing.assert_allclose(sorted(map(tuple, points.round(12))), sorted(map(tuple, expected.round(12))), atol=1e-11)
    np.testing.assert_allclose(weights, math.pi / 6, rtol=1e-12)


@pytest.mark.parametrize("count", [2, 3])
def test_rules_of_opposite_halves_are_mirror_images(count):
    for axis in range(3):
        low, high = np.array(WHOLE[:3]), np.array(WHOLE[3:])
        low[axis] = -0.3
        points, weights = _ball_rule(count, (*low, *high))
        low, high = np.array(WHOLE[:3]), np.array(WHOLE[3:])
        high[axis] = 0.3
        mirrored, mirrored_weights = _ball_rule(count, (*low, *high))
        points = points * np.where(np.arange(3) == axis, -1, 1)
        order, other = np.lexsort(points.round(9).T), np.lexsort(mirrored.round(9).T)
        np.testing.assert_allclose(points[order], mirrored[other], atol=1e-10)
        np.testing.assert_allclose(weights[order], mirrored_weights[other], atol=1e-10)


def brute_force(box: tuple[float, ...], powers: tuple[int, ...], steps: int = 160) -> float:
    """Midpoint sums over thin columns, each cut exactly along z."""
    sides = [np.linspace(low, high, steps + 1) for low, high in zip(box[:2], box[3:5], strict=True)]
    x, y = np.meshgrid(*((side[1:] + side[:-1]) / 2 for side in sides))
    cell = math.prod(side[1] - side[0] for side in sides)
    height = np.sqrt(np.clip(1 - x**2 - y**2, 0, None))
    low, high = np.maximum(-height, box[2]), np.minimum(height, box[5])
    power = powers[2] + 1
    columns = np.where(high > low, (high**power - low**power) / power, 0.0)
    return float((x ** powers[0] * y ** powers[1] * columns).sum() * cell)


bounds = st.floats(0.1, 1.0)


@settings(max_examples=25, deadline=None)
@given(low=st.tuples(bounds, bounds, bounds), high=st.tuples(bounds, bounds, bounds), count=st.sampled_from([2, 3]))
def test_balls_cut_off_centre_have_their_volume_and_centroid(low, high, count):
    box = (*(-v for v in low), *high)
    rule = _ball_rule(count, box)
    # The brute force's steps, of the ball's volume.
    assert rule[1].sum() == pytest.approx(brute_force(box, (0, 0, 0)), abs=1e-3 * 4.19)
    for powers in [(1, 0, 0), (0, 1, 0), (0, 0, 1)]:
        # Slices of a ball cut along several axes are no polynomials. Of the ball's volume, the worst of 1,352 random
        # boxes was 1.7 % with two points per axis and 0.7 % with three.
        tolerance = {2: 0.025, 3: 0.01}[count]
        assert rule_moment(rule, powers) == pytest.approx(brute_force(box, powers), abs=tolerance * 4.19)
    points = rule[0]
    assert (np.linalg.norm(points, axis=1) < 1).all()
    assert ((points > np.array(box[:3])) & (points < np.array(box[3:]))).all()
    assert (rule[1] > 0).all()


def sample_points(sampling: Sampling, taxel: int) -> tuple[np.ndarray, np.ndarray]:
    """Unfolded points [m] of one taxel and their weights."""
    average = sampling.average
    entries = slice(average.indptr[taxel], average.indptr[taxel + 1])
    image, index = np.divmod(average.indices[entries], len(sampling.positions))
    signs = np.array([(*BOTH.images[q], 1) for q in image])
    return sampling.positions[index] * signs, average.data[entries]


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("layer", range(4))
def test_weights_of_a_reading_are_positive_and_sum_to_one(layer, count):
    average = layer_sampling(Pad(), layer, count).average
    assert len(average.indptr) == 169 + 1
    np.testing.assert_allclose(average.sum(axis=1), 1, rtol=1e-13)
    assert average.data.min() > 0


@pytest.mark.parametrize("count", [1, 2, 3])
def test_points_lie_in_their_taxels_ball_and_in_the_sheet(count):
    pad = Pad(taxels=TaxelGrid(rows=3, columns=4, pitch=(5e-3, 6e-3), centre=(0.0, 1.4e-3)), depths=(0.3e-3, 4.8e-3))
    for layer, depth in enumerate(pad.depths):
        sampling = layer_sampling(pad, layer, count)
        for taxel, (y, x) in enumerate(itertools.product(pad.grid.y, pad.grid.x)):
            points, weights = sample_points(sampling, taxel)
            # Balls that two sides cut have both orders of a rule.
            corner = 2 if abs(x) > 7e-3 and abs(y) > 7e-3 else 1
            assert len(weights) == corner * count**3
            assert (np.linalg.norm(points - (x, y, -depth), axis=1) < pad.sampling_radius).all()
            assert (np.abs(points[:, :2]) < np.array(pad.size) / 2).all()
            assert (points[:, 2] < 0).all()
            assert (points[:, 2] > -pad.thickness).all()


def test_centroid_of_clipped_balls_is_that_of_half_a_ball():
    """A taxel on the sheet's edge: the centroid of a half ball stands 3/8 of the radius inside."""
    sampling = layer_sampling(Pad(), 1, 2)
    inward = 3 / 8 * 0.625e-3
    points, weights = sample_points(sampling, 6 * 13)  # middle row, first column
    # Points are rounded to a billionth of the radius where they are folded.
    np.testing.assert_allclose(weights @ points, [-7.5e-3 + inward, 0, -2e-3], atol=1e-11)
    points, weights = sample_points(sampling, 12)  # first row, last column: a corner, a quarter ball
    # 3 um of 234 um were seen to be missing.
    np.testing.assert_allclose(weights @ points, [7.5e-3 - inward, -7.5e-3 + inward, -2e-3], atol=5e-6)


STACK = Pad(
    layers=tuple(Layer(thickness=t, young=e, poisson=0.4) for t, e in ((1e-3, 1e6), (0.2e-3, 5e6), (3.8e-3, 2e6))),
    depths=(1e-3, 3e-3),
)


def test_balls_are_cut_at_interfaces():
    """Each piece between interfaces has its own points, with its share of the volume."""
    radius = STACK.sampling_radius
    sampling = layer_sampling(STACK, 0, 2)
    points, weights = sample_points(sampling, 6 * 13 + 6)
    assert len(weights) == 3 * 8
    edges = np.array([radius, 0.0, -0.2e-3, -radius]) / radius  # from the ball's centre, 1 mm deep
    above = (2 + 3 * edges - edges**3) / 4  # share of the volume below a height
    shares = -np.diff(above)
    piece = np.digitize(-points[:, 2], [1e-3, 1.2e-3])
    np.testing.assert_allclose(np.bincount(piece, weights), shares, rtol=1e-9)
    # No interface within reach: one piece.
    assert len(sample_points(layer_sampling(STACK, 1, 2), 84)[1]) == 8


def test_an_interface_that_only_touches_the_ball_does_not_cut_it():
    pad = Pad(
        layers=tuple(Layer(thickness=t, young=1e6, poisson=0.4) for t in (1.625e-3, 3.375e-3)), depths=(1e-3, 2.25e-3)
    )
    for layer in (0, 1):
        assert len(sample_points(layer_sampling(pad, layer, 2), 84)[1]) == 8


def test_taxels_at_mirrored_places_have_mirrored_points():
    sampling = layer_sampling(Pad(), 0, 3)
    points, weights = sample_points(sampling, 2 * 13 + 0)
    image, image_weights = sample_points(sampling, 2 * 13 + 12)
    image = image * (-1, 1, 1)
    order, other = np.lexsort(points.round(10).T), np.lexsort(image.round(10).T)
    np.testing.assert_array_equal(points[order], image[other])
    np.testing.assert_allclose(weights[order], image_weights[other], rtol=1e-9)


def test_mirrored_taxels_share_their_folded_points():
    """13 x 13 mirrored taxels of 8 points: those of 7 x 7, where balls on a mirror have half of theirs."""
    inner = replace(Pad(), taxels=TaxelGrid(rows=11, columns=11))
    assert len(layer_sampling(inner, 1, 2).positions) == 5 * 5 * 8 + 2 * 5 * 4 + 2


@pytest.mark.parametrize("count", [1, 3])
def test_odd_rules_have_points_on_the_mirrors(count):
    sampling = layer_sampling(Pad(), 1, count)
    points, weights = sample_points(sampling, 6 * 13 + 6)
    assert len(weights) == count**3
    assert (points[:, 0] == 0).sum() == count**2
    assert weights.sum() == pytest.approx(1, rel=1e-13)


def test_folded_points_unfold_to_where_they_were():
    positions = np.array([[1, 2, -1], [-1, 2, -1], [1, -2, -1], [-1, -2, -1], [0, 3, -2], [-0.5, 0, -1]]) * 1e-3
    folded = fold_points(positions, 1e-12, BOTH)
    assert len(folded.positions) == 3
    signs = np.array([(*BOTH.images[q], 1) for q in folded.image])
    np.testing.assert_allclose(folded.positions[folded.index] * signs, positions, atol=1e-12)


def test_rule_scales_with_the_radius():
    pad = Pad()
    offsets, volumes = _taxel_rule(pad, np.array([0.0, 0.0, 2e-3]), 0.625e-3, 2)
    larger, larger_volumes = _taxel_rule(pad, np.array([0.0, 0.0, 2e-3]), 1.25e-3, 2)
    np.testing.assert_allclose(larger, 2 * offsets, rtol=1e-12)
    np.testing.assert_allclose(larger_volumes, 8 * volumes, rtol=1e-12)
    assert volumes.sum() == pytest.approx(4 / 3 * math.pi * pad.sampling_radius**3, rel=1e-12)
