"""With what force and twist a grasped body bears on a pad, whose face covers the pad.

As `force.py`, for what hands hold: faces larger than the pad, pressed by up to tens of newtons, pulled and twisted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.estimator import Estimator
from mjtactile.recognition.features import PrincipalComponents
from mjtactile.recognition.weight_files import Stored

#: What is recognised, besides the deviations: tangential over pressing force (2), centre of pressure (2) [m], twist
#: over pressing force [m], logarithm of pressing force over the readings' size.
GRASP_OUTPUTS = 6


@dataclass(frozen=True, eq=False)
class GraspResult:
    """What bears on a pad, pad frame; batch axes as those of the readings.

    Attributes:
        force: on the pad, (..., 3) [N]; pressing is -z.
        centre: of pressure, (..., 2) [m].
        twist: moment about the pad's normal through the centre of pressure, (...) [N m].
        force_deviation: standard deviation of the force's tangential part, over the pressing force [-].
        magnitude_deviation: standard deviation of the pressing force, relative [-].
    """

    force: Array
    centre: Array
    twist: Array
    force_deviation: Array
    magnitude_deviation: Array

    @property
    def pressing(self) -> Array:
        """Force into the pad (...) [N]."""
        return -self.force[..., 2]

    @property
    def tangential(self) -> Array:
        """Force along the pad (...) [N]."""
        return np.hypot(self.force[..., 0], self.force[..., 1])


@dataclass(frozen=True, eq=False)
class GraspRecogniser:
    """Readings to force and twist; make one with `recognition.load("grasp")`.

    Attributes:
        view: what is looked at.
        estimator: of tangential over pressing force (2), centre of pressure (2) [m], twist over pressing force [m] and
            the logarithm of the pressing force over the readings' size.
    """

    view: PrincipalComponents
    estimator: Estimator

    @classmethod
    def from_stored(cls, view: PrincipalComponents, stored: Stored) -> GraspRecogniser:
        """The recogniser in a file of weights."""
        return cls(view, Estimator.from_arrays(stored.arrays, "grasp"))

    def __call__(self, readings: np.ndarray) -> GraspResult:
        """Recognise.

        Args:
            readings: (..., layers, rows, columns) [Pa] of the pad the weights belong to.

        Raises:
            RecognitionError: for another shape, NaN, or where nothing presses.
        """
        flat, batch = self.view.checked(readings)
        seen = self.view.see(flat)
        values, deviations = self.estimator(seen.features)
        pressing = np.exp(values[:, 5]) * seen.size
        ratio = seen.mirrors.original(values[:, :2])
        # A twist turns round in every mirror.
        flips = seen.mirrors.x ^ seen.mirrors.y ^ seen.mirrors.swapped
        twist = np.where(flips, -1.0, 1.0) * values[:, 4] * pressing
        return GraspResult(
            np.column_stack([ratio * pressing[:, None], -pressing]).reshape(*batch, 3),
            seen.mirrors.original(values[:, 2:4]).reshape(*batch, 2),
            twist.reshape(batch),
            np.sqrt((deviations[:, :2] ** 2).sum(axis=1)).reshape(batch),
            deviations[:, 5].reshape(batch),
        )


def grasp_targets(wrenches: Array) -> Array:
    """What a recogniser is to say of wrenches (n, 6) on a pad: (n, 6), the last without the readings' size.

    Args:
        wrenches: [N, N m], about the pad frame's origin; all press, so that force z < 0.
    """
    force, moment = wrenches[:, :3], wrenches[:, 3:]
    pressing = -force[:, 2]
    centre = np.column_stack([-moment[:, 1], moment[:, 0]]) / force[:, 2:3]
    twist = moment[:, 2] - (centre[:, 0] * force[:, 1] - centre[:, 1] * force[:, 0])
    return np.column_stack([force[:, :2] / pressing[:, None], centre, twist / pressing, np.log(pressing)])
