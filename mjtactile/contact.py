"""Contact laws: which tractions on the footprint make up a given contact wrench.

Tractions are what the indenter does to the pad, in the pad frame. They are returned as consistent nodal forces of the
surface grid; these reproduce the traction's resultant force and moment to rounding.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon, Polygon

from mjtactile.errors import ContactError, ContactWarning
from mjtactile.footprint import Footprint
from mjtactile.influence import InfluenceMatrices
from mjtactile.pad import Array
from mjtactile.planar import areal
from mjtactile.pressure import linear_pressure
from mjtactile.surface import SurfaceGrid

#: Names of the contact laws.
LAWS = ("uniform",)
#: Mean pressure over the top layer's modulus above which strains are no longer small.
LINEAR_RANGE = 0.1
#: A part of the wrench counts as not carried when it is larger than this fraction of the wrench.
_RESIDUAL_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class SurfaceLoad:
    """Tractions on a pad's surface, as nodal forces.

    Attributes:
        forces: on the surface grid's nodes [N], pad frame, shape (nodes y, nodes x, 3).
        surface: the grid.
        contact: the part of the surface that carries pressure, in the pad frame [m].
        residual_force: given force minus the force carried [N], shape (3,); zero when the law could carry it.
        residual_moment: given moment minus the moment carried [N m], about the pad's origin, shape (3,).
    """

    forces: Array
    surface: SurfaceGrid
    contact: Polygon | MultiPolygon
    residual_force: Array = field(default_factory=lambda: np.zeros(3))
    residual_moment: Array = field(default_factory=lambda: np.zeros(3))

    def resultant(self) -> tuple[Array, Array]:
        """Force [N] and moment [N m] of the load about the pad's origin, each of shape (3,), pad frame."""
        x, y = self.surface.x.nodes, self.surface.y.nodes
        fx, fy, fz = np.moveaxis(self.forces, -1, 0)
        along_x, along_y = fz.sum(axis=0) @ x, fz.sum(axis=1) @ y
        torsion = fy.sum(axis=0) @ x - fx.sum(axis=1) @ y
        return np.array([fx.sum(), fy.sum(), fz.sum()]), np.array([along_y, -along_x, torsion])

    def __add__(self, other: SurfaceLoad) -> SurfaceLoad:
        """Both loads at once: tractions of several bodies on one pad add up."""
        if self.forces.shape != other.forces.shape:
            raise ContactError(
                f"loads on different surface grids do not add: {self.forces.shape} and {other.forces.shape} nodes. "
                "Make both with the same influence matrices."
            )
        contact = areal(self.contact.union(other.contact))
        return SurfaceLoad(
            self.forces + other.forces,
            self.surface,
            contact,
            self.residual_force + other.residual_force,
            self.residual_moment + other.residual_moment,
        )

    @classmethod
    def none(cls, surface: SurfaceGrid) -> SurfaceLoad:
        """No load at all."""
        return cls(np.zeros((*surface.node_shape, 3)), surface, Polygon())


def contact_load(
    influence: InfluenceMatrices,
    footprint: Footprint,
    force: npt.ArrayLike,
    *,
    moment: npt.ArrayLike | None = None,
    law: str = "uniform",
) -> SurfaceLoad:
    """Tractions that carry a contact wrench on a footprint.

    Law "uniform": pressure is constant over the footprint plus the linear gradient that carries the moment, and zero
    where that would pull; shear is constant over the area under pressure plus the rotation that carries the torsion.

    Args:
        influence: of the pad.
        footprint: the covered area, made with the same influence matrices.
        force: on the pad [N], pad frame, shape (3,); pressing is force[2] < 0.
        moment: about the pad's origin [N m], shape (3,); by default the force acts at the footprint's centroid.
        law: name of the contact law.

    Returns:
        The load. What the footprint cannot carry is left out, nearest first, and stands in its residual.

    Raises:
        ContactError: for an unknown law or a wrench that is not three finite numbers each.

    Warns:
        ContactWarning: when the wrench cannot be carried, or the pressure is beyond small strains.
    """
    if law not in LAWS:
        raise ContactError(f"contact law {law!r} does not exist. Available: {', '.join(LAWS)}.")
    wanted_force = _vector("force", force)
    centre = np.array([*footprint.centroid, 0.0])
    wanted_moment = np.cross(centre, wanted_force) if moment is None else _vector("moment", moment)
    load = _uniform(footprint, wanted_force, wanted_moment)
    _warn_unless_carried(load, wanted_force, wanted_moment, footprint)
    _warn_beyond_linear_range(load, wanted_force, influence)
    return load


