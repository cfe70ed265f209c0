"""Law "uniform": a constant pressure, the linear gradient that carries the moment, and constant shear with a turn.

Pressure is zero where it would pull. Integrals over the outline are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from mjtactile.footprint import Footprint
from mjtactile.friction import ShearGrip
from mjtactile.load import ContactState, SurfaceLoad
from mjtactile.options import Wrench
from mjtactile.pad import Array
from mjtactile.pressure import linear_pressure
from mjtactile.surface import SurfaceGrid


def uniform_load(footprint: Footprint, force: Array, moment: Array) -> SurfaceLoad:
    """Tractions of law "uniform" that carry a wrench, or the nearest to it that the footprint can.

    Args:
        footprint: flat; curved bodies press with their lowest part.
        force: on the pad [N], pad frame.
        moment: about the pad's origin [N m].
    """
    surface = footprint.surface
    nodal = np.zeros((*surface.node_shape, 3))
    if force[2] > 0:
        return SurfaceLoad(nodal, surface, Polygon(), force, moment)
    contact, integrals, peak = footprint.outline, footprint.integrals, 0.0
    if force[2] < 0:
        pressure = linear_pressure(footprint, -force[2], (moment[1], -moment[0]))
        contact = pressure.contact
        integrals = integrals if contact is footprint.outline else surface.nodal_integrals(contact)
        coefficients = _pressure_coefficients(surface, integrals, pressure.first_moments)
        nodal[..., 2] = -np.einsum("i,iyx->yx", coefficients, integrals)
        peak = float((coefficients[0] + shapely.get_coordinates(contact) @ coefficients[1:]).max())
    nodal[..., :2] = _shear(surface, integrals, force, moment[2])
    carried_force, carried_moment = SurfaceLoad(nodal, surface, contact).resultant()
    state = ContactState(contact_area=contact.area, peak_pressure=peak)
    return SurfaceLoad(nodal, surface, contact, force - carried_force, moment - carried_moment, state)


def uniform_load_within(footprint: Footprint, wrench: Wrench, friction: float | None) -> SurfaceLoad:
    """The same for a wrench, with shear and torsion no larger than friction holds."""
    load = uniform_load(footprint, wrench.force, wrench.moment)
    if friction is None or wrench.normal < 0.0:
        return load
    held = uniform_load(footprint, *_held(load, wrench, friction))
    force, moment = held.resultant()
    return replace(held, residual_force=wrench.force - force, residual_moment=wrench.moment - moment)


def _held(load: SurfaceLoad, wrench: Wrench, friction: float) -> tuple[Array, Array]:
    """The wrench with its shear and torsion reduced to what friction holds under this load's pressure."""
    force, moment = wrench.force, wrench.moment
    grip = _pressure_grip(load)
    if grip is None:
        return np.array([0.0, 0.0, force[2]]), np.array([*moment[:2], 0.0])
    nearest, _ = grip.nearest(grip.about_centre(force, moment[2]), friction)
    across = grip.centre[0] * nearest[1] - grip.centre[1] * nearest[0]
    return np.array([*nearest[:2], force[2]]), np.array([*moment[:2], nearest[2] * grip.length + across])


@dataclass(frozen=True, eq=False)
class UniformBasis:
    """Law "uniform" on one footprint as a linear map, while its pressure is nowhere zero.

    Attributes:
        forces: nodal forces of its six parts, (6, nodes y, nodes x, 3): pressures 1, x, y and shears x, y, turn.
        to_pressure: first moments (p, x p, y p) to the coefficients of pressures 1, x, y.
        corners: of the outline, (corners, 2) [m].
        shear: area [m^2], centre x, y [m], and turning moment per unit of the turn's shear [N m].
    """

    forces: Array
    to_pressure: Array
    corners: Array
    shear: tuple[float, float, float, float]

    @classmethod
    def of(cls, footprint: Footprint) -> UniformBasis:
        """Parts of the law on a flat footprint."""
        surface, integrals = footprint.surface, footprint.integrals
        local, nodes, (centre_x, centre_y, scale) = _local_frame(surface, integrals)
        polar = np.einsum("yx,yx->", local[1], nodes[1]) + np.einsum("yx,yx->", local[2], nodes[2])
        forces = np.zeros((6, *surface.node_shape, 3))
        forces[:3, ..., 2] = -integrals
        forces[3, ..., 0] = forces[4, ..., 1] = local[0]
        forces[5, ..., 0], forces[5, ..., 1] = -local[2], local[1]
        to_pressure = np.column_stack([_pressure_coefficients(surface, integrals, unit) for unit in np.eye(3)])
        shear = (float(local[0].sum()), float(centre_x), float(centre_y), float(scale * polar))
        return cls(forces, to_pressure, shapely.get_coordinates(footprint.outline), shear)

    def weights(self, wrench: Wrench) -> Array | None:
        """Share of each part in a wrench's load, (6,); None where the law is not linear."""
        if wrench.normal <= 0.0:
            return None
        pressure = self.to_pressure @ np.array([wrench.normal, wrench.moment[1], -wrench.moment[0]])
        if (pressure[0] + self.corners @ pressure[1:]).min() < 0.0:
            return None
        area, centre_x, centre_y, polar = self.shear
        fx, fy, _ = wrench.force
        turn = (wrench.moment[2] - (centre_x * fy - centre_y * fx)) / polar
        return np.array([*pressure, fx / area, fy / area, turn])

    @property
    def shares(self) -> Array:
        """The same map as a matrix: share of each part per unit of force x, y, z and moment x, y, z, (6, 6)."""
        area, centre_x, centre_y, polar = self.shear
        shares = np.zeros((6, 6))
        # First moments (p, x p, y p) of the pressure are -force z, moment y and -moment x.
        shares[:3, [2, 4, 3]] = self.to_pressure * [-1.0, 1.0, -1.0]
        shares[3, 0] = shares[4, 1] = 1.0 / area
        shares[5, [0, 1, 5]] = np.array([centre_y, -centre_x, 1.0]) / polar
        return shares


def _pressure_grip(load: SurfaceLoad) -> ShearGrip | None:
    """What carries shear under a load's pressure, as its nodal forces; None without pressure."""
    normal = -load.forces[..., 2].ravel()
    # Nodal forces of a polygon are partly negative; friction is bound by the pressure they stand for.
    normal = np.maximum(normal, 0.0)
    if normal.sum() == 0.0:
        return None
    normal *= -load.forces[..., 2].sum() / normal.sum()
    x, y = np.meshgrid(load.surface.x.nodes, load.surface.y.nodes)
    points = np.column_stack([x.ravel(), y.ravel()])[normal > 0.0]
    normal = normal[normal > 0.0]
    return ShearGrip(points, normal, normal @ points / normal.sum(), float(np.sqrt(load.contact_area)))


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


def _shear(surface: SurfaceGrid, integrals: Array, force: Array, torsion: float) -> Array:
    """Nodal shear forces (nodes y, nodes x, 2): constant plus a rotation about the contact's centroid."""
    local, nodes, (centre_x, centre_y, scale) = _local_frame(surface, integrals)
    area = local[0].sum()
    polar = np.einsum("yx,yx->", local[1], nodes[1]) + np.einsum("yx,yx->", local[2], nodes[2])
    about_centre = torsion - (centre_x * force[1] - centre_y * force[0])
    rate = about_centre / (scale * polar)
    shear_x = force[0] / area * local[0] - rate * local[2]
    shear_y = force[1] / area * local[0] + rate * local[1]
    return np.stack([shear_x, shear_y], axis=-1)
