"""What the compiled core needs of a pad to press on it: its compliance, and what contact laws ask for besides."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING

import numpy as np

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array
from mjtactile.contact.compliance import surface_compliance
from mjtactile.contact.linear_range import linear_range
from mjtactile.influence.core_pad import CorePad, PressedSurface, core_pad
from mjtactile.influence.matrices import InfluenceMatrices

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


def contact_pad(influence: InfluenceMatrices, *, stress: bool = False) -> CorePad:
    """A pad that is pressed and read, shared by all that use the same influence matrices; see `core_pad`."""
    return core_pad(influence, stress=stress, surface=lambda: pressed_surface(influence))


def press_pad(influence: InfluenceMatrices, *, compliant: bool) -> CorePad:
    """A pad that is pressed but not read, without stress matrices; `compliant`: whether the law asks how it gives."""
    return CorePad(influence, pressed_surface(influence) if compliant else None)


def pressed_surface(influence: InfluenceMatrices) -> PressedSurface:
    """The surface of a pad as the core presses on it."""
    compliance = surface_compliance(influence)
    return PressedSurface(
        linear_range(influence.pad),
        compliance.normal_factor,
        (contiguous(compliance.lines[0]), contiguous(compliance.lines[1])),
        (_coefficients(compliance.splines[0]), _coefficients(compliance.splines[1])),
        contiguous(compliance.remainder[2, :, 2, :]),
    )


def give_shear(pad: CorePad, influence: InfluenceMatrices) -> None:
    """Hand over what shear needs that does not spread in proportion to the pressure."""

    def hand_over() -> None:
        compliance = surface_compliance(influence)
        remainder = contiguous(compliance.remainder)
        library().mjt_pad_set_tangential(pad.handle, ctypes.c_double(compliance.poisson), pointer(remainder))

    pad.give("shear", hand_over)


def give_springs(pad: CorePad, areas: Array, stiffnesses: Array) -> None:
    """Hand over the springs of law "foundation", see `foundation_springs`."""

    def hand_over() -> None:
        of_areas, of_stiffnesses = contiguous(areas), contiguous(stiffnesses)
        count = ctypes.c_size_t(len(of_areas))
        library().mjt_pad_set_foundation(pad.handle, count, pointer(of_areas), pointer(of_stiffnesses))

    pad.give("springs", hand_over)


def _coefficients(spline: PPoly) -> Array:
    """Of a quadratic spline, (3, intervals, patches), highest power first."""
    coefficients = np.asarray(spline.c)
    return contiguous(np.concatenate([np.zeros((3 - len(coefficients), *coefficients.shape[1:])), coefficients]))
