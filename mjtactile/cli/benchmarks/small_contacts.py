"""The benchmark of small contacts: how far off each preset is where a contact is not much larger than an element.

benchmarks/small_contacts.npz has readings of the default pad's top taxels near a ball's pressure of 1 N, found without
a mesh by tests/reference/bonded_layer.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from shapely import Point

from mjtactile._types import Array
from mjtactile.cli.benchmarks.direct import relative_difference
from mjtactile.experiments.markdown import markdown_table
from mjtactile.fidelity import PRESETS
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.sim.assets import asset_path
from mjtactile.units import MILLIMETRE


def small_contacts_benchmark(presets: Sequence[str] = tuple(PRESETS)) -> dict[str, Any]:
    """Measure presets, all by default, under a ball's pressure on circles of several sizes, at several places.

    Returns:
        "radii_m", the circles' radii [m]; and "errors", by preset the relative L2 errors of the top layer's readings
        near the load [-], one list over the places for each radius.
    """
    with np.load(asset_path("benchmarks/small_contacts.npz")) as cases:
        radii, places, exact = (cases[name].astype(float) for name in ("radii", "places", "readings"))
    errors = {}
    for preset in presets:
        influence = influence_matrices(fidelity=preset)
        errors[preset] = [
            [_error(influence, radius, place, there) for place, there in zip(places, readings, strict=True)]
            for radius, readings in zip(radii, exact, strict=True)
        ]
    return {"radii_m": radii.tolist(), "errors": errors}


def small_contacts_table(result: dict[str, Any]) -> str:
    """The result of `small_contacts_benchmark` as a Markdown table."""
    sizes = [f"radius {radius / MILLIMETRE:.2g} mm: median (worst)" for radius in result["radii_m"]]
    rows = [
        [preset, *(f"{np.median(errors):.1%} ({max(errors):.1%})" for errors in by_radius)]
        for preset, by_radius in result["errors"].items()
    ]
    return markdown_table(["preset", *sizes], rows)


def _error(influence: InfluenceMatrices, radius: float, place: Array, exact: Array) -> float:
    """Relative error of the top layer's readings under a ball's pressure, where `exact` is finite [-]."""
    load = _ball_pressure(influence, radius, place)
    force = -load.resultant()[0][2]
    near = np.isfinite(exact)
    return relative_difference(influence.readings(load)[0][near] / force, exact[near])


def _ball_pressure(influence: InfluenceMatrices, radius: float, place: Array) -> SurfaceLoad:
    """Hertz's pressure of about 1 N on a circle [m]; exactly on its polygon of many corners."""
    peak = 1.5 / (np.pi * radius**2)

    def traction(points: Array, normals: Array) -> Array:
        share = 1.0 - np.sum((points[:, :2] - place) ** 2, axis=1) / radius**2
        return -peak * np.sqrt(np.maximum(share, 0.0))[:, None] * normals

    return SurfaceLoad.from_tractions(influence, Point(place).buffer(radius, 64), traction)
