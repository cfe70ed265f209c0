"""Footprints of the bodies of a MuJoCo model on one pad.

A body presses with its colliding geoms or, if it has any, with the geoms whose names end in "_tactile". The latter have
the true shape of a body that collides with simplified geoms (feet, convex pieces).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import mujoco
import numpy as np
import shapely
import trimesh
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from mjtactile._types import Indices
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import FootprintError
from mjtactile.fem.surface_grid import SurfaceGrid
from mjtactile.geometry.flat_faces import BodyFaces
from mjtactile.geometry.height_minimum import Rectangle
from mjtactile.geometry.lower_surface import LowerSurface, lower_surface
from mjtactile.geometry.planar import areal
from mjtactile.geometry.primitives import Pose, Shape
from mjtactile.sim.geoms import body_face, geom_shape, geom_solid, pressing_geoms
from mjtactile.sim.wrench import PadFrame

Geometry = TypeVar("Geometry")

#: A face contains the first contact point if its lowest corner is within this of the body's lowest point [m].
_SAME_TOUCH = 1e-6


def geoms_in_pad(data: mujoco.MjData, frame: PadFrame, geoms: Indices) -> dict[int, Pose]:
    """Poses of geoms in the pad frame, by id.

    Args:
        data: state of the model, after a step or a forward pass.
        frame: pose of the pad frame in the world.
        geoms: ids of the geoms, (n,).
    """
    positions = (data.geom_xpos[geoms] - frame.position) @ frame.rotation
    rotations = frame.rotation.T @ data.geom_xmat[geoms].reshape(-1, 3, 3)
    return {int(g): Pose(*pose) for g, *pose in zip(geoms, positions, rotations, strict=True)}


class Imprints(ABC, Generic[Geometry]):
    """Makes the footprints of bodies on one pad; shapes of geoms are cached between calls.

    Args:
        model: compiled model.
        pad_geom: id of the pad's geom.
        surface: the pad's surface grid.
        facing_gap: parts up to this height above a body's first contact point face the pad [m].
    """

    def __init__(self, model: mujoco.MjModel, pad_geom: int, surface: SurfaceGrid, *, facing_gap: float) -> None:
        self.model = model
        self.pad_geom = pad_geom
        self.grid = surface
        self.facing_gap = facing_gap
        self._shapes: dict[int, Geometry] = {}

    def footprint(self, data: mujoco.MjData, frame: PadFrame, body: int, touching: Indices) -> Footprint:
        """Footprint of a body that presses on the pad.

        Args:
            data: state of the model, after a step or a forward pass.
            frame: pose of the pad frame in the world.
            body: id of the body.
            touching: ids of its geoms that touch the pad, (n,).

        Raises:
            FootprintError: no part of the body is over the sensing surface.
            SceneError: one of its geoms has no solid or surface.
        """
        return self._made(geoms_in_pad(data, frame, self._pressing(body, touching)))

    def _colliding(self, body: int) -> Indices:
        """A body's geoms that may collide with the pad."""
        own, model, pad = np.flatnonzero(self.model.geom_bodyid == body), self.model, self.pad_geom
        collides = (model.geom_contype[own] & model.geom_conaffinity[pad]) != 0
        collides |= (model.geom_conaffinity[own] & model.geom_contype[pad]) != 0
        return own[collides]

    def _pressing(self, body: int, touching: Indices) -> Indices:
        return pressing_geoms(self.model, body, touching)

    @abstractmethod
    def _made(self, placed: dict[int, Pose]) -> Footprint:
        """Footprint of some geoms of one body; `placed` has their poses in the pad frame, by id."""


class SectionImprints(Imprints[trimesh.Trimesh]):
    """Makes footprints for law "uniform": sections of the bodies' solids, `facing_gap` above their lowest points."""

    def _made(self, placed: dict[int, Pose]) -> Footprint:
        for geom in placed.keys() - self._shapes.keys():
            self._shapes[geom] = geom_solid(self.model, geom)
        solids = [(self._shapes[geom], pose.position, pose.rotation) for geom, pose in placed.items()]
        here = PadFrame(np.zeros(3), np.eye(3))
        footprint = Footprint.from_outline(body_face(solids, here, self.facing_gap), self.grid)
        if footprint.outline.buffer(-self.facing_gap / 2).is_empty:
            raise FootprintError(
                f"only a sliver narrower than {self.facing_gap * 1e6:.3g} um is over the surface. "
                "Press further in from the edge."
            )
        return footprint


