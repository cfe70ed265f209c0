"""Gains and offsets of one array of transducers, measured at rest and under a known pressure.

A driver decodes with the nominal element's curve. Gains and offsets differ between arrays but are constant for one
array, so they can be measured once: at rest, and under a uniform pressure such as that of a fluid. Noise and dead
taxels remain: averaging readings reduces noise, and recognisers replace dead taxels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjtactile._types import Array, Mask
from mjtactile.errors import TransducerError, shortened
from mjtactile.transducer.array import Element, Transducer, checked_shape, finite_readings, require_element
from mjtactile.transducer.checks import require_positive
from mjtactile.units import is_whole

#: A taxel with less than this fraction of the nominal gain is dead [-].
_DEAD = 0.5
#: A pressure at the end of an element's range may exceed it by this fraction [-], that of rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Calibration:
    """Gains and offsets of one array: `calibration(readings)` corrects what the array reports.

    Arrays have the shape of one set of readings: (layers, rows, columns), or (taxels,) for free taxels.

    Attributes:
        element: the nominal one, whose curve the array's readings were decoded with.
        offsets: signals at rest [V].
        gains: over the nominal gain [-].
        dead: bool, True for taxels that always report rest.
    """

    element: Element
    offsets: Array
    gains: Array
    dead: Mask

    def __call__(self, readings: npt.ArrayLike) -> Array:
        """Readings as an array without spread would report them [Pa], same shape; dead taxels read zero.

        Args:
            readings: as the array reports them [Pa], shape (..., *offsets.shape).

        Raises:
            TransducerError: the readings have another shape or are not finite.
        """
        given = finite_readings(readings)
        if given.shape[-self.offsets.ndim :] != self.offsets.shape:
            raise TransducerError(
                f"the readings have shape {given.shape}; expected that of the calibration, "
                f"{self.offsets.shape}, or batches of it."
            )
        signal = (self.element.signal(given) - self.offsets) / np.where(self.dead, 1.0, self.gains)
        return np.where(self.dead, 0.0, self.element.stress(signal))


def calibrate(
    array: Callable[[Array], Array],
    element: Element,
    *,
    shape: tuple[int, ...] = (4, 13, 13),
    pressure: float,
    readings: int = 100,
) -> Calibration:
    """Measure an array: readings at rest, and under one pressure everywhere.

    Reports of a `Transducer` with a delay are discarded after each change of pressure until it has passed. Another
    array must report each stress at once.

    Args:
        array: takes the stress at all taxels [Pa] and returns what the array reports of it [Pa], both of shape
            `shape`; for example a `Transducer`, whose delay line is then full of readings under the pressure.
        element: the nominal one.
        shape: of one set of readings, (layers, rows, columns) or (taxels,).
        pressure: stress at all taxels under the known load [Pa], within the element's range; half the full scale is a
            good choice.
        readings: how many are averaged, at rest and under the load.

    Raises:
        TransducerError: the element is none, the pressure is not positive or beyond the element's range, the number of
            readings is not a positive whole number, the array reports something else than finite readings of its shape,
            or no taxel responds to the pressure.
    """
    require_element(element)
    shape = checked_shape(shape)
    require_positive("pressure", pressure, "a positive pressure in pascals, such as 1e3")
    if not (is_whole(readings) and readings > 0):
        raise TransducerError(f"readings = {shortened(readings)}; expected a positive whole number, such as 100.")
    nominal = float(element.signal(float(pressure)))
    if nominal > element.full_signal * (1.0 + _ROUNDING):
        range_end = float(element.stress(element.full_signal))
        raise TransducerError(
            f"pressure = {pressure:g} Pa is beyond the element's range, which ends at {range_end:.4g} Pa: every taxel "
            f"would report that, and gains would be wrong. Give a pressure within it, such as {range_end / 2:.3g} Pa, "
            "or an element of a wider range, see with_range."
        )
    rest = _mean_signal(array, element, np.zeros(shape), readings)
    loaded = _mean_signal(array, element, np.full(shape, float(pressure)), readings)
    gains = (loaded - rest) / nominal
    dead = gains < _DEAD
    if dead.all():
        raise TransducerError(
            f"no taxel reports a pressure of {pressure:g} Pa. Is the array connected? If it reports with a delay, let "
            "its function discard reports of the pressure before: only for a Transducer itself that is done here."
        )
    return Calibration(element, rest, gains, dead)


def _mean_signal(array: Callable[[Array], Array], element: Element, stress: Array, readings: int) -> Array:
    for _ in range(array.imperfections.delay if isinstance(array, Transducer) else 0):
        array(stress)  # reports of the pressure before
    reports = [finite_readings(array(stress)) for _ in range(readings)]
    if any(report.shape != stress.shape for report in reports):
        raise TransducerError(f"the array reports shape {reports[0].shape}; expected {stress.shape}. Give its shape=.")
    return np.mean([element.signal(report) for report in reports], axis=0)
