"""Curved pads for tests: some that bulge everywhere, and some with hollows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.interpolate import RectBivariateSpline

from mjtactile._types import Array
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import FLAT, CylinderSector, EllipsoidCap, SphereCap, Surface, SurfacePatch
from mjtactile.pad_shape.taxels import FreeTaxels

_SIDE = 12e-3


def curved(surface: Surface) -> Pad:
    """12 x 12 mm, 3 mm thick in two layers, 5 x 5 taxels at two depths."""
    layers = Layer(thickness=1e-3, young=1e6, poisson=0.49), Layer(thickness=2e-3, young=3e6, poisson=0.49)
    taxels = TaxelGrid(rows=5, columns=5, pitch=(2e-3, 2e-3))
    return Pad(
        size=(_SIDE, _SIDE), layers=layers, taxels=taxels, depths=(0.75e-3, 2e-3), sampling_radius=4e-4, surface=surface
    )


def pad_with(height: Callable[[Array, Array], Array]) -> Pad:
    """The same under a patch z(x, y) [m]."""
    line = np.linspace(-0.51, 0.51, 41) * _SIDE
    x, y = np.meshgrid(line, line, indexing="ij")
    spline = RectBivariateSpline(line, line, height(x, y), kx=5, ky=5, s=(1e-8) ** 2 * x.size)  # type: ignore[arg-type]
    knots = spline.get_knots()
    values = spline.get_coeffs().reshape(len(knots[0]) - 6, len(knots[1]) - 6)
    return curved(SurfacePatch(tuple(knots[0]), tuple(knots[1]), tuple(map(tuple, values))))


def stack(pad: Pad) -> Pad:
    """The same pad, flat."""
    return replace(pad, surface=FLAT)


BULGES = {
    "dome": curved(SphereCap(12e-3)),
    "tip": curved(CylinderSector(8e-3)),
    "ellipsoid": curved(EllipsoidCap((10e-3, 14e-3, 8e-3))),
    "lopsided": pad_with(lambda x, y: -(x**2 + y**2) / 24e-3 + 0.02 * x + 1.5 * x**2 * y),
}
HOLLOWS = {
    "saddle": pad_with(lambda x, y: (x**2 - y**2) / 20e-3),
    "bowl": pad_with(lambda x, y: (x**2 + y**2) / 40e-3),
}
CURVED = BULGES | HOLLOWS


def with_free_taxels(pad: Pad, count: int = 12) -> Pad:
    """The same body with taxels at random places [m] between a quarter and three quarters of its depth."""
    rng = np.random.default_rng(1)
    x, y = (rng.uniform(-0.35, 0.35, count) * side for side in pad.size)
    points = pad.surface.positions(x, y, rng.uniform(0.25, 0.75, count) * pad.thickness)
    taxels = FreeTaxels(points)  # type: ignore[arg-type]
    return Pad(
        size=pad.size, layers=pad.layers, taxels=taxels, sampling_radius=pad.sampling_radius, surface=pad.surface
    )


#: What every door is walked with: two mirrors, one, none; and free taxels on a flat and on a curved pad.
WALKED = {
    "dome": BULGES["dome"],
    "tip": BULGES["tip"],
    "patch": BULGES["lopsided"],
    "free": with_free_taxels(stack(BULGES["dome"])),
    "free dome": with_free_taxels(BULGES["dome"]),
}
