"""Stress in an elastic layer without end, bonded to a rigid base, under a ball's pressure: by Hankel transforms.

    python tests/reference/bonded_layer.py    # writes benchmarks/small_contacts.npz

Nothing here is discretised in space, so contacts of any size come out alike. That tells how much of a small contact the
elements of a mesh miss. Displacements are u_r = integral U(z) J1(kr) k dk and u_z = integral W(z) J0(kr) k dk, with z
downward: the waves of layered_sheet.py, summed over all directions (Sneddon, *Fourier Transforms*, 1951, chapter 10).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from layered_sheet import plane_state, plane_waves, wave_factors
from scipy.special import j0, j1

from mjtactile._types import Array
from mjtactile.pad import Layer, Pad

#: Where the cases of the benchmark are stored.
DATA = Path(__file__).resolve().parents[2] / "benchmarks" / "small_contacts.npz"
#: Contact radii [m] and places of the load [m]: the pad's middle, and others near it.
RADII = np.array([0.15e-3, 0.3e-3, 0.6e-3, 1.2e-3])
PLACES = np.vstack([np.zeros(2), np.random.default_rng(3).uniform(-2e-3, 2e-3, (8, 2))])
#: Readings are compared up to this distance from the load [m]. Further out the sides of the pad change them.
REACH = 2.5e-3
#: Wave numbers go up to this many over the least depth. There the integrand has fallen by e^-17.
_WAVES_PER_DEPTH = 17.0
#: Points of the integral over wave numbers.
_WAVES = 1500


def stresses(layer: Layer, radius: float, depths: Array, distances: Array) -> Array:
    """Stress in a layer under Hertz's pressure of 1 N over a circle.

    Args:
        layer: bonded to a rigid base.
        radius: of the circle [m].
        depths: below the surface [m], shape (m,).
        distances: from the circle's axis [m], shape (n,).

    Returns:
        radial, hoop and axial stress and the shear of radius and depth [Pa], shape (m, n, 4); tension positive.
    """
    points, weights = np.polynomial.legendre.leggauss(_WAVES)
    most = _WAVES_PER_DEPTH / depths.min()
    k, dk = (points + 1) * most / 2, weights * most / 2
    peak, ka = 1.5 / (np.pi * radius**2), k * radius
    pressure = peak * radius**2 * (np.sin(ka) - ka * np.cos(ka)) / ka**3
    factors = wave_factors((layer,), plane_state, k)[..., 0] * (-pressure * k * dk)[:, None]
    bessel, slope = j0(np.outer(distances, k)), j1(np.outer(distances, k))
    lame, shear = layer.lame_lambda, layer.shear_modulus
    found = np.empty((len(depths), len(distances), 4))
    for depth, row in zip(depths, found, strict=True):
        u, w, du, dw = (np.sum(one * factors, axis=1) for one in plane_waves(layer, k, depth))
        dilatation, stretch, moved = bessel @ (k * (u + dw)), bessel @ (k * u), slope @ u
        # u_r / r tends to half the stretch of the axis.
        hoop = np.divide(moved, distances, out=stretch / 2, where=distances > 0.0)
        row[:, 0] = lame * dilatation + 2 * shear * (stretch - hoop)
        row[:, 1] = lame * dilatation + 2 * shear * hoop
        row[:, 2] = lame * dilatation + 2 * shear * (bessel @ (k * dw))
        row[:, 3] = shear * (slope @ (k * (du - w)))
    return found


def top_readings(pad: Pad, radius: float, place: Array) -> Array:
    """Readings of a pad's top taxels under a ball's pressure of 1 N, as if the pad had no sides.

    Args:
        pad: of one layer.
        radius: of the contact [m].
        place: of its middle in the pad frame [m], shape (2,).

    Returns:
        mean von Mises stress over the taxels' balls [Pa], (rows, columns); NaN beyond REACH.
    """
    (layer,) = pad.layers
    points, weights = ball_rule(6)
    points = points * pad.sampling_radius
    levels, level = np.unique(np.round(pad.depths[0] + points[:, 2], 12), return_inverse=True)
    grid = np.linspace(0.0, REACH + pad.sampling_radius, 400)
    stress = stresses(layer, radius, levels, grid)
    x, y = np.meshgrid(pad.grid.x, pad.grid.y)
    away = np.hypot(x - place[0], y - place[1])
    readings = np.full(away.shape, np.nan)
    for taxel in zip(*np.nonzero(away <= REACH), strict=True):
        distances = np.hypot(x[taxel] + points[:, 0] - place[0], y[taxel] + points[:, 1] - place[1])
        after = np.clip(np.searchsorted(grid, distances), 1, len(grid) - 1)
        share = ((distances - grid[after - 1]) / (grid[after] - grid[after - 1]))[:, None]
        readings[taxel] = weights @ von_mises((1 - share) * stress[level, after - 1] + share * stress[level, after])
    return readings


def von_mises(stress: Array) -> Array:
    """Von Mises stress of (..., 4) stresses as `stresses` gives them."""
    radial, hoop, axial, shear = np.moveaxis(stress, -1, 0)
    return np.sqrt(((radial - hoop) ** 2 + (hoop - axial) ** 2 + (axial - radial) ** 2) / 2 + 3 * shear**2)


def ball_rule(count: int) -> tuple[Array, Array]:
    """Points (points, 3) and weights of the mean over the unit ball, by Gauss in radius and height."""
    x, weights = np.polynomial.legendre.leggauss(count)
    radius, height, turn = np.meshgrid(
        (x + 1) / 2, x, 2 * np.pi * (np.arange(2 * count) + 0.5) / (2 * count), indexing="ij"
    )
    aside = np.sqrt(1 - height**2)
    points = radius[..., None] * np.stack([aside * np.cos(turn), aside * np.sin(turn), height], axis=-1)
    share = 3 * ((x + 1) / 2) ** 2 * weights / 2
    shares = np.broadcast_to((share[:, None] * weights / 2)[..., None] / (2 * count), turn.shape)
    return points.reshape(-1, 3), shares.ravel()


if __name__ == "__main__":
    found = np.array([[top_readings(Pad(), radius, place) for place in PLACES] for radius in RADII])
    np.savez_compressed(DATA, radii=RADII, places=PLACES, readings=found.astype(np.float32))
