"""Pads added to any model that is still being written: geom, site, sensor and plugin in one call."""

from __future__ import annotations

import hashlib
import json

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile.errors import SceneError
from mjtactile.pad import Pad
from mjtactile.plugin import PLUGIN, ensure_registered
from mjtactile.plugin_attributes import OUTPUTS, known_pad, register_pad
from mjtactile.preset import PRESETS

#: Contact of a pad's geom: what settles 10 to 200 gf within .1 % (docs/plugin.md). The priority makes it count against
#: whatever the hand or the object brings along.
_CONTACT = {
    "condim": 4,
    "friction": [1.0, 0.0005, 0.0001],
    "solref": [0.005, 1.0],
    "solimp": [0.98, 0.99, 0.001, 0.5, 2.0],
    "priority": 10,
}
_COLOUR = [0.75, 0.8, 0.85, 1.0]
_DENSITY = 965.0  # of PDMS [kg/m^3]


def attach_pad(
    spec: mujoco.MjSpec,
    *,
    body: str,
    name: str,
    pos: npt.ArrayLike = (0.0, 0.0, 0.0),
    quat: npt.ArrayLike = (1.0, 0.0, 0.0, 0.0),
    pad: Pad | str | None = None,
    fidelity: str = "balanced",
    output: str = "von_mises",
    visual: bool = False,
    law: str | None = None,
    friction: float | None = None,
) -> mujoco.MjsGeom:
    """Add a tactile pad to a body.

    Adds a box geom `<name>_pad`, a site `<name>_surface` in the middle of its sensing surface, and a sensor `<name>` of
    the plugin "mjtactile.pad". Let the pad stand a little proud of the body's own geoms: what
    touches those is not felt.

    Args:
        spec: of the model; compile it afterwards.
        body: name of the body; "world" for the world.
        name: of the sensor.
        pos: where the middle of the sensing surface stands in the body's frame [m], shape (3,).
        quat: orientation of the pad frame there, z out of the pad, (w, x, y, z).
        pad: a pad, the name of a registered one or a file of saved influence matrices; by default the paper's.
        fidelity: preset by name.
        output: one or more of "von_mises", "stress" and "wrench", separated by spaces.
        visual: whether viewers show the top layer's readings as a heat map on the pad.
        law: contact law in place of the fidelity's own.
        friction: coefficient that bounds the shear the pad feels; by default what MuJoCo's contacts carry.

    Returns:
        The geom, to change its contact parameters or colour.

    Raises:
        SceneError: when there is no such body, pad, fidelity or output, or the name is taken.
        NativeError: when the plugin cannot be registered with this MuJoCo.
    """
    ensure_registered()
    parent = spec.worldbody if body == "world" else spec.body(body)
    if parent is None:
        names = [one.name for one in spec.bodies if one.name]
        raise SceneError(f"body '{body}' does not exist in the model. Available: {names}.")
    if any(sensor.name == name for sensor in spec.sensors) or spec.geom(f"{name}_pad") is not None:
        raise SceneError(f"the model has a sensor '{name}' or a geom '{name}_pad' already. Give the pad another name.")
    if fidelity not in PRESETS:
        raise SceneError(f"fidelity {fidelity!r} does not exist. Available: {', '.join(PRESETS)}.")
    if unknown := [one for one in output.split() if one not in OUTPUTS]:
        raise SceneError(f"output {unknown[0]!r} does not exist. Available: {', '.join(OUTPUTS)}.")
    position, orientation = np.asarray(pos, dtype=float), np.asarray(quat, dtype=float)
    if position.shape != (3,) or orientation.shape != (4,) or not np.linalg.norm(orientation) > 0.0:
        raise SceneError(f"pos = {pos}, quat = {quat}; expected three lengths [m] and a quaternion (w, x, y, z).")
    table, made = pad_table(pad)
    geom = _add_geom(parent, name, made, position, orientation / np.linalg.norm(orientation))
    config = {"pad": table, "fidelity": fidelity, "output": output, "visual": "on" if visual else "off"}
    config |= {} if law is None else {"law": law}
    config |= {} if friction is None else {"friction": f"{friction:.17g}"}
    add_pad_sensor(spec, name, config)
    return geom


def pad_table(pad: Pad | str | None) -> tuple[str, Pad]:
    """Text by which a model names a pad, and the pad; a pad of one's own is registered.

    Raises:
        SceneError: there is no pad or file of that name.
    """
    if pad is None:
        return "default", Pad()
    if isinstance(pad, str):
        return pad, known_pad(pad)
    if pad == Pad():
        return "default", pad
    digest = hashlib.sha256(json.dumps(pad.description, sort_keys=True).encode()).hexdigest()
    name = f"pad-{digest[:12]}"
    register_pad(name, pad)
    return name, pad


def _add_geom(
    parent: mujoco.MjsBody, name: str, pad: Pad, position: npt.NDArray[np.float64], quat: npt.NDArray[np.float64]
) -> mujoco.MjsGeom:
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quat)
    centre = position - rotation.reshape(3, 3)[:, 2] * pad.thickness / 2
    geom = parent.add_geom(
        name=f"{name}_pad",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[pad.size[0] / 2, pad.size[1] / 2, pad.thickness / 2],
        pos=centre,
        quat=quat,
        rgba=_COLOUR,
        density=_DENSITY,
        **_CONTACT,
    )
    parent.add_site(name=f"{name}_surface", pos=position, quat=quat, size=[0.0002, 0.0002, 0.0002], group=4)
    return geom


def add_pad_sensor(spec: mujoco.MjSpec, name: str, config: dict[str, str]) -> None:
    """A sensor of the plugin on geom `<name>_pad`, which is there already.

    Args:
        spec: of the model.
        name: of the sensor.
        config: attributes of the plugin, see docs/plugin.md.
    """
    spec.activate_plugin(PLUGIN)
    instance = spec.add_plugin(name=f"{name}_plugin", plugin_name=PLUGIN, active=True)
    instance.config = config
    sensor = spec.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_PLUGIN,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname=f"{name}_pad",
        needstage=mujoco.mjtStage.mjSTAGE_ACC,
        datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
    )
    sensor.plugin = instance
    sensor.plugin.name = f"{name}_plugin"
    sensor.plugin.plugin_name = PLUGIN
    sensor.plugin.active = True
