"""The compiled core's way back into Python: functions it calls, and whom they ask.

Light to import: MuJoCo loads the plugin, and this with it, in processes that may never touch a pad.
"""

from __future__ import annotations

import ctypes
import itertools
import traceback
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mjtactile.gap import Pose
    from mjtactile.press_host import PressHost

#: Numbers of a pose and of a wrench, as the core has them.
POSE, WRENCH = 12, 6

_Face = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_int64, ctypes.c_int, ctypes.POINTER(ctypes.c_double))
_Beyond = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int, ctypes.c_double, ctypes.c_double)
_Forces = ctypes.CFUNCTYPE(
    ctypes.c_int,
    ctypes.c_int64,
    ctypes.c_int,
    ctypes.POINTER(ctypes.c_double),
    ctypes.POINTER(ctypes.c_double),
    ctypes.POINTER(ctypes.c_double),
)


class HostFunctions(ctypes.Structure):
    """`mjt_host` of native/core/api.h."""

    _fields_ = [("face", _Face), ("cut_face", _Face), ("nodal_forces", _Forces), ("beyond_range", _Beyond)]


#: Hosts by the number that the core knows them by; they live as long as what reads through them.
_hosts: dict[int, PressHost] = {}
_numbers = itertools.count(1)


def register(host: PressHost) -> int:
    """Number under which the core may ask a host, until `release`."""
    number = next(_numbers)
    _hosts[number] = host
    return number


def release(number: int) -> None:
    """Forget a host."""
    _hosts.pop(number, None)


@_Face
def _face(context: int, body: int, pose: Any) -> int | None:
    try:
        face = _hosts[context].face(body, _pose(pose))
        return None if face is None else face.handle.value
    except Exception:  # nothing can be raised through the core
        traceback.print_exc()
        return None


@_Face
def _cut_face(context: int, body: int, place: Any) -> int | None:
    try:
        face = _hosts[context].cut_face(body, (float(place[0]), float(place[1]), float(place[2])))
        return None if face is None else face.handle.value
    except Exception:
        traceback.print_exc()
        return None


@_Forces
def _nodal_forces(context: int, body: int, pose: Any, wrench: Any, forces: Any) -> int:
    try:
        found = _hosts[context].nodal_forces(body, _pose(pose), np.ctypeslib.as_array(wrench, (WRENCH,)).copy())
        if found is None:
            return 0
        np.ctypeslib.as_array(forces, found.shape)[...] = found
        return 1
    except Exception:
        traceback.print_exc()
        return 0


@_Beyond
def _beyond_range(context: int, body: int, pressure: float, approach: float) -> None:
    try:
        _hosts[context].warn_beyond_range(body, pressure, approach)
    except Exception:
        traceback.print_exc()


#: What the core calls; kept alive here.
HOST = HostFunctions(_face, _cut_face, _nodal_forces, _beyond_range)


def _pose(numbers: Any) -> Pose:
    from mjtactile.gap import Pose

    values = np.ctypeslib.as_array(numbers, (POSE,)).copy()
    return Pose(values[:3], values[3:].reshape(3, 3))
