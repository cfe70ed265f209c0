"""MuJoCo's side: the sensor plugin "mjtactile.pad", registered once per process.

Light to import: MuJoCo from 4.0 on does so itself, through an entry point, whenever it is imported. What the plugin's
attributes mean is looked up when a model first uses them (plugin_attributes.py).
"""

from __future__ import annotations

import atexit
import ctypes
import sys
import threading
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjtactile._native import library
from mjtactile.errors import MjTactileError, NativeError
from mjtactile.plugin.health import deliver, release

if TYPE_CHECKING:
    from mjtactile.plugin.mujoco_layout import MujocoLayout

#: Name under which models ask for the plugin.
PLUGIN = "mjtactile.pad"
_MOST_OUTPUTS, _ERROR_SIZE = 5, 1024


class Instance(ctypes.Structure):
    """What the attributes of one sensor mean: `mjt_instance` of native/plugin/plugin.h."""

    _fields_ = [
        ("pad", ctypes.c_void_p),
        ("context", ctypes.c_int64),
        ("friction", ctypes.c_double),
        ("tolerance", ctypes.c_double),
        ("facing_gap", ctypes.c_double),
        ("strength", ctypes.c_double),
        ("taxels", ctypes.c_int),
        ("layers", ctypes.c_int),
        ("rows", ctypes.c_int),
        ("columns", ctypes.c_int),
        ("pitch", ctypes.c_double * 2),
        ("centre", ctypes.c_double * 2),
        ("law", ctypes.c_int),
        ("tangential", ctypes.c_int),
        ("cells", ctypes.c_int),
        ("tilting", ctypes.c_int),
        ("visual", ctypes.c_int),
        ("output_count", ctypes.c_int),
        ("outputs", ctypes.c_int * _MOST_OUTPUTS),
        ("error", ctypes.c_char * _ERROR_SIZE),
    ]


_Resolve = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.POINTER(ctypes.c_char_p), ctypes.POINTER(Instance)
)
_Release = ctypes.CFUNCTYPE(None, ctypes.c_int64)
_Deliver = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)


class _PluginHost(ctypes.Structure):
    """`mjt_plugin_host` of native/plugin/plugin.h."""

    _fields_ = [
        ("resolve", _Resolve),
        ("release", _Release),
        ("schedule", ctypes.c_void_p),
        ("deliver", _Deliver),
    ]


_registered = False
_registering = threading.Lock()


def ensure_registered() -> None:
    """Register the plugin with the running MuJoCo, if it is not yet.

    Raises:
        NativeError: when there is no compiled core, or this MuJoCo is not one it knows.
    """
    global _registered
    with _registering:
        if _registered:
            return
        import mujoco

        core, numbers = library(), running_layout().packed()
        from mjtactile.plugin.mujoco_layout import FUNCTIONS

        functions = [ctypes.cast(getattr(_mujoco_library(), name), ctypes.c_void_p) for name in FUNCTIONS]
        core.mjt_plugin_register.restype = ctypes.c_int
        slot = core.mjt_plugin_register(
            ctypes.c_void_p(numbers.ctypes.data),
            ctypes.c_size_t(len(numbers)),
            (ctypes.c_void_p * len(functions))(*functions),
            ctypes.c_size_t(len(functions)),
            ctypes.byref(_HOST),
        )
        if slot < 0:
            raise NativeError(
                f"MuJoCo {mujoco.__version__} refused the plugin {PLUGIN}: another library has registered one of that "
                "name, or the compiled core does not belong to this mjtactile. Install mjtactile again."
            )
        # Simulations may outlive the interpreter, whose functions are gone when the last of them are destroyed.
        atexit.register(core.mjt_plugin_leave)
        _registered = True


@lru_cache(maxsize=1)
def running_layout() -> MujocoLayout:
    """Layout of the running MuJoCo, see mujoco_layout.py."""
    from mjtactile.plugin.mujoco_layout import mujoco_layout

    return mujoco_layout()


@lru_cache(maxsize=1)
def _mujoco_library() -> ctypes.CDLL:
    import mujoco

    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
    if not found:
        raise NativeError(f"MuJoCo's library was not found in {folder}. Install mujoco from PyPI.")
    return ctypes.CDLL(str(found[0]))


@_Resolve
def _resolve(model: int | None, geom: int, values: Any, instance: Any) -> int:
    to = instance.contents
    try:
        from mjtactile.plugin.attributes import Attributes, fill

        fill(to, model, geom, Attributes(dict(zip(attribute_names(), _texts(values), strict=True))))
    except MjTactileError as error:
        to.error = str(error).encode()[: _ERROR_SIZE - 1]
        return 0
    except Exception as error:  # nothing can be raised through MuJoCo
        to.error = f"{PLUGIN}: {type(error).__name__}: {error}".encode()[: _ERROR_SIZE - 1]
        return 0
    return 1


def plugin_config(model: Any, instance: int, attribute: str) -> str | None:
    """Text of an attribute of a plugin instance in a compiled model; None where its plugin has no such attribute."""
    function = _mujoco_library().mj_getPluginConfig
    function.restype = ctypes.c_char_p
    text = function(ctypes.c_void_p(int(model._address)), ctypes.c_int(instance), attribute.encode())
    return None if text is None else str(text.decode())


def attribute_names() -> list[str]:
    """Names of the plugin's attributes, as the core lists them."""
    names = ctypes.POINTER(ctypes.c_char_p)()
    library().mjt_plugin_attributes.restype = ctypes.c_size_t
    count = library().mjt_plugin_attributes(ctypes.byref(names))
    return [text.decode() for text in names[:count]]


def _texts(values: Any) -> list[str]:
    return [values[i].decode() for i in range(len(attribute_names()))]


@_Release
def _release(context: int) -> None:
    release(context)


@_Deliver
def _deliver(_: int | None) -> int:
    try:
        deliver(library())
    except Warning as error:  # warnings are errors here, but nothing can be raised from a call of Python's own
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
    return 0


#: What the core calls; kept alive here. Deliveries wait until Python runs again, in its main thread.
_HOST = _PluginHost(
    _resolve, _release, ctypes.cast(ctypes.pythonapi.Py_AddPendingCall, ctypes.c_void_p).value, _deliver
)
