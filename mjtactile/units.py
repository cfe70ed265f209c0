"""Numbers as users give them: checked, typed at a command line with their units, and their limits."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from numbers import Integral, Real
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from mjtactile.errors import UnitError

#: Largest seed: other programs cannot read larger integers from our files.
MOST_SEED = 2**63 - 1
#: Largest noise relative to the largest reading [-].
MOST_NOISE = 10.0
#: Largest number of presses of a dataset: names of its files have nine digits.
MOST_PRESSES = 10**9 - 1

#: One gram-force [N], by definition of standard gravity.
GRAM_FORCE = 9.80665e-3
#: One millimetre [m].
MILLIMETRE = 1e-3
#: Least pressing force [N], a tenth of the weight of a microgram.
LEAST_FORCE = 1e-9

_FORCE_UNITS = {"gf": GRAM_FORCE, "n": 1.0, "mn": 1e-3}


def finite_number(value: object) -> float:
    """A finite real number of Python or NumPy as a float; NaN for everything else, such as text, a bool or infinity."""
    if isinstance(value, str | bytes | bool | np.bool_ | np.complexfloating):
        return math.nan
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan
    return number if math.isfinite(number) else math.nan


def real_numbers(values: object) -> npt.NDArray[Any] | None:
    """Values as an array of real numbers, of any shape; NaN and infinity are accepted.

    NumPy converts text to numbers silently, and drops imaginary parts with a mere warning. Here both are refused.

    Returns:
        The array, of the values' own type if that is a real one, and not copied then; None for everything else, such as
        text, complex numbers or rows of different lengths.
    """
    try:
        numbers = np.asarray(values)
        if numbers.dtype.kind in "biuf":
            return numbers
        # Objects are fractions, integers beyond 64 bits, and such.
        if numbers.dtype.kind != "O" or not all(isinstance(one, Real | Decimal) for one in numbers.flat):
            return None
        return numbers.astype(float)
    except (TypeError, ValueError, OverflowError):
        return None


def is_whole(value: object) -> TypeGuard[int]:
    """Whether a value is a whole number of Python or NumPy; a bool is none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def parse_force(text: str) -> float:
    """A pressing force [N] from text such as "100gf", "0.98N" or "980 mN".

    Raises:
        UnitError: the unit is missing or unknown, or the force is not at least `LEAST_FORCE`.
    """
    number = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?"
    match = re.fullmatch(rf"\s*({number})\s*([a-z]*)\s*", text, flags=re.IGNORECASE)
    unit = match.group(2) if match else ""
    # Any case will do, but a capital M is mega, not milli.
    unit = unit if unit.startswith("M") else unit.lower()
    if match is None or unit not in _FORCE_UNITS:
        raise UnitError(
            f"force {text!r} is not a number with unit gf, N or mN; expected for example 100gf, 0.98N or 980mN."
        )
    value = float(match.group(1))
    if not (math.isfinite(value) and value > 0.0):
        raise UnitError(f"force {text!r} does not press; expected a positive force. Its direction is set by --tilt.")
    force = value * _FORCE_UNITS[unit]
    if not (math.isfinite(force) and force >= LEAST_FORCE):
        raise UnitError(f"force {text!r} is too small to press; expected at least {LEAST_FORCE:g} N.")
    return force


def parse_millimetres(name: str, text: str) -> tuple[float, float]:
    """Two lengths [m] from text such as "1.25,0" in millimetres; `name` is that of the option, for the error message.

    Raises:
        UnitError: the text is not two finite numbers.
    """
    try:
        x, y = map(float, text.split(","))
    except ValueError:
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise UnitError(f"{name} {text!r} is not two numbers; expected x,y in millimetres, for example 1.25,0.")
    return x * MILLIMETRE, y * MILLIMETRE
