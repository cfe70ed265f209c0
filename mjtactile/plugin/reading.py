"""Options of a pad's readings, passed to the core; the same for sensors of the plugin and for `TactileSensor`."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from mjtactile._native import contiguous, library, pointer
from mjtactile._types import Array, Indices
from mjtactile.contact.core_pad import core_names
from mjtactile.contact.footprint import FACING_GAP
from mjtactile.contact.linear_range import linear_range
from mjtactile.contact.options import ContactOptions
from mjtactile.contact.ready import ready_pad
from mjtactile.errors import contacts_are_quiet
from mjtactile.influence.core_pad import CorePad
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.pad import Pad, TaxelGrid
from mjtactile.plugin.engine import Instance
from mjtactile.plugin.health import Names, register
from mjtactile.sim.pad_check import SIZE_TOLERANCE

#: A body whose pose changes by less than this counts as at rest, so that its wrench basis is used again [m or rad].
POSE_TOLERANCE = 1e-6
#: Tiles of a heat map: height above the surface [m], and size relative to the taxels' pitch or diameter [-].
_HOVER, _TILE_SHARE = 5e-5, 0.92


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Options of a pad's readings.

    Attributes:
        influence: matrices of the pad.
        options: how contacts are solved. If their friction is None, shear has no bound, except under "coulomb", which
            uses MuJoCo's coefficient.
        facing_gap: parts up to this height above a body's first contact point face the pad [m].
        stress: whether full stress tensors are needed.
    """

    influence: InfluenceMatrices
    options: ContactOptions
    facing_gap: float = FACING_GAP
    stress: bool = False


def tiles_of(pad: Pad) -> tuple[Array, Indices]:
    """Tiles of a heat map of the top layer.

    Returns:
        The tiles, (n, 14): position [m] (3), rotation matrix by rows (9) and half sizes [m] (2) of each in the pad
        frame, as `mjt_pad_set_tiles` takes them; and the index of each tile's reading, (n,).
    """
    shown = pad.layers_drawn[0]
    feet = pad.taxel_feet(0)[shown]
    axes = pad.surface.frames(feet[:, 0], feet[:, 1])
    if isinstance(pad.taxels, TaxelGrid):
        # Seen from above they are as wide as the pitch.
        half_sizes = np.array(pad.taxels.pitch) / 2 / np.stack([axes[:, 0, 0], axes[:, 1, 1]], axis=-1)
    else:
        half_sizes = np.repeat(np.array(pad.sensed_radii)[shown, None], 2, axis=1)
    positions = pad.surface.positions(feet[:, 0], feet[:, 1], -_HOVER)
    rotations = axes.transpose(0, 2, 1).reshape(-1, 9)
    return contiguous(np.concatenate([positions, rotations, _TILE_SHARE * half_sizes], axis=1)), shown


def fill_instance(to: Instance, how: Reading, pad: str, bodies: tuple[str, ...], *, asked: bool) -> None:
    """Fill the core's structure with the options of a pad's readings.

    Args:
        to: `mjt_instance`; its outputs are not changed.
        how: options of the readings.
        pad: name of the pad in warnings.
        bodies: names of the model's bodies.
        asked: whether Python asks for each reading.
    """
    influence, options = how.influence, how.options
    geometry, layer = influence.pad, influence.pad.layers[0]
    tables = ready_pad(influence, options, stress=how.stress)
    to.taxels = int(np.prod(geometry.reading_shape))
    to.pad = tables.handle.value
    tables.give("tiles", lambda: _give_tiles(tables, geometry))
    to.law, to.tangential = core_names(options)
    to.cells, to.widest = options.cells, options.widest_cells(geometry)
    to.friction = -1.0 if options.friction is None else options.friction
    to.tolerance, to.facing_gap, to.strength = POSE_TOLERANCE, how.facing_gap, layer.young
    to.size_tolerance = SIZE_TOLERANCE
    to.tilting = options.tilting
    pressure, indentation = linear_range(geometry)
    over, deeper = f"over {pressure:.3g} Pa on the average", f"deeper than {indentation * 1e3:.3g} mm"
    to.context = register(Names(pad, over, deeper, bodies, quiet=contacts_are_quiet(), asked=asked))


def _give_tiles(tables: CorePad, pad: Pad) -> None:
    tiles, shown = tiles_of(pad)
    numbers = shown.astype(np.int32)
    library().mjt_pad_set_tiles(tables.handle, ctypes.c_size_t(len(tiles)), pointer(tiles), pointer(numbers))
