"""Recognition of the force and torsional moment of a grasped body whose face covers the pad.

It is trained for held objects: faces larger than the pad, forces up to tens of newtons, shear and torsion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjtactile._types import Array
from mjtactile.recognition.familiarity import Familiarity
from mjtactile.recognition.wrench import EstimatedWrenches, WrenchRecogniser

#: Number of estimated values: tangential over pressing force (2), centre of pressure (2) [m], torsional moment over
#: pressing force [m], logarithm of the pressing force over the readings' size.
GRASP_OUTPUTS = 6


@dataclass(frozen=True, eq=False)
class GraspResult:
    """Load on a pad in the pad frame, with the batch axes of the readings.

    Attributes:
        force: on the pad [N], (..., 3); pressing is -z.
        centre: centre of pressure (x, y) [m], (..., 2).
        torsion: torsional moment, about the pad's normal through the centre of pressure [N m], (...).
        ratio_deviation: standard deviation of the ratio of tangential to pressing force [-], (...).
        pressing_deviation: relative standard deviation of the pressing force [-], (...).
        familiarity: whether the readings look like those of faces that cover the pad, and how far they are from them;
            None if the weights do not say: they have no module "familiarity".
    """

    force: Array
    centre: Array
    torsion: Array
    ratio_deviation: Array
    pressing_deviation: Array
    familiarity: Familiarity | None = None

    @property
    def pressing(self) -> Array:
        """Pressing force, the component into the pad [N], (...)."""
        return -self.force[..., 2]

    @property
    def tangential(self) -> Array:
        """Magnitude of the tangential force [N], (...)."""
        return np.hypot(self.force[..., 0], self.force[..., 1])


class GraspRecogniser(WrenchRecogniser[GraspResult]):
    """Recognises force and torsional moment of a grasp from readings; `recognition.load("grasp")` makes one."""

    name = "grasp"

    def result(self, found: EstimatedWrenches, batch: tuple[int, ...]) -> GraspResult:
        """Convert estimated wrenches to a result with the batch axes of the readings."""
        assert found.torsion is not None
        return GraspResult(
            found.force.reshape(*batch, 3),
            found.position.reshape(*batch, 2),
            found.torsion.reshape(batch),
            found.ratio_deviation.reshape(batch),
            found.pressing_deviation.reshape(batch),
            found.familiarity,
        )


def grasp_targets(wrenches: Array) -> Array:
    """Training targets of a grasp recogniser, (n, 6): the values of `GRASP_OUTPUTS`.

    The last value is the logarithm of the pressing force alone. The logarithm of the readings' size remains to be
    subtracted from it.

    Args:
        wrenches: wrenches on the pad in the pad frame [N, N m], (n, 6); all press (force z < 0).
    """
    force, moment = wrenches[:, :3], wrenches[:, 3:]
    pressing = -force[:, 2]
    centre = np.column_stack([-moment[:, 1], moment[:, 0]]) / force[:, 2:3]
    torsion = moment[:, 2] - (centre[:, 0] * force[:, 1] - centre[:, 1] * force[:, 0])
    return np.column_stack([force[:, :2] / pressing[:, None], centre, torsion / pressing, np.log(pressing)])
