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
from mjtactile.fem.block_elimination import EliminatedSheet
from mjtactile.fem.mesh import sheet_mesh
from mjtactile.fem.stiffness import PARITIES, Parity, assemble, free_in_plane
from mjtactile.fem.stress import StressSampler, von_mises
from mjtactile.fem.symmetry import QUADRANT_SIGNS, fold_forces, unfold_field
from mjtactile.fem.taxel_quadrature import layer_sampling
from mjtactile.fidelity import MeshDensity
from mjtactile.influence.build import available_cores
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad

#: A load is the sum of its parts in the four symmetry classes. Each part is a quarter of the folded load.
_QUARTER = 0.25


class Response(NamedTuple):
    """Readings, displacements and reactions of a pad under some loads; vectors are in the pad frame."""

    readings: Array  #: von Mises stress at the taxels, (loads, layers, rows, columns) [Pa]
    displacement: Array  #: displacement of the surface's nodes, (loads, nodes y, nodes x, 3) [m]
    base_reaction: Array  #: nodal forces of the base on the sheet, (loads, nodes y, nodes x, 3) [N]


def solve(pad: Pad, density: MeshDensity, loads: Sequence[SurfaceLoad], *, threads: int | None = None) -> Response:
    """Solve the finite elements of a pad for some loads.

    Args:
        pad: the pad that is pressed.
        density: density of the mesh.
        loads: tractions on the surface grid of the same mesh.
        threads: threads that work at once, at most four; by default one per core.
    """
    mesh = sheet_mesh(pad, density)
    quarter = mesh.quarter()
    stiffness = assemble(quarter)
    layers = [layer_sampling(pad, k, density.points_at(k)) for k in range(len(pad.depths))]
    points = np.concatenate([layer.positions for layer in layers])
    batch = np.stack([load.forces for load in loads])
    plane = (3, quarter.y.node_count, quarter.x.node_count)
    top = mesh.z.node_count - 1

    def solve_class(parity: Parity) -> tuple[Array, Array, Array]:
        """Stress (loads, points, 5), surface displacement and base reaction of one symmetry class."""
        stress = np.zeros((len(loads), len(points), 5))
        fields = {top: np.zeros((len(loads), *plane)), 0: np.zeros((len(loads), *plane))}
        folded = _QUARTER * fold_forces(batch, parity).reshape(len(loads), -1)
        # Loads that share a mirror plane have parts in some classes that act on held nodes only, apart from rounding.
        if np.abs(folded[:, free_in_plane(quarter, parity).ravel()]).max() > 1e-11 * np.abs(batch).max():
            sheet = EliminatedSheet(stiffness, parity)
            sampler = StressSampler(mesh, parity, points, len(loads))
            near_base = {}
            for z, displacements in sheet.descend(folded[:, sheet.free].T):
                sampler.add(z, sheet.free, displacements)
                if z in (1, 2):
                    near_base[z] = displacements
                if z in fields:
                    fields[z].reshape(len(loads), -1)[:, sheet.free] = displacements.T
            fields[0].reshape(len(loads), -1)[:, sheet.free] = sheet.base_reaction(near_base[1], near_base[2]).T
            stress = np.moveaxis(sampler.result()[0], -1, 0)
        return stress, fields[top], fields[0]

    with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(threads or available_cores()) as executor:
        classes = list(executor.map(solve_class, PARITIES))
    stress = np.stack([one[0] for one in classes], axis=1)
    surfaces, reactions = [one[1] for one in classes], [one[2] for one in classes]
    norms = von_mises(np.einsum("qc,bcpw->bqpw", QUADRANT_SIGNS, stress))
    readings, start = [], 0
    for layer in layers:
        end = start + len(layer.positions)
        readings.append((layer.average @ norms[:, :, start:end].reshape(len(loads), -1).T).T)
        start = end
    shape = (len(loads), *pad.reading_shape)
    return Response(np.stack(readings, axis=1).reshape(shape), unfold_field(surfaces), _whole_forces(reactions))


def _whole_forces(quarters: list[Array]) -> Array:
    """Nodal forces on the whole plane from those on the quarter, where nodes on a mirror line hold half of theirs."""
    doubled = []
    for quarter in quarters:
        forces = quarter.copy()
        forces[..., :, 0] *= 2
        forces[..., 0, :] *= 2
        doubled.append(forces)
    return unfold_field(doubled)


def relative_difference(actual: Array, expected: Array) -> float:
    """Euclidean norm of the difference, divided by the norm of the expected values [-]."""
    return float(np.linalg.norm(actual - expected) / np.linalg.norm(expected))
