"""Transducers in datasets: readings as hardware reports them, from a table in the specification.

    [transducer]
    name = "capacitive"      # or "piezoresistive"
    full_scale = 100e3       # [Pa]
    imperfections = { noise = 0.002, gain_spread = 0.01, dead = 0.003, adc_bits = 12 }

Every press has an array of its own, drawn from the press's seed, and is the only sample of that array. So delay and
hysteresis, which act from one sample to the next, are refused.
"""

from __future__ import annotations

from typing import Any

from mjtactile.errors import DatasetError, shortened
from mjtactile.transducer.array import ELEMENTS, Transducer
from mjtactile.transducer.imperfections import Imperfections
from mjtactile.units import finite_number


def transducer_for(values: dict[str, Any], shape: tuple[int, ...], seed: int) -> Transducer:
    """An array of the transducers that a table describes.

    Args:
        values: table [transducer] of the specification.
        shape: shape of one set of readings, (layers, rows, columns) or (taxels,).
        seed: seed of the array's gains, offsets and noise.

    Raises:
        DatasetError: the table names no transducer, has an unknown entry, or has a delay or hysteresis.
        TransducerError: a value is outside its range, or crosstalk is given for free taxels.
    """
    if not isinstance(values, dict):
        raise DatasetError(f"transducer = {values!r}; expected a table [transducer] with a name.")
    unknown = set(values) - {"name", "full_scale", "imperfections"}
    if unknown:
        raise DatasetError(f"[transducer] has no entry {sorted(unknown)}. Available: name, full_scale, imperfections.")
    full_scale = values.get("full_scale", 100e3)
    if not 1.0 <= finite_number(full_scale) <= 1e9:
        raise DatasetError(f"[transducer] full_scale = {shortened(full_scale)}; expected a stress of 1 to 1e9 Pa.")
    try:
        imperfections = Imperfections(**values.get("imperfections", {}))
    except TypeError as error:
        raise DatasetError(f"[transducer] imperfections: {error}. Expected the arguments of Imperfections.") from None
    for name in ("delay", "hysteresis"):
        value = getattr(imperfections, name)
        if value > 0:
            raise DatasetError(
                f"[transducer] imperfections: {name} = {value} acts from one sample to the next, but every press of a "
                "dataset is a single sample of a new array. Leave it out."
            )
    name = values.get("name")
    if not (isinstance(name, str) and name in ELEMENTS):
        raise DatasetError(f"[transducer] name = {name!r}; expected {' or '.join(map(repr, ELEMENTS))}.")
    return Transducer(ELEMENTS[name].with_range(full_scale), imperfections, shape=shape, seed=seed)
