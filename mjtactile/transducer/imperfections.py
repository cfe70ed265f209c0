"""What sets a real array apart from its data sheet: noise, spread, dead and coupled taxels, memory, counts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.transducer.capacitive import TransducerError


@dataclass(frozen=True, kw_only=True)
class Imperfections:
    """How an array differs from its nominal elements; the defaults are an ideal array.

    Raises:
        TransducerError: for a value outside its range.
    """

    noise: float = 0.0  #: standard deviation of each sample's noise over the full signal [-]
    signal_noise: float = 0.0  #: standard deviation of noise over the taxel's own signal [-]
    gain_spread: float = 0.0  #: standard deviation of the taxels' gains about 1 [-]
    offset_spread: float = 0.0  #: standard deviation of the taxels' signals at rest over the full signal [-]
    dead: float = 0.0  #: share of the taxels that always report rest [-]
    dead_taxels: tuple[tuple[int, ...], ...] = ()  #: dead for certain: (layer, row, column), of free taxels (taxel,)
    crosstalk: float = 0.0  #: share of its signal a taxel gives to each of its four neighbours in the layer [-]
    hysteresis: float = 0.0  #: by how much a taxel reads too high while it is unloaded, over the reading [-]
    delay: int = 0  #: calls after which a reading comes out
    adc_bits: int | None = None  #: of the converter over the signal's range; None: not rounded

    def __post_init__(self) -> None:
        """Refuse values outside their ranges."""
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
            if not (math.isfinite(value) and 0.0 <= value <= most):
                raise TransducerError(
                    f"{name} = {value}; expected a share from 0 to {most:g}: 1 % is 0.01."
                    if math.isfinite(most)
                    else f"{name} = {value}; expected a share of at least 0: 1 % is 0.01."
                )
        if not (isinstance(self.delay, int) and self.delay >= 0):
            raise TransducerError(f"delay = {self.delay!r}; expected a whole number of calls, 0 for none.")
        if self.adc_bits is not None and not (isinstance(self.adc_bits, int) and 1 <= self.adc_bits <= 32):
            raise TransducerError(f"adc_bits = {self.adc_bits!r}; expected 1 to 32, or None for signals not rounded.")


#: What a good array does today, all at once: a starting point, not a measurement (ours).
TYPICAL = Imperfections(
    noise=2e-3, gain_spread=0.01, offset_spread=1e-3, crosstalk=0.01, hysteresis=0.01, dead=0.003, adc_bits=12
)


def coupled(stress: Array, crosstalk: float) -> Array:
    """Stress after each taxel gave a share of it to each of its four neighbours in the layer.

    What stands at the rim has fewer neighbours and keeps the rest: the sum over a layer stays, and so does a uniform
    field.

    Args:
        stress: (..., rows, columns) [Pa].
        crosstalk: the share c [-]; a taxel with four neighbours keeps 1 - 4 c.
    """
    if crosstalk == 0.0:
        return stress
    mixed = stress.copy()
    for axis in (-2, -1):
        # What flows between two neighbours is c times their difference.
        flow = crosstalk * np.diff(stress, axis=axis)
        none = [(0, 0)] * stress.ndim
        before, after = none.copy(), none.copy()
        before[axis], after[axis] = (1, 0), (0, 1)
        mixed += np.pad(flow, after) - np.pad(flow, before)
    return mixed


def lagging(stress: Array, before: Array, hysteresis: float) -> Array:
    """What a taxel that lags on unloading reports: the play operator on a relative scale.

    It follows a rising stress exactly; on unloading it stays until the stress is 1 / (1 + h) of what it reports, then
    follows (1 + h) times the stress: a rate-independent loop that closes at zero (Krasnosel'skii and Pokrovskii,
    Systems with Hysteresis (1989), on a logarithmic scale).

    Args:
        stress: now [Pa].
        before: reported one sample before [Pa], same shape.
        hysteresis: h [-].
    """
    return np.minimum(np.maximum(before, stress), (1.0 + hysteresis) * stress)
