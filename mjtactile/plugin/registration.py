"""Registration of the sensor plugin "mjtactile.pad" with MuJoCo, once per process.

This module imports little, since MuJoCo from 4.0 on imports it through an entry point whenever MuJoCo is imported. The
module attributes.py is imported when a model first uses the plugin.
"""

from __future__ import annotations

import atexit
import ctypes
import threading
from typing import Any

from mjtactile._native import library, library_path
from mjtactile._progress import say
from mjtactile.errors import MjTactileError, NativeError
from mjtactile.pad_names import PLUGIN
from mjtactile.plugin.engine import ERROR_SIZE, Instance, attribute_names, running_layout
from mjtactile.plugin.health import deliver, release

_Resolve = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.POINTER(ctypes.c_char_p), ctypes.POINTER(Instance)
)
_Release = ctypes.CFUNCTYPE(None, ctypes.c_int64)
_Deliver = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)


class _PluginHost(ctypes.Structure):
    """Functions that the core calls, as struct `mjt_plugin_host` of native/plugin/plugin.h."""

    _fields_ = [
        ("resolve", _Resolve),
        ("release", _Release),
        ("schedule", ctypes.c_void_p),
        ("deliver", _Deliver),
        ("raise", ctypes.c_void_p),
        ("drop", ctypes.c_void_p),
    ]


_registered = False
_registering = threading.Lock()


def ensure_registered() -> None:
    """Register the plugin with the running MuJoCo, unless it is registered already.

    Raises:
        NativeError: there is no compiled core, or it does not support this MuJoCo.
    """
    global _registered
    import mujoco  # before the lock is taken: MuJoCo calls this function while it is imported

    with _registering:
        if _registered:
            return
        core, numbers = library(), running_layout().packed()
        from mjtactile.plugin.mujoco_layout import FUNCTIONS, OPTIONAL_FUNCTIONS
        from mjtactile.sim.mujoco_library import mujoco_library

        there_are = [getattr(mujoco_library(), name) for name in FUNCTIONS]
        there_are += [getattr(mujoco_library(), name, None) for name in OPTIONAL_FUNCTIONS]
        functions = [ctypes.cast(one, ctypes.c_void_p) for one in there_are]
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
                f"the compiled core {library_path()} does not belong to this mjtactile: it reads other fields of "
                f"MuJoCo {mujoco.__version__}'s structures than this package describes. Install mjtactile "
                "again with `pip install .`, so that both come from one source."
            )
        # Simulations may outlive the interpreter; Python functions no longer exist when the last ones are destroyed.
        atexit.register(core.mjt_plugin_leave)
        _registered = True


@_Resolve
def _resolve(model: int | None, geom: int, values: Any, instance: Any) -> int:
    to = instance.contents
    try:
        from mjtactile.plugin.attributes import Attributes, fill

        fill(to, model, geom, Attributes({name: values[k].decode() for k, name in enumerate(attribute_names())}))
    except MjTactileError as error:
        to.error = str(error).encode()[: ERROR_SIZE - 1]
        return 0
    except BaseException as error:  # exceptions cannot pass through MuJoCo
        to.error = f"{PLUGIN}: {type(error).__name__}: {error}".encode()[: ERROR_SIZE - 1]
        if not isinstance(error, Exception) and threading.current_thread() is threading.main_thread():
            # Ctrl-C, for example: the core has it raised when MuJoCo returns to Python, which it does at once.
            error.with_traceback(None)
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(error))  # the core drops it once it is raised
            to.exception_type, to.exception = id(type(error)), id(error)
        return 0
    return 1


@_Release
def _release(context: int) -> None:
    release(library(), context)


@_Deliver
def _deliver(_: int | None) -> int:
    try:
        deliver(library(), 2)  # at the code that runs now
    except Warning as error:  # if warnings are errors; a callback of the interpreter cannot raise them
        for text in (str(error), *getattr(error, "__notes__", ())):
            say(f"{type(error).__name__}: {text}")
    return 0


#: Functions that the core calls; kept alive here. Warnings are delivered when Python's main thread runs again.
_HOST = _PluginHost(
    _resolve,
    _release,
    ctypes.cast(ctypes.pythonapi.Py_AddPendingCall, ctypes.c_void_p).value,
    _deliver,
    ctypes.cast(ctypes.pythonapi.PyErr_SetObject, ctypes.c_void_p).value,
    ctypes.cast(ctypes.pythonapi.Py_DecRef, ctypes.c_void_p).value,
)
