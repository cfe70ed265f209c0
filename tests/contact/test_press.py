"""Contact cells that find where a body touches: anywhere, at any angle, under any force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import Point, affinity, box

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import ContactWarning
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad

RADIUS = 6e-3
#: The resultant is the wrench to this fraction of it.
CARRIED = 1e-9


def sphere_at(x0: float, y0: float, radius: float = RADIUS):
    return lambda x, y: ((x - x0) ** 2 + (y - y0) ** 2) / (2 * radius)


def ridge(turn: float, radius: float = 3e-3):
    return lambda x, y: (math.cos(turn) * y - math.sin(turn) * x) ** 2 / (2 * radius)


def pressed(influence: InfluenceMatrices, gap, force: float = 0.05, **options) -> SurfaceLoad:
    options = {"law": "elastic", "cells": 200, **options}
    return contact_load(influence, Footprint.from_gap(gap, influence.surface), (0.0, 0.0, -force), **options)


def assert_carried(load: SurfaceLoad, force: float) -> None:
    got = load.resultant()[0]
    np.testing.assert_allclose(got, [0.0, 0.0, -force], atol=CARRIED * force)
    assert np.linalg.norm(load.residual_force) <= CARRIED * force


@pytest.mark.parametrize("law", ["elastic", "foundation"])
def test_sphere_sinks_in_alike_wherever_it_is(default_influence, law):
    middle = pressed(default_influence, sphere_at(0.0, 0.0), law=law)
    for place in ((1.234e-3, -0.777e-3), (-3.1e-3, 2.9e-3), (0.0375e-3, 0.0)):
        there = pressed(default_influence, sphere_at(*place), law=law)
        assert_carried(there, 0.05)
        assert there.indentation == pytest.approx(middle.indentation, rel=0.01 if law == "elastic" else 0.03)
        assert there.contact_area == pytest.approx(middle.contact_area, rel=0.08)  # whole cells
        np.testing.assert_allclose([there.contact.centroid.x, there.contact.centroid.y], place, atol=0.03e-3)


@pytest.mark.parametrize("force", [1e-3, 0.1, 1.0])
@pytest.mark.filterwarnings("ignore:.*:mjtactile.errors.ContactWarning")
def test_sphere_under_any_force(default_influence, force):
    load = pressed(default_influence, sphere_at(1e-3, 2e-3), force)
    assert_carried(load, force)
    radius = hertz_radius(force)
    # The sheet is thin: the larger the contact, the less it gives.
    assert load.indentation == pytest.approx(radius**2 / RADIUS, rel=0.02 + 0.3 * radius / 1e-3)
    assert math.sqrt(load.contact_area / math.pi) == pytest.approx(radius, rel=0.05)


@pytest.mark.parametrize("force", [1e-9, 1e-6])
def test_the_least_forces_rest_on_one_cell(default_influence, force):
    """Narrower than a hundredth of the pad's depth, taxels do not tell cells apart; a square sinks in about as far."""
    load = pressed(default_influence, sphere_at(1e-3, 2e-3), force)
    assert_carried(load, force)
    assert load.indentation == pytest.approx(hertz_radius(force) ** 2 / RADIUS, rel=0.05)


def hertz_radius(force: float) -> float:
    """Of a ball's contact [m] (Johnson, Contact Mechanics, 1985, eq. 4.22)."""
    return (3 * force * RADIUS / (4 * 3e6 / (1 - 0.49**2))) ** (1 / 3)


@pytest.mark.parametrize("law", ["elastic", "foundation"])
@pytest.mark.filterwarnings("ignore:.*:mjtactile.errors.ContactWarning")
def test_forces_far_beyond_the_linear_range_are_carried(default_influence, law):
    assert_carried(pressed(default_influence, sphere_at(1e-3, 2e-3), 10.0, law=law), 10.0)


@pytest.mark.filterwarnings("ignore:the mean pressure:mjtactile.errors.ContactWarning")
def test_no_cell_bears_more_than_the_top_layers_modulus(default_influence):
    with pytest.warns(ContactWarning, match="more than its area can bear"):
        load = pressed(default_influence, sphere_at(1e-3, 2e-3), 1e3)
    assert 0.0 < -load.resultant()[0][2] <= 3e6 * default_influence.surface.sheet.area
    assert load.peak_pressure <= 3e6 * (1 + CARRIED)


@pytest.mark.parametrize("law", ["elastic", "foundation"])
def test_ridge_sinks_in_alike_at_any_angle(default_influence, law):
    """A cylinder on its side, short enough to stay on the sheet: no angle is special."""
    face = box(-3e-3, -1e-3, 3e-3, 1e-3)

    def at(turn: float) -> SurfaceLoad:
        outline = affinity.rotate(face, math.degrees(turn), origin=(0, 0))
        footprint = Footprint.from_gap(ridge(turn), default_influence.surface, outline=outline)
        return contact_load(default_influence, footprint, (0.0, 0.0, -0.05), law=law, cells=300)

    loads = [at(turn) for turn in (0.0, 0.3, math.pi / 4, 1.2, math.pi / 2, -0.9)]
    depths = [load.indentation for load in loads]
    np.testing.assert_allclose(depths, depths[0], rtol=0.02 if law == "elastic" else 0.06)
    areas = [load.contact_area for load in loads]
    np.testing.assert_allclose(areas, areas[0], rtol=0.2)  # whole cells, few across
    for load in loads:
        assert_carried(load, 0.05)


