"""One load solved without influence matrices: the finite elements themselves, in double precision.

Influence matrices answer for every possible load. This answers for a few, on any mesh, and shows what the matrices
save and what they lose.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mjtactile._types import Array
from mjtactile.fem.block_elimination import EliminatedSheet
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.stiffness import PARITIES, assemble
from mjtactile.fem.stress import DEVIATORIC_COUNT, StressSampler, von_mises
from mjtactile.fem.symmetry import QUADRANT_SIGNS, fold_forces
from mjtactile.fem.taxel_quadrature import layer_sampling
from mjtactile.fidelity import Fidelity, MeshDensity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad

#: A load at a mirrored point is the sum of its four classes; each class's own is a quarter of the folded load.
_QUARTER = 0.25


def without_tables(pad: Pad, density: MeshDensity) -> InfluenceMatrices:
    """What footprints need of influence matrices: the pad and its surface grid."""
    return InfluenceMatrices(pad, Fidelity(mesh=density), {})


def direct_readings(pad: Pad, density: MeshDensity, loads: Sequence[SurfaceLoad]) -> Array:
    """Readings of a pad under loads on a mesh's own surface grid.

    Returns:
        (loads, layers, rows, columns) [Pa].
    """
    mesh = sheet_mesh(pad, density)
    quarter = mesh.quarter()
    stiffness = assemble(quarter)
    layers = [layer_sampling(pad, k, density.points_at(k)) for k in range(len(pad.depths))]
    points = np.concatenate([layer.positions for layer in layers])
    forces = np.stack([load.forces for load in loads])
    coordinates = np.zeros((len(QUADRANT_SIGNS), len(points), DEVIATORIC_COUNT, len(forces)))
    for parity, signs in zip(PARITIES, QUADRANT_SIGNS.T, strict=True):
        sheet = EliminatedSheet(stiffness, parity)
        folded = _QUARTER * fold_forces(forces, parity).reshape(len(forces), -1)[:, sheet.free]
        sampler = StressSampler(mesh, parity, points, len(forces))
        for plane, displacements in sheet.descend(folded.T):
            sampler.add(plane, sheet.free, displacements)
        coordinates += np.multiply.outer(signs, sampler.result()[0])
    norms = np.moveaxis(von_mises(np.moveaxis(coordinates, 2, -1)), -1, 0)  # (loads, quadrants, points)
    ends = np.cumsum([len(layer.positions) for layer in layers])[:-1]
    readings = [
        (layer.average @ of_layer.reshape(len(forces), -1).T).T
        for layer, of_layer in zip(layers, np.split(norms, ends, axis=2), strict=True)
    ]
    return np.stack(readings, axis=1).reshape(len(forces), *pad.reading_shape)
