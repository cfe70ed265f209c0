"""Footprints from gap functions: what is covered, where it touches first, and what is refused."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from shapely import Point, Polygon, box

from mjtactile.contact.footprint import FACING_GAP, REACH, Footprint
from mjtactile.errors import FootprintError
from mjtactile.fidelity import Fidelity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad
from mjtactile.pad_shape.surfaces import SphereCap

INFLUENCE = InfluenceMatrices(Pad(), Fidelity(mesh="draft"), {})
CURVED = InfluenceMatrices(Pad(surface=SphereCap(20e-3)), Fidelity(mesh="draft"), {})
RADIUS = 6e-3


def sphere(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return ((x - 1e-3) ** 2 + (y + 2e-3) ** 2) / (2 * RADIUS)


def test_sphere_covers_what_is_within_reach():
    footprint = Footprint.from_gap(sphere, INFLUENCE.surface)
    reach = REACH * Pad().thickness
    radius = math.sqrt(2 * RADIUS * reach)
    assert footprint.reach == pytest.approx(reach)
    assert footprint.area == pytest.approx(math.pi * radius**2, rel=2e-3)
    assert footprint.lowest == pytest.approx(0.0, abs=1e-14)
    assert footprint.centroid == pytest.approx((1e-3, -2e-3), abs=2e-6)


@pytest.mark.parametrize("lift", [-0.01, 0.0, 123.0])
def test_only_differences_of_height_matter(lift):
    there = Footprint.from_gap(lambda x, y: sphere(x, y) + lift, INFLUENCE.surface)
    here = Footprint.from_gap(sphere, INFLUENCE.surface)
    points = np.array([[1e-3, -2e-3], [2e-3, 0.0], [7e-3, 7e-3]])
    np.testing.assert_allclose(there.heights(points), here.heights(points), atol=1e-12)
    assert there.area == pytest.approx(here.area, rel=1e-6)


def test_heights_out_of_reach_are_infinite():
    footprint = Footprint.from_gap(sphere, INFLUENCE.surface)
    heights = footprint.heights(np.array([[1e-3, -2e-3], [-7e-3, 7e-3]]))
    assert heights.shape == (2,)
    assert heights[0] == pytest.approx(0.0, abs=1e-12)
    assert heights[1] == np.inf


def test_flat_face_has_no_height_and_faces_itself():
    footprint = Footprint.from_outline(box(0, 0, 1e-3, 1e-3), INFLUENCE.surface)
    np.testing.assert_array_equal(footprint.heights(np.zeros((4, 2))), 0.0)
    assert footprint.lowest_part is footprint


def test_curved_body_faces_the_pad_with_its_lowest_part():
    lowest = Footprint.from_gap(sphere, INFLUENCE.surface).lowest_part
    assert lowest.gap is None
    assert lowest.area == pytest.approx(math.pi * 2 * RADIUS * FACING_GAP, rel=5e-3)


def test_outline_limits_the_body_and_its_lowest_point():
    """A tilted face: the lowest point is on the outline's edge, and what is lower beyond it does not count."""
    face = Point(1e-3, 0).buffer(2e-3, quad_segs=64)
    footprint = Footprint.from_gap(lambda x, y: 0.1 * (x + y), INFLUENCE.surface, outline=face)
    assert footprint.outline.equals(face)
    assert footprint.lowest == pytest.approx(0.1 * (1e-3 - 2e-3 * math.sqrt(2)), abs=1e-7)
    edge = 2e-3 / math.sqrt(2)
    assert footprint.centroid == pytest.approx((1e-3 - edge, -edge), abs=0.1e-3)


def test_body_over_the_edge_touches_where_there_is_a_sheet():
    footprint = Footprint.from_gap(lambda x, y: ((x - 9e-3) ** 2 + y**2) / (2 * RADIUS), INFLUENCE.surface)
    assert footprint.outline.bounds[2] == pytest.approx(7.5e-3)
    assert footprint.lowest == pytest.approx((1.5e-3) ** 2 / (2 * RADIUS), rel=1e-6)


def test_small_body_is_found_with_its_outline():
    tip = Point(0.123e-3, 0.077e-3).buffer(20e-6)
    footprint = Footprint.from_gap(lambda x, y: np.zeros_like(x), INFLUENCE.surface, outline=tip)
    assert footprint.area == pytest.approx(tip.area)


