"""Readings from a wrench basis against those of contacts solved anew."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from mjtactile import ContactError, ContactWarning, Footprint, WrenchBasis, contact_load, indenter_outline

#: Single precision over a few hundred terms.
ROUNDING = 1e-6
OPTIONS = [
    {"law": "uniform"},
    {"law": "foundation"},
    {"law": "elastic"},
    {"law": "elastic", "friction": 0.9},
    {"law": "elastic", "tilt": "fixed"},
    {"law": "elastic", "tangential": "stick"},
]


def star(influence):
    return Footprint.from_outline(indenter_outline("star", rotate_deg=13.0, shift=(5e-4, 2e-4)), influence.surface)


def ball(influence, radius: float = 6e-3, x: float = 0.3e-3):
    return Footprint.from_gap(lambda px, py: ((px - x) ** 2 + py**2) / (2 * radius), influence.surface)


def wrenches(footprint, count: int, *, wobble: float = 2e-5, share: float = 0.1, seed: int = 0):
    """Forces of about 0.3 N near the footprint's centroid, with shear and torsion."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        force = np.array([*0.03 * random.normal(size=2), -0.3 * (1 + share * random.uniform(-1, 1))])
        through = np.array([*footprint.centroid, 0.0]) + np.array([*wobble * random.normal(size=2), 0.0])
        yield force, np.cross(through, force) + np.array([0.0, 0.0, 1e-5 * random.normal()])


def difference(actual, expected) -> float:
    return float(np.linalg.norm(actual - expected) / np.linalg.norm(expected))


@pytest.mark.parametrize("options", OPTIONS, ids=lambda options: "-".join(map(str, options.values())))
def test_readings_are_those_of_contacts_solved_anew(options, coarse_square):
    footprint = star(coarse_square)
    basis = WrenchBasis(coarse_square, footprint, cells=60, **options)
    for force, moment in wrenches(footprint, 12):
        expected = coarse_square.readings(
            contact_load(coarse_square, footprint, force, moment=moment, cells=60, **options)
        )
        assert difference(basis.readings(force, moment), expected) < ROUNDING
    linear = options["law"] != "uniform" and not {"friction", "tangential"} & options.keys()
    assert basis.active == linear


@pytest.mark.parametrize("options", [{"law": "elastic"}, {"law": "foundation"}])
def test_a_curved_body_is_solved_anew_for_each_force(options, coarse_square):
    footprint = ball(coarse_square)
    basis = WrenchBasis(coarse_square, footprint, cells=100, **options)
    for force, moment in wrenches(footprint, 10, wobble=1e-6):
        load = contact_load(coarse_square, footprint, force, moment=moment, cells=100, **options)
        assert difference(basis.readings(force, moment), coarse_square.readings(load)) < ROUNDING


def test_forces_far_apart_get_cells_of_their_own(coarse_square):
    footprint = ball(coarse_square)
    basis = WrenchBasis(coarse_square, footprint, law="elastic", cells=100)
    for newton in (0.3, 1e-3, 0.3, 1e-6):
        load = contact_load(coarse_square, footprint, [0.0, 0.0, -newton], law="elastic", cells=100)
        assert difference(basis.readings([0.0, 0.0, -newton]), coarse_square.readings(load)) < ROUNDING


def test_a_wrench_that_lifts_an_edge_ends_the_basis(coarse_square):
    footprint = star(coarse_square)
    basis = WrenchBasis(coarse_square, footprint, law="elastic", cells=60)
    for force, moment in wrenches(footprint, 4):
        basis.readings(force, moment)
    assert basis.active
    force = np.array([0.0, 0.0, -0.3])
    moment = np.cross([footprint.centroid[0] + 2e-3, footprint.centroid[1], 0.0], force)
    expected = contact_load(coarse_square, footprint, force, moment=moment, law="elastic", cells=60)
    assert expected.contact_area < 0.9 * footprint.area
    assert difference(basis.readings(force, moment), coarse_square.readings(expected)) < ROUNDING
    assert not basis.active


