"""Attributes of a "mjtactile.pad" sensor: pad, fidelity, contact law, outputs.

Tables are loaded once per process and shared by every model, simulation and thread.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from mjtactile._native import library, pointer
from mjtactile.contact.options import TILTS, contact_options
from mjtactile.contact.tangentials import TANGENTIALS
from mjtactile.errors import InfluenceError, MeshError, PresetError, SceneError, of_type
from mjtactile.fidelity import CONTACT_LAWS, DEFAULT, PRESETS, Fidelity, as_fidelity, fidelity_from_text
from mjtactile.influence.cache import influence_matrices
from mjtactile.influence.matrices import InfluenceMatrices, load_influence, read_influence
from mjtactile.pad import Pad
from mjtactile.pad_names import PLUGIN, named_pad, no_such_value
from mjtactile.plugin.engine import Instance, attribute_names, running_layout
from mjtactile.plugin.health import HEALTH_NUMBERS, Health
from mjtactile.plugin.model_copy import ModelCopy
from mjtactile.plugin.reading import Reading, fill_instance
from mjtactile.sim.mujoco_library import element_id, is_pad_sensor, pad_sensor_names, plugin_config
from mjtactile.sim.pad_check import check_pad_geom

#: Outputs that a sensor can have.
OUTPUTS = ("von_mises", "stress", "wrench", "carried", "range")
_SWITCH = {"": False, "off": False, "on": True}


def known_pad(name: str) -> Pad:
    """The pad of a registered name, of a text (`mjtactile.pad_text`), or of a file of saved influence matrices.

    Raises:
        SceneError: it is none of these, or the text does not describe a pad.
    """
    try:
        return named_pad(name) or read_influence(name).pad
    except InfluenceError as error:
        raise SceneError(
            f'{PLUGIN}: attribute "pad": {error} Or name a TOML file, NAME.toml, see pad_from_file.'
        ) from error


class Attributes:
    """The attributes of one sensor, parsed from texts by name; a text is empty if the model does not set the attribute.

    Raises:
        SceneError: a value is invalid; the message lists the valid ones.
    """

    def __init__(self, values: dict[str, str]) -> None:
        self.pad = values["pad"] or "default"
        self.fidelity = values["fidelity"]
        self.outputs = _chosen_outputs(values["output"])
        self.law = _one_of("law", values["law"], CONTACT_LAWS)
        self.tangential = _one_of("tangential", values["tangential"], TANGENTIALS) or TANGENTIALS[0]
        self.tilt = _one_of("tilt", values["tilt"], TILTS) or TILTS[0]
        self.friction = _number("friction", values["friction"])
        if values["visual"] not in _SWITCH:
            raise SceneError(no_such_value("visual", values["visual"], ("on", "off")))
        self.visual = _SWITCH[values["visual"]]

    @property
    def contact(self) -> tuple[str | None, str, float | None, str]:
        """Law, tangential, friction and tilt."""
        return self.law, self.tangential, self.friction, self.tilt

    def influence(self) -> InfluenceMatrices:
        """Influence matrices of the sensor's pad and fidelity; loaded once per process.

        Raises:
            SceneError: there is no such pad, table or fidelity.
        """
        known = named_pad(self.pad)
        chosen = _chosen_fidelity(self.fidelity) if self.fidelity else None
        if known is None:
            return _of_file(self.pad, chosen, _version(self.pad))
        return shared_influence(known, chosen or DEFAULT)


def shared_influence(pad: Pad, fidelity: str | Fidelity) -> InfluenceMatrices:
    """Influence matrices of a pad, loaded once per process for sensors with and without the plugin."""
    return _of_pad(pad, as_fidelity(fidelity))


def _version(path: str) -> tuple[int, int]:
    """Modification time [ns] and size [bytes] of a file, which change when it is written again."""
    found = Path(path).stat()
    return found.st_mtime_ns, found.st_size


def _chosen_fidelity(text: str) -> Fidelity:
    if text not in PRESETS and not text.lstrip().startswith("{"):
        raise SceneError(no_such_value("fidelity", text, tuple(PRESETS)))
    try:
        return fidelity_from_text(text)
    except (MeshError, PresetError) as error:
        raise SceneError(f'{PLUGIN}: attribute "fidelity": {error}') from error


@lru_cache(maxsize=64)
def _of_pad(pad: Pad, fidelity: Fidelity) -> InfluenceMatrices:
    return influence_matrices(pad, fidelity)


@lru_cache(maxsize=64)
def _of_file(path: str, fidelity: Fidelity | None, _version: tuple[int, int]) -> InfluenceMatrices:
    return load_influence(path, fidelity=fidelity)


class PluginSensor(NamedTuple):
    """A sensor of the plugin in a compiled model."""

    geom: int  #: id of its pad's geom
    attributes: Attributes  #: its attributes
    readings: slice | None  #: part of `sensordata` with its von Mises stress [Pa]; None if it does not output it


def plugin_sensor(model: mujoco.MjModel, name: str) -> PluginSensor | None:
    """A sensor of the plugin by its name, with its tables loaded; None if the plugin has no sensor of that name.

    Raises:
        SceneError: an attribute of the sensor is invalid.
    """
    sensor = element_id(model, mujoco.mjtObj.mjOBJ_SENSOR, name, "pad")
    if not is_pad_sensor(model, sensor):
        return None
    instance = int(model.sensor_plugin[sensor])
    attributes = Attributes({key: plugin_config(model, instance, key) for key in attribute_names()})
    taxels = int(np.prod(attributes.influence().pad.reading_shape))
    widths = {"von_mises": taxels, "stress": 6 * taxels, "wrench": 6, "carried": 6, "range": 1}
    start = int(model.sensor_adr[sensor])
    for output in attributes.outputs:
        if output == "von_mises":
            return PluginSensor(int(model.sensor_objid[sensor]), attributes, slice(start, start + taxels))
        start += widths[output]
    return PluginSensor(int(model.sensor_objid[sensor]), attributes, None)


def plugin_health(model: mujoco.MjModel, data: mujoco.MjData, sensor: str) -> Health:
    """Counts of problems in the readings of a sensor of the plugin since its `MjData` was made.

    Args:
        model: compiled model.
        data: an MjData of this model.
        sensor: name of the sensor.

    Raises:
        SceneError: the model has no such sensor of the plugin, or `data` belongs to another model.
    """
    of_type(mujoco.MjModel, "model", model, SceneError, "MjSpec.compile() makes one")
    of_type(mujoco.MjData, "data", data, SceneError, "mujoco.MjData(model) makes one")
    known = pad_sensor_names(model)
    if sensor not in known:
        raise SceneError(f"the model has no sensor '{sensor}' of the plugin {PLUGIN}. Available: {known}.")
    numbers = np.zeros(HEALTH_NUMBERS)
    instance = int(model.sensor_plugin[model.sensor(sensor).id])
    if not library().mjt_plugin_health(ctypes.c_void_p(int(data._address)), ctypes.c_int(instance), pointer(numbers)):
        raise SceneError(f"data has no sensor '{sensor}' of the plugin. Pass data that was made from this model.")
    return Health.of(numbers)


def _chosen_outputs(text: str) -> list[str]:
    names = text.split() or [OUTPUTS[0]]
    for name in names:
        if name not in OUTPUTS or names.count(name) > 1:
            raise SceneError(no_such_value("output", text, OUTPUTS) + " Several are separated by spaces, each once.")
    return names


def _one_of(attribute: str, value: str, known: tuple[str, ...]) -> str | None:
    if value and value not in known:
        raise SceneError(no_such_value(attribute, value, known))
    return value or None


def _number(attribute: str, value: str) -> float | None:
    try:
        return float(value) if value else None
    except ValueError:
        raise SceneError(f'{PLUGIN}: {attribute}="{value}" is not a number, such as "0.8".') from None


def fill(to: Instance, model: int | None, geom: int, attributes: Attributes) -> None:
    """Fill the plugin's instance. Without a model, only the sizes of the sensor's outputs are filled in.

    Args:
        to: the instance to fill.
        model: address of the model that is being compiled, or None.
        geom: id of the pad's geom.
        attributes: attributes of the sensor.

    Raises:
        SceneError: an attribute is invalid, or the geom does not have the pad's shape.
        ContactError: the options of the contact are invalid.
    """
    influence = attributes.influence()
    pad = influence.pad
    to.taxels = int(np.prod(pad.reading_shape))
    to.output_count = len(attributes.outputs)
    to.outputs[: to.output_count] = [OUTPUTS.index(name) for name in attributes.outputs]
    if model is None:
        return
    options = contact_options(
        influence,
        law=attributes.law,
        tangential=attributes.tangential,
        friction=attributes.friction,
        tilt=attributes.tilt,
    )
    copy = ModelCopy(model, running_layout())
    check_pad_geom(copy, geom, pad)
    how = Reading(influence=influence, options=options, stress="stress" in attributes.outputs)
    name = copy.geom(geom).name or f"geom number {geom}"
    fill_instance(to, how, name, tuple(copy.body(number).name for number in range(copy.nbody)), asked=False)
    to.visual = attributes.visual
