"""The range of small strains, in which the linear model holds, and the readings at which taxels saturate."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.pad import Pad

#: Largest mean pressure, shear counted, over the top layer's modulus for small strains [-].
LINEAR_RANGE = 0.1
#: Largest indentation over the sheet's thickness for small strains [-].
LINEAR_INDENTATION = 0.1
#: End of a sentence about strains that are not small.
APPROXIMATE = (
    "the readings of this linear model are only approximate. Press less hard or over a larger area, or use a stiffer "
    "or thicker pad."
)
#: Reading at which a taxel saturates over the modulus of its material [-].
SATURATION = 1.2


def linear_range(pad: Pad) -> tuple[float, float]:
    """Largest mean pressure [Pa] and indentation [m] for small strains."""
    return LINEAR_RANGE * pad.layers[0].young, LINEAR_INDENTATION * pad.thickness


def saturation(pad: Pad) -> Array:
    """Readings [Pa] at which the taxels of each sensing layer saturate under a contact, shape (layers,).

    The pressure on a contact cell is at most the top layer's modulus, so such a stress is possible in every layer. In a
    stiffer layer within a taxel's ball, stresses up to that layer's modulus are possible.
    """
    tops = np.concatenate([[0.0], np.cumsum([layer.thickness for layer in pad.layers])])
    moduli = np.array([layer.young for layer in pad.layers])
    depths, radii = np.array(pad.sensed_depths)[:, None], np.array(pad.sensed_radii)[:, None]
    met = (tops[:-1] < depths + radii) & (tops[1:] > depths - radii)
    least = SATURATION * np.maximum(np.where(met, moduli, 0.0).max(axis=1), moduli[0])
    return least if pad.depths else least.max(keepdims=True)  # free taxels are one layer


def beyond_linear_range(pad: Pad, pressure: float, indentation: float) -> str | None:
    """A sentence on how a contact exceeds the range of small strains; None if it does not.

    Args:
        pad: the pad.
        pressure: sqrt(p^2 + 3 t^2) of the mean pressure p and shear t over the contact area [Pa].
        indentation: largest indentation of the surface [m]; NaN if unknown.
    """
    most_pressure, most_indentation = linear_range(pad)
    if pressure > most_pressure:
        limit = f"{LINEAR_RANGE:.0%} of the top layer's modulus, {pad.layers[0].young:.3g} Pa"
        reason = f"the mean pressure, shear counted, is {pressure:.3g} Pa, which is over {limit}"
    elif indentation > most_indentation:
        limit = f"{LINEAR_INDENTATION:.0%} of the pad's thickness, {pad.thickness * 1e3:.3g} mm"
        reason = f"the indentation, {indentation * 1e3:.3g} mm, is over {limit}"
    else:
        return None
    return f"{reason}: strains are no longer small, so {APPROXIMATE}"
