"""A pad of a model read by the compiled core without a sensor of the plugin: what `TactileSensor` does."""

from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjtactile._native import library, native_pad, pointer
from mjtactile.contact.compliance import surface_compliance
from mjtactile.contact.footprint import FACING_GAP
from mjtactile.contact.linear_range import linear_range
from mjtactile.contact.options import TANGENTIALS, ContactOptions
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Array
from mjtactile.plugin.health import HEALTH_NUMBERS, Health, Names, deliver, register
from mjtactile.plugin.registration import Instance, ensure_registered

#: Poses are the same up to this, where a wrench basis may answer [m or rad].
POSE_TOLERANCE = 1e-6
_WRENCH, _STATE = 6, 4


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How a pad is read.

    Attributes:
        influence: matrices of the pad.
        options: how contacts are solved.
        friction: coefficient; None: no bound, and for "coulomb" that of MuJoCo's contacts.
        facing_gap: what is no further than this above a body's first touch faces the pad [m].
        stress: whether whole stress tensors are wanted.
    """

    influence: InfluenceMatrices
    options: ContactOptions
    friction: float | None = None
    facing_gap: float = FACING_GAP
    stress: bool = False


def fill_instance(to: Instance, how: Reading, pad: str, bodies: tuple[str, ...]) -> None:
    """Tell the core how a pad is read.

    Args:
        to: `mjt_instance`, of which the outputs are left alone.
        how: the pad is read.
        pad: name that warnings use.
        bodies: names of the model's bodies.
    """
    influence, options = how.influence, how.options
    geometry, layer = influence.pad, influence.pad.layers[0]
    tables = native_pad(influence, stress=how.stress)
    options.contact_law.prepare(tables, influence)
    if options.tangential != "proportional":
        tables.set_tangential(surface_compliance(influence))
    to.layers, to.rows, to.columns = geometry.reading_shape
    to.taxels = int(np.prod(geometry.reading_shape))
    to.pad = tables.handle.value
    to.law, to.tangential, to.cells = options.contact_law.number, TANGENTIALS.index(options.tangential), options.cells
    to.friction = -1.0 if how.friction is None else how.friction
    to.tolerance, to.facing_gap, to.strength = POSE_TOLERANCE, how.facing_gap, layer.young
    to.pitch[:], to.centre[:] = geometry.taxels.pitch, geometry.taxels.centre
    to.tilting = options.tilting
    pressure, approach = linear_range(geometry)
    to.context = register(
        Names(pad, f"over {pressure:.3g} Pa on the average", f"deeper than {approach * 1e3:.3g} mm", bodies)
    )


class Found(NamedTuple):
    """What was read of one state.

    Attributes:
        readings: von Mises stress (layers, rows, columns) [Pa].
        forces: on the surface grid's nodes (nodes y, nodes x, 3) [N].
        wrench: of all contacts, force [N] and moment about the pad's origin [N m], (6,).
        carried: the part of it that the readings carry, (6,).
        range: largest share that a contact takes of the range of small strains [-].
        indentation: of the surface where it is deepest [m].
        area: under pressure [m^2].
        peak: largest mean pressure over a contact cell [Pa].
    """

    readings: Array
    forces: Array
    wrench: Array
    carried: Array
    range: float
    indentation: float
    area: float
    peak: float


class NativeReader:
    """One pad of one model, as the core reads it.

    Args:
        how: the pad is read.
        geom: id of the pad's box.
        pad: name that warnings use.
        bodies: names of the model's bodies.

    Raises:
        NativeError: when the core cannot read this MuJoCo.
    """

    def __init__(self, how: Reading, geom: int, pad: str, bodies: tuple[str, ...]) -> None:
        ensure_registered()
        self._how = how
        instance = Instance()
        fill_instance(instance, how, pad, bodies)
        core = library()
        self._handle = ctypes.c_void_p(core.mjt_reader_new(ctypes.byref(instance), ctypes.c_int(geom)))
        self._finalizer = weakref.finalize(self, core.mjt_reader_free, self._handle)

    def read(self, model: Any, data: Any, *, forces: bool = False) -> Found:
        """Read a state; with `forces` nodal forces as well, which are empty otherwise.

        Warns:
            ContactWarning: once for every body and kind, of what a contact cannot carry or the model does not describe.
        """
        pad, surface = self._how.influence.pad, self._how.influence.surface
        readings = np.empty(pad.reading_shape)
        nodal = np.empty((*surface.node_shape, 3)) if forces else np.empty((0, 0, 3))
        wrench, carried, state = np.empty(_WRENCH), np.empty(_WRENCH), np.empty(_STATE)
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
        deliver(library())
        return Found(readings, nodal, wrench, carried, *(float(number) for number in state))

    def health(self) -> Health:
        """What the readings came to so far."""
        numbers = np.empty(HEALTH_NUMBERS)
        library().mjt_reader_health(self._handle, pointer(numbers))
        return Health.of(numbers)
