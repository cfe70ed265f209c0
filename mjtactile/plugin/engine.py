"""Interface to the running MuJoCo and the compiled plugin: memory layout and C structures."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from typing import TYPE_CHECKING

from mjtactile._native import library

if TYPE_CHECKING:
    from mjtactile.plugin.mujoco_layout import MujocoLayout

_MOST_OUTPUTS, ERROR_SIZE = 5, 1024


class Instance(ctypes.Structure):
    """Settings of one sensor, as struct `mjt_instance` of native/plugin/plugin.h."""

    _fields_ = [
        ("pad", ctypes.c_void_p),
        ("context", ctypes.c_int64),
        ("friction", ctypes.c_double),
        ("tolerance", ctypes.c_double),
        ("facing_gap", ctypes.c_double),
        ("strength", ctypes.c_double),
        ("widest", ctypes.c_double),
        ("size_tolerance", ctypes.c_double),
        ("taxels", ctypes.c_int),
        ("law", ctypes.c_char * 16),
        ("tangential", ctypes.c_char * 16),
        ("cells", ctypes.c_int),
        ("tilting", ctypes.c_int),
        ("visual", ctypes.c_int),
        ("output_count", ctypes.c_int),
        ("outputs", ctypes.c_int * _MOST_OUTPUTS),
        ("error", ctypes.c_char * ERROR_SIZE),
        ("exception_type", ctypes.c_void_p),
        ("exception", ctypes.c_void_p),
    ]


@lru_cache(maxsize=1)
def running_layout() -> MujocoLayout:
    """Layout of the running MuJoCo's structures, see mujoco_layout.py.

    Raises:
        NativeError: this MuJoCo does not describe its structures, or its memory does not match the description.
    """
    from mjtactile.plugin.mujoco_layout import mujoco_layout

    return mujoco_layout()


def attribute_names() -> list[str]:
    """Names of the plugin's attributes, in the order of the compiled core."""
    names = ctypes.POINTER(ctypes.c_char_p)()
    library().mjt_plugin_attributes.restype = ctypes.c_size_t
    count = library().mjt_plugin_attributes(ctypes.byref(names))
    return [text.decode() for text in names[:count]]
