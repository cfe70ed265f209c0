"""Add a pad to a MuJoCo model specification (MjSpec): geom, site, sensor and plugin in one call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjtactile._types import Array
from mjtactile.contact.options import TILTS, contact_options
from mjtactile.contact.tangentials import TANGENTIALS
from mjtactile.errors import ContactError, PresetError, SceneError, of_type, shortened
from mjtactile.fidelity import DEFAULT, Fidelity, as_fidelity, fidelity_text
from mjtactile.influence.matrices import read_influence
from mjtactile.pad import Pad
from mjtactile.pad_names import PLUGIN, named_pad, pad_text
from mjtactile.plugin.attributes import OUTPUTS, known_pad
from mjtactile.plugin.registration import ensure_registered
from mjtactile.sim.pad_geom import add_pad_geom, piece_names
from mjtactile.sim.pad_solid import pad_solid
from mjtactile.units import real_numbers


def attach_pad(
    spec: mujoco.MjSpec,
    *,
    body: str,
    name: str,
    pos: npt.ArrayLike = (0.0, 0.0, 0.0),
    quat: npt.ArrayLike = (1.0, 0.0, 0.0, 0.0),
    pad: Pad | str | Path | None = None,
    fidelity: str | Fidelity | None = None,
    output: str | None = "von_mises",
    visual: bool = False,
    law: str | None = None,
    tangential: str = "proportional",
    friction: float | None = None,
    tilt: str = "free",
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
        pad: a Pad, the name of a registered one, a TOML file of one, or a file of saved influence matrices; by default
            the paper's pad. The model stores all numbers of a Pad, so that it can be saved and opened anywhere. Of a
            file of influence matrices it stores only the name.
        fidelity: a preset by name, or a Fidelity, of which the model stores every choice; by default "balanced" or, for
            a file of influence matrices, its own.
        output: one or more of "von_mises", "stress", "wrench", "carried" and "range", separated by spaces. None adds no
            sensor, so that steps cost nothing: `TactileSensor(model, pad, geom="<name>_pad", fidelity=...)` reads the
            pad when it is asked, and takes `fidelity`, `law`, `tangential`, `friction` and `tilt` as its arguments.
        visual: whether viewers show the top layer's readings as a heat map on the pad: a tile per taxel, as wide as
            its ball where taxels are free.
        law: contact law in place of the fidelity's own.
        tangential: how shear is distributed, see `contact_load`; "coulomb" takes the friction of MuJoCo's contacts
            where `friction` is None.
        friction: coefficient [-] that bounds the shear the pad feels; by default what MuJoCo's contacts carry.
        tilt: "free", or "fixed" for bodies that keep their orientation, see `contact_load`.
        contact: "stiff", or "soft" for grippers that cannot align themselves with the object: a tilted object then
            presses with a patch instead of a corner (docs/hands.md). `sim.pad_geom.contact_constants` lists the values,
            and two more names that this package's own models use: "press" and "hand".

    Returns:
        The geom, to change its contact parameters or colour.

    Raises:
        SceneError: no such body, pad, fidelity, output, law, tangential, tilt or contact, or a law that does not
            offer `tangential`; the name is taken; a number is not finite; `visual` is no bool, or is True without a
            sensor; or `spec` is no specification. The specification is then unchanged.
        NativeError: when the plugin cannot be registered with this MuJoCo.
    """
    ensure_registered()
    check_spec(spec)
    parent = _body(spec, body)
    place = _place(pos, quat)
    of_type(bool, "visual", visual, SceneError)
    of_type(str, "contact", contact, SceneError, "'stiff' or 'soft'")
    table, made = pad_table(pad)
    check_free(spec, name, made)
    if output is None:
        if visual:
            raise SceneError(
                f"pad '{name}': visual=True shows the readings of a sensor, and output=None adds no sensor. Give an "
                "output, such as 'von_mises', or leave visual out."
            )
        return add_pad_geom(spec, parent, name, made, place, contact)
    config = {"pad": table, "output": _checked_outputs(output), "visual": "on" if visual else "off"}
    own = read_influence(table).fidelity if fidelity is None and named_pad(table) is None else None
    chosen = own or (DEFAULT if fidelity is None else fidelity)
    config |= _contact_attributes(chosen, law=law, tangential=tangential, friction=friction, tilt=tilt)
    if own is not None:
        del config["fidelity"]  # which the file says
    geom = add_pad_geom(spec, parent, name, made, place, contact)
    add_pad_sensor(spec, name, config)
    return geom


def check_spec(spec: Any) -> None:
    """Check that an argument is a model specification, to which a pad can be attached.

    Raises:
        SceneError: `spec` is not a mujoco.MjSpec.
    """
    if isinstance(spec, mujoco.MjSpec):
        return
    cure = "Make one with mujoco.MjSpec.from_file(...) or mujoco.MjSpec.from_string(...)"
    if isinstance(spec, mujoco.MjModel):
        cure = "A compiled model takes no more geoms: attach the pad to its MjSpec, and compile that"
    raise SceneError(f"spec is of type {type(spec).__name__}; expected a mujoco.MjSpec. {cure}.")


