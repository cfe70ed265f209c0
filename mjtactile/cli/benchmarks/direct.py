"""Responses to a few loads without tables: the finite elements are solved for those loads, in double precision.

Influence matrices answer every possible load. The direct solution answers a few, on any mesh, in a tenth of the time
that the matrices take to build. Benchmarks and tests compare both: in time and in accuracy.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from mjtactile._types import Array
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.solution import SweptPad
from mjtactile.fem.stress import DEVIATORIC_COUNT, von_mises
from mjtactile.fem.symmetry import MirrorPlanes, Parity, fold_forces, free_in_plane, unfold_field
from mjtactile.fem.taxel_quadrature import layer_sampling
from mjtactile.fidelity import MeshDensity
from mjtactile.influence.build import available_cores
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad


class Response(NamedTuple):
    """Readings, displacements and reactions of a pad under some loads; vectors are in the pad frame."""

    readings: Array  #: von Mises stress at the taxels, (loads, layers, rows, columns) [Pa]
    displacement: Array  #: displacement of the surface's nodes, (loads, nodes y, nodes x, 3) [m]
    base_reaction: Array  #: nodal forces of the base on the sheet, (loads, nodes y, nodes x, 3) [N]


def solve(pad: Pad, density: MeshDensity, loads: Sequence[SurfaceLoad], *, threads: int | None = None) -> Response:
    """Solve the finite elements of a pad for loads on its mesh, with at most four threads, by default one per core."""
    mesh = sheet_mesh(pad, density)
    mirrors = MirrorPlanes(*mesh.outer.mirrors)
    layers = [layer_sampling(pad, k, density.points_at(k)) for k in range(pad.sensing_layers)]
    points, part = np.concatenate([layer.positions for layer in layers]), mesh.quarter()
    swept = SweptPad(mesh, points)
    base_stiffness = swept.elements.matrix(layers=1)
    batch = np.stack([load.forces for load in loads])

    def solve_class(parity: Parity) -> tuple[Array, Array, Array]:
        """Stress (loads, points, 5), surface displacement and base reaction of one symmetry class."""
        free = free_in_plane(part, parity)
        # A load is the sum of its parts in the classes; the folded load is each part's forces on all mirror images.
        forces = fold_forces(batch, parity).reshape(len(loads), -1)[:, free].T / len(mirrors.images)
        # Loads that share a mirror plane have parts in some classes that act on held nodes only, apart from rounding.
        if np.abs(forces).max() <= 1e-11 * np.abs(batch).max():
            nothing = np.zeros((len(loads), 3, part.y.node_count, part.x.node_count))
            return np.zeros((len(loads), len(points), DEVIATORIC_COUNT)), nothing, nothing
        equations = swept.equations(parity)
        displacements = np.zeros((equations.count, len(loads)))
        displacements[equations.surface] = forces
        equations.solve(displacements)
        stress = swept.stress(parity, equations)(displacements)[0]
        nodal = equations.nodal(displacements)
        reaction = (base_stiffness @ nodal.reshape(-1, len(loads))).reshape(nodal.shape)[0]
        surface, base = (field.transpose(3, 2, 0, 1) for field in (nodal[-1], reaction))
        # Reactions at degrees of freedom that symmetry holds come from the other half of the pad, not from the base.
        return np.moveaxis(stress, -1, 0), surface, np.where(free.reshape(base.shape[1:]), base, 0.0)

    with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(threads or available_cores()) as executor:
        classes = list(executor.map(solve_class, mirrors.classes))
    stress = np.stack([one[0] for one in classes], axis=1)
    surfaces, reactions = [one[1] for one in classes], [_whole_nodes(one[2], mirrors) for one in classes]
    norms = von_mises(np.einsum("qc,bcpw->bqpw", mirrors.signs, stress))
    readings, start = [], 0
    for layer in layers:
        end = start + len(layer.positions)
        readings.append((layer.average @ norms[:, :, start:end].reshape(len(loads), -1).T).T)
        start = end
    shape = (len(loads), *pad.reading_shape)
    return Response(
        np.stack(readings, axis=1).reshape(shape), unfold_field(surfaces, mirrors), unfold_field(reactions, mirrors)
    )


def _whole_nodes(reaction: Array, mirrors: MirrorPlanes) -> Array:
    """Nodal forces on the part that symmetry leaves, (..., y, x), with both halves of those on its mirror lines."""
    forces = reaction.copy()
    if mirrors.x:
        forces[..., :, 0] *= 2
    if mirrors.y:
        forces[..., 0, :] *= 2
    return forces


def relative_difference(actual: Array, expected: Array) -> float:
    """Euclidean norm of the difference, divided by the norm of the expected values [-]."""
    return float(np.linalg.norm(actual - expected) / np.linalg.norm(expected))
