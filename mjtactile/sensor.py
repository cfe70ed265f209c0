"""One pad in one MuJoCo model: contact wrench and geometry in, readings out."""

from __future__ import annotations

import functools
import operator
import warnings
from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeVar

import mujoco
import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from mjtactile.basis import WrenchBasis
from mjtactile.cache import influence_matrices
from mjtactile.errors import ContactError, ContactWarning, FootprintError, SceneError
from mjtactile.footprint import FACING_GAP, Footprint
from mjtactile.geom import pad_geom
from mjtactile.imprint import POSE_TOLERANCE, GapImprints, Imprints, SectionImprints
from mjtactile.influence import InfluenceMatrices
from mjtactile.load import SurfaceLoad
from mjtactile.mesh import MeshDensity
from mjtactile.options import contact_options
from mjtactile.pad import Array, Pad
from mjtactile.planar import areal
from mjtactile.plugin_attributes import plugin_sensor
from mjtactile.preset import Fidelity
from mjtactile.several import contact_loads
from mjtactile.wrench import PadFrame, contact_wrenches, geom_frame

Answer = TypeVar("Answer")


class TactileSensor:
    """Readings of a pad that is a box geom of a MuJoCo model; its +z face senses.

    Contact forces come from MuJoCo, footprints from the geometry of what touches: a body's visual geoms where it has
    some, its colliding geoms otherwise. Law "uniform" takes the section of a body `facing_gap` above its lowest point
    for its footprint, the others the true shape: the outline of a flat face, the gap map of any other.

    Args:
        model: compiled model.
        pad: its size and thickness must be the geom's; by default the paper's. Or the name of a sensor of the plugin
            "mjtactile.pad", whose pad, fidelity and law are taken and whose readings are read; or of a pad's geom.
        geom: name of the pad's geom.
        mesh: "draft", "default", "fine" or a MeshDensity; ignored when `influence` is given.
        preset: fidelity by name in place of a mesh, see `influence_matrices`; ignored when `influence` is given.
        influence: influence matrices of this pad, where they are at hand.
        law: contact law, see `contact_load`; None for the influence matrices' own.
        tangential: how shear is spread, see `contact_load`.
        friction: sliding friction [-], see `contact_load`; None for that of MuJoCo's contacts where "coulomb" needs it.
        tilt: "free" or "fixed", see `contact_load`; None for "free".
        coupled: whether each of several bodies on the pad feels how the others bend it, see `contact_loads`; for law
            "elastic". It matters where bodies are less than 2 mm apart and costs the wrench basis.
        facing_gap: [m].
        pose_tolerance: a footprint and what is known of its contact are kept while no coordinate of the body's pose
            relative to the pad has moved by more than this since they were made [m or rad].

    Raises:
        SceneError: when the model has no such geom, or it is not a box of the pad's size.
        ContactError: when there is no such law, tangential or tilt, or they do not go together.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        pad: Pad | str | None = None,
        *,
        geom: str = "pad",
        mesh: str | MeshDensity | None = None,
        preset: str | Fidelity | None = None,
        influence: InfluenceMatrices | None = None,
        law: str | None = None,
        tangential: str = "proportional",
        friction: float | None = None,
        tilt: str | None = None,
        coupled: bool = False,
        facing_gap: float = FACING_GAP,
        pose_tolerance: float = POSE_TOLERANCE,
    ) -> None:
        self.model = model
        #: Where the plugin puts its readings, if it is a sensor of the plugin that is read.
        self._sensordata: slice | None = None
        if isinstance(pad, str):
            found = plugin_sensor(model, pad)
            pad, geom = None, pad if found is None else model.geom(found.geom).name
            if found is not None:
                influence, self._sensordata = found.attributes.influence(), found.readings
                law, tangential, friction, tilt = found.attributes.contact
        self.pad = pad if pad is not None else (influence.pad if influence is not None else Pad())
        self.geom = pad_geom(model, geom, self.pad)
        if influence is not None and influence.pad != self.pad:
            raise SceneError(
                f"the influence matrices belong to a {influence.pad.summary}, the sensor to a {self.pad.summary}. "
                "Make them with influence_matrices(pad)."
            )
        self.influence = influence_matrices(self.pad, mesh, preset=preset) if influence is None else influence
        self.law = self.influence.fidelity.law if law is None else law
        self.tangential, self.friction, self.tilt = tangential, friction, "free" if tilt is None else tilt
        # Friction of "coulomb" may only be known at the contact; the rest is refused here.
        known_friction = 1.0 if friction is None and tangential == "coulomb" else friction
        if coupled and tangential == "coulomb" and friction is None:
            raise ContactError("several coupled bodies slip with one friction: pass friction=..., for example 0.8.")
        contact_options(self.influence, law=law, tangential=tangential, friction=known_friction, tilt=self.tilt)
        self.coupled = coupled
        self.facing_gap = facing_gap
        self.pose_tolerance = pose_tolerance
        self._imprints = self._new_imprints()
        self._bases: dict[int, WrenchBasis] = {}

    def read(self, data: mujoco.MjData) -> Array:
        """Von Mises readings (layers, rows, columns) [Pa] from the contacts of the last step or forward pass.

        Warns:
            ContactWarning: when a contact wrench cannot be carried by the footprint it came through, or only in part.
        """
        if self._sensordata is not None:
            return np.array(data.sensordata[self._sensordata]).reshape(self.pad.reading_shape)
        touches = list(self._touches(data))
        if self.coupled and len(touches) > 1:
            load = self._coupled_load(touches)
            return np.zeros(self.pad.reading_shape) if load is None else self.influence.readings(load)
        total: Array | None = None
        for touch in touches:
            response = self._solved(data, touch, WrenchBasis.response)
            if response is not None:
                total = response if total is None else total + response
        return np.zeros(self.pad.reading_shape) if total is None else self.influence.readings_of(total)

    def load(self, data: mujoco.MjData) -> SurfaceLoad | None:
        """Tractions on the pad; None without contact. Its resultant is MuJoCo's contact wrench."""
        touches = list(self._touches(data))
        if self.coupled and len(touches) > 1:
            return self._coupled_load(touches)
        total: SurfaceLoad | None = None
        for touch in touches:
            load = self._solved(data, touch, WrenchBasis.load)
            if load is not None:
                total = load if total is None else total + load
        return total

    def wrench(self, data: mujoco.MjData) -> Array:
        """Total contact force [N] and moment about the pad's origin [N m] on the pad, pad frame, shape (6,)."""
        return contact_wrenches(self.model, data, self.geom).total

    def outline(self, data: mujoco.MjData) -> Polygon | MultiPolygon:
        """What faces the pad of all bodies that press on it, in the pad frame [m]; empty without contact."""
        return areal(shapely.union_all([touch.footprint.outline for touch in self._touches(data)]))

    def forget_footprints(self) -> None:
        """Make every footprint anew at the next reading, also of height fields that have changed."""
        self._imprints.forget()
        self._bases.clear()

    def _touches(self, data: mujoco.MjData) -> Iterator[_Touch]:
        """Each body that presses on the pad."""
        frame = geom_frame(self.model, data, self.geom)
        contacts = contact_wrenches(self.model, data, self.geom, frame)
        for body, wrench in contacts.by_body(self.model).items():
            if not wrench.any():
                continue
            known = contacts.geoms[contacts.geoms >= 0]  # flexes are no geoms
            touching = known[self.model.geom_bodyid[known] == body]
            try:
                yield _Touch(body, self._footprint(data, frame, body, touching), wrench)
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
        return self._imprints.footprint(data, frame, body, touching)

    def _new_imprints(self) -> Imprints:
        kept = {"facing_gap": self.facing_gap, "pose_tolerance": self.pose_tolerance}
        if self.law == "uniform":
            return SectionImprints(self.model, self.geom, self.influence, **kept)
        level = self.tilt == "fixed"
        return GapImprints(self.model, self.geom, self.influence, **kept, level=level)

    def _solved(
        self, data: mujoco.MjData, touch: _Touch, ask: Callable[[WrenchBasis, Array, Array], Answer]
    ) -> Answer | None:
        """What one body's contact answers; None, and a warning, where no contact is found that carries its wrench."""
        try:
            return ask(self._basis(data, touch), touch.wrench[:3], touch.wrench[3:])
        except ContactError as error:
            warnings.warn(
                f"{self._label(touch.body)} presses on the pad with {np.linalg.norm(touch.wrench[:3]):.3g} N, but "
                f"nothing is read from it: {error}",
                ContactWarning,
                stacklevel=4,
            )
            return None

    def _coupled_load(self, touches: list[_Touch]) -> SurfaceLoad | None:
        """Loads of all bodies together, each on the surface as the others bend it."""
        wrenches = np.array([touch.wrench for touch in touches])
        try:
            loads = contact_loads(
                self.influence,
                [touch.footprint for touch in touches],
                wrenches[:, :3],
                moments=wrenches[:, 3:],
                law=self.law,
                tangential=self.tangential,
                friction=self.friction,
                tilt=self.tilt,
            )
        except ContactError as error:
            names = ", ".join(self._label(touch.body) for touch in touches)
            warnings.warn(f"nothing is read from {names}: {error}", ContactWarning, stacklevel=3)
            return None
        return functools.reduce(operator.add, loads)

    def _basis(self, data: mujoco.MjData, touch: _Touch) -> WrenchBasis:
        """The body's own basis, a new one when its footprint or its friction is."""
        friction = self.friction
        if friction is None and self.tangential == "coulomb":
            friction = self._friction(data, touch.body)
        basis = self._bases.get(touch.body)
        if basis is None or basis.footprint is not touch.footprint or basis.options.friction != friction:
            basis = WrenchBasis(
                self.influence,
                touch.footprint,
                law=self.law,
                tangential=self.tangential,
                friction=friction,
                tilt=self.tilt,
            )
            self._bases[touch.body] = basis
        return basis

    def _friction(self, data: mujoco.MjData, body: int) -> float:
        """The largest sliding friction of a body's contacts with the pad: what they hold, the law can hold [-]."""
        pairs = data.contact.geom.reshape(-1, 2)
        on_pad = (pairs == self.geom).any(axis=1) & (pairs >= 0).all(axis=1)
        bodies = self.model.geom_bodyid[pairs]
        return float(data.contact.friction[on_pad & (bodies == body).any(axis=1), :2].max())


class _Touch(NamedTuple):
    """A body that presses on the pad."""

    body: int
    footprint: Footprint
    wrench: Array  #: [N, N m], shape (6,)