def _vector(name: str, value: npt.ArrayLike) -> Array:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ContactError(f"{name} = {value!r}; expected three finite numbers (x, y, z) in the pad frame, N or N m.")
    return vector


def _uniform(footprint: Footprint, force: Array, moment: Array) -> SurfaceLoad:
    surface = footprint.surface
    nodal = np.zeros((*surface.node_shape, 3))
    if force[2] > 0:
        return SurfaceLoad(nodal, surface, Polygon(), force, moment)
    contact, integrals = footprint.outline, footprint.integrals
    if force[2] < 0:
        pressure = linear_pressure(footprint, -force[2], (moment[1], -moment[0]))
        contact = pressure.contact
        integrals = integrals if contact is footprint.outline else surface.nodal_integrals(contact)
        coefficients = _pressure_coefficients(surface, integrals, pressure.first_moments)
        nodal[..., 2] = -np.einsum("i,iyx->yx", coefficients, integrals)
    nodal[..., :2] = _shear(surface, integrals, force, moment[2])
    load = SurfaceLoad(nodal, surface, contact)
    carried_force, carried_moment = load.resultant()
    return SurfaceLoad(nodal, surface, contact, force - carried_force, moment - carried_moment)


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


def _warn_unless_carried(load: SurfaceLoad, force: Array, moment: Array, footprint: Footprint) -> None:
    length = np.sqrt(footprint.area)
    size = np.linalg.norm(force) + np.linalg.norm(moment) / length
    missing = np.linalg.norm(load.residual_force) + np.linalg.norm(load.residual_moment) / length
    if missing <= _RESIDUAL_TOLERANCE * size:
        return
    if force[2] > 0:
        reason = "the force pulls the indenter off the pad"
    elif force[2] == 0:
        reason = "there is a tilting moment but no force pressing"
    else:
        through = np.round(np.array([moment[1], -moment[0]]) / -force[2] * 1e3, 6) + 0.0
        reason = f"the force passes through ({through[0]:.4g}, {through[1]:.4g}) mm, outside the area it spans"
    left_force, left_moment = _format(load.residual_force, size), _format(load.residual_moment, size * length)
    warnings.warn(
        f"the footprint cannot carry this wrench: {reason}. The nearest load that it can carry is used; "
        f"force {left_force} N and moment {left_moment} N m are left over.",
        ContactWarning,
        stacklevel=3,
    )


def _format(vector: Array, size: float) -> str:
    """Three digits each; what is rounding beside `size` as 0."""
    shown = np.where(np.abs(vector) <= _RESIDUAL_TOLERANCE * size, 0.0, vector)
    return "(" + ", ".join(f"{v:.3g}" for v in shown) + ")"


def _warn_beyond_linear_range(load: SurfaceLoad, force: Array, influence: InfluenceMatrices) -> None:
    young = influence.pad.layers[0].young
    if load.contact.is_empty or force[2] >= 0:
        return
    pressure = -force[2] / load.contact.area
    if pressure > LINEAR_RANGE * young:
        warnings.warn(
            f"the mean pressure, {pressure:.3g} Pa, is over {LINEAR_RANGE:.0%} of the top layer's modulus, {young:.3g} "
            "Pa: strains are no longer small and the readings of this linear model are too simple there.",
            ContactWarning,
            stacklevel=3,
        )
