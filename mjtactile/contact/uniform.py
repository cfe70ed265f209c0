"""Law "uniform" as a linear map from wrenches to nodal forces, for gradients; valid while all pressure is positive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.contact.footprint import Footprint
from mjtactile.fem.surface_grid import SurfaceGrid


@dataclass(frozen=True, eq=False)
class UniformBasis:
    """Law "uniform" on one footprint as a linear map, valid while its pressure is positive everywhere.

    Attributes:
        forces: nodal forces of its six parts [N], (6, nodes y, nodes x, 3), pad frame. Parts are the pressures 1, x and
            y, the shears of 1 Pa along x and along y, and a rotational shear.
        to_pressure: matrix from the integrals of (p, x p, y p) to the coefficients of pressures 1, x, y, (3, 3).
        shear: area [m^2], centre x, y [m], and torsional moment of a unit rotational shear [N m].
    """

    forces: Array
    to_pressure: Array
    shear: tuple[float, float, float, float]

    @classmethod
    def of(cls, footprint: Footprint) -> UniformBasis:
        """The linear map of a flat footprint."""
        surface, integrals = footprint.surface, footprint.integrals
        local, nodes, (centre_x, centre_y, scale) = _local_frame(surface, integrals)
        polar = np.einsum("yx,yx->", local[1], nodes[1]) + np.einsum("yx,yx->", local[2], nodes[2])
        forces = np.zeros((6, *surface.node_shape, 3))
        forces[:3, ..., 2] = -integrals
        forces[3, ..., 0] = forces[4, ..., 1] = local[0]
        forces[5, ..., 0], forces[5, ..., 1] = -local[2], local[1]
        to_pressure = np.column_stack([_pressure_coefficients(surface, integrals, unit) for unit in np.eye(3)])
        shear = (float(local[0].sum()), float(centre_x), float(centre_y), float(scale * polar))
        return cls(forces, to_pressure, shear)

    @property
    def shares(self) -> Array:
        """Matrix from force x, y, z [N] and moment x, y, z [N m] to the factor of each part, (6, 6)."""
        area, centre_x, centre_y, polar = self.shear
        shares = np.zeros((6, 6))
        # Integrals of (p, x p, y p) over the contact are -force z, moment y and -moment x.
        shares[:3, [2, 4, 3]] = self.to_pressure * [-1.0, 1.0, -1.0]
        shares[3, 0] = shares[4, 1] = 1.0 / area
        shares[5, [0, 1, 5]] = np.array([centre_y, -centre_x, 1.0]) / polar
        return shares


def _local_frame(surface: SurfaceGrid, integrals: Array) -> tuple[Array, Array, Array]:
    """Linear functions 1, (x - centre) / scale, (y - centre) / scale: nodal integrals, node values, (centre, scale)."""
    area, first_x, first_y = integrals.sum(axis=(1, 2))
    centre, scale = np.array([first_x, first_y]) / area, np.sqrt(area)
    local = np.stack([integrals[0], *((integrals[1:] - centre[:, None, None] * integrals[0]) / scale)])
    x, y = np.meshgrid((surface.x.nodes - centre[0]) / scale, (surface.y.nodes - centre[1]) / scale)
    return local, np.stack([np.ones_like(x), x, y]), np.array([*centre, scale])


def _pressure_coefficients(surface: SurfaceGrid, integrals: Array, moments: Array) -> Array:
    """Coefficients of 1, x, y whose pressure has the given integrals of p, x p and y p over the contact."""
    local, nodes, (centre_x, centre_y, scale) = _local_frame(surface, integrals)
    normal, first_x, first_y = moments
    wanted = np.array([normal, (first_x - centre_x * normal) / scale, (first_y - centre_y * normal) / scale])
    p, along_x, along_y = np.linalg.solve(np.einsum("iyx,jyx->ji", local, nodes), wanted)
    along_x, along_y = along_x / scale, along_y / scale
    return np.array([p - along_x * centre_x - along_y * centre_y, along_x, along_y])
