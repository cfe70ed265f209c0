"""One pad in one MuJoCo model: contact wrench and geometry in, readings out."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
import shapely
import trimesh
from shapely import MultiPolygon, Polygon

from mjtactile.cache import influence_matrices
from mjtactile.contact import SurfaceLoad, contact_load
from mjtactile.errors import ContactWarning, FootprintError, SceneError
from mjtactile.footprint import Footprint
from mjtactile.geom import body_face, geom_solid, pressing_geoms
from mjtactile.influence import InfluenceMatrices
from mjtactile.mesh import MeshDensity
from mjtactile.pad import Array, Pad
from mjtactile.planar import areal
from mjtactile.wrench import PadFrame, contact_wrenches, geom_frame

#: What is no higher than this above a body's lowest point faces the pad [m], by default.
FACING_GAP = 50e-6
#: A footprint is kept while no coordinate of its pose relative to the pad moves by more than this [m or 1].
POSE_TOLERANCE = 1e-9
#: Largest difference between a pad's size and its geom's [m].
_SIZE_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class _KeptFootprint:
    """A body's footprint and the poses of its geoms relative to the pad it was cut for."""

    poses: Array
    footprint: Footprint


class TactileSensor:
    """Readings of a pad that is a box geom of a MuJoCo model; its +z face senses.

    Contact forces come from MuJoCo, footprints from the geometry of what touches: a body's visual geoms where it has
    some, its colliding geoms otherwise. Flat faces are what law "uniform" is made for; of a curved body, the part
    within `facing_gap` of its lowest point presses.

    Args:
        model: compiled model.
        pad: its size and thickness must be the geom's; by default the paper's.
        geom: name of the pad's geom.
        mesh: "draft", "default", "fine" or a MeshDensity; ignored when `influence` is given.
        influence: influence matrices of this pad, where they are at hand.
        law: contact law, see `contact_load`.
        facing_gap: [m].

    Raises:
        SceneError: when the model has no such geom, or it is not a box of the pad's size.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        pad: Pad | None = None,
        *,
        geom: str = "pad",
        mesh: str | MeshDensity = "default",
        influence: InfluenceMatrices | None = None,
        law: str = "uniform",
        facing_gap: float = FACING_GAP,
    ) -> None:
        self.model = model
        self.pad = pad if pad is not None else (influence.pad if influence is not None else Pad())
        self.geom = _pad_geom(model, geom, self.pad)
        if influence is not None and influence.pad != self.pad:
            raise SceneError(
                f"the influence matrices belong to a {influence.pad.summary}, the sensor to a {self.pad.summary}. "
                "Make them with influence_matrices(pad)."
            )
        self.influence = influence_matrices(self.pad, mesh) if influence is None else influence
        self.law = law
        self.facing_gap = facing_gap
        self._solids: dict[int, trimesh.Trimesh] = {}
        self._kept: dict[int, _KeptFootprint] = {}

    def read(self, data: mujoco.MjData) -> Array:
        """Von Mises readings (layers, rows, columns) [Pa] from the contacts of the last step or forward pass.

        Warns:
            ContactWarning: when a contact wrench cannot be carried by the footprint it came through.
        """
        load = self.load(data)
        return np.zeros(self.pad.reading_shape) if load is None else self.influence.readings(load)

    def load(self, data: mujoco.MjData) -> SurfaceLoad | None:
        """Tractions on the pad; None without contact. Its resultant is MuJoCo's contact wrench."""
        total: SurfaceLoad | None = None
        for footprint, wrench in self._touches(data):
            load = contact_load(self.influence, footprint, wrench[:3], moment=wrench[3:], law=self.law)
            total = load if total is None else total + load
        return total

    def wrench(self, data: mujoco.MjData) -> Array:
        """Total contact force [N] and moment about the pad's origin [N m] on the pad, pad frame, shape (6,)."""
        return contact_wrenches(self.model, data, self.geom).total

    def outline(self, data: mujoco.MjData) -> Polygon | MultiPolygon:
        """What faces the pad of all bodies that press on it, in the pad frame [m]; empty without contact."""
        return areal(shapely.union_all([footprint.outline for footprint, _ in self._touches(data)]))

    def forget_footprints(self) -> None:
        """Cut every footprint anew at the next reading."""
        self._kept.clear()

    def _touches(self, data: mujoco.MjData) -> Iterator[tuple[Footprint, Array]]:
        """Footprint and wrench of each body that presses on the pad."""
        frame = geom_frame(self.model, data, self.geom)
        contacts = contact_wrenches(self.model, data, self.geom, frame)
        for body, wrench in contacts.by_body(self.model).items():
            if not wrench.any():
                continue
            known = contacts.geoms[contacts.geoms >= 0]  # flexes are no geoms
            touching = known[self.model.geom_bodyid[known] == body]
            try:
                yield self._footprint(data, frame, body, touching), wrench
            except FootprintError as error:
                warnings.warn(
                    f"{self._label(body)} presses on the pad with {np.linalg.norm(wrench[:3]):.3g} N, but not on its "
                    f"sensing surface, so nothing is read from it: {error}",
                    ContactWarning,
                    stacklevel=4,
                )

    def _label(self, body: int) -> str:
        return "a flex" if body < 0 else f"body '{self.model.body(body).name or f'number {body}'}'"

    def _footprint(self, data: mujoco.MjData, frame: PadFrame, body: int, touching: np.ndarray) -> Footprint:
        if body < 0:
            raise FootprintError("it is a flex, whose footprint is not modelled. Press with geoms.")
        choices = pressing_geoms(self.model, body, touching)
        poses = np.concatenate([self._relative_pose(data, frame, int(g)) for geoms in choices for g in geoms])
        kept = self._kept.get(body)
        if kept is not None and kept.poses.shape == poses.shape and np.abs(kept.poses - poses).max() <= POSE_TOLERANCE:
            return kept.footprint
        *likelier, last = choices
        footprint = None
        for geoms in likelier:
            with contextlib.suppress(FootprintError):
                footprint = self._cut(data, frame, geoms)
        footprint = footprint or self._cut(data, frame, last)
        self._kept[body] = _KeptFootprint(poses, footprint)
        return footprint

    def _cut(self, data: mujoco.MjData, frame: PadFrame, geoms: np.ndarray) -> Footprint:
        """Footprint of some geoms of one body.

        Raises:
            FootprintError: when they are not over the sensing surface by more than a sliver, which is what sinks into
                the pad's flank.
        """
        solids = [(self._solid(int(g)), data.geom_xpos[g], data.geom_xmat[g].reshape(3, 3)) for g in geoms]
        footprint = Footprint.from_outline(body_face(solids, frame, self.facing_gap), self.influence)
        if footprint.outline.buffer(-self.facing_gap / 2).is_empty:
            raise FootprintError(
                f"what is over the surface is a sliver narrower than {self.facing_gap * 1e6:.3g} um. "
                "Press further in from the edge."
            )
        return footprint

    def _relative_pose(self, data: mujoco.MjData, frame: PadFrame, geom: int) -> Array:
        """Id, position and rotation of a geom in the pad frame, shape (13,)."""
        position = frame.rotation.T @ (data.geom_xpos[geom] - frame.position)
        rotation = frame.rotation.T @ data.geom_xmat[geom].reshape(3, 3)
        return np.concatenate([[geom], position, rotation.ravel()])

    def _solid(self, geom: int) -> trimesh.Trimesh:
        if geom not in self._solids:
            self._solids[geom] = geom_solid(self.model, geom)
        return self._solids[geom]


def _pad_geom(model: mujoco.MjModel, name: str, pad: Pad) -> int:
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    if geom < 0:
        names = [model.geom(i).name for i in range(model.ngeom) if model.geom(i).name]
        raise SceneError(f"geom '{name}' does not exist in the model. Available: {names}. Pass geom=... of the pad.")
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_BOX:
        raise SceneError(f"geom '{name}' is not a box. A pad is a box geom whose +z face senses.")
    actual, expected = 2 * model.geom_size[geom], np.array([*pad.size, pad.thickness])
    if np.abs(actual - expected).max() > _SIZE_TOLERANCE:
        raise SceneError(
            f"geom '{name}' measures {_millimetres(actual)} mm, but the pad {_millimetres(expected)} mm. "
            "Give the geom half of the pad's lengths as its size, or pass the Pad that fits it."
        )
    return geom


def _millimetres(lengths: Array) -> str:
    return " x ".join(f"{length * 1e3:.4g}" for length in lengths)
