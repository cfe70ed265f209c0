"""The interface of controllers in the grasp experiments: loads on the pads, and the robot's own state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mjtactile._types import Array

#: Sign of each pad's x axis along the gripper's y axis, and of its y axis along the gripper's z axis, (pads, 2); see
#: hands/gripper.py.
_ALONG = np.array([[1.0, 1.0], [-1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class PadLoads:
    """Loads on the pads in their pad frames; zeros without contact."""

    pressing: Array  #: force into the pad [N], (pads,)
    tangential: Array  #: force along the pad's x and y [N], (pads, 2)
    centre: Array  #: centre of pressure (x, y) [m], (pads, 2)
    torsion: Array  #: moment about the pad's normal through the centre of pressure [N m], (pads,)
    #: Readings with noise [Pa], (pads, layers, rows, columns); None if the pads were not read.
    readings: Array | None = None

    @property
    def pull(self) -> Array:
        """Sum of the tangential forces on the pads along y and z of the gripper's frame [N], shape (2,).

        It is the force on the pads, so z is negative under a weight.
        """
        return (self.tangential * _ALONG).sum(axis=0)

    @property
    def turn(self) -> float:
        """Sum of the moments on the pads about the line between their centres [N m]."""
        x, y = self.centre.T
        about_middle = self.torsion + x * self.tangential[:, 1] - y * self.tangential[:, 0]
        return float((about_middle * _ALONG[:, 0]).sum())

    @property
    def both(self) -> bool:
        """Whether all pads are in contact."""
        return bool((self.pressing > 0.0).all())


class Arm(Protocol):
    """A gripper and its wrist, with commands and loads at each tick."""

    grip: float  #: commanded force of each finger [N]
    place: dict[str, float]  #: commanded displacement of the wrist by driven axis [m]
    felt: PadLoads  #: loads on the pads at the last tick

    @property
    def period(self) -> float:
        """Time between ticks [s]."""
        ...

    @property
    def time(self) -> float:
        """Simulated time since the beginning [s]."""
        ...

    def tick(self) -> PadLoads:
        """Advance one period with the present commands and return the loads on the pads."""
        ...

    def move(self, axis: str, by: float, *, speed: float) -> PadLoads:
        """Move an axis for one tick at a speed [m/s], but by no more than `by` [m], and return the loads."""
        ...