def test_free_body_tilts_until_its_moment_is_the_given_one(default_influence):
    footprint = Footprint.from_outline(box(-2e-3, -2e-3, 2e-3, 2e-3), default_influence.surface)
    force = np.array([0.0, 0.0, -0.1])
    moment = np.cross([0.4e-3, -0.2e-3, 0.0], force)
    load = contact_load(default_influence, footprint, force, moment=moment, law="elastic", cells=200)
    np.testing.assert_allclose(load.resultant()[1], moment, atol=CARRIED * 0.1 * 4e-3)
    # It goes down where the force is: about y by the force's x, about x by its y.
    assert load.tilts[1] > 0.0
    assert load.tilts[0] > 0.0
    np.testing.assert_allclose(load.tilts[1] / load.tilts[0], 2.0, rtol=0.02)


def test_fixed_body_keeps_its_orientation_and_answers_with_a_moment(default_influence):
    """Half over the rim: the free edge gives more, so the pressure's centre moves inward."""
    footprint = Footprint.from_outline(Point(5.5e-3, 0).buffer(3e-3), default_influence.surface)
    force = np.array([0.0, 0.0, -0.1])
    fixed = contact_load(default_influence, footprint, force, law="elastic", cells=200, tilt="fixed")
    free = contact_load(default_influence, footprint, force, law="elastic", cells=200)
    assert fixed.tilts == (0.0, 0.0)
    assert abs(free.tilts[1]) > 0.0
    through = fixed.resultant()[1][1] / 0.1
    assert through < footprint.centroid[0]
    np.testing.assert_allclose(fixed.residual_moment[:2], 0.0, atol=1e-15)  # none was asked for


def test_more_cells_change_little(default_influence):
    few, many = (pressed(default_influence, sphere_at(0.4e-3, 0.0), cells=cells) for cells in (100, 800))
    assert few.indentation == pytest.approx(many.indentation, rel=0.01)
    readings = [default_influence.readings(load) for load in (few, many)]
    assert np.linalg.norm(readings[0] - readings[1]) <= 0.01 * np.linalg.norm(readings[1])


@pytest.mark.parametrize("cells", [1, 2, 3, 7])
def test_a_handful_of_cells_still_carries_the_force(default_influence, cells):
    for law in ("elastic", "foundation"):
        assert_carried(pressed(default_influence, sphere_at(0.4e-3, 0.1e-3), cells=cells, law=law), 0.05)


def leaning_square(slopes: np.ndarray, x0: float, y0: float, turn: float, half: float):
    def gap(x, y):
        along = math.cos(turn) * (x - x0) + math.sin(turn) * (y - y0)
        across = math.cos(turn) * (y - y0) - math.sin(turn) * (x - x0)
        rise = slopes[0] * along + slopes[1] * across + half * np.abs(slopes).sum()
        return np.where(np.maximum(np.abs(along), np.abs(across)) <= half, rise, np.inf)

    return gap


@pytest.mark.slow
def test_leaning_squares_that_keep_their_orientation_read_as_with_many_cells(default_influence):
    """They are mostly looked at once, so the cells of that look have to fit the part of the face that presses."""
    rng = np.random.default_rng(5)
    errors = []
    for _ in range(24):
        slopes = rng.normal(size=2) * math.radians(0.7)
        x0, y0 = rng.uniform(-1.5e-3, 1.5e-3, 2)
        gap = leaning_square(slopes, x0, y0, rng.uniform(0, 2 * math.pi), rng.uniform(1.5e-3, 4e-3))
        force = 10 ** rng.uniform(-1.3, 0.0)
        few, many = (
            default_influence.readings(pressed(default_influence, gap, force, cells=cells, tilt="fixed"))
            for cells in (60, 1500)
        )
        errors.append(np.linalg.norm(few - many) / np.linalg.norm(many))
    assert np.median(errors) <= 0.009
    assert max(errors) <= 0.03


def test_foundation_sinks_in_as_the_elastic_surface_does(default_influence):
    """Calibrated on flat round punches: these to a few per cent, other shapes roughly."""
    for radius in (0.8e-3, 2e-3, 4e-3):
        footprint = Footprint.from_outline(Point(0, 0).buffer(radius), default_influence.surface)
        elastic, springs = (
            contact_load(default_influence, footprint, (0.0, 0.0, -0.05), law=law, cells=200, tilt="fixed")
            for law in ("elastic", "foundation")
        )
        assert springs.indentation == pytest.approx(elastic.indentation, rel=0.03)
        assert springs.peak_pressure == pytest.approx(0.05 / footprint.area, rel=1e-3)


def test_what_a_gap_function_raises_reaches_the_user(coarse_square):
    """Wherever it is: while the outline is traced, or while the core looks at heights."""
    calls = []

    def gap(x, y):
        calls.append(1)
        if len(calls) > limit:
            raise KeyError("my own")
        return (x**2 + y**2) / 12e-3

    limit = 1
    with pytest.raises(KeyError, match="my own"):
        Footprint.from_gap(gap, coarse_square.surface)
    limit = 10**9
    footprint = Footprint.from_gap(gap, coarse_square.surface)
    _ = footprint.centroid
    limit = len(calls)
    with pytest.raises(KeyError, match="my own"):
        contact_load(coarse_square, footprint, (0.0, 0.0, -0.1), law="elastic", cells=60)
