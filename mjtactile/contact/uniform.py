"""Law "uniform" as a linear map from wrenches to nodal forces, for gradients; valid while all pressure is positive."""

from __future__ import annotations

import numpy as np

from mjtactile._types import Array
from mjtactile.contact.footprint import Footprint


def uniform_basis(footprint: Footprint) -> Array:
    """Nodal forces per unit of a wrench on a flat footprint, by law "uniform" while all its pressure is positive.

    (6, nodes y, nodes x, 3) [N/N, N/(N m)]: force x, y, z and moment x, y, z about the pad's origin, pad frame.
    """
    surface, integrals = footprint.surface, footprint.integrals
    area, first_x, first_y = integrals.sum(axis=(1, 2))
    centre_x, centre_y, scale = first_x / area, first_y / area, np.sqrt(area)
    # Integrals and values at nodes of 1, (x - centre) / scale and (y - centre) / scale, which are alike in size.
    to_local = np.array([[scale, 0.0, 0.0], [-centre_x, 1.0, 0.0], [-centre_y, 0.0, 1.0]]) / scale
    local = np.einsum("ij,jyx->iyx", to_local, integrals)
    x, y = np.meshgrid(surface.x.nodes, surface.y.nodes)
    nodes = np.einsum("ij,jyx->iyx", to_local, np.stack([np.ones_like(x), x, y]))
    # Parts of the load: pressures 1, x and y, shears of 1 Pa along x and along y, and a rotational shear.
    parts = np.zeros((6, *surface.node_shape, 3))
    parts[:3, ..., 2] = -integrals
    parts[3, ..., 0] = parts[4, ..., 1] = local[0]
    parts[5, ..., 0], parts[5, ..., 1] = -local[2], local[1]
    # Factors of the pressures from the integrals of (p, x p, y p), which are -force z, moment y and -moment x.
    to_pressure = to_local.T @ np.linalg.solve(np.einsum("iyx,jyx->ji", local, nodes), to_local)
    torsion = scale * float(np.sum(local[1:] * nodes[1:]))  # moment of the rotational shear
    shares = np.zeros((6, 6))
    shares[:3, [2, 4, 3]] = to_pressure * [-1.0, 1.0, -1.0]
    shares[3, 0] = shares[4, 1] = 1.0 / area
    shares[5, [0, 1, 5]] = np.array([centre_y, -centre_x, 1.0]) / torsion
    return np.einsum("pyxc,pw->wyxc", parts, shares)
