"""A block so large that it is a half space: Love's closed forms for a disc of uniform pressure."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import disc_stress_on_axis, disc_surface_sinking
from shapely import Point
from small_pads import without_tables

from mjtactile.cli.benchmarks.direct import solve
from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.fidelity import MeshDensity
from mjtactile.pad import Layer, Pad, TaxelGrid

RADIUS = 1e-3
#: Half width and height over the disc's radius: the rim and the base are felt as the inverse of it.
REACH = 100
PRESSURE = 1000.0
#: Elements grow from the middle and from the surface outward, by factors of 250 and 500 in all.
GROWING = MeshDensity(
    in_plane_size=1 / 9,
    through_size=1 / 12,
    rim_grading=1 / 250,
    base_grading=1 / 500,
    points_per_axis=(1,),
    reference_length=REACH * RADIUS,
)
DEPTHS = tuple(RADIUS * np.array([0.3, 0.6, 1.0, 1.5, 2.5, 4.0]))


def block(poisson: float) -> Pad:
    return Pad(
        size=(2 * REACH * RADIUS, 2 * REACH * RADIUS),
        layers=(Layer(thickness=REACH * RADIUS, young=3e6, poisson=poisson),),
        taxels=TaxelGrid(rows=1, columns=1),
        depths=DEPTHS,
        sampling_radius=0.01 * RADIUS,
    )


@pytest.mark.parametrize("poisson", [pytest.param(0.3, marks=pytest.mark.slow), 0.49])
def test_disc_on_a_large_block_is_loves(poisson):
    pad = block(poisson)
    influence = without_tables(pad, GROWING)
    disc = Footprint.from_outline(Point(0, 0).buffer(RADIUS, quad_segs=64), influence.surface)
    load = contact_load(influence, disc, (0.0, 0.0, -PRESSURE * disc.area))
    response = solve(pad, GROWING, [load])

    expected = disc_stress_on_axis(np.array(DEPTHS), radius=RADIUS, pressure=PRESSURE, poisson=poisson)
    von_mises = np.abs(expected.axial - expected.radial)
    # Of the largest reading; the mesh, and a block that ends 100 radii away.
    np.testing.assert_allclose(response.readings[0, :, 0, 0], von_mises, atol=0.01 * von_mises.max())

    x = influence.surface.x.nodes
    inside = np.flatnonzero((x >= 0) & (x < 0.8 * RADIUS))
    middle = influence.surface.y.node_count // 2
    sinking = disc_surface_sinking(
        x[inside], radius=RADIUS, pressure=PRESSURE, young=pad.layers[0].young, poisson=poisson
    )
    assert len(inside) > 3
    np.testing.assert_allclose(-response.displacement[0, middle, inside, 2], sinking, rtol=0.01)
