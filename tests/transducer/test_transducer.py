"""Transducers: the elements' curves, the way of a signal through them, and the paper's array under weights."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point

import mjtactile
from mjtactile.transducer.array import Transducer
from mjtactile.transducer.capacitive import (
    BENDING_MEAN,
    SHEAR_MEAN,
    VACUUM_PERMITTIVITY,
    CapacitiveCell,
    TransducerError,
)
from mjtactile.transducer.imperfections import TYPICAL, Imperfections, coupled, lagging
from mjtactile.transducer.piezoresistive import PiezoresistiveElement
from mjtactile.units import GRAM_FORCE

#: Pressures of the paper's weights of 5, 10, 20 and 50 gf on discs of radius 5.5, 6.5, 7.5 and 10 mm [Pa].
WEIGHTS = np.array([5, 10, 20, 50]) * GRAM_FORCE / (np.pi * np.array([5.5e-3, 6.5e-3, 7.5e-3, 10e-3]) ** 2)
SHAPE = (4, 13, 13)
ELEMENTS = [CapacitiveCell(), CapacitiveCell.with_range(100e3), PiezoresistiveElement()]


@pytest.fixture
def readings():
    return np.random.default_rng(3).uniform(0.0, 2e3, SHAPE)


def test_the_weights_are_the_papers():
    # To the four digits printed in the paper.
    np.testing.assert_allclose(WEIGHTS, [516, 738, 1109, 1560], rtol=2e-3)


def test_deflections_are_those_of_a_clamped_plate_and_a_square_membrane():
    # A unit square: Navier's double sine series for the membrane, Galerkin on polynomials for the plate.
    wave = np.arange(1, 120, 2) * np.pi
    rows, columns = np.meshgrid(wave, wave)
    membrane = (8.0 / (rows * columns)) ** 2 / (rows**2 + columns**2)
    assert membrane.sum() == pytest.approx(SHEAR_MEAN, rel=1e-3)
    x = np.polynomial.Polynomial([0.0, 1.0])
    shapes = [(x * (1 - x)) ** 2 * (x - 0.5) ** (2 * order) for order in range(5)]

    def integral(polynomial):
        return polynomial.integ()(1.0)

    def products(order):
        derived = [shape.deriv(order) if order else shape for shape in shapes]
        return np.array([[integral(a * b) for b in derived] for a in derived])

    mass, slope, bend = products(0), products(1), products(2)
    load = np.array([integral(s) for s in shapes])
    stiffness = np.kron(bend, mass) + np.kron(mass, bend) + 2 * np.kron(slope, slope)
    work = np.kron(load, load)
    assert work @ np.linalg.solve(stiffness, work) == pytest.approx(BENDING_MEAN, rel=1e-3)


def test_the_capacitive_curve_is_a_parallel_plates():
    cell = CapacitiveCell()
    assert cell.rest_capacitance == pytest.approx(VACUUM_PERMITTIVITY * 1e-6 / 3e-6)
    assert cell.rest_capacitance == pytest.approx(2.95e-12, rel=1e-3)
    assert 2e3 < cell.full_scale < 3e3
    sunk = WEIGHTS / cell.stiffness
    plates = VACUUM_PERMITTIVITY * 1e-6 / (3e-6 - sunk)
    np.testing.assert_allclose(cell.signal(WEIGHTS), (plates - cell.rest_capacitance) / 0.1e-12, rtol=1e-12)


def test_the_capacitive_curve_rises_ever_faster_over_the_papers_weights():
    cell = CapacitiveCell()
    volts = cell.signal(np.concatenate([[0.0], WEIGHTS]))
    # As printed in docs/transducers.md, at 516, 738, 1109 and 1560 Pa.
    np.testing.assert_allclose(volts[1:], [0.961, 1.396, 2.149, 3.114], atol=6e-4)
    slopes = np.diff(volts) / np.diff(np.concatenate([[0.0], WEIGHTS]))
    assert (np.diff(slopes) > 0.0).all()
    # Bad linearity: a straight line through rest and the heaviest weight is off by over 2 % of it at the lightest
    # (-1 + 1 / (1 - p/pc) at 516 against 1560 Pa with pc = 16.4 kPa: 2.2 %).
    assert volts[4] * WEIGHTS[0] / WEIGHTS[3] - volts[1] > 0.02 * volts[4]


def test_the_piezoresistive_curve_is_straight_to_200_gram_force():
    element = PiezoresistiveElement()
    forces = np.linspace(0.0, 200.0, 21) * GRAM_FORCE
    volts = element.signal(forces / element.area)
    np.testing.assert_allclose(volts, np.linspace(0.0, 5.0, 21), atol=1e-12)
    assert Transducer(element, shape=(1, 1, 1)).volts(np.full((1, 1, 1), 1.5 * element.full_scale)) == 5.0


@pytest.mark.parametrize("element", ELEMENTS)
def test_the_calibration_is_the_inverse_and_both_rise(element):
    full = element.full_scale
    stress = np.linspace(-0.04 * full, full, 500)
    volts = element.signal(stress)
    assert (np.diff(volts) > 0.0).all()
    np.testing.assert_allclose(element.stress(volts), stress, rtol=1e-9, atol=1e-9 * full)
    assert element.signal(np.array(full)) == pytest.approx(element.full_signal)


@pytest.mark.parametrize("kind", [CapacitiveCell, PiezoresistiveElement])
def test_an_element_with_a_range_saturates_at_its_end(kind):
    assert kind.with_range(50e3).full_scale == pytest.approx(50e3, rel=1e-12)  # rounding


def test_electrodes_that_meet_give_no_finite_capacitance_and_a_clipped_report():
    cell = CapacitiveCell()
    assert np.isinf(cell.capacitance(1.01 * cell.closing_pressure))
    reported = Transducer(cell)(np.full(SHAPE, 100.0 * cell.closing_pressure))
    np.testing.assert_allclose(reported, cell.full_scale, rtol=1e-12)


def test_three_axes_come_back_from_four_resistors():
    element = PiezoresistiveElement()
    force = np.random.default_rng(0).uniform(-0.2, 0.2, (5, 7, 3))
    volts = element.voltages(force)
    assert volts.shape == (5, 7, 4)
    np.testing.assert_allclose(element.forces(volts), force, atol=1e-12)
    # Pressing strains all four alike, shear along x the pair on x oppositely and the other pair not at all.
    pressing, shear = element.voltages([0.0, 0.0, 0.1]), element.voltages([0.1, 0.0, 0.0])
    assert np.ptp(pressing) == 0.0
    np.testing.assert_allclose(shear, shear[0] * np.array([1.0, 0.0, -1.0, 0.0]), atol=1e-15)


def test_pillars_gather_the_stress_that_presses_on_them():
    element = PiezoresistiveElement()
    tensor = np.zeros((6, 4, 13, 13))
    tensor[2], tensor[4], tensor[5] = -1e3, 20.0, 30.0
    np.testing.assert_allclose(element.pillar_force(tensor)[0, 0, 0], np.array([30.0, 20.0, 1e3]) * element.area)
    with pytest.raises(TransducerError, match=r"\(6, \.\.\.\)"):
        element.pillar_force(np.zeros((5, 2)))


@pytest.mark.parametrize("element", ELEMENTS)
@given(seed=st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_an_ideal_array_reports_what_it_is_given(element, seed):
    given_readings = np.random.default_rng(seed).uniform(0.0, element.full_scale, (2, *SHAPE))
    np.testing.assert_allclose(Transducer(element)(given_readings), given_readings, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("element", ELEMENTS)
@given(bits=st.integers(6, 20), seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_counts_keep_the_order_of_stresses_and_are_half_a_count_off_at_most(element, bits, seed):
    stress = np.sort(np.random.default_rng(seed).uniform(0.0, 1.2 * element.full_scale, (1, 1, 50)))
    transducer = Transducer(element, Imperfections(adc_bits=bits), shape=(1, 1, 50))
    volts = transducer.volts(stress)
    assert (np.diff(volts) >= 0.0).all()
    exact = np.minimum(element.signal(np.minimum(stress, element.full_scale)), element.full_signal)
    assert np.abs(volts - exact).max() <= 0.5 * 1.05 * element.full_signal / (2**bits - 1) * (1 + 1e-9)
    assert (Transducer(element, Imperfections(adc_bits=bits), shape=(1, 1, 50))(0 * stress) == 0.0).all()


@given(seed=st.integers(0, 2**31), batch=st.integers(1, 4))
@settings(max_examples=20, deadline=None)
def test_the_same_seed_gives_the_same_bits_alone_and_in_a_batch(seed, batch):
    given_readings = np.random.default_rng(seed).uniform(0.0, 2e3, (batch, *SHAPE))
    how = Imperfections(noise=0.01, gain_spread=0.05, offset_spread=0.01, dead=0.02, crosstalk=0.05, adc_bits=12)
    first, second = (Transducer(imperfections=how, seed=seed) for _ in range(2))
    together = first(given_readings)
    np.testing.assert_array_equal(together, np.stack([second(one) for one in given_readings]))
    assert (first(given_readings) != together).any()  # noise goes on ...
    first.reset()
    np.testing.assert_array_equal(first(given_readings), together)  # ... until it starts anew
    for other in (how, Imperfections(noise=0.01), Imperfections(gain_spread=0.05)):
        one, another = (Transducer(imperfections=other, seed=k)(given_readings) for k in (seed, seed + 1))
        assert (one != another).any()


def test_noise_and_spread_are_as_large_as_asked_for(readings):
    element = PiezoresistiveElement(full_force=2e3 * PiezoresistiveElement().area)
    batch = np.broadcast_to(readings, (200, *SHAPE)) * 0.5
    noisy = Transducer(element, Imperfections(noise=0.02), seed=1)(batch)
    # 135,200 draws: the standard deviation is known to 0.2 %; five times that.
    assert (noisy - batch).std() == pytest.approx(0.02 * element.full_scale, rel=0.01)
    own = Transducer(element, Imperfections(signal_noise=0.02), seed=1)(batch)
    assert (own / batch - 1.0).std() == pytest.approx(0.02, rel=0.01)
    spread = Transducer(element, Imperfections(gain_spread=0.05), seed=1)(batch[0])
    assert (spread / batch[0] - 1.0).std() == pytest.approx(0.05, rel=0.15)  # 676 draws: 2.7 %
    assert Transducer(element, Imperfections(gain_spread=0.05), seed=1).gains.std() > 0.0


def test_noise_at_rest_is_not_cut_in_half():
    noisy = Transducer(imperfections=Imperfections(noise=0.01), seed=0).volts(np.zeros((100, *SHAPE)))
    assert abs(noisy.mean()) < 5e-4  # 67,600 draws of 0.05 V: 0.0002 V
    assert noisy.min() < 0.0


def test_dead_taxels_report_rest_whatever_presses(readings):
    how = Imperfections(dead=0.1, dead_taxels=((0, 6, 6),), noise=0.01, offset_spread=0.01)
    transducer = Transducer(imperfections=how, seed=5)
    assert transducer.dead[0, 6, 6]
    assert transducer.dead.mean() == pytest.approx(0.1, abs=0.06)  # 676 draws: 0.012
    reported = transducer(readings)
    assert (reported[transducer.dead] == 0.0).all()
    assert (reported[~transducer.dead] != 0.0).all()


@given(share=st.floats(0.0, 0.25), seed=st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_crosstalk_keeps_sums_and_uniform_fields(share, seed):
    stress = np.random.default_rng(seed).uniform(0.0, 1.0, (2, 3, 5, 6))
    mixed = coupled(stress, share)
    np.testing.assert_allclose(mixed.sum(axis=(-1, -2)), stress.sum(axis=(-1, -2)), rtol=1e-12)
    np.testing.assert_allclose(coupled(np.ones((1, 4, 4)), share), 1.0, rtol=1e-12)


def test_crosstalk_spreads_one_taxel_over_its_four_neighbours():
    spot = np.zeros((2, 5, 5))
    spot[0, 2, 2] = 1.0
    expected = np.zeros((2, 5, 5))
    expected[0, [1, 3, 2, 2], [2, 2, 1, 3]], expected[0, 2, 2] = 0.1, 0.6
    np.testing.assert_allclose(coupled(spot, 0.1), expected, atol=1e-15)


@given(path=st.lists(st.floats(0.0, 1e3), min_size=1, max_size=30), width=st.floats(0.0, 0.5))
def test_hysteresis_follows_a_rising_stress_and_stays_within_its_band(path, width):
    before = np.zeros(1)
    for stress in path:
        now = lagging(np.array([stress]), before, width)
        assert stress <= now[0] <= (1.0 + width) * stress
        if stress >= before[0]:
            assert now[0] == stress
        before = now


def test_hysteresis_is_a_loop_that_closes(readings):
    transducer = Transducer(imperfections=Imperfections(hysteresis=0.1))
    up = [transducer(share * readings) for share in (0.0, 0.5, 1.0)]
    down = [transducer(share * readings) for share in (0.95, 0.5, 0.0)]
    np.testing.assert_allclose(up[1], 0.5 * readings, rtol=1e-9)
    np.testing.assert_allclose(down[0], readings, rtol=1e-9)  # still within the play
    np.testing.assert_allclose(down[1], 0.55 * readings, rtol=1e-9)
    assert np.abs(down[2]).max() < 1e-9
    transducer(readings)
    transducer.reset()
    np.testing.assert_allclose(transducer(0.5 * readings), 0.5 * readings, rtol=1e-9)


def test_a_delay_brings_readings_late_and_rest_first(readings):
    transducer = Transducer(imperfections=Imperfections(delay=2))
    reported = [transducer(k * readings / 10) for k in range(1, 6)]
    assert (reported[0] == 0.0).all()
    assert (reported[1] == 0.0).all()
    for k in range(2, 5):
        np.testing.assert_allclose(reported[k], (k - 1) * readings / 10, rtol=1e-9)
    transducer.reset()
    assert (transducer(readings) == 0.0).all()


@pytest.mark.parametrize("how", [Imperfections(hysteresis=0.1), Imperfections(delay=1)])
def test_a_transducer_that_remembers_refuses_another_batch_size(how, readings):
    transducer = Transducer(imperfections=how)
    transducer(readings)
    with pytest.raises(TransducerError, match="reset"):
        transducer(np.stack([readings, readings]))


def test_free_taxels_report_what_a_single_row_of_a_grid_does(readings):
    free, batch = readings.reshape(-1)[:50], readings.reshape(-1)[:150].reshape(3, 50)
    how = Imperfections(noise=0.01, gain_spread=0.1, hysteresis=0.1, delay=1, dead=0.1, adc_bits=12)
    row, alone = (Transducer(imperfections=how, shape=shape, seed=3) for shape in ((1, 1, 50), (50,)))
    for load in (1.0, 0.5, 0.0):  # the same draws in the same order: the same bits
        np.testing.assert_array_equal(alone(load * free), row(load * free[None, None])[0, 0])
    alone.reset()
    row.reset()
    np.testing.assert_array_equal(alone(batch), row(batch[:, None, None])[:, 0, 0])


@pytest.mark.parametrize(("shape", "taxel"), [(SHAPE, [0, 6, 5]), ((9,), [4])])
def test_dead_taxels_may_be_lists_as_files_have_them(shape, taxel):
    dead = Transducer(imperfections=Imperfections(dead_taxels=(taxel,)), shape=shape).dead
    assert np.argwhere(dead).tolist() == [taxel]


def test_equal_imperfections_have_equal_hashes():
    listed = Imperfections(dead_taxels=[[0, np.int64(6), 5]])  # type: ignore[arg-type,list-item]
    own = Imperfections(dead_taxels=((0, 6, 5),))
    assert listed == own
    assert hash(listed) == hash(own)


@pytest.mark.parametrize("element", ELEMENTS)
def test_no_number_stays_none_in_an_elements_curve(element):
    assert np.isnan(element.signal([np.nan, 1e3])).tolist() == [True, False]
    assert np.isnan(element.stress([np.nan, 1.0])).tolist() == [True, False]


def test_the_capacitance_of_no_number_is_none():
    assert np.isnan(CapacitiveCell().capacitance(np.nan))


@pytest.mark.parametrize("values", [["1", "2", "3"], np.array([1.0, 2.0, 3.0 + 1j]), [1.0, [2.0], 3.0]])
def test_text_and_complex_numbers_are_refused(values):
    cell, element = CapacitiveCell(), PiezoresistiveElement()
    for take in (cell.signal, cell.stress, cell.capacitance, element.signal, element.stress, element.pillar_force):
        with pytest.raises(TransducerError, match="expected"):
            take(values)
    with pytest.raises(TransducerError, match=r"force = .*; expected forces along x, y"):
        element.voltages(values)
    with pytest.raises(TransducerError, match=r"voltages = .*; expected outputs"):
        element.forces(values)
    with pytest.raises(TransducerError, match=r"readings = .*; expected an array of stresses"):
        Transducer(shape=(3,))(values)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Transducer(element="x"), "element = 'x'; expected a CapacitiveCell"),  # type: ignore[arg-type]
        (lambda: Transducer(element=CapacitiveCell), r"expected one of it, CapacitiveCell\(\)"),  # type: ignore[arg-type]
        (lambda: Transducer(imperfections="x"), "imperfections is of type str"),  # type: ignore[arg-type]
        (lambda: PiezoresistiveElement().voltages(np.zeros((5, 2))), r"force has shape \(5, 2\); expected \(..., 3\)"),
        (lambda: PiezoresistiveElement().forces(1.0), r"voltages has shape \(\); expected \(..., 4\)"),
        (lambda: CapacitiveCell(gap=0.0), "gap"),
        (lambda: CapacitiveCell(gap="3e-6"), "gap = '3e-6'"),  # type: ignore[arg-type]
        (lambda: CapacitiveCell(poisson=0.6), "silicone"),
        (lambda: CapacitiveCell(poisson=None), "silicone"),  # type: ignore[arg-type]
        (lambda: PiezoresistiveElement.with_range("1e5"), "full_scale = '1e5'"),  # type: ignore[arg-type]
        (lambda: CapacitiveCell.with_range(-1.0), "full_scale = -1.0"),
        (lambda: PiezoresistiveElement(area=np.nan), "area"),
        (lambda: Imperfections(noise=-0.1), "noise"),
        (lambda: Imperfections(crosstalk=0.3), "crosstalk"),
        (lambda: Imperfections(delay=-1), "delay"),
        (lambda: Imperfections(adc_bits=0), "adc_bits"),
        (lambda: Imperfections(noise="0.1"), "noise = '0.1'"),  # type: ignore[arg-type]
        (lambda: Imperfections(dead_taxels=(5,)), r"dead_taxels = \(5,\); expected"),  # type: ignore[arg-type]
        (lambda: Imperfections(dead_taxels=((0, 0, 0.5),)), "dead_taxels = .*expected"),  # type: ignore[arg-type]
        (lambda: Imperfections(dead_taxels=((0, 0, -1),)), "dead_taxels = .*expected"),
        (lambda: Transducer(seed=-1), "seed = -1"),
        (lambda: Transducer(seed="1"), "seed = '1'"),  # type: ignore[arg-type]
        (lambda: Transducer(shape="676"), "layers, rows, columns"),  # type: ignore[arg-type]
        (lambda: Transducer()("soft"), "readings = 'soft'; expected an array"),  # type: ignore[arg-type]
        (lambda: Transducer(shape=(4, 13)), "layers, rows, columns"),  # type: ignore[arg-type]
        (lambda: Transducer(imperfections=Imperfections(dead_taxels=((4, 0, 0),))), "dead taxel"),
        (lambda: Transducer(shape=(5,))(np.zeros((5, 1))), "shape="),
        (lambda: Transducer(shape=(5,))(np.zeros((2, 2, 5))), "shape="),
        (lambda: Transducer(imperfections=Imperfections(dead_taxels=((0, 0, 3),)), shape=(5,)), "dead taxel"),
        (lambda: Transducer(imperfections=Imperfections(crosstalk=0.1), shape=(5,)), "free taxels"),
        (lambda: Transducer()(np.zeros((1, 13, 13))), "shape="),
        (lambda: Transducer()(np.full(SHAPE, np.nan)), "NaN"),
    ],
)
def test_what_cannot_be_says_what_was_expected(make, says):
    with pytest.raises(TransducerError, match=says):
        make()


def test_typical_imperfections_are_small(readings):
    transducer = Transducer(imperfections=TYPICAL, seed=2)
    error = (transducer(readings) - readings)[~transducer.dead]
    assert 0.0 < np.abs(error).mean() < 0.05 * readings.max()


@pytest.fixture(scope="module")
def array_under(draft):
    """What the 3 x 3 cells in the middle of the pad, 1 mm deep and 1.25 mm apart, report of a weight."""
    cells = Transducer(CapacitiveCell(), Imperfections(adc_bits=12), shape=(1, 3, 3))

    def reported(weight):
        footprint = mjtactile.Footprint.from_outline(weight, draft.surface)
        load = mjtactile.contact_load(draft, footprint, (0.0, 0.0, -10.0 * GRAM_FORCE), law="uniform")
        pressing = np.maximum(-draft.stress(load)[2, 0, 5:8, 5:8], 0.0)
        return cells(pressing[None])[0]

    return reported


def test_an_array_under_a_weight_that_covers_it_reads_nearly_uniform(array_under):
    whole = array_under(Point(0.0, 0.0).buffer(6.5e-3, quad_segs=64))
    # The pressure of 10 gf on a disc of 6.5 mm, some of which spreads into the sheet around it.
    assert whole.mean() == pytest.approx(738.0, rel=0.1)
    assert np.ptp(whole) < 0.05 * whole.mean()


def test_an_array_with_a_corner_uncovered_reads_less_there(array_under):
    # The weight's edge passes 0.4 mm from the middle on the line to the corner at +x, +y.
    partly = array_under(Point(-4.3e-3, -4.3e-3).buffer(6.5e-3, quad_segs=64))
    corner, opposite = partly[2, 2], partly[0, 0]
    assert corner < 0.3 * opposite
    assert partly[2, 2] == partly.min()
    assert max(partly[2, 1], partly[1, 2]) < partly[0, 0]
    # The further along the diagonal from the covered to the uncovered corner, the less.
    assert partly[0, 0] > partly[1, 1] > partly[2, 2]
    np.testing.assert_allclose(partly, partly.T, rtol=1e-2)
