"""What the compiled core asks Python for: the faces of bodies, and contacts it does not solve itself.

Answers depend on what is asked alone, not on what was asked before, so that simulations read the same in whatever
order and thread they run. Of a body that stands still, the contact cells are kept: they belong to its pose rounded to
the tolerance, and to its force rounded to a step of the same factor everywhere.
"""

from __future__ import annotations

import math
import warnings
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from mjtactile.cell_laws import CellLoad
from mjtactile.contact import beyond_linear_range, reported, solved_load
from mjtactile.errors import ContactError, ContactWarning, FootprintError, SceneError
from mjtactile.faces import BodyFaces, composed
from mjtactile.footprint import FACING_GAP, REACH, Footprint
from mjtactile.gap import Pose
from mjtactile.geom import geom_shape
from mjtactile.imprint import POSE_TOLERANCE, GapImprints, SectionImprints
from mjtactile.influence import InfluenceMatrices
from mjtactile.native_bodies import NativeBody, NativeFace
from mjtactile.options import ContactOptions, Wrench
from mjtactile.pad import Array
from mjtactile.wrench import Indices

#: Forces for which one choice of contact cells serves, as a factor.
_FORCE_STEP = 2.0**0.25
_KEPT_FOOTPRINTS = 64


class GeomModel(Protocol):
    """What is read of a compiled MuJoCo model: the model itself, or a copy of its geoms."""

    ngeom: int
    geom_type: Any
    geom_bodyid: Any
    geom_pos: Any
    geom_quat: Any


@dataclass(eq=False)
class _Standing:
    """A body at one pose."""

    footprint: Footprint
    chosen: dict[int, CellLoad | None] = field(default_factory=dict)  #: contact cells by step of force


