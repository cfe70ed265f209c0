"""All that a controller of the loop knows: what was recognised, where racks and bins are, how stiff its arms are."""

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
    """What was recognised at one tick."""

    force: ForceResult
    shape: ShapeResult


class Arms(Protocol):
    """Arms that go where they are told, and what is felt meanwhile.

    Attributes:
        targets: of each arm, (arms, 3) [m].
        period: between ticks [s].
    """

    targets: Array
    period: float

    @property
    def ticks(self) -> int:
        """How many there were."""
        ...

    def tick(self, arm: int, commanded: Array | None = None) -> Recognised | None:
        """Let the arms go to their targets for one period, and feel; None where nothing presses."""
        ...


def home(arm: int) -> Array:
    """Where an arm's axis stands in the rack [m], shape (3,)."""
    return np.array([(arm - (len(INDENTER_NAMES) - 1) / 2) * SPACING, DISTANCE, RACK_HEIGHT])


def bin_place(k: int) -> Array:
    """Where the bin of the k-th shape stands [m], shape (3,)."""
    return np.array([(k - (len(INDENTER_NAMES) - 1) / 2) * SPACING, -DISTANCE, 2e-3])
