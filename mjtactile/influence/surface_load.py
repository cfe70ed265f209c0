"""Tractions on a pad's surface, and the state of the contact that causes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from mjtactile._types import Array
from mjtactile.errors import ContactError, of_type
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.fem.tractions import Traction, integrated_traction
from mjtactile.geometry.planar import area_on_sheet, areal
from mjtactile.influence.layout import PadTables

Area = Polygon | MultiPolygon


@dataclass(frozen=True, kw_only=True)
class ContactState:
    """Results of a contact law besides the tractions; NaN where the law does not compute them."""

    #: Displacement of the body into the pad since first contact [m]: at the footprint's centroid; for a sensor, the
    #: largest.
    indentation: float = math.nan
    tilts: tuple[float, float] = (math.nan, math.nan)  #: rotation of the body about the pad's x and y axes [rad]
    contact_area: float = 0.0  #: area under pressure [m^2]
    peak_pressure: float = 0.0  #: largest mean pressure over a contact cell [Pa]
    stick_area: float = math.nan  #: area where the surface does not slip along the body [m^2]


@dataclass(frozen=True, eq=False)
class SurfaceLoad:
    """Tractions on a pad's surface, as nodal forces.

    Attributes:
        forces: on the surface grid's nodes [N], pad frame, shape (nodes y, nodes x, 3).
        surface: the grid.
        covered: the part of the surface that carries pressure [m], or a function that returns it.
        residual_force: given force minus the force carried [N], pad frame, shape (3,); zero if all of it is carried.
        residual_moment: given moment minus the moment carried [N m], about the pad's origin, shape (3,).
        state: further results of the contact law.
    """

    forces: Array
    surface: SurfaceGrid
    covered: Area | Callable[[], Area]
    residual_force: Array = field(default_factory=lambda: np.zeros(3))
    residual_moment: Array = field(default_factory=lambda: np.zeros(3))
    state: ContactState = ContactState()

    @cached_property
    def contact(self) -> Area:
        """The part of the surface that carries pressure, in the pad frame [m]."""
        return self.covered() if callable(self.covered) else self.covered

    @property
    def indentation(self) -> float:
        """Displacement of the body into the pad since first contact [m]; see ContactState."""
        return self.state.indentation

    @property
    def tilts(self) -> tuple[float, float]:
        """Rotation of the body about the pad's x and y axes [rad]."""
        return self.state.tilts

    @property
    def contact_area(self) -> float:
        """Area under pressure [m^2]."""
        return self.state.contact_area

    @property
    def peak_pressure(self) -> float:
        """Largest mean pressure over a contact cell [Pa]; largest pressure for a law without cells."""
        return self.state.peak_pressure

    def resultant(self) -> tuple[Array, Array]:
        """Force [N] and moment [N m] of the load about the pad's origin, each of shape (3,), pad frame."""
        x, y, z = self.surface.x.nodes, self.surface.y.nodes, self.surface.node_heights
        fx, fy, fz = np.moveaxis(self.forces, -1, 0)
        along_x, along_y = fz.sum(axis=0) @ x, fz.sum(axis=1) @ y
        torsion = fy.sum(axis=0) @ x - fx.sum(axis=1) @ y
        moment = np.array([along_y - np.sum(fy * z), np.sum(fx * z) - along_x, torsion])
        return np.array([fx.sum(), fy.sum(), fz.sum()]), moment

    def __add__(self, other: SurfaceLoad) -> SurfaceLoad:
        """The sum of the loads of two bodies on one pad; indentation and tilts become NaN.

        Raises:
            ContactError: the loads are on different surface grids.
        """
        if not isinstance(other, SurfaceLoad):
            return NotImplemented
        if not self.surface.matches(other.surface):
            raise ContactError(
                f"loads on different surface grids do not add: {self.surface.summary}, and {other.surface.summary}. "
                "Make both with the same influence matrices."
            )
        return SurfaceLoad(
            self.forces + other.forces,
            self.surface,
            partial(_joined_contact, self, other),
            self.residual_force + other.residual_force,
            self.residual_moment + other.residual_moment,
            ContactState(
                contact_area=self.contact_area + other.contact_area,
                peak_pressure=max(self.peak_pressure, other.peak_pressure),
                stick_area=self.state.stick_area + other.state.stick_area,
            ),
        )

    @classmethod
    def from_tractions(cls, influence: PadTables, outline: BaseGeometry, traction: Traction) -> SurfaceLoad:
        """The load of a known traction, without a contact law, on a flat or curved pad.

        Args:
            influence: influence matrices of the pad.
            outline: polygon or multipolygon in the projection onto (x, y), pad frame [m], holes allowed. Parts beyond
                the pad are ignored.
            traction: function of points of the surface (n, 3) [m] and unit normals out of the pad (n, 3), both in the
                pad frame. It returns the traction on the pad per area of the surface [Pa], shape (n, 3). A pressure p
                is `lambda points, normals: -p * normals`.

        Returns:
            The load; its contact area is that of the surface under the outline.

        Raises:
            FootprintError: the outline is not a valid area, or does not overlap the pad.
            ContactError: the traction is no function, has another shape, or is not finite; or `influence` are no
                influence matrices.
        """
        if not callable(traction):
            raise ContactError(
                f"traction is of type {type(traction).__name__}; expected a function of points and normals, such as "
                "lambda points, normals: -1e4 * normals for a pressure of 10 kPa."
            )
        cure = "influence_matrices(pad) makes them"
        surface = of_type(PadTables, "influence", influence, ContactError, cure).surface
        area = area_on_sheet(outline, surface.bounds)
        found = integrated_traction(surface, area, traction)
        state = ContactState(contact_area=found.area, peak_pressure=found.peak)
        return cls(found.forces, surface, area, state=state)

    @classmethod
    def none(
        cls, surface: SurfaceGrid, residual_force: Array | None = None, residual_moment: Array | None = None
    ) -> SurfaceLoad:
        """A load without tractions.

        Args:
            surface: the grid.
            residual_force: a given force, none of which is carried [N], shape (3,); None for no force.
            residual_moment: its moment about the pad's origin [N m], shape (3,); None for no moment.
        """
        left_force, left_moment = (np.zeros(3) if one is None else one for one in (residual_force, residual_moment))
        nodal = np.zeros((*surface.node_shape, 3))
        return cls(nodal, surface, Polygon(), left_force, left_moment, ContactState(stick_area=0.0))


def _joined_contact(one: SurfaceLoad, other: SurfaceLoad) -> Area:
    """The area that carries pressure under either load; a function by name, so that sums of loads can be pickled."""
    return areal(one.contact.union(other.contact))