class PressHost:
    """Bodies of one model on one pad.

    Args:
        model: compiled model, or a copy of its geoms.
        pad_geom: id of the pad's geom.
        influence: of the pad.
        options: how contacts are solved.
        facing_gap: see TactileSensor.
        pose_tolerance: see TactileSensor.
    """

    def __init__(
        self,
        model: Any,
        pad_geom: int,
        influence: InfluenceMatrices,
        options: ContactOptions,
        *,
        facing_gap: float = FACING_GAP,
        pose_tolerance: float = POSE_TOLERANCE,
    ) -> None:
        self.model = model
        self.influence = influence
        self.options = options
        self.facing_gap = facing_gap
        self.pose_tolerance = pose_tolerance
        kept = {"facing_gap": facing_gap, "pose_tolerance": pose_tolerance}
        level = not options.tilting
        self.imprints: GapImprints | SectionImprints = (
            SectionImprints(model, pad_geom, influence, **kept)
            if options.law == "uniform"
            else GapImprints(model, pad_geom, influence, **kept, level=level)
        )
        self._standing: OrderedDict[tuple[int, bytes], _Standing] = OrderedDict()
        self._bodies: dict[int, tuple[BodyFaces, NativeBody] | None] = {}
        self._faces: dict[tuple[int, int], NativeFace | None] = {}
        self._cut_faces: OrderedDict[tuple[int, int, bytes], NativeFace | None] = OrderedDict()

    def body(self, body: int) -> NativeBody | None:
        """A body's geometry; None where only the NumPy code presses it."""
        if body not in self._bodies:
            self._bodies[body] = self._made_body(body)
        known = self._bodies[body]
        return None if known is None else known[1]

    def face(self, body: int, number: int) -> NativeFace | None:
        """One of a body's flat faces; None where it is none that could press by itself."""
        key = (body, number)
        if key not in self._faces:
            known = self._bodies[body]
            face = None if known is None else known[0].face(number)
            self._faces[key] = None if face is None else NativeFace(face, self.options.cells)
        return self._faces[key]

    def cut_face(self, body: int, number: int, place: tuple[float, float, float]) -> NativeFace | None:
        """The part over the sheet of a body's face at (x, y) [m], turned by an angle [rad]; None for none."""
        known = self._bodies[body]
        face = None if known is None else known[0].face(number)
        part = None if face is None else face.over(self.influence.surface.sheet, place)
        if part is None:
            return None
        # Most places of a face larger than the sheet leave the same part, all of it.
        key = (body, number, part.outline.normalize().wkb)
        if key not in self._cut_faces:
            self._cut_faces[key] = NativeFace(part, self.options.cells, cut=True)
            if len(self._cut_faces) > _KEPT_FOOTPRINTS:
                self._cut_faces.popitem(last=False)
        self._cut_faces.move_to_end(key)
        return self._cut_faces[key]

    def nodal_forces(self, body: int, pose: Pose, wrench: Array) -> Array | None:
        """Nodal forces (nodes y, nodes x, 3) [N] of one body's contact under a wrench (6,); None without contact.

        Warns:
            ContactWarning: when the wrench cannot be carried, or only in part.
        """
        try:
            standing = self._at(body, pose)
            wanted = Wrench(wrench[:3], wrench[3:])
            known = None if standing.footprint.gap is None else self._chosen(standing, wanted)
            load, _ = solved_load(self.influence, standing.footprint, wanted, self.options, known)
            return reported(self.influence, standing.footprint, load, wanted, self.options).forces
        except (ContactError, FootprintError, SceneError) as error:
            warnings.warn(
                f"body number {body} presses on the pad with {np.linalg.norm(wrench[:3]):.3g} N, but nothing is read "
                f"from it: {error}",
                ContactWarning,
                stacklevel=2,
            )
            return None

    def warn_beyond_range(self, body: int, pressure: float, approach: float) -> None:
        """Warn that strains are no longer small under a body: mean pressure [Pa], indentation [m]."""
        reason = beyond_linear_range(self.influence.pad, pressure, approach)
        warnings.warn(f"body number {body}: {reason}", ContactWarning, stacklevel=2)

    def warn_not_carried(self, body: int, wrench: Array) -> None:
        """Warn that a body's force (6,) [N, N m] passes beside what it presses through."""
        x, y = wrench[4] / -wrench[2] * 1e3, -wrench[3] / -wrench[2] * 1e3
        warnings.warn(
            f"body number {body}: its force passes through ({x:.4g}, {y:.4g}) mm, outside the area it presses on. The "
            "nearest load that the contact can carry is read.",
            ContactWarning,
            stacklevel=2,
        )

    def _at(self, body: int, pose: Pose) -> _Standing:
        """The body at its pose rounded to the tolerance."""
        whole = [np.round(part / self.pose_tolerance) + 0.0 for part in pose]
        key = (body, b"".join(part.tobytes() for part in whole))
        if key in self._standing:
            self._standing.move_to_end(key)
            return self._standing[key]
        rounded = Pose(*(part * self.pose_tolerance for part in whole))
        geoms = np.unique(np.concatenate(self.imprints.choices(body)))
        placed = {geom: composed(rounded, local) for geom, local in self._local_poses(geoms).items()}
        standing = _Standing(self.imprints.footprint_of(body, placed))
        self._standing[key] = standing
        if len(self._standing) > _KEPT_FOOTPRINTS:
            self._standing.popitem(last=False)
        return standing

    def _chosen(self, standing: _Standing, wrench: Wrench) -> CellLoad | None:
        """Contact cells on a curved body for about this force."""
        if wrench.normal <= 0.0 or self.options.law == "uniform":
            return None
        step = round(math.log(wrench.normal) / math.log(_FORCE_STEP))
        if step not in standing.chosen:
            force = np.array([0.0, 0.0, -(_FORCE_STEP**step)])
            centre = np.array([*standing.footprint.centroid, 0.0])
            pressing = Wrench(force, np.cross(centre, force))
            standing.chosen[step] = solved_load(self.influence, standing.footprint, pressing, self.options)[1]
        return standing.chosen[step]

    def _made_body(self, body: int) -> tuple[BodyFaces, NativeBody] | None:
        if self.options.tangential != "proportional":
            return None
        local = self._local_poses(self.imprints.choices(body)[0])
        shapes = {geom: geom_shape(self.model, geom) for geom in local}
        uniform = self.options.law == "uniform"
        level = not self.options.tilting and not uniform
        faces = BodyFaces(shapes, local, facing_gap=self.facing_gap, level=level, leaning=not uniform)
        depth = self.influence.pad.thickness
        return faces, NativeBody(shapes, local, faces.facing, (depth, REACH * depth, self.facing_gap))

    def _local_poses(self, geoms: Indices) -> dict[int, Pose]:
        """Poses of geoms in their body's frame."""
        return {int(g): Pose(np.array(self.model.geom_pos[g]), _rotation(self.model.geom_quat[g])) for g in geoms}


def _rotation(quaternion: Array) -> Array:
    """Of a unit quaternion (w, x, y, z)."""
    w, x, y, z = (float(part) for part in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