def test_shear_beyond_friction_is_not_answered_from_the_basis(coarse_square):
    footprint = star(coarse_square)
    basis = WrenchBasis(coarse_square, footprint, law="elastic", cells=60, friction=0.5)
    for force, moment in wrenches(footprint, 4):
        basis.readings(force, moment)
    assert not basis.active
    with pytest.warns(ContactWarning, match="it slips: friction 0.5"):
        slid = basis.readings([0.3, 0.0, -0.3])
    with pytest.warns(ContactWarning):
        expected = contact_load(coarse_square, footprint, [0.3, 0.0, -0.3], law="elastic", cells=60, friction=0.5)
    assert difference(slid, coarse_square.readings(expected)) < ROUNDING


def test_partial_slip_has_no_basis(coarse_square):
    footprint = star(coarse_square)
    options = {"law": "elastic", "tangential": "coulomb", "friction": 0.5, "cells": 40}
    basis = WrenchBasis(coarse_square, footprint, **options)
    for force, moment in wrenches(footprint, 4):
        load = contact_load(coarse_square, footprint, force, moment=moment, **options)
        assert difference(basis.readings(force, moment), coarse_square.readings(load)) < ROUNDING
    assert not basis.active


def test_responses_of_two_bodies_add_up(coarse_square):
    left = Footprint.from_outline(indenter_outline("circle", scale=0.3, shift=(-4e-3, 0.0)), coarse_square.surface)
    right = Footprint.from_outline(indenter_outline("square", scale=0.3, shift=(4e-3, 0.0)), coarse_square.surface)
    bases = [WrenchBasis(coarse_square, footprint, law="foundation", cells=40) for footprint in (left, right)]
    totals = [bases[0].response([0.0, 0.0, -0.1]) + bases[1].response([0.01, 0.0, -0.2]) for _ in range(4)]
    loads = [
        contact_load(coarse_square, footprint, force, law="foundation", cells=40)
        for footprint, force in ((left, [0.0, 0.0, -0.1]), (right, [0.01, 0.0, -0.2]))
    ]
    assert difference(coarse_square.readings_of(totals[-1]), coarse_square.readings(loads[0] + loads[1])) < ROUNDING


def test_wrenches_without_pressure_read_nothing_and_say_so(coarse_square):
    basis = WrenchBasis(coarse_square, star(coarse_square), law="elastic", cells=40)
    for _ in range(4):
        basis.readings([0.0, 0.0, -0.3])
    with pytest.warns(ContactWarning, match="pulls the indenter off"):
        assert not basis.readings([0.0, 0.0, 0.1]).any()
    assert not basis.readings([0.0, 0.0, 0.0]).any()


def test_the_same_wrench_gives_the_same_bits(coarse_square):
    basis = WrenchBasis(coarse_square, star(coarse_square), law="elastic", cells=40)
    for _ in range(3):
        basis.readings([0.01, 0.0, -0.3])
    first = basis.readings([0.01, 0.0, -0.3])
    for force, _ in itertools.chain(wrenches(basis.footprint, 50, wobble=0.0)):
        basis.readings(force)
    assert (basis.readings([0.01, 0.0, -0.3]) == first).all()


def test_readings_warn_out_of_range_from_the_basis_too(coarse_square):
    basis = WrenchBasis(coarse_square, star(coarse_square), law="elastic", cells=40)
    for _ in range(4):
        basis.readings([0.0, 0.0, -0.3])
    assert basis.active
    with pytest.warns(ContactWarning, match="strains are no longer small"):
        basis.readings([0.0, 0.0, -30.0])


def test_options_are_refused_when_the_basis_is_made(coarse_square):
    with pytest.raises(ContactError, match="needs law='elastic'"):
        WrenchBasis(coarse_square, star(coarse_square), law="uniform", tangential="stick")


def test_moving_by_the_sensors_tolerance_changes_readings_by_less_than_a_thousandth(draft):
    from mjtactile.plugin.reading import POSE_TOLERANCE

    for law, make in (("uniform", star_at), ("elastic", star_at), ("elastic", ball_at)):
        there, moved = (
            draft.readings(contact_load(draft, make(draft, x), [0.01, 0.0, -0.1], law=law, cells=60))
            for x in (1e-3, 1e-3 + POSE_TOLERANCE)
        )
        assert 1e-6 < difference(moved, there) < 1e-3


def star_at(influence, x: float):
    return Footprint.from_outline(indenter_outline("star", shift=(x, 0.0)), influence.surface)


def ball_at(influence, x: float):
    return ball(influence, radius=3e-3, x=x)
