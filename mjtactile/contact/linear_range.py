"""Where strains count as small, as the linear model takes them to be."""

from __future__ import annotations

from mjtactile.pad import Pad

#: Mean pressure over the top layer's modulus above which strains are no longer small.
LINEAR_RANGE = 0.1
#: Indentation over the sheet's thickness above which they are not either.
LINEAR_INDENTATION = 0.1


def linear_range(pad: Pad) -> tuple[float, float]:
    """Mean pressure [Pa] and indentation [m] up to which strains count as small."""
    return LINEAR_RANGE * pad.layers[0].young, LINEAR_INDENTATION * pad.thickness


def beyond_linear_range(pad: Pad, pressure: float, approach: float) -> str | None:
    """What is wrong with a contact of this mean pressure [Pa] and indentation [m]; None within the linear range."""
    most_pressure, most_approach = linear_range(pad)
    if pressure > most_pressure:
        limit = f"{LINEAR_RANGE:.0%} of the top layer's modulus, {pad.layers[0].young:.3g} Pa"
        reason = f"the mean pressure, {pressure:.3g} Pa, is over {limit}"
    elif approach > most_approach:
        limit = f"{LINEAR_INDENTATION:.0%} of the pad's thickness, {pad.thickness * 1e3:.3g} mm"
        reason = f"the indentation, {approach * 1e3:.3g} mm, is over {limit}"
    else:
        return None
    return f"{reason}: strains are no longer small and the readings of this linear model are too simple there."
