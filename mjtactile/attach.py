"""Add a pad to a MuJoCo model specification (MjSpec): geom, site, sensor and plugin in one call."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.errors import PresetError, SceneError
from mjtactile.fidelity import DEFAULT, Fidelity, fidelity_text
from mjtactile.pad import Pad
from mjtactile.pad_names import PLUGIN, named_pad, pad_text
from mjtactile.plugin.attributes import OUTPUTS, known_pad
from mjtactile.plugin.registration import ensure_registered
from mjtactile.sim.pad_geom import add_pad_geom


def attach_pad(
    spec: mujoco.MjSpec,
    *,
    body: str,
    name: str,
    pos: npt.ArrayLike = (0.0, 0.0, 0.0),
    quat: npt.ArrayLike = (1.0, 0.0, 0.0, 0.0),
    pad: Pad | str | None = None,
    fidelity: str | Fidelity = DEFAULT,
    output: str | None = "von_mises",
    visual: bool = False,
    law: str | None = None,
    friction: float | None = None,
    contact: str = "stiff",
) -> mujoco.MjsGeom:
    """Add a tactile pad to a body.

    Adds a geom `<name>_pad`, a site `<name>_surface` in the pad frame, and a sensor `<name>` of the plugin
    "mjtactile.pad". A flat pad's geom is a box. A curved pad's geom is a mesh of the same name in the pad's shape; a
    curved pad with hollows gets further geoms, `<name>_pad_piece_1` and so on (docs/curved.md). Place the pad slightly
    above the body's own geoms: it does not feel contacts on those. The pad collides with whatever the body's own geoms
    collide with. The model's defaults do not affect it.

    Args:
        spec: model specification; compile it afterwards.
        body: name of the body; "world" for the world.
        name: name of the sensor.
        pos: origin of the pad frame, the middle of the sensing surface, in the body's frame [m], (3,).
        quat: orientation of the pad frame in the body's frame, (w, x, y, z); the pad's z axis points out of the pad.
        pad: a Pad, the name of a registered one, or a file of saved influence matrices; by default the paper's pad. The
            model stores all numbers of a Pad, so that it can be saved and opened anywhere, but only the name of a file.
        fidelity: a preset by name, or a Fidelity, of which the model stores every choice.
        output: one or more of "von_mises", "stress", "wrench", "carried" and "range", separated by spaces. None adds no
            sensor, so that steps cost nothing: `TactileSensor(model, pad, geom="<name>_pad", fidelity=...)` reads the
            pad when it is asked, and `fidelity`, `law` and `friction` are its to choose.
        visual: whether viewers show the top layer's readings as a heat map on the pad: a tile per taxel, as wide as
            its ball where taxels are free.
        law: contact law in place of the fidelity's own.
        friction: coefficient [-] that bounds the shear the pad feels; by default what MuJoCo's contacts carry.
        contact: "stiff", or "soft" for grippers that cannot align themselves with the object: a tilted object then
            presses with a patch instead of a corner (docs/hands.md). `sim.pad_geom.contact_constants` lists the values,
            and two more names that this package's own models use: "press" and "hand".

    Returns:
        The geom, to change its contact parameters or colour.

    Raises:
        SceneError: no such body, pad, fidelity, output or contact; the name is taken; or `visual` without a sensor.
        NativeError: when the plugin cannot be registered with this MuJoCo.
    """
    ensure_registered()
    parent = _body(spec, body)
    _check_free(spec, name)
    place = _place(pos, quat)
    table, made = pad_table(pad)
    if output is None:
        if visual:
            raise SceneError(
                f"pad '{name}': viewers show what a sensor reads, and output=None adds none. Ask for an output."
            )
        return add_pad_geom(spec, parent, name, made, place, contact)
    config = {"pad": table, "fidelity": _fidelity_attribute(fidelity), "output": _checked_outputs(output)}
    config |= {"visual": "on" if visual else "off"} | _law_attributes(law, friction)
    geom = add_pad_geom(spec, parent, name, made, place, contact)
    add_pad_sensor(spec, name, config)
    return geom


def _body(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    found = spec.worldbody if name == "world" else spec.body(name)
    if found is None:
        names = [one.name for one in spec.bodies if one.name]
        raise SceneError(f"body '{name}' does not exist in the model. Available: {names}.")
    return found


def _check_free(spec: mujoco.MjSpec, name: str) -> None:
    if any(sensor.name == name for sensor in spec.sensors) or spec.geom(f"{name}_pad") is not None:
        raise SceneError(f"the model has a sensor '{name}' or a geom '{name}_pad' already. Give the pad another name.")


def _law_attributes(law: str | None, friction: float | None) -> dict[str, str]:
    chosen = {"law": law, "friction": None if friction is None else f"{friction:.17g}"}
    return {name: value for name, value in chosen.items() if value is not None}


def _fidelity_attribute(fidelity: str | Fidelity) -> str:
    try:
        return fidelity_text(fidelity)
    except PresetError as error:
        raise SceneError(str(error)) from error


def _checked_outputs(output: str) -> str:
    if unknown := [one for one in output.split() if one not in OUTPUTS]:
        raise SceneError(f"output {unknown[0]!r} does not exist. Available: {', '.join(OUTPUTS)}.")
    return output


def _place(pos: npt.ArrayLike, quat: npt.ArrayLike) -> tuple[Array, Array]:
    """Position [m] and unit quaternion."""
    position, orientation = np.asarray(pos, dtype=float), np.asarray(quat, dtype=float)
    if position.shape != (3,) or orientation.shape != (4,) or not np.linalg.norm(orientation) > 0.0:
        raise SceneError(f"pos = {pos}, quat = {quat}; expected three lengths [m] and a quaternion (w, x, y, z).")
    return position, orientation / np.linalg.norm(orientation)


def pad_table(pad: Pad | str | None) -> tuple[str, Pad]:
    """The plugin attribute `pad` of a model, and the pad it stands for.

    Args:
        pad: a Pad, the name of a registered one, or a file of saved influence matrices; None for the paper's pad.

    Returns:
        The attribute ("default", a file's name, or the pad's own numbers as text), and the Pad.

    Raises:
        SceneError: there is no pad or file of that name.
    """
    found = named_pad(pad) if isinstance(pad, str) else pad or Pad()
    if found is None:
        assert isinstance(pad, str)
        return pad, known_pad(pad)
    return ("default" if found == Pad() else pad_text(found)), found


def add_pad_sensor(spec: mujoco.MjSpec, name: str, config: dict[str, str]) -> None:
    """Add a sensor of the plugin to a model that already has the geom `<name>_pad`.

    Args:
        spec: model specification.
        name: name of the sensor.
        config: attributes of the plugin by name, see docs/plugin.md.
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
