"""Checks of the numbers given to sensing elements."""

from __future__ import annotations

import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import TransducerError, shortened
from mjtactile.units import finite_number, real_numbers


def require_positive(name: str, value: object, expected: str = "a positive number in SI units") -> None:
    """Check a value of a sensing element.

    Raises:
        TransducerError: it is not a positive, finite number.
    """
    if not finite_number(value) > 0.0:
        raise TransducerError(f"{name} = {shortened(value)}; expected {expected}.")


def require_numbers(name: str, values: npt.ArrayLike, expected: str) -> Array:
    """Values given to a sensing element as an array of the same shape; NaN and infinity are accepted.

    Raises:
        TransducerError: they are not real numbers.
    """
    numbers = real_numbers(values)
    if numbers is None:
        raise TransducerError(f"{name} = {shortened(values)}; expected {expected}.")
    return numbers.astype(float, copy=False)


def require_stress(stress: npt.ArrayLike) -> Array:
    """A stress [Pa] as an array of the same shape.

    Raises:
        TransducerError: it is not of real numbers.
    """
    return require_numbers("stress", stress, "stresses in pascals")


def require_signal(signal: npt.ArrayLike) -> Array:
    """A signal [V] as an array of the same shape.

    Raises:
        TransducerError: it is not of real numbers.
    """
    return require_numbers("signal", signal, "signals in volts")


def require_vectors(name: str, values: npt.ArrayLike, components: int, expected: str) -> Array:
    """Vectors given to a sensing element as an array, shape (..., components); `expected` says what they are.

    Raises:
        TransducerError: they are not real numbers, or the last axis has another length.
    """
    numbers = require_numbers(name, values, expected)
    if numbers.shape[-1:] != (components,):
        raise TransducerError(f"{name} has shape {numbers.shape}; expected (..., {components}): {expected}.")
    return numbers
