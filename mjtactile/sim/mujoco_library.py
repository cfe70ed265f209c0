"""What MuJoCo's Python bindings lack: the plugin of a sensor and its attributes, and checks of names and of data.

Functions import MuJoCo, not the module: MuJoCo has the plugin registered while it is imported, with this module whole.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from mjtactile.errors import MjTactileError, NativeError, SceneError, of_type
from mjtactile.pad_names import PLUGIN

if TYPE_CHECKING:
    import mujoco

#: Arrays of MjData, and the sizes of MjModel that are their lengths.
_SIZES = (
    ("qpos", "nq"), ("qvel", "nv"), ("act", "na"), ("ctrl", "nu"), ("xpos", "nbody"), ("geom_xpos", "ngeom"),
    ("sensordata", "nsensordata"), ("plugin_state", "npluginstate"),
)  # fmt: skip


@lru_cache(maxsize=1)
def mujoco_library() -> ctypes.CDLL:
    """The C library that the bindings use, loaded at the first call.

    Raises:
        NativeError: the library is not in the folder of the bindings.
    """
    import mujoco

    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
    if not found:
        raise NativeError(f"MuJoCo's library was not found in {folder}. Install mujoco from PyPI.")
    return ctypes.CDLL(str(found[0]))


def plugin_config(model: mujoco.MjModel, instance: int, attribute: str) -> str:
    """Text of an attribute of a plugin instance in a compiled model; empty if the model does not set it."""
    function = mujoco_library().mj_getPluginConfig
    function.restype = ctypes.c_char_p
    text = function(ctypes.c_void_p(int(model._address)), ctypes.c_int(instance), attribute.encode())
    return "" if text is None else str(text.decode())


def element_id(
    model: mujoco.MjModel, kind: mujoco.mjtObj, name: str, argument: str, error: type[MjTactileError] = SceneError
) -> int:
    """Id of an element of a compiled model by its name; -1 if there is none. MuJoCo itself crashes on None as a name.

    Raises:
        MjTactileError: `error`, if the name is no text.
    """
    import mujoco

    return mujoco.mj_name2id(model, kind, of_type(str, argument, name, error))


def check_data(model: mujoco.MjModel, data: mujoco.MjData, whose: str) -> None:
    """Refuse data of another model, in which geoms and readings are elsewhere; `whose` says what the model is.

    Raises:
        SceneError: `data` belongs to another model, or is no MjData.
    """
    import mujoco

    if is_data_of(model, data):
        return
    said = "belongs to another model" if isinstance(data, mujoco.MjData) else f"is of type {type(data).__name__}"
    raise SceneError(f"data {said}; expected the mujoco.MjData of {whose}: mujoco.MjData(model) makes one.")


def is_data_of(model: mujoco.MjModel, data: object) -> bool:
    """Whether an object is data of a model, as far as MuJoCo tells.

    MuJoCo stores the same signature of the kinematic tree in a model and in its data. Numbers such as masses are not
    part of it, so that data of a model with varied numbers is accepted. Pickles and MJB files have 0 in its place: then
    only sizes tell.
    """
    import mujoco

    if not isinstance(data, mujoco.MjData) or 0 != model.signature != data.signature != 0:
        return False
    return all(len(getattr(data, array)) == getattr(model, size) for array, size in _SIZES)


def is_pad_sensor(model: mujoco.MjModel, sensor: int) -> bool:
    """Whether a sensor of a compiled model is one of the plugin "mjtactile.pad"; False for a negative index."""
    import mujoco

    if sensor < 0 or model.sensor_type[sensor] != mujoco.mjtSensor.mjSENS_PLUGIN:
        return False
    function = mujoco_library().mjp_getPluginAtSlot
    function.restype = ctypes.POINTER(ctypes.c_char_p)  # the first member of mjpPlugin is its name
    slot = int(model.plugin[model.sensor_plugin[sensor]])
    return function(ctypes.c_int(slot))[0] == PLUGIN.encode()


def pad_sensor_names(model: mujoco.MjModel) -> list[str]:
    """Names of the sensors of the plugin "mjtactile.pad", in the model's order; unnamed sensors are left out.

    No table is loaded.
    """
    names = [model.sensor(number).name for number in range(model.nsensor) if is_pad_sensor(model, number)]
    return [name for name in names if name]
