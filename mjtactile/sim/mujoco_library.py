"""MuJoCo's own library, for what its Python bindings leave out: whose plugin a sensor is, and with which attributes."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

import mujoco

from mjtactile.errors import NativeError
from mjtactile.pad_names import PLUGIN


@lru_cache(maxsize=1)
def mujoco_library() -> ctypes.CDLL:
    """The library that the bindings use, loaded once.

    Raises:
        NativeError: when it does not lie beside the bindings.
    """
    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
    if not found:
        raise NativeError(f"MuJoCo's library was not found in {folder}. Install mujoco from PyPI.")
    return ctypes.CDLL(str(found[0]))


def plugin_config(model: mujoco.MjModel, instance: int, attribute: str) -> str:
    """Text of an attribute of a plugin instance in a compiled model; empty where the model says nothing.

    Args:
        model: compiled model.
        instance: number of the plugin instance.
        attribute: one that its plugin has.
    """
    function = mujoco_library().mj_getPluginConfig
    function.restype = ctypes.c_char_p
    text = function(ctypes.c_void_p(int(model._address)), ctypes.c_int(instance), attribute.encode())
    return "" if text is None else str(text.decode())


def is_pad_sensor(model: mujoco.MjModel, sensor: int) -> bool:
    """Whether a sensor of a compiled model is one of the plugin "mjtactile.pad".

    Args:
        model: compiled model.
        sensor: its number; negative for none.
    """
    if sensor < 0 or model.sensor_type[sensor] != mujoco.mjtSensor.mjSENS_PLUGIN:
        return False
    function = mujoco_library().mjp_getPluginAtSlot
    function.restype = ctypes.POINTER(ctypes.c_char_p)  # mjpPlugin begins with its name
    slot = int(model.plugin[model.sensor_plugin[sensor]])
    return function(ctypes.c_int(slot))[0] == PLUGIN.encode()


def pad_sensor_names(model: mujoco.MjModel) -> list[str]:
    """Names of the sensors of the plugin "mjtactile.pad", in the model's order; no table is loaded.

    Sensors without a name are left out.
    """
    names = [model.sensor(number).name for number in range(model.nsensor) if is_pad_sensor(model, number)]
    return [name for name in names if name]
