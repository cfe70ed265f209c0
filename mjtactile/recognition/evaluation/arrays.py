"""Transducer arrays for the evaluation of recognisers: each imperfection alone, and all together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.transducer.array import Element, Transducer
from mjtactile.transducer.calibration import calibrate
from mjtactile.transducer.capacitive import CapacitiveCell
from mjtactile.transducer.imperfections import TYPICAL, Imperfections
from mjtactile.transducer.piezoresistive import PiezoresistiveElement

#: Full scale of all arrays [Pa], the peak reading under 200 gf on a 3 mm disc.
FULL_SCALE = 100e3
#: Number of random arrays of each kind; each reads a part of the presses.
_DRAWN = 20
#: Number of readings in averages, 80 ms at 200 Hz.
SEVERAL = 16
_CAPACITIVE, _PIEZORESISTIVE = CapacitiveCell.with_range(FULL_SCALE), PiezoresistiveElement.with_range(FULL_SCALE)


@dataclass(frozen=True, kw_only=True)
class TransducerArray:
    """A kind of array, with the processing of its readings before recognition."""

    element: Element = _CAPACITIVE  #: kind of the array's elements
    imperfections: Imperfections  #: imperfections of the array
    #: Number of readings that are averaged. This reduces the transducers' noise, not that of the presses.
    readings: int = 1
    calibrated: bool = False  #: whether gains and offsets are calibrated first

    def reported(self, presses: Array, seed: int) -> Array:
        """Readings [Pa] as arrays of this kind report them; each of several random arrays reads a part of the presses.

        Args:
            presses: ideal readings, (presses, layers, rows, columns) [Pa].
            seed: seed of the first array; the others have the seeds that follow.
        """
        shares = enumerate(np.array_split(presses, _DRAWN))
        return np.concatenate([self._of_one(share, seed + k) for k, share in shares if len(share)])

    def _of_one(self, presses: Array, seed: int) -> Array:
        shape = presses.shape[1:]
        array = Transducer(self.element, self.imperfections, shape=shape, seed=seed)
        calibration = calibrate(array, self.element, shape=shape, pressure=FULL_SCALE / 3) if self.calibrated else None
        array.reset()
        mean = np.mean([array(presses) for _ in range(self.readings)], axis=0)
        return mean if calibration is None else calibration(mean)


#: Arrays by their names in the tables.
ARRAYS = {
    "capacitive, 12 bits": TransducerArray(imperfections=Imperfections(adc_bits=12)),
    "piezoresistive, 12 bits": TransducerArray(element=_PIEZORESISTIVE, imperfections=Imperfections(adc_bits=12)),
    "gains off by 1 %": TransducerArray(imperfections=Imperfections(gain_spread=0.01)),
    "crosstalk of 1 %": TransducerArray(imperfections=Imperfections(crosstalk=0.01)),
    "0.3 % of taxels dead": TransducerArray(imperfections=Imperfections(dead=0.003)),
    "noise of 0.2 % of full scale": TransducerArray(imperfections=Imperfections(noise=0.002)),
    "capacitive, typical": TransducerArray(imperfections=TYPICAL),
    "piezoresistive, typical": TransducerArray(element=_PIEZORESISTIVE, imperfections=TYPICAL),
    "capacitive, typical, calibrated": TransducerArray(imperfections=TYPICAL, calibrated=True),
    f"capacitive, typical, mean of {SEVERAL} readings": TransducerArray(imperfections=TYPICAL, readings=SEVERAL),
    f"capacitive, typical, calibrated, mean of {SEVERAL}": TransducerArray(
        imperfections=TYPICAL, readings=SEVERAL, calibrated=True
    ),
}


def noisy(readings: Array, noise: float, seed: int) -> Array:
    """Readings (presses, ...) [Pa] plus white noise; `noise` is its standard deviation over the largest reading [-]."""
    peak = readings.max(axis=(1, 2, 3), keepdims=True)
    return readings + noise * peak * np.random.default_rng([seed, 99]).standard_normal(readings.shape)