def where_far(bad: float):
    return lambda x, y: np.where(x > 2e-3, bad, 0.0)


@pytest.mark.parametrize(
    ("gap", "message"),
    [
        (where_far(math.nan), r"is nan at x = .* m, y = .* m\. Heights are finite"),
        (where_far(-math.inf), r"is -inf at x"),
        (lambda x, y: np.full_like(x, np.inf), "infinite over the whole sheet: .*Shift it"),
        (lambda x, y: 0.0, r"shape \(\) for points of shape \(\d+,\).*one height per point"),
        (lambda x, y: np.zeros((len(x), 1)), r"shape \(\d+, 1\) for points"),
        (lambda x, y: np.zeros(3), r"shape \(3,\) for points"),
        (lambda x, y: np.zeros(len(x), dtype=complex), "heights that are no real numbers"),
        (lambda x, y: ["0"] * len(x), "heights that are no real numbers"),
        (None, "gap is of type NoneType; expected a function of arrays x and y"),
        (0.0, "gap is of type float; expected a function"),
    ],
    ids=[
        *("nan", "minus infinity", "nothing there", "a number", "a column", "too few", "complex", "text"),
        *("no function", "a height"),
    ],
)
def test_bad_gap_functions_are_refused_with_the_cure(gap, message):
    with pytest.raises(FootprintError, match=message):
        Footprint.from_gap(gap, INFLUENCE.surface)


@pytest.mark.parametrize(
    ("lowest", "message"),
    [
        (1.0, "lowest = 1.0; expected the gap function's least height"),
        (5e-5, "lowest = 5e-05; expected the gap"),
        (math.nan, "lowest = nan; expected the gap"),
        (-math.inf, "lowest = -inf; expected the gap"),
        ("0", "lowest = '0'; expected the gap"),
        (-1.0, "or, if lowest=... is below the body, leave that out"),
    ],
)
def test_a_lowest_point_that_is_none_is_refused(lowest, message):
    with pytest.raises(FootprintError, match=message):
        Footprint.from_gap(sphere, INFLUENCE.surface, lowest=lowest)


def test_the_lowest_point_that_is_found_may_be_given():
    found = Footprint.from_gap(sphere, INFLUENCE.surface)
    given = Footprint.from_gap(sphere, INFLUENCE.surface, lowest=found.lowest)
    assert given.outline.equals(found.outline)


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (box(1.0, 1.0, 2.0, 2.0), "covers none of the pad"),
        (Polygon([(0, 0), (1e-3, 1e-3), (1e-3, 0), (0, 1e-3)]), "not a valid area"),
        (Point(0, 0), "expected a shapely Polygon"),
    ],
    ids=["off the sheet", "self-crossing", "a point"],
)
def test_bad_outlines_are_refused_with_a_gap_too(outline, message):
    with pytest.raises(FootprintError, match=message):
        Footprint.from_gap(sphere, INFLUENCE.surface, outline=outline)


@pytest.mark.parametrize("surface", [INFLUENCE.surface, CURVED.surface], ids=["flat", "curved"])
def test_a_height_is_a_function(surface):
    with pytest.raises(FootprintError, match="height is of type int; expected a function of arrays x and y"):
        Footprint.from_height(3, surface)  # type: ignore[arg-type]


@pytest.mark.parametrize("make", [Footprint.from_gap, Footprint.from_height])
def test_a_wrong_surface_is_refused_with_an_outline_too(make):
    with pytest.raises(FootprintError, match="surface is of type str; expected a"):
        make(sphere, "wrong", outline=box(0, 0, 1e-3, 1e-3))


@pytest.mark.parametrize("influence", [INFLUENCE, CURVED], ids=["flat", "curved"])
@pytest.mark.parametrize("make", [Footprint.from_gap, Footprint.from_height, None])
def test_a_footprint_can_be_pickled_if_its_function_can(make, influence):
    face = box(0, 0, 2e-3, 3e-3)
    made = make(sphere, influence.surface) if make else Footprint.from_outline(face, influence.surface)
    stored = pickle.loads(pickle.dumps(made))
    points = np.array([[1e-3, -2e-3], [2e-3, 1e-3], [7e-3, 7e-3]])
    assert stored.outline.equals(made.outline)
    np.testing.assert_array_equal(stored.heights(points), made.heights(points))
