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
    from collections.abc import Callable

    from mjtactile.gap import Pose
    from mjtactile.native_bodies import NativeBody, NativeFace
    from mjtactile.press_host import PressHost

#: Numbers of a pose and of a wrench, as the core has them.
POSE, WRENCH = 12, 6

_Body = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_int64, ctypes.c_int)
_Face = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_int64, ctypes.c_int, ctypes.c_int)
_CutFace = ctypes.CFUNCTYPE(
    ctypes.c_void_p, ctypes.c_int64, ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_double)
)
_NotCarried = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int, ctypes.POINTER(ctypes.c_double))
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

    _fields_ = [
        ("body", _Body),
        ("face", _Face),
        ("cut_face", _CutFace),
        ("nodal_forces", _Forces),
        ("beyond_range", _Beyond),
        ("not_carried", _NotCarried),
    ]


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


@_Body
def _body(context: int, body: int) -> int | None:
    return _handle(lambda: _hosts[context].body(body))


@_Face
def _face(context: int, body: int, number: int) -> int | None:
    return _handle(lambda: _hosts[context].face(body, number))


@_CutFace
def _cut_face(context: int, body: int, number: int, place: Any) -> int | None:
    return _handle(lambda: _hosts[context].cut_face(body, number, (float(place[0]), float(place[1]), float(place[2]))))


def _handle(ask: Callable[[], NativeBody | NativeFace | None]) -> int | None:
    try:
        found = ask()
        return None if found is None else found.handle.value
    except Exception:  # nothing can be raised through the core
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


@_NotCarried
def _not_carried(context: int, body: int, wrench: Any) -> None:
    try:
        _hosts[context].warn_not_carried(body, np.ctypeslib.as_array(wrench, (WRENCH,)).copy())
    except Exception:
        traceback.print_exc()


#: What the core calls; kept alive here.
HOST = HostFunctions(_body, _face, _cut_face, _nodal_forces, _beyond_range, _not_carried)


def _pose(numbers: Any) -> Pose:
    from mjtactile.gap import Pose

    values = np.ctypeslib.as_array(numbers, (POSE,)).copy()
    return Pose(values[:3], values[3:].reshape(3, 3))
