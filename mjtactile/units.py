"""Quantities as people type them at a command line, into SI units and back."""

from __future__ import annotations

import math
import re

from mjtactile.errors import UnitError

#: Of any seed; larger ones would be drawn from as well, but other programs could not read them back.
MOST_SEED = 2**63 - 1
#: Of noise over the largest reading: beyond this there is nothing left to see.
MOST_NOISE = 10.0
#: Presses of a dataset: files' names count them with nine digits.
MOST_PRESSES = 10**9 - 1

#: One gram-force [N], by definition of standard gravity.
GRAM_FORCE = 9.80665e-3
MILLIMETRE = 1e-3
#: Smaller forces than this move nothing [N]: the weight of a microgram is ten times as much.
LEAST_FORCE = 1e-9

_FORCE_UNITS = {"gf": GRAM_FORCE, "n": 1.0, "mn": 1e-3}


def parse_force(text: str) -> float:
    """A pressing force [N] from text such as "100gf", "0.98N" or "980 mN".

    Raises:
        UnitError: without a unit, or not a positive number of at least `LEAST_FORCE`.
    """
    match = re.fullmatch(r"\s*([-+]?[0-9.]+(?:e[-+]?[0-9]+)?)\s*([a-z]*)\s*", text, flags=re.IGNORECASE)
    unit = match.group(2).lower() if match else ""
    value = _number(match.group(1)) if match else None
    if value is None or unit not in _FORCE_UNITS:
        raise UnitError(f"force {text!r} is not a number with a unit; expected for example 100gf, 0.98N or 980mN.")
    if not (math.isfinite(value) and value > 0.0):
        raise UnitError(f"force {text!r} does not press; expected a positive force. Its direction is set by --tilt.")
    force = value * _FORCE_UNITS[unit]
    if not (math.isfinite(force) and force >= LEAST_FORCE):
        raise UnitError(f"force {text!r} is too small to press; expected at least {LEAST_FORCE:g} N.")
    return force


def parse_millimetres(name: str, text: str) -> tuple[float, float]:
    """Two lengths [m] from text such as "1.25,0" in millimetres.

    Raises:
        UnitError: when there are not two finite numbers.
    """
    values = [_number(part) for part in text.split(",")]
    if len(values) != 2 or any(v is None or not math.isfinite(v) for v in values):
        raise UnitError(f"{name} {text!r} is not two numbers; expected x,y in millimetres, for example 1.25,0.")
    x, y = (float(v) * MILLIMETRE for v in values if v is not None)
    return x, y


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