def _body(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    found = spec.worldbody if name == "world" else spec.body(name) if isinstance(name, str) else None
    if found is None:
        names = [one.name for one in spec.bodies if one.name]
        raise SceneError(f"body {name!r} does not exist in the model. Available: {names}.")
    return found


def check_free(spec: mujoco.MjSpec, name: str, pad: Pad) -> None:
    """Check that a model does not yet contain any of the elements that a pad of this name adds.

    Raises:
        SceneError: the model has a sensor, geom, mesh, site or plugin of such a name, or the name is empty or holds a
            null character.
    """
    if not isinstance(name, str) or not name:
        raise SceneError(f"name = {name!r}; expected a text that is not empty, such as 'ff'.")
    if "\0" in name:
        raise SceneError(f"name = {name!r}; expected a text without the null character, at which MuJoCo ends a name.")
    geoms = [f"{name}_pad"] if pad.surface.is_flat else piece_names(f"{name}_pad", pad_solid(pad))
    meshes = [] if pad.surface.is_flat else geoms
    taken = [f"sensor '{name}'"] if any(sensor.name == name for sensor in spec.sensors) else []
    taken += [f"geom '{one}'" for one in geoms if spec.geom(one) is not None]
    taken += [f"mesh '{one}'" for one in meshes if spec.mesh(one) is not None]
    taken += [f"site '{name}_surface'"] if spec.site(f"{name}_surface") is not None else []
    taken += [f"plugin '{name}_plugin'"] if any(one.name == f"{name}_plugin" for one in spec.plugins) else []
    if taken:
        raise SceneError(f"the model has a {taken[0]} already. Give the pad another name than '{name}'.")


def _contact_attributes(fidelity: str | Fidelity, **options: Any) -> dict[str, str]:
    """Attributes for a fidelity and options of `contact_load`, without those that are the default."""
    try:
        text = fidelity_text(fidelity)
        contact_options(as_fidelity(fidelity), **options)
    except (PresetError, ContactError) as error:
        raise SceneError(str(error)) from error
    friction = options.pop("friction")
    defaults = {"law": None, "tangential": TANGENTIALS[0], "tilt": TILTS[0]}
    chosen = {name: value for name, value in options.items() if value != defaults[name]}
    return {"fidelity": text, **chosen} | ({} if friction is None else {"friction": f"{friction:.17g}"})


def _checked_outputs(output: str) -> str:
    names: list[Any] = [*output.split()] if isinstance(output, str) else [output]
    for name in names:
        if not (isinstance(name, str) and name in OUTPUTS) or names.count(name) > 1:
            raise SceneError(
                f"output {shortened(name)} does not exist or is given twice. Available: {', '.join(OUTPUTS)}. Give "
                "several as one text, separated by spaces."
            )
    return output


def _place(pos: npt.ArrayLike, quat: npt.ArrayLike) -> tuple[Array, Array]:
    """Position [m] and unit quaternion."""
    wrong = SceneError(
        f"pos = {pos!r}, quat = {quat!r}; expected three lengths [m] and a quaternion (w, x, y, z) that is not zero, "
        "all finite."
    )
    position, orientation = real_numbers(pos), real_numbers(quat)
    if position is None or orientation is None or position.shape != (3,) or orientation.shape != (4,):
        raise wrong
    if not (orientation.any() and np.isfinite([*position, *orientation]).all()):
        raise wrong
    # A power of two near the largest component is taken out, which rounds nothing: the norm's squares would overflow
    # or vanish for very large or small components.
    _, exponent = np.frexp(np.abs(orientation).max())
    scaled = np.ldexp(orientation.astype(float), -exponent)
    return position.astype(float), scaled / np.linalg.norm(scaled)


def pad_table(pad: Pad | str | Path | None) -> tuple[str, Pad]:
    """The plugin attribute `pad` that a model stores for a pad, and that pad.

    Args:
        pad: a Pad, the name of a registered one, a TOML file of one, or a file of saved influence matrices; None for
            the paper's pad.

    Returns:
        The attribute ("default", a file's name, or the pad's own numbers as text), and the Pad.

    Raises:
        SceneError: there is no pad or file of that name, or it is no pad.
    """
    pad = str(pad) if isinstance(pad, Path) else pad
    if not isinstance(pad, Pad | str | None):
        raise SceneError(
            f"pad is of type {type(pad).__name__}; expected a mjtactile.Pad, the name of a registered one, or a file."
        )
    found = named_pad(pad) if isinstance(pad, str) else pad or Pad()
    if found is None:
        assert isinstance(pad, str)
        return pad, known_pad(pad)
    return ("default" if found == Pad() else pad_text(found)), found


def add_pad_sensor(spec: mujoco.MjSpec, name: str, config: dict[str, str]) -> None:
    """Add a sensor of the plugin, with attributes as in docs/plugin.md, to a model that has the geom `<name>_pad`."""
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
