"""With what force and twist a grasped body bears on a pad, whose face covers the pad.

As `force.py`, for what hands hold: faces larger than the pad, pressed by up to tens of newtons, pulled and twisted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.wrench import EstimatedWrenches, WrenchRecogniser

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


class GraspRecogniser(WrenchRecogniser[GraspResult]):
    """Readings to force and twist; make one with `recognition.load("grasp")`."""

    name = "grasp"

    def result(self, found: EstimatedWrenches, batch: tuple[int, ...]) -> GraspResult:
        """See WrenchRecogniser."""
        assert found.twist is not None
        return GraspResult(
            found.force.reshape(*batch, 3),
            found.position.reshape(*batch, 2),
            found.twist.reshape(batch),
            found.ratio_deviation.reshape(batch),
            found.pressing_deviation.reshape(batch),
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
