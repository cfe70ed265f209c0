"""One pad in one simulation, read by the compiled core with Python's help where that is needed."""

from __future__ import annotations

import ctypes
import sys
import traceback
import weakref
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mjtactile.gap import Pose
from mjtactile.native import contiguous, library, native_pad, pointer
from mjtactile.pad import Array
from mjtactile.press_host import PressHost

#: Numbers of a pose and of a wrench, as the core has them.
POSE, WRENCH = 12, 6

_Face = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_int64, ctypes.c_int, ctypes.POINTER(ctypes.c_double))
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

    _fields_ = [("face", _Face), ("nodal_forces", _Forces)]


class Touch(NamedTuple):
    """A body that presses on a pad."""

    body: int
    pose: Pose  #: in the pad frame
    wrench: Array  #: on the pad, about its origin, pad frame [N, N m], shape (6,)


#: Hosts by the number that the core knows them by; they live as long as what reads through them.
_hosts: dict[int, PressHost] = {}
_numbers = iter(range(1, sys.maxsize))


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


#: What the core calls; kept alive here.
HOST = HostFunctions(_face, _nodal_forces)


class NativeSensor:
    """Readings from what touches a pad.

    Args:
        host: of the pad.
        stress: whether whole stress tensors are wanted too.
    """

    def __init__(self, host: PressHost, *, stress: bool = False) -> None:
        self._shape = host.influence.pad.reading_shape
        self._pad = native_pad(host.influence, stress=stress)
        number = register(host)
        options = host.options
        native = options.law == "elastic" and options.tangential == "proportional"
        self._handle = ctypes.c_void_p(
            library().mjt_sensor_new(
                self._pad.handle,
                ctypes.c_int(options.tilting),
                ctypes.c_double(-1.0 if options.friction is None else options.friction),
                ctypes.c_int(native),
                ctypes.c_double(host.pose_tolerance),
                ctypes.byref(HOST),
                ctypes.c_int64(number),
            )
        )
        weakref.finalize(self, _close, self._handle, number)

    def readings(self, touches: Sequence[Touch]) -> Array:
        """Readings (layers, rows, columns) [Pa]."""
        readings = np.empty(self._shape)
        self._read(touches, readings, None)
        return readings

    def stress(self, touches: Sequence[Touch]) -> Array:
        """Mean stress tensors (6, layers, rows, columns) [Pa], components as in InfluenceMatrices.stress."""
        stress = np.empty((6, *self._shape))
        self._read(touches, None, stress)
        return stress

    def forget(self) -> None:
        """Look at every body's shape anew."""
        library().mjt_sensor_forget(self._handle)

    def _read(self, touches: Sequence[Touch], readings: Array | None, stress: Array | None) -> None:
        bodies = np.array([touch.body for touch in touches], dtype=np.int32)
        poses = np.array([[*t.pose.position, *t.pose.rotation.ravel()] for t in touches]).reshape(-1, POSE)
        wrenches = contiguous([touch.wrench for touch in touches])
        library().mjt_sensor_read(
            self._handle,
            ctypes.c_size_t(len(touches)),
            *(pointer(one) for one in (bodies, poses, wrenches, readings, stress)),
        )


def _close(handle: ctypes.c_void_p, number: int) -> None:
    library().mjt_sensor_free(handle)
    release(number)


def _pose(numbers: Any) -> Pose:
    values = np.ctypeslib.as_array(numbers, (POSE,)).copy()
    return Pose(values[:3], values[3:].reshape(3, 3))
