"""Several bodies on one pad at once."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from mjtactile import ContactError, ContactWarning, Footprint, contact_load, contact_loads

CELLS = 100


def pair(influence, gap: float, width: float = 2e-3):
    """Two rectangles, side by side along x."""
    left = shapely.box(-gap / 2 - width, -2e-3, -gap / 2, 2e-3)
    right = shapely.box(gap / 2, -2e-3, gap / 2 + width, 2e-3)
    return [Footprint.from_outline(outline, influence.surface) for outline in (left, right)]


def difference(actual, expected) -> float:
    return float(np.linalg.norm(actual - expected) / np.linalg.norm(expected))


@pytest.mark.parametrize("gap", [0.1e-3, 1e-3, 4e-3])
def test_two_halves_that_sink_alike_are_one_body(gap, coarse_square):
    """A rigid body pressed on two faces is two bodies with the same indentation: independent of how bodies couple."""
    left, right = pair(coarse_square, gap)
    both = Footprint.from_outline(left.outline.union(right.outline), coarse_square.surface)
    one = contact_load(coarse_square, both, [0, 0, -0.3], law="elastic", tilt="fixed", cells=2 * CELLS)
    forces = [[0, 0, -0.15], [0, 0, -0.15]]
    two = contact_loads(coarse_square, [left, right], forces, law="elastic", tilt="fixed", cells=CELLS)
    assert difference(coarse_square.readings(two[0] + two[1]), coarse_square.readings(one)) < 5e-3
    assert two[0].indentation == pytest.approx(one.indentation, rel=5e-3)
    assert two[0].indentation == pytest.approx(two[1].indentation, rel=1e-6)
    alone = contact_load(coarse_square, left, [0, 0, -0.15], law="elastic", tilt="fixed", cells=CELLS)
    assert abs(alone.indentation / one.indentation - 1) > 0.01  # what coupling is there for


def test_each_body_carries_its_own_wrench(coarse_square):
    footprints = pair(coarse_square, 0.5e-3)
    forces = np.array([[0.01, 0.0, -0.1], [0.0, 0.02, -0.2]])
    moments = np.cross([[-1.3e-3, 0.2e-3, 0.0], [1.1e-3, 0.0, 0.0]], forces)
    loads = contact_loads(coarse_square, footprints, forces, moments=moments, law="elastic", cells=CELLS)
    for load, force, moment in zip(loads, forces, moments, strict=True):
        carried_force, carried_moment = load.resultant()
        np.testing.assert_allclose(carried_force, force, atol=1e-12)
        np.testing.assert_allclose(carried_moment, moment, atol=1e-14)


def test_a_ball_beside_a_punch_is_lifted_by_what_the_punch_sinks(coarse_square):
    def gap(x, y):
        return ((x - 2.5e-3) ** 2 + y**2) / (2 * 4e-3)

    punch = Footprint.from_outline(shapely.box(-3e-3, -1e-3, 0.0, 1e-3), coarse_square.surface)
    ball = Footprint.from_gap(gap, coarse_square.surface)
    forces = [[0, 0, -0.3], [0, 0, -0.05]]
    _, beside = contact_loads(coarse_square, [punch, ball], forces, law="elastic", cells=CELLS)
    alone = contact_load(coarse_square, ball, forces[1], law="elastic", cells=CELLS)
    assert beside.indentation > 1.02 * alone.indentation
    assert beside.contact_area == pytest.approx(alone.contact_area, rel=0.1)


def test_bodies_that_do_not_press_leave_the_others_alone(coarse_square):
    footprints = pair(coarse_square, 1e-3)
    loads = contact_loads(coarse_square, footprints, [[0, 0, -0.1], [0, 0, 0]], law="elastic", cells=CELLS)
    alone = contact_load(coarse_square, footprints[0], [0, 0, -0.1], law="elastic", cells=CELLS)
    np.testing.assert_array_equal(loads[0].forces, alone.forces)
    assert not loads[1].forces.any()
    with pytest.warns(ContactWarning, match="pulls"):
        contact_loads(coarse_square, footprints, [[0, 0, -0.1], [0, 0, 0.1]], law="elastic", cells=CELLS)


def test_other_laws_do_not_couple(coarse_square):
    footprints = pair(coarse_square, 0.1e-3)
    forces = [[0, 0, -0.1], [0, 0, -0.2]]
    for law in ("uniform", "foundation"):
        loads = contact_loads(coarse_square, footprints, forces, law=law, cells=CELLS)
        for load, footprint, force in zip(loads, footprints, forces, strict=True):
            alone = contact_load(coarse_square, footprint, force, law=law, cells=CELLS)
            np.testing.assert_array_equal(load.forces, alone.forces)


def test_each_body_keeps_its_own_cells_under_laws_that_do_not_couple(coarse_square):
    surface = coarse_square.surface
    balls = [
        Footprint.from_gap(lambda x, y, at=at, radius=radius: ((x - at) ** 2 + y**2) / (2 * radius), surface)
        for at, radius in ((-3e-3, 8e-3), (3e-3, 2e-3))
    ]
    loads = contact_loads(coarse_square, balls, [[0, 0, -0.3], [0, 0, -0.1]], law="foundation", cells=CELLS)
    for load, ball in zip(loads, balls, strict=True):
        assert load.contact.area == pytest.approx(load.state.contact_area, rel=1e-6)
        assert load.contact.centroid.x == pytest.approx(ball.centroid[0], abs=0.3e-3)


@pytest.mark.parametrize(
    ("forces", "moments", "message"),
    [
        (None, None, "forces = None; expected a sequence with one entry for each footprint"),
        (-0.1, None, "forces = -0.1; expected a sequence"),
        ([[0, 0, -0.1], [0, -0.1]], None, r"force = \[0, -0.1\]; expected three finite numbers"),
        ("no", None, "force = 'n'; expected three finite numbers"),
        ([[0, 0, -0.1]] * 2, 7, "moments = 7; expected a sequence"),
        ([[0, 0, -0.1]] * 2, [[0, 0, 0], "none"], "moment = 'none'; expected three finite numbers"),
    ],
)
def test_forces_and_moments_that_are_none_are_refused(forces, moments, message, coarse_square):
    with pytest.raises(ContactError, match=message):
        contact_loads(coarse_square, pair(coarse_square, 1e-3), forces, moments=moments)


def test_counts_that_do_not_match_are_refused(coarse_square):
    with pytest.raises(ContactError, match="2 footprints, 1 forces and 2 moments; expected one force"):
        contact_loads(coarse_square, pair(coarse_square, 1e-3), [[0, 0, -0.1]], law="elastic")
