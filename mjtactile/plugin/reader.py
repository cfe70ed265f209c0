"""Readings of a pad by the compiled core without a sensor of the plugin, for `TactileSensor`."""

from __future__ import annotations

import ctypes
import threading
import weakref
from typing import Any, NamedTuple

import numpy as np

from mjtactile._native import library, pointer
from mjtactile._types import Array
from mjtactile.plugin.engine import Instance
from mjtactile.plugin.health import HEALTH_NUMBERS, Health, deliver
from mjtactile.plugin.reading import Reading, fill_instance
from mjtactile.plugin.registration import ensure_registered

_WRENCH, _STATE = 6, 4


class Found(NamedTuple):
    """Readings of a pad in one state, and its contacts."""

    readings: Array  #: von Mises stress [Pa], of shape `Pad.reading_shape`
    forces: Array  #: on the surface grid's nodes, pad frame [N], (nodes y, nodes x, 3)
    #: Ends of the edges of the areas under pressure, with the area on their left, pad frame [m], (edges, 2, 2).
    rim: Array
    wrench: Array  #: wrench of all contacts, force [N] and moment about the pad's origin [N m], pad frame, (6,)
    carried: Array  #: the part of the wrench that the readings carry, likewise, (6,)
    range: float  #: largest ratio of a contact's strain to the limit of small strains [-]
    indentation: float  #: largest indentation of the surface [m]
    area: float  #: area under pressure [m^2]
    peak: float  #: largest mean pressure over a contact cell [Pa]


class NativeReader:
    """Reader of one pad of one model, in the compiled core. Threads that share it wait for each other.

    Raises:
        NativeError: the core cannot read the structures of this MuJoCo.
    """

    def __init__(self, how: Reading, geom: int, pad: str, bodies: tuple[str, ...]) -> None:
        ensure_registered()
        self._arguments = how, geom, pad, bodies
        self._how = how
        instance = Instance()
        fill_instance(instance, how, pad, bodies, asked=True)
        core, self._number = library(), int(instance.context)
        self._handle = ctypes.c_void_p(core.mjt_reader_new(ctypes.byref(instance), ctypes.c_int(geom)))
        self._finalizer = weakref.finalize(self, core.mjt_reader_free, self._handle)
        # The core solves in the reader's own memory, and Python's lock is free meanwhile.
        self._solving = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies, also in other processes, have a handle and counts of their own."""
        return NativeReader, self._arguments

    def read(self, model: Any, data: Any, *, forces: bool = False) -> Found:
        """Compute the readings of a state.

        Args:
            model: compiled model.
            data: its state, after a step or a forward pass.
            forces: whether to compute the nodal forces and the rim; otherwise they are empty.

        Warns:
            ContactWarning: the surface cannot carry a contact, or strains are not small; once for every body and kind.
                It points at the caller's caller.
        """
        pad, surface = self._how.influence.pad, self._how.influence.surface
        readings = np.empty(pad.reading_shape)
        nodal = np.empty((*surface.node_shape, 3)) if forces else np.empty((0, 0, 3))
        wrench, carried, state = np.empty(_WRENCH), np.empty(_WRENCH), np.empty(_STATE)
        with self._solving:
            library().mjt_reader_read(
                self._handle,
                ctypes.c_void_p(int(model._address)),
                ctypes.c_void_p(int(data._address)),
                pointer(readings),
                ctypes.c_void_p(None),
                pointer(nodal if forces else None),
                pointer(wrench),
                pointer(carried),
                pointer(state),
            )
            rim = self._rim() if forces else np.empty((0, 2, 2))
        deliver(library(), 3, self._number)
        return Found(readings, nodal, rim, wrench, carried, *(float(number) for number in state))

    def _rim(self) -> Array:
        ends = np.empty((library().mjt_reader_rim(self._handle, ctypes.c_void_p(None)), 2, 2))
        library().mjt_reader_rim(self._handle, pointer(ends))
        return ends

    def health(self) -> Health:
        """Counts of problems in the readings so far."""
        numbers = np.empty(HEALTH_NUMBERS)
        with self._solving:
            library().mjt_reader_health(self._handle, pointer(numbers))
        return Health.of(numbers)
