"""One pad in one simulation, read by the compiled core with Python's help where that is needed."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mjtactile.gap import Pose
from mjtactile.native import contiguous, library, native_pad, pointer
from mjtactile.native_host import HOST, POSE, register, release
from mjtactile.pad import Array
from mjtactile.press_host import PressHost


class Touch(NamedTuple):
    """A body that presses on a pad."""

    body: int
    pose: Pose  #: in the pad frame
    wrench: Array  #: on the pad, about its origin, pad frame [N, N m], shape (6,)


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
