"""Pads and meshes that several tests share: everything there is, nothing takes long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mjtactile.fem.taxel_quadrature import layer_sampling, sampling_tables
from mjtactile.fidelity import Fidelity, MeshDensity
from mjtactile.influence.build import build_tables
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Layer, Pad, TaxelGrid
from mjtactile.pad_shape.surfaces import EllipsoidCap

#: Three elements per half width, three across the thickness: everything is there, nothing takes long.
COARSE = MeshDensity(
    in_plane_size=0.5, through_size=0.34, rim_grading=1.5, base_grading=1.3, points_per_axis=(2,), most_elements=40
)
#: Not square, layered, with a grid of taxels that the sheet's mirrors do not map onto itself.
LAYERED_PAD = Pad(
    size=(9e-3, 6e-3),
    layers=(
        Layer(thickness=1.0e-3, young=1e6, poisson=0.49),
        Layer(thickness=0.7e-3, young=4e6, poisson=0.3),
        Layer(thickness=1.3e-3, young=2e6, poisson=0.45),
    ),
    taxels=TaxelGrid(rows=4, columns=5, pitch=(1.5e-3, 1.2e-3), centre=(0.8e-3, -0.5e-3)),
    depths=(0.9e-3, 1.7e-3, 2.6e-3),
    sampling_radius=0.5e-3,
)
#: The same under an ellipsoid.
DOME = replace(LAYERED_PAD, surface=EllipsoidCap((11e-3, 8e-3, 9e-3)))


def in_double_precision(pad: Pad, density: MeshDensity) -> InfluenceMatrices:
    """Influence matrices whose stresses are not rounded to float32, so that identities hold to rounding."""
    tables = {}
    for k in range(pad.sensing_layers):
        tables |= sampling_tables(layer_sampling(pad, k, density.points_at(k)), k)
    for class_tables in build_tables(pad, density, dtype=np.float64):
        tables |= class_tables
    return InfluenceMatrices(pad, Fidelity(mesh=density, precision="float64"), tables)


def without_tables(pad: Pad, density: MeshDensity) -> InfluenceMatrices:
    """Influence matrices without tables. They have a pad and its surface grid, enough to find footprints and loads."""
    return InfluenceMatrices(pad, Fidelity(mesh=density), {})
