"""All that a controller of the grasp experiments knows: what is felt, and what a robot knows of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mjtactile._types import Array

#: Signs by which the pads' axes along them, x and y, make up the gripper's y and z; see hands/gripper.py.
_ALONG = np.array([[1.0, 1.0], [-1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class PadLoads:
    """What bears on each pad, pad frames; zeros where nothing does.

    Attributes:
        pressing: into the pad, (pads,) [N].
        tangential: along the pad, x and y, (pads, 2) [N].
        centre: of pressure, (pads, 2) [m].
        twist: moment about the pad's normal through the centre of pressure, (pads,) [N m].
        readings: (pads, layers, rows, columns) [Pa], with noise; None where they were not looked at.
    """

    pressing: Array
    tangential: Array
    centre: Array
    twist: Array
    readings: Array | None = None

    @property
    def pull(self) -> Array:
        """What both fingers hold together by friction: along y and upwards [N], in the gripper's frame, shape (2,).

        The sign is that of the force on the pads: a weight pulls them down.
        """
        return (self.tangential * _ALONG).sum(axis=0)

    @property
    def turn(self) -> float:
        """Moment about the line between the pads' middles that both fingers hold together [N m]."""
        x, y = self.centre.T
        about_middle = self.twist + x * self.tangential[:, 1] - y * self.tangential[:, 0]
        return float((about_middle * _ALONG[:, 0]).sum())

    @property
    def both(self) -> bool:
        """Whether all pads are touched."""
        return bool((self.pressing > 0.0).all())


class Arm(Protocol):
    """A gripper and its wrist, commanded from tick to tick.

    Attributes:
        grip: commanded force of each finger [N].
        place: commanded displacement of the wrist by driven axis [m].
        felt: what was felt last.
    """

    grip: float
    place: dict[str, float]
    felt: PadLoads

    @property
    def period(self) -> float:
        """Between ticks [s]."""
        ...

    @property
    def time(self) -> float:
        """Since the beginning [s]."""
        ...

    def tick(self) -> PadLoads:
        """Let a period pass with the commands as they are, and feel."""
        ...

    def move(self, axis: str, by: float, *, speed: float) -> PadLoads:
        """Drive an axis at a speed for one tick, no further than `by` [m] from where it is commanded to be."""
        ...
