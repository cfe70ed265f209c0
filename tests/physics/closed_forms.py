"""Closed forms of elasticity that the pad's finite elements must reproduce."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ellipe

from mjtactile._types import Array
from mjtactile.pad import Layer


class AxisStress(NamedTuple):
    axial: Array  #: sigma_zz [Pa], tension positive
    radial: Array  #: sigma_rr = sigma_tt [Pa]


def disc_stress_on_axis(depth: Array, *, radius: float, pressure: float, poisson: float) -> AxisStress:
    """Stress under the middle of a disc of uniform pressure on a half space.

    With s = z / sqrt(a^2 + z^2):
        sigma_zz = -p (1 - s^3),
        sigma_rr = -p/2 ((1 + 2 nu) - 2 (1 + nu) s + s^3).

    Args:
        depth: below the surface [m].
        radius: a [m].
        pressure: p [Pa].
        poisson: nu [-].

    Source: A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377; K. L. Johnson, Contact Mechanics (1985), eq. 3.33.
    """
    s = depth / np.hypot(depth, radius)
    return AxisStress(-pressure * (1 - s**3), -pressure / 2 * ((1 + 2 * poisson) - 2 * (1 + poisson) * s + s**3))


def disc_surface_sinking(distance: Array, *, radius: float, pressure: float, young: float, poisson: float) -> Array:
    """How far the surface sinks [m] at a distance from the middle of a disc of uniform pressure, within the disc.

        u(r) = 4 (1 - nu^2) p a E(r / a) / (pi E), E(k) the complete elliptic integral of the second kind.

    Source: K. L. Johnson, Contact Mechanics (1985), eq. 3.29a.
    """
    modulus = young / (1 - poisson**2)
    return 4 * pressure * radius / (np.pi * modulus) * ellipe((distance / radius) ** 2)


def confined_modulus(layer: Layer) -> float:
    """Stress over strain of a layer that cannot spread [Pa]: E (1 - nu) / ((1 + nu) (1 - 2 nu))."""
    nu = layer.poisson
    return layer.young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
