"""Readings of one pad in a MuJoCo model, from contact forces and the geometry of what touches it."""

from __future__ import annotations

import mujoco
import numpy as np

from mjtactile._types import Array
from mjtactile.contact.footprint import FACING_GAP
from mjtactile.contact.options import TILTS, contact_options
from mjtactile.contact.press import Rim
from mjtactile.contact.tangentials import TANGENTIALS
from mjtactile.errors import SceneError, of_type
from mjtactile.fidelity import DEFAULT, Fidelity
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import ContactState, SurfaceLoad
from mjtactile.pad import Pad, require_pad
from mjtactile.plugin.attributes import plugin_sensor, shared_influence
from mjtactile.plugin.health import Health
from mjtactile.plugin.reader import NativeReader
from mjtactile.plugin.reading import Reading
from mjtactile.sim.mujoco_library import check_data
from mjtactile.sim.pad_check import pad_geom
from mjtactile.sim.wrench import contact_wrench
from mjtactile.units import finite_number

_SENSORS_OFF = mujoco.mjtDisableBit.mjDSBL_SENSOR.value


class TactileSensor:
    """Readings of a pad that is a geom of a MuJoCo model: a box whose +z face senses, or a mesh of a curved pad.

    Contact forces come from MuJoCo. Footprints come from the touching body's geoms that collide; if the body has geoms
    whose names end in "_tactile", or in that and a number, those are used instead. The compiled core solves every
    contact, as in the plugin. Forces on the pad's sides, and forces that the sensing surface cannot carry, are part of
    the wrench but not of the readings.

    Args:
        model: compiled model.
        pad: a Pad whose size and thickness are those of the geom; by default the paper's. Or the name of a sensor of
            the plugin "mjtactile.pad", whose pad, fidelity, law and readings are used, so that no other argument may be
            given; or the name of a pad's geom, in place of `geom`. Where the model disables its sensors, MuJoCo writes
            no readings, and this object solves the contacts.
        geom: name of the pad's geom; None for "pad".
        fidelity: preset by name or a Fidelity, see `influence_matrices`; None for "balanced". Ignored when `influence`
            is given.
        influence: influence matrices of this pad, if they are loaded already.
        law: contact law, see `contact_load`; None for the one of the influence matrices' fidelity.
        tangential: how shear is distributed, see `contact_load`; None for "proportional".
        friction: coefficient [-] that bounds shear, see `contact_load`; None: no bound, except that "coulomb" takes
            the friction of MuJoCo's contacts.
        tilt: "free" or "fixed", see `contact_load`; None for "free".
        facing_gap: parts of a body up to this height above its first contact point belong to the contact face [m]; None
            for `contact.footprint.FACING_GAP`.

    Raises:
        SceneError: the model is no MjModel or has no such geom, the geom does not have the pad's shape, `facing_gap` is
            no length, arguments contradict a sensor of the plugin, or two geoms are named. Methods raise it too, if
            `data` belongs to another model.
        PadError: `pad` is no pad.
        PresetError: there is no such fidelity.
        MeshError: the fidelity's mesh does not suit the pad.
        ContactError: law, tangential or tilt is unknown, they cannot be combined, or the friction is negative.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        pad: Pad | str | None = None,
        *,
        geom: str | None = None,
        fidelity: str | Fidelity | None = None,
        influence: InfluenceMatrices | None = None,
        law: str | None = None,
        tangential: str | None = None,
        friction: float | None = None,
        tilt: str | None = None,
        facing_gap: float | None = None,
    ) -> None:
        of_type(mujoco.MjModel, "model", model, SceneError, "MjSpec.compile() or MjModel.from_xml_path(...) makes one")
        if influence is not None:
            of_type(InfluenceMatrices, "influence", influence, SceneError, "influence_matrices(pad) makes them")
        self.model = model
        #: Where `sensordata` holds the readings, for a sensor of the plugin.
        self._sensordata: slice | None = None
        if isinstance(pad, str):
            found = plugin_sensor(model, pad)
            if found is None:
                _refuse_second_geom(pad, geom)
                pad, geom = None, pad
            else:
                own = {"fidelity": fidelity, "influence": influence, "law": law, "tangential": tangential}
                own |= {"friction": friction, "geom": geom, "tilt": tilt, "facing_gap": facing_gap}
                name = model.geom(found.geom).name
                _refuse_second_choice(pad, name, [option for option, given in own.items() if given is not None])
                pad, geom = None, name
                influence, self._sensordata = found.attributes.influence(), found.readings
                law, tangential, friction, tilt = found.attributes.contact
        self.pad = require_pad(pad) if pad is not None else (influence.pad if influence is not None else Pad())
        geom = "pad" if geom is None else geom
        self.geom = pad_geom(model, geom, self.pad)
        if influence is not None and influence.pad != self.pad:
            raise SceneError(
                f"the influence matrices belong to a {influence.pad.summary}, the sensor to a {self.pad.summary}. "
                "Make them with influence_matrices(pad)."
            )
        if influence is None:
            influence = shared_influence(self.pad, DEFAULT if fidelity is None else fidelity)
        self.influence = influence
        self.law = self.influence.fidelity.law if law is None else law
        self.tangential = TANGENTIALS[0] if tangential is None else tangential
        self.friction, self.tilt = friction, TILTS[0] if tilt is None else tilt
        options = contact_options(
            self.influence, law=law, tangential=self.tangential, friction=friction, tilt=self.tilt
        )
        self.facing_gap = FACING_GAP if facing_gap is None else _checked_gap(facing_gap)
        how = Reading(influence=self.influence, options=options, facing_gap=self.facing_gap)
        bodies = tuple(model.body(number).name for number in range(model.nbody))
        self._reader = NativeReader(how, self.geom, geom, bodies)

    def read(self, data: mujoco.MjData) -> Array:
        """Von Mises readings [Pa] from the contacts of the last step or forward pass.

        Returns:
            (layers, rows, columns), top layer first; (taxels,) for a pad with free taxels.

        Raises:
            SceneError: `data` belongs to another model.

        Warns:
            ContactWarning: once for every body and kind, when a contact wrench cannot be carried by the surface or only
                in part, or strains are not small.
        """
        self._check(data)
        if self._sensordata is not None and not self.model.opt.disableflags & _SENSORS_OFF:
            return np.array(data.sensordata[self._sensordata]).reshape(self.pad.reading_shape)
        return self._reader.read(self.model, data).readings

    def load(self, data: mujoco.MjData) -> SurfaceLoad | None:
        """Tractions on the pad as nodal forces [N], pad frame; None without contact.

        The load's residual is the part of the contact wrench that the tractions do not carry. Its contact is the area
        that bears pressure: exact for flat faces that press as a whole, otherwise to the size of a contact cell.

        Raises:
            SceneError: `data` belongs to another model.
        """
        self._check(data)
        found = self._reader.read(self.model, data, forces=True)
        if not found.wrench.any():
            return None
        left = found.wrench - found.carried
        state = ContactState(indentation=found.indentation, contact_area=found.area, peak_pressure=found.peak)
        return SurfaceLoad(found.forces, self.influence.surface, Rim(found.rim), left[:3], left[3:], state)

    def carried(self, data: mujoco.MjData) -> Array:
        """The part of the contact wrench that the readings carry.

        Returns:
            Force [N] and moment about the pad's origin [N m], pad frame, (6,).

        Raises:
            SceneError: `data` belongs to another model.
        """
        self._check(data)
        return self._reader.read(self.model, data).carried

    def health(self) -> Health:
        """Counts of readings beyond the range of small strains, carried only in part, refused, or slow.

        They count what this object has solved. For readings that the plugin wrote, see `mjtactile.plugin_health`.
        """
        return self._reader.health()

    def wrench(self, data: mujoco.MjData) -> Array:
        """The contact wrench on the pad: that of all of MuJoCo's contacts, also those with its sides.

        Returns:
            Force [N] and moment about the pad's origin [N m], pad frame, (6,).

        Raises:
            SceneError: `data` belongs to another model.
        """
        self._check(data)
        return contact_wrench(self.model, data, self.geom)

    def _check(self, data: mujoco.MjData) -> None:
        check_data(self.model, data, "the model that the TactileSensor was made with")


def _refuse_second_geom(pad: str, geom: str | None) -> None:
    """Refuse a geom beside one that is named in place of the pad."""
    if geom is not None:
        raise SceneError(
            f"pad = {pad!r} is no sensor of the plugin, so that it names the pad's geom, but geom = {geom!r} names one "
            f"too. Give one of them, TactileSensor(model, geom={geom!r}, ...), or a Pad as pad."
        )


def _refuse_second_choice(sensor: str, geom: str, given: list[str]) -> None:
    """Refuse arguments that a sensor of the plugin has chosen already."""
    if given:
        raise SceneError(
            f"'{sensor}' is a sensor of the plugin, which has its own {', '.join(given)}. Leave that out, or read its "
            f"pad in another way: TactileSensor(model, pad, geom='{geom}', ...)."
        )


def _checked_gap(gap: float) -> float:
    if not finite_number(gap) >= 0.0:
        raise SceneError(f"facing_gap = {gap!r}; expected a length in metres, such as {FACING_GAP:g}.")
    return float(gap)
