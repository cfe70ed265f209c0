"""The interface of controllers in the loop: recognition, positions of rack and bins, stiffness of the arms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mjtactile._types import Array
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.recognition.force import ForceResult
from mjtactile.recognition.shape import ShapeResult

#: Stiffness of an arm along each axis [N/m].
ARM_STIFFNESS = 400.0
#: Distance between neighbours in rack and bins, distance of both from the pad's middle, and height of the rack [m].
SPACING, DISTANCE, RACK_HEIGHT = 14e-3, 26e-3, 12e-3


@dataclass(frozen=True, eq=False)
class Recognised:
    """The contact that was recognised at one tick."""

    force: ForceResult  #: its force and position
    shape: ShapeResult  #: shape and pose of the punch


class Arms(Protocol):
    """Arms with position targets, and recognition of the contact."""

    targets: Array  #: position target of each arm [m], (arms, 3)
    period: float  #: time between ticks [s]

    @property
    def ticks(self) -> int:
        """Number of ticks so far."""
        ...

    def tick(self, arm: int, commanded: Array | None = None) -> Recognised | None:
        """Advance one period and return the recognised contact; None without contact.

        For the log: index of the moving arm, and its commanded force on the pad [N], (3,).
        """
        ...


def home(arm: int) -> Array:
    """Position of an arm in the rack, pad frame [m], shape (3,)."""
    return np.array([(arm - (len(INDENTER_NAMES) - 1) / 2) * SPACING, DISTANCE, RACK_HEIGHT])


def bin_place(k: int) -> Array:
    """Position of the bin of the k-th shape of `INDENTER_NAMES`, pad frame [m], shape (3,)."""
    return np.array([(k - (len(INDENTER_NAMES) - 1) / 2) * SPACING, -DISTANCE, 2e-3])
