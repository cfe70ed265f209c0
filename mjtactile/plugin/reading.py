"""Options of a pad's readings, passed to the core; the same for sensors of the plugin and for `TactileSensor`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile.contact.core_pad import core_names
from mjtactile.contact.footprint import FACING_GAP
from mjtactile.contact.linear_range import linear_range
from mjtactile.contact.options import ContactOptions
from mjtactile.contact.ready import ready_pad
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad, TaxelGrid
from mjtactile.plugin.engine import Instance
from mjtactile.plugin.health import Names, register

#: A body whose pose changes by less than this is at rest, so that a wrench basis may be used [m or rad].
POSE_TOLERANCE = 1e-6


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Options of a pad's readings.

    Attributes:
        influence: matrices of the pad.
        options: how contacts are solved.
        friction: coefficient [-]; None: no bound, and for "coulomb" that of MuJoCo's contacts.
        facing_gap: parts up to this height above a body's first contact point face the pad [m].
        stress: whether full stress tensors are needed.
    """

    influence: InfluenceMatrices
    options: ContactOptions
    friction: float | None = None
    facing_gap: float = FACING_GAP
    stress: bool = False


def rows_of_readings(pad: Pad) -> tuple[int, int, int]:
    """Shape of the readings in the core, (layers, rows, columns); free taxels are one row."""
    return pad.grid_shape if isinstance(pad.taxels, TaxelGrid) else (1, 1, len(pad.taxels))


def fill_instance(to: Instance, how: Reading, pad: str, bodies: tuple[str, ...]) -> None:
    """Fill the core's structure with the options of a pad's readings.

    Args:
        to: `mjt_instance`; its outputs are not changed.
        how: options of the readings.
        pad: name of the pad in warnings.
        bodies: names of the model's bodies.
    """
    influence, options = how.influence, how.options
    geometry, layer = influence.pad, influence.pad.layers[0]
    tables = ready_pad(influence, options, stress=how.stress)
    to.layers, to.rows, to.columns = rows_of_readings(geometry)
    to.taxels = int(np.prod(geometry.reading_shape))
    to.pad = tables.handle.value
    to.law, to.tangential = core_names(options)
    to.cells = options.cells
    to.friction = -1.0 if how.friction is None else how.friction
    to.tolerance, to.facing_gap, to.strength = POSE_TOLERANCE, how.facing_gap, layer.young
    if isinstance(geometry.taxels, TaxelGrid):  # the grid is used for drawing only
        to.pitch[:], to.centre[:] = geometry.taxels.pitch, geometry.taxels.centre
    to.tilting = options.tilting
    pressure, indentation = linear_range(geometry)
    to.context = register(
        Names(pad, f"over {pressure:.3g} Pa on the average", f"deeper than {indentation * 1e3:.3g} mm", bodies)
    )
