"""Calibration: an array's own gains and offsets are measured at rest and under a known pressure, and taken out."""

from __future__ import annotations

import numpy as np
import pytest

from mjtactile.errors import TransducerError
from mjtactile.transducer.array import Transducer
from mjtactile.transducer.calibration import calibrate
from mjtactile.transducer.capacitive import CapacitiveCell
from mjtactile.transducer.imperfections import Imperfections
from mjtactile.transducer.piezoresistive import PiezoresistiveElement

SHAPE = (2, 6, 6)
FULL = 50e3
ELEMENTS = [CapacitiveCell.with_range(FULL), PiezoresistiveElement(full_force=FULL * 1.5625e-6)]


@pytest.fixture
def readings():
    return np.random.default_rng(1).uniform(0.0, 0.8 * FULL, (5, *SHAPE))


@pytest.mark.parametrize("element", ELEMENTS)
def test_gains_and_offsets_are_taken_out(element, readings):
    array = Transducer(element, Imperfections(gain_spread=0.05, offset_spread=0.01), shape=SHAPE, seed=3)
    calibration = calibrate(array, element, shape=SHAPE, pressure=FULL / 2, readings=1)
    np.testing.assert_allclose(calibration.gains, array.gains, rtol=1e-9)
    np.testing.assert_allclose(calibration.offsets, array.offsets * element.full_signal, atol=1e-9)
    assert np.abs(array(readings) - readings).max() > 0.02 * FULL
    # Where an array's gain is low enough not to clip, nothing is left.
    np.testing.assert_allclose(calibration(array(readings)), readings, rtol=1e-6, atol=1e-6 * FULL)


def test_free_taxels_are_calibrated(readings):
    element, free = ELEMENTS[0], readings.reshape(5, -1)
    array = Transducer(element, Imperfections(gain_spread=0.05), shape=free.shape[1:], seed=3)
    calibration = calibrate(array, element, shape=free.shape[1:], pressure=FULL / 2, readings=1)
    np.testing.assert_allclose(calibration.gains, array.gains, rtol=1e-9)
    np.testing.assert_allclose(calibration(array(free)), free, rtol=1e-6, atol=1e-6 * FULL)


def test_noise_averages_out_of_a_calibration(readings):
    element = ELEMENTS[0]
    array = Transducer(element, Imperfections(noise=0.01, gain_spread=0.02), shape=SHAPE, seed=4)
    few, many = (
        np.abs(calibrate(array, element, shape=SHAPE, pressure=FULL / 2, readings=n).gains - array.gains).mean()
        for n in (2, 200)
    )
    # A tenth, by the square root of a hundred times as many.
    assert few / many == pytest.approx(10.0, rel=0.5)


def test_dead_taxels_are_found_and_read_zero(readings):
    element = ELEMENTS[0]
    dead = ((0, 1, 2), (1, 5, 5))
    array = Transducer(element, Imperfections(dead_taxels=dead, gain_spread=0.02), shape=SHAPE, seed=5)
    calibration = calibrate(array, element, shape=SHAPE, pressure=FULL / 2, readings=1)
    assert {tuple(index) for index in np.argwhere(calibration.dead).tolist()} == set(dead)
    corrected = calibration(array(readings))
    assert all((corrected[(slice(None), *taxel)] == 0.0).all() for taxel in dead)


@pytest.mark.parametrize("delay", [0, 5, 50])
def test_readings_that_are_still_of_the_pressure_before_are_discarded(delay):
    array = Transducer(ELEMENTS[0], Imperfections(delay=delay, gain_spread=0.02), shape=SHAPE, seed=6)
    array(np.full(SHAPE, 0.4 * FULL))  # in the delay line as the calibration begins
    reported, inner = [], array.volts
    array.volts = lambda readings: reported.append(None) or inner(readings)  # type: ignore[method-assign]
    calibration = calibrate(array, ELEMENTS[0], shape=SHAPE, pressure=FULL / 2, readings=20)
    np.testing.assert_allclose(calibration.gains, array.gains, rtol=1e-9)
    np.testing.assert_allclose(calibration.offsets, 0.0, atol=1e-9)
    assert len(reported) == 2 * (20 + delay)


def test_a_delay_behind_a_function_is_named_where_nothing_is_reported():
    array = Transducer(ELEMENTS[0], Imperfections(delay=9), shape=SHAPE)
    with pytest.raises(TransducerError, match=r"connected\? If it reports with a delay, .*discard"):
        calibrate(lambda stress: array(stress), ELEMENTS[0], shape=SHAPE, pressure=FULL / 2, readings=4)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_pressure_beyond_the_elements_range_is_refused(element):
    """Every taxel would report the end of the range, and all gains would be too small by the same factor."""
    array = Transducer(element, shape=SHAPE)
    for pressure in (1.01 * FULL, 1e3 * FULL):
        with pytest.raises(TransducerError, match=r"beyond the element's range, which ends at 5e\+04 Pa.*2.5e\+04"):
            calibrate(array, element, shape=SHAPE, pressure=pressure, readings=1)
    gains = calibrate(array, element, shape=SHAPE, pressure=element.full_scale, readings=1).gains
    np.testing.assert_allclose(gains, 1.0, rtol=1e-9)  # rounding


@pytest.mark.parametrize(
    ("element", "says"), [("x", "element = 'x'"), (CapacitiveCell, r"expected.*CapacitiveCell\(\)")]
)
def test_a_calibration_needs_an_element(element, says):
    with pytest.raises(TransducerError, match=says):
        calibrate(Transducer(shape=SHAPE), element, shape=SHAPE, pressure=1e3)


def test_what_cannot_be_measured_is_refused():
    element = ELEMENTS[0]
    array = Transducer(element, shape=SHAPE)
    with pytest.raises(TransducerError, match="positive pressure"):
        calibrate(array, element, shape=SHAPE, pressure=0.0)
    with pytest.raises(TransducerError, match=r"readings = 2.5; expected a positive whole number"):
        calibrate(array, element, shape=SHAPE, pressure=FULL / 2, readings=2.5)  # type: ignore[arg-type]
    with pytest.raises(TransducerError, match="NaN"):
        calibrate(lambda stress: stress * np.nan, element, shape=SHAPE, pressure=FULL / 2)
    with pytest.raises(TransducerError, match=r"reports shape \(1,\)"):
        calibrate(lambda stress: stress.ravel()[:1], element, shape=SHAPE, pressure=FULL / 2)
    with pytest.raises(TransducerError, match="no taxel reports"):
        calibrate(np.zeros_like, element, shape=SHAPE, pressure=FULL / 2)
    calibration = calibrate(array, element, shape=SHAPE, pressure=FULL / 2)
    with pytest.raises(TransducerError, match=r"\(4, 13, 13\)"):
        calibration(np.zeros((4, 13, 13)))
    with pytest.raises(TransducerError, match="NaN"):
        calibration(np.full(SHAPE, np.nan))
