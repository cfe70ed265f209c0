"""Imperfections of real arrays: noise, spread, dead taxels, crosstalk, hysteresis, delay and resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.errors import TransducerError, shortened
from mjtactile.units import finite_number, is_whole


@dataclass(frozen=True, kw_only=True)
class Imperfections:
    """Differences between an array and its nominal elements; by default there are none.

    Raises:
        TransducerError: a value is outside its range.
    """

    noise: float = 0.0  #: standard deviation of each sample's noise over the full signal [-]
    signal_noise: float = 0.0  #: standard deviation of noise over the taxel's own signal [-]
    gain_spread: float = 0.0  #: standard deviation of the taxels' gains about 1 [-]
    offset_spread: float = 0.0  #: standard deviation of the taxels' signals at rest over the full signal [-]
    dead: float = 0.0  #: share of the taxels that always report rest [-]
    dead_taxels: tuple[tuple[int, ...], ...] = ()  #: dead for certain: (layer, row, column), of free taxels (taxel,)
    crosstalk: float = 0.0  #: fraction of a taxel's stress that goes to each of its four neighbours in the layer [-]
    hysteresis: float = 0.0  #: relative excess of the reading while the load decreases [-]
    delay: int = 0  #: number of calls between a reading and its report
    adc_bits: int | None = None  #: resolution of the converter over the signal's range; None: not rounded

    def __post_init__(self) -> None:
        for name, most in (
            ("noise", math.inf),
            ("signal_noise", math.inf),
            ("gain_spread", 0.3),
            ("offset_spread", math.inf),
            ("dead", 1.0),
            ("crosstalk", 0.25),
            ("hysteresis", math.inf),
        ):
            value = getattr(self, name)
            if not 0.0 <= finite_number(value) <= most:
                limits = f"from 0 to {most:g}" if math.isfinite(most) else "of at least 0"
                raise TransducerError(f"{name} = {shortened(value)}; expected a share {limits}: 1 % is 0.01.")
        dead = self.dead_taxels
        if not isinstance(dead, list | tuple) or not all(
            isinstance(taxel, list | tuple) and all(is_whole(k) and k >= 0 for k in taxel) for taxel in dead
        ):
            raise TransducerError(
                f"dead_taxels = {shortened(dead)}; expected the whole numbers (layer, row, column) of each, such as "
                "((0, 6, 5),), or (taxel,) of free taxels."
            )
        # Tuples of int, so that equal imperfections have equal hashes.
        object.__setattr__(self, "dead_taxels", tuple(tuple(map(int, taxel)) for taxel in dead))
        if not (is_whole(self.delay) and self.delay >= 0):
            raise TransducerError(f"delay = {shortened(self.delay)}; expected a whole number of calls, 0 for none.")
        if self.adc_bits is not None and not (is_whole(self.adc_bits) and 1 <= self.adc_bits <= 32):
            raise TransducerError(
                f"adc_bits = {shortened(self.adc_bits)}; expected 1 to 32, or None for signals not rounded."
            )


#: Imperfections assumed for a good array of today: a starting point, not a measurement.
TYPICAL = Imperfections(
    noise=2e-3, gain_spread=0.01, offset_spread=1e-3, crosstalk=0.01, hysteresis=0.01, dead=0.003, adc_bits=12
)


def coupled(stress: Array, crosstalk: float) -> Array:
    """Stress [Pa] after crosstalk: each taxel passes a fraction of its own to each of its four neighbours in the layer.

    Taxels at the rim have fewer neighbours and keep the rest, so the sum over a layer and uniform fields do not change.

    Args:
        stress: (..., rows, columns) [Pa].
        crosstalk: the fraction c [-]; a taxel with four neighbours keeps 1 - 4 c.
    """
    if crosstalk == 0.0:
        return stress
    mixed = stress.copy()
    for axis in (-2, -1):
        # The exchange between two neighbours is c times their difference.
        flow = crosstalk * np.diff(stress, axis=axis)
        none = [(0, 0)] * stress.ndim
        before, after = none.copy(), none.copy()
        before[axis], after[axis] = (1, 0), (0, 1)
        mixed += np.pad(flow, after) - np.pad(flow, before)
    return mixed


def lagging(stress: Array, before: Array, hysteresis: float) -> Array:
    """Stress with hysteresis on unloading: the play operator on a relative scale.

    The report follows an increasing stress exactly. While the stress decreases, the report stays constant until the
    stress is 1 / (1 + h) of it, then follows (1 + h) times the stress. The loop is independent of rate and closes at
    zero (Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989), on a logarithmic scale).

    Args:
        stress: current stress [Pa], any shape.
        before: what was reported one sample before [Pa], same shape.
        hysteresis: h [-].
    """
    return np.minimum(np.maximum(before, stress), (1.0 + hysteresis) * stress)