class GapImprints(Imprints[Shape]):
    """Makes footprints for all other laws: outlines of flat faces, and gap functions of other bodies.

    Args:
        model: compiled model.
        pad_geom: id of the pad's geom.
        surface: the pad's surface grid.
        facing_gap: parts up to this height above a body's first contact point face the pad [m].
        level: whether a face must be parallel to the pad to count as flat, because its body cannot tilt.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        pad_geom: int,
        surface: SurfaceGrid,
        *,
        facing_gap: float,
        level: bool = False,
    ) -> None:
        super().__init__(model, pad_geom, surface, facing_gap=facing_gap)
        self.level = level
        self._sheet = Rectangle(*surface.bounds)
        self._depth = surface.thickness
        self._faces: dict[tuple[int, ...], BodyFaces] = {}

    def surface(self, placed: dict[int, Pose]) -> LowerSurface:
        """Lower surface of some geoms of one body.

        Args:
            placed: poses of the geoms in the pad frame, by id.

        Raises:
            FootprintError: no part of the body is over the sensing surface, or it is too far above.
        """
        near = {geom: pose for geom, pose in placed.items() if self._may_touch(geom, pose)}
        shapes = [(self._shape(geom), pose) for geom, pose in near.items()]
        return lower_surface(shapes, self._sheet, depth=self._depth, facing_gap=self.facing_gap)

    def _pressing(self, body: int, touching: Indices) -> Indices:
        """Geoms in contact, and geoms of the same body that may come into contact as it presses deeper."""
        return pressing_geoms(self.model, body, np.union1d(self._colliding(body), touching))

    def _made(self, placed: dict[int, Pose]) -> Footprint:
        surface = self.surface(placed)
        face = surface.flat_face(self.facing_gap, level=self.level)
        if face is None and not self.level:
            face = self._leaning_face(placed, surface.touch)
        if face is not None:
            return Footprint.from_outline(face, self.grid)
        outline = surface.flat_face(self.facing_gap) if self.level else None
        try:
            return Footprint.from_gap(surface.gap, self.grid, outline=outline, lowest=0.0)
        except FootprintError:  # too small to find on the whole sheet
            return Footprint.from_gap(surface.gap, self.grid, outline=self._shadow(placed), lowest=0.0)

    def _leaning_face(self, placed: dict[int, Pose], touch: float) -> Polygon | MultiPolygon | None:
        """Flat face of an inclined body, onto which the body tilts under its load; None if there is none.

        The face must contain the first contact point, whose height is `touch` [m].
        """
        geoms = tuple(placed)
        first = geoms[0]
        if geoms not in self._faces:
            origin = placed[first]
            local = {
                geom: Pose(origin.rotation.T @ (pose.position - origin.position), origin.rotation.T @ pose.rotation)
                for geom, pose in placed.items()
            }
            shapes = {geom: self._shape(geom) for geom in geoms}
            self._faces[geoms] = BodyFaces(shapes, local, facing_gap=self.facing_gap)
        for face, outline in self._faces[geoms].towards(placed[first]):
            over = shapely.get_coordinates(outline.intersection(self.grid.sheet))
            if len(over) and abs(face.heights(placed[first], over).min() - touch) <= _SAME_TOUCH:
                return outline
        return None

    def _shape(self, geom: int) -> Shape:
        if geom not in self._shapes:
            self._shapes[geom] = geom_shape(self.model, geom)
        return self._shapes[geom]

    def _shadow(self, placed: dict[int, Pose]) -> BaseGeometry:
        """Bounding squares of the geoms' bounding spheres, seen from above [m]."""
        squares = [
            shapely.Point(pose.position[:2]).buffer(self.model.geom_rbound[geom], cap_style="square")
            for geom, pose in placed.items()
            if self._may_touch(geom, pose) and self.model.geom_rbound[geom] > 0.0
        ]
        return areal(shapely.union_all(squares))

    def _may_touch(self, geom: int, pose: Pose) -> bool:
        """Whether a geom's bounding sphere is over the sheet and no higher above it than the pad's thickness."""
        if self.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            return True
        radius = self.model.geom_rbound[geom]
        x, y, z = pose.position
        west, south, east, north = self._sheet
        over = west - radius < x < east + radius and south - radius < y < north + radius
        return over and z - radius < self._depth
