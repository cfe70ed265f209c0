"""Closed forms of elasticity that the pad's finite elements must reproduce."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import root_scalar
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


def paraboloid_on_bonded_layer(chi: float) -> float:
    """Force over Hertz's that a rigid paraboloid without friction needs on a bonded incompressible layer.

    Pressure p(r) is the Abel transform of phi(t), t < a; the layer's compliance over the half space's is, w = k h,
        M(w) = (sinh 2w - 2w) / (cosh 2w + 1 + 2 w^2),
    so that  phi(t) - 2 / pi int_0^a phi(s) int_0^inf (1 - M) cos kt cos ks dk ds = depth - t^2 / R,  and phi(a) = 0
    where the pressure ends. Here h, R and the contact modulus are 1; the integrals are Gauss', to rounding.

    Args:
        chi: sqrt(R depth) / h [-], 0.02 to 1.

    Source: Hayes, Keer, Herrmann, Mockros, J. Biomech. 5 (1972) 541, sections 2 and 4.
    """
    radius = root_scalar(lambda a: np.sqrt(_depth_and_force(a)[0]) - chi, bracket=(0.01, 2.0)).root
    depth, force = _depth_and_force(radius)
    return force / (4 / 3 * depth**1.5)


def _depth_and_force(radius: float) -> tuple[float, float]:
    """Depth and force at which the contact has this radius, all over the layer's thickness."""
    (nodes, weights), (waves, wave_weights) = (np.polynomial.legendre.leggauss(n) for n in (40, 400))
    places, weights = np.append(radius * (nodes + 1) / 2, radius), weights * radius / 2
    waves, wave_weights = 10.0 * (waves + 1), 10.0 * wave_weights  # beyond 20, 1 - M is below 1e-14
    decay = np.exp(-2 * waves)
    layer = ((1 - decay**2) / 2 - 2 * waves * decay) / ((1 + decay**2) / 2 + decay * (1 + 2 * waves**2))
    cosines = np.cos(np.outer(places, waves))
    kernel = 2 / np.pi * (cosines * ((1 - layer) * wave_weights)) @ cosines[:-1].T * weights
    system = np.eye(len(places))
    system[:, :-1] -= kernel
    of_depth, of_shape = np.linalg.solve(system, np.column_stack([np.ones(len(places)), places**2])).T
    depth = of_shape[-1] / of_depth[-1]
    return float(depth), float(2 * weights @ (depth * of_depth - of_shape)[:-1])
