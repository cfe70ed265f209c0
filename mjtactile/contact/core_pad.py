"""Pads in the compiled core with the data for contacts: compliance, springs and range of small strains."""

from __future__ import annotations

import ctypes

from mjtactile._native import contiguous, library, pointer, sized
from mjtactile._types import Array
from mjtactile.contact.cells.compliance import surface_compliance
from mjtactile.contact.linear_range import linear_range, saturation
from mjtactile.contact.options import ContactOptions
from mjtactile.errors import NativeError
from mjtactile.influence.core_pad import CorePad, core_pad
from mjtactile.influence.matrices import InfluenceMatrices


def contact_pad(influence: InfluenceMatrices, *, stress: bool = False) -> CorePad:
    """A pad with stress matrices and data for contacts, one for each influence matrices; see `core_pad`."""
    pad = core_pad(influence, stress=stress)
    _give_surface(pad, influence, compliant=True)
    return pad


def press_pad(influence: InfluenceMatrices, *, compliant: bool) -> CorePad:
    """A pad without stress matrices, for contacts only; `compliant`: whether the law needs the surface compliance."""
    pad = CorePad(influence)
    _give_surface(pad, influence, compliant=compliant)
    return pad


def _give_surface(pad: CorePad, influence: InfluenceMatrices, *, compliant: bool) -> None:
    """Add the range of small strains and, if `compliant`, the surface compliance."""

    def hand_over() -> None:
        limits = contiguous([*linear_range(influence.pad), influence.pad.thickness])
        most = contiguous(saturation(influence.pad))
        library().mjt_pad_set_range(pad.handle, pointer(limits), pointer(most))
        if compliant:
            compliance = surface_compliance(influence)
            pieces = [contiguous(line) for line in compliance.lines]
            remainder = contiguous(compliance.spline_remainder[2, :, 2, :])
            library().mjt_pad_set_compliance(
                pad.handle,
                ctypes.c_double(compliance.normal_factor),
                *(part for line in pieces for part in sized(line)),
                pointer(remainder),
            )

    pad.give("surface", hand_over)


def core_names(options: ContactOptions) -> tuple[bytes, bytes]:
    """Names of law and tangential choice as arguments of the core.

    Raises:
        NativeError: the core does not have these names.
    """
    names = options.law.encode(), options.tangential.encode()
    if not library().mjt_knows(*names):
        raise NativeError(
            f"the compiled core has no law {options.law!r} with shear {options.tangential!r}. Every name in "
            "contact/laws.py and contact/tangentials.py must also be in native/core/contact/laws/by_name.cpp. Build "
            "the core again."
        )
    return names


def give_shear(pad: CorePad, influence: InfluenceMatrices) -> None:
    """Add the tangential compliance, which shear "stick" and "coulomb" need."""

    def hand_over() -> None:
        compliance = surface_compliance(influence)
        remainder = contiguous(compliance.spline_remainder)
        library().mjt_pad_set_tangential(pad.handle, ctypes.c_double(compliance.poisson), pointer(remainder))

    pad.give("shear", hand_over)


def give_springs(pad: CorePad, areas: Array, stiffnesses: Array) -> None:
    """Add the springs of law "foundation", as `foundation_springs` gives them; later calls for a pad have no effect."""

    def hand_over() -> None:
        of_areas, of_stiffnesses = contiguous(areas), contiguous(stiffnesses)
        count = ctypes.c_size_t(len(of_areas))
        library().mjt_pad_set_foundation(pad.handle, count, pointer(of_areas), pointer(of_stiffnesses))

    pad.give("springs", hand_over)
